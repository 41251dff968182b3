import re

import pytest

from jaxphys.guidance.refine_check import mended, object_words, problem

GOOD = "a rose, layered red petals, green stem, small thorns"


@pytest.mark.parametrize(
    "answer",
    [
        GOOD,
        f'"{GOOD}."',
        f"Here is the refined prompt: {GOOD}",
        f"Sure! Here's the rewritten prompt:\n\n{GOOD}\n",
        "```\na rose\n- layered red petals\n- green stem\n- small thorns\n```",
        "a rose; layered red petals;green stem ,, small thorns",
        f"{GOOD}, green stem, on a wooden table in a kitchen",
        "a rose,\tlayered\x07red petals,\ngreen stem, small thorns",
    ],
)
def test_answers_that_can_be_mended(answer):
    assert mended(answer) == GOOD
    assert problem(mended(answer), "a rose") is None


@pytest.mark.parametrize(
    ("answer", "said"),
    [
        ("", "says nothing"),
        ("...", "says nothing"),
        ("a rose, red", "words"),
        ("a rose, " + "very, ".join(f"petal{i} " for i in range(80)), "words"),
        ("a rose with layered red petals and thorns", "fewer than 3 parts"),
        ("a tulip, red petals, green stem, leaves", r"does not name the object \(rose\)"),
        ("I rewrote the prompt, a rose, red petals, stem", r"speaks of the task \(prompt\)"),
        ("a rose, red petals, a garden scene, green stem", "speaks of the surroundings"),
    ],
)
def test_answers_that_cannot(answer, said):
    assert re.search(said, problem(mended(answer), "a rose"))


def test_words_that_the_user_wrote_may_be_kept():
    refined = "a stage background, painted trees, blue sky, wooden frame"
    assert problem(refined, "a stage background") is None
    assert problem(refined, "a stage") is not None


def test_plurals_name_the_object_too():
    assert problem("two roses, red petals, green stems, thorns", "a rose") is None


def test_the_object_is_what_the_first_part_names():
    assert object_words("a vase with flowers") == ["vase", "with", "flowers"]
    assert object_words("a red rose on a wooden table") == ["red", "rose"]
