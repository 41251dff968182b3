import pytest

from jaxphys.core.errors import InputError
from jaxphys.guidance.prompts.refine import refine


def test_short_prompts_are_elaborated():
    result = refine("a strawberry", {}, "rules")
    assert result.original == "a strawberry"
    assert result.refined.startswith("a strawberry, ") and "seeds" in result.refined
    assert result.how.startswith("offline") and "elaborated" in result.how
    # An object the rules do not know still gets a fuller description.
    assert refine("a zorgle", {}, "rules").refined.count(",") >= 3


def test_long_prompts_are_reduced_and_keep_their_object():
    prompt = (
        "I would really like to see a small vintage teapot that has a curved golden spout and a "
        "painted blue dragon which is chasing a tiny phoenix around it while steam rises slowly"
    )
    result = refine(prompt, {}, "rules")
    assert "reduced" in result.how
    assert len(result.refined) < len(prompt) and result.refined.count(",") <= 5
    assert "teapot" in result.refined and "golden spout" in result.refined


@pytest.mark.parametrize(
    ("prompt", "gone"),
    [
        ("a red rose on a wooden table in a sunny kitchen", ["table", "kitchen"]),
        ("a burger, soft studio lighting, with a blurred background", ["background"]),
        ("a microphone against a dark backdrop", ["backdrop"]),
        ("a bicycle, leaning against an old caravan", ["leaning", "caravan"]),
        ("a duck floating between soap bubbles", ["floating", "bubbles"]),
    ],
)
def test_backgrounds_are_removed(prompt, gone):
    refined = refine(prompt, {}, "rules").refined
    assert not any(word in refined for word in gone)
    assert refined.startswith(prompt.split()[0])


def test_what_an_object_holds_is_not_background():
    assert refine("a vase with flowers", {}, "rules").refined.startswith("a vase with flowers")
    assert "leaning tower" in refine("a leaning tower", {}, "rules").refined
    assert "cone" in refine("vanilla ice in a cone", {}, "rules").refined


def test_refinement_is_deterministic():
    assert refine("a guitar", {}, "rules") == refine("a guitar", {}, "rules")


@pytest.mark.parametrize("prompt", ["", "   ", "?!", "a\x00b", "x" * 3000])
def test_unusable_prompts(prompt):
    with pytest.raises(InputError, match=r"^prompt: "):
        refine(prompt, {}, "rules")


def test_what_is_not_there_is_said(monkeypatch):
    monkeypatch.setattr("jaxphys.guidance.prompts.refine.find_local", lambda environment: None)
    for how, said in (("endpoint", "JAXPHYS_LLM_URL"), ("local", "weights fetch smollm2")):
        with pytest.raises(InputError, match=said):
            refine("a rose", {}, how)
    with pytest.raises(InputError, match="did you mean 'rules'"):
        refine("a rose", {}, "rule")
    with pytest.raises(InputError, match="must begin with http"):
        refine("a rose", {"JAXPHYS_LLM_URL": "file:///etc"})
