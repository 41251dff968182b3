"""What the field of a cloud is at places around it: the targets of the autoencoder."""

from typing import NamedTuple

import numpy as np
from scipy.spatial import cKDTree

from experiments.priors.clouds import Cloud
from jaxphys.guidance.bundled.shape_autoencoder import AutoencoderConfig

NEAR, AROUND = 0.5, 0.3  # shares of the places; the rest is anywhere
SPREADS = 0.012, 0.05  # how far those stand off the surface, standard deviations
HALF = 0.56  # half the side of the box around everything
SPACING = 1.5  # of the cloud's spacing: sideways distances up to it are gaps between points


class Targets(NamedTuple):
    """Places (Q, 3), signed distance (Q,) as `Field` has it, colour (Q, 3) of what is nearest."""

    places: np.ndarray
    distance: np.ndarray
    colour: np.ndarray


def field_targets(
    cloud: Cloud, count: int, rng: np.random.Generator, config: AutoencoderConfig
) -> Targets:
    """The field of a dense cloud at `count` random places, most of them near it."""
    near, around = int(NEAR * count), int(AROUND * count)
    at = rng.integers(0, len(cloud.points), near + around)
    spread = np.repeat(SPREADS, (near, around))[:, None]
    places = np.concatenate(
        [
            cloud.points[at] + spread * rng.normal(size=(near + around, 3)),
            rng.uniform(-HALF, HALF, (count - near - around, 3)),
        ]
    )
    return Targets(places, *field_at(cloud, places, config))


def field_at(
    cloud: Cloud, places: np.ndarray, config: AutoencoderConfig
) -> tuple[np.ndarray, np.ndarray]:
    """Signed distance (Q,) and colour (Q, 3) at places (Q, 3)."""
    tree = cKDTree(cloud.points)
    distance, nearest = tree.query(places)
    offset = places - cloud.points[nearest]
    # Between samples the surface goes on: what separates a place from it is the height above the
    # nearest point's plane, and sideways only what is more than the gaps.
    height = np.abs((offset * cloud.normals[nearest]).sum(1))
    sideways = np.sqrt(np.maximum(distance**2 - height**2, 0))
    spacing = SPACING * np.median(tree.query(cloud.points[::16], k=2)[0][:, 1])
    distance = np.hypot(height, np.maximum(sideways - spacing, 0))
    signed = np.where(cloud.inside(places), -distance, distance) - config.thickness
    return np.clip(signed, -config.reach, config.reach), cloud.colours[nearest]
