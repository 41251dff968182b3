import jax
import jax.numpy as jnp
import numpy as np
import pytest
from flax import nnx

from jaxphys.guidance.bundled.adaptive import (
    TrainableLinear,
    apply_stack,
    matmul,
    normalise,
    scores,
    spread,
    stack,
)


def values(*shapes):
    rng = np.random.default_rng(0)
    return [jnp.asarray(rng.normal(size=shape)) for shape in shapes]


@pytest.mark.parametrize(
    "ours, plain, shapes",
    [
        (matmul, lambda a, b: a @ b, [(6, 3), (3, 5)]),
        (matmul, lambda a, b: a @ b, [(6, 5), (5, 2)]),
        (matmul, lambda a, b: a @ b, [(4, 6, 3), (4, 3, 5)]),
        (scores, lambda a, b: a @ jnp.swapaxes(b, 1, 2), [(4, 6, 3), (4, 5, 3)]),
        (lambda v: spread(v, 7), lambda v: jnp.repeat(v[:, None], 7, 1), [(3, 4)]),
    ],
)
def test_products_and_their_gradients(ours, plain, shapes):
    inputs = values(*shapes)
    weight = values(plain(*inputs).shape)[0]
    np.testing.assert_allclose(ours(*inputs), plain(*inputs), atol=1e-12)
    every = tuple(range(len(inputs)))
    found = jax.grad(lambda *a: jnp.sum(weight * ours(*a)), every)(*inputs)
    wanted = jax.grad(lambda *a: jnp.sum(weight * plain(*a)), every)(*inputs)
    for ours_gradient, plain_gradient in zip(found, wanted, strict=True):
        np.testing.assert_allclose(ours_gradient, plain_gradient, atol=1e-12)


def test_norm_has_unit_mean_square_and_bears_zero():
    (x,) = values((3, 8))
    np.testing.assert_allclose(jnp.mean(normalise(x) ** 2, -1), 1.0, atol=1e-4)
    gradient = jax.grad(lambda x: normalise(x).sum())(jnp.zeros((2, 4)))
    assert np.isfinite(gradient).all()


def test_stack_applies_its_modules_in_order():
    stacked = stack(lambda rngs: TrainableLinear(4, 4, rngs=rngs), 3, nnx.Rngs(0))
    assert stacked.kernel.shape == (3, 4, 4)
    assert not np.allclose(stacked.kernel[0], stacked.kernel[1])
    (x,) = values((2, 4))
    wanted = x
    for index in range(3):
        wanted = wanted @ stacked.kernel[index] + stacked.bias[index]
    found = apply_stack(stacked, lambda module, x: module(x), x)
    np.testing.assert_allclose(found, wanted, rtol=1e-6)
