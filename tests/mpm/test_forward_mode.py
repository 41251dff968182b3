"""Both directions of one rule: tangents against differences and against the transpose, and second
derivatives against differences of gradients. All in float64.
"""

from dataclasses import replace
from functools import partial

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from jaxphys.mpm.boundaries import Plane, Setting, prepare
from jaxphys.mpm.loop.adjoint import Checkpointed, Plain
from jaxphys.mpm.loop.frames import rollout_frames
from jaxphys.mpm.loop.one_pass import numbers_and_flags, whole
from jaxphys.mpm.loop.placement import Placement
from jaxphys.mpm.loop.rollout import rollout
from jaxphys.mpm.materials.catalogue import MATERIALS
from jaxphys.mpm.state import OK

from .cases import block, simulation_of
from .test_placement import EVERY_BOUNDARY, mixed

DT = 5e-4
SMALL = 1e-6
PLAIN = Plain()


def loss_by(config, model, state, adjoint=PLAIN, steps=3):
    """A loss of every array at the end, as a function of every number that a rollout is
    differentiated by, and these numbers.
    """
    names = ("position", "velocity", "affine", "deformation", "total", "history", "slip")
    start = {name: getattr(state, name) for name in names}
    numbers, flags = numbers_and_flags((model, start))

    def loss(numbers):
        model, start = whole(numbers, flags)
        end = rollout(config, model, state._replace(**start), dt=DT, steps=steps, adjoint=adjoint)
        value = jnp.sum(end.position**2) + 1e-2 * jnp.sum(jnp.sin(end.velocity))
        value += 1e-4 * jnp.sum(end.affine**2) + jnp.sum(end.deformation**3)
        value += 0 if end.total is None else jnp.sum(end.total**2)
        return value + (0 if end.history is None else jnp.sum(end.history**2))

    return loss, numbers


def direction_of(numbers, seed=0, size=1e-2):
    """A change of every number by about `size` of the largest of its array."""
    random = np.random.default_rng(seed)
    change = lambda x: size * jnp.max(jnp.abs(x)) * jnp.asarray(random.normal(size=x.shape))  # noqa: E731
    return jax.tree.map(change, numbers)


def moved(numbers, direction, h):
    return jax.tree.map(lambda x, d: x + h * d, numbers, direction)


def dot(a, b):
    return sum(jnp.vdot(x, y) for x, y in zip(*map(jax.tree.leaves, (a, b)), strict=True))


def both_directions(loss, numbers, direction):
    """(derivative along a direction forward, the same by the gradient, by central difference)."""

    @jax.jit
    def run(numbers, direction):
        forward = jax.jvp(loss, (numbers,), (direction,))[1]
        return forward, dot(jax.grad(loss)(numbers), direction)

    value = jax.jit(loss)
    high, low = (value(moved(numbers, direction, h)) for h in (SMALL, -SMALL))
    return *run(numbers, direction), (high - low) / (2 * SMALL)


def agree(forward, back, difference):
    assert abs(forward) > 1e-8
    np.testing.assert_allclose(forward, back, rtol=1e-12)
    np.testing.assert_allclose(forward, difference, rtol=1e-6)


@pytest.mark.parametrize(
    ("names", "boundaries"),
    [
        (("jelly", "metal"), EVERY_BOUNDARY[:3]),
        *(pytest.param((name,), EVERY_BOUNDARY, id=name) for name in MATERIALS),
    ],
)
@pytest.mark.slow
def test_laws_and_boundaries(names, boundaries):
    config, model, state = mixed(jnp.float64, boundaries, names, count=60)
    loss, numbers = loss_by(config, model, state)
    agree(*both_directions(loss, numbers, direction_of(numbers)))


@pytest.mark.parametrize(
    ("options", "adjoint"),
    [
        pytest.param({"placement": Placement(4, 16)}, PLAIN, marks=pytest.mark.slow),
        ({"window": (8, 8, 8)}, Checkpointed(2)),
    ],
    ids=["chunks on four devices", "window, checkpointed"],
)
def test_however_it_is_computed(options, adjoint):
    if options.get("placement", Placement()).devices > jax.device_count():
        pytest.skip("needs four host devices: see tests/conftest.py")
    config, model, state = block(count=40)
    loss, numbers = loss_by(replace(config, **options), model, state, adjoint, steps=4)
    direction = direction_of(numbers)
    found = both_directions(loss, numbers, direction)
    agree(*found)
    plain, _ = loss_by(config, model, state, steps=4)
    expected = jax.jit(lambda n: jax.jvp(plain, (n,), (direction,))[1])(numbers)
    np.testing.assert_allclose(found[0], expected, rtol=1e-11)


@pytest.fixture(scope="module")
def thrown():
    """A soft block that a floor with friction stops: (loss of three numbers, where)."""
    config, model, state = block(count=30)
    setting = Setting(
        config.grid, np.asarray(state.position.T), np.asarray(model.volume), np.float64
    )
    (floor,) = prepare([Plane((0.0, 0.0, 0.28), friction=0.4)], setting)
    state = state._replace(slip=jnp.zeros((floor.rows, 30))) if floor.rows else state
    stiffness, speed = model.parameters["youngs_modulus"], state.velocity

    def loss(x):
        parameters = model.parameters | {"youngs_modulus": stiffness * x[0]}
        changed = replace(model, parameters=parameters, boundaries=(floor,))
        start = state._replace(velocity=speed * x[1], position=state.position * x[2])
        end = rollout(config, changed, start, dt=1e-3, steps=4)
        return jnp.sum(end.position**2) + jnp.sum(jnp.sin(end.velocity))

    return loss, jnp.array([1.0, 1.1, 0.99])


def test_jacobians_of_both_directions(thrown):
    loss, x = thrown
    columns = jnp.stack([jax.jit(partial(_along, loss))(x, d) for d in jnp.eye(3)])
    forward = jax.jit(jax.jacfwd(loss))(x)
    np.testing.assert_allclose(forward, columns, rtol=1e-13)
    np.testing.assert_allclose(forward, jax.jit(jax.jacrev(loss))(x), rtol=1e-12)


def _along(loss, x, d):
    return jax.jvp(loss, (x,), (d,))[1]


@pytest.mark.slow
def test_gradients_of_several_scenes_at_once(thrown):
    loss, x = thrown
    scenes = x * jnp.array([[1.0], [1.02], [0.97]])
    gradient = jax.jit(jax.grad(loss))
    together = jax.jit(jax.vmap(jax.grad(loss)))(scenes)
    for scene, ours in zip(scenes, together, strict=True):
        np.testing.assert_allclose(ours, gradient(scene), rtol=1e-11)


@pytest.mark.slow
def test_hessian_in_both_orders(thrown):
    loss, x = thrown
    gradient = jax.jit(jax.grad(loss))
    forward_over_reverse = jax.jit(jax.jacfwd(jax.grad(loss)))(x)
    reverse_over_forward = jax.jit(jax.jacrev(jax.jacfwd(loss)))(x)
    scale = jnp.max(jnp.abs(forward_over_reverse))
    np.testing.assert_allclose(forward_over_reverse, forward_over_reverse.T, atol=1e-12 * scale)
    np.testing.assert_allclose(forward_over_reverse, reverse_over_forward, atol=1e-12 * scale)
    h = 1e-5
    differences = [(gradient(x + h * d) - gradient(x - h * d)) / (2 * h) for d in jnp.eye(3)]
    np.testing.assert_allclose(forward_over_reverse, differences, atol=1e-7 * scale)


@pytest.mark.parametrize(
    "names", [("metal",), *(pytest.param((n,), marks=pytest.mark.slow) for n in MATERIALS)]
)
@pytest.mark.slow
def test_second_derivatives_of_every_law(names):
    """In both orders, where the principal stretches differ and from rest, where all are one."""
    config, model, state = mixed(jnp.float64, EVERY_BOUNDARY[:1], names, count=60)
    loss, numbers = loss_by(config, model, state)
    slope = jax.jit(jax.grad(loss))
    direction = direction_of(numbers)
    along = lambda numbers: jax.jvp(loss, (numbers,), (direction,))[1]  # noqa: E731
    products = (
        jax.jit(lambda numbers: jax.jvp(jax.grad(loss), (numbers,), (direction,))[1]),
        jax.jit(jax.grad(along)),
    )
    rest = jnp.broadcast_to(jnp.eye(3)[:, :, None], state.deformation.shape)
    for start in (state.deformation, rest):
        numbers[1].update(deformation=start, total=start)
        gradient = slope(numbers)
        high, low = (slope(moved(numbers, direction, h)) for h in (SMALL, -SMALL))
        for product in products:
            found = product(numbers)
            for g, a, b, c in zip(*map(jax.tree.leaves, (gradient, found, high, low)), strict=True):
                rounding = 1e-14 / SMALL * float(jnp.max(jnp.abs(g)))
                expected = (b - c) / (2 * SMALL)
                np.testing.assert_allclose(
                    a, expected, atol=1e-6 * float(jnp.max(jnp.abs(expected))) + rounding
                )


def test_frames_forward():
    config, model, state = block(count=20)

    def loss(x, adjoint=PLAIN):
        start = state._replace(velocity=state.velocity * x)
        simulation = simulation_of(config, model, start, dt=DT, steps=3)
        motion = rollout_frames(simulation, 4, adjoint=adjoint)
        return jnp.sum(motion.position**3) + jnp.sum(motion.deformation**2)

    x, d = jnp.array(1.1), jnp.array(1.0)
    forward, back, difference = both_directions(loss, x, d)
    agree(forward, back, difference)
    again = jax.jit(partial(_along, partial(loss, adjoint=Checkpointed())))(x, d)
    np.testing.assert_allclose(again, forward, rtol=1e-13)


def test_a_failed_rollout_has_no_tangent():
    """With a number of steps that is traced, too."""
    config, model, state = block(count=10)

    def end(speed, steps):
        start = state._replace(velocity=state.velocity * speed)
        found = rollout(config, model, start, dt=DT, steps=steps)
        return found.position, found.status

    @jax.jit
    def run(speed, steps):
        rate = jax.jvp(lambda s: end(s, steps)[0], (speed,), (1.0,))[1]
        return rate, end(speed, steps)[1].code

    rate, code = run(1e6, 2)
    assert jnp.isnan(rate).all() and int(code) != OK
    rate, code = run(1.0, 2)
    assert int(code) == OK
    known = jax.jit(lambda s: jax.jvp(lambda s: end(s, 2)[0], (s,), (1.0,))[1])(1.0)
    np.testing.assert_allclose(rate, known, rtol=1e-13)
