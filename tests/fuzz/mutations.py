"""Small changes to valid files that a careless program, a bad disk or an enemy would make."""

import copy
import json
import re
import struct
from random import Random
from typing import Any

NUMBERS = (
    "0", "-1", "1", "2", "-0.0", "0.5", "1e5", "1e155", "-1e155", "1e308", "1e309", "-1e999",
    "5e-324", "1e-30", "1e15", "1e16", "1e18", "3.5e38", "nan", "inf", "-inf", "NaN", "2147483648",
    "4294967295", "18446744073709551616", "9" * 400, "9" * 5000, "0x10", "1_000", "",
)  # fmt: skip
WORDS = (
    "", "x", "\x1b[31mred\x1b[0m", "a\nb", "\0", "../..", "é", "\ud800", "null", "x" * 3000,
    "float", "list", "vertex", "end_header", "jelly", "1", "/dev/zero",
)  # fmt: skip
VALUES = (
    None, True, False, 0, -1, 1, 2, 1.5, -0.0, 1e155, -1e155, 1e308, 5e-324, 1e-30, 1e15, 1e16,
    2**31, 2**63, 2**64, 10**30, 10**310, "x", "\x1b[31mred\x1b[0m", "\0", "a\ud800", "é" * 2000,
    [], {}, [0, 0, 0], [1e300, 1, 1], [None], {"type": "box"}, {"type": 1}, [[[[]]]],
    float("nan"), float("inf"),
)  # fmt: skip
SPECIAL = tuple(
    struct.pack(kind, value)
    for kind, values in {
        "<f": (float("nan"), float("inf"), -1e38, 1e38, 1e20, 1e-40, 0.0, 100.0),
        "<d": (float("nan"), 1e155, 1e308, 5e-324),
        "<I": (0, 1, 2, 40, 2**31, 2**32 - 1),
        "<Q": (0, 1, 2**31, 2**62, 2**63, 2**64 - 1),
        "<B": (0, 1, 0x7F, 0x80, 0xFF),
    }.items()
    for value in values
)


def mutated_bytes(data: bytes, random: Random) -> bytes:
    """Some bytes flipped, replaced, left out, said twice or cut off."""
    data = bytearray(data)
    for _ in range(random.choice((1, 1, 1, 2, 3, 8))):
        at = random.randrange(len(data) + 1)
        span = random.choice((1, 2, 4, 8, 16, 64))
        match random.randrange(6):
            case 0 if at < len(data):
                data[at] ^= 1 << random.randrange(8)
            case 1 | 2:
                special = random.choice(SPECIAL)
                data[at : at + len(special)] = special
            case 3:
                del data[at : at + span]
            case 4:
                data[at:at] = data[at : at + span]
            case _ if random.randrange(4) == 0:
                del data[at:]
    return bytes(data)


def mutated_text(text: str, random: Random) -> str:
    """Some words replaced by nasty ones, or lines left out, repeated, swapped or cut."""
    lines = text.split("\n")
    for _ in range(random.choice((1, 1, 2, 4))):
        at = random.randrange(len(lines))
        words = lines[at].split(" ")
        word = random.randrange(len(words))
        match random.randrange(8):
            case 0 | 1 | 2:
                words[word] = random.choice(NUMBERS)
            case 3:
                words[word] = random.choice(WORDS)
            case 4:
                del words[word:]
            case 5:
                words.insert(word, random.choice(NUMBERS))
            case 6:
                lines[at], lines[0] = lines[0], lines[at]
                continue
            case 7:
                lines.insert(at, lines[at])
                continue
        lines[at] = " ".join(words)
    return "\n".join(lines)


def mutated_json(value: Any, random: Random) -> Any:
    """A copy with some part replaced, removed, renamed or added."""
    value = copy.deepcopy(value)
    for _ in range(random.choice((1, 1, 1, 2, 3))):
        places = list(_places(value))
        if not places:
            break
        parent, key = random.choice(places)
        match random.randrange(8):
            case 0 if isinstance(parent, dict):
                del parent[key]
            case 1 if isinstance(parent, dict):
                parent[random.choice(WORDS)] = parent.pop(key)
            case 2 if isinstance(parent, list):
                parent.append(copy.deepcopy(parent[key]))
            case 3 if type(parent[key]) in (int, float):
                factor = random.choice((0, -1, 1e-9, 1e9, 1e30, 1 + 1e-9, 3))
                parent[key] = parent[key] * factor
            case _:
                parent[key] = copy.deepcopy(random.choice(VALUES))
    return value


def _places(value: Any):
    keys = value if isinstance(value, dict) else range(len(value)) if type(value) is list else ()
    for key in keys:
        yield value, key
        yield from _places(value[key])


def json_bytes(value: Any, random: Random) -> bytes:
    """`value` mutated as text of JSON, and now and then that text too."""
    text = json.dumps(mutated_json(value, random))
    match random.randrange(12):
        case 0:
            wanted, count = random.choice(NUMBERS), random.randrange(1, 4)
            text = re.sub(r"\d+(\.\d+)?", wanted, text, count=count)
        case 1:
            depth = random.choice((10, 900, 1200, 100_000))
            text = text.replace("[", "[" * depth, 1).replace("]", "]" * depth, 1)
        case 2:
            return mutated_bytes(text.encode(errors="surrogatepass"), random)
    return text.encode(errors="surrogatepass")


def with_json_header(data: bytes, random: Random) -> bytes:
    """A safetensors file whose header is changed and still has the length that it claims."""
    (length,) = struct.unpack_from("<Q", data)
    header = json_bytes(json.loads(data[8 : 8 + length]), random)
    return struct.pack("<Q", len(header)) + header + data[8 + length :]


def with_gltf_json(data: bytes, random: Random) -> bytes:
    """A .glb whose JSON is changed and still has the lengths that it claims."""
    (length,) = struct.unpack_from("<I", data, 12)
    header = json_bytes(json.loads(data[20 : 20 + length]), random)
    header += b" " * (-len(header) % 4)
    rest = data[20 + length :]
    start = struct.pack("<4sII", b"glTF", 2, 20 + len(header) + len(rest))
    return start + struct.pack("<I4s", len(header), b"JSON") + header + rest
