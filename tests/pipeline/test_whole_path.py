"""From a scene to pixels, against particles that are found one by one and a renderer that draws
every splat at every pixel: where every particle carries a Gaussian, and where some only fill.
"""

from dataclasses import replace

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from jaxphys.core.errors import InputError
from jaxphys.core.splats import Splats
from jaxphys.gaussians.gaussians import covariances, from_points, opacities
from jaxphys.gaussians.harmonics import dc_to_rgb
from jaxphys.mpm.loop.frames import advance_frame, rollout_frames
from jaxphys.mpm.loop.status import SimulationError
from jaxphys.pipeline.draw import deformed_gaussians, draw
from jaxphys.pipeline.frames import simulate
from jaxphys.render.camera import orbit
from jaxphys.render.settings import Settings
from jaxphys.scene import Box, Domain, Filling, Object, Plane, Scene
from jaxphys.scene.build import build
from tests.render.reference import render_dense

CAMERA = orbit((0.5, 0.5, 0.5), 1.2, 0.4, 0.2, width=24, height=16, dtype=jnp.float64)
SETTINGS = Settings()


def gaussians(count=50):
    random = np.random.default_rng(4)
    direction = random.normal(size=(count, 3))
    points = direction / np.linalg.norm(direction, axis=1, keepdims=True)
    return from_points(points.astype(np.float32), random.uniform(0, 1, (count, 3)), 0.3)


def scene(filling, **changes):
    thing = Object(
        size=0.4,
        centre=(0.5, 0.5, 0.5),
        filling=filling,
        parameters={"youngs_modulus": 1e3},
        velocity=(0.2, 0.0, -1.0),
        spin=(3.0, 1.0, 0.0),
    )
    domain = Domain((1.0, 1.0, 1.0), 1 / 12)
    return Scene(objects=(thing,), domain=domain, frame_time=0.02, **changes)


@pytest.fixture(scope="module")
def hollow():
    """Every particle carries a Gaussian."""
    built = build(scene(None, regularise_colours=False), gaussians(), dtype="float64")
    assert built.simulation.config.particles == 50
    return built


@pytest.fixture(scope="module")
def filled():
    """Some particles only fill."""
    built = build(scene(Filling(), regularise_colours=False), gaussians(), dtype="float64")
    assert built.simulation.config.particles > 80
    return built


def brute_force_picture(simulation, look, state):
    """Each Gaussian's particle is the one that starts where the Gaussian is."""
    start = np.asarray(simulation.state.position).T
    mean = np.asarray(look.gaussians.means, np.float64)
    distance = np.linalg.norm(start[None] - mean[:, None], axis=2)
    own = distance.argmin(axis=1)
    assert distance.min(axis=1).max() < 1e-6 and len(set(own)) == len(own)
    position = np.asarray(state.position).T[own]
    F = np.moveaxis(np.asarray(state.deformation), -1, 0)[own]
    shape = F @ np.asarray(covariances(look.gaussians), np.float64) @ np.swapaxes(F, 1, 2)
    rgb = np.asarray(dc_to_rgb(look.gaussians.harmonics[:, 0]), np.float64)
    splats = Splats(position, shape, np.asarray(opacities(look.gaussians), np.float64), rgb)
    return render_dense(jax.tree.map(jnp.asarray, splats), CAMERA, jnp.ones(3), SETTINGS)[0]


@pytest.mark.parametrize("which", ["hollow", pytest.param("filled", marks=pytest.mark.slow)])
def test_pictures_show_every_gaussian_on_its_own_particle(which, request):
    simulation, look = request.getfixturevalue(which)
    motion = jax.jit(rollout_frames, static_argnames="frames")(simulation, frames=3)
    state = simulation.state
    for frame in range(3):
        if frame:
            state = advance_frame(
                simulation.config, simulation.model, state, simulation.dt, simulation.steps
            )
        image = draw(look, motion[frame], CAMERA, background=1.0)
        expected = brute_force_picture(simulation, look, state)
        np.testing.assert_allclose(image.colour, expected, atol=2e-6)
    # The object has turned and fallen: another picture than that of frame 0.
    assert np.abs(np.asarray(expected) - draw(look, motion[0], CAMERA).colour).max() > 0.1
    host = simulate(simulation, 3, particles=simulation.carriers)
    np.testing.assert_allclose(host[2].carried()[0], motion[2].carried()[0], atol=1e-12)


def test_gradient_of_pixels_by_every_particles_velocity(filled):
    """(N, 3) velocities are in the object's order: Gaussians first."""
    simulation, look = filled
    count = simulation.config.particles

    @jax.jit
    def loss(velocity):
        motion = rollout_frames(simulation.with_(velocity=velocity), 2)
        image = draw(look, motion[-1], CAMERA, capacity=4096)
        return jnp.mean((image.colour - 0.3) ** 2)

    velocity = jnp.zeros((count, 3)).at[:, 2].set(-1.0)
    gradient = jax.jit(jax.grad(loss))(velocity)
    for particle in (0, 17, 49, count - 1):
        nudge = jnp.zeros((count, 3)).at[particle, 2].set(1e-3)
        difference = (loss(velocity + nudge) - loss(velocity - nudge)) / 2e-3
        assert float(gradient[particle, 2]) == pytest.approx(float(difference), rel=2e-3, abs=1e-10)
    # A single particle of those that are seen moves where its own Gaussian is.
    alone = rollout_frames(simulation.with_(velocity=10 * nudge), 1)
    assert np.array_equal(alone.position[0], simulation.frame(simulation.state).position)


def test_with_reaches_every_number(filled):
    simulation, _ = filled
    count = simulation.config.particles
    stiff = np.linspace(1e3, 2e3, count)
    changed = simulation.with_(
        youngs_modulus=stiff, density=2e3, gravity=(0.0, 1.0, 0.0), velocity=(1.0, 2.0, 3.0)
    )
    # By place: particle p of the object is where the p-th position says.
    start = np.asarray(simulation.state.position).T
    place = np.asarray(simulation.frame(simulation.state).position)
    own = np.linalg.norm(start[None] - place[:, None], axis=2).argmin(axis=1)
    found = np.asarray(changed.model.parameters["youngs_modulus"])[own]
    np.testing.assert_allclose(found, stiff)
    np.testing.assert_allclose(changed.model.mass, 2e3 * np.asarray(simulation.model.volume))
    np.testing.assert_allclose(changed.model.gravity, [0, 1, 0])
    np.testing.assert_allclose(changed.state.velocity, np.tile([[1.0], [2.0], [3.0]], count))
    assert not np.any(changed.state.affine)
    # Nothing of the first one has changed.
    assert np.ptp(np.asarray(simulation.model.parameters["youngs_modulus"])) == 0


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"young": 3.0}, "youngs_modulus"),
        ({"youngs_modulus": -1.0}, "must be > 0"),
        ({"youngs_modulus": np.nan}, "must be > 0"),
        ({"poisson_ratio": 0.5}, "between -1 and 0.5"),
        ({"density": 0.0}, "must be > 0"),
        ({"youngs_modulus": np.ones(3)}, "give a number or"),
        ({"velocity": np.ones(4)}, "velocity has shape"),
        ({"velocity": (np.inf, 0.0, 0.0)}, "not a finite number"),
        ({"gravity": 9.81}, "gravity has shape"),
        ({"friction": 0.3}, "no boundary here has friction"),
    ],
)
def test_with_refuses_what_cannot_be(hollow, changes, message):
    with pytest.raises(InputError, match=message):
        hollow.simulation.with_(**changes)


def test_the_step_follows_known_numbers_and_traced_ones_show_that_it_does_not(hollow):
    simulation, look = hollow
    stiff = simulation.with_(youngs_modulus=1e7)
    # Sound is a hundred times as fast; the first step was bounded by the spin.
    assert stiff.dt < 0.1 * simulation.dt
    assert stiff.dt * stiff.steps == pytest.approx(0.02)
    back = stiff.with_(youngs_modulus=1e3)
    assert (back.dt, back.steps) == (simulation.dt, simulation.steps)
    rollout_frames(stiff, 2).check()

    @jax.jit
    def moved(young):
        motion = rollout_frames(simulation.with_(youngs_modulus=young), 3)
        image = draw(look, motion[-1], CAMERA, capacity=4096)
        return jnp.sum(motion.position[-1] ** 2), (motion, image)

    (value, (motion, image)), gradient = jax.value_and_grad(moved, has_aux=True)(1e7)
    assert np.isnan(value) and np.isnan(gradient) and np.isnan(image.colour).all()
    with pytest.raises(SimulationError, match="frame 1, "):
        motion.check()
    for consumer in (lambda f: draw(look, f, CAMERA), lambda f: deformed_gaussians(look, f)):
        consumer(motion[0])
        with pytest.raises(SimulationError):
            consumer(motion[-1])


def test_a_look_refuses_the_motion_of_something_else(hollow):
    simulation, look = hollow
    fewer = replace(simulation, carriers=simulation.carriers[:20])
    with pytest.raises(InputError, match="50 Gaussians on positions"):
        draw(look, fewer.frame(simulation.state), CAMERA)


@pytest.fixture(scope="module")
def landing():
    """A ball that a floor and a box touch from the start."""
    floor = Plane((0.5, 0.5, 0.3), friction=0.3)
    push = Box((0.5, 0.5, 0.9), (0.3, 0.3, 0.2), velocity=(0.0, 0.0, -0.5), surface="separate")
    asked = scene(None, boundaries=(floor, push), damping=0.1)
    return build(asked, gaussians(), dtype="float64").simulation


def test_numbers_of_boundaries_reach_the_motion_and_its_gradient(landing):
    numbers = {
        0: {
            "point": (0.5, 0.5, 0.31),
            "normal": (0.1, 0.0, 1.0),
            "velocity": (0.0, 0.0, 0.3),
            "friction": 0.6,
        },
        1: {"centre": (0.5, 0.5, 0.89), "velocity": (0.1, 0.0, -0.6)},
    }
    numbers = {i: {k: jnp.asarray(v) for k, v in of.items()} for i, of in numbers.items()}

    def loss(numbers):
        motion = rollout_frames(landing.with_(boundaries=numbers), 3)
        return jnp.sum(motion.position[-1] ** 2)

    # At level 0, which the suite compiles with, this program alone gives NaN.
    level = {"xla_backend_optimization_level": 1}
    gradient = jax.jit(jax.grad(loss), compiler_options=level)(numbers)
    loss, step = jax.jit(loss), 1e-5
    for index, of in numbers.items():
        for name, value in of.items():
            direction = jnp.ones_like(value)

            def at(t, index=index, name=name, value=value, direction=direction):
                return loss(numbers | {index: numbers[index] | {name: value + t * direction}})

            difference = float(at(step) - at(-step)) / (2 * step)
            assert difference != 0
            assert float(jnp.sum(gradient[index][name])) == pytest.approx(difference, rel=1e-3)


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"boundaries": {7: {"point": (0.0, 0.0, 0.0)}}}, r"boundaries\[7\]: there are 3"),
        ({"boundaries": {0: {"pont": (0.0, 0.0, 0.0)}}}, r"boundaries\[0\]\.pont.*'point'"),
        ({"boundaries": {0: {"surface": "slip"}}}, "surface: is no number"),
        ({"boundaries": {0: {"point": (0.0, 1.0)}}}, "expected 3 values"),
        ({"boundaries": {1: {"friction": 0.5}}}, "leaves it out of the program"),
        ({"friction": -1.0}, "at least 0"),
        ({"friction": np.nan}, "not a finite number"),
    ],
)
def test_with_refuses_what_boundaries_cannot_be(landing, changes, message):
    with pytest.raises(InputError, match=message):
        landing.with_(**changes)
