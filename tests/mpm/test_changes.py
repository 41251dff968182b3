"""`Simulation.with_`: every number by name, in the object's order, known or traced."""

from dataclasses import replace

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from jaxphys.core.errors import InputError
from jaxphys.mpm.boundaries import (
    Cuboid,
    Impulse,
    Keyframes,
    Plane,
    Release,
    Rotate,
    Setting,
    Translate,
    Walls,
    prepare,
)
from jaxphys.mpm.loop.frames import rollout_frames
from jaxphys.mpm.state import OK, UNSTABLE_STEP, initial_state
from jaxphys.mpm.stepping import Adaptive
from tests.mpm.cases import block, simulation_of

COUNT = 20
ORDER = np.random.default_rng(5).permutation(COUNT)
BOX = {"centre": (0.4, 0.4, 0.4), "half_size": (0.08, 0.2, 0.2)}
BOUNDARIES = (
    Translate(**BOX, velocity=(0.0, 0.0, 0.1)),
    Impulse(**BOX, force=(1.0, 0.0, 0.0), per_particle=True),
    Rotate((0.4, 0.4, 0.4), (0.0, 0.0, 1.0), 0.1, 0.1, 2.0),
    Release((0.0, 0.0, 1.0), 0.2, 0.7),
    Walls(inset=0.1, frictions=(0.1, 0.2, 0.0, 0.3, 0.4, 0.5)),
    Plane((0.0, 0.0, 0.1), friction=0.2),
    Plane((0.0, 0.0, 0.1), friction=0.0),
)


def simulation(boundaries=BOUNDARIES, dtype=jnp.float64):
    """Two objects of 12 and 8 particles, which the solver keeps in another order."""
    config, model, state = block(count=COUNT, dtype=dtype)
    setting = Setting(config.grid, np.asarray(state.position.T), np.asarray(model.volume), dtype)
    made = prepare(boundaries, setting)
    rows = sum(boundary.rows for boundary in made)
    slip = jnp.zeros((rows, COUNT), dtype) if rows else None
    model = replace(model, boundaries=made)
    state = state._replace(slip=slip)
    return replace(
        simulation_of(config, model, state, dt=1e-3, steps=20, order=ORDER), counts=(12, 8)
    )


@pytest.fixture(scope="module")
def built():
    return simulation()


def given(array):
    """(..., N) of the solver in the order of the objects, particles first."""
    return np.moveaxis(np.asarray(array)[..., ORDER], -1, 0)


def test_the_start_is_given_in_the_order_of_the_objects(built):
    random = np.random.default_rng(0)
    numbers = {
        "position": given(built.state.position) + 0.01 * random.random((COUNT, 3)),
        "velocity": random.normal(size=(COUNT, 3)),
        "affine": random.normal(size=(COUNT, 3, 3)),
        "deformation": np.eye(3) + 0.05 * random.normal(size=(COUNT, 3, 3)),
    }
    state = built.with_(**numbers).state
    for name, value in numbers.items():
        np.testing.assert_array_equal(given(getattr(state, name)), value)
    same = built.with_(affine=np.diag([1.0, 2.0, 3.0]), deformation=1.1 * np.eye(3)).state
    np.testing.assert_array_equal(given(same.affine), [np.diag([1.0, 2.0, 3.0])] * COUNT)
    np.testing.assert_array_equal(given(same.deformation), [1.1 * np.eye(3)] * COUNT)
    np.testing.assert_array_equal(same.velocity, built.state.velocity)
    # A velocity alone leaves no motion about the particles' own middles.
    assert not np.any(built.with_(velocity=(1.0, 0.0, 0.0)).state.affine)


def test_sums_begin_anew_with_another_start():
    small = simulation((), jnp.float32)
    stale = jax.tree.map(jnp.ones_like, small.state.residual)
    small = replace(small, state=small.state._replace(residual=stale))
    moved = small.with_(position=given(small.state.position)).state.residual
    assert not np.any(moved.position) and np.all(moved.deformation)
    assert not np.any(small.with_(deformation=np.eye(3)).state.residual.deformation)


def test_objects_spin_about_their_own_centres_of_mass(built):
    rates = np.array([[0.0, 0.0, 3.0], [1.0, -2.0, 0.5]])
    for velocity in (None, (0.5, 0.0, -1.0)):
        changed = built.with_(spin=rates, velocity=velocity)
        mass, place, speed = (
            given(x) for x in (built.model.mass, built.state.position, changed.state.velocity)
        )
        before = given(built.state.velocity)
        for rate, own in zip(rates, (slice(0, 12), slice(12, 20)), strict=True):
            m = mass[own, None]
            centre = (m * place[own]).sum(0) / m.sum()
            drift = velocity
            if velocity is None:
                drift = (m * before[own]).sum(0) / m.sum()
            np.testing.assert_allclose(
                speed[own], drift + np.cross(rate, place[own] - centre), atol=1e-12
            )
            gradient = given(changed.state.affine)[own]
            arm = np.array([0.3, -0.2, 0.7])
            np.testing.assert_allclose(gradient @ arm, [np.cross(rate, arm)] * len(m), atol=1e-12)
    one = built.with_(spin=(0.0, 0.0, 1.0)).state
    np.testing.assert_allclose(
        one.velocity, built.with_(spin=[(0.0, 0.0, 1.0)] * 2).state.velocity, atol=1e-15
    )


def inside(place, centre, half_size):
    return np.all(np.abs(place - np.array(centre)) < np.array(half_size), axis=1)


def test_regions_choose_anew(built):
    place = np.asarray(built.state.position).T
    larger = {"half_size": (0.3, 0.06, 0.3)}
    for index in (0, 1):
        changed = built.with_(boundaries={index: larger}).model.boundaries[index]
        expected = inside(place, BOX["centre"], larger["half_size"])
        np.testing.assert_array_equal(changed.chosen, expected)
        assert np.any(expected != inside(place, BOX["centre"], BOX["half_size"]))
        traced = jax.jit(
            lambda x, i=index: built.with_(boundaries={i: {"half_size": x}}).model.boundaries[i]
        )(jnp.array(larger["half_size"]))
        np.testing.assert_array_equal(traced.chosen, expected)
    changed = built.with_(boundaries={2: {"radius": 0.15, "axis": (0.0, 3.0, 0.0)}})
    arm = place - 0.4
    expected = (np.abs(arm[:, 1]) < 0.1) & (np.hypot(arm[:, 0], arm[:, 2]) < 0.15)
    np.testing.assert_array_equal(changed.model.boundaries[2].chosen, expected)
    changed = built.with_(boundaries={3: {"normal": (0.0, 2.0, 0.0)}}).model.boundaries[3]
    np.testing.assert_allclose(changed.places, place[:, 1])
    # A number that says nothing of the region chooses nothing anew, whatever the particles do.
    away = replace(built, state=built.state._replace(position=built.state.position + 0.2))
    same = away.with_(boundaries={0: {"velocity": (1.0, 0.0, 0.0)}}).model.boundaries[0]
    np.testing.assert_array_equal(same.chosen, built.model.boundaries[0].chosen)
    moved = built.with_(position=given(built.state.position) + np.array([0.06, 0, 0]))
    np.testing.assert_array_equal(
        moved.model.boundaries[0].chosen, inside(place + np.array([0.06, 0, 0]), **BOX)
    )


def test_a_place_of_which_one_number_is_traced(built):
    """As a user writes it: a tuple with an unknown height in it."""

    def normal(height):
        changed = built.with_(boundaries={3: {"normal": (0.0, 2.0, height)}})
        return changed.model.boundaries[3].normal

    slope = jax.jacfwd(normal)(0.0)
    np.testing.assert_allclose(slope, [0.0, 0.0, 1.0], atol=1e-12)
    with pytest.raises(InputError, match="shape"):
        jax.eval_shape(lambda h: built.with_(boundaries={3: {"normal": (0.0, h)}}), 0.0)


def test_a_force_on_each_particle_follows_the_choice(built):
    """Of 1 N each, shared by mass among those that are in the box."""
    for size in ((0.08, 0.2, 0.2), (0.3, 0.06, 0.3)):
        changed = built.with_(boundaries={1: {"half_size": size, "force": (2.0, 0.0, 0.0)}})
        push = changed.model.boundaries[1]
        share = push.loads(changed.model, changed.config.grid)["share"]
        chosen = inside(np.asarray(built.state.position).T, BOX["centre"], size)
        assert float(share.sum()) == pytest.approx(chosen.sum())
        np.testing.assert_array_equal(push.force, [2.0, 0.0, 0.0])


def test_friction_reaches_every_side_that_has_some(built):
    changed = built.with_(friction=0.7).model.boundaries
    sides = changed[4].frictions
    assert [None if f is None else float(f) for f in sides] == [0.7, 0.7, None, 0.7, 0.7, 0.7]
    assert float(changed[5].friction) == 0.7 and changed[6].friction is None
    each = built.with_(boundaries={4: {"frictions": (0.9, 0.8, 0.0, 0.7, 0.6, 0.5)}})
    sides = each.model.boundaries[4].frictions
    np.testing.assert_allclose(
        [float(f) for f in sides if f is not None], [0.9, 0.8, 0.7, 0.6, 0.5]
    )
    only = simulation((BOUNDARIES[4],))
    slope = jax.jit(
        jax.grad(lambda mu: only.with_(friction=mu).model.boundaries[0].frictions[5] ** 2)
    )
    assert float(slope(0.3)) == pytest.approx(0.6)


REFUSED = {
    "position outside": ({"position": np.full((COUNT, 3), 5.0)}, r"position\[0\].*outside"),
    "position shape": ({"position": np.ones(3)}, r"position has shape \(3,\)"),
    "position nan": ({"position": np.full((COUNT, 3), np.nan)}, "position: nan"),
    "spin": ({"spin": np.ones((3, 3))}, r"spin has shape \(3, 3\); give \(3,\) or \(2, 3\)"),
    "spin fast": ({"spin": (0.0, 0.0, 1e9)}, "spin: .*at most"),
    "affine": ({"affine": np.ones(3)}, "affine has shape"),
    "inverted": ({"deformation": np.diag([1.0, 1.0, -1.0])}, r"deformation\[0\] has determinant"),
    "velocity": ({"velocity": (1e9, 0.0, 0.0)}, "velocity: .*at most"),
    "gravity": ({"gravity": (np.inf, 0.0, 0.0)}, "gravity: inf is not a finite number"),
    "name": ({"spinn": (0.0, 0.0, 1.0)}, "'spin'"),
    "frictions": ({"boundaries": {4: {"frictions": (0.1,) * 6}}}, "built as zero"),
    "frictions few": ({"boundaries": {4: {"frictions": (0.1,) * 5}}}, r"has shape \(5,\)"),
    "frictions bad": ({"boundaries": {4: {"frictions": (-1.0, 0, 0, 0, 0, 0)}}}, "at least 0"),
    "deep": ({"boundaries": {5: {"point": (0.0, 0.0, 0.5)}}}, r"boundaries\[5\]\.point: \d+ part"),
    "text": ({"velocity": "fast"}, "velocity: expected numbers, found 'fast'"),
    "text of many": ({"youngs_modulus": ["soft"]}, "youngs_modulus: expected numbers"),
    "no places": ({"boundaries": [{"point": (0.0, 0.0, 0.1)}]}, "boundaries: give numbers by pl"),
    "no names": ({"boundaries": {5: 0.2}}, "boundaries: give numbers by place and name"),
}


@pytest.mark.parametrize("which", REFUSED)
def test_what_cannot_be_is_refused(built, which):
    changes, message = REFUSED[which]
    with pytest.raises(InputError, match=message):
        built.with_(**changes)


def test_known_numbers_of_a_boundary_go_together_as_in_a_file():
    frames = Keyframes((0.0, 1.0, 2.0), displacements=((0.0, 0.0, 0.0),) * 3)
    size = {"half_size": (0.1, 0.1, 0.05), "rounding": 0.02}
    made = simulation((Cuboid((0.4, 0.4, 0.05), **size, friction=0.0, motion=frames),))
    with pytest.raises(InputError, match=r"boundaries\[0\]\.rounding: .* more than the least"):
        made.with_(boundaries={0: {"rounding": 0.06}})
    with pytest.raises(InputError, match=r"boundaries\[0\]\.motion\.times: .*later than the last"):
        made.with_(boundaries={0: {"motion": {"times": (0.0, 2.0, 1.0)}}})
    both = made.with_(boundaries={0: {"half_size": (0.1, 0.1, 0.08), "rounding": 0.06}})
    assert float(both.model.boundaries[0].rounding) == 0.06


def test_another_name_of_a_parameter_is_converted():
    from jaxphys.mpm.materials.catalogue import MATERIALS
    from jaxphys.mpm.state import Config

    config, model, state = block(count=COUNT)
    sand = MATERIALS["sand"].law
    config = Config(config.grid, ((sand, 0, COUNT),))
    parameters = model.parameters | {"friction_angle": jnp.full(COUNT, 30.0)}
    state = initial_state(config, state.position.T)
    made = simulation_of(config, replace(model, parameters=parameters), state, dt=1e-3, steps=2)
    angle = made.with_(plane_strain_friction_angle=40.0).model.parameters["friction_angle"]
    sine = np.sin(np.radians(40.0))
    # alpha of plane strain, sqrt(2) / 3 sin, is sqrt(2 / 3) 2 s / (3 - s) of the triaxial angle.
    ratio = sine / np.sqrt(3)
    expected = np.degrees(np.arcsin(3 * ratio / (2 + ratio)))
    np.testing.assert_allclose(angle, expected, rtol=1e-12)
    other = MATERIALS["sand"].alternatives["plane_strain_friction_angle"]
    assert other.instead_of == "friction_angle"
    with pytest.raises(InputError, match="given twice"):
        made.with_(plane_strain_friction_angle=40.0, friction_angle=30.0)


def test_a_gradient_reaches_every_number_of_the_start():
    """Against differences, by a direction in all of them at once."""
    start = simulation(())
    random = np.random.default_rng(2)
    numbers = {
        "position": given(start.state.position),
        "velocity": random.normal(size=(COUNT, 3)),
        "spin": random.normal(size=(2, 3)),
        "deformation": np.eye(3) + 0.02 * random.normal(size=(COUNT, 3, 3)),
        "gravity": np.array([0.1, 0.2, -9.0]),
        "density": np.asarray(500 + 500 * random.random(COUNT)),
        "youngs_modulus": np.asarray(1e3 * (1 + random.random(COUNT))),
        "poisson_ratio": np.asarray(0.2 + 0.1 * random.random(COUNT)),
    }

    def loss(numbers):
        motion = rollout_frames(replace(start, dt=1e-3, steps=4).with_(**numbers), 2)
        return jnp.sum(motion.position[-1] ** 2) + jnp.sum(motion.deformation[-1] ** 3)

    numbers = jax.tree.map(jnp.asarray, numbers)
    value, gradient = jax.jit(jax.value_and_grad(loss))(numbers)
    loss, h = jax.jit(loss), 1e-5
    assert np.isfinite(value)
    for name, number in numbers.items():
        size = jnp.maximum(jnp.max(jnp.abs(number)), 1e-3)
        step = h * size * jnp.asarray(random.normal(size=number.shape))
        ends = [float(loss(numbers | {name: number + side * step})) for side in (1, -1)]
        expected = float(jnp.sum(gradient[name] * step))
        assert (ends[0] - ends[1]) / 2 == pytest.approx(expected, rel=1e-3), name
        assert expected != 0


@pytest.mark.slow
def test_beyond_the_step_traced_numbers_are_an_answer_or_a_failure():
    """Fixed steps say that they are too long, with no gradient; those that adapt are right."""
    strained = np.diag([1.002, 1.0, 1.0])
    start = simulation(()).with_(deformation=strained, velocity=(0.1, 0.0, 0.0))
    stiff = 2e7
    reference = start.with_(youngs_modulus=stiff)  # known: the step follows
    assert reference.steps > 5 * start.steps

    def end(modulus, stepping):
        changed = replace(start, stepping=stepping).with_(youngs_modulus=modulus)
        motion = rollout_frames(changed, 2)
        return jnp.sum(motion.position[-1] ** 2), motion

    run = jax.jit(jax.value_and_grad(end, has_aux=True), static_argnums=1)
    (value, motion), slope = run(stiff, start.stepping)
    assert int(motion.status.code[1]) == UNSTABLE_STEP and np.isnan(value) and np.isnan(slope)
    (value, motion), slope = run(stiff, Adaptive(most_steps=300))
    assert int(motion.status.code[1]) == OK and np.isfinite(slope) and slope != 0
    expected = rollout_frames(reference, 2)
    np.testing.assert_allclose(motion.position[1], expected.position[1], atol=5e-5)
    assert np.abs(expected.position[1] - expected.position[0]).max() > 2e-3
