import os

import pytest

from jaxphys.core.errors import InputError, one_line
from jaxphys.core.files import read_json
from jaxphys.core.reading import reading


def refused(path, match, **limits):
    with pytest.raises(InputError, match=match) as error, reading(path, **limits):
        raise AssertionError("was opened")
    assert one_line(str(path)) in str(error.value)


def test_what_is_no_regular_file_is_refused_before_it_is_opened(tmp_path):
    os.mkfifo(tmp_path / "pipe")
    refused(tmp_path / "pipe", "pipe or a device")
    refused("/dev/zero", "pipe or a device")
    refused(tmp_path, "folder")
    refused(tmp_path / "none", "no such file")
    refused(tmp_path / "a\ud800", "no such file|no name")
    (tmp_path / "a").write_bytes(bytes(11))
    refused(tmp_path / "a", "more than", largest=10)
    with reading(tmp_path / "a", largest=11) as path:
        assert path == tmp_path / "a"


def test_every_error_names_the_file(tmp_path):
    path = tmp_path / "a"
    path.touch()
    with pytest.raises(InputError, match=r"/a: bad$"), reading(path):
        raise InputError("bad")
    with pytest.raises(InputError, match=r"^[^:]*/a: bad$"), reading(path):
        raise InputError(f"{path}: bad")
    with pytest.raises(InputError, match=r"/a: .*Input/output"), reading(path):
        raise OSError(5, "Input/output error")
    with pytest.raises(InputError, match=r"/a: .*memory"), reading(path):
        raise MemoryError


def test_a_fault_of_the_reader_stays_what_it_is_and_gets_a_note(tmp_path):
    path = tmp_path / "a"
    path.touch()
    with pytest.raises(KeyError) as error, reading(path), reading(path):
        raise KeyError("x")
    assert error.value.__notes__ == [f"while reading {path}"]


@pytest.mark.parametrize(
    ("content", "match"),
    [
        (b'{"a": 1e999}', "number"),
        (b'{"a": %s}' % (b"9" * 5000), "number"),
        (b'{"a": -Infinity}', "number"),
        (b"[" * 100_000, "deeply"),
        (b"[1]", "object"),
        (b"{", "line 1, column 2"),
        (b"\xff{}", "UTF-8"),
    ],
)
def test_json_that_is_none(tmp_path, content, match):
    (tmp_path / "a.json").write_bytes(content)
    with pytest.raises(InputError, match=match) as error:
        read_json(tmp_path / "a.json")
    assert str(error.value).startswith(str(tmp_path / "a.json"))


def test_json_comes_back(tmp_path):
    (tmp_path / "a.json").write_text(f'{{"a": [1, 2.5, "é", null], "b": {10**30}}}')
    assert read_json(tmp_path / "a.json") == {"a": [1, 2.5, "é", None], "b": 10**30}
