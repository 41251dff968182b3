import pytest

from jaxphys.guidance.guides import phrases_of
from jaxphys.library import KINDS, build, usual
from jaxphys.library.asked import asked


@pytest.mark.parametrize(
    ("prompt", "kind", "given"),
    [
        ("a teapot", "teapot", {}),
        (
            "a gray teapot with a long blue spout",
            "teapot",
            {"body": ("grey",), "spout": ("blue", "long")},
        ),
        ("an automobile", "car", {}),
        ("a teddy bear", "teddy bear", {}),
        ("two strawberries", "strawberry", {}),
        ("a rubber duck on a pond", "rubber duck", {}),
        (
            "a cake with three layers and no cherries, pink icing",
            "cake",
            {"layers": ("three",), "cherries": ("",), "icing": ("pink",)},
        ),
        ("a vase with blue flowers", "vase with flowers", {"flowers": ("blue",)}),
        ("a tall mug", "mug", {"height": ("tall",)}),
        ("a teapot, red stripes", "teapot", {"pattern": ("red",), "style": ("striped",)}),
        ("a mug, light blue, glossy", "mug", {"body": ("light blue",)}),
    ],
)
def test_words_are_kinds_parts_and_options(prompt, kind, given):
    found = asked(phrases_of(prompt, 9))
    assert found is not None and found.kind == kind
    assert found.given == given
    usual(found.kind, 0, found.given)  # every word is one that the kind knows


@pytest.mark.parametrize("prompt", ["a pangolin", "a dragon fruit", "a car park", "teapots' lids"])
def test_what_names_something_else_is_unknown(prompt):
    assert asked(phrases_of(prompt, 9)) is None


@pytest.mark.parametrize("name", list(KINDS))
def test_every_kind_is_found_by_its_name(name):
    found = asked(phrases_of(f"a {name}", 9))
    assert found is not None and found.kind == name


def test_a_part_may_be_given_size_and_colour():
    built = build("teapot", 3, {"spout": ("long", "blue"), "lid": "white", "body": "blue"})
    assert built.choice.words["spout"] == "long"
    assert {part: built.choice.colours[part] for part in ("spout", "lid", "body")} == {
        "spout": "blue",
        "lid": "white",
        "body": "blue",
    }
    # What is like the body stays so unless somebody says otherwise.
    assert set(usual("teapot", 3, {"body": "blue"}).choice.colours[p] for p in ("lid", "knob")) == {
        "blue"
    }
