"""A renderer with nothing to go wrong: every splat at every pixel, one after another, by autodiff.

Written from the formulas of Kerbl et al. 2023 and the sources of their rasteriser and of gsplat,
in matrix form and without anything of `jaxphys.render` but the names of the settings.
"""

import jax
import jax.numpy as jnp
from jax import lax


def project_dense(splats, camera, settings):
    """Pixel means (N, 2), blurred covariances (N, 2, 2), opacities, depths and drawn (N,)."""
    R, t, f, c = camera.rotation, camera.translation, camera.focal, camera.centre
    local = jnp.einsum("ij,nj->ni", R, splats.means) + t
    z = local[:, 2]
    drawn = (z > settings.near) & (z < settings.far)
    z_safe = jnp.where(drawn, z, 1.0)
    slope = local[:, :2] / z_safe[:, None]
    size = jnp.array([camera.width, camera.height], f.dtype)
    tangent = size / (2 * f)
    if settings.jacobian_clamp == "symmetric":
        slope_j = jnp.clip(slope, -1.3 * tangent, 1.3 * tangent)
    elif settings.jacobian_clamp == "principal":
        slope_j = jnp.clip(slope, -(c / f + 0.3 * tangent), (size - c) / f + 0.3 * tangent)
    else:
        slope_j = slope
    zero = jnp.zeros_like(z)
    J = jnp.stack(
        [
            jnp.stack([f[0] / z_safe, zero, -f[0] * slope_j[:, 0] / z_safe], -1),
            jnp.stack([zero, f[1] / z_safe, -f[1] * slope_j[:, 1] / z_safe], -1),
        ],
        axis=1,
    )
    V = jnp.einsum("nij,jk,nkl,ml,npm->nip", J, R, splats.covariances, R, J)
    blurred = V + settings.low_pass * jnp.eye(2, dtype=V.dtype)
    opacities = splats.opacities
    if settings.antialias:
        ratio = jnp.linalg.det(V) / jnp.linalg.det(blurred)
        opacities = opacities * jnp.sqrt(jnp.maximum(ratio, 0.000025))
    return f * slope + c, blurred, opacities, z, drawn & (opacities >= settings.alpha_min)


def render_dense(splats, camera, background, settings):
    """Colour (H, W, C), alpha (H, W) and depth (H, W), all differentiable by autodiff."""
    means, covariances, opacities, z, drawn = project_dense(splats, camera, settings)
    conics = jnp.linalg.inv(covariances)
    height, width = camera.height, camera.width
    columns, rows = jnp.meshgrid(jnp.arange(width), jnp.arange(height))
    pixels = jnp.stack([columns, rows], -1).reshape(-1, 2) + 0.5
    order = jnp.argsort(jnp.where(drawn, z, jnp.inf))
    middle = 0.5 * (covariances[:, 0, 0] + covariances[:, 1, 1])
    spread = jnp.sqrt(jnp.maximum(0.1, middle**2 - jnp.linalg.det(covariances)))
    radii = jnp.ceil(3 * jnp.sqrt(middle + spread))
    inputs = (means, conics, opacities, z, drawn, splats.colours, radii)
    inputs = jax.tree.map(lambda leaf: leaf[order], inputs)

    def add(carry, splat):
        light, open_, colour, alpha_sum, depth = carry
        mean, conic, opacity, z, drawn, value, radius = splat
        d = mean - pixels
        power = -0.5 * jnp.einsum("pi,ij,pj->p", d, conic, d)
        raw = opacity * jnp.exp(power)
        alpha = jnp.minimum(settings.alpha_max, raw)
        use = drawn & (power <= 0) & (raw >= settings.alpha_min)
        if settings.extent == "three_sigma":
            low = jnp.trunc((mean - 0.5 - radius) / 16) * 16
            high = jnp.trunc((mean - 0.5 + radius + 15) / 16) * 16
            index = pixels - 0.5
            use = use & jnp.all((index >= low) & (index < high), axis=-1)
        alpha = jnp.where(use, alpha, 0.0)
        left = light * (1 - alpha)
        open_ = open_ & ~(use & (left < settings.transmittance_min))
        weight = jnp.where(open_, light * alpha, 0.0)
        light = jnp.where(open_, left, light)
        return (
            light,
            open_,
            colour + weight[:, None] * value,
            alpha_sum + weight,
            depth + weight * z,
        ), None

    count = pixels.shape[0]
    dtype = means.dtype
    start = (
        jnp.ones(count, dtype),
        jnp.ones(count, bool),
        jnp.zeros((count, splats.colours.shape[1]), dtype),
        jnp.zeros(count, dtype),
        jnp.zeros(count, dtype),
    )
    (_, _, colour, alpha, depth), _ = lax.scan(add, start, inputs)
    colour = colour.reshape(height, width, -1)
    alpha, depth = alpha.reshape(height, width), depth.reshape(height, width)
    return colour + (1 - alpha)[..., None] * background, alpha, depth
