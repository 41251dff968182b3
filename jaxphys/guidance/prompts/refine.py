"""Prompt refinement: a sentence as a list of traits of one object, which guidance models read
better.

The stage and the two parts of its instruction, context and task, are those of the paper: short
prompts are elaborated, long ones reduced, backgrounds removed, the result is separated by commas.
Whoever is there is asked in turn: an endpoint, a language model in this process, fixed rules. An
answer that cannot be used is asked for again, then the next one is; the record says so.
"""

import os
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from typing import Literal, Protocol

from jaxphys.core.errors import InputError, nearest
from jaxphys.guidance.prompts.check import mended, problem
from jaxphys.guidance.prompts.endpoint import ADDRESS, Unanswered, find_endpoint
from jaxphys.guidance.prompts.local import PATH, find_local
from jaxphys.guidance.prompts.rules import refine_offline

Refiner = Literal["auto", "endpoint", "local", "rules"]
REFINERS = ("auto", "endpoint", "local", "rules")
LONGEST_PROMPT = 2000
ATTEMPTS = 3


@dataclass(frozen=True)
class Attempt:
    """A question that brought no usable answer: who was asked, what was wrong, and the raw answer
    if there was one."""

    who: str
    problem: str
    answer: str = ""


@dataclass(frozen=True)
class Refinement:
    """A prompt before and after, and how it came about.

    Attributes:
        original: as the user wrote it.
        refined: comma-separated, what guidance reads.
        how: who answered: "endpoint (model)", "local (model)", or which fixed rules were applied.
        instruction: what was asked, "" for rules.
        answer: the raw answer that `refined` was made of, "" for rules.
        attempts: what was asked in vain before.
    """

    original: str
    refined: str
    how: str
    instruction: str = ""
    answer: str = ""
    attempts: tuple[Attempt, ...] = ()


class Asked(Protocol):
    """A language model that refines prompts."""

    @property
    def who(self) -> str:
        """As the record names it."""

    def instruction(self, prompt: str) -> str:
        """What it is asked for a prompt, as text."""

    def ask(self, prompt: str, attempt: int) -> str:
        """Its raw answer; another one for another `attempt`. Raises Unanswered."""


def check_prompt(prompt: str) -> str:
    """The prompt on one line; raises `InputError` if it is empty, too long, or not text."""
    line = " ".join(prompt.split())
    if not any(character.isalnum() for character in line):
        raise InputError("prompt: is empty; say what the object is, for example 'a strawberry'")
    if len(line) > LONGEST_PROMPT:
        raise InputError(f"prompt: {len(line)} characters; at most {LONGEST_PROMPT} can be read")
    if not line.isprintable():
        raise InputError("prompt: holds control characters; write plain text")
    return line


def refine(
    prompt: str, environment: Mapping[str, str] = os.environ, how: Refiner = "auto"
) -> Refinement:
    """The prompt, refined.

    Args:
        prompt: any text of up to 2000 characters.
        environment: JAXPHYS_LLM_URL is the base address of an OpenAI-compatible API, such as
            `http://localhost:8000/v1`, JAXPHYS_LLM_MODEL its model (default gpt-4),
            JAXPHYS_LLM_KEY its key and JAXPHYS_LLM_TIMEOUT how many seconds it may take (60);
            JAXPHYS_LLM_PATH is a local model, a .gguf file or a folder. Without that, SmolLM2
            counts where `jaxphys weights fetch smollm2` has put it.
        how: "auto" asks whoever is there, in that order; else only the one named and, if it fails,
            the rules.

    Raises:
        InputError: an unusable prompt, a wrong setting, or nobody there of the kind named.
    """
    return refined_by(_models(environment, how), prompt)


def refined_by(models: Iterable[Asked], prompt: str) -> Refinement:
    """The prompt, refined by the first of these models that gives a usable answer, else by the
    rules. Raises InputError for an unusable prompt.
    """
    line = check_prompt(prompt)
    attempts = []
    for model in models:
        for attempt in range(ATTEMPTS):
            try:
                answer = model.ask(line, attempt)
            except Unanswered as error:
                attempts.append(Attempt(model.who, str(error)))
                break
            refined, asked = mended(answer, line), model.instruction(line)
            if (wrong := problem(refined, line, asked)) is None:
                return Refinement(prompt, refined, model.who, asked, answer, tuple(attempts))
            attempts.append(Attempt(model.who, f"the answer {wrong}", answer))
    refined, rules = refine_offline(line)
    who = f"offline rules, no language model ({rules})"
    return Refinement(prompt, refined, who, attempts=tuple(attempts))


def _models(environment: Mapping[str, str], how: Refiner) -> Iterator[Asked]:
    """Who is to be asked before the rules; each is set up only when its turn comes."""
    if how not in REFINERS:
        raise InputError(f"refiner {how!r}: {nearest(how, REFINERS)}")
    if how in ("auto", "endpoint"):
        endpoint = find_endpoint(environment)
        if endpoint is None and how == "endpoint":
            raise InputError(f"refiner endpoint: {ADDRESS} is not set; name the API's address")
        if endpoint is not None:
            yield endpoint
    if how in ("auto", "local"):
        local = find_local(environment)
        if local is None and how == "local":
            raise InputError(
                f"refiner local: there is none; `jaxphys weights fetch smollm2`, or set {PATH}"
            )
        if local is not None:
            yield local
