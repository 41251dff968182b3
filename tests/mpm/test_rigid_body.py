"""A rigid body among particles: what it gives they get, and it meets planes as a body does."""

import dataclasses
from functools import partial

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.spatial.transform import Rotation

from jaxphys.core.errors import InputError
from jaxphys.gaussians.solid_mesh import solid_mesh
from jaxphys.mpm.boundaries import (
    Ball,
    Capsule,
    Cuboid,
    Cylinder,
    Free,
    MeshObstacle,
    Plane,
    Solid,
)
from jaxphys.mpm.boundaries.free import Wrench
from jaxphys.mpm.loop import rigid_body
from jaxphys.mpm.loop.placement import Placement
from jaxphys.mpm.loop.rollout import advance, rollout
from jaxphys.mpm.stepping.bounds import contact_bound, with_wave_modulus

from .cases import count_primitives, simulation_of
from .test_contact import G, H, body, contact_energy, lattice
from .test_obstacles import RATE, alone, ball_samples, check_derivatives, lowered, ready, seen

F32 = jnp.float32
FAR_AWAY = [[0.25, 0.25, 0.25]]


@partial(jax.jit, static_argnums=(0, 3))
def path(config, model, state, frames, steps, dt):
    """The states after each frame, stacked."""

    def frame(state, _):
        state = advance(config, model, state, dt, steps)
        return state, state

    return jax.lax.scan(frame, state, length=frames)[1]


def free(shape=Ball, *size, **fields):
    return shape((0.6, 0.5, 0.6), *size, friction=0.3, motion=Free(**fields))


def momenta(state, model, h=H):
    """Momentum (3,) and angular momentum (3,) of particles and body together."""
    x, v, C = (np.asarray(a) for a in (state.position, state.velocity, state.affine))
    m = np.asarray(model.mass)
    momentum = (m * v).sum(1)
    # The affine part of APIC carries m h^2 / 4 times its rotation.
    turn = h**2 / 4 * np.stack([C[2, 1] - C[1, 2], C[0, 2] - C[2, 0], C[1, 0] - C[0, 1]])
    angular = (m * (np.cross(x.T, v.T).T + turn)).sum(1)
    solid = state.rigid
    return momentum + solid.momentum, (
        angular + np.cross(solid.position, solid.momentum) + solid.angular_momentum
    )


def struck(dtype=jnp.float64, **fields):
    """A block of jelly that a spinning cuboid strikes off its middle: config, model, state, dt."""
    points = lattice(0, (0.2, 0.2, 0.2), H / 2) + np.array([0.5, 0.4, 0.4])
    solid = Cuboid(
        (0.31, 0.42, 0.52), (0.12, 0.1, 0.08), orientation=(0.95, 0.1, 0.2, 0.1),
        motion=Free(density=700.0, velocity=(1.0, 0.2, 0.0), spin=(2.0, -3.0, 1.0)), **fields,
    )  # fmt: skip
    made = body(points, (H / 2) ** 3, (solid,), gravity=(0, 0, 0), nodes=(13, 12, 12), dtype=dtype)
    return *made, 0.3 * float(contact_bound(with_wave_modulus(*made[:2]), made[0].grid))


def test_momentum_and_angular_momentum_are_conserved_to_the_last_digits():
    config, model, state, dt = struck(friction=0.5)
    before = momenta(state, model)
    states = path(config, model, state, 8, 12, dt)
    assert int(states.status.code[-1]) == 0
    end = jax.tree.map(lambda a: a[-1], states)
    given = np.abs(np.asarray(end.rigid.momentum - state.rigid.momentum)).max()
    turned = np.abs(np.asarray(end.rigid.angular_momentum - state.rigid.angular_momentum)).max()
    assert given > 0.1 and turned > 0.005
    for whole, at_first in zip(momenta(end, model), before, strict=True):
        np.testing.assert_allclose(whole, at_first, atol=1e-13 * 1e2)


def energy(config, model, state, after):
    """Of a body and particles without stress, of contact, and of weight [J]; velocities are the
    mean of two, for they belong half a step earlier than places.
    """
    obstacle = model.boundaries[0]
    motion, solid = obstacle.motion, obstacle.solid()
    both = [state.rigid, after.rigid]
    p, s = (0.5 * sum(getattr(b, n) for b in both) for n in ("momentum", "angular_momentum"))
    axes = Rotation.from_quat(np.roll(np.asarray(state.rigid.orientation), -1)).as_matrix()
    inertia = axes @ np.asarray(motion.inertia_of(solid)) @ axes.T
    kinetic = 0.5 * p @ p / motion.mass_of(solid) + 0.5 * s @ np.linalg.solve(inertia, s)
    v = 0.5 * (state.velocity + after.velocity)
    kinetic += 0.5 * float(jnp.sum(model.mass * jnp.sum(v**2, axis=0)))
    there = dataclasses.replace(
        obstacle, centre=state.rigid.position, orientation=state.rigid.orientation, motion=None
    )
    distance = there.faces(state.position, state.time)[0].distance
    return float(kinetic), float(contact_energy(model, config, state.position, distance))


def test_energy_is_kept_without_friction():
    """One particle strikes a ball and leaves it as masses do that meet, e = 1."""
    solid = Ball((0.6, 0.35, 0.4), 0.1, friction=0.0, motion=Free(mass=0.5))
    config, model, state = alone(
        [[0.6, 0.35, 0.5 + H / 4 + 0.005]], (solid,), gravity=(0, 0, 0), velocity=(0, 0, -1.0),
        nodes=(13, 8, 12),
    )  # fmt: skip
    m, M = float(model.mass[0]), 0.5
    rate = RATE * (1 + m / M)
    dt = 0.05 / rate**0.5
    states = path(config, model, state, 20, 10, dt)
    found = [jax.tree.map(lambda a, i=i: np.asarray(a[i]), states) for i in range(20)]
    one_later = [path(config, model, s, 1, 1, dt) for s in found[::4]]
    one_later = [jax.tree.map(lambda a: a[0], s) for s in one_later]
    energies = [energy(config, model, s, a) for s, a in zip(found[::4], one_later, strict=True)]
    assert max(stored for _, stored in energies) > 0.05 * 0.5 * m
    np.testing.assert_allclose(np.sum(energies, axis=1), 0.5 * m, rtol=5e-3)
    end = found[-1]
    assert end.velocity[2, 0] == pytest.approx(-(m - M) / (m + M), rel=2e-3)
    assert end.rigid.momentum[2] / M == pytest.approx(-2 * m / (m + M), rel=2e-3)
    known = with_wave_modulus(config, model)
    rates = [float(b.stiffest(known, config.grid)) for b in model.boundaries]
    assert rates[0] > rate  # the bound takes many particles at once


def test_a_turning_body_follows_eulers_equations():
    """Of an uneven box, whose turn is anything but steady; its momentum stays as it is."""
    spin, size = np.array([0.5, 6.0, 0.2]), np.array([0.15, 0.1, 0.05])
    solid = free(Cuboid, tuple(size), density=500.0, spin=tuple(spin), velocity=(0.1, 0, 0))
    config, model, state = alone(FAR_AWAY, (solid,), gravity=(0, 0, 0), nodes=(8, 8, 8))
    mass = 500.0 * 8 * size.prod()
    inertia = mass / 3 * (np.sum(size**2) - size**2)

    def rates(_, y):
        """Of the quaternion, the real part last, and of the spin in the body's own axes."""
        v, s, w = y[:3], y[3], y[4:]
        turn = 0.5 * np.append(s * w + np.cross(v, w), -v @ w)
        return np.append(turn, -np.cross(w, inertia * w) / inertia)

    exact = solve_ivp(rates, (0, 2.0), [0, 0, 0, 1, *spin], rtol=1e-10, atol=1e-12).y[:, -1]
    errors = []
    for steps in (500, 1000):
        end = jax.tree.map(
            lambda a: np.asarray(a[0]), path(config, model, state, 1, steps, 2.0 / steps)
        )
        turn = Rotation.from_quat(np.roll(end.rigid.orientation, -1))
        errors.append((turn * Rotation.from_quat(exact[:4]).inv()).magnitude())
        np.testing.assert_array_equal(end.rigid.angular_momentum, state.rigid.angular_momentum)
        np.testing.assert_allclose(end.rigid.position, [0.8, 0.5, 0.6])
    assert errors[1] < 0.02 and 3.3 < errors[0] / errors[1] < 4.7  # second order


def on_the_floor(shape, seconds, dt, gravity=(0, 0, -G), mu=0.3):
    """The states of a body that starts at or above z = 0.3."""
    # The particle takes no part.
    config, model, state = alone(
        [[0.25, 0.25, 1.1]],
        (shape, Plane((0, 0, 0.3), friction=mu)),
        gravity=gravity,
        nodes=(8, 8, 14),  # the body needs none
    )
    return path(config, model, state, 10, round(seconds / dt / 10), dt)


def test_a_ball_falls_leaps_and_rests():
    """It leaves the floor with its restitution, and lies at last where it touches."""
    dt = 1e-3
    ball = Ball((0.6, 0.5, 0.5), 0.1, friction=0.3, motion=Free(density=400.0, restitution=0.6))
    states = on_the_floor(ball, 0.25, dt)
    height = np.asarray(states.rigid.position)[:, 2] - 0.4
    speed = np.asarray(states.rigid.momentum)[:, 2] / (400 * 4 / 3 * np.pi * 1e-3)
    strike = (2 * G * 0.1) ** 0.5
    falls = np.asarray(states.time) < strike / G
    np.testing.assert_allclose(height[falls], 0.1 - 0.5 * G * states.time[falls] ** 2, atol=1e-3)
    leaps = np.asarray(states.time) > strike / G + 0.03
    share = np.sqrt(speed**2 + 2 * G * height)[leaps] / strike
    assert falls.sum() == 5 and leaps.sum() > 2
    np.testing.assert_allclose(share, 0.6, atol=0.05)
    states = on_the_floor(ball, 0.9, dt)
    assert abs(float(states.rigid.position[-1, 2]) - 0.4) < 20 * G * dt**2
    assert float(jnp.abs(states.rigid.momentum[-1, 2])) < 1e-2 * 400 * 4 / 3 * np.pi * 1e-3


def test_a_ball_rolls_and_a_box_slides_or_holds():
    """Rolling down a slope it gains 5/7 of what it would gain sliding without friction."""
    dt, slope = 5e-4, np.arctan(0.4)
    pull = (G * np.sin(slope), 0.0, -G * np.cos(slope))
    depth = 100 * G * dt**2

    def travelled(shape, mu):
        states = on_the_floor(shape, 0.3, dt, gravity=pull, mu=mu)
        return np.asarray(states.rigid.position)[-1] - np.array(shape.centre), states

    ball = Ball((0.6, 0.5, 0.4), 0.1, friction=0.3, motion=Free(mass=2.0, restitution=0.0))
    way, states = travelled(ball, 0.3)
    seconds = float(states.time[-1])
    assert way[0] == pytest.approx(5 / 7 * 0.5 * pull[0] * seconds**2, rel=0.03)
    spin = np.asarray(states.rigid.angular_momentum)[-1] / (0.4 * 2.0 * 0.01)
    np.testing.assert_allclose(spin, [0, 5 / 7 * pull[0] * seconds / 0.1, 0], rtol=0.03, atol=0.01)
    box = Cuboid((0.6, 0.5, 0.35), (0.1, 0.1, 0.05), friction=0.3,
                 motion=Free(mass=2.0, restitution=0.0))  # fmt: skip
    way, _ = travelled(box, 0.5)
    assert np.abs(way).max() < 2 * depth
    way, _ = travelled(box, 0.2)
    expected = 0.5 * (pull[0] + 0.2 * pull[2]) * seconds**2
    assert way[0] == pytest.approx(expected, rel=0.05) and abs(way[2]) < 2 * depth


def test_shapes_know_their_volume_inertia_and_surface():
    random = np.random.default_rng(0)
    shapes = (
        Ball((0.5,) * 3, 0.2),
        Cuboid((0.5,) * 3, (0.2, 0.1, 0.15)),
        Cuboid((0.5,) * 3, (0.2, 0.1, 0.15), rounding=0.06),
        Cylinder((0.5,) * 3, 0.15, 0.2),
        Capsule((0.5,) * 3, 0.1, 0.15),
    )
    x = random.uniform(-0.3, 0.3, (200_000, 3))
    for shape in shapes:
        made = ready(shape)
        solid = jax.jit(lambda made: made.solid())(made)
        distance = np.asarray(seen(made, x.T + 0.5)[0][0])
        inside = distance < 0
        assert float(solid.volume) == pytest.approx(0.6**3 * inside.mean(), rel=0.02)
        squares = 0.6**3 * (x[:, :, None] * x[:, None])[inside].sum(0) / len(x)
        inertia = np.trace(squares) * np.eye(3) - squares
        np.testing.assert_allclose(solid.inertia, inertia, rtol=0.04, atol=3e-5)
        shell = 0.6**3 * (np.abs(distance) < 0.005).mean() / 0.01
        assert float(solid.area) == pytest.approx(shell, rel=0.05)
        touching = seen(made, np.asarray(solid.points) + 0.5)[0][0]
        np.testing.assert_allclose(touching, -solid.radius, atol=1e-12)


def test_a_mesh_knows_its_own():
    """A box that does not lie about its middle, cut from a cube: a wedge of known moments."""
    corners = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]])
    wedge = corners[[[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]]] + 3.0
    for triangles in (wedge, wedge[:, ::-1]):
        found = solid_mesh(triangles)
        assert found.volume == pytest.approx(1 / 6)
        np.testing.assert_allclose(found.middle, np.full(3, 0.25 - 0.5))
        # Of a corner of a cube: 1/60 for x^2, 1/120 for x y, about its right-angled corner.
        squares = np.full((3, 3), 1 / 120) + np.eye(3) / 120 - np.full((3, 3), 1 / 96)
        np.testing.assert_allclose(found.inertia, np.trace(squares) * np.eye(3) - squares)
        assert found.area == pytest.approx(1.5 + 0.75**0.5)
        assert sorted(map(tuple, found.points.T + 0.5)) == sorted(map(tuple, corners))
    unit = Solid(*solid_mesh(wedge))
    mesh = MeshObstacle((0.6, 0.5, 0.6), "a.ply", 0.2, samples=ball_samples(), unit=unit,
                        motion=Free(density=100.0, spin=(0, 0, 2.0)))  # fmt: skip
    made = ready(mesh)
    start = made.body((made,))
    arm = np.full(3, -0.05)
    np.testing.assert_allclose(start.position, np.array([0.6, 0.5, 0.6]) + arm)
    mass = 100 * 0.008 / 6
    np.testing.assert_allclose(start.momentum, mass * np.cross([0, 0, 2.0], arm))


def test_a_body_on_several_devices_in_chunks_and_in_float32():
    """Three particles, one of the four places for which is empty, fall on it."""
    if jax.device_count() < 2:
        pytest.skip("needs two host devices: see tests/conftest.py")
    solid = Ball((0.6, 0.35, 0.4), 0.1, friction=0.0,
                 motion=Free(mass=0.5, velocity=(0.2, 0.1, 0.3), spin=(0, 1.0, 2.0)))  # fmt: skip
    points = [[0.55, 0.33, 0.53], [0.66, 0.36, 0.53], [0.6, 0.4, 0.53]]
    config, model, state = alone(points, (solid,), velocity=(0, 0, -1.0), nodes=(13, 8, 12))

    def end(config, model, state):
        return path(config, model, state, 1, 40, 0.1 / RATE**0.5).rigid

    whole = end(config, model, state)
    assert float(jnp.abs(whole.momentum[0, :2] - state.rigid.momentum[:2]).min()) > 1e-3
    apart = end(dataclasses.replace(config, placement=Placement(2, 16)), model, state)
    np.testing.assert_allclose(apart.momentum, whole.momentum, rtol=1e-11)
    np.testing.assert_allclose(apart.position, whole.position, rtol=1e-11)
    coarse = end(*alone(points, (solid,), velocity=(0, 0, -1.0), nodes=(13, 8, 12), dtype=F32))
    assert coarse.momentum.dtype == coarse.orientation.dtype == F32
    np.testing.assert_allclose(coarse.position, whole.position, atol=1e-6)
    np.testing.assert_allclose(coarse.orientation, whole.orientation, atol=1e-6)


NUMBERS = ("centre", "orientation", "density", "velocity", "spin", "restitution", "radius",
           "half_height")  # fmt: skip


def striking():
    """A capsule that turns and is about to strike a slope: boundaries, and what is among them."""
    solid = Capsule((0.6, 0.35, 0.5), 0.1, 0.1, orientation=(0.8, 0.1, 0.5, 0.2), friction=0.4,
                    motion=Free(density=300.0, velocity=(0, 0.1, -0.5), spin=(1.0, 2.0, -1.0),
                                restitution=0.5))  # fmt: skip
    return solid, Plane((0.6, 0.35, 0.345), (0.05, 0.0, 1.0), friction=0.3)


def of_the_end(body):
    """A mean of all that a body ends with."""
    w = jnp.asarray(np.random.default_rng(1).normal(size=(4, 3)))
    mean = jnp.sum(w[0] * body.position) + jnp.sum(w[1] * body.momentum)
    return mean + 10 * jnp.sum(w[2] * body.angular_momentum) + jnp.sum(w[3] * body.orientation[1:])


def test_derivatives_of_a_bodys_own_motion_are_central_differences():
    """It falls on a slope, leaps and rubs."""
    boundaries = tuple(ready(one, place=(0.6, 0.6, 0.9)) for one in striking())
    dt, gravity = jnp.asarray(1e-3), jnp.array([0.0, 0.0, -G])
    nothing = Wrench(jnp.array([0.01, 0.02, 0.0]), jnp.array([1e-3, 0.0, 2e-3]))

    def end(boundaries):
        def one(body, time):
            body = rigid_body.moved(boundaries[0], body, dt)
            there = rigid_body.placed(boundaries, boundaries[0], body)
            return rigid_body.pushed(there, body, nothing, gravity, time, dt, dt), None

        start = boundaries[0].body(boundaries)
        return of_the_end(jax.lax.scan(one, start, jnp.arange(60) * dt)[0])

    run = jax.jit(jax.value_and_grad(end))
    check_derivatives(run, boundaries, 0, NUMBERS)
    check_derivatives(run, boundaries, 1, ("point", "normal", "friction"))


@pytest.mark.slow
def test_derivatives_through_a_body_among_particles_are_central_differences():
    points = np.array([[0.55, 0.36, 0.8], [0.66, 0.34, 0.8], [0.6, 0.4, 0.8]])
    config, model, state = alone(points, striking(), nodes=(13, 8, 12), velocity=(0, 0, -1.0))
    state = lowered(model, state)
    config = dataclasses.replace(config, check_step=False)

    def end(boundaries):
        made = dataclasses.replace(model, boundaries=boundaries)
        begin = state._replace(rigid=boundaries[0].body(boundaries))
        after = rollout(config, made, begin, dt=0.1 / RATE**0.5, steps=60)
        return of_the_end(after.rigid) + jnp.sum(after.position[1:])

    run = jax.jit(jax.value_and_grad(end))
    check_derivatives(run, model.boundaries, 0, (*NUMBERS, "friction"))
    check_derivatives(run, model.boundaries, 1, ("point", "friction"))


def test_a_simulations_body_starts_by_the_numbers_that_it_is_given():
    config, model, state, _ = struck()
    simulation = simulation_of(config, model, state, dt=1e-3, steps=1, carriers=1)

    @jax.jit
    def begin(centre, velocity):
        numbers = {"centre": centre, "motion": {"velocity": velocity}}
        made = simulation.with_(boundaries={0: numbers})
        return made.state.rigid, made.frame(made.state).body

    centre, velocity = jnp.array([0.3, 0.4, 0.5]), jnp.array([1.0, 2.0, 3.0])
    body, seen = begin(centre, velocity)
    np.testing.assert_allclose(body.position, centre)
    np.testing.assert_allclose(seen.centre, centre)
    np.testing.assert_allclose(body.momentum, 700 * 8 * 0.12 * 0.1 * 0.08 * velocity)
    np.testing.assert_allclose(body.angular_momentum, state.rigid.angular_momentum)


def test_a_step_without_a_body_holds_nothing_of_one():
    def primitives(motion):
        ball = Ball((0.6, 0.5, 0.6), 0.1, friction=0.3, motion=motion)
        config, model, state = alone(FAR_AWAY, (ball,), nodes=(13, 12, 12))
        traced = jax.make_jaxpr(lambda m, s: advance(config, m, s, 1e-3, 1))(model, state)
        assert (state.rigid is None) == (motion is None)
        return [count_primitives(traced.jaxpr, name) for name in ("psum", "atan2", "sin", "cos")]

    assert primitives(None) == [0, 0, 0, 0]
    assert primitives(Free(mass=1.0))[2] > 0


def test_what_cannot_be_free_is_refused():
    ball = Ball((0.6, 0.5, 0.6), 0.1, motion=Free(mass=1.0))
    other = dataclasses.replace(ball, centre=(0.9, 0.5, 0.6))
    with pytest.raises(InputError, match=r"boundaries\[1\].motion: is free.*may have one"):
        alone(FAR_AWAY, (ball, other), nodes=(13, 12, 12))
    for change, message in (
        ({"inside": True}, "motion: only a solid that acts on particles from outside"),
        ({"surface": "sticky"}, "motion: only a solid that acts on particles from outside"),
    ):
        with pytest.raises(InputError, match=message):
            ready(dataclasses.replace(ball, **change))
    for fields in ({}, {"mass": 1.0, "density": 2.0}):
        with pytest.raises(InputError, match="density: give a free body either"):
            Free(**fields)
    config, model, state = alone(FAR_AWAY, (ball,), nodes=(13, 12, 12))
    with pytest.raises(InputError, match=r"State.rigid does not fit"):
        advance(config, model, state._replace(rigid=None), 1e-3, 1)
    still = dataclasses.replace(ball, motion=None)
    _, model, _ = alone(FAR_AWAY, (still,), nodes=(13, 12, 12))
    with pytest.raises(InputError, match=r"State.rigid does not fit"):
        advance(config, model, state, 1e-3, 1)
