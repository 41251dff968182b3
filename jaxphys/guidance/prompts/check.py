"""What a language model's answer must be before guidance reads it: mended if it can be, else
refused with a reason.
"""

import re
import unicodedata

from jaxphys.guidance.prompts.rules import without_background
from jaxphys.guidance.prompts.subject import subject

FEWEST_PARTS = 3
FEWEST_WORDS, MOST_WORDS = 5, 60
MOST_WORDS_OF_PART = 10
MOST_COPIED = 2  # parts; fewer may be chance
# Words by which an answer speaks of the task instead of the object ...
ECHOES = (
    "rewrite", "rewritten", "refined", "prompt", "task", "context", "instruction", "instructions",
    "text-to-3d", "sure", "sorry", "user", "assistant", "comma", "commas",
)  # fmt: skip
# ... of a picture or a place ...
SCENERY = (
    "background", "backdrop", "scene", "scenery", "setting", "landscape", "surroundings",
    "atmosphere", "environment", "lighting", "sunlight", "sunset", "sunrise", "studio", "camera",
    "photo", "photograph", "photography", "render", "rendering", "bokeh",
)  # fmt: skip
# ... or to somebody, or tells a story.
TALK = {"i", "you", "he", "she", "we", "they", "it", "his", "her", "please", "hope", "let"}
# Words at the end of a part that lead nowhere.
LOOSE_ENDS = {
    "at", "on", "in", "of", "with", "and", "the", "a", "an", "to", "by", "for", "or", "sitting",
    "standing", "lying", "parked", "placed", "floating",
}  # fmt: skip
OPENING = re.compile(
    r"^[^,:]{0,60}\b(here|prompt|answer|sure|refined|rewritten)\b[^,:]{0,40}:", re.I
)


def words_of(text: str) -> list[str]:
    """Lower-case words."""
    return re.findall(r"[\w'-]+", text.lower())


def mended(answer: str, prompt: str) -> str:
    """One printable line of parts separated by commas: without an opening ("Here is:"), bullets,
    quotes, surroundings, remarks and parts that say nothing new."""
    text = OPENING.sub("", answer.strip().strip("`\"' \n"))
    text = re.sub(r"(?:^|\n)\s*(?:[-*•]|\d+[.)])?\s*", ", ", text)
    text = "".join(character if character.isprintable() else " " for character in text)
    kept: list[str] = []
    said: set[str] = set()
    asked = set(words_of(prompt))
    for part in re.split(r"[,;.]", text):
        part = _trimmed(without_background(part)[0] or ("" if kept else part))
        words = set(words_of(part)) - LOOSE_ENDS
        if words <= said or (kept and not _is_trait(part, asked)):
            continue
        kept.append(part)
        said |= words
    return ", ".join(kept)


def _trimmed(part: str) -> str:
    """A part without the marks and loose words around it."""
    words = part.strip(" .;:!?\"'`*-").split()
    while words and words[0].lower() in ("and", "or"):
        words = words[1:]
    while words and words[-1].lower() in LOOSE_ENDS:
        words = words[:-1]
    return " ".join(words).strip(" .;:!?\"'`*-")


def _is_trait(part: str, asked: set[str]) -> bool:
    words = words_of(part)
    strange = TALK | (set(SCENERY) - asked)
    return len(words) <= MOST_WORDS_OF_PART and strange.isdisjoint(words)


def problem(refined: str, prompt: str, instruction: str = "") -> str | None:
    """Why a mended answer cannot be used for the user's `prompt`, where the model was asked by
    `instruction`; None if it can."""
    words = words_of(refined)
    if not words:
        return "says nothing"
    if not FEWEST_WORDS <= len(words) <= MOST_WORDS:
        return f"has {len(words)} words instead of {FEWEST_WORDS} to {MOST_WORDS}"
    if refined.count(",") + 1 < FEWEST_PARTS:
        return f"has fewer than {FEWEST_PARTS} parts separated by commas"
    asked = words_of(prompt)
    for kind, listed in (("task", ECHOES), ("surroundings", SCENERY)):
        spoken = [word for word in listed if word in words and word not in asked]
        if spoken:
            return f"speaks of the {kind} ({spoken[0]})"
    nouns = [noun for noun in subject(prompt).nouns if _plain(noun).isascii()]
    lost = [noun for noun in nouns if not _names(refined, noun)]
    if lost:
        return f"does not name the object ({' '.join(lost)})"
    parts = refined.split(", ")
    if nouns and not any(_names(parts[0], noun) for noun in nouns):
        return f"does not begin with the object ({nouns[0]})"
    if any(2 * sum(_names(part, noun) for part in parts) > len(parts) > 3 for noun in nouns):
        return f"goes in circles ({nouns[0]})"
    told = set(re.split(r"[,.;:()\"\n]+ *", instruction))
    copied = [part for part in parts[1:] if part in told and part not in prompt]
    if len(copied) >= MOST_COPIED:
        return f"repeats what it was told ({', '.join(copied[:MOST_COPIED])})"
    return None


def _names(text: str, noun: str) -> bool:
    """Whether a text holds a noun, in singular or plural, in one word or two."""
    forms, joined = _forms(noun), _plain(text).replace(" ", "-")
    return any(forms & _forms(word) for word in words_of(text)) or (
        "-" in noun and _plain(noun) in joined
    )


def _forms(word: str) -> set[str]:
    word = _plain(word)
    endings = (("ies", "y"), ("ves", "f"), ("es", ""), ("s", ""))
    return {word, *(word.removesuffix(old) + new for old, new in endings if word.endswith(old))}


def _plain(text: str) -> str:
    """Lower case without accents. Names in other scripts stay what they are: nobody can say here
    how an answer in English would call them."""
    decomposed = unicodedata.normalize("NFKD", text.lower())
    return "".join(character for character in decomposed if not unicodedata.combining(character))
