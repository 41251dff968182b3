"""The object that a prompt names: "the rusty bicycle" of all that a sentence tells about it.

There is no grammar here, only lists of the words after which a name is over. That is right for most
prompts and wrong for some; whoever asks must do without an answer, too.
"""

import re
from typing import NamedTuple

from jaxphys.guidance.prompts.rules import FILLER, PLACES, without_background

# Words before a name that do not belong to it.
LEADING = FILLER | {
    "i'd", "i'll", "need", "give", "show", "draw", "design", "imagine", "us", "my", "your", "his",
    "her", "our", "their", "this", "these", "those", "once", "just", "for", "can", "could", "you",
    "upon", "time", "favourite", "favorite",
} - {"model", "picture", "photo"}  # fmt: skip
# Of these, a name follows behind "of": a slice of cake is a cake.
MEASURES = {
    "slice", "piece", "pair", "kind", "sort", "type", "set", "stack", "bunch", "pile", "lot",
    "couple", "image", "picture", "photo", "model", "render", "rendering", "scene", "bit",
}  # fmt: skip
# Words after a name.
TRAILING = {
    *PLACES,
    "with", "without", "that", "which", "who", "whose", "whom", "where", "when", "while", "as",
    "from", "for", "by", "to", "like", "so", "such", "because", "is", "are", "was", "were", "be",
    "been", "has", "have", "had", "having", "can", "could", "will", "would", "should", "must",
    "may", "might", "does", "did", "looks", "look", "made", "it", "he", "she", "they", "its",
    "there", "then", "but", "or", "about", "into", "over", "through", "across", "along", "around",
    "between",
}  # fmt: skip
DETERMINERS = {"a", "an", "the", "some", "its", "his", "her", "their", "my"}
NO_NAMES = {"something", "anything", "thing", "things", "object", "objects", "stuff", "item", "one"}
NAMES_IN_ING = {
    "building", "painting", "drawing", "earring", "pudding", "dumpling", "duckling", "ceiling",
    "clothing", "dressing", "stocking", "wedding", "carving",
}  # fmt: skip


class Subject(NamedTuple):
    """`phrase` names the object with what is said of it at once, "rusty bicycle"; `nouns` are the
    words of it that must not be lost. Both are empty where nothing is named.
    """

    phrase: str
    nouns: tuple[str, ...]


def subject(prompt: str) -> Subject:
    """What a prompt (one line) is about."""
    text = without_background(prompt)[0] or prompt
    for clause in re.split(r"[,;:.!?()\"]", text):
        words = re.findall(r"[\w'-]+", clause)
        if found := _name(words):
            return found
    return Subject("", ())


def _name(words: list[str]) -> Subject | None:
    lower = [word.lower() for word in words]
    start = 0
    while start < len(words) and (lower[start] in LEADING or _measures(lower, start)):
        start += 1
    phrase: list[str] = []
    nouns: list[str] = []
    for i in range(start, len(words)):
        word, following = lower[i], lower[i + 1 : i + 2]
        if word in TRAILING or (i > start and _does_something(word, following)):
            break
        if word in ("of", "and"):
            if not phrase or not following or following[0] in TRAILING:
                break
            nouns += phrase[-1:] if lower[i - 1] not in MEASURES else []
            phrase.append(word)
        elif word not in DETERMINERS:
            phrase.append(words[i])
    while phrase and phrase[-1] in ("of", "and"):
        phrase.pop()
    named = tuple(dict.fromkeys(noun.lower() for noun in [*nouns, *phrase[-1:]]))
    if not named or not NO_NAMES.isdisjoint([*named, phrase[0].lower()]):
        return None  # "something sweet" names nothing
    return Subject(" ".join(phrase), named)


def _measures(lower: list[str], i: int) -> bool:
    return lower[i] in MEASURES and lower[i + 1 : i + 2] == ["of"]


def _does_something(word: str, following: list[str]) -> bool:
    """Whether a word in -ing or -ed goes on to tell ("cat wearing a hat", "lid covered with moss")
    instead of belonging to the name ("old sailing ship", "weathered bench")."""
    verbal = (word.endswith("ing") and len(word) > 5 and word not in NAMES_IN_ING) or (
        word.endswith("ed") and len(word) > 5
    )
    return verbal and (not following or following[0] in TRAILING | DETERMINERS)
