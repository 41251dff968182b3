"""Parametric coloured models: `build(name, seed)` draws one, the same for the same seed.

World frame: z up, the front faces +x, centred, longest side of the bounding box 1.
"""

import zlib

import numpy as np

from . import dishes, plants, simple, sweets, things
from .surfaces import Mesh, normalise

MODELS = {**sweets.MODELS, **dishes.MODELS, **plants.MODELS, **things.MODELS, **simple.MODELS}

# The objects a user is most likely to ask for first: they get many more variants than the others.
PRINCIPAL = (
    "strawberry",
    "rose",
    "ice cream",
    "salmon nigiri",
    "pancakes",
    "can",
    "microphone",
    "sponge",
    "burger",
    "vase with flowers",
    "guitar",
    "teddy bear",
)


def build(name: str, seed: int) -> tuple[Mesh, list[str]]:
    """One random variant of the model `name`: its normalised mesh and captions, most general
    first.
    """
    rng = np.random.default_rng([zlib.crc32(name.encode()), seed])
    mesh, captions = MODELS[name](rng)
    return normalise(mesh), captions
