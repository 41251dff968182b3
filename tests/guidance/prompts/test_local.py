"""Refinement by a language model in this process."""

import os
import re

import pytest

from experiments.parity.arrays import weights
from jaxphys.core.errors import InputError
from jaxphys.guidance.prompts import local
from jaxphys.guidance.prompts.check import words_of
from jaxphys.guidance.prompts.local import conversation, find_local
from jaxphys.guidance.prompts.refine import ATTEMPTS, refine
from jaxphys.networks.llama_config import LlamaConfig
from tests.networks.published import of_llama
from tests.weights.gguf_files import CONFIG, write_gguf

LONG = (
    "a tall blue bottle which my uncle brought from a journey to Spain, with a brown cork in it "
    "and a yellow label, standing on a table in a bar at night"
)
WIDE = CONFIG | {"max_position_embeddings": 4096}


@pytest.fixture(scope="module")
def tiny(tmp_path_factory):
    """A random model; its answers are noise."""
    arrays = weights(of_llama(LlamaConfig.from_json(CONFIG, "tiny")))
    return write_gguf(tmp_path_factory.mktemp("model") / "tiny.gguf", arrays, config=WIDE)


class Speaker:
    """Answers what it is told to and keeps what it was asked."""

    def __init__(self, *answers: str):
        self.answers, self.asked = iter(answers), []

    def answer(self, messages, **options) -> str:
        self.asked.append((messages, options))
        return next(self.answers)


@pytest.fixture
def speaker(monkeypatch, tmp_path):
    def speak(*answers: str) -> tuple[Speaker, dict[str, str]]:
        said = Speaker(*answers)
        monkeypatch.setattr(local.LanguageModel, "load", lambda path: said)
        return said, {"JAXPHYS_LLM_PATH": str(tmp_path)}

    return speak


def test_a_good_answer_is_taken_and_recorded(speaker):
    answer = "rose, layered red petals, green stem, small thorns"
    said, environment = speaker(answer)
    result = refine("a rose", environment)
    assert result.refined == result.answer == answer and not result.attempts
    assert result.how.startswith("local (")
    (messages, options), *more = said.asked
    assert not more and messages[-1] == ("user", "a rose") and messages[0].role == "system"
    assert all(content in result.instruction for _, content in messages)
    assert result.instruction.endswith("assistant: rose,")
    assert options["begin"] == "rose," and options["until"](" red petals\n")
    assert not options["until"](" red petals, green")


def test_bad_answers_are_asked_for_again_then_the_rules_answer(speaker):
    bad = ("rose", "rose, red", "rose, red, red, red, red")
    said, environment = speaker(*bad)
    result = refine("a rose", environment)
    assert result.how.startswith("offline rules") and result.answer == result.instruction == ""
    assert [attempt.answer for attempt in result.attempts] == list(bad)
    assert all("words" in attempt.problem for attempt in result.attempts)
    spread = [options["sampling"] for _, options in said.asked]
    assert [sampling.temperature > 0 for sampling in spread] == [False, True, True]
    assert len({sampling.seed for sampling in spread}) == ATTEMPTS


def test_examples_are_no_answers(speaker):
    good = "lighthouse, round white tower, red stripes, glass lantern"
    _, environment = speaker("lighthouse, curved handlebar, leather saddle, red roof", good)
    result = refine("a lighthouse", environment)
    assert result.refined == good
    (attempt,) = result.attempts
    assert "repeats what it was told (curved handlebar, leather saddle)" in attempt.problem


def test_short_prompts_are_elaborated_with_guidance(speaker):
    said, environment = speaker("rose, layered red petals, green stem, small thorns")
    refine("a rose", environment)
    _, options = said.asked[0]
    assert options["sampling"].guidance > 1 and options["only"] is None
    assert options["without"][:-1] == conversation("a rose")[:-1]
    assert options["without"][-1].content == "a thing" and options["begin_without"] == "a thing,"


def test_long_prompts_are_reduced_with_their_own_words(speaker):
    said, environment = speaker("tall blue bottle, brown cork, yellow label")
    assert refine(LONG, environment).refined == "tall blue bottle, brown cork, yellow label"
    messages, options = said.asked[0]
    assert messages[0] != conversation("a rose")[0]
    assert options["without"] is None and options["begin"] == "tall blue bottle,"
    allowed = words_of(options["only"])
    assert {"brown", "cork", "yellow", "label"} <= set(allowed)
    assert not {"table", "bar", "night"} & set(allowed)  # surroundings cannot even be said


def test_what_a_prompt_does_not_name_is_the_model_s_choice(speaker):
    said, environment = speaker("a cake, round layers, white frosting, red cherries")
    assert refine("something sweet", environment).refined.startswith("a cake")
    assert said.asked[0][1]["begin"] == ""


def test_noise_falls_through(tiny):
    environment = {"JAXPHYS_LLM_PATH": str(tiny)}
    result = refine("a rose", environment)
    assert result.how.startswith("offline rules") and len(result.attempts) == ATTEMPTS
    assert all(attempt.who == "local (tiny)" for attempt in result.attempts)
    assert all(attempt.answer.startswith("rose,") for attempt in result.attempts)
    assert result == refine("a rose", environment)  # noise, but the same noise


def test_a_prompt_that_is_too_long_for_the_model(tmp_path):
    arrays = weights(of_llama(LlamaConfig.from_json(CONFIG, "tiny")))
    path = write_gguf(tmp_path / "short.gguf", arrays)
    result = refine("a rose", {"JAXPHYS_LLM_PATH": str(path)})
    (attempt,) = result.attempts
    assert "512 that the model reads" in attempt.problem


def test_a_model_that_the_user_names_must_be_readable(tmp_path):
    with pytest.raises(InputError, match=r"^JAXPHYS_LLM_PATH: .* is missing"):
        refine("a rose", {"JAXPHYS_LLM_PATH": str(tmp_path / "none.gguf")})
    damaged = tmp_path / "a.gguf"
    damaged.write_bytes(b"GGUF and no more")
    with pytest.raises(InputError, match=re.escape(str(damaged))):
        refine("a rose", {"JAXPHYS_LLM_PATH": str(damaged)})


def test_a_model_that_is_found_need_not_be(tmp_path, monkeypatch):
    (tmp_path / "a.gguf").write_bytes(b"GGUF and no more")
    monkeypatch.setattr(local, "locate", lambda *_, **__: tmp_path)
    result = refine("a rose", {})
    (attempt,) = result.attempts
    assert "no usable GGUF file" in attempt.problem and result.how.startswith("offline rules")


def test_nothing_is_found_where_nothing_is(monkeypatch):
    def absent(*_, **__):
        raise InputError("it is not here")

    monkeypatch.setattr(local, "locate", absent)
    assert find_local({}) is None


@pytest.mark.slow
@pytest.mark.skipif("JAXPHYS_LLM_PATH" not in os.environ, reason="set it to SmolLM2's file")
def test_smollm2_refines():
    model = find_local(os.environ)
    assert re.match(r"castle, .*\b(stone|tower)", model.ask("a castle", 0))
    assert "cork" in model.ask(LONG, 0) and "Spain" not in model.ask(LONG, 0)
