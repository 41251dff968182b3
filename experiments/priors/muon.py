"""Muon (Jordan et al. 2024) for the hidden matrices of a flat dictionary of parameters, else AdamW.

The hidden matrices are those of layers, stacked (layers, inputs, outputs) or alone. They are
orthogonalised in bfloat16, as its authors do.
"""

from typing import NamedTuple

import jax
import jax.numpy as jnp
import optax
from jax import Array, lax

from jaxphys.guidance.bundled.adaptive import scores

Parameters = dict[str, Array]
LARGE = 128  # rows and columns of a hidden matrix that is no part of a stack
COEFFICIENTS = (3.4445, -4.7750, 2.0315)


def orthogonalise(matrices: Array, iterations: int = 5) -> Array:
    """(G, rows, columns) -> nearly orthogonal ones with the same singular vectors (singular values
    within about 0.7 to 1.2), by a quintic Newton-Schulz iteration."""
    tall = matrices.shape[1] > matrices.shape[2]
    x = jnp.swapaxes(matrices, 1, 2) if tall else matrices
    x = x / (jnp.linalg.norm(x, axis=(1, 2), keepdims=True) + 1e-7)
    x = x.astype(jnp.bfloat16)
    a, b, c = COEFFICIENTS

    def iterate(x: Array, _: None) -> tuple[Array, None]:
        gram = scores(x, x)
        return a * x + (b * gram + c * (gram @ gram)) @ x, None

    x, _ = lax.scan(iterate, x, length=iterations)
    x = x.astype(matrices.dtype)
    return jnp.swapaxes(x, 1, 2) if tall else x


def _orthogonal(value: Array) -> Array:
    return orthogonalise(value.reshape(-1, *value.shape[-2:])).reshape(value.shape)


class MuonState(NamedTuple):
    momentum: Parameters


def scale_by_muon(decay: float = 0.95) -> optax.GradientTransformation:
    """Orthogonalised Nesterov momentum, as large as an Adam update (Liu et al. 2025, eq. 4)."""

    def init(parameters: Parameters) -> MuonState:
        return MuonState(jax.tree.map(jnp.zeros_like, parameters))

    def update(gradient: Parameters, state: MuonState, _=None) -> tuple[Parameters, MuonState]:
        momentum = jax.tree.map(lambda m, g: decay * m + (1 - decay) * g, state.momentum, gradient)
        ahead = jax.tree.map(lambda m, g: decay * m + (1 - decay) * g, momentum, gradient)
        result = {
            name: 0.2 * max(value.shape[-2:]) ** 0.5 * _orthogonal(value)
            for name, value in ahead.items()
        }
        return result, MuonState(momentum)

    return optax.GradientTransformation(init, update)


def muon(rate: optax.Schedule, weight_decay: float) -> optax.GradientTransformation:
    """Muon for the hidden matrices, AdamW without decay for all else."""
    hidden = optax.chain(
        scale_by_muon(), optax.add_decayed_weights(weight_decay), optax.scale_by_learning_rate(rate)
    )
    other = optax.adamw(rate, b1=0.9, b2=0.99, weight_decay=0.0)

    def init(parameters: Parameters):
        first, second = _split(parameters)
        return hidden.init(first), other.init(second)

    def update(gradient: Parameters, state, parameters: Parameters):
        (g1, g2), (p1, p2) = _split(gradient), _split(parameters)
        u1, s1 = hidden.update(g1, state[0], p1)
        u2, s2 = other.update(g2, state[1], p2)
        merged = u1 | u2
        return {name: merged[name] for name in gradient}, (s1, s2)

    return optax.GradientTransformation(init, update)


def is_hidden(name: str, value: Array) -> bool:
    """Whether it is a matrix of a stack of layers, or one that is large both ways. Of a matrix of
    thousands of inputs a step of Adam's size would change what comes out of it at once.
    """
    return value.ndim == 3 or (name.endswith("kernel") and min(value.shape) >= LARGE)


def _split(parameters: Parameters) -> tuple[Parameters, Parameters]:
    first = {name: value for name, value in parameters.items() if is_hidden(name, value)}
    return first, {name: value for name, value in parameters.items() if name not in first}
