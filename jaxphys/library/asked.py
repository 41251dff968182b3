"""What words ask for: a kind, colours of its parts and words of its options."""

import re
from collections.abc import Iterable
from typing import NamedTuple

from jaxphys.library import KINDS
from jaxphys.library.kinds import Kind, Option
from jaxphys.library.palette import COLOURS
from jaxphys.library.patterns import STYLES

# Behind a noun that names the object ("a mug of tea", "a house on a hill"), unless it is the last.
FOLLOWS = r"(?=$|\s(?:of|with|without|on|in|for|from|that|made|and|wearing|at)\b)"
SPELLINGS = {"gray": "grey", "gold": "golden", "wood": "wooden", "violet": "purple"}
ABSENT = r"\b(?:no|without)\b"


class Asked(NamedTuple):
    """The kind's name, and what of it is fixed, as `library.build` takes it."""

    kind: str
    given: dict[str, tuple[str, ...]]


def asked(phrases: Iterable[str]) -> Asked | None:
    """What a prompt in phrases asks for, None where its object is of no known kind.

    Args:
        phrases: of `guidance.guides.phrases_of`: the object with all that is before the first
            comma, then one thing each.
    """
    head, *others = (_plain(phrase) for phrase in phrases)
    found = _noun(head)
    if found is None:
        return None
    kind, before = found
    given: dict[str, tuple[str, ...]] = {}
    # A phrase that names the object again is its part without what comes behind "with".
    for phrase in (before, *(o for o in others if _part(kind, o) or _noun(o) is None)):
        for name, word in _traits(kind, phrase):
            given[name] = (*given.get(name, ()), word)
    return Asked(kind.name, given)


def _plain(text: str) -> str:
    words = re.findall(r"[\w'-]+", text.lower())
    return " ".join(SPELLINGS.get(word, word) for word in words)


def _noun(head: str) -> tuple[Kind, str] | None:
    """The kind that a phrase names, by its longest name in there, and the words before it. What
    comes behind "with" is a part, unless the name itself goes on there.
    """
    best: tuple[int, Kind, str] | None = None
    end = re.search(r"\bwith\b|$", head).start()  # type: ignore[union-attr]
    for kind in KINDS.values():
        for noun in kind.nouns:
            plain = _plain(noun)
            stem = plain.removesuffix("s").removesuffix("y")
            if stem.split(" with ")[0] not in head:
                continue
            # The flowers of a vase with flowers may be blue ones.
            pattern = re.escape(stem).replace(r"\ with\ ", r"\ with\ (?:[\w-]+ )*")
            match = re.search(rf"\b{pattern}(?:s|es|y|ies)?\b{FOLLOWS}", head)
            if match and match.start() < end and (best is None or len(plain) > best[0]):
                best = len(plain), kind, head[: match.start()].strip()
    return best and best[1:]


def _part(kind: Kind, phrase: str) -> str | None:
    """The part or option that a phrase is about, its longest name in there."""
    names = {*kind.colours, *(n for n, o in kind.options.items() if o.type != "form")}
    spoken = {
        name: rf"\b{re.escape(name.replace('_', ' ').removesuffix('s'))}(?:s|es)?\b"
        for name in names
    }
    if "pattern" in names:
        styles = {STYLES[w] for o in kind.options.values() for w in o.values if w in STYLES}
        spoken["pattern"] = rf"\b(?:{'|'.join(styles)})\b"
    found = [name for name, pattern in spoken.items() if re.search(pattern, phrase)]
    return max(found, key=len, default=None)


def _colour(phrase: str) -> str | None:
    found = [name for name in COLOURS if re.search(rf"\b{name}\b", phrase)]
    return max(found, key=len, default=None)


def _traits(kind: Kind, phrase: str) -> list[tuple[str, str]]:
    """What one phrase fixes: names with words."""
    part, colour = _part(kind, phrase), _colour(phrase)
    given = []
    if colour is not None and (part is None or part in kind.colours):
        given.append((part or kind.main, colour))
    for name, option in kind.options.items():
        if option.type == "extra" and name == part:
            given.append((name, "" if re.search(ABSENT, phrase) else "with"))
        elif option.type == "form" or (name == part and option.type != "extra"):
            given += [(name, word) for word in _spoken(option, phrase)]
    return given


def _spoken(option: Option, phrase: str) -> list[str]:
    """The words of an option that a phrase says, "stripes" for "striped" too."""
    said = {word: rf"\b(?:{word}|{STYLES.get(word, word)})\b" for word in option.values if word}
    return [word for word, pattern in said.items() if re.search(pattern, phrase)]
