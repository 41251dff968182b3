"""Refinement by a small language model in this process.

SmolLM2 with its 135 million weights cannot follow an instruction like the endpoint's, but it goes
on from examples. So the two halves of the task are two conversations: short prompts are elaborated,
pushed by guidance towards what belongs to this object rather than to any; long ones are reduced,
with no other words to choose from than the prompt's own. Both answers are made to begin with the
object that the prompt names.
"""

import re
from collections.abc import Mapping
from functools import cached_property
from pathlib import Path

from jaxphys.core.errors import InputError
from jaxphys.guidance.prompts.check import words_of
from jaxphys.guidance.prompts.endpoint import Unanswered
from jaxphys.guidance.prompts.language_model import LanguageModel, Message, Sampling
from jaxphys.guidance.prompts.rules import LONG, without_background
from jaxphys.guidance.prompts.subject import subject
from jaxphys.weights.places import expanded
from jaxphys.weights.resolve import locate

PATH = "JAXPHYS_LLM_PATH"
MOST_TOKENS = 48
MOST_COMMAS = 5

ELABORATE = (
    "Describe the object. Answer with one line: the object first, then what its parts look like, "
    "separated by commas."
)
ELABORATED = (
    ("a guitar", "a guitar, curved wooden body, round sound hole, long neck, six steel strings"),
    (
        "an elephant",
        "an elephant, grey wrinkled skin, long trunk, two white tusks, big flat ears",
    ),
    (
        "something to write with",
        "a fountain pen, slim black body, golden clip, pointed steel nib, smooth cap",
    ),
    (
        "a bicycle",
        "a bicycle, two thin spoked wheels, red metal frame, curved handlebar, leather saddle",
    ),
)
ANY_OBJECT = "a thing"
REDUCE = (
    "Shorten the description to what the object looks like. Answer with one line: the object first,"
    " then its visible parts, separated by commas."
)
REDUCED = (
    (
        "my favourite windmill, the one that we saw on holiday with its four white sails turning in"
        " the wind, and a pointed red roof and a round stone tower",
        "windmill, four white sails, pointed red roof, round stone tower",
    ),
    (
        "a brave knight who has not slept for three nights, dressed in shiny steel armour, carrying"
        " a round wooden shield with a lion painted on it and a long sword, because the king sent"
        " him to find a ring",
        "brave knight, shiny steel armour, round wooden shield with a lion, long sword",
    ),
    (
        "I want to see a tall blue bottle that my uncle brought from Spain, it has a cork in it"
        " and a yellow label, standing on a table in a bar",
        "tall blue bottle, cork, yellow label",
    ),
)
LINKS = ", a with and the of"  # words that a reduced prompt may add


class LocalModel:
    """A language model on disk, read when it is first asked."""

    def __init__(self, path: Path, *, chosen: bool = True):
        """`chosen`: the user named it, so that it is a mistake if it cannot be read."""
        self._path, self._chosen = path, chosen

    @property
    def who(self) -> str:
        return f"local ({self._path.stem})"

    @cached_property
    def _model(self) -> LanguageModel:
        try:
            return LanguageModel.load(self._path)
        except InputError as error:
            if self._chosen:
                raise
            raise Unanswered(str(error)) from None

    def instruction(self, prompt: str) -> str:
        """The conversation that is sent, turn by turn, up to the words that the answer is made to
        begin with."""
        turns = [f"{role}: {content}" for role, content in conversation(prompt)]
        return "\n".join([*turns, f"assistant: {beginning(prompt)}"])

    def ask(self, prompt: str, attempt: int) -> str:
        """The answer: the likeliest at first, draws for later attempts.

        Raises:
            Unanswered: the prompt is too long for the model, or the model that was found cannot be
                read; InputError if the user named it.
        """
        model, long, spread = self._model, is_long(prompt), 0.0 if attempt == 0 else 0.7
        sampling = Sampling(
            temperature=spread,
            seed=attempt,
            penalty=2.0,
            plausible=0.1 if attempt == 0 else 0.03,
            guidance=1.0 if long else 2.0,
        )
        try:
            return model.answer(
                conversation(prompt),
                max_tokens=MOST_TOKENS,
                begin=beginning(prompt),
                until=_is_over,
                only=f"{LINKS} {without_background(prompt)[0]}" if long else None,
                without=None if long else conversation(ANY_OBJECT),
                begin_without=beginning(ANY_OBJECT),
                sampling=sampling,
            )
        except InputError as error:
            raise Unanswered(str(error)) from None


def is_long(prompt: str) -> bool:
    """Whether a prompt is to be reduced instead of elaborated."""
    return len(words_of(prompt)) > LONG


def conversation(prompt: str) -> list[Message]:
    """The task part with examples, then the prompt."""
    task, examples = (REDUCE, REDUCED) if is_long(prompt) else (ELABORATE, ELABORATED)
    turns = [Message("system", task)]
    for asked, answered in examples:
        turns += [Message("user", asked), Message("assistant", answered)]
    return [*turns, Message("user", prompt)]


def beginning(prompt: str) -> str:
    """What the answer is made to begin with: the object, if the prompt names one."""
    named = prompt if prompt == ANY_OBJECT else subject(prompt).phrase
    return f"{named}," if named else ""


def _is_over(text: str) -> bool:
    return text.count(",") > MOST_COMMAS or re.search(r"[\n.:;!?\"]", text) is not None


def find_local(environment: Mapping[str, str]) -> LocalModel | None:
    """The model that is set up, else SmolLM2 where it is, else None.

    Raises:
        InputError: JAXPHYS_LLM_PATH names nothing that is there.
    """
    given = environment.get(PATH, "").strip()
    if given:
        path = expanded(given)
        if path is None or not path.exists():
            raise InputError(f"{PATH}: {given} is missing; name a .gguf file or a folder")
        return LocalModel(path)
    try:
        found = locate("smollm2", fetch=False, environment=environment)
    except InputError:
        return None  # it is not here, which is no mistake
    return LocalModel(found, chosen=False)
