"""CLIP's word pieces: lower case, byte-level byte-pair encoding (Sennrich et al. 2016; Radford et
al. 2021) with a mark at the end of every word.
"""

from collections.abc import Sequence
from pathlib import Path

import numpy as np
from tokenizers import AddedToken, Regex, Tokenizer, models, normalizers, pre_tokenizers

from jaxphys.core.errors import InputError, shown
from jaxphys.core.files import read_json
from jaxphys.core.reading import reading

START, END = "<|startoftext|>", "<|endoftext|>"
LENGTH = 77
MOST_PIECES = 10_000_000
# Marks, English contractions, runs of letters, single digits, runs of anything else.
WORDS = (
    r"<\|startoftext\|>|<\|endoftext\|>|'s|'t|'re|'ve|'m|'ll|'d"
    r"|[\p{L}]+|[\p{N}]|[^\s\p{L}\p{N}]+"
)


class ClipTokenizer:
    """Call it with texts: -> (B, 77) int32, each row start mark, pieces, end mark, padding. Of a
    longer text only the first 75 pieces are kept.

    Args:
        folder: holds vocab.json and merges.txt, or tokenizer.json; and, unless the padding is the
            end mark, special_tokens_map.json or tokenizer_config.json that names it.

    Attributes:
        size: ids are below it.

    Raises:
        InputError: a file is missing or damaged, or a mark is not in the vocabulary.
    """

    def __init__(self, folder: str | Path, length: int = LENGTH):
        folder = Path(folder)
        vocabulary, merges, source = _pieces(folder)
        marks = {
            "bos_token": AddedToken(START, special=True),
            "eos_token": AddedToken(END, special=True),
            "pad_token": AddedToken(END, special=True),
        } | _named_marks(folder)
        for name, mark in marks.items():
            if mark.content not in vocabulary:
                raise InputError(f"{source}: {mark.content!r}, the {name}, is not in it")
        wrong = [
            id for id in vocabulary.values() if type(id) is not int or not 0 <= id < MOST_PIECES
        ]
        if wrong:
            raise InputError(f"{source}: is damaged: a piece has the number {shown(wrong[0])}")
        try:
            model = models.BPE(vocabulary, merges, end_of_word_suffix="</w>", unk_token=END)
        except Exception as error:  # the library raises nothing narrower
            raise InputError(f"{source}: is damaged: {error}") from None
        self._tokenizer = Tokenizer(model)
        self._tokenizer.normalizer = normalizers.Sequence(
            [normalizers.NFC(), normalizers.Lowercase()]
        )
        self._tokenizer.pre_tokenizer = pre_tokenizers.Sequence(
            [
                pre_tokenizers.Split(Regex(WORDS), behavior="removed", invert=True),
                pre_tokenizers.ByteLevel(add_prefix_space=False),
            ]
        )
        # A mark is one piece wherever it stands: with "!" as padding, "!!" is twice that piece and
        # not the one of "!!". So it is in the pipelines that these folders are published for.
        self._tokenizer.add_special_tokens(list(marks.values()))
        self._start, self._end, self._padding = (
            vocabulary[marks[name].content] for name in ("bos_token", "eos_token", "pad_token")
        )
        self._length = length
        self.size = max(vocabulary.values()) + 1

    def __call__(self, texts: Sequence[str]) -> np.ndarray:
        if isinstance(texts, str) or not all(isinstance(text, str) for text in texts):
            raise InputError("CLIP tokenizer: give a list of strings")
        ids = np.full((len(texts), self._length), self._padding, np.int32)
        for row, text in zip(ids, texts, strict=True):
            pieces = self._tokenizer.encode(text, add_special_tokens=False).ids
            pieces = [self._start, *pieces[: self._length - 2], self._end]
            row[: len(pieces)] = pieces
        return ids


def _pieces(folder: Path) -> tuple[dict[str, int], list[tuple[str, str]], Path]:
    """The vocabulary, the merges in order, and the file that they are from."""
    plain, whole = folder / "vocab.json", folder / "tokenizer.json"
    if plain.exists():
        vocabulary, source = read_json(plain), plain
        merges = folder / "merges.txt"
        if not merges.is_file():
            raise InputError(f"{merges}: is missing; it belongs beside vocab.json")
        with reading(merges):
            try:
                lines = merges.read_text(encoding="utf-8").split("\n")
            except ValueError as error:
                raise InputError(f"{merges}: is damaged: {error}") from None
        pairs = [line for line in lines[lines[0].startswith("#version") :] if line]
    elif whole.exists():
        model, source = read_json(whole).get("model"), whole
        parts = model if isinstance(model, dict) else {}
        entries, merged = parts.get("vocab"), parts.get("merges")
        if not isinstance(entries, dict) or not isinstance(merged, list):
            raise InputError(f"{whole}: model: holds no vocab and merges; get the file again")
        vocabulary, pairs = entries, merged
    else:
        raise InputError(
            f"{folder}: holds neither vocab.json and merges.txt nor tokenizer.json;"
            " copy the model's tokenizer there"
        )
    split = [pair.split(" ") if isinstance(pair, str) else pair for pair in pairs]
    if not all(isinstance(pair, list) and len(pair) == 2 for pair in split):
        raise InputError(f"{folder}: a merge is not of two pieces; get the tokenizer again")
    return vocabulary, [(first, second) for first, second in split], source


def _named_marks(folder: Path) -> dict[str, AddedToken]:
    """The marks that the folder names; special_tokens_map.json has the last word."""
    marks = {}
    for name in ("tokenizer_config.json", "special_tokens_map.json"):
        path = folder / name
        values = read_json(path) if path.exists() else {}
        for key in ("bos_token", "eos_token", "pad_token"):
            entry = values.get(key)
            if isinstance(entry, str):
                marks[key] = AddedToken(entry, special=True)
            elif isinstance(entry, dict) and isinstance(entry.get("content"), str):
                flags = ("single_word", "lstrip", "rstrip", "normalized")
                given = {flag: entry[flag] for flag in flags if flag in entry}
                marks[key] = AddedToken(entry["content"], special=True, **given)
            elif entry is not None:
                raise InputError(f"{path}: {key}: expected a string, found {shown(entry)}")
    return marks
