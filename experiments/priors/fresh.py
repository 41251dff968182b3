"""Fresh objects at every step: what a training batch reads instead of stored variants."""

from collections.abc import Sequence

import numpy as np

from experiments.priors.data.splat import bake_light
from experiments.priors.models import KINDS, sample


def kind_of(item: str) -> str | None:
    """The kind of an item by its name, None of what is not parametric."""
    source, _, rest = item.partition("-")
    kind = rest.rpartition("-")[0].replace("_", " ")
    return kind if source == "parametric" and kind in KINDS else None


def fresh_clouds(
    kinds: Sequence[str], points: int, rng: np.random.Generator
) -> tuple[np.ndarray, np.ndarray, list[str]]:
    """A new variant of each of `kinds`: points (B, N, 3) float16, lit colours (B, N, 3) uint8 and a
    caption each, as the stored ones have them.
    """
    clouds, paints, captions = [], [], []
    for kind in kinds:
        drawn = sample(kind, rng, points)
        lit = bake_light(drawn.colours, drawn.normals)
        clouds.append(drawn.points.astype(np.float16))
        paints.append(np.rint(255 * lit).astype(np.uint8))
        captions.append(drawn.caption)
    return np.stack(clouds), np.stack(paints), captions
