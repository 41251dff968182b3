"""Training pictures are changed at random, so that nothing but the object helps to name it."""

import jax
import jax.numpy as jnp
from jax import Array

KERNEL = (0.25, 0.5, 0.25)


def grounds(key: Array, count: int, resolution: int) -> Array:
    """(B, R, R, 3): one light or any colour, and around it a slope between four corners."""
    base_key, corner_key, light_key, slope_key = jax.random.split(key, 4)
    base = jax.random.uniform(base_key, (count, 1, 1, 3))
    grey = 0.75 + 0.25 * base[..., :1] + 0.05 * (base - 0.5)
    base = jnp.where(jax.random.uniform(light_key, (count, 1, 1, 1)) < 0.5, grey, base)
    corners = jax.random.uniform(corner_key, (count, 2, 2, 3), minval=-0.5, maxval=0.5)
    corners = corners * jax.random.uniform(slope_key, (count, 1, 1, 1)) ** 2
    ramp = jnp.linspace(0.0, 1.0, resolution)
    weights = jnp.stack([1 - ramp, ramp])
    return base + jnp.einsum("bijc,ix,jy->bxyc", corners, weights, weights)


def blurred(images: Array) -> Array:
    """Pictures (B, H, W, C) smoothed by one, two, one quarters along both axes."""
    for axis in (1, 2):
        ends = [(0, 0)] * 4
        ends[axis] = (1, 1)
        padded = jnp.pad(images, ends, mode="edge")
        size = images.shape[axis]
        images = sum(
            weight * jax.lax.slice_in_dim(padded, k, k + size, axis=axis)
            for k, weight in enumerate(KERNEL)
        )
    return images


def augment(images: Array, key: Array) -> Array:
    """RGBA uint8 (B, R, R, 4) to RGB in [0, 1]: mirrored, blurred, tinted, on a ground, with noise.

    The blur acts on colour and outline before the ground is put behind, as soft Gaussians look.
    """
    keys = jax.random.split(key, 8)
    count, resolution = images.shape[:2]

    def chance(index: int, *shape: int, low: float = 0.0, high: float = 1.0) -> Array:
        return jax.random.uniform(keys[index], (count, *shape), jnp.float32, low, high)

    rgba = images.astype(jnp.float32) / 255
    rgba = jnp.where(chance(0, 1, 1, 1) < 0.5, rgba, rgba[:, :, ::-1])
    rgba = rgba.at[..., :3].multiply(rgba[..., 3:])
    once = blurred(rgba)
    soft = chance(1, 1, 1, 1, high=2.0) * chance(2, 1, 1, 1)
    rgba = jnp.where(
        soft < 1,
        rgba + soft * (once - rgba),
        once + (soft - 1) * (blurred(blurred(once)) - once),
    )
    gain = chance(3, 1, 1, 1, low=0.75, high=1.2) * chance(4, 1, 1, 3, low=0.92, high=1.08)
    colour, alpha = rgba[..., :3] * gain, rgba[..., 3:]
    # Towards or away from the middle grey that is hidden by the object: contrast.
    colour = alpha * 0.5 + chance(5, 1, 1, 1, low=0.75, high=1.2) * (colour - alpha * 0.5)
    shown = colour + (1 - alpha) * grounds(keys[6], count, resolution)
    first, second = jax.random.split(keys[7])
    level = 0.04 * jax.random.uniform(first, (count, 1, 1, 1)) ** 2
    # One pattern for the batch: drawing one for each picture costs more than all else here.
    return jnp.clip(shown + level * jax.random.normal(second, shown.shape[1:]), 0, 1)
