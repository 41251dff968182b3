"""What a diffusion network is told of the step that it denoises."""

import jax
import jax.numpy as jnp
from flax import nnx
from jax import Array

from jaxphys.networks.layers import Linear

LONGEST = 1e4  # steps a radian of the slowest wave


def waves(step: Array, width: int, *, flip_sin_to_cos: bool = True, freq_shift: float = 0) -> Array:
    """Sines and cosines (Vaswani et al. 2017) of the steps (B,): (B, width), in float32 or better.

    flip_sin_to_cos: the cosines come first.
    freq_shift: 1 makes the slowest wave exactly `LONGEST` steps a radian, 0 a little shorter.
    """
    half = width // 2
    rates = LONGEST ** (-jnp.arange(half, dtype=jnp.float32) / (half - freq_shift))
    step = step.astype(jnp.promote_types(step.dtype, jnp.float32))
    phase = step[:, None] * rates.astype(step.dtype)
    parts = (jnp.cos(phase), jnp.sin(phase))
    return jnp.concatenate(parts if flip_sin_to_cos else parts[::-1], -1)


class TimestepEmbedding(nnx.Module):
    """Two layers on the waves: (B, inputs) -> (B, width)."""

    def __init__(self, inputs: int, width: int):
        self.linear_1 = Linear(inputs, width)
        self.linear_2 = Linear(width, width)

    def __call__(self, features: Array) -> Array:
        return self.linear_2(jax.nn.silu(self.linear_1(features)))
