"""What a language model's answer must be before guidance reads it: mended if it can be, else
refused with a reason.
"""

import re

from jaxphys.guidance.refine_offline import FILLER, refine_offline, without_background

FEWEST_PARTS = 3
FEWEST_WORDS, MOST_WORDS = 5, 60
# Words by which an answer speaks of the task, or of a picture instead of the object.
ECHOES = (
    "rewrite", "rewritten", "refined", "prompt", "task", "context", "instruction", "instructions",
    "sure", "sorry", "user", "assistant", "comma", "commas",
)  # fmt: skip
PLACES = ("background", "backdrop", "scene", "scenery", "setting", "landscape")
OPENING = re.compile(
    r"^[^,:]{0,60}\b(here|prompt|answer|sure|refined|rewritten)\b[^,:]{0,40}:", re.I
)


def words_of(text: str) -> list[str]:
    """Lower-case words."""
    return re.findall(r"[\w'-]+", text.lower())


def mended(answer: str) -> str:
    """One printable line of parts separated by commas: without an opening ("Here is:"), bullets,
    quotes, surroundings and repeated parts."""
    text = OPENING.sub("", answer.strip().strip("`\"' \n"))
    text = re.sub(r"\n\s*(?:[-*•]|\d+[.)])?\s*", ", ", text)
    text = "".join(character if character.isprintable() else " " for character in text)
    text = without_background(text)[0]
    parts = [" ".join(part.split()).strip(" .;:\"'`*-") for part in re.split(r"[,;]", text)]
    distinct: dict[str, str] = {}
    for part in parts:
        if part:
            distinct.setdefault(part.lower(), part)
    return ", ".join(distinct.values())


def problem(refined: str, prompt: str) -> str | None:
    """Why a mended answer cannot be used for the user's `prompt`; None if it can."""
    words = words_of(refined)
    if not words:
        return "says nothing"
    if not FEWEST_WORDS <= len(words) <= MOST_WORDS:
        return f"has {len(words)} words instead of {FEWEST_WORDS} to {MOST_WORDS}"
    if refined.count(",") + 1 < FEWEST_PARTS:
        return f"has fewer than {FEWEST_PARTS} parts separated by commas"
    asked = words_of(prompt)
    for kind, listed in (("task", ECHOES), ("surroundings", PLACES)):
        spoken = [word for word in listed if word in words and word not in asked]
        if spoken:
            return f"speaks of the {kind} ({spoken[0]})"
    named = object_words(prompt)
    kept = [word for word in named if any(same(word, other) for other in words)]
    if 2 * len(kept) < len(named):
        missing = [word for word in named if word not in kept]
        return f"does not name the object ({' '.join(missing)})"
    return None


def object_words(prompt: str) -> list[str]:
    """Words that tell what the user asked for: of the part of the prompt that names the object."""
    subject = refine_offline(prompt)[0].split(",")[0]
    return [word for word in words_of(subject) if word not in FILLER] or words_of(subject)


def same(word: str, other: str) -> bool:
    """Whether two words are one but for a plural."""
    return word == other or word.rstrip("s") == other.rstrip("s")
