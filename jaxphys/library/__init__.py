"""Parametric coloured objects: `build(kind, seed)` makes one, the same for the same seed.

`KINDS` lists what there is; `kinds.py` says how a new one is written. World frame: z up, the front
faces +x, centred, longest side of the bounding box 1.
"""

import zlib
from typing import NamedTuple

import numpy as np

from jaxphys.library import families  # noqa: F401  (declares the kinds)
from jaxphys.library.kinds import KINDS, Kind
from jaxphys.library.model import Model, finish
from jaxphys.library.solids import listed
from jaxphys.library.variation import Choice, Given, choose, options_of, paints, pairs
from jaxphys.library.words import caption

__all__ = ["KINDS", "PRINCIPAL", "Built", "Kind", "Sample", "build", "captions", "sample", "usual"]

# The objects a user is most likely to ask for first: they are drawn more often than the others.
PRINCIPAL = (
    "strawberry", "rose", "ice cream", "salmon nigiri", "pancakes", "can", "microphone", "sponge",
    "burger", "vase with flowers", "guitar", "teddy bear",
)  # fmt: skip


class Built(NamedTuple):
    """A variant of a kind: its model, what was chosen for it, and which parts it has."""

    kind: Kind
    model: Model
    choice: Choice
    present: frozenset[str]

    @property
    def attributes(self) -> dict:
        """Colours by part (of those that are there) and words by option, as plain data."""
        colours = {part: c for part, c in self.choice.colours.items() if part in self.present}
        return {"kind": self.kind.name, "colours": colours, "options": dict(self.choice.words)}


class Sample(NamedTuple):
    """Points (N, 3) in [-0.5, 0.5], albedo (N, 3) in [0, 1], outward unit normals (N, 3), and what
    they are in words."""

    points: np.ndarray
    colours: np.ndarray
    normals: np.ndarray
    caption: str
    attributes: dict


def make(kind: Kind, rng: np.random.Generator, given: Given | None = None) -> Built:
    """A random variant; `given` fixes colours by part and words by option."""
    choice = choose(kind, rng, given)
    parts = {n: listed(s) for n, s in kind.make(options_of(choice), rng).items()}
    parts = {name: solids for name, solids in parts.items() if solids}
    colours, textures = paints(kind, choice, rng)
    coats = {name for solids in parts.values() for s in solids for name, _ in s.coats if name}
    present = (set(parts) | coats) & set(kind.colours)
    # A part that nobody declared and that is not named as a colour is like the whole.
    for name in set(parts) - set(colours):
        colours[name] = colours[kind.main]
        if kind.main in textures:
            textures[name] = textures[kind.main]
    return Built(kind, finish(parts, colours, textures), choice, frozenset(present))


def build(name: str, seed: int, given: Given | None = None) -> Built:
    """One variant of the kind `name`, the same for the same seed; `given` fixes colours by part and
    words by option, as {"spout": "long", "lid": "red"}."""
    return make(KINDS[name], np.random.default_rng([zlib.crc32(name.encode()), seed]), given)


def usual(name: str, seed: int, given: Given | None = None) -> Built:
    """One variant with the colours that the kind usually has, as captions without colours mean,
    but for what is `given`."""
    kind = KINDS[name]
    fixed = {part: (kind.colours[part][0],) for part in kind.colours if part not in kind.same}
    for part, word in pairs(given):
        fixed[part] = (*fixed.get(part, ()), word)
    for number in range(seed, seed + 1_000_000, 10_000):
        if not build(name, number).choice.unusual & set(kind.same) - set(fixed):
            return build(name, number, fixed)
    raise AssertionError(f"no variant of {name} with its usual colours")


def captions(built: Built, count: int, rng: np.random.Generator) -> list[str]:
    """Several ways to say what it is, without repetitions."""
    said = [caption(built.kind, built.choice, built.present, rng) for _ in range(count)]
    return list(dict.fromkeys(said))


def sample(name: str, rng: np.random.Generator, count: int = 4096) -> Sample:
    """Fresh surface points of a random variant of the kind `name`, with a caption."""
    built = make(KINDS[name], rng)
    surface = built.model.sample(count, rng)
    return Sample(*surface, captions(built, 1, rng)[0], built.attributes)
