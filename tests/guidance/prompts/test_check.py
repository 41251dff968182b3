import re

import pytest

from jaxphys.guidance.prompts.check import MOST_WORDS, mended, problem

GOOD = "a rose, layered red petals, green stem, small thorns"


@pytest.mark.parametrize(
    "answer",
    [
        GOOD,
        f'"{GOOD}."',
        f"Here is the refined prompt: {GOOD}",
        f"Sure! Here's the rewritten prompt:\n\n{GOOD}\n",
        f"{GOOD}\n\nI hope this helps!",
        f"{GOOD}. It has a lovely smell. Please tell me if you need more.",
        "```\na rose\n- layered red petals\n- green stem\n- small thorns\n```",
        "1. a rose\n2. layered red petals\n3. green stem\n4. small thorns",
        "a rose; layered red petals;green stem ,, small thorns",
        f"{GOOD}, green stem, on a wooden table in a kitchen",
        f"{GOOD}, soft studio lighting, photograph, sunset scenery",
        f"{GOOD}, red, and small thorns, standing on, with a",
        "a rose,\tlayered\x07red petals,\ngreen stem, and small thorns",
    ],
)
def test_answers_that_can_be_mended(answer):
    assert mended(answer, "a rose") == GOOD
    assert problem(GOOD, "a rose") is None


@pytest.mark.parametrize(
    ("answer", "said"),
    [
        ("", "says nothing"),
        ("...", "says nothing"),
        ("\x00\x01", "says nothing"),
        ("a rose, red", "has 3 words"),
        (", ".join(["a rose", *(f"petal{i} leaf{i}" for i in range(40))]), "has 82 words"),
        ("a rose with layered red petals and thorns", "fewer than 3 parts"),
        ("a tulip, red petals, green stem, leaves", r"does not name the object \(rose\)"),
        ("a garden flower, red petals, rose", r"does not begin with the object \(rose\)"),
        ("I'd rewrite the prompt as a rose, red petals, stem", r"speaks of the task \(rewrite\)"),
        ("a studio rose, red petals, green stem, thorns", "speaks of the surroundings"),
        ("a rose, rose petals, rose leaves, a rose stem, thorns", r"goes in circles \(rose\)"),
        ("I cannot help with that.", "words|parts|name"),
    ],
)
def test_answers_that_cannot(answer, said):
    assert re.search(said, problem(mended(answer, "a rose"), "a rose"))


def test_words_that_the_user_wrote_may_be_kept():
    refined = "a stage background, painted trees, blue sky, wooden frame"
    assert mended(refined, "a stage background") == refined
    assert problem(refined, "a stage background") is None
    assert "surroundings" in problem("a stage backdrop, painted trees, blue frame", "a stage")


@pytest.mark.parametrize(
    ("prompt", "answer"),
    [
        ("a rose", "two roses, red petals, green stems, thorns"),
        ("two cherries", "a cherry, red round fruit, thin green stem"),
        ("a wolf", "wolves, grey thick fur, yellow eyes, sharp teeth"),
        ("an ice-cream", "ice cream, crisp waffle cone, round white scoop"),
        ("a crème brûlée", "creme brulee, caramel crust, white round bowl"),
        ("一朵红玫瑰", "a red rose, layered petals, green stem"),  # nobody can tell
        ("something sweet", "a cake, round layers, white frosting, cherries"),  # nothing is named
    ],
)
def test_other_forms_name_the_object_too(prompt, answer):
    assert problem(mended(answer, prompt), prompt) is None


def test_all_that_is_named_must_be_there():
    assert "saucer" in problem("a cup, white glaze, round handle, thin rim", "a cup and saucer")
    assert problem("a cup, white glaze, round saucer, thin rim", "a cup and saucer") is None


def test_what_was_told_is_no_answer():
    told = 'Context: "a rose"\nTask: one line (shape, fine parts, bright colours, surface of it).'
    echo = "a rose, fine parts, bright colours, green stem"
    assert "repeats what it was told (fine parts, bright colours)" in problem(echo, "a rose", told)
    assert problem(echo, "a rose") is None
    # One part may be the same by chance, and the user's own words are free.
    assert problem("a rose, fine parts, red colours, green stem", "a rose", told) is None
    assert problem(echo, "a rose with fine parts, bright colours", told) is None


def test_an_answer_never_grows_by_being_mended():
    long = ", ".join(["a rose", *(f"red part{i}" for i in range(40))])
    assert mended(long, "a rose") == long
    assert str(MOST_WORDS) in problem(long, "a rose")
