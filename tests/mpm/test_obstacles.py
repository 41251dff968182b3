"""Obstacles by signed distance: where they are, how they move, and what they do to matter."""

import dataclasses
from functools import partial

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from scipy.spatial.transform import Rotation, Slerp

from jaxphys.core.errors import InputError
from jaxphys.mpm.boundaries import (
    Ball,
    Capsule,
    Cuboid,
    Cylinder,
    Damping,
    Keyframes,
    MeshObstacle,
    Plane,
    Rotate,
    Samples,
    Setting,
    Steady,
)
from jaxphys.mpm.grid import Grid
from jaxphys.mpm.loop.rollout import advance, rollout
from jaxphys.mpm.stepping.bounds import fastest

from .test_contact import DUST, P_WAVE, G, H, body, lattice

MIDDLE = np.array([0.6, 0.5, 0.55])
TURN = Rotation.from_rotvec([0.3, -0.7, 0.4])
QUATERNION = tuple(np.roll(TURN.as_quat(), 1))
RADIUS, HALF, SIZE, ROUND = 0.1, 0.2, np.array([0.1, 0.2, 0.15]), 0.04


def ball_samples(radius=0.5, steps=12):
    """A ball of unit diameter, sampled; linear between samples."""
    axis = np.arange(-steps, steps + 1) / steps
    x = np.stack(np.meshgrid(axis, axis, axis, indexing="ij"))
    return Samples(np.sqrt((x**2).sum(0)) - radius, np.full(3, axis[0]), np.array(1 / steps))


def ball_mesh(centre, diameter, **fields):
    return MeshObstacle(centre, "ball.stl", diameter, samples=ball_samples(), **fields)


def ready(boundary, dtype=np.float64, place=(0.1, 0.1, 0.1)):
    setting = Setting(Grid((12, 12, 12), H), np.array([place]), np.array([1e-6]), dtype)
    return boundary.prepared(setting)


@jax.jit
def seen(boundary, x, time=0.0):
    """Distance, normal and velocity of each face at places x (3, N)."""
    return [(f.distance, f.normal, f.velocity) for f in boundary.faces(x, jnp.asarray(time))]


def directions(count):
    """Unit vectors (count, 3), spread evenly."""
    z = 1 - 2 * (np.arange(count) + 0.5) / count
    turn = np.pi * (1 + 5**0.5) * np.arange(count)
    return np.stack([np.sqrt(1 - z**2) * np.cos(turn), np.sqrt(1 - z**2) * np.sin(turn), z], 1)


def ray_surface(inside):
    """Points of the surface of a convex solid around 0, by bisection along rays."""
    rays = directions(60_000)
    low, high = np.zeros(len(rays)), np.full(len(rays), 1.0)
    for _ in range(40):
        middle = (low + high) / 2
        within = inside(rays * middle[:, None])
        low, high = np.where(within, middle, low), np.where(within, high, middle)
    return rays * low[:, None]


def in_rounded(x):
    beyond = np.maximum(np.abs(x) - (SIZE - ROUND), 0)
    return (beyond**2).sum(1) < ROUND**2


SHAPES = {
    "ball": (Ball(tuple(MIDDLE), RADIUS, orientation=QUATERNION),
             lambda x: (x**2).sum(1) < RADIUS**2),
    "cuboid": (Cuboid(tuple(MIDDLE), tuple(SIZE), orientation=QUATERNION),
               lambda x: (np.abs(x) < SIZE).all(1)),
    "round cuboid": (
        Cuboid(tuple(MIDDLE), tuple(SIZE), rounding=ROUND, orientation=QUATERNION), in_rounded),
    "cylinder": (Cylinder(tuple(MIDDLE), RADIUS, HALF, orientation=QUATERNION),
                 lambda x: (np.hypot(x[:, 0], x[:, 1]) < RADIUS) & (np.abs(x[:, 2]) < HALF)),
    "capsule": (Capsule(tuple(MIDDLE), RADIUS, HALF, orientation=QUATERNION), lambda x: (
        np.hypot(np.hypot(x[:, 0], x[:, 1]), np.maximum(np.abs(x[:, 2]) - HALF, 0)) < RADIUS)),
}  # fmt: skip


@pytest.mark.parametrize("name", SHAPES)
def test_distance_is_that_of_the_nearest_of_many_points_of_the_surface(name):
    """And the normal is the slope of the distance, of unit length; a hollow has the reverse."""
    made, inside = SHAPES[name]
    made = ready(made)
    own = np.random.default_rng(1).uniform(-0.35, 0.35, (60, 3))
    x = TURN.apply(own) + MIDDLE
    surface = ray_surface(inside)
    nearest = np.array([np.sqrt(((surface - p) ** 2).sum(1).min()) for p in own])
    signed = np.where(inside(own), -nearest, nearest)
    ((distance, normal, _),) = seen(made, x.T)
    # Of what has edges, rays leave some of these farther apart.
    np.testing.assert_allclose(distance, signed, atol=5e-3)
    assert np.abs(np.asarray(distance) - signed).mean() < 5e-4

    nudge = 1e-6

    def at(shift):
        return np.asarray(seen(made, (x + shift).T)[0][0])

    slope = [(at(nudge * e) - at(-nudge * e)) / (2 * nudge) for e in np.eye(3)]
    np.testing.assert_allclose(normal, slope, atol=1e-6)
    hollow = dataclasses.replace(made, inside=True)
    faces = seen(hollow, x.T)
    assert len(faces) == len(hollow.kinds) == {"cuboid": 3, "cylinder": 2}.get(name, 1)
    room = np.min([face[0] for face in faces], axis=0)
    np.testing.assert_allclose(room[inside(own)], -np.asarray(distance)[inside(own)], atol=1e-15)
    assert (room[~inside(own)] <= 0).all()


def test_samples_are_linear_in_between_and_never_nearer_beyond():
    mesh = ready(ball_mesh((0.5, 0.5, 0.5), 0.4))
    x = 0.5 + np.random.default_rng(2).uniform(-0.5, 0.5, (200, 3))
    ((distance, normal, _),) = jax.tree.map(np.asarray, seen(mesh, x.T))
    arm = x - 0.5
    exact = np.linalg.norm(arm, axis=1) - 0.2
    within = np.abs(arm).max(1) < 0.4
    near = within & (exact > -0.1)
    # The second derivative is 1 / |x|, and steps are of 0.4 / 12: errors of h^2 / 8 a direction.
    assert np.abs(distance - exact)[near].max() < 2 * (0.4 / 12) ** 2 / 8 / 0.1
    cosine = np.sum(normal.T * arm, 1) / np.linalg.norm(arm, axis=1)
    assert cosine[near].min() > 0.98
    assert distance[~within].min() > 0.1
    assert np.isfinite(seen(mesh, np.full((3, 200), 0.5))[0][1]).all()
    assert np.isnan(seen(mesh, np.full((3, 200), np.nan))[0][0]).all()


@pytest.mark.parametrize("smooth", [False, True])
def test_keyframes_go_straight_and_turn_about_one_axis(smooth):
    times = np.array([0.2, 0.5, 1.1])
    places = np.array([[0.0, 0.0, 0.0], [0.3, 0.1, 0.0], [0.3, -0.2, 0.4]])
    turns = Rotation.from_rotvec([[0, 0, 0], [0.5, 1.0, -0.3], [0.2, 1.2, 2.0]])
    motion = Keyframes(
        tuple(times),
        tuple(map(tuple, places)),
        tuple(map(tuple, -2 * np.roll(turns.as_quat(), 1, axis=1))),
        "smooth" if smooth else "linear",
    )
    made = ready(Cuboid(tuple(MIDDLE), tuple(SIZE), orientation=QUATERNION, motion=motion))
    pose = jax.jit(made.pose)
    slerp = Slerp(times, turns)
    for time in (0.1, 0.2, 0.3, 0.45, 0.5, 0.7, 1.0, 1.4):
        k = min(max(np.searchsorted(times, time, side="right") - 1, 0), 1)
        share = np.clip((time - times[k]) / (times[k + 1] - times[k]), 0, 1)
        share = 3 * share**2 - 2 * share**3 if smooth else share
        found = pose(time)
        np.testing.assert_allclose(
            found.centre, MIDDLE + (1 - share) * places[k] + share * places[k + 1], atol=1e-12
        )
        expected = slerp(times[k] + share * (times[k + 1] - times[k])) * TURN
        turned = Rotation.from_quat(np.roll(found.orientation, -1))
        assert (turned * expected.inv()).magnitude() < 1e-7
        if time not in times:  # where the speed jumps
            before, after = pose(time - 1e-6), pose(time + 1e-6)
            velocity = (after.centre - before.centre) / 2e-6
            np.testing.assert_allclose(found.velocity, velocity, atol=1e-7)
            turns_of = [Rotation.from_quat(np.roll(p.orientation, -1)) for p in (before, after)]
            spin = (turns_of[1] * turns_of[0].inv()).as_rotvec() / 2e-6
            np.testing.assert_allclose(found.spin, spin, atol=1e-6)
    if smooth:
        assert np.abs(pose(0.5).velocity).max() == 0
    speeds = (
        np.linalg.norm(np.diff(places, axis=0), axis=1)
        + np.linalg.norm(SIZE) * (turns[1:] * turns[:-1].inv()).magnitude()
    )
    fastest = (1.5 if smooth else 1) * np.max(speeds / np.diff(times))
    assert float(made.fastest()) == pytest.approx(fastest)


def test_a_steady_motion_turns_about_the_centre():
    motion = Steady((0.1, 0.0, 0.2), (0.0, 3.0, 4.0), start=0.5, end=1.5)
    made = ready(Cuboid(tuple(MIDDLE), tuple(SIZE), orientation=QUATERNION, motion=motion))
    for time, passed in ((0.4, 0.0), (0.9, 0.4), (2.0, 1.0)):
        pose = jax.jit(made.pose)(time)
        np.testing.assert_allclose(pose.centre, MIDDLE + passed * np.array([0.1, 0, 0.2]))
        expected = Rotation.from_rotvec(np.array([0, 3.0, 4.0]) * passed) * TURN
        turned = Rotation.from_quat(np.roll(pose.orientation, -1))
        assert (turned * expected.inv()).magnitude() < 1e-7
    x = np.array([[0.7, 0.3], [0.5, 0.2], [0.6, 0.9]])
    centre = MIDDLE + 0.4 * np.array([0.1, 0, 0.2])
    expected = np.array([0.1, 0, 0.2]) + np.cross([0, 3.0, 4.0], x.T - centre)
    np.testing.assert_allclose(seen(made, x, 0.9)[0][2].T, expected)
    assert np.all(seen(made, x, 1.6)[0][2] == 0)
    assert float(made.fastest()) == pytest.approx(0.05**0.5 + 5 * np.linalg.norm(SIZE))


def alone(points, boundaries, *, gravity=(0, 0, -G), velocity=(0, 0, 0), nodes=(26, 8, 14),
          dtype=jnp.float64):  # fmt: skip
    """Particles without stress, so far apart that none feels another."""
    volume = (H / 2) ** 3
    config, model, state = body(
        np.asarray(points), volume, boundaries, gravity=gravity, velocity=velocity, nodes=nodes,
        dtype=dtype,
    )  # fmt: skip
    return dataclasses.replace(config, segments=((DUST, 0, len(points)),)), model, state


@partial(jax.jit, static_argnums=0)
def ends(config, model, state, steps, dt):
    return advance(config, model, state, dt, steps)


RATE = 2 * 2e4 * P_WAVE / 1000.0 / H**2  # of the springs, over mass [1/s^2]


def test_particles_rest_on_every_shape_at_the_depth_of_their_spring():
    """m g = k (r - d), and in a room alike."""
    x, z, r = 0.4 + 0.4 * np.arange(6), 0.6, H / 4
    quarter = (0.5**0.5, 0.5**0.5, 0.0, 0.0)
    smooth = {"friction": 0.0}
    # Near its faces the distance of a cube is linear, and so exact between samples.
    axis = np.arange(-8, 9) / 10
    largest = np.abs(np.stack(np.meshgrid(axis, axis, axis, indexing="ij"))).max(axis=0)
    cube = Samples(largest - 0.5, np.full(3, -0.8), np.array(0.1))
    shapes = (
        Ball((x[0], 0.35, z - 0.1), 0.1, **smooth),
        Cuboid((x[1], 0.35, z - 0.2), (0.1, 0.2, 0.1), orientation=quarter, **smooth),
        Cylinder((x[2], 0.35, z - 0.1), 0.1, 0.1, orientation=quarter, **smooth),
        Capsule((x[3], 0.35, z - 0.25), 0.1, 0.15, **smooth),
        MeshObstacle((x[4], 0.35, z - 0.1), "cube.stl", 0.2, samples=cube, **smooth),
        Cuboid((1.4, 0.35, 0.9), (1.3, 0.3, 0.4), inside=True, **smooth),
        Damping(0.5 * RATE**0.5),
    )
    floors = np.array([z] * 5 + [0.5])  # the last one's is that of the room around all
    points = np.stack([x, np.full(6, 0.35), floors + r], 1)
    config, model, state = alone(points, shapes, nodes=(30, 8, 12))
    end = ends(config, model, state, 140, 0.5 / RATE**0.5)  # longer, and one falls off a ball
    assert int(end.status.code) == 0
    np.testing.assert_allclose(end.position[2], floors + r - G / RATE, atol=1e-6)
    np.testing.assert_allclose(end.position[:2], points.T[:2], atol=1e-6)


def test_coulombs_law_holds_on_a_tilted_cuboid():
    """Held below the angle of friction, a g (sin - mu cos) above it."""
    friction, slopes = 0.5, np.arctan(0.5 * np.array([0.9, 1.5]))
    x = np.array([0.6, 1.7])
    shapes, points = [], []
    for place, slope in zip(x, slopes, strict=True):
        half = 0.5 * slope
        shapes.append(
            Cuboid((place, 0.35, 0.5), (0.4, 0.2, 0.1), friction=friction,
                   orientation=(np.cos(half), 0.0, np.sin(half), 0.0))
        )  # fmt: skip
        up = np.array([np.sin(slope), 0, np.cos(slope)])
        depth = G * np.cos(slope) / RATE
        points.append(np.array([place, 0.35, 0.5]) + up * (0.1 + H / 4 - depth))
    config, model, state = alone(np.array(points), shapes)
    along = np.stack([np.cos(slopes), 0 * slopes, -np.sin(slopes)])
    # As strained as weight and friction hold each other, or at the limit.
    held = G / RATE * np.minimum(np.sin(slopes), friction * np.cos(slopes))
    slip = np.zeros((2, 3, 2))
    for i in (0, 1):
        slip[i, :, i] = held[i] * along[:, i]
    state = state._replace(slip=jnp.asarray(slip.reshape(6, 2)))
    dt = 0.1 / RATE**0.5
    steps = round(0.12 / dt)
    end = ends(config, model, state, steps, dt)
    moved = np.sum(along * (np.asarray(end.position) - np.array(points).T), axis=0)
    expected = 0.5 * G * (np.sin(slopes[1]) - friction * np.cos(slopes[1])) * (steps * dt) ** 2
    assert abs(moved[0]) < 0.1 * held[0]
    assert moved[1] == pytest.approx(expected, rel=0.03)


def test_what_sticks_to_a_turning_solid_turns_with_it():
    shape = Cylinder((0.6, 0.6, 0.6), 0.2, 0.2, surface="sticky", acts_on="particles",
                     motion=Steady((0.1, 0, 0), (0, 0, 2.0)))  # fmt: skip
    config, model, state = alone(
        [[0.6 + 0.2 + H / 4, 0.6, 0.6]], (shape,), gravity=(0, 0, 0), nodes=(13, 13, 13),
        velocity=(0.1, 2.0 * 0.225, 0),
    )  # fmt: skip
    dt = 0.2 / RATE**0.5
    steps = round(0.8 / dt)
    end = ends(config, model, state, steps, dt)
    angle = 2.0 * steps * dt
    expected = np.array([0.6 + 0.1 * steps * dt, 0.6, 0.6]) + 0.225 * np.array(
        [np.cos(angle), np.sin(angle), 0]
    )
    np.testing.assert_allclose(np.asarray(end.position)[:, 0], expected, atol=0.02 * H)


def test_a_body_follows_what_pushes_it():
    """Damped, it moves as the pusher does, and lies against it."""
    points = lattice(0, (0.15, 0.15, 0.15), H / 2) + np.array([0.5, 0.4, 0.4])
    half = 0.5 * np.pi / 4  # a cube on its edge would do; this one turned by a right angle and back
    turn = (np.cos(2 * half), 0.0, 0.0, np.sin(2 * half))
    pusher = Cuboid(
        (0.33, 0.475, 0.475),
        (0.2, 0.15, 0.2),
        orientation=turn,
        friction=0.0,
        motion=Keyframes((0.0, 0.4, 0.6), ((0, 0, 0), (0.3, 0, 0), (0.3, 0, 0))),
    )
    config, model, state = body(
        points, (H / 2) ** 3, (pusher, Damping(40.0)), gravity=(0, 0, 0), nodes=(16, 11, 11)
    )  # fmt: skip
    dt = 0.3 * H / (2e4 * P_WAVE / 1000) ** 0.5
    end = ends(config, model, state, round(0.6 / dt), dt)
    x = np.asarray(end.position)
    assert int(end.status.code) == 0
    assert x[0].min() == pytest.approx(0.33 + 0.15 + 0.3 + H / 4, abs=0.2 * H)
    assert np.abs(x[1:].mean(1) - 0.475).max() < 0.02 * H


def everything(chosen=range(5)):
    """Every shape in motion, or some, a particle on its way into each: what a gradient reaches."""
    x = 0.4 + 0.4 * np.arange(5)
    moving = Steady((0.2, 0.1, 0.1), (2.0, 1.0, 3.0))
    frames = Keyframes((0.0, 0.05), ((0.0, 0.0, 0.0), (0.01, 0.0, 0.005)),
                       ((1.0, 0.0, 0.0, 0.0), (0.99, 0.05, 0.1, 0.0)))  # fmt: skip
    common = {"orientation": (0.9, 0.2, 0.1, 0.3), "motion": moving, "friction": 0.4}
    shapes = (
        Ball((x[0], 0.35, 0.5), 0.1, **common),
        Cuboid((x[1], 0.35, 0.5), (0.1, 0.12, 0.1), rounding=0.03, **common),
        Cylinder((x[2], 0.35, 0.5), 0.1, 0.1, **common),
        Capsule((x[3], 0.35, 0.5), 0.08, 0.05, **common | {"motion": frames}),
        ball_mesh((x[4], 0.35, 0.5), 0.2, **common),
    )
    points = np.stack([x + 0.02, np.full(5, 0.36), np.full(5, 0.75)], 1)
    points, shapes = points[list(chosen)], tuple(shapes[i] for i in chosen)
    config, model, state = alone(points, shapes, velocity=(0.3, 0.2, -0.8))
    return config, model, lowered(model, state)


def lowered(model, state, depth=0.4 * H / 4):
    """The state with each particle let down until it is so deep in the spring of a boundary [m]."""

    @jax.jit
    def fallen(position):
        faces = [f for b in model.boundaries for f in b.faces(position, jnp.zeros(()))]
        return jnp.min(jnp.stack([f.distance for f in faces]), axis=0) - (H / 4 - depth)

    position = state.position
    for _ in range(60):
        position = position.at[2].add(-fallen(position))
    assert float(jnp.abs(fallen(position)).max()) < 1e-4
    return state._replace(position=position)


SIZES = ("radius", "half_size", "half_height", "half_height", "size")
MOTIONS = {"steady": ("velocity", "spin"), "keyframes": ("displacements", "orientations")}


def check_derivatives(end, boundaries, index, names):
    """Reverse mode against central differences by single numbers of boundary `index`."""
    leaves, structure = jax.tree.flatten(boundaries[index])
    paths = [path for path, _ in jax.tree_util.tree_flatten_with_path(boundaries[index])[0]]
    found = [jax.tree_util.keystr(path).split(".")[-1] for path in paths]
    gradient = jax.tree.leaves(end(boundaries)[1][index])
    for name in names:
        place = found.index(name)
        way = jnp.asarray(np.random.default_rng(place).normal(size=leaves[place].shape))

        def nudged(step, place=place, way=way):
            changed = [x + step * way if i == place else x for i, x in enumerate(leaves)]
            made = (*boundaries[:index], structure.unflatten(changed), *boundaries[index + 1 :])
            return float(end(made)[0])

        ours = float(jnp.sum(way * gradient[place]))
        central = (nudged(1e-6) - nudged(-1e-6)) / 2e-6
        assert ours == pytest.approx(central, rel=2e-5, abs=1e-9) and ours != 0, name


def wanted(boundary, index):
    turned = () if index == 0 else ("orientation",)  # a ball looks the same from everywhere
    return ("centre", *turned, "friction", *MOTIONS[boundary.motion.type], SIZES[index])


@pytest.mark.parametrize("index", range(5), ids=["ball", "cuboid", "cylinder", "capsule", "mesh"])
def test_derivatives_of_a_push_by_place_turn_speed_spin_friction_and_size(index):
    _, model, state = everything()
    x = state.position[:, index : index + 1]
    slip = jnp.full((3, 1), 1e-5)
    weights = jnp.array([[1.0], [2.0], [-0.7]])
    loads = {"particle_radius": jnp.array([H / 4]), "stiffness": jnp.array([100.0])}

    def end(boundaries):
        push, kept = boundaries[0].impulse(
            x, 0 * x, slip, loads, jnp.asarray(0.01), jnp.asarray(0.05), jnp.asarray(0.05)
        )
        return jnp.sum(weights * (push + 30 * kept))

    made = (model.boundaries[index].shared(),)
    check_derivatives(jax.jit(jax.value_and_grad(end)), made, 0, wanted(made[0], index))


def gradient_of_the_end(chosen, steps):
    """A mean of the end of a motion as a function of these of all boundaries, with its gradient."""
    config, model, state = everything(chosen)
    weights = jnp.asarray(np.random.default_rng(3).normal(size=(2, *state.position.shape)))
    config = dataclasses.replace(config, check_step=False)

    def end(boundaries):
        made = dataclasses.replace(model, boundaries=boundaries)
        after = rollout(config, made, state, dt=0.2 / RATE**0.5, steps=steps)
        return jnp.sum(weights[0] * after.position + 0.1 * weights[1] * after.velocity)

    return model.boundaries, jax.jit(jax.value_and_grad(end))


def test_derivatives_of_a_motion_by_a_turning_cuboid():
    boundaries, end = gradient_of_the_end((1,), 25)
    check_derivatives(end, boundaries, 0, wanted(boundaries[0], 1))


@pytest.mark.slow
def test_derivatives_of_a_motion_by_every_shape():
    boundaries, end = gradient_of_the_end(range(5), 25)
    for index in range(5):
        check_derivatives(end, boundaries, index, wanted(boundaries[index], index))


def test_the_steps_bound_knows_how_fast_a_surface_is():
    """What is elastic leaves it at up to twice its speed."""
    shapes = (
        Ball((0.5, 0.5, 0.3), 0.1, motion=Steady((0, 0, 30.0), (0, 200.0, 0))),
        Plane((0, 0, 0.2), velocity=(0, 0, 3.0)),
        Rotate((0.5, 0.5, 0.5), (0, 0, 1), 0.1, 0.2, angular_velocity=20.0, axial_velocity=3.0),
    )
    for boundaries, speed in ((shapes, 50.0), (shapes[1:], 5.0), (shapes[1:2], 3.0), ((), 0.0)):
        config, model, state = alone([[0.5, 0.5, 0.8]], boundaries, gravity=(0, 0, 0))
        state = state._replace(velocity=state.velocity + 1e-3)
        assert float(fastest(config, model, state)) == pytest.approx(max(2 * speed, 3e-6**0.5))


def test_other_numbers_reach_the_motion_and_bad_ones_are_refused():
    made = ready(Ball((0.5, 0.5, 0.5), 0.1, motion=Steady((0, 0, 1.0))))
    changed = made.changed(radius=0.2, motion={"velocity": (0.0, 2.0, 0.0)})
    pose = changed.pose(jnp.asarray(0.1))
    np.testing.assert_allclose(pose.centre, [0.5, 0.7, 0.5])
    assert float(changed.radius) == 0.2
    for values, message in (
        ({"motion": {"speed": 1.0}}, r"motion.speed: is no number of a steady"),
        ({"motion": 1.0}, r"motion: give its numbers by name"),
        ({"motion": {"spin": (1.0, 2.0)}}, r"motion.spin: expected 3 values"),
        ({"radius": -1.0}, r"radius: -1.0 must be above 0"),
    ):
        with pytest.raises(InputError, match=message):
            made.changed(**values)
    with pytest.raises(InputError, match="motion: was built as zero or none"):
        ready(Ball((0.5, 0.5, 0.5), 0.1)).changed(motion={"velocity": (0, 0, 1.0)})
    with pytest.raises(InputError, match="rounding: was built as zero"):
        ready(Cuboid((0.5, 0.5, 0.5), (0.1, 0.1, 0.1))).changed(rounding=0.01)
    for build, message in (
        (lambda: Keyframes((0.0,)), "times: .* at least two"),
        (lambda: Keyframes((0.0, 0.0)), "each later than the last"),
        (lambda: Keyframes((0.0, 1.0), ((0, 0, 0),)), "displacements: 1 for 2 times"),
        (lambda: Keyframes((0.0, 1.0), None, ((1.0, 0, 0, 0), (0.0, 0, 0, 0))), "one is zero"),
        (lambda: Ball((0, 0, 0), 1.0, orientation=(0.0, 0, 0, 0)), "orientation: is zero"),
        (lambda: Cuboid((0, 0, 0), (1.0, 1.0, 0.1), rounding=0.2), "rounding: 0.2 is more"),
        (lambda: ready(MeshObstacle((0, 0, 0), "a.obj", 1.0)), "source: is read when a scene"),
    ):
        with pytest.raises(InputError, match=message):
            build()
