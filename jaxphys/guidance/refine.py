"""Prompt refinement: a sentence as a list of traits of one object, which guidance models read
better.

The stage and the two parts of its instruction, context and task, are those of the paper: short
prompts are elaborated, long ones reduced, backgrounds removed, the result is separated by commas.
A language model does it if an OpenAI-compatible endpoint is configured; otherwise fixed rules do.
"""

import json
import os
import urllib.error
import urllib.request
from collections.abc import Mapping
from dataclasses import dataclass

from jaxphys.core.errors import InputError
from jaxphys.guidance.refine_offline import refine_offline

ENDPOINT = "JAXPHYS_LLM_URL"
KEY = "JAXPHYS_LLM_KEY"
MODEL = "JAXPHYS_LLM_MODEL"
LONGEST_PROMPT = 2000
LONGEST_REPLY = 64 * 1024
TIMEOUT = 60.0

TASK = (
    "Rewrite this prompt for a text-to-3D model that knows only simple descriptions. Answer with "
    "the rewritten prompt alone: one line, the object first, then its traits separated by commas "
    "(shape, parts, colours, material, surface). If the prompt is short or vague, add fitting "
    "visual details. If it is long or involved, keep its essence and drop the rest; resolve "
    "contradictions. Describe one object by itself: leave out background, place, lighting, camera, "
    "people and story."
)


@dataclass(frozen=True)
class Refinement:
    """A prompt before and after.

    Attributes:
        original: as the user wrote it.
        refined: comma-separated, what guidance reads.
        how: "endpoint (model name)", or which fixed rules were applied.
    """

    original: str
    refined: str
    how: str


def instruction(prompt: str) -> str:
    """What a language model is asked: the context part with the prompt, then the task part."""
    return (
        f"Context: the prompt of a text-to-3D generation is: {json.dumps(prompt)}\n\nTask: {TASK}"
    )


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


def refine(prompt: str, environment: Mapping[str, str] = os.environ) -> Refinement:
    """The prompt, refined.

    Args:
        prompt: any text of up to 2000 characters.
        environment: where JAXPHYS_LLM_URL (base address of an OpenAI-compatible API, such as
            `http://localhost:8000/v1`), JAXPHYS_LLM_MODEL and, if it needs one, JAXPHYS_LLM_KEY
            are looked up. Without an address the offline rules refine.

    Raises:
        InputError: an unusable prompt, a half-configured endpoint, or one that does not answer.
    """
    line = check_prompt(prompt)
    address = environment.get(ENDPOINT, "").strip()
    if not address:
        refined, rules = refine_offline(line)
        return Refinement(prompt, refined, f"offline rules, no language model ({rules})")
    model = environment.get(MODEL, "").strip()
    if not model:
        raise InputError(f"{MODEL}: is not set though {ENDPOINT} is; name the model to ask")
    answer = _ask(address, model, environment.get(KEY, "").strip(), instruction(line))
    return Refinement(prompt, _clean(answer, address), f"endpoint ({model})")


def _ask(address: str, model: str, key: str, text: str) -> str:
    """The reply of a chat completion endpoint at temperature 0. The key goes nowhere but the
    header.
    """
    if not address.startswith(("http://", "https://")):
        raise InputError(f"{ENDPOINT}: must begin with http:// or https://")
    body = {
        "model": model,
        "messages": [{"role": "user", "content": text}],
        "temperature": 0,
        "seed": 0,
    }
    headers = {"Content-Type": "application/json"}
    if key:
        headers["Authorization"] = f"Bearer {key}"
    try:
        request = urllib.request.Request(
            address.rstrip("/") + "/chat/completions", json.dumps(body).encode(), headers
        )
        with urllib.request.urlopen(request, timeout=TIMEOUT) as reply:
            data = json.loads(reply.read(LONGEST_REPLY))
    except urllib.error.HTTPError as error:
        error.close()
        raise InputError(
            f"{ENDPOINT}: the endpoint answered {error.code}; check {KEY} and {MODEL}, "
            f"or unset {ENDPOINT} to refine offline"
        ) from None
    except (OSError, ValueError):
        raise InputError(
            f"{ENDPOINT}: no usable answer; check it, or unset it to refine offline"
        ) from None
    try:
        return str(data["choices"][0]["message"]["content"])
    except (KeyError, IndexError, TypeError):
        raise InputError(
            f"{ENDPOINT}: the answer is no chat completion; is it OpenAI-compatible?"
        ) from None


def _clean(answer: str, address: str) -> str:
    """One printable line of comma-separated traits out of a model's reply."""
    printable = "".join(c if c.isprintable() else " " for c in answer)
    parts = [" ".join(part.split()).strip(" .\"'`") for part in printable.split(",")]
    refined = ", ".join(part for part in parts if part)[:LONGEST_PROMPT]
    if not any(character.isalnum() for character in refined):
        raise InputError(f"{ENDPOINT}: the model answered nothing; try another {MODEL}")
    return refined
