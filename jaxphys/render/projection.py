"""From Gaussians in space to Gaussians in the picture: EWA splatting (Zwicker et al. 2001)."""

from typing import NamedTuple

import jax.numpy as jnp
from jax import Array, lax

from jaxphys.core.splats import Splats
from jaxphys.render.camera import Camera
from jaxphys.render.settings import Settings

# Means [m] and covariances [m^2] beyond this are drawn no more than infinite ones are: their
# squares would leave float32 on the way to the picture.
LARGEST = 1e12


class Projected(NamedTuple):
    """Gaussians in the picture, one per splat; splats that are not drawn hold harmless numbers.

    The inverse covariance is kept as its Cholesky factor: with (dx, dy) = centre - pixel,
    u = a dx + b dy and v = c dy, the exponent is (u^2 + v^2) / 2. Unlike the three-coefficient
    form it cannot become negative by rounding.

    Attributes:
        centres: [pixels], shape (2, N).
        factors: a, b, c [1/pixel], shape (3, N).
        opacities: with the antialiasing compensation if asked for, 0 where not drawn, shape (N,).
        depths: z in the camera [m], shape (N,).
        half_sizes: of the axis-aligned box that holds every contribution [pixels], shape (2, N);
            without gradient.
        radii: three standard deviations of the longer axis, rounded up [pixels], shape (N,);
            without gradient.
        valid: whether the splat is drawn, shape (N,).
    """

    centres: Array
    factors: Array
    opacities: Array
    depths: Array
    half_sizes: Array
    radii: Array
    valid: Array


def usable(splats: Splats) -> Array:
    """Which splats hold only numbers that can be drawn: finite and within 1e12. Shape (N,)."""

    def bounded(values: Array) -> Array:
        return jnp.all(jnp.abs(values) <= LARGEST, axis=tuple(range(1, values.ndim)))

    return (
        bounded(splats.means)
        & bounded(splats.covariances)
        & bounded(splats.opacities)
        & bounded(splats.colours)
    )


def project(splats: Splats, camera: Camera, settings: Settings) -> Projected:
    """Projects N splats; every output is differentiable but the bounds.

    Splats that `usable` rejects, that lie outside (near, far) or whose opacity is below `alpha_min`
    are not valid; they are replaced before any arithmetic, so neither values nor gradients of the
    others see them. Covariances need not be exactly symmetric or positive semi-definite: the
    symmetric part is taken and the low-pass bounds the smaller variance from below.
    """
    fine = usable(splats)
    means = jnp.where(fine[:, None], splats.means, 0)
    covariances = jnp.where(fine[:, None, None], splats.covariances, 0)
    opacities = jnp.where(fine, splats.opacities, 0)

    R, t = camera.rotation, camera.translation
    px, py, pz = means[:, 0], means[:, 1], means[:, 2]
    x, y, z = (R[i, 0] * px + R[i, 1] * py + R[i, 2] * pz + t[i] for i in range(3))
    drawn = fine & (z > settings.near) & (z < settings.far)
    # Behind the camera any harmless depth will do.
    inverse = 1 / jnp.where(drawn, z, 1)
    x, y = jnp.where(drawn, x, 0) * inverse, jnp.where(drawn, y, 0) * inverse

    fx, fy = camera.focal[0], camera.focal[1]
    cx, cy = camera.centre[0], camera.centre[1]
    centre_x, centre_y = fx * x + cx, fy * y + cy
    xx, xy, yy = _flatten(covariances, R, camera, settings, x, y, inverse)

    a, c = xx + settings.low_pass, jnp.maximum(yy, 0) + settings.low_pass
    # The Schur complement of a blurred positive semi-definite matrix is at least the blur.
    b_over_c = xy / c
    schur = jnp.maximum(a - b_over_c * xy, settings.low_pass)
    across = lax.rsqrt(schur)
    factors = jnp.stack([across, -b_over_c * across, lax.rsqrt(c)])
    if settings.antialias:
        # det / det_blurred, the quotient taken factor by factor so that nothing overflows.
        sharp = jnp.maximum(xx, 0) / schur * (jnp.maximum(yy, 0) / c) - (xy / schur) * b_over_c
        opacities = opacities * jnp.sqrt(jnp.clip(sharp, 0.005**2, 1))

    drawn = drawn & (opacities >= settings.alpha_min)
    opacities = jnp.where(drawn, opacities, 0)
    half_sizes, radii = _bounds(xy, c, schur, opacities, drawn, settings)
    return Projected(
        jnp.stack([centre_x, centre_y]), factors, opacities, z, half_sizes, radii, drawn
    )


def _flatten(covariances, R, camera, settings, x, y, inverse):
    """The three coefficients of J R Sigma R^T J^T [pixels^2], J the Jacobian of the projection."""
    fx, fy = camera.focal[0], camera.focal[1]
    cx, cy = camera.centre[0], camera.centre[1]
    half_x, half_y = 0.5 * camera.width / fx, 0.5 * camera.height / fy
    if settings.jacobian_clamp == "principal":
        x = jnp.clip(x, -(cx / fx + 0.3 * half_x), (camera.width - cx) / fx + 0.3 * half_x)
        y = jnp.clip(y, -(cy / fy + 0.3 * half_y), (camera.height - cy) / fy + 0.3 * half_y)
    elif settings.jacobian_clamp == "symmetric":
        x = jnp.clip(x, -1.3 * half_x, 1.3 * half_x)
        y = jnp.clip(y, -1.3 * half_y, 1.3 * half_y)
    # Rows of J R, one entry per splat.
    row_x = [fx * inverse * (R[0, k] - x * R[2, k]) for k in range(3)]
    row_y = [fy * inverse * (R[1, k] - y * R[2, k]) for k in range(3)]

    def entry(i: int, j: int) -> Array:
        return 0.5 * (covariances[:, i, j] + covariances[:, j, i])

    S = [[entry(i, j) if i <= j else None for j in range(3)] for i in range(3)]
    S[1][0], S[2][0], S[2][1] = S[0][1], S[0][2], S[1][2]

    def times(row):
        return [S[i][0] * row[0] + S[i][1] * row[1] + S[i][2] * row[2] for i in range(3)]

    def dot(p, q):
        return p[0] * q[0] + p[1] * q[1] + p[2] * q[2]

    S_x, S_y = times(row_x), times(row_y)
    return dot(row_x, S_x), dot(row_x, S_y), dot(row_y, S_y)


def _bounds(b, c, schur, opacities, drawn, settings):
    """Boxes of the ellipse alpha = alpha_min, and the three-sigma radius of Kerbl et al. 2023."""
    b, c, schur, opacities = map(lax.stop_gradient, (b, c, schur, opacities))
    level = 2 * jnp.log(jnp.where(drawn, opacities, settings.alpha_min) / settings.alpha_min)
    # The variance along x that the factor stands for, also where the input was not semi-definite.
    wide = schur + b * (b / c)
    half_sizes = jnp.stack([jnp.sqrt(level * wide), jnp.sqrt(level * c)])
    middle = 0.5 * (wide + c)
    spread = jnp.sqrt(jnp.maximum(0.1, (0.5 * (wide - c)) ** 2 + b * b))
    radii = jnp.ceil(3 * jnp.sqrt(middle + spread))
    return half_sizes, radii
