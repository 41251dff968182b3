import jax
import jax.numpy as jnp
import numpy as np
import pytest

from jaxphys.core.errors import InputError
from jaxphys.mpm import boundaries, particle_boundaries
from jaxphys.mpm.boundaries import GridBoundary, box, cut, damping, half_space, walls
from jaxphys.mpm.particle_boundaries import (
    ParticleBoundary,
    impulse,
    release,
    rotation,
    translation,
)

SHAPE, SPACING = (12, 10, 11), 0.1
RANDOM = np.random.default_rng(6)
F64 = jnp.float64


def coordinates(dtype=F64):
    return tuple(
        (jnp.arange(n, dtype=dtype) * jnp.asarray(SPACING, dtype)).reshape(
            [-1 if a == axis else 1 for a in range(3)]
        )
        for axis, n in enumerate(SHAPE)
    )


def apply(boundary, velocity, time=0.0, dt=1e-3):
    return boundary.apply(velocity, coordinates(velocity.dtype), time, dt)


def random_velocity(dtype=F64):
    return jnp.asarray(RANDOM.normal(size=(3, *SHAPE)), dtype)


def uniform(vector):
    return jnp.broadcast_to(jnp.asarray(vector, F64).reshape(3, 1, 1, 1), (3, *SHAPE))


@pytest.mark.parametrize("dtype", [np.float32, np.float64])
def test_walls_take_outward_motion_only_and_only_in_three_cells(dtype):
    v = random_velocity(dtype)
    after = apply(walls(SHAPE, SPACING, dtype=dtype), v)
    assert after.dtype == dtype
    for axis, n in enumerate(SHAPE):
        index = np.arange(n).reshape([-1 if a == axis else 1 for a in range(3)])
        expected = jnp.where(index <= 3, jnp.maximum(v[axis], 0), v[axis])
        expected = jnp.where(index >= n - 4, jnp.minimum(expected, 0), expected)
        np.testing.assert_allclose(after[axis], expected, atol=1e-6)
    assert (after[:, 4:-4, 4:-4, 4:-4] == v[:, 4:-4, 4:-4, 4:-4]).all()


def test_walls_take_a_surface_each():
    v = random_velocity()
    six = ("sticky", "open", "open", "open", "slip", "open")
    after = apply(walls(SHAPE, SPACING, six, dtype=F64), v)
    assert (after[:, :4] == 0).all()
    assert (after[2, 4:, :, :4] == 0).all()
    assert (after[:2, 4:, :, :4] == v[:2, 4:, :, :4]).all()
    assert (after[:, 4:, :, 4:] == v[:, 4:, :, 4:]).all()
    with pytest.raises(InputError, match="six"):
        walls(SHAPE, SPACING, ("slip",) * 5)
    with pytest.raises(InputError, match="did you mean 'separate'"):
        walls(SHAPE, SPACING, "separat")


NORMAL = np.array([0.0, 0.6, 0.8])


def ground(surface, friction=0.0, **other):
    return half_space([0.5, 0.5, 0.5], 2 * NORMAL, surface, friction, dtype=F64, **other)


def below():
    x, y, z = coordinates()
    return np.asarray(0.6 * (y - 0.5) + 0.8 * (z - 0.5) + 0 * x < 0)


def test_half_space_surfaces():
    v = random_velocity()
    along = np.einsum("i,iabc->abc", NORMAL, v)
    inside = below()
    assert inside.any() and not inside.all()
    expected = {
        "sticky": np.zeros_like(v),
        "slip": v - along * NORMAL.reshape(3, 1, 1, 1),
        "separate": v - np.minimum(along, 0) * NORMAL.reshape(3, 1, 1, 1),
    }
    for surface, held in expected.items():
        after = apply(ground(surface), v)
        np.testing.assert_allclose(after, np.where(inside, held, v), atol=1e-15)


def test_every_surface_is_not_sticky():
    """In PhysGaussian a surface of any kind stops everything."""
    v = uniform([1.0, 0.0, 0.0])
    for surface in ("slip", "separate"):
        np.testing.assert_allclose(apply(ground(surface), v), v, atol=1e-15)
    assert not np.allclose(apply(ground("sticky"), v), v)


@pytest.mark.parametrize("friction", [0.0, 0.3, 2.0])
def test_friction_obeys_coulombs_cone(friction):
    v = random_velocity()
    after = apply(ground("separate", friction), v)
    n = NORMAL.reshape(3, 1, 1, 1)
    pressed = below() & (np.einsum("i,iabc->abc", NORMAL, v) < 0)
    taken = np.asarray(after - v)
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


def test_a_moving_wall_carries_what_sticks_to_it():
    wall = ground("sticky", velocity=[0.0, 0.0, 2.0], start=1.0, end=1.5)
    v = random_velocity()
    np.testing.assert_array_equal(apply(wall, v, time=0.9), v)
    np.testing.assert_array_equal(apply(wall, v, time=1.5), v)
    after = np.asarray(apply(wall, v, time=1.0))
    np.testing.assert_allclose(after[:, below()].T, np.tile([0, 0, 2.0], (below().sum(), 1)))
    later = np.asarray(apply(wall, v, time=1.2))
    assert (np.all(later == uniform([0, 0, 2.0]), 0)).sum() > below().sum()


def test_a_box_moves_stops_and_lets_go():
    b = box([0.3, 0.3, 0.3], [0.15] * 3, [1.0, 0, 0], 1.0, 1.4, rest_after=0.1, dtype=F64)
    v = random_velocity()

    def inside(centre):
        x, y, z = coordinates()
        return np.asarray((abs(x - centre) < 0.15) & (abs(y - 0.3) < 0.15) & (abs(z - 0.3) < 0.15))

    np.testing.assert_array_equal(apply(b, v, time=0.99), v)
    for time, centre, held in ((1.0, 0.3, 1.0), (1.2001, 0.5001, 1.0), (1.45, 0.7, 0.0)):
        after = np.asarray(apply(b, v, time=time))
        np.testing.assert_array_equal(
            after, np.where(inside(centre), uniform([held, 0, 0]), v), err_msg=str(time)
        )
    np.testing.assert_array_equal(apply(b, v, time=1.6), v)


def test_cut_lets_its_layer_slide_and_holds_the_rest():
    c = cut([0.5, 0.55, 0.5], [0, 1, 0], lower=0.35, upper=0.65, factor=0.3, dtype=F64)
    v = random_velocity()
    after = np.asarray(apply(c, v))
    np.testing.assert_array_equal(after[:, :, 6:], v[:, :, 6:])
    layer = after[:, :, :6, 4:7]
    np.testing.assert_allclose(layer[[0, 2]], 0.3 * v[:, :, :6, 4:7][jnp.array([0, 2])])
    np.testing.assert_allclose(layer[1], 0, atol=1e-15)
    assert (after[:, :, :6, :4] == 0).all() and (after[:, :, :6, 7:] == 0).all()


def test_damping_does_not_depend_on_the_length_of_steps():
    v = random_velocity()
    d = damping(3.0, 0.0, 1.0, dtype=F64)
    two = apply(d, apply(d, v, dt=0.05), dt=0.05)
    np.testing.assert_allclose(two, apply(d, v, dt=0.1), rtol=1e-14)
    np.testing.assert_allclose(two, v * np.exp(-0.3), rtol=1e-14)
    np.testing.assert_array_equal(apply(d, v, time=1.0), v)


def test_gradients_with_respect_to_friction_and_wall_velocity():
    v, weight = random_velocity(), RANDOM.normal(size=(3, *SHAPE))

    def loss(friction, speed, normal):
        wall = boundaries.HalfSpace(
            jnp.full(3, 0.47), normal, friction, speed, jnp.array(0.0), jnp.array(1.0), "separate"
        )
        return jnp.sum(weight * apply(wall, v))

    arguments = (jnp.array(0.3), jnp.array([0.1, 0.2, -0.3]), jnp.asarray(NORMAL))
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


@pytest.mark.parametrize("surface", boundaries.SURFACES)
def test_gradients_of_a_body_at_rest_are_finite(surface):
    def loss(v, friction):
        wall = boundaries.HalfSpace(
            jnp.full(3, 0.5), jnp.array([0, 0, 1.0]), friction, jnp.zeros(3), 0.0, 1.0, surface
        )
        return jnp.sum(apply(wall, v))

    gradient = jax.grad(loss, (0, 1))(jnp.zeros((3, *SHAPE)), jnp.array(0.4))
    assert all(np.isfinite(x).all() for x in gradient)


REST = jnp.asarray(RANDOM.random((3, 200)))
MASS = jnp.asarray(0.5 + RANDOM.random(200))
SPEED = jnp.asarray(RANDOM.normal(size=(3, 200)))


def act(boundary, time=0.0, dt=0.01, position=REST):
    return np.asarray(boundary.apply(position, SPEED, REST, MASS, time, dt))


def test_an_impulse_gives_its_region_force_times_time_as_one_body():
    b = impulse([1.0, 0, -2.0], [0.25] * 3, [0.25] * 3, end=0.05, dtype=F64)
    chosen = np.asarray((REST < 0.5).all(0))
    change = act(b) - SPEED
    np.testing.assert_allclose((MASS * change).sum(1), [0.01, 0, -0.02], atol=1e-15)
    assert np.ptp(change[:, chosen], axis=1).max() < 1e-15
    np.testing.assert_array_equal(change[:, ~chosen], 0)
    np.testing.assert_array_equal(act(b, time=0.05), SPEED)
    empty = impulse([1.0, 0, 0], [9.0] * 3, [0.1] * 3, dtype=F64)
    np.testing.assert_array_equal(act(empty), SPEED)


def test_translation_acts_by_rest_positions():
    b = translation([1.0, 2, 3], [0.25] * 3, [0.25] * 3, start=0.1, end=0.2, dtype=F64)
    chosen = np.asarray((REST < 0.5).all(0))
    after = act(b, 0.1, position=REST + 10)
    np.testing.assert_array_equal(after[:, chosen].T, np.tile([1.0, 2, 3], (chosen.sum(), 1)))
    np.testing.assert_array_equal(after[:, ~chosen], SPEED[:, ~chosen])
    for time in (0.05, 0.2):
        np.testing.assert_array_equal(act(b, time), SPEED)


def test_rotation_turns_a_cylinder():
    b = rotation([0.5] * 3, [0, 0, 3], 0.3, 0.4, angular_velocity=2.0, speed=0.7, dtype=F64)
    x, y, z = np.asarray(REST) - 0.5
    chosen = (abs(z) < 0.3) & (x**2 + y**2 < 0.16)
    expected = np.where(chosen, np.stack([-2 * y, 2 * x, 0 * x + 0.7]), SPEED)
    np.testing.assert_allclose(act(b), expected, atol=1e-14)
    with pytest.raises(InputError, match="zero"):
        rotation([0.5] * 3, [0, 0, 0], 0.3, 0.4, 1.0)


def test_release_lets_go_along_its_normal():
    b = release([0, 0, 2], 0.2, 0.8, start=1.0, end=2.0, dtype=F64)
    z = np.asarray(REST)[2]
    for time, plane in ((0.0, 0.2), (1.0, 0.2), (1.5, 0.5), (1.99, 0.794)):
        held = (z > plane) & (z <= 0.8)
        np.testing.assert_array_equal(act(b, time), np.where(held, 0, SPEED))
    np.testing.assert_array_equal(act(b, 2.0), SPEED)


def test_gradient_of_an_impulse_with_respect_to_its_force():
    def loss(force):
        b = particle_boundaries.Impulse(
            force, jnp.full(3, 0.25), jnp.full(3, 0.25), jnp.array(0.0), jnp.array(1.0)
        )
        return jnp.sum(MASS * b.apply(REST, SPEED, REST, MASS, 0.0, 0.01))

    np.testing.assert_allclose(jax.grad(loss)(jnp.zeros(3)), 0.01, rtol=1e-12)


ALL = [
    walls(SHAPE, SPACING),
    half_space([0.0] * 3, [0, 0, 1.0]),
    cut([0.0] * 3, [0, 0, 1.0]),
    box([0.0] * 3, [0.1] * 3),
    damping(1.0),
    impulse([1.0, 0, 0], [0.0] * 3, [1.0] * 3),
    translation([1.0, 0, 0], [0.0] * 3, [1.0] * 3),
    rotation([0.0] * 3, [0, 0, 1.0], 1.0, 1.0, 1.0),
    release([0, 0, 1.0], 0.0, 1.0, 0.0, 1.0),
]


@pytest.mark.parametrize("boundary", ALL, ids=lambda b: type(b).__name__)
def test_boundaries_are_pytrees_of_one_family_and_keep_the_dtype(boundary):
    assert isinstance(boundary, GridBoundary) != isinstance(boundary, ParticleBoundary)
    leaves, tree = jax.tree.flatten(boundary)
    assert leaves and all(leaf.dtype == jnp.float32 for leaf in leaves)
    rebuilt = jax.tree.unflatten(tree, leaves)
    if isinstance(boundary, GridBoundary):
        v = random_velocity(np.float32)
        run = jax.jit(lambda b, v: apply(b, v, jnp.float32(0), jnp.float32(1e-3)))
    else:
        v = SPEED.astype(np.float32)
        r, m = REST.astype(np.float32), MASS.astype(np.float32)
        run = jax.jit(lambda b, v: b.apply(r, v, r, m, jnp.float32(0), jnp.float32(1e-3)))
    assert run(rebuilt, v).dtype == jnp.float32


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: half_space([0] * 3, [0, 0, 0]), "normal is zero"),
        (lambda: half_space([0] * 3, [0, 0, 1], friction=-0.1), "friction"),
        (lambda: half_space([0] * 3, [0, 0, 1], "stick"), "did you mean 'sticky'"),
        (lambda: half_space([0] * 2, [0, 0, 1]), "three numbers"),
        (lambda: damping(-1.0), "rate"),
        (lambda: walls(SHAPE, SPACING, friction=float("nan")), "friction"),
    ],
)
def test_what_makes_no_sense_is_refused(make, message):
    with pytest.raises(InputError, match=message):
        make()
