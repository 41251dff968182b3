"""What each boundary does to nodes and particles, and what it refuses."""

import dataclasses

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from jaxphys.core.errors import InputError
from jaxphys.mpm.boundaries import (
    Box,
    Cut,
    Damping,
    Impulse,
    Plane,
    Release,
    Rotate,
    Setting,
    Translate,
    Walls,
    prepare,
)
from jaxphys.mpm.boundaries.box import box_distance
from jaxphys.mpm.grid import Grid, node_coordinates
from jaxphys.mpm.state import Model

SHAPE, SPACING = (12, 10, 11), 0.1
GRID = Grid(SHAPE, SPACING)
F64 = jnp.float64
NORMAL = (0.0, 0.6, 0.8)
SURFACES = ("sticky", "slip", "separate")


@pytest.fixture(scope="module")
def rest():
    return np.random.default_rng(6).random((200, 3))


@pytest.fixture(scope="module")
def mass():
    return jnp.asarray(0.5 + np.random.default_rng(7).random(200))


@pytest.fixture(scope="module")
def speed():
    return jnp.asarray(np.random.default_rng(8).normal(size=(3, 200)))


@pytest.fixture(scope="module")
def moving():
    """Velocities of all nodes."""
    return jnp.asarray(np.random.default_rng(9).normal(size=(3, *SHAPE)))


def ready(boundary, rest=((0.6, 0.6, 0.6),), dtype=F64):
    return boundary.prepared(Setting(GRID, np.asarray(rest), np.full(len(rest), 1e-4), dtype))


def coordinates(dtype=F64):
    return node_coordinates(SHAPE, SPACING, np.zeros(3, int), dtype)


def on_nodes(boundary, velocity, time=0.0, dt=1e-3):
    return np.asarray(
        ready(boundary, dtype=velocity.dtype).on_grid(
            velocity, coordinates(velocity.dtype), GRID, time, dt
        )
    )


def wall(surface, friction=0.0, **other):
    normal = tuple(2 * n for n in NORMAL)
    return Plane((0.5, 0.5, 0.5), normal, surface, friction, acts_on="nodes", **other)


def below():
    x, y, z = coordinates()
    return np.asarray(0.6 * (y - 0.5) + 0.8 * (z - 0.5) + 0 * x < -1e-9)


def uniform(vector):
    return jnp.broadcast_to(jnp.asarray(vector, F64).reshape(3, 1, 1, 1), (3, *SHAPE))


@pytest.mark.parametrize("dtype", [np.float32, np.float64])
def test_walls_on_nodes_take_outward_motion_strictly_outside_of_three_cells(moving, dtype):
    """PhysGaussian's bounding box holds nodes 0 to 2: the fourth lies on the wall and is free."""
    v = moving.astype(dtype)
    after = on_nodes(Walls(acts_on="nodes"), v)
    assert after.dtype == dtype
    for axis, n in enumerate(SHAPE):
        index = np.arange(n).reshape([-1 if a == axis else 1 for a in range(3)])
        expected = jnp.where(index < 3, jnp.maximum(v[axis], 0), v[axis])
        expected = jnp.where(index > n - 4, jnp.minimum(expected, 0), expected)
        np.testing.assert_allclose(after[axis], expected, atol=1e-6)
    inner = (slice(None), *(slice(3, -3),) * 3)
    assert (after[inner] == v[inner]).all()


def test_walls_take_a_surface_and_a_friction_each(moving):
    six = ("sticky", "open", "open", "open", "slip", "open")
    after = on_nodes(Walls(surfaces=six, acts_on="nodes"), moving)
    assert (after[:, :3] == 0).all()
    assert (after[2, 3:, :, :3] == 0).all()
    assert (after[:2, 3:, :, :3] == moving[:2, 3:, :, :3]).all()
    assert (after[:, 3:, :, 3:] == moving[:, 3:, :, 3:]).all()
    rough = Walls(frictions=(0.0, 0.0, 0.0, 0.0, 0.5, 0.0), acts_on="nodes")
    inner = (slice(4, 8), slice(4, 6))
    down = uniform([1.0, 0.0, -1.0])
    np.testing.assert_allclose(on_nodes(rough, down)[0][inner][..., :3], 0.5)
    np.testing.assert_allclose(on_nodes(rough, -down)[0][inner][..., -3:], -1.0)


def test_walls_stand_where_they_are_told_at_any_spacing():
    x = jnp.array([[0.5], [0.5], [0.13]])
    (near,) = {round(float(min(f.distance[0] for f in ready(Walls(inset=0.12)).faces(x, 0.0))), 12)}
    assert near == pytest.approx(0.01)
    by_cells = min(float(f.distance[0]) for f in ready(Walls()).faces(x, 0.0))
    assert by_cells == pytest.approx(0.13 - 3 * SPACING)


def test_plane_on_nodes_obeys_its_surface(moving):
    v = np.asarray(moving)
    along = np.einsum("i,iabc->abc", NORMAL, v)
    inside = below()
    assert inside.any() and not inside.all()
    n = np.reshape(NORMAL, (3, 1, 1, 1))
    expected = {
        "sticky": np.zeros_like(v),
        "slip": v - along * n,
        "separate": v - np.minimum(along, 0) * n,
    }
    for surface, held in expected.items():
        np.testing.assert_allclose(
            on_nodes(wall(surface), moving), np.where(inside, held, v), atol=1e-15
        )


@pytest.mark.parametrize("dtype", [np.float32, np.float64])
def test_nodes_on_a_plane_or_on_the_faces_of_a_box_are_free(dtype):
    v = jnp.ones((3, *SHAPE), dtype)
    for k in range(1, SHAPE[2] - 1):
        plane = Plane((0.0, 0.0, k * SPACING), surface="sticky")
        held = np.all(on_nodes(plane, v) == 0, axis=(0, 1, 2))
        assert np.flatnonzero(held).tolist() == list(range(k))
    # 0.3 and 0.7 are node planes, and half of their difference is none of float32's numbers.
    held = np.all(on_nodes(Box((0.5, 0.5, 0.5), (0.2, 0.2, 0.2)), v) == 0, axis=0)
    inside = np.zeros(SHAPE, bool)
    inside[4:7, 4:7, 4:7] = True
    np.testing.assert_array_equal(held, inside)


@pytest.mark.parametrize("friction", [0.0, 0.3, 2.0])
def test_friction_on_nodes_obeys_coulombs_cone(moving, friction):
    v = np.asarray(moving)
    after = on_nodes(wall("separate", friction), moving)
    n = np.reshape(NORMAL, (3, 1, 1, 1))
    pressed = below() & (np.einsum("i,iabc->abc", NORMAL, v) < 0)
    taken = after - v
    normal = np.einsum("i,iabc->abc", NORMAL, taken)
    drag = np.linalg.norm(taken - normal * n, axis=0)
    assert (drag[pressed] <= friction * normal[pressed] + 1e-12).all()
    sliding = np.linalg.norm(after, axis=0)[pressed] > 1e-12
    # What still slides feels all of the friction; what stops felt no more than it takes.
    np.testing.assert_allclose(
        drag[pressed][sliding], friction * normal[pressed][sliding], atol=1e-12
    )
    np.testing.assert_allclose(taken[:, ~pressed], 0, atol=1e-12)
    if friction == 2.0:
        assert not sliding.all()
    turned = np.einsum("iabc,iabc->abc", after - normal * n - v, v)
    assert (turned <= 1e-12).all()  # friction never speeds up


def test_a_moving_plane_carries_what_sticks_to_it(moving):
    plane = wall("sticky", velocity=(0.0, 0.0, 2.0), start=1.0, end=1.5)
    np.testing.assert_array_equal(on_nodes(plane, moving, time=0.9), moving)
    np.testing.assert_array_equal(on_nodes(plane, moving, time=1.5), moving)
    after = on_nodes(plane, moving, time=1.0)
    np.testing.assert_allclose(after[:, below()].T, np.tile([0, 0, 2.0], (below().sum(), 1)))
    later = on_nodes(plane, moving, time=1.2)
    assert (np.all(later == uniform([0, 0, 2.0]), 0)).sum() > below().sum()


def test_a_box_carries_stops_and_lets_go(moving):
    b = Box((0.3, 0.3, 0.3), (0.15,) * 3, (1.0, 0.0, 0.0), 1.0, 1.4, rest_after=0.1)

    def inside(centre):
        x, y, z = coordinates()
        return np.asarray((abs(x - centre) < 0.15) & (abs(y - 0.3) < 0.15) & (abs(z - 0.3) < 0.15))

    np.testing.assert_array_equal(on_nodes(b, moving, time=0.99), moving)
    for time, centre, held in ((1.0, 0.3, 1.0), (1.2001, 0.5001, 1.0), (1.45, 0.7, 0.0)):
        expected = np.where(inside(centre), uniform([held, 0, 0]), moving)
        np.testing.assert_array_equal(on_nodes(b, moving, time=time), expected, err_msg=str(time))
    np.testing.assert_array_equal(on_nodes(b, moving, time=1.6), moving)


def test_distance_to_a_box_is_that_of_the_nearest_point():
    half = jnp.array([0.3, 0.2, 0.1])
    x = jnp.asarray(np.random.default_rng(3).uniform(-0.6, 0.6, (3, 300)))
    distance, normal = box_distance(x, half)
    nearest = jnp.clip(x, -half[:, None], half[:, None])
    outside = np.any(np.abs(x) > half[:, None], axis=0)
    assert outside.any() and not outside.all()
    np.testing.assert_allclose(
        distance[outside], jnp.linalg.norm(x - nearest, axis=0)[outside], rtol=1e-12
    )
    np.testing.assert_allclose(
        distance[~outside], -(half[:, None] - jnp.abs(x)).min(0)[~outside], rtol=1e-12
    )
    gradient = jax.vmap(jax.grad(lambda p: box_distance(p, half)[0]), 1, 1)(x)
    np.testing.assert_allclose(normal, gradient, atol=1e-12)


def test_cut_lets_its_layer_slide_and_holds_the_rest(moving):
    after = on_nodes(Cut((0.5, 0.55, 0.5), (0.0, 1.0, 0.0), 0.35, 0.65, 0.3), moving)
    np.testing.assert_array_equal(after[:, :, 6:], moving[:, :, 6:])
    layer = after[:, :, :6, 4:7]
    np.testing.assert_allclose(layer[[0, 2]], 0.3 * moving[:, :, :6, 4:7][jnp.array([0, 2])])
    np.testing.assert_allclose(layer[1], 0, atol=1e-15)
    assert (after[:, :, :6, :4] == 0).all() and (after[:, :, :6, 7:] == 0).all()


def test_damping_does_not_depend_on_the_length_of_steps(moving):
    d = Damping(3.0, 0.0, 1.0)
    two = on_nodes(d, jnp.asarray(on_nodes(d, moving, dt=0.05)), dt=0.05)
    np.testing.assert_allclose(two, on_nodes(d, moving, dt=0.1), rtol=1e-14)
    np.testing.assert_allclose(two, moving * np.exp(-0.3), rtol=1e-14)
    np.testing.assert_array_equal(on_nodes(d, moving, time=1.0), moving)


def test_gradients_on_nodes_with_respect_to_friction_velocity_and_normal(moving):
    weight = np.random.default_rng(1).normal(size=(3, *SHAPE))
    plane = ready(wall("separate", 0.3, velocity=(0.1, 0.2, -0.3)))
    plane = dataclasses.replace(plane, point=jnp.full(3, 0.47))

    def loss(friction, velocity, normal):
        changed = dataclasses.replace(plane, friction=friction, velocity=velocity, normal=normal)
        return jnp.sum(weight * changed.on_grid(moving, coordinates(), GRID, 0.0, 1e-3))

    arguments = (plane.friction, plane.velocity, plane.normal)
    gradients = jax.grad(loss, (0, 1, 2))(*arguments)
    h = 1e-6
    for index, gradient in enumerate(gradients):
        assert np.abs(gradient).max() > 0
        for entry in np.ndindex(gradient.shape):
            shift = jnp.zeros_like(gradient).at[entry].set(h)
            up, down = (
                loss(*(a + sign * shift if i == index else a for i, a in enumerate(arguments)))
                for sign in (1, -1)
            )
            assert float(gradient[entry]) == pytest.approx(float(up - down) / (2 * h), rel=1e-5)


@pytest.mark.parametrize("surface", SURFACES)
def test_gradients_of_a_body_at_rest_are_finite(surface):
    def loss(v, friction):
        plane = dataclasses.replace(ready(wall(surface, 0.4)), friction=friction)
        return jnp.sum(plane.on_grid(v, coordinates(), GRID, 0.0, 1e-3))

    gradient = jax.grad(loss, (0, 1))(jnp.zeros((3, *SHAPE)), jnp.array(0.4))
    assert all(np.isfinite(x).all() for x in gradient)


def test_an_impulse_gives_its_region_force_times_time_as_one_body(rest, mass, speed):
    push = Impulse((0.25,) * 3, (0.25,) * 3, (1.0, 0.0, -2.0), duration=0.05)
    model = Model(mass, mass, {}, jnp.zeros(3))

    def given(boundary, time=0.0):
        made = ready(boundary, rest)
        return np.asarray(
            made.impulse(rest.T, speed, None, made.loads(model, GRID), time, 0.01, 0.01)[0]
        )

    chosen = (rest < 0.5).all(1)
    momentum = given(push)
    np.testing.assert_allclose(momentum.sum(1), [0.01, 0, -0.02], atol=1e-15)
    assert np.ptp((momentum / mass)[:, chosen], axis=1).max() < 1e-15
    assert not momentum[:, ~chosen].any() and not given(push, time=0.05).any()
    assert not given(Impulse((9.0,) * 3, (0.1,) * 3, (1.0, 0.0, 0.0))).any()
    each = dataclasses.replace(push, per_particle=True)
    np.testing.assert_allclose(given(each).sum(1), momentum.sum(1) * chosen.sum())
    # Whatever the steps: in all force times duration, also of a push shorter than a step.
    for start, duration in ((0.0, 0.003), (0.004, 0.003), (0.007, 0.02)):
        short = dataclasses.replace(push, start=start, duration=duration)
        total = sum(given(short, time=0.01 * step) for step in range(4))
        np.testing.assert_allclose(total.sum(1), duration * np.array([1.0, 0, -2.0]), atol=1e-15)


def on_particles(boundary, rest, speed, time=0.0, position=None):
    position = jnp.asarray(rest.T if position is None else position)
    made = ready(boundary, rest)
    loads = made.loads(Model(None, None, {}, None), GRID)
    return np.asarray(made.shared().on_particles(position, speed, loads, time, 0.01))


def test_translation_acts_by_rest_positions(rest, speed):
    b = Translate((0.25,) * 3, (0.25,) * 3, (1.0, 2.0, 3.0), start=0.1, end=0.2)
    chosen = (rest < 0.5).all(1)
    after = on_particles(b, rest, speed, 0.1, position=rest.T + 10)
    np.testing.assert_array_equal(after[:, chosen].T, np.tile([1.0, 2, 3], (chosen.sum(), 1)))
    np.testing.assert_array_equal(after[:, ~chosen], speed[:, ~chosen])
    for time in (0.05, 0.2):
        np.testing.assert_array_equal(on_particles(b, rest, speed, time), speed)


@pytest.mark.parametrize("dtype", [np.float32, np.float64])
def test_particles_on_the_faces_of_a_region_are_not_of_it(dtype):
    line = np.stack([np.arange(12) * SPACING, np.full(12, 0.5), np.full(12, 0.5)], 1).astype(dtype)
    made = ready(Translate((0.5, 0.5, 0.5), (0.2, 0.2, 0.2)), line, dtype)
    assert np.flatnonzero(made.chosen).tolist() == [4, 5, 6]


def test_rotation_turns_a_cylinder(rest, speed):
    b = Rotate((0.5,) * 3, (0.0, 0.0, 3.0), 0.3, 0.4, angular_velocity=2.0, axial_velocity=0.7)
    x, y, z = rest.T - 0.5
    chosen = (abs(z) < 0.3) & (x**2 + y**2 < 0.16)
    expected = np.where(chosen, np.stack([-2 * y, 2 * x, 0 * x + 0.7]), speed)
    np.testing.assert_allclose(on_particles(b, rest, speed), expected, atol=1e-14)


@pytest.mark.parametrize("down", [False, True])
def test_release_lets_go_along_its_normal(rest, speed, down):
    begin, finish = (0.8, 0.2) if down else (0.2, 0.8)
    b = Release((0.0, 0.0, 2.0), begin, finish, start=1.0, end=2.0)
    z = rest[:, 2]
    for time, share in ((0.0, 0.0), (1.0, 0.0), (1.5, 0.5), (1.99, 0.99)):
        plane = begin + share * (finish - begin)
        held = (z > plane) & (z <= 0.8) if not down else (z < plane) & (z >= 0.2)
        np.testing.assert_array_equal(on_particles(b, rest, speed, time), np.where(held, 0, speed))
    np.testing.assert_array_equal(on_particles(b, rest, speed, 2.0), speed)


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: Plane(normal=(0.0, 0.0, 0.0)), "normal: is zero"),
        (lambda: Plane(friction=-0.1), "friction"),
        (lambda: Plane(surface="stick"), "did you mean 'sticky'"),
        (lambda: Plane(point=(0.0, 0.0)), "point: expected 3 values"),
        (lambda: Plane(acts_on="node"), "did you mean 'nodes'"),
        (lambda: Damping(-1.0), "rate"),
        (lambda: Walls(friction=float("nan")), "friction"),
        (lambda: Walls(surfaces=("slip",) * 5), "expected 6"),
        (lambda: Walls(surfaces=("slip",) * 5 + ("opn",)), "did you mean 'open'"),
        (lambda: Rotate((0.5,) * 3, (0.0, 0.0, 0.0), 0.3, 0.4), "axis: is zero"),
        (lambda: ready(Plane(point=np.zeros(2))), "point: expected 3 numbers"),
    ],
)
def test_what_makes_no_sense_is_refused(make, message):
    with pytest.raises(InputError, match=message):
        make()


def test_particles_that_start_deep_inside_are_told_of():
    inside = np.array([[0.5, 0.5, 0.42], [0.5, 0.5, 0.9]])
    setting = Setting(GRID, inside, np.full(2, 1e-4), F64)
    with pytest.raises(InputError, match=r"boundaries\[1\].point: 1 particles start inside of it"):
        prepare((Damping(1.0), Plane((0.0, 0.0, 0.5))), setting)
    # Touching is no fault, nor is a plane that appears later or that holds nodes.
    prepare(
        (
            Plane((0.0, 0.0, 0.45)),
            Plane((0.0, 0.0, 0.5), start=0.1),
            Plane((0.0, 0.0, 0.5), acts_on="nodes"),
        ),
        setting,
    )
