import json

import pytest

from jaxphys.core.errors import InputError, nearest
from jaxphys.core.files import atomic_path, write_json


def test_nearest_names_the_likeliest_first_then_all():
    text = nearest("jely", ["sand", "jelly", "metal"])
    assert text.startswith("did you mean 'jelly'?")
    assert text.endswith("valid: jelly, metal, sand")
    assert "did you mean" not in nearest("xyz", ["sand", "jelly"])


def test_an_input_error_is_a_value_error():
    with pytest.raises(ValueError, match="what"):
        raise InputError("what")


def test_a_file_appears_whole_or_not_at_all(tmp_path):
    path = tmp_path / "new" / "a.txt"
    with atomic_path(path) as aside:
        assert aside.suffix == ".txt" and aside.parent == path.parent
        aside.write_text("whole")
        assert not path.exists()
    assert path.read_text() == "whole"
    with pytest.raises(RuntimeError), atomic_path(path) as aside:
        aside.write_text("half")
        raise RuntimeError
    assert path.read_text() == "whole"
    assert [p.name for p in path.parent.iterdir()] == ["a.txt"]


def test_equal_values_give_equal_bytes(tmp_path):
    write_json(tmp_path / "a.json", {"b": 1, "a": [2.5]})
    write_json(tmp_path / "b.json", {"a": [2.5], "b": 1})
    assert (tmp_path / "a.json").read_bytes() == (tmp_path / "b.json").read_bytes()
    assert json.loads((tmp_path / "a.json").read_text()) == {"a": [2.5], "b": 1}


def test_a_value_that_is_not_json_leaves_the_old_file(tmp_path):
    write_json(tmp_path / "a.json", 1)
    with pytest.raises(TypeError):
        write_json(tmp_path / "a.json", object())
    assert (tmp_path / "a.json").read_text() == "1\n"
