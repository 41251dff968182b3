"""A function whose derivative JAX finds wrong, and a rule that finds it right in every order."""

from functools import partial

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from jaxphys.core.own_rule import own_rule

X, D = jnp.array([0.0, 0.4, -1.3]), jnp.array([1.0, -0.5, 0.25])


def cube(x, count):
    """x^3 in a way that has no derivative at zero, and a number that is no float."""
    return jnp.sign(x) * jnp.sqrt(x * x) ** 3, count + 1


def rule(primals, tangents, again):
    (x, count), (dx, none) = primals, tangents
    assert none.dtype == jax.dtypes.float0
    results = again(x, count)
    return results, (3 * x**2 * dx, np.zeros(np.shape(count), jax.dtypes.float0))


def ours(x, count):
    return own_rule(cube, partial(rule, again=ours), x, count)


@jax.custom_jvp
def jaxs(x, count):
    return cube(x, count)


@jaxs.defjvp
def _(primals, tangents):
    return rule(primals, tangents, jaxs)


def loss(function, x):
    """sum of (x + 3 c x^3) after three steps that multiply by 1 + c x^2, in a loop and a branch."""

    def body(carry, _):
        x, count = carry
        cubed, count = function(x, count)
        return (x + jax.lax.cond(count[0] > 4, lambda: 0.1 * cubed, lambda: 0 * x), count), None

    (x, count), _ = jax.lax.scan(body, (x, jnp.full(3, 4)), length=3)
    return jnp.sum(x**2) + 0 * jnp.sum(count)


def polynomial(x):
    for _ in range(3):
        x = x + 0.1 * x**3
    return jnp.sum(x**2)


PRODUCTS = {
    "forward over reverse": lambda f: lambda x: jax.jvp(jax.grad(f), (x,), (D,))[1],
    "reverse over forward": lambda f: jax.grad(lambda x: jax.jvp(f, (x,), (D,))[1]),
    "forward over forward": lambda f: jax.jacfwd(lambda x: jax.jvp(f, (x,), (D,))[1]),
    "of a checkpoint": lambda f: lambda x: jax.jvp(jax.grad(jax.checkpoint(f)), (x,), (D,))[1],
    "hessian": jax.hessian,
    "third": lambda f: jax.jacfwd(lambda x: jax.jvp(jax.grad(f), (x,), (D,))[1]),
}


@pytest.mark.parametrize("name", PRODUCTS)
@pytest.mark.parametrize("compiled", [jax.jit, lambda f: f], ids=["compiled", "not"])
def test_every_order_and_direction(name, compiled):
    product = PRODUCTS[name]
    found = compiled(product(partial(loss, ours)))(X)
    np.testing.assert_allclose(found, product(polynomial)(X), rtol=1e-5, atol=1e-6)


def test_what_it_is_for():
    """JAX's own rule is forgotten: the day that it is not, this module can go."""
    product = PRODUCTS["forward over reverse"]
    assert jnp.isnan(product(partial(loss, jaxs))(X)).any()


def test_batches():
    several = X * jnp.array([[1.0], [0.5], [-2.0], [0.0]])
    product = PRODUCTS["forward over reverse"]
    found = jax.jit(jax.vmap(product(partial(loss, ours))))(several)
    np.testing.assert_allclose(found, jax.vmap(product(polynomial))(several), rtol=1e-5, atol=1e-6)
    counts = jnp.arange(3)
    cubed, after = jax.vmap(ours, in_axes=(None, 0))(X, counts)
    np.testing.assert_array_equal(after, counts + 1)
    np.testing.assert_allclose(cubed, jnp.broadcast_to(X**3, (3, 3)), rtol=1e-5)


def test_values_are_the_function_s():
    for compiled in (ours, jax.jit(ours)):
        cubed, count = compiled(X, 4)
        np.testing.assert_allclose(cubed, X**3, rtol=1e-6)
        assert count == 5


def test_what_is_traced_must_be_given():
    def hidden(y):
        return own_rule(lambda x: x * y, lambda p, t: (p[0] * y, t[0] * y), X)

    with pytest.raises(TypeError, match="given all that is traced"):
        jax.jit(hidden)(2.0)
