"""Where particles meet Gaussians: a Gaussian goes where its particle goes and stretches with it.

A Gaussian at X with covariance S becomes one at phi(X) with covariance F S F^T, the push-forward by
the deformation map linearised at X; its colour is looked up along the view direction turned back by
the rotation R of F = R U (Xie et al. 2024, PhysGaussian).

Who carries which Gaussian is the motion's to know (`mpm.motion.Frame.carried`): here the i-th
position is that of the i-th Gaussian.
"""

from dataclasses import dataclass

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array

from jaxphys.core import algebra
from jaxphys.core.errors import InputError
from jaxphys.core.program import part
from jaxphys.core.rotations import matrix_to_quaternion
from jaxphys.core.spectral import polar_rotation
from jaxphys.core.splats import Splats
from jaxphys.gaussians import harmonics as sh
from jaxphys.gaussians.colour import ColourRange, regularise
from jaxphys.gaussians.gaussians import Gaussians, axes, opacities, view_colours


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class Similarity:
    """The solver's frame seen from the world: x_solver = scale * rotation x_world + translation.

    Attributes:
        rotation: (3, 3), proper.
        scale: solver length of a unit of world length, above 0, a scalar.
        translation: (3,), in solver units.
    """

    rotation: Array
    scale: Array
    translation: Array


def to_solver(similarity: Similarity, points: Array) -> Array:
    """World points (N, 3) in the solver's frame."""
    turned = sum(points[:, axis, None] * similarity.rotation[:, axis] for axis in range(3))
    return similarity.scale * turned + similarity.translation


def to_world(similarity: Similarity, positions: Array, deformation: Array) -> tuple[Array, Array]:
    """Solver positions (N, 3) and deformation gradients (N, 3, 3) in the world's frame.

    x = Q^T (y - b) / s and F = Q^T F_solver Q. The polar rotation of the latter is Q^T R_solver Q,
    so that colours turn by the right amount about the right axis.
    """
    Q = similarity.rotation
    centred = (positions - similarity.translation) / similarity.scale
    points = algebra.total(centred[:, axis, None] * Q[axis] for axis in range(3))
    F, Q = jnp.moveaxis(deformation, 0, -1), Q[:, :, None]
    F = algebra.matmul(algebra.transpose(Q), algebra.matmul(F, Q))
    return points, jnp.moveaxis(F, -1, 0)


def _carried(gaussians: Gaussians, positions, deformation, similarity) -> tuple[Array, Array]:
    """World positions (n, 3) and gradients (3, 3, n) of the particles that carry Gaussians."""
    count = gaussians.count
    if positions.shape != (count, 3) or deformation.shape != (count, 3, 3):
        raise InputError(
            f"{count} Gaussians on positions {positions.shape} and deformation gradients "
            f"{deformation.shape}: give one of each for every Gaussian (Frame.carried)"
        )
    if similarity is not None:
        positions, deformation = to_world(similarity, positions, deformation)
    return positions, jnp.moveaxis(deformation, 0, -1)


@jax.jit
def deform(
    gaussians: Gaussians,
    positions: Array,
    deformation: Array,
    camera_position: Array,
    *,
    similarity: Similarity | None = None,
    colours: ColourRange | None = None,
) -> Splats:
    """What a renderer draws of the Gaussians once their particles have moved.

    Args:
        gaussians: at rest, n of them, in the world.
        positions: where the Gaussians' particles are now [m], (n, 3).
        deformation: their total deformation gradients, (n, 3, 3).
        camera_position: (3,) [m], in the world.
        similarity: the frame of `positions` and `deformation`, if it is not the world's.
        colours: the range to regularise colours by; none: colours as they are.

    Raises:
        InputError: not one position and one deformation gradient for each Gaussian.
    """
    means, F = _carried(gaussians, positions, deformation, similarity)
    # (F A)(F A)^T rather than F (A A^T) F^T: symmetric and positive by construction.
    A = algebra.matmul(F, axes(gaussians))
    covariances = jnp.moveaxis(algebra.matmul_transpose(A, A), -1, 0)
    # Colours that look the same from all sides need no rotation, and no decomposition.
    turns = gaussians.harmonics.shape[1] > 1
    rotations = None
    if turns:
        with part("turned view directions"):
            rotations = jnp.moveaxis(polar_rotation(F), -1, 0)
    rgb = view_colours(gaussians.harmonics, means, camera_position, rotations)
    if colours is not None:
        rgb = regularise(rgb, colours)
    return Splats(means, covariances, opacities(gaussians), rgb)


def bake(
    gaussians: Gaussians,
    positions: Array,
    deformation: Array,
    *,
    similarity: Similarity | None = None,
) -> Gaussians:
    """The deformed Gaussians as Gaussians, for viewers that know no deformation.

    Scales and quaternions come from the eigen-decomposition of the deformed covariance, harmonics
    are turned by the polar rotation: from any camera `to_splats` of the result is `deform` of the
    arguments. For export, on the host and not for gradients.

    Args and errors are those of `deform`.
    """
    means, F = _carried(gaussians, positions, deformation, similarity)
    harmonics = gaussians.harmonics
    if harmonics.shape[1] > 1:
        harmonics = sh.rotate(harmonics, jnp.moveaxis(polar_rotation(F), -1, 0))
    # In double precision: squaring a thin disc's axes would lose its thickness in single.
    A = np.moveaxis(np.asarray(F, np.float64), -1, 0) @ np.moveaxis(
        np.asarray(axes(gaussians), np.float64), -1, 0
    )
    squares, directions = np.linalg.eigh(A @ np.swapaxes(A, 1, 2))
    directions[:, :, 0] *= np.linalg.det(directions)[:, None]  # +-1: make them proper
    largest = np.maximum(squares[:, -1:], np.finfo(np.float32).tiny)
    log_scales = 0.5 * np.log(np.maximum(squares, 1e-15 * largest))
    dtype = gaussians.means.dtype
    return Gaussians(
        means,
        jnp.asarray(log_scales, dtype),
        matrix_to_quaternion(jnp.asarray(directions, dtype)),
        gaussians.opacity_logits,
        harmonics,
    )
