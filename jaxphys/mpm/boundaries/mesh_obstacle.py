"""A solid whose signed distance was sampled from a mesh."""

from dataclasses import dataclass, field, replace
from typing import Any, ClassVar, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array

from jaxphys.core.errors import InputError
from jaxphys.core.fields import between
from jaxphys.mpm.boundaries.base import DERIVED, LENGTH, STATIC, Setting, array_of
from jaxphys.mpm.boundaries.free import Solid
from jaxphys.mpm.boundaries.obstacle import Obstacle, length_and_direction


class Samples(NamedTuple):
    """A signed distance on a regular grid, in units of a solid's longest side.

    distance: (nx, ny, nz); first: place of node (0, 0, 0), from the centre of the solid's bounding
    box, (3,); pitch: between nodes, ().
    """

    distance: Any
    first: Any
    pitch: Any


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class MeshObstacle(Obstacle):
    """A closed mesh, or a hollow in the shape of one.

    The file is read and its signed distance sampled when a scene is built. Between the samples
    distance is linear along each axis, and its gradient gives the normal: edges finer than the
    samples are rounded.

    Attributes:
        centre, orientation, motion, inside, surface, friction, start, end: as for any `Obstacle`;
            the centre is that of the bounding box.
        source: path of a mesh; y up in .glb, .gltf and .obj.
        size: longest side of its bounding box, before it is turned [m].
        resolution: samples along the longest side.
        samples: of the signed distance.
        unit: the solid where its longest side is 1, for a free one.
    """

    type: ClassVar[str] = "mesh"
    source: str = field(metadata=STATIC)
    size: float = field(metadata=LENGTH)
    resolution: int = field(default=48, kw_only=True, metadata=STATIC | between(4, 512))
    samples: Samples | None = field(
        default=None, kw_only=True, repr=False, compare=False, metadata=DERIVED
    )
    unit: Solid | None = field(
        default=None, kw_only=True, repr=False, compare=False, metadata=DERIVED
    )

    def prepared(self, setting: Setting):
        if self.samples is None:
            raise InputError(
                "source: is read when a scene is built; give `samples` where none is built"
            )
        if self.free and self.unit is None:
            raise InputError("motion: a free mesh needs its `unit` where no scene is built")
        samples, unit = jax.tree.map(
            lambda x: jnp.asarray(x, setting.dtype), (self.samples, self.unit)
        )
        return super(MeshObstacle, replace(self, samples=samples, unit=unit)).prepared(setting)

    def solid(self):
        s, unit = array_of(self.size), self.unit
        assert unit is not None  # of a prepared one
        return Solid(
            volume=s**3 * unit.volume,
            middle=s * unit.middle,
            inertia=s**5 * unit.inertia,
            area=s**2 * unit.area,
            levers=s**2 * unit.levers,
            points=s * unit.points,
            radius=s * unit.radius,
        )

    def sides(self, x):
        samples = self._samples
        # Beyond the samples, as far again as to the nearest of them: less than it is.
        shape = samples.distance.shape
        at = [(x[i] / self.size - samples.first[i]) / samples.pitch for i in range(3)]
        within = [jnp.clip(a, 0, n - 1) for a, n in zip(at, shape, strict=True)]
        distance, slope = interpolated(samples.distance, within)
        beyond, _ = length_and_direction([a - w for a, w in zip(at, within, strict=True)])
        return [(self.size * (distance + beyond * samples.pitch), length_and_direction(slope)[1])]

    @property
    def _samples(self) -> Samples:
        assert self.samples is not None  # of a prepared one
        return self.samples

    @property
    def reach(self):
        samples = self._samples
        last = samples.first + samples.pitch * (np.array(samples.distance.shape) - 1)
        corner = jnp.maximum(jnp.abs(samples.first), jnp.abs(last))
        return array_of(self.size) * jnp.sqrt(jnp.sum(corner**2))


def interpolated(samples: Array, at) -> tuple[Array, list[Array]]:
    """Value (...) and slope (three arrays) between samples (nx, ny, nz), linear along each axis.

    at: places in steps of the samples, three arrays (...), each within [0, n - 1].
    """
    base, share = [], []
    for place, n in zip(at, samples.shape, strict=True):
        # What is no number must not address anything either.
        node = jnp.clip(jnp.floor(place).astype(jnp.int32), 0, n - 2)
        base.append(node)
        share.append(place - node)
    _, ny, nz = samples.shape
    flat, first = samples.reshape(-1), (base[0] * ny + base[1]) * nz + base[2]

    def corner(i, j, k):
        return flat.at[first + (i * ny + j) * nz + k].get(mode="promise_in_bounds")

    c = [[[corner(i, j, k) for k in (0, 1)] for j in (0, 1)] for i in (0, 1)]
    u, v, w = share

    def mixed(both, s):
        low, high = both
        return low + s * (high - low)

    edges = [[mixed(c[i][j], w) for j in (0, 1)] for i in (0, 1)]
    sides = [mixed(edges[i], v) for i in (0, 1)]
    steps = [mixed([c[i][j][1] - c[i][j][0] for j in (0, 1)], v) for i in (0, 1)]
    slope = [
        sides[1] - sides[0],
        mixed([edges[i][1] - edges[i][0] for i in (0, 1)], u),
        mixed(steps, u),
    ]
    return mixed(sides, u), slope
