"""The registry: what a kind of object is called, what of it can have which colour, and how its
shape may vary. A kind is a function of its options and a generator that returns parts by name:

    @kind(
        "teapot",
        "kitchen",
        also=("tea pot",),
        colours=dict(body="white|light blue", lid="=body", handle="=body", spout="=body"),
        sizes=dict(spout="short 0.7|1|long 1.6"),
        forms=dict(height="flat 0.8|1|tall 1.25"),
    )
    def teapot(o, rng):
        return dict(body=ball(0.4, 0.4, 0.35 * o.height), ...)

Colours: for each part its usual ones, the first part giving the colour of the whole ("a blue
teapot"). "=part" is the colour of that part unless said; a leading "!" means never another one (a
tyre). Options, all read as `o.name`, the unmarked value being the default:

    sizes   adjectives of a part: "with a long spout"
    forms   adjectives of the whole: "a tall teapot"; words alone give themselves, and the default
            is a first "plain" or the one with a star: "plain|striped", "*striped|plain"
    counts  how many, "1|2|3": "with three layers"
    extras  the chance that something is there: "with a saucer"
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from types import SimpleNamespace

import numpy as np

from jaxphys.library.palette import COLOURS
from jaxphys.library.solids import Parts

Make = Callable[[SimpleNamespace, np.random.Generator], Parts]


@dataclass(frozen=True)
class Option:
    """How one thing varies.

    type: "size", "form", "count" or "extra".
    values: word -> value; the word "" is the default's, which goes without saying.
    chance: for extras, of being there.
    """

    name: str
    type: str
    values: Mapping[str, float | str | int | bool]
    chance: float = 0.5


@dataclass(frozen=True)
class Kind:
    """One kind of object; see the module's text."""

    name: str
    family: str
    also: tuple[str, ...]
    colours: Mapping[str, tuple[str, ...]]
    same: Mapping[str, str]
    fixed: frozenset[str]
    options: Mapping[str, Option]
    make: Make

    @property
    def main(self) -> str:
        """The part whose colour is the whole's."""
        return next(iter(self.colours))

    @property
    def nouns(self) -> tuple[str, ...]:
        return (self.name, *self.also)


KINDS: dict[str, Kind] = {}


def number(text: str) -> float | int | str:
    for read in (int, float):
        try:
            return read(text)
        except ValueError:
            continue
    return text


COUNTS = (
    "no", "one", "two", "three", "four", "five", "six", "seven", "eight", "nine", "ten", "eleven",
    "twelve",
)  # fmt: skip


def read_values(name: str, kind: str, text: str) -> dict:
    """The values of one option as it is written, see the module's text."""
    values: dict[str, float | str | int] = {}
    for index, entry in enumerate(text.split("|")):
        words, _, last = entry.strip().rpartition(" ")
        value = number(last)
        if kind == "count":
            values[COUNTS[int(last)]] = int(last)
        elif isinstance(value, str):  # a word alone stands for itself; the first is the default
            word = entry.strip().removeprefix("*")
            values["" if entry.startswith("*") or (index == 0 and word == "plain") else word] = word
        else:
            values[words] = float(value)
    if kind == "size" and "" not in values:
        raise ValueError(f"option {name!r}: no default among {text!r}")
    return values


def kind(
    name: str,
    family: str,
    *,
    also: tuple[str, ...] = (),
    colours: Mapping[str, str],
    sizes: Mapping[str, str] | None = None,
    forms: Mapping[str, str] | None = None,
    counts: Mapping[str, str] | None = None,
    extras: Mapping[str, float] | None = None,
) -> Callable[[Make], Make]:
    """Declares the function below as the maker of the kind `name`."""
    usual: dict[str, tuple[str, ...]] = {}
    same: dict[str, str] = {}
    fixed = set()
    for part, text in colours.items():
        if text.startswith("="):
            same[part] = text[1:]
            usual[part] = usual[text[1:]]
            continue
        if text.startswith("!"):
            fixed.add(part)
        usual[part] = tuple(text.lstrip("!").split("|"))
        unknown = set(usual[part]) - set(COLOURS)
        if unknown:
            raise ValueError(f"{name}, {part}: no colour is called {sorted(unknown)}")
    options = {}
    for type_, given in (("size", sizes), ("form", forms), ("count", counts)):
        for key, text in (given or {}).items():
            options[key] = Option(key, type_, read_values(key, type_, text))
    for key, chance in (extras or {}).items():
        options[key] = Option(key, "extra", {"": False, "with": True}, chance)

    def declare(make: Make) -> Make:
        if name in KINDS:
            raise ValueError(f"there are two kinds called {name!r}")
        KINDS[name] = Kind(name, family, also, usual, same, frozenset(fixed), options, make)
        return make

    return declare
