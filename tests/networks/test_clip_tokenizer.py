"""CLIP's tokenizer against ids of transformers' own (`experiments/parity/clip_tokenizer.py`)."""

import json
import re
from pathlib import Path

import numpy as np
import pytest

from experiments.parity.clip_tokenizer import STYLES, pieces, write_folder
from jaxphys.core.errors import InputError
from jaxphys.networks.clip_tokenizer import START, ClipTokenizer

GOLDEN = Path(__file__).parent / "golden" / "clip_tokenizer.json"


@pytest.fixture(scope="module")
def golden():
    return json.loads(GOLDEN.read_text())


@pytest.fixture
def folder(tmp_path, golden):
    return write_folder(tmp_path / "tokenizer", golden["merges"], STYLES["end"])


@pytest.mark.parametrize("style", ["end", "exclamation"])
def test_ids_are_those_of_the_original(tmp_path, golden, style):
    folder = write_folder(tmp_path, golden["merges"], STYLES[style])
    ids = ClipTokenizer(folder)(golden["texts"])
    assert ids.dtype == np.int32 and ids.shape == (len(golden["texts"]), 77)
    np.testing.assert_array_equal(ids, golden["ids"][style])


def test_other_padding_is_noticed(folder, golden):
    ids = ClipTokenizer(folder)(golden["texts"])
    differs = (ids != np.array(golden["ids"]["exclamation"])).any(1)
    # All but the texts that fill a row and hold no padding mark.
    assert differs.mean() > 0.9


def test_padding_may_be_named_in_either_file_or_in_none(tmp_path, golden):
    texts = ["a strawberry", "so!!"]
    for style, same_as in (("config", "exclamation"), ("unnamed", "end")):
        found, expected = (
            ClipTokenizer(write_folder(tmp_path / name, golden["merges"], STYLES[name]))(texts)
            for name in (style, same_as)
        )
        np.testing.assert_array_equal(found, expected)


@pytest.mark.parametrize("as_text", [True, False])
def test_one_file_serves_as_well(tmp_path, folder, golden, as_text):
    merges = golden["merges"]
    vocabulary = {piece: number for number, piece in enumerate(pieces(merges))}
    written = merges if as_text else [merge.split(" ") for merge in merges]
    model = {"type": "BPE", "vocab": vocabulary, "merges": written}
    (tmp_path / "tokenizer.json").write_text(json.dumps({"model": model}))
    np.testing.assert_array_equal(
        ClipTokenizer(tmp_path)(golden["texts"]), ClipTokenizer(folder)(golden["texts"])
    )


@pytest.mark.parametrize(
    "model, message",
    [
        (None, "holds no vocab and merges"),
        ({"vocab": {}, "merges": 3}, "holds no vocab and merges"),
        ({"vocab": [], "merges": []}, "holds no vocab and merges"),
        ({"vocab": {}, "merges": [3]}, "a merge is not of two pieces"),
        ({"vocab": {START: "x", "<|endoftext|>": 1}, "merges": []}, "is damaged"),
    ],
)
def test_one_damaged_file_is_named(tmp_path, model, message):
    (tmp_path / "tokenizer.json").write_text(json.dumps({"model": model}))
    with pytest.raises(InputError, match=message):
        ClipTokenizer(tmp_path)


def test_rows_start_and_end_with_their_marks(folder):
    tokenizer = ClipTokenizer(folder)
    start, end = tokenizer.size - 2, tokenizer.size - 1
    empty, long = tokenizer(["", "word " * 200])
    assert list(empty) == [start] + [end] * 76
    assert long[0] == start and long[-1] == end and end not in long[:-1]
    assert tokenizer([]).shape == (0, 77)


def test_one_string_is_refused(folder):
    with pytest.raises(InputError, match="list of strings"):
        ClipTokenizer(folder)("a strawberry")


@pytest.mark.parametrize(
    "name, content, message",
    [
        ("special_tokens_map.json", '{"pad_token": "<no>"}', r"vocab.json: '<no>', the pad_token"),
        ("special_tokens_map.json", '{"pad_token": 3}', r"map.json: pad_token: expected a string"),
        ("tokenizer_config.json", "[]", r"tokenizer_config.json: "),
        ("merges.txt", "#version: 0.2\na b c\n", r"a merge is not of two pieces"),
        ("merges.txt", "#version: 0.2\nnot there\n", r"vocab.json: is damaged: .*not"),
        ("merges.txt", None, r"merges.txt: is missing"),
        ("vocab.json", "{", r"vocab.json: not valid JSON"),
        ("vocab.json", None, r"holds neither vocab.json"),
        ("vocab.json", '{"a": 0}', rf"vocab.json: '{re.escape(START)}', the bos_token, is not"),
    ],
)
def test_files_that_cannot_be_used_are_named(folder, name, content, message):
    (folder / name).unlink()
    if content is not None:
        (folder / name).write_text(content)
    with pytest.raises(InputError, match=message):
        ClipTokenizer(folder)
