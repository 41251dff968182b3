"""The few layers that both priors are made of: matrix products, attention, adaptive norms.

Everything computes in the dtype of its input (parameters are cast to it), so that one module trains
in bfloat16 and samples in float32.
"""

from collections.abc import Callable, Sequence
from functools import partial
from typing import Any, TypeVar

import jax
import jax.numpy as jnp
from flax import nnx
from jax import Array, lax
from jax.experimental.layout import Layout, with_layout_constraint


def _transposed(matrix: Array) -> Array:
    """Last two axes swapped *in memory*.

    XLA folds a transpose into the product that follows; its CPU backend then misses the fast
    (AMX) bfloat16 kernels, which want both operands row-major: 100 instead of 500 GFLOP/s.
    """
    swapped = jnp.swapaxes(matrix, -1, -2)
    rows_first = Layout(tuple(range(matrix.ndim)))
    return lax.optimization_barrier(with_layout_constraint(swapped, rows_first))


@jax.custom_vjp
def matmul(rows: Array, kernel: Array) -> Array:
    """(M, K) @ (K, N), or batched (..., M, K) @ (..., K, N); gradients by row-major products."""
    return rows @ kernel


def _matmul_forward(rows: Array, kernel: Array) -> tuple[Array, tuple[Array, Array]]:
    return rows @ kernel, (rows, kernel)


def _matmul_backward(saved: tuple[Array, Array], gradient: Array) -> tuple[Array, Array]:
    rows, kernel = saved
    towards_rows = gradient @ _transposed(kernel)
    if rows.ndim == 2 and rows.shape[1] > gradient.shape[1]:  # transpose the smaller operand
        return towards_rows, _transposed(lax.optimization_barrier(_transposed(gradient) @ rows))
    return towards_rows, _transposed(rows) @ gradient


matmul.defvjp(_matmul_forward, _matmul_backward)


@jax.custom_vjp
def scores(queries: Array, keys: Array) -> Array:
    """(G, Q, D), (G, K, D) -> (G, Q, K): all inner products."""
    return jnp.einsum("gqd,gkd->gqk", queries, keys)


def _scores_forward(queries: Array, keys: Array) -> tuple[Array, tuple[Array, Array]]:
    return scores(queries, keys), (queries, keys)


def _scores_backward(saved: tuple[Array, Array], gradient: Array) -> tuple[Array, Array]:
    queries, keys = saved
    return gradient @ keys, _transposed(gradient) @ queries


scores.defvjp(_scores_forward, _scores_backward)


@partial(jax.custom_vjp, nondiff_argnums=(1,))
def spread(vectors: Array, count: int) -> Array:
    """(B, W) -> (B, count, W), the same vector for every token.

    The gradient, a sum over tokens, is a product with ones: XLA's CPU backend turns a plain sum
    over a leading axis into slow trees of `reduce-window`.
    """
    return jnp.broadcast_to(vectors[:, None, :], (vectors.shape[0], count, vectors.shape[1]))


def _spread_forward(vectors: Array, count: int) -> tuple[Array, None]:
    return spread(vectors, count), None


def _spread_backward(count: int, _: None, gradient: Array) -> tuple[Array]:
    ones = jnp.ones((gradient.shape[0], 1, count), gradient.dtype)
    return ((ones @ gradient)[:, 0],)


spread.defvjp(_spread_forward, _spread_backward)


class TrainableLinear(nnx.Module):
    """x W + b over the last axis of (..., inputs)."""

    def __init__(self, inputs: int, outputs: int, *, rngs: nnx.Rngs, zero: bool = False):
        scale = 0.0 if zero else inputs**-0.5
        self.kernel = nnx.Param(
            scale * jax.random.normal(rngs.params(), (inputs, outputs), jnp.float32)
        )
        self.bias = nnx.Param(jnp.zeros((outputs,), jnp.float32))

    def __call__(self, x: Array) -> Array:
        kernel, bias = self.kernel[...].astype(x.dtype), self.bias[...].astype(x.dtype)
        rows = x.reshape(-1, x.shape[-1])
        rows = matmul(rows, kernel) + spread(bias[None], rows.shape[0])[0]
        return rows.reshape(*x.shape[:-1], -1)


def normalise(x: Array) -> Array:
    """Root-mean-square norm of the last axis (Zhang & Sennrich 2019), in float32 or better."""
    wide = x.astype(jnp.promote_types(x.dtype, jnp.float32))
    return (wide * lax.rsqrt(jnp.mean(wide**2, -1, keepdims=True) + 1e-6)).astype(x.dtype)


def time_features(time: Array, width: int) -> Array:
    """(B,) in [0, 1] -> (B, width) sines and cosines (Vaswani et al. 2017) of 1000 t."""
    rates = jnp.exp(-jnp.log(1e4) * jnp.arange(width // 2) / (width // 2))
    phase = 1000.0 * time[:, None] * rates
    return jnp.concatenate([jnp.cos(phase), jnp.sin(phase)], -1).astype(time.dtype)


class SquaredPerceptron(nnx.Module):
    """Two layers with a squared rectifier (So et al. 2021), which costs no transcendental."""

    def __init__(
        self, inputs: int, hidden: int, outputs: int, *, rngs: nnx.Rngs, zero: bool = False
    ):
        self.inner = TrainableLinear(inputs, hidden, rngs=rngs)
        self.outer = TrainableLinear(hidden, outputs, rngs=rngs, zero=zero)

    def __call__(self, x: Array) -> Array:
        return self.outer(jnp.square(jax.nn.relu(self.inner(x))))


class NormalisedAttention(nnx.Module):
    """Multi-head attention of (B, T, width) tokens to (B, S, context) tokens, with normalised
    queries and keys (Dehghani et al. 2023)."""

    def __init__(self, width: int, context: int, heads: int, head_width: int, *, rngs: nnx.Rngs):
        inner = heads * head_width
        self.heads, self.head_width = heads, head_width
        self.queries = TrainableLinear(width, inner, rngs=rngs)
        self.keys_values = TrainableLinear(context, 2 * inner, rngs=rngs)
        self.output = TrainableLinear(inner, width, rngs=rngs)
        self.sharpness = nnx.Param(jnp.ones((heads,), jnp.float32))

    def _split(self, x: Array) -> Array:
        batch, tokens = x.shape[:2]
        x = x.reshape(batch, tokens, self.heads, self.head_width).transpose(0, 2, 1, 3)
        return x.reshape(batch * self.heads, tokens, self.head_width)

    def _sharpness(self, batch: int) -> Array:
        repeated = spread(self.sharpness[...][None], batch)
        return repeated.reshape(-1, 1, 1) * self.head_width**-0.5

    def __call__(self, x: Array, context: Array) -> Array:
        batch, tokens = x.shape[:2]
        keys, values = jnp.split(self.keys_values(context), 2, axis=-1)
        queries = normalise(self._split(self.queries(x)))
        keys = normalise(self._split(keys))
        logits = scores(queries * self._sharpness(batch).astype(x.dtype), keys)
        weights = jax.nn.softmax(logits.astype(jnp.promote_types(x.dtype, jnp.float32)), axis=-1)
        mixed = matmul(weights.astype(x.dtype), self._split(values))
        mixed = mixed.reshape(batch, self.heads, tokens, self.head_width).transpose(0, 2, 1, 3)
        return self.output(mixed.reshape(batch, tokens, -1))


class Modulation(nnx.Module):
    """Shift, scale and gate from the condition: adaLN-zero (Peebles & Xie 2023) of low rank."""

    def __init__(self, condition: int, width: int, rank: int, count: int, *, rngs: nnx.Rngs):
        self.count, self.width = count, width
        self.inner = TrainableLinear(condition, rank, rngs=rngs)
        self.outer = TrainableLinear(rank, count * width, rngs=rngs, zero=True)

    def __call__(self, condition: Array) -> Sequence[Array]:
        """(B, condition) -> `count` arrays (B, width)."""
        return jnp.split(self.outer(self.inner(condition)), self.count, axis=-1)


def modulate(x: Array, shift: Array, scale: Array) -> Array:
    """Norm of (B, T, width) tokens, then each sample's own scale and shift (B, width)."""
    return normalise(x) * spread(1 + scale, x.shape[1]) + spread(shift, x.shape[1])


class AdaptiveLayer(nnx.Module):
    """Pre-norm transformer layer: attention to `context` (or to itself), then a perceptron."""

    def __init__(
        self,
        width: int,
        *,
        context: int | None,
        heads: int,
        head_width: int,
        hidden: int,
        condition: int,
        rank: int,
        rngs: nnx.Rngs,
    ):
        self.modulation = Modulation(condition, width, rank, 6, rngs=rngs)
        self.attention = NormalisedAttention(width, context or width, heads, head_width, rngs=rngs)
        self.perceptron = SquaredPerceptron(width, hidden, width, rngs=rngs)

    def __call__(self, x: Array, condition: Array, context: Array | None = None) -> Array:
        shift_1, scale_1, gate_1, shift_2, scale_2, gate_2 = self.modulation(condition)
        inner = modulate(x, shift_1, scale_1)
        read = self.attention(inner, inner if context is None else normalise(context))
        x = x + spread(gate_1, x.shape[1]) * read
        inner = modulate(x, shift_2, scale_2)
        return x + spread(gate_2, x.shape[1]) * self.perceptron(inner)


class PhraseTokens(nnx.Module):
    """Tokens (B, R, width) to attend to, one for each row of (B, R, text) unit embeddings: the
    object and what else a prompt says. Rows of zeros say nothing, and have a token all the same.
    """

    def __init__(self, text: int, rows: int, width: int, *, rngs: nnx.Rngs):
        self.read = TrainableLinear(text, width, rngs=rngs)
        self.place = nnx.Param(jax.random.normal(rngs.params(), (rows, width)))

    def __call__(self, text: Array) -> Array:
        batch, rows, width = text.shape
        place = spread(self.place[...].astype(text.dtype).reshape(1, -1), batch)
        return self.read(text * width**0.5) + place.reshape(batch, rows, -1)


Stacked = TypeVar("Stacked", bound=nnx.Module)


def stack(build: Callable[[nnx.Rngs], Stacked], count: int, rngs: nnx.Rngs) -> Stacked:
    """`count` modules as one, every parameter with a leading axis: traced once, not so often."""
    return nnx.vmap(build, in_axes=0, out_axes=0)(rngs.fork(split=count))


def apply_stack(stacked: nnx.Module, step: Callable, carry: Any) -> Any:
    """carry <- step(module, carry) for each module of a `stack` in turn, by `lax.scan`.

    The gradient computes each module's inside again, which costs less here than keeping it.
    """
    graph, state = nnx.split(stacked)

    @partial(jax.checkpoint, prevent_cse=False)
    def body(carry: Any, parameters: Any) -> tuple[Any, None]:
        return step(nnx.merge(graph, parameters), carry), None

    return lax.scan(body, carry, state)[0]
