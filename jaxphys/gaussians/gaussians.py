"""3D Gaussians: the parameters that optimisation changes and files hold (Kerbl et al. 2023)."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array
from jax.typing import ArrayLike

from jaxphys.core import algebra
from jaxphys.core.errors import InputError
from jaxphys.core.rotations import (
    matrix_to_quaternion,
    quaternion_product,
    quaternion_to_matrix,
)
from jaxphys.core.splats import Splats
from jaxphys.gaussians import harmonics as sh

# exp(2 * 30) = 1e26: covariances and what a deformation makes of them stay finite in float32.
LOG_SCALE_LIMIT = 30.0
# sigmoid(15) = 1 - 3e-7: an opacity of 0 or 1 becomes the nearest one with a usable gradient.
LOGIT_LIMIT = 15.0


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class Gaussians:
    """N Gaussians in the parameters that are optimised and stored.

    Attributes:
        means: centres [m], shape (N, 3).
        log_scales: logarithm of the standard deviation along each own axis [log m], shape (N, 3).
        quaternions: own axes as a rotation w, x, y, z of any length, shape (N, 4).
        opacity_logits: logit of the opacity, shape (N,).
        harmonics: colour as coefficients of real spherical harmonics, shape (N, K, 3) with
            K = (degree + 1)^2, degree 0 to 3; the colour is their value + 0.5.
    """

    means: Array
    log_scales: Array
    quaternions: Array
    opacity_logits: Array
    harmonics: Array

    @property
    def count(self) -> int:
        """The number of Gaussians."""
        return self.means.shape[0]

    @property
    def degree(self) -> int:
        """The degree of the harmonics, 0 to 3."""
        return sh.degree_of(self.harmonics.shape[1])


@jax.jit
def scales(gaussians: Gaussians) -> Array:
    """Standard deviations along the own axes [m], shape (N, 3), kept within [1e-13, 1e13]."""
    limit = LOG_SCALE_LIMIT
    return jnp.exp(jnp.clip(gaussians.log_scales, -limit, limit))


def axes(gaussians: Gaussians) -> Array:
    """Own axes times standard deviations [m]: A (3, 3, N) with covariance A A^T.

    Particle axis last, for `core.algebra`. A zero quaternion is no rotation.
    """
    rotations = quaternion_to_matrix(gaussians.quaternions)
    return jnp.moveaxis(rotations * scales(gaussians)[:, None, :], 0, -1)


@jax.jit
def covariances(gaussians: Gaussians) -> Array:
    """R S S^T R^T [m^2], shape (N, 3, 3), symmetric to the last bit."""
    A = axes(gaussians)
    return jnp.moveaxis(algebra.matmul_transpose(A, A), -1, 0)


@jax.jit
def opacities(gaussians: Gaussians) -> Array:
    """Opacities in [0, 1], shape (N,)."""
    return jax.nn.sigmoid(gaussians.opacity_logits)


@jax.jit
def view_colours(
    harmonics: Array, means: Array, camera_position: Array, rotations: Array | None = None
) -> Array:
    """Colours as seen from a camera, max(harmonics(d) + 0.5, 0), shape (N, 3).

    Args:
        harmonics: (N, K, 3).
        means: where the Gaussians are now [m], (N, 3).
        camera_position: (3,) [m].
        rotations: how far each has turned since its harmonics were set, (N, 3, 3): the direction is
            turned back, d = R^T (mean - camera) (Xie et al. 2024, PhysGaussian).

    A Gaussian at the camera itself is seen along +z, with zero gradient to its position.
    """
    if harmonics.shape[1] == 1:
        return jnp.maximum(sh.dc_to_rgb(harmonics[:, 0]), 0)
    offset = means - camera_position
    squared = jnp.sum(offset**2, axis=-1, keepdims=True)
    apart = squared > 0
    ahead = jnp.array([0, 0, 1], offset.dtype)
    direction = jnp.where(apart, offset / jnp.sqrt(jnp.where(apart, squared, 1)), ahead)
    if rotations is not None:
        direction = algebra.total(
            rotations[:, axis, :] * direction[:, axis, None] for axis in range(3)
        )
    return jnp.maximum(sh.evaluate(harmonics, direction) + 0.5, 0)


@jax.jit
def to_splats(
    gaussians: Gaussians, camera_position: Array, rotations: Array | None = None
) -> Splats:
    """What a renderer draws from a camera at `camera_position` (3,) [m].

    With `rotations` (N, 3, 3) the view direction is turned back by them; means and covariances are
    drawn as they stand.
    """
    return Splats(
        gaussians.means,
        covariances(gaussians),
        opacities(gaussians),
        view_colours(gaussians.harmonics, gaussians.means, camera_position, rotations),
    )


@jax.jit
def opacity_to_logit(opacity: Array) -> Array:
    """Logit of opacities in [0, 1], clipped to +-15 so that 0 and 1 stay finite."""
    limit = 1 / (1 + math.exp(LOGIT_LIMIT))
    clipped = jnp.clip(opacity, limit, 1 - limit)
    return jnp.clip(jnp.log(clipped) - jnp.log1p(-clipped), -LOGIT_LIMIT, LOGIT_LIMIT)


def from_points(
    points: ArrayLike,
    colours: ArrayLike,
    sizes: ArrayLike,
    *,
    opacity: ArrayLike = 0.95,
    quaternions: ArrayLike | None = None,
    degree: int = 0,
) -> Gaussians:
    """Gaussians at `points` with one constant colour each.

    Args:
        points: (N, 3) [m].
        colours: RGB in [0, 1], (N, 3) or (3,).
        sizes: standard deviation [m]: a number, (N,), or (N, 3) along the own axes.
        opacity: in [0, 1], a number or (N,); 0 and 1 are moved by 3e-7 to keep the logit finite.
        quaternions: own axes w, x, y, z, (N, 4); none given, no rotation.
        degree: of the harmonics, 0 to 3; those above 0 start at zero.

    Raises:
        InputError: a shape does not fit, or the degree is not 0 to 3.
    """
    points = jnp.asarray(points)
    points = points.astype(jnp.result_type(points.dtype, jnp.float32))
    dtype, count = points.dtype, points.shape[0]
    if points.ndim != 2 or points.shape[1] != 3:
        raise InputError(f"points of shape {points.shape}: give (N, 3)")
    if not 0 <= degree <= sh.MAX_DEGREE:
        raise InputError(f"harmonics of degree {degree}: give 0 to {sh.MAX_DEGREE}")
    sizes = jnp.asarray(sizes, dtype)
    if sizes.ndim == 1:
        sizes = sizes[:, None]

    def fit(name: str, value, shape: tuple[int, ...]) -> Array:
        value = jnp.asarray(value, dtype)
        try:
            return jnp.broadcast_to(value, shape)
        except ValueError as error:
            raise InputError(
                f"{name} of shape {value.shape} for {count} points: give {shape}"
            ) from error

    return _from_points(
        points,
        fit("colours", colours, (count, 3)),
        fit("sizes", sizes, (count, 3)),
        fit("opacity", opacity, (count,)),
        fit(
            "quaternions",
            np.array([1, 0, 0, 0]) if quaternions is None else quaternions,
            (count, 4),
        ),
        degree,
    )


@partial(jax.jit, static_argnums=5)
def _from_points(
    points: Array, colours: Array, sizes: Array, opacity: Array, quaternions: Array, degree: int
) -> Gaussians:
    """As `from_points`, of arrays of the right shapes."""
    smallest, largest = math.exp(-LOG_SCALE_LIMIT), math.exp(LOG_SCALE_LIMIT)
    dc = sh.rgb_to_dc(colours)[:, None]
    rest = jnp.zeros((len(points), (degree + 1) ** 2 - 1, 3), points.dtype)
    return Gaussians(
        points,
        jnp.log(jnp.clip(sizes, smallest, largest)),
        quaternions,
        opacity_to_logit(opacity),
        jnp.concatenate([dc, rest], axis=1),
    )


def select(gaussians: Gaussians, index: Array | np.ndarray | slice) -> Gaussians:
    """The Gaussians at `index`: integers, a slice, or (outside jit) a mask (N,)."""
    if isinstance(index, slice):
        return jax.tree.map(lambda leaf: leaf[index], gaussians)
    if index.dtype == bool:
        index = np.flatnonzero(index)
    return _at(gaussians, index)


@jax.jit
def _at(gaussians: Gaussians, index: Array) -> Gaussians:
    # One program for all fields: building a scene is mostly compiling.
    return jax.tree.map(lambda leaf: leaf[index], gaussians)


def with_degree(gaussians: Gaussians, degree: int) -> Gaussians:
    """The same Gaussians with harmonics of another degree: padded with zeros, or cut."""
    count = (degree + 1) ** 2
    sh.degree_of(count)
    kept = gaussians.harmonics[:, :count]
    rest = jnp.zeros((gaussians.count, count - kept.shape[1], 3), kept.dtype)
    harmonics = jnp.concatenate([kept, rest], axis=1)
    return Gaussians(
        gaussians.means,
        gaussians.log_scales,
        gaussians.quaternions,
        gaussians.opacity_logits,
        harmonics,
    )


def concatenate(parts: Sequence[Gaussians]) -> Gaussians:
    """All Gaussians of `parts` in order, with the highest degree among them."""
    if not parts:
        raise InputError("no Gaussians to concatenate: give at least one set")
    return _joined(tuple(parts), max(part.degree for part in parts))


@partial(jax.jit, static_argnums=1)
def _joined(parts: tuple[Gaussians, ...], degree: int) -> Gaussians:
    padded = [with_degree(part, degree) for part in parts]
    return jax.tree.map(lambda *leaves: jnp.concatenate(leaves), *padded)


@jax.jit
def transform(
    gaussians: Gaussians,
    rotation: Array | None = None,
    scale: Array | float = 1.0,
    translation: Array | float = 0.0,
) -> Gaussians:
    """The Gaussians after x -> scale * rotation x + translation; harmonics turn along.

    Args:
        gaussians: to be moved.
        rotation: (3, 3), proper (det +1); none: no rotation.
        scale: a positive number.
        translation: (3,) [m].
    """
    dtype = gaussians.means.dtype
    scale = jnp.asarray(scale, dtype)
    means, quaternions = gaussians.means, gaussians.quaternions
    harmonics = gaussians.harmonics
    if rotation is not None:
        rotation = jnp.asarray(rotation, dtype)
        means = algebra.total(means[:, axis, None] * rotation[:, axis] for axis in range(3))
        # A zero quaternion stands for no rotation, and its product would stay zero.
        absent = jnp.sum(quaternions**2, axis=-1, keepdims=True) == 0
        identity = jnp.array([1, 0, 0, 0], dtype)
        quaternions = quaternion_product(
            matrix_to_quaternion(rotation), jnp.where(absent, identity, quaternions)
        )
        harmonics = sh.rotate(harmonics, rotation)
    return Gaussians(
        scale * means + jnp.asarray(translation, dtype),
        gaussians.log_scales + jnp.log(scale),
        quaternions,
        gaussians.opacity_logits,
        harmonics,
    )


def require_finite(gaussians: Gaussians, source: str) -> None:
    """Raises InputError naming `source`, the field and the first Gaussian that is not finite.

    For the border: it looks at values, so it cannot be called inside jit.
    """
    for name in ("means", "log_scales", "quaternions", "opacity_logits", "harmonics"):
        values = np.asarray(getattr(gaussians, name))
        bad = ~np.isfinite(values).all(axis=tuple(range(1, values.ndim)))
        if bad.any():
            raise InputError(
                f"{source}: {name} not finite for {bad.sum()} of {bad.size} Gaussians (first: "
                f"{np.argmax(bad)}); remove them"
            )
