import pytest

from jaxphys.guidance.guides import object_of, phrases_of


@pytest.mark.parametrize(
    ("prompt", "phrases"),
    [
        ("a teapot", ["a teapot"]),
        ("a teapot, blue, tall", ["a teapot", "blue", "tall"]),
        (
            "a teapot with a blue lid and a long spout, glossy",
            [
                "a teapot with a blue lid and a long spout",
                "a teapot",
                "a blue lid",
                "a long spout",
                "glossy",
            ],
        ),
        ("a cake, with three layers and a cherry", ["a cake", "three layers", "a cherry"]),
        ("salt and pepper, , white", ["salt and pepper", "white"]),
    ],
)
def test_a_prompt_falls_into_phrases(prompt, phrases):
    assert phrases_of(prompt, 7) == phrases
    assert object_of(prompt) == phrases[0]


def test_what_is_too_much_stays_together():
    assert phrases_of("a cup, red, tall, old, round", 2) == ["a cup", "red", "tall, old, round"]
    assert phrases_of("a cup, red", 0) == ["a cup"]
