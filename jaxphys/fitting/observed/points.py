"""Clouds of points, of which nobody knows which is which."""

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import ClassVar

import jax.numpy as jnp
import numpy as np
from scipy.spatial import cKDTree

from jaxphys.core.errors import InputError
from jaxphys.fitting.observed.base import Observed, refuse_outside, refuse_unknown, size_of

SHARE = 5e-3  # of the object's size: the noise that is expected where none is given
APART = 0.5  # of the object's size: clouds further apart than that are first brought together
DIRECTIONS, QUANTILES = 32, 64
MATCHED = ("seen", "made", "seen_counts", "made_counts", "apart")


@dataclass(frozen=True, eq=False)
class Points(Observed):
    """Points on or in what moved, frame by frame, in any order and number.

    Each simulated point is compared with the nearest that was seen, and each that was seen with the
    nearest simulated one. Who is whose neighbour is found between iterations and held fixed
    meanwhile (as iterated closest points do; Besl and McKay 1992). Neighbours say little where two
    clouds hardly overlap: these frames are compared by their shadows along fixed directions, sorted
    (sliced Wasserstein distance; Bonneel et al. 2015).

    Attributes:
        clouds: T arrays (M_t, 3) [m].
        times: (T,) [s].
        particles: those that could have been seen, in the object's order; None: those that carry
            what is drawn.
        trim: share of the worst pairs each way that does not count, for parts that were hidden.
        noise: [m]; None: five thousandths of the object's size.
    """

    name: ClassVar[str] = "points"
    unit: ClassVar[str] = "m"
    clouds: Sequence[np.ndarray] = field(repr=False)
    times: np.ndarray
    particles: np.ndarray | None = field(default=None, repr=False)
    trim: float = 0.0

    def check_own(self, simulation, look):
        if len(self.clouds) != len(self.times):
            raise self.fail("clouds", f"{len(self.clouds)} of them for {len(self.times)} times")
        if not 0 <= self.trim < 1:
            raise self.fail("trim", f"is {self.trim}; give a share in [0, 1)")
        for frame, cloud in enumerate(self.clouds):
            cloud = np.asarray(cloud)
            if cloud.ndim != 2 or cloud.shape[1] != 3 or not len(cloud):
                raise self.fail("clouds", f"frame {frame} has shape {cloud.shape}; give (M, 3)")
            if not np.all(np.isfinite(cloud)):
                raise self.fail("clouds", f"frame {frame} has entries that are not finite")
            refuse_outside(self, "clouds", frame, cloud, simulation)
        count = simulation.config.particles
        if self.particles is not None:
            refuse_unknown(self, np.asarray(self.particles), count)
        if not len(self._which(simulation)):
            raise InputError("points.particles: nothing is drawn; name the particles")

    def _which(self, simulation) -> np.ndarray:
        return np.asarray(simulation.carriers if self.particles is None else self.particles)

    def noise_of(self, simulation):
        return self.noise or SHARE * size_of(simulation)

    def data(self, simulation, look):
        longest = max(len(cloud) for cloud in self.clouds)
        which = self._which(simulation)
        padded = np.zeros((len(self.clouds), longest, 3))
        real = np.zeros((len(self.clouds), longest), bool)
        for frame, cloud in enumerate(self.clouds):
            padded[frame, : len(cloud)] = cloud
            real[frame, : len(cloud)] = True
        size = size_of(simulation)
        directions = np.random.default_rng(0).normal(size=(DIRECTIONS, 3))
        directions /= np.linalg.norm(directions, axis=1, keepdims=True)
        dtype = simulation.model.mass.dtype
        frames = len(self.clouds)
        return {
            "which": jnp.asarray(which, jnp.int32),
            "cloud": jnp.asarray(padded, dtype),
            "real": jnp.asarray(real),
            "certainty": jnp.asarray(self.weight**0.5 / self.noise_of(simulation), dtype),
            "size": jnp.asarray(size, dtype),
            "directions": jnp.asarray(directions, dtype),
            # Of each simulated point the nearest that was seen, and the other way round.
            "seen": jnp.zeros((frames, len(which)), jnp.int32),
            "made": jnp.zeros((frames, longest), jnp.int32),
            "seen_counts": jnp.ones((frames, len(which)), dtype),
            "made_counts": jnp.ones((frames, longest), dtype),
            "apart": jnp.zeros((frames,), bool),
        }

    def matched(self, motion, look, data):
        which, found = np.asarray(data["which"]), dict(data)
        for name in MATCHED:
            found[name] = np.array(data[name])
        for frame, cloud in enumerate(self.clouds):
            made = np.asarray(motion.position[frame])[which]
            there, seen = cKDTree(cloud).query(made)
            back, nearest = cKDTree(made).query(cloud)
            count = len(cloud)
            found["seen"][frame] = seen
            found["made"][frame, :count] = nearest
            found["seen_counts"][frame] = self._counts(there)
            found["made_counts"][frame] = 0
            found["made_counts"][frame, :count] = self._counts(back)
            shift = np.linalg.norm(np.mean(made, axis=0) - np.mean(cloud, axis=0))
            found["apart"][frame] = shift > APART * float(data["size"])
        return {name: jnp.asarray(value) for name, value in found.items()}

    def _counts(self, distance: np.ndarray) -> np.ndarray:
        return (distance <= np.quantile(distance, 1 - self.trim)).astype(float)

    def residuals(self, motion, look, data):
        made = motion.position[:, data["which"]]
        cloud = data["cloud"]
        to_seen = made - jnp.take_along_axis(cloud, data["seen"][..., None], axis=1)
        to_made = jnp.take_along_axis(made, data["made"][..., None], axis=1) - cloud
        near = ~data["apart"][:, None]
        # Each way counts as much, however many points there are.
        ways = [
            to_seen * (data["seen_counts"] * near)[..., None] / made.shape[1] ** 0.5,
            to_made * (data["made_counts"] * near)[..., None]
            / jnp.sum(data["real"], axis=1)[:, None, None] ** 0.5,
        ]  # fmt: skip
        shadows = self._shadows(made, data) * data["apart"][:, None, None]
        flat = [part.reshape(part.shape[0], -1) for part in (*ways, shadows)]
        # As many independent points as the smaller of the two clouds has.
        fewest = min(made.shape[1], cloud.shape[1])
        return jnp.concatenate(flat, axis=1) * (data["certainty"] * fewest**0.5)

    def _shadows(self, made, data):
        """Differences of quantiles of the clouds along each direction, (T, DIRECTIONS,
        QUANTILES)."""
        shares = (jnp.arange(QUANTILES) + 0.5) / QUANTILES
        axes = data["directions"]
        own = jnp.sort(jnp.sum(made[:, None] * axes[:, None], axis=-1), axis=-1)
        own = own[..., (shares * own.shape[-1]).astype(int)]
        shadow = jnp.sum(data["cloud"][:, None] * axes[:, None], axis=-1)
        shadow = jnp.sort(jnp.where(data["real"][:, None], shadow, jnp.inf), axis=-1)
        at = (shares * jnp.sum(data["real"], axis=1)[:, None]).astype(int)[:, None]
        shadow = jnp.take_along_axis(shadow, jnp.broadcast_to(at, own.shape), axis=-1)
        return (own - shadow) / own[0].size ** 0.5
