from dataclasses import replace
from functools import partial

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from jaxphys.core.errors import InputError
from jaxphys.core.program import parts
from jaxphys.gaussians.gaussians import covariances, from_points
from jaxphys.mpm.boundaries import Plane, Translate
from jaxphys.mpm.loop.frames import advance_frame, rollout_frames
from jaxphys.mpm.loop.rollout import step
from jaxphys.mpm.stepping import Adaptive, Fixed, Implicit
from jaxphys.mpm.transfer import AFLIP, APIC, FLIP, Transfer
from jaxphys.pipeline.draw import draw
from jaxphys.render.camera import orbit
from jaxphys.scene import Domain, Meeting, Object, Region, Rotation, Scene
from jaxphys.scene.build import build
from jaxphys.scene.json import scene_from_json, to_json

POINTS = np.random.default_rng(0).uniform(-1, 1, (60, 3)).astype(np.float32)
POINTS[0], POINTS[1] = (-2, 0, 0), (2, 0, 0)
GAUSSIANS = from_points(POINTS, np.random.default_rng(1).uniform(0, 1, (60, 3)), 0.2)
THING = dict(size=0.4, centre=(0.5, 0.5, 0.5), filling=None, parameters={"youngs_modulus": 1e3})


def scene(**changes):
    return Scene(
        objects=(Object(**(THING | changes)),),
        domain=Domain((1.0, 1.0, 1.0), 1 / 12),
        frame_time=0.01,
    )


def carried(simulation):
    """Positions of the particles that carry Gaussians, in the order of the Gaussians."""
    return np.asarray(simulation.frame(simulation.state).carried()[0])


def test_every_gaussian_sits_on_its_particle():
    simulation, look = build(scene(), GAUSSIANS)
    assert np.array_equal(carried(simulation), np.asarray(look.gaussians.means))
    # Same object, scaled by 0.1 about its middle.
    offsets = carried(simulation) - 0.5
    assert np.allclose(offsets, 0.1 * (POINTS - (POINTS.min(0) + POINTS.max(0)) / 2), atol=1e-6)
    ratio = np.asarray(covariances(look.gaussians)) / 0.01
    assert np.allclose(ratio, np.asarray(covariances(GAUSSIANS)), atol=1e-6)


def test_turns_come_in_order():
    x, z = (1.0, 0.0, 0.0), (0.0, 0.0, 1.0)
    turned, _ = build(scene(rotation=(Rotation(z, 90.0), Rotation(x, 90.0))), GAUSSIANS)
    # The long axis goes from x to y by the first turn, from y to z by the second.
    reach = np.ptp(carried(turned), axis=0)
    assert np.argmax(reach) == 2 and reach[2] == pytest.approx(0.4, rel=1e-4)


def test_velocity_and_spin():
    simulation, _ = build(scene(velocity=(1.0, 0.0, 0.0), spin=(0.0, 0.0, 2.0)), GAUSSIANS)
    position, velocity = (
        np.asarray(simulation.state.position),
        np.asarray(simulation.state.velocity),
    )
    assert np.allclose(velocity[0], 1 - 2 * (position[1] - 0.5), atol=1e-5)
    assert np.allclose(velocity[1], 2 * (position[0] - 0.5), atol=1e-5)
    gradient = np.asarray(simulation.state.affine)[:, :, 0]
    assert np.allclose(gradient, [[0, -2, 0], [2, 0, 0], [0, 0, 0]])


def test_regions_have_parameters_of_their_own():
    right = Region((0.75, 0.5, 0.5), (0.25, 1.0, 1.0), {"youngs_modulus": 3e3})
    simulation, _ = build(scene(regions=(right,)), GAUSSIANS)
    inside = np.asarray(simulation.state.position)[0] > 0.5
    found = np.asarray(simulation.model.parameters["youngs_modulus"])
    assert np.allclose(found, np.where(inside, 3e3, 1e3))


@pytest.mark.parametrize("off", [-1e-6, 1e-6])
def test_a_region_holds_what_a_boundary_with_its_box_holds(off):
    """What lies on a face is outside of both, to whichever side rounding puts it."""
    x = np.arange(5.0)
    lattice = np.stack(np.meshgrid(x, x, x), -1).reshape(-1, 3).astype(np.float32)
    gaussians = from_points(lattice, np.full((125, 3), 0.5), 0.2)
    box = {"centre": (0.5, 0.5, 0.5), "half_size": (0.1 + off,) * 3}
    region = Region(**box, parameters={"youngs_modulus": 3e3})
    made = scene(regions=(region,), size=0.4, filling=None)
    made = replace(made, boundaries=(Translate(**box),))
    simulation, _ = build(made, gaussians)
    stiff = np.asarray(simulation.model.parameters["youngs_modulus"]) > 2e3
    assert stiff.sum() == 1
    np.testing.assert_array_equal(stiff, simulation.model.boundaries[0].chosen)


def test_numbers_of_numpy_and_lists_are_those_of_a_file():
    plain = scene(filling=None)
    (thing,) = plain.objects
    centre, size = np.array(thing.centre), np.float32(thing.size)
    given = replace(thing, centre=centre, size=size, velocity=list(thing.velocity))
    made = build(replace(plain, objects=[given]), GAUSSIANS)
    assert scene_from_json(to_json(replace(plain, objects=[given]))).objects[0].size == size
    for one, other in zip(
        jax.tree.leaves(made.simulation.state),
        jax.tree.leaves(build(plain, GAUSSIANS).simulation.state),
        strict=True,
    ):
        np.testing.assert_allclose(one, other, rtol=1e-6)


@pytest.mark.parametrize(
    "changes, told",
    [
        ({"size": np.float32("nan")}, r"^objects\[0\]\.size: nan is not a finite"),
        ({"centre": np.array([0.5, np.inf, 0.5])}, r"^objects\[0\]\.centre\[1\]: inf"),
        ({"centre": (0.5, 0.5)}, r"^objects\[0\]\.centre: expected a list of 3"),
        ({"material": None}, r"^objects\[0\]\.material: expected a text"),
        ({"parameters": {"density": "light"}}, r"^objects\[0\]\.parameters\.density: expected a"),
    ],
)
def test_what_no_file_could_hold_is_told_by_its_field(changes, told):
    made = scene()
    with pytest.raises(InputError, match=told):
        build(replace(made, objects=(replace(made.objects[0], **changes),)), GAUSSIANS)


def test_texts_and_truths_are_no_numbers():
    for make in (lambda: Object(size="1"), lambda: Domain(spacing=True), lambda: Adaptive("8")):
        with pytest.raises(InputError, match="expected a number, found"):
            make()
    with pytest.raises(InputError, match=r"^size: expected 3 values"):
        Domain(size=(1.0, 1.0))


@pytest.mark.parametrize(
    "changes, told",
    [
        ({"domain": {"size": [2.0, 2.0, 2.0], "spacing": 0.25}}, r"^domain: .*give Domain\("),
        ({"objects": ({"material": "jelly"},)}, r"^objects\[0\]: .*give Object\("),
        ({"boundaries": ({"type": "walls"},)}, r"^boundaries\[0\]: .*give Walls\("),
    ],
)
def test_a_dict_that_reads_well_is_still_no_dataclass(changes, told):
    with pytest.raises(InputError, match=told):
        build(replace(scene(), **changes), GAUSSIANS)


def test_a_path_is_no_set_of_gaussians():
    with pytest.raises(InputError, match=r"^build: objects\[0\] is 'a.ply'; .*jaxphys.load"):
        build(scene(), "a.ply")


def test_only_what_is_inside_the_area_moves():
    _, look = build(scene(area=(-3.0, 0.0, -3.0, 3.0, -3.0, 3.0)), GAUSSIANS)
    assert look.gaussians.count + look.still.count == 60
    assert look.gaussians.count == (POINTS[:, 0] < 0).sum()


def test_a_transfer_goes_from_json_into_the_step():
    asked = {"scheme": {"type": "flip", "blend": 0.9}, "kernel": "cubic"}
    hard = replace(scene(parameters={"youngs_modulus": 1e6}), frame_time=0.01)
    read = scene_from_json(to_json(hard) | {"transfer": asked})
    assert read.transfer == Transfer(FLIP(0.9), "cubic") and to_json(read)["transfer"] == asked
    simulation, _ = build(read, GAUSSIANS)
    config, model, state = simulation.config, simulation.model, simulation.state
    assert config.transfer == read.transfer
    assert "velocity of its own" in parts(lambda: step(config, model, state, simulation.dt))
    end = advance_frame(config, model, state, simulation.dt, 2)
    assert int(end.status.code) == 0 and int(end.status.taken) == 2
    # A longer swing of a particle alone: 2 / sqrt(3) of the step of quadratic splines for APIC, and
    # without an affine part 1 / sqrt(2) of that.
    plain = build(hard, GAUSSIANS).simulation
    assert plain.config.transfer == Transfer(APIC(), "quadratic")
    assert plain.steps < simulation.steps < 1.5 * plain.steps


@pytest.mark.parametrize(
    ("transfer", "message"),
    [
        ({"scheme": {"type": "flup"}}, r"transfer\.scheme\.type: unknown type 'flup'.*flip"),
        ({"scheme": {"blend": 0.5}}, r"transfer\.scheme: .*aflip, apic, flip, pic"),
        ({"scheme": {"type": "flip", "blend": 1.5}}, r"transfer\.scheme\.blend: .* at most 1"),
        ({"scheme": {"type": "apic", "blend": 0.5}}, r"transfer\.scheme: unknown key 'blend'"),
        ({"kernel": "linear"}, r"transfer\.kernel: unknown value 'linear'.*quadratic"),
    ],
)
def test_wrong_transfers_are_named(transfer, message):
    with pytest.raises(InputError, match=message):
        scene_from_json(to_json(scene()) | {"transfer": transfer})


def test_cubic_splines_need_more_room_at_the_ends():
    near = scene(centre=(0.35, 0.5, 0.5))  # reaches to 0.15 m, where 1.5 cells are 0.125
    build(near, GAUSSIANS)
    with pytest.raises(InputError, match="the domain holds"):
        build(replace(near, transfer=Transfer(AFLIP(), "cubic")), GAUSSIANS)


def test_substep_divides_the_frame():
    simulation, _ = build(scene(), GAUSSIANS)
    assert simulation.steps * simulation.dt == pytest.approx(0.01)


def test_float64_goes_all_the_way():
    """From the scene to the last frame where JAX is set to it, and nowhere through float32."""
    thing = {"velocity": (0.1, 0.2, -0.7), "spin": (0.0, 0.0, 0.3), "parameters": {"density": 0.1}}
    asked = replace(scene(**thing), boundaries=(Plane((0.5, 0.5, 0.1), friction=0.3),), damping=0.1)
    for dtype, wanted in ((None, jnp.float64), ("float32", jnp.float32)):
        simulation, _ = build(asked, GAUSSIANS, dtype=dtype)
        numbers = (simulation.model, simulation.state)
        kinds = {leaf.dtype for leaf in jax.tree.leaves(numbers) if leaf.dtype.kind == "f"}
        assert kinds == {jnp.dtype(wanted)}
        motion = jax.eval_shape(partial(rollout_frames, frames=2), simulation)
        assert motion.position.dtype == motion.time.dtype == wanted
        adapting = replace(simulation, stepping=Adaptive())
        motion = jax.eval_shape(partial(rollout_frames, frames=2), adapting)
        assert motion.position.dtype == motion.time.dtype == wanted
    simulation = build(asked, GAUSSIANS).simulation.with_(poisson_ratio=0.2)
    model, x, v = simulation.model, simulation.state.position, simulation.state.velocity
    # What float32 would round at the seventh digit.
    np.testing.assert_allclose(model.mass / model.volume, 0.1, rtol=1e-14)
    np.testing.assert_allclose(v[0], 0.1 - 0.3 * (x[1] - 0.5), rtol=1e-13)
    np.testing.assert_allclose(model.parameters["poisson_ratio"], 0.2, rtol=1e-15)
    assert float(model.boundaries[0].friction) == 0.3 and float(model.boundaries[1].rate) == 0.1


def test_a_scene_says_how_it_is_stepped():
    """Films adapt where nothing else is said; a given substep is a fixed one."""
    assert build(scene(), GAUSSIANS).simulation.stepping == Fixed()
    assert scene().filmed().stepping == Adaptive()
    assert build(scene().filmed(), GAUSSIANS).simulation.stepping == Adaptive()
    assert replace(scene(), substep=1e-4).filmed().stepping == Fixed()
    fixed = replace(scene(), stepping=Fixed())
    assert fixed.filmed() == fixed
    with pytest.raises(InputError, match=r"substep: .* fixed"):
        replace(scene(), stepping=Adaptive(), substep=1e-4)
    with pytest.raises(InputError, match="every: 0 must be at least 1"):
        Adaptive(every=0)


def test_unknown_parameter_of_with():
    with pytest.raises(InputError, match="youngs_modulus"):
        build(scene(), GAUSSIANS).simulation.with_(young=3.0)


@pytest.mark.slow
def test_gradient_of_a_pixel_loss_is_the_central_difference():
    simulation, look = build(scene(velocity=(0.0, 0.0, -1.0), spin=(3.0, 0.0, 0.0)), GAUSSIANS)
    simulation = jax.tree.map(
        lambda leaf: leaf.astype(jnp.float64) if leaf.dtype == jnp.float32 else leaf, simulation
    )
    camera = orbit((0.5, 0.5, 0.5), 1.2, 0.4, 0.2, width=24, height=16, dtype=jnp.float64)

    @jax.jit
    def loss(youngs_modulus, velocity):
        changed = simulation.with_(youngs_modulus=youngs_modulus, velocity=velocity)
        motion = rollout_frames(changed, 3)
        image = draw(look, motion[-1], camera, capacity=4096)
        return jnp.mean((image.colour - 0.3) ** 2)

    young, velocity = 1e3, jnp.array([0.0, 0.3, -1.0])
    by_young, by_velocity = jax.jit(jax.grad(loss, argnums=(0, 1)))(young, velocity)
    step = 1.0
    difference = (loss(young + step, velocity) - loss(young - step, velocity)) / (2 * step)
    assert float(by_young) == pytest.approx(float(difference), rel=2e-3) and by_young != 0
    for axis in range(3):
        nudge = jnp.zeros(3).at[axis].set(1e-5)
        difference = (loss(young, velocity + nudge) - loss(young, velocity - nudge)) / 2e-5
        assert float(by_velocity[axis]) == pytest.approx(float(difference), rel=2e-3, abs=1e-9)


def meeting(contact, **changes):
    """Two objects side by side, the one that comes first in the domain listed last."""
    right, left = (Object(**(THING | {"centre": (x, 0.5, 0.5), "size": 0.25})) for x in (0.7, 0.3))
    return replace(scene(), objects=(right, left), contact=contact, **changes)


def test_objects_that_meet_have_a_velocity_field_each():
    built = build(meeting(Meeting(friction=0.4)), GAUSSIANS, GAUSSIANS, dtype="float32")
    config, model, state = built.simulation.config, built.simulation.model, built.simulation.state
    assert config.fields == 2 and model.friction.dtype == jnp.float32
    assert np.array_equal(model.field == 0, state.position[0] > 0.5)
    found = parts(partial(step, config), model, state, 1e-4)
    assert found["contact between objects"] > 0
    rougher = built.simulation.with_(friction=0.7)
    assert float(rougher.model.friction) == pytest.approx(0.7)
    for friction, message in ((-0.1, "at least 0"), ((0.1, 0.2), "give one number")):
        with pytest.raises(InputError, match=f"with_: friction.*{message}"):
            built.simulation.with_(friction=friction)


def test_objects_that_do_not_meet_by_contact_have_none_of_it():
    shared, smooth = (
        build(meeting(contact), GAUSSIANS, GAUSSIANS).simulation for contact in (None, Meeting())
    )
    assert shared.config.fields == 1 and shared.model.field is None is shared.model.friction
    assert smooth.config.fields == 2 and smooth.model.friction is None
    with pytest.raises(InputError, match="no boundary here has friction, nor has contact"):
        smooth.with_(friction=0.3)


def test_contact_between_objects_is_refused_where_it_cannot_be():
    with pytest.raises(InputError, match=r"contact: is between objects, and there is one"):
        replace(scene(), contact=Meeting())
    with pytest.raises(InputError, match=r"scene\.contact\.friction: .* at least 0"):
        scene_from_json(to_json(meeting(Meeting())) | {"contact": {"friction": -1}})
    with pytest.raises(InputError, match="Implicit: contact between objects needs explicit steps"):
        build(meeting(Meeting(), stepping=Implicit()), GAUSSIANS, GAUSSIANS)
