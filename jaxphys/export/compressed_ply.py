"""Gaussians as compressed .ply files, 16 bytes each and one a coefficient of the harmonics.

The layout is that of PlayCanvas' SuperSplat and splat-transform (their `compressed-chunk.ts`,
`write-compressed-ply.ts` and `decompress-ply.ts`): binary little endian, an element `chunk` for
each 256 Gaussians with the range of their centres, logarithms of scales and colours as float32, an
element `vertex` of four words with places within these ranges, and an element `sh`.

    packed_position, packed_scale   11, 10 and 11 bits of x, y, z
    packed_rotation                 which of w, x, y, z is the largest (2 bits), the others 10 each
    packed_color                    red, green, blue within the range, and opacity, 8 bits each
    f_rest_*                        8 bits over [-4, 4], all of red first
"""

import os
from collections.abc import Callable
from pathlib import Path
from typing import BinaryIO

import jax.numpy as jnp
import numpy as np

from jaxphys.core.errors import InputError
from jaxphys.core.fields import LARGEST
from jaxphys.core.files import atomic_path
from jaxphys.core.reading import reading
from jaxphys.export.frames import Plain, plain
from jaxphys.gaussians.gaussians import LOGIT_LIMIT, Gaussians
from jaxphys.gaussians.harmonics import DC
from jaxphys.gaussians.ply import Element, read_header

CHUNK = 256
SCALE_LIMIT = 20.0  # of logarithms
_HALF = 0.5**0.5
# Which components are kept, by the one that is not.
_OTHERS = np.array([[1, 2, 3], [0, 2, 3], [0, 1, 3], [0, 1, 2]])
_RANGES = [
    f"{end}_{name}" for names in ("x y z", "scale_x scale_y scale_z", "r g b")
    for end in ("min", "max") for name in names.split()
]  # fmt: skip
_WORDS = ["packed_position", "packed_rotation", "packed_scale", "packed_color"]
_RESTS = (9, 24, 45)
_MOST = 20_000_000


def spatial_order(means: np.ndarray) -> np.ndarray:
    """Indices (N,) that put neighbours together, along Morton's curve through 1024^3 cells, so that
    the range of a chunk is small.
    """
    low = means.min(axis=0)
    extent = max(float(np.ptp(means, axis=0).max()), np.finfo(float).tiny)
    code = np.zeros(len(means), np.uint64)
    for axis in range(3):
        bits = np.clip((means[:, axis] - low[axis]) / extent * 1023, 0, 1023).astype(np.uint64)
        for bit in range(10):
            code |= ((bits >> np.uint64(bit)) & np.uint64(1)) << np.uint64(3 * bit + axis)
    return np.argsort(code, kind="stable")


def write_compressed_ply(
    path: str | os.PathLike, gaussians: Gaussians, *, order: np.ndarray | None = None
) -> None:
    """Writes `gaussians` to `path`, whole or not at all; equal values give equal bytes.

    Args:
        path: the file.
        gaussians: N of them.
        order: in which they are written (N,); None: `spatial_order` of their centres.

    Raises:
        InputError: there are none, or a value is not finite or too large.
    """
    given = plain(gaussians, str(path))
    order = spatial_order(given.means) if order is None else order
    values = Plain(*(part[order] for part in given))
    ranges, words = _packed(values)
    count, rest = len(order), values.harmonics[:, 1:].transpose(0, 2, 1).reshape(len(order), -1)
    header = ["ply", "format binary_little_endian 1.0", f"element chunk {len(ranges)}"]
    header += [f"property float {name}" for name in _RANGES]
    header += [f"element vertex {count}", *(f"property uint {name}" for name in _WORDS)]
    if rest.shape[1]:
        header += [f"element sh {count}"]
        header += [f"property uchar f_rest_{i}" for i in range(rest.shape[1])]
    header += ["end_header", ""]
    with atomic_path(path) as aside, open(aside, "wb") as file:
        file.write("\n".join(header).encode())
        file.write(ranges.tobytes())
        file.write(words.tobytes())
        file.write(np.clip(np.floor((rest / 8 + 0.5) * 256), 0, 255).astype(np.uint8).tobytes())


def compressed_ply_writer() -> Callable[[Path, Gaussians], None]:
    """A writer of the frames of one motion: all in the order of the first one, so that the same
    Gaussian stands at the same place of every file.
    """
    order: np.ndarray | None = None

    def write(path: Path, gaussians: Gaussians) -> None:
        nonlocal order
        if order is None or len(order) != gaussians.count:
            order = spatial_order(plain(gaussians, str(path)).means)
        write_compressed_ply(path, gaussians, order=order)

    return write


def _packed(values: Plain) -> tuple[np.ndarray, np.ndarray]:
    """The table of chunks float32 (C, 18), and the words uint32 (N, 4)."""
    scaled = np.clip(values.log_scales, -SCALE_LIMIT, SCALE_LIMIT)
    parts = [values.means, scaled, values.harmonics[:, 0] * DC + 0.5]
    starts = np.arange(0, len(values.means), CHUNK)
    chunk = np.arange(len(values.means)) // CHUNK
    ranges, places = [], []
    for part in parts:
        low = np.minimum.reduceat(part, starts).astype("<f4")
        high = np.maximum.reduceat(part, starts).astype("<f4")
        ranges += [low, high]
        extent = np.float64(high) - low
        places.append((part - low[chunk]) / np.where(extent > 0, extent, 1)[chunk])
    position, scale, colour = places
    words = [
        _join(position, (11, 10, 11)),
        _packed_rotations(values.quaternions),
        _join(scale, (11, 10, 11)),
        _join(np.concatenate([colour, values.opacities[:, None]], axis=1), (8, 8, 8, 8)),
    ]
    return np.concatenate(ranges, axis=1), np.stack(words, axis=1).astype("<u4")


def _join(places: np.ndarray, bits: tuple[int, ...]) -> np.ndarray:
    """Words (N,) of numbers in [0, 1] (N, B), each with so many bits, the first one on top."""
    word = np.zeros(len(places), np.uint32)
    for column, width in enumerate(bits):
        most = 2**width - 1
        level = np.clip(np.floor(places[:, column] * most + 0.5), 0, most).astype(np.uint32)
        word = (word << np.uint32(width)) | level
    return word


def _part(word: np.ndarray, bits: tuple[int, ...]) -> np.ndarray:
    """What `_join` put together, (N, B)."""
    parts = []
    for width in reversed(bits):
        most = np.uint32(2**width - 1)
        parts.append((word & most) / float(most))
        word = word >> np.uint32(width)
    return np.stack(parts[::-1], axis=1)


def _packed_rotations(quaternions: np.ndarray) -> np.ndarray:
    largest = np.argmax(np.abs(quaternions), axis=1)
    top = np.take_along_axis(quaternions, largest[:, None], axis=1)
    others = np.take_along_axis(quaternions, _OTHERS[largest], axis=1) * np.where(top < 0, -1, 1)
    return (largest.astype(np.uint32) << np.uint32(30)) | _join(others * _HALF + 0.5, (10, 10, 10))


def _unpacked_rotations(word: np.ndarray) -> np.ndarray:
    largest = (word >> np.uint32(30)).astype(int)
    others = (_part(word, (10, 10, 10)) - 0.5) / _HALF
    top = np.sqrt(np.maximum(0, 1 - np.sum(others**2, axis=1)))
    quaternions = np.empty((len(word), 4))
    np.put_along_axis(quaternions, _OTHERS[largest], others, axis=1)
    np.put_along_axis(quaternions, largest[:, None], top[:, None], axis=1)
    return quaternions


def is_compressed_ply(path: str | os.PathLike) -> bool:
    """Whether a file that can be read begins like a compressed .ply."""
    with reading(path) as path, open(path, "rb") as file:
        return b"packed_position" in file.read(4096)


def read_compressed_ply(path: str | os.PathLike) -> Gaussians:
    """Gaussians from a compressed .ply, float32; colours without a range are taken as [0, 1].

    Raises:
        InputError: the file is missing, cut off, of another layout, or holds ranges that are not
            finite.
    """
    with reading(path) as path:
        with open(path, "rb") as file:
            style, elements = read_header(file, path)
            if style != "binary_little_endian":
                raise InputError("a compressed .ply must be binary_little_endian; export it again")
            tables = _tables(file, elements)
        return _gaussians(*tables)


def _tables(file: BinaryIO, elements: list[Element]) -> tuple[dict, dict, dict]:
    """Columns of the chunks, the words and the harmonics by name."""
    known = {element.name: element for element in elements}
    names = [element.name for element in elements]
    if names not in (["chunk", "vertex"], ["chunk", "vertex", "sh"]) or any(
        element.has_list for element in elements
    ):
        raise InputError("is no compressed .ply of elements chunk, vertex and sh; export it again")
    chunk, vertex, sh = (known.get(name) for name in ("chunk", "vertex", "sh"))
    assert chunk is not None and vertex is not None
    fields = [
        (chunk, [_RANGES, _RANGES[:12]], "f4"),
        (vertex, [_WORDS], "u4"),
        (sh, [[f"f_rest_{i}" for i in range(n)] for n in _RESTS], "u1"),
    ]
    for element, layouts, kind in fields:
        if element is not None and (
            {kind} != {of for _, of in element.properties}
            or not any(dict(element.properties).keys() == set(names) for names in layouts)
        ):
            raise InputError(f"its element '{element.name}' has other fields; export it again")
    if chunk.count != -(-vertex.count // CHUNK) or (sh is not None and sh.count != vertex.count):
        raise InputError(
            f"{vertex.count} Gaussians do not go with {chunk.count} chunks of {CHUNK}"
            + ("" if sh is None else f" and {sh.count} rows of harmonics")
            + "; export it again"
        )
    if not 0 < vertex.count <= _MOST:
        raise InputError(f"holds {vertex.count} Gaussians, expected 1 to {_MOST}")
    types = [element.dtype("<") for element in elements]
    wanted = sum(e.count * t.itemsize for e, t in zip(elements, types, strict=True))
    there = os.fstat(file.fileno()).st_size - file.tell()
    if there != wanted:
        what = "cut off" if there < wanted else "longer than its header says"
        raise InputError(f"{what}: {there} bytes of {wanted}; copy the file again")
    tables = []
    for element, dtype in zip(elements, types, strict=True):
        rows = np.frombuffer(file.read(element.count * dtype.itemsize), dtype)
        tables.append({name: rows[name] for name, _ in element.properties})
    return tables[0], tables[1], tables[2] if sh is not None else {}


def _gaussians(ranges: dict, words: dict, rest: dict) -> Gaussians:
    for name, column in ranges.items():
        if not (np.abs(column) <= LARGEST).all():
            raise InputError(f"field '{name}' is not finite, or beyond {LARGEST:g}; clean it up")
    count = len(words["packed_position"])
    chunk = np.arange(count) // CHUNK

    def within(places: np.ndarray, names: list[str]) -> np.ndarray:
        low, high = (
            np.stack([ranges[name] for name in part], axis=1)[chunk]
            for part in (names[:3], names[3:])
        )
        return low * (1 - places) + high * places

    means = within(_part(words["packed_position"], (11, 10, 11)), _RANGES[:6])
    log_scales = within(_part(words["packed_scale"], (11, 10, 11)), _RANGES[6:12])
    rgba = _part(words["packed_color"], (8, 8, 8, 8))
    rgb = within(rgba[:, :3], _RANGES[12:]) if "min_r" in ranges else rgba[:, :3]
    with np.errstate(divide="ignore"):
        logits = np.log(rgba[:, 3]) - np.log(1 - rgba[:, 3])
    harmonics = [((rgb - 0.5) / DC)[:, None]]
    if rest:
        levels = np.stack([rest[f"f_rest_{i}"] for i in range(len(rest))], axis=1).astype(float)
        places = np.where(levels == 0, 0, np.where(levels == 255, 1, (levels + 0.5) / 256))
        harmonics.append((8 * (places - 0.5)).reshape(count, 3, -1).transpose(0, 2, 1))
    return Gaussians(
        *(
            jnp.asarray(part, jnp.float32)
            for part in (
                means,
                log_scales,
                _unpacked_rotations(words["packed_rotation"]),
                np.clip(logits, -LOGIT_LIMIT, LOGIT_LIMIT),
                np.concatenate(harmonics, axis=1),
            )
        )
    )
