"""A map with its transpose, in every transformation, against the same function left to JAX."""

from functools import partial

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from jax.sharding import Mesh, PartitionSpec

from jaxphys.core.linear_map import linear_map, zero_tangent

X = jnp.array([0.3, -1.2, 0.7, 2.0])
D = jnp.array([1.0, 0.5, -0.2, 0.3])


def plain(x, count):
    """A function of three results, one of them an integer, that JAX differentiates by itself."""
    return jnp.sin(x) * jnp.sum(x**2), jnp.cumsum(x**3), count + 1


def given(turn=1.0):
    """The same with a rule of its own; its transpose is multiplied by `turn`, to be told apart."""

    def forward(x, tangents):
        (of_x, none) = tangents
        assert none is None
        return jax.jvp(lambda x: plain(x, 0)[:2], (x,), (zeros(x, of_x),))[1]

    def transpose(x, cotangents):
        back = jax.vjp(lambda x: plain(x, 0)[:2], x)[1]
        like = plain(x, 0)[:2]
        filled = tuple(zeros(a, b) for a, b in zip(like, cotangents, strict=True))
        (to_x,) = back(filled)
        return turn * to_x, None

    @jax.custom_jvp
    def function(x, count):
        return plain(x, count)

    @function.defjvp
    def rule(primals, tangents):
        x, count = primals
        results = function(x, count)
        rates = linear_map(forward, transpose, x, (tangents[0], None), results[:2])
        return results, (*rates, zero_tangent(results[2]))

    return function


def zeros(like, rate):
    return zero_tangent(like) if rate is None else rate


def loss(function, x):
    """Both results several times over: in a loop, a branch, and a checkpoint."""

    def body(x, _):
        a, b, count = function(0.3 * x, 4)
        x = jax.lax.cond(count > 4, lambda: x + 0.1 * a + 0.02 * b, lambda: x)
        return x, b

    x, found = jax.lax.scan(body, x, length=3)
    x = jax.checkpoint(lambda x: function(x, 0)[0])(0.2 * x)
    return jnp.sum(x**2) + jnp.sum(found[1:] * found[:-1])


OURS, THEIRS = partial(loss, given()), partial(loss, plain)


def close(ours, theirs):
    np.testing.assert_allclose(ours, theirs, rtol=1e-12, atol=1e-12)


def hessian_product(f, x, d):
    return jax.jvp(jax.grad(f), (x,), (d,))[1]


def product_of_reverse(f, x, d):
    return jax.grad(lambda x: jax.jvp(f, (x,), (d,))[1])(x)


@pytest.mark.parametrize(
    "derivative",
    [
        lambda f, x, d: jax.jvp(f, (x,), (d,))[1],
        lambda f, x, d: jax.grad(f)(x),
        lambda f, x, d: jax.jacfwd(f)(x),
        hessian_product,
        product_of_reverse,
        lambda f, x, d: jax.grad(lambda x: jnp.vdot(jax.grad(f)(x), d))(x),
        lambda f, x, d: jax.vmap(jax.grad(f))(jnp.stack([x, 2 * d, x - d])),
    ],
    ids=[
        "jvp",
        "grad",
        "jacfwd",
        "forward_over_reverse",
        "reverse_over_forward",
        "reverse_over_reverse",
        "vmap_of_grad",
    ],
)
def test_every_derivative_is_that_of_the_function(derivative):
    run = jax.jit(derivative, static_argnums=0)
    close(run(OURS, X, D), run(THEIRS, X, D))


def test_third_derivative():
    def third(function):
        first = lambda x: function(x, 0)[0].sum()  # noqa: E731
        return jax.jit(jax.grad(lambda x: jnp.vdot(hessian_product(first, x, D), D)))(X)

    close(third(given()), third(plain))


def test_outside_of_jit():
    f, g = given(), plain
    for function in (f, g):
        assert function(X, 2)[2] == 3
    close(jax.grad(lambda x: f(x, 0)[1].sum())(X), 3 * X**2 * jnp.arange(4, 0, -1))
    close(
        jax.jvp(lambda x: f(x, 0)[0], (X,), (D,))[1], jax.jvp(lambda x: g(x, 0)[0], (X,), (D,))[1]
    )


def test_the_transpose_is_the_one_that_was_given():
    once, twice = given(), given(turn=2.0)
    value = lambda f: lambda x: f(x, 0)[0].sum()  # noqa: E731
    close(jax.grad(value(twice))(X), 2 * jax.grad(value(once))(X))
    close(jax.jvp(value(twice), (X,), (D,))[1], jax.jvp(value(once), (X,), (D,))[1])
    # Transposed twice it is the map itself.
    tangent = lambda d: jax.jvp(lambda x: twice(x, 0)[1], (X,), (d,))[1]  # noqa: E731
    back = jax.linear_transpose(tangent, X)
    forth = jax.linear_transpose(lambda c: back(c)[0], X)
    close(forth(D)[0], tangent(D))


def test_nothing_is_kept_but_what_the_map_depends_on():
    def end(x):
        return jax.lax.scan(lambda x, _: (given()(x, 0)[0], None), x, length=50)[0].sum()

    jaxpr = jax.make_jaxpr(jax.grad(end))(X).jaxpr
    forth = next(e for e in jaxpr.eqns if e.primitive.name == "scan")
    stacked = [v.aval.shape for v in forth.outvars[forth.params["num_carry"] :]]
    assert stacked == [(50, 4)]


def test_over_devices():
    if jax.device_count() < 2:
        pytest.skip("needs two devices")
    mesh = Mesh(np.array(jax.devices()[:2]), ("side",))

    def spread(f, x):
        share = jax.shard_map(
            lambda x: jax.lax.psum(f(x), "side"),
            mesh=mesh,
            in_specs=PartitionSpec("side"),
            out_specs=PartitionSpec(),
            check_vma=False,
        )
        return share(x)

    both = jnp.concatenate([X, D])
    ours, theirs = (jax.jit(jax.grad(partial(spread, f)))(both) for f in (OURS, THEIRS))
    close(ours, theirs)
    close(ours, jnp.concatenate([jax.grad(THEIRS)(X), jax.grad(THEIRS)(D)]))


def test_zero_tangents():
    found = zero_tangent((jnp.ones(2), jnp.arange(3)))
    assert found[0].dtype == jnp.ones(2).dtype and not found[0].any()
    assert found[1].dtype == jax.dtypes.float0 and found[1].shape == (3,)


def test_differentiated_beside_a_kink():
    """|x| d: a map whose derivative at zero is taken a little to the right of it, or not at all."""

    def rate(x, near):
        scale = lambda x, d: (jnp.abs(x) * d[0],)  # noqa: E731
        return linear_map(scale, scale, x, (1.0,), (x,), near=near)[0]

    for derivative in (jax.grad, jax.jacfwd):
        assert derivative(lambda x: rate(x, lambda x: x + 1e-9))(0.0) == 1
        assert derivative(lambda x: rate(x, lambda x: x - 1e-9))(0.0) == -1
    assert rate(0.0, lambda x: x + 1e-9) == 0
