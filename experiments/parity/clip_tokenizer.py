"""CLIP's tokenizer against that of transformers, and a small one with known ids for the tests.

    python -m experiments.parity.clip_tokenizer bpe_simple_vocab_16e6.txt.gz [--check]

The file is CLIP's own list of merges, as its wheels hold it. Every text is compared with the whole
vocabulary, for each way in which published folders say what they pad with; then
tests/networks/golden/clip_tokenizer.json is written from its first merges (or compared: --check).
"""

import argparse
import gzip
import json
import random
import sys
import tempfile
from pathlib import Path

import numpy as np

from jaxphys.networks.clip_tokenizer import END, START, ClipTokenizer

GOLDEN = Path(__file__).parents[2] / "tests" / "networks" / "golden" / "clip_tokenizer.json"
MERGES, SMALL = 48894, 300
TEXTS = [
    "", " ", "a", "a strawberry", "A Photo of a CAT", "a  double   space", "tabs\tand\nlines\r\n",
    "it's a dog's life, we're here, I've, I'm, you'll, he'd, don't", "IT'S DON'T", "rock'n'roll",
    "crème brûlée", "cre\u0300me bru\u0302le\u0301e", "CRÈME BRÛLÉE", "Ångström", "naïve façade",
    "123", "3.14159", "in 2024, 1958x1090 pixels", "¼ of ½", "x² + y³", "٣ apples", "Ⅷ",
    "🍓", "a 🍓 and a 🍔!", "👩‍🔬 at work", "🇫🇷", "☕️", "hello!!! world! a", "!!!", "!", "a!b",
    "<div>html &amp; entities &lt;b&gt;</div>", "&quot;quoted&quot;", "“curly” ‘quotes’ — dash",
    "日本語のテキスト", "中文", "한국어", "русский ТЕКСТ", "Ελληνικά ΣΊΣΥΦΟΣ", "عربى",
    "हिन्दी", "İstanbul", "ß ẞ ﬁ ﬂ", "ǅ", "\u00a0no\u2003break\u200bspaces\u3000",
    "under_score-and-hyphen", "a.b,c;d:e",
    "http://example.org/a?b=c&d=e", "me@example.org", "#hashtag @mention", "C++ C# F#", "$5.00 €3",
    "<|startoftext|>", "<|endoftext|>", "a <|endoftext|> b", "x<|startoftext|>y", "<|ENDOFTEXT|>",
    "\u0000\u0001 control", "soft\u00adhyphen", "e\u0301\u0301\u0301", "\ufeffmark", "\ud7a3\u1100",
    "photo of an astronaut riding a horse", "a highly detailed stone vase, 8k, unreal engine",
    "the quick brown fox jumps over the lazy dog " * 4, "long" * 100, "word " * 80, "! " * 90,
]  # fmt: skip
ALPHABETS = (
    "abcdefghijklmnopqrstuvwxyz", "ABCXYZ", "0123456789", " ", "  \t\n", ".,;:!?'\"-_()&<>|/\\#",
    "éèêëàâäôöùûüçñÉÈÊÀÔÜÇÑ", "\u0300\u0301\u0302\u0308\u0327", "αβγδПриветмир",
    "你好世界日本語한국", "🍓🍔🎸🦆👩\u200d🔬\ufe0f", "½²³¹ⅧⅨ٣٤", "'s't're've'm'll'd",
)  # fmt: skip


def random_texts(count: int) -> list[str]:
    """Texts of mixed scripts, marks and spaces; the same every time."""
    draw = random.Random(0)
    texts = []
    for _ in range(count):
        runs = [draw.choice(ALPHABETS) for _ in range(draw.randint(1, 12))]
        texts.append("".join("".join(draw.choices(run, k=draw.randint(1, 6))) for run in runs))
    return texts


def pieces(merges: list[str]) -> list[str]:
    """The vocabulary in the order of its ids: bytes as characters, those that end a word, what the
    merges make, the two marks.
    """
    plain = [*range(33, 127), *range(161, 173), *range(174, 256)]
    shifted = [chr(256 + n) for n in range(256 - len(plain))]  # stand for bytes without a glyph
    characters = [*map(chr, plain), *shifted]
    made = [merge.replace(" ", "") for merge in merges]
    return [*characters, *(c + "</w>" for c in characters), *made, START, END]


def write_folder(folder: Path, merges: list[str], files: dict[str, dict]) -> Path:
    """A tokenizer's folder: the vocabulary, the merges and `files` by name."""
    folder.mkdir(parents=True, exist_ok=True)
    vocabulary = {piece: number for number, piece in enumerate(pieces(merges))}
    (folder / "vocab.json").write_text(json.dumps(vocabulary))
    (folder / "merges.txt").write_text("\n".join(["#version: 0.2", *merges, ""]))
    for name, values in files.items():
        (folder / name).write_text(json.dumps(values))
    return folder


def marked(content: str) -> dict:
    """A mark as published folders have it."""
    flags = {"lstrip": False, "normalized": True, "rstrip": False, "single_word": False}
    return {"content": content} | flags


STYLES = {
    "end": {  # Stable Diffusion 1.5, CLIP
        "tokenizer_config.json": {"model_max_length": 77, "pad_token": END},
        "special_tokens_map.json": {
            "bos_token": marked(START), "eos_token": marked(END), "unk_token": marked(END),
            "pad_token": END,
        },
    },
    "exclamation": {  # Stable Diffusion 2.1
        "tokenizer_config.json": {"model_max_length": 77, "pad_token": END},
        "special_tokens_map.json": {
            "bos_token": marked(START), "eos_token": marked(END), "unk_token": marked(END),
            "pad_token": "!",
        },
    },
    "config": {
        "tokenizer_config.json": {
            "model_max_length": 77, "pad_token": {"__type": "AddedToken"} | marked("!"),
        },
    },
    "unnamed": {},
}  # fmt: skip


def original(folder: Path, texts: list[str]) -> np.ndarray:
    """What transformers makes of the texts."""
    from transformers import CLIPTokenizer

    tokenizer = CLIPTokenizer.from_pretrained(folder)
    return np.array(
        tokenizer(texts, padding="max_length", max_length=77, truncation=True)["input_ids"]
    )


def compare(folder: Path, texts: list[str]) -> int:
    """Number of texts whose ids differ, each printed."""
    wanted, found = original(folder, texts), ClipTokenizer(folder)(texts)
    wrong = [i for i in range(len(texts)) if (wanted[i] != found[i]).any()]
    for i in wrong:
        print(f"{folder.name}: {texts[i]!r}\n  {wanted[i][:20]}\n  {found[i][:20]}")
    print(f"{folder.name}: {len(texts) - len(wrong)} of {len(texts)} texts agree")
    return len(wrong)


def main() -> int:
    """Compares, then writes or checks the golden; status 1 where something differs."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("merges", type=Path)
    parser.add_argument("--check", action="store_true", help="write nothing, compare")
    asked = parser.parse_args()
    merges = gzip.decompress(asked.merges.read_bytes()).decode().split("\n")[1 : MERGES + 1]
    texts = TEXTS + random_texts(600)
    wrong = 0
    with tempfile.TemporaryDirectory() as place:
        for style, files in STYLES.items():
            wrong += compare(write_folder(Path(place) / style, merges, files), texts)
        from transformers import CLIPTokenizer

        whole = Path(place) / "tokenizer_json"
        CLIPTokenizer.from_pretrained(Path(place) / "end").save_pretrained(whole)
        assert not (whole / "vocab.json").exists()
        wrong += compare(whole, texts)
        small = {}
        for style in ("end", "exclamation"):
            folder = write_folder(Path(place) / f"small_{style}", merges[:SMALL], STYLES[style])
            small[style] = original(folder, TEXTS).tolist()
    golden = {"merges": merges[:SMALL], "texts": TEXTS, "ids": small}
    text = json.dumps(golden, ensure_ascii=True, separators=(",", ":")) + "\n"
    if not asked.check:
        GOLDEN.write_text(text)
    elif GOLDEN.read_text() != text:
        print(f"{GOLDEN.name} differs from the committed file", file=sys.stderr)
        wrong += 1
    return bool(wrong)


if __name__ == "__main__":
    sys.exit(main())
