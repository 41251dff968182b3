"""Words: captions of kinds and of things of which only the colours are known."""

import numpy as np
import pytest

from experiments.priors.data.colour_names import colour_captions, seen
from jaxphys.library import KINDS
from jaxphys.library.kinds import kind, read_values
from jaxphys.library.palette import COLOURS
from jaxphys.library.variation import Choice
from jaxphys.library.words import caption, is_plural, nouns_for, singular

EVERYTHING = set(KINDS["teapot"].colours)


def say(colours, unusual, words, count=200):
    teapot = KINDS["teapot"]
    usual = {part: "white" for part in teapot.colours}
    defaults = {name: "" for name in teapot.options}
    values = {"style": "plain"}
    choice = Choice(usual | colours, frozenset(unusual), defaults | words, values)
    rng = np.random.default_rng(0)
    return {caption(teapot, choice, EVERYTHING - {"pattern"}, rng) for _ in range(count)}


def test_sentences_and_lists_say_the_same():
    said = say({"body": "blue", "lid": "red"}, {"body", "lid"}, {"spout": "long"})
    assert "a blue teapot with a long spout and a red lid" in said
    assert any(text.startswith("a teapot, blue, ") for text in said)
    assert any(text.startswith("a blue teapot, ") for text in said)
    assert all("blue" in t and "red lid" in t and "long" in t and "spout" in t for t in said)


def test_a_bare_name_is_said_of_the_usual_thing_only():
    assert "a teapot" in say({}, set(), {})
    assert "a teapot" not in say({"lid": "red"}, {"lid"}, {})


def test_size_and_colour_of_one_part_are_one_phrase():
    said = say({"spout": "green"}, {"spout"}, {"spout": "short"})
    assert "a teapot with a short green spout" in said


@pytest.mark.parametrize(
    "noun, plural",
    [("pancakes", True), ("stack of pancakes", False), ("vase with flowers", False),
     ("glass", False), ("feet", True), ("bus", False), ("trousers", True), ("dress", False)],
)  # fmt: skip
def test_plurals(noun, plural):
    assert is_plural(noun) == plural


def test_singulars():
    assert [singular(n) for n in ("layers", "leaves", "berries")] == ["layer", "leaf", "berry"]


def test_a_name_with_a_colour_in_it_is_for_things_of_that_colour():
    bear = KINDS["bear"]
    assert "brown bear" in nouns_for(bear, "brown", "")
    assert "brown bear" not in nouns_for(bear, "green", "green")
    assert "brown bear" not in nouns_for(bear, "brown", "brown")  # else a brown brown bear


def test_options_read_what_is_written():
    assert read_values("spout", "size", "short 0.6|1|long 1.6") == {
        "short": 0.6, "": 1.0, "long": 1.6,
    }  # fmt: skip
    assert read_values("style", "form", "plain|striped") == {"": "plain", "striped": "striped"}
    assert read_values("style", "form", "*striped|plain") == {"": "striped", "plain": "plain"}
    assert read_values("layers", "count", "1|3") == {"one": 1, "three": 3}
    with pytest.raises(ValueError, match="no default"):
        read_values("spout", "size", "short 0.6|long 1.6")


def test_a_kind_may_not_name_an_unknown_colour_nor_come_twice():
    with pytest.raises(ValueError, match="no colour is called"):
        kind("thing", "toys", colours={"body": "reddish"})
    with pytest.raises(ValueError, match="two kinds"):
        kind("teapot", "toys", colours={"body": "red"})(lambda o, rng: {})


def test_colours_seen_get_their_names():
    for name in ("red", "dark blue", "white", "brown", "pink", "black", "light green"):
        assert seen(np.array([COLOURS[name]] * 5))[0] == (name, 1.0)
    shades = np.concatenate([[COLOURS["brown"]] * 70, [COLOURS["white"]] * 30])
    assert colour_captions("chair", False, shades) == [
        "a brown chair", "a chair, brown", "a brown and white chair", "a chair, brown, white",
    ]  # fmt: skip
    assert colour_captions("trousers", True, shades)[0] == "brown trousers"
    many = np.array(list(COLOURS.values()))
    assert colour_captions("carpet", False, many) == []
