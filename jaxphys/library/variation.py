"""What one variant of a kind looks like: which colours and options it gets, and which combinations
are never drawn, so that tests can ask whether a prior composes what it has seen apart.
"""

import zlib
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from types import SimpleNamespace

import numpy as np

from jaxphys.library.kinds import Kind
from jaxphys.library.palette import BRIGHT, COLOURS, MATERIALS, jitter, texture

UNUSUAL_WHOLE = 0.4  # chance that the whole has a colour that it does not usually have
UNUSUAL_NATURE = 0.2  # the same of what grows or is eaten
NATURE = {"animals", "plants", "fruit", "vegetables", "food", "sweets", "nature"}
UNUSUAL_PARTS = (0.5, 0.35, 0.15)  # chances that none, one, two of the other parts do
UNMARKED = (0.4, 0.4, 0.2)  # chances that none, one, two of sizes and forms are not the default
VARIETY = 0.06  # relative spread of every number beyond what the words say

# Combinations that are held out beside the hashed ones, for the tables of the documents.
HELD_OUT = {
    ("teapot", "body", "blue"),
    ("mug", "body", "purple"),
    ("rubber duck", "body", "green"),
    ("car", "body", "pink"),
    ("chair", "seat", "turquoise"),
    ("teddy bear", "fur", "blue"),
    ("teapot", "spout", "long"),
    ("cake", "layers", "three"),
    ("mug", "height", "tall"),
}
HASHED = 10  # one in so many unusual combinations of a kind and a colour is held out


def held_out(kind: str, name: str, word: str) -> bool:
    """Whether the kind is never drawn with this colour of a part, or word of an option."""
    if (kind, name, word) in HELD_OUT:
        return True
    if word not in BRIGHT:
        return False
    return zlib.crc32(f"{kind}/{name}/{word}".encode()) % HASHED == 0


@dataclass(frozen=True)
class Choice:
    """colours: the colour's name of each part; unusual: the parts that captions must name;
    words: the word of each option; values: what its maker reads.
    """

    colours: Mapping[str, str]
    unusual: frozenset[str]
    words: Mapping[str, str]
    values: Mapping[str, float | str | int | bool]


Given = Mapping[str, str | tuple[str, ...]]
"""Colours of parts and words of options by name; several of what is both, ("long", "blue")."""


def pairs(given: Given | None) -> list[tuple[str, str]]:
    """Each name with each of its words, in order: later ones count."""
    several = {n: (w,) if isinstance(w, str) else w for n, w in (given or {}).items()}
    return [(name, word) for name, words in several.items() for word in words]


def choose(kind: Kind, rng: np.random.Generator, given: Given | None = None) -> Choice:
    """A random variant that is not held out; `given` fixes colours of parts and words of options
    (held out or not, as a test or a user asks).

    Raises KeyError for a part, option or word that the kind does not have.
    """
    colours, unusual = choose_colours(kind, rng)
    words = choose_words(kind, rng)
    for name, word in pairs(given):
        if name in kind.options and word in kind.options[name].values:
            words[name] = word
        elif name in kind.colours and word in COLOURS:
            colours[name] = word
            if word not in kind.colours[name] or name in kind.same:
                unusual.add(name)
        else:
            raise KeyError(f"{kind.name} has no {name} {word!r}")
    for part, reference in kind.same.items():
        if part not in unusual:
            colours[part] = colours[reference]
    values = {}
    for name, word in words.items():
        value = kind.options[name].values[word]
        if isinstance(value, float):
            value *= np.exp(VARIETY * np.clip(rng.normal(), -2, 2))
        values[name] = value
    return Choice(colours, frozenset(unusual), words, values)


def choose_colours(kind: Kind, rng: np.random.Generator) -> tuple[dict[str, str], set[str]]:
    free = [part for part in kind.colours if part not in kind.fixed and part != kind.main]
    count = min(len(free), int(rng.choice(3, p=UNUSUAL_PARTS)))
    unusual = set(rng.choice(free, count, replace=False)) if count else set()
    chance = UNUSUAL_NATURE if kind.family in NATURE else UNUSUAL_WHOLE
    if kind.main not in kind.fixed and rng.random() < chance:
        unusual.add(kind.main)
    colours = {}
    for part, usual in kind.colours.items():
        if part in unusual:
            every = MATERIALS if part == kind.main and rng.random() < 0.15 else BRIGHT
            others = [c for c in every if c not in usual and not held_out(kind.name, part, c)]
            colours[part] = str(rng.choice(others))
        else:
            weights = np.array([2.0] + [1.0] * (len(usual) - 1))
            colours[part] = str(rng.choice(usual, p=weights / weights.sum()))
    return colours, {str(part) for part in unusual}


def choose_words(kind: Kind, rng: np.random.Generator) -> dict[str, str]:
    words, markable = {}, []
    for name, option in kind.options.items():
        allowed = [w for w in option.values if not held_out(kind.name, name, w)]
        if option.type == "extra":
            words[name] = "with" if rng.random() < option.chance else ""
        elif "" in option.values:
            words[name] = ""
            markable.append((name, [w for w in allowed if w]))
        else:
            words[name] = str(rng.choice(allowed))
    count = min(len(markable), int(rng.choice(3, p=UNMARKED)))
    for index in rng.choice(len(markable), count, replace=False) if count else ():
        name, marked = markable[index]
        words[name] = str(rng.choice(marked)) if marked else ""
    return words


PLAIN = {name: np.array(colour) for name, colour in COLOURS.items()}


def paints(kind: Kind, choice: Choice, rng: np.random.Generator) -> tuple[dict, dict]:
    """The colour (3,) of each part and of each plain colour, and the textures of those parts whose
    material has one.
    """
    colours, textures = dict(PLAIN), dict[str, Callable]()
    for part, name in choice.colours.items():
        reference = kind.same.get(part)
        if reference is not None and part not in choice.unusual:
            colours[part] = colours[reference]
            if reference in textures:
                textures[part] = textures[reference]
            continue
        colours[part] = jitter(rng, COLOURS[name])
        if (made := texture(name, rng, 1.0)) is not None:
            textures[part] = made
    return colours, textures


def options_of(choice: Choice) -> SimpleNamespace:
    """The options as a maker reads them."""
    return SimpleNamespace(**choice.values)
