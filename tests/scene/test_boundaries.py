"""Each boundary from JSON into a step: the numbers that a user writes reach the particles."""

import dataclasses
import typing

import jax
import numpy as np
import pytest

from jaxphys.core.errors import InputError
from jaxphys.gaussians.gaussians import from_points
from jaxphys.gaussians.mesh import write_triangles
from jaxphys.mpm.boundaries import AnyBoundary
from jaxphys.mpm.loop.rollout import step
from jaxphys.scene import Domain, Object, Scene, scene_from_json, to_json
from jaxphys.scene.build import build

H, V0 = 1 / 12, np.array([0.3, 0.0, -0.6])
YOUNG, POISSON = 1e3, 0.25
P_WAVE = YOUNG * (1 - POISSON) / ((1 + POISSON) * (1 - 2 * POISSON))
BOX = {"centre": [0.5, 0.5, 0.4], "half_size": [0.2, 0.2, 0.11]}


@pytest.fixture(scope="module", autouse=True)
def cube(tmp_path_factory):
    """The mesh that a case names."""
    x = np.array([[0, 0], [1, 0], [1, 1], [0, 1]])[[[0, 2, 1], [0, 3, 2]]] - 0.5
    lower = np.concatenate([x, np.full((2, 3, 1), -0.5)], -1)
    half = np.concatenate([lower, np.roll(lower, 1, -1), np.roll(lower, 2, -1)])
    path = tmp_path_factory.mktemp("mesh") / "cube.ply"
    write_triangles(path, np.concatenate([half, -half[:, ::-1]]))
    CASES["mesh"][0]["source"] = str(path)


def after_a_step(*boundaries, filling=None, **fields):
    """Rest positions, masses, volumes, velocities (N, 3) after one step, and its length."""
    thing = Object(
        size=0.3,
        centre=(0.5, 0.5, 0.5),
        velocity=tuple(V0),
        filling=filling,
        parameters={"youngs_modulus": YOUNG, "poisson_ratio": POISSON},
    )
    scene = Scene(
        (thing,), (0.0, 0.0, 0.0), domain=Domain((1.0, 1.0, 1.0), H), frame_time=0.01, **fields
    )
    scene = scene_from_json(to_json(scene) | {"boundaries": list(boundaries)})
    points = np.random.default_rng(0).uniform(-1, 1, (60, 3)).astype(np.float32)
    made, _ = build(scene, from_points(points, np.full((60, 3), 0.5), 0.2), dtype=np.float32)
    with jax.disable_jit():  # nine programs for one step each would take longer to compile
        end = step(made.config, made.model, made.state, made.dt)
    x, v = (np.asarray(a, np.float64).T for a in (made.state.position, end.velocity))
    mass, volume = (np.asarray(a, np.float64) for a in (made.model.mass, made.model.volume))
    return x, mass, volume, v, made.dt


UNSAID = ("acts_on", "particle_radius", "size")  # of every contact, and what Walls derive


def in_box(x):
    return np.all(np.abs(x - BOX["centre"]) < BOX["half_size"], axis=1)


def pushed(x, volume, distance):
    """Force [N] on particles whose signed distances to a surface are given."""
    return 2 * P_WAVE * volume / H**2 * np.maximum(np.cbrt(volume) / 2 - distance, 0)


def check_walls(x, mass, volume, v, dt):
    force = np.zeros(3)
    for axis in range(3):
        force[axis] = (pushed(x, volume, x[:, axis] - 0.36)).sum()
        force[axis] -= (pushed(x, volume, 1 - 0.36 - x[:, axis])).sum()
    assert np.all(np.abs(force) > 0.1)
    np.testing.assert_allclose(mass @ v, mass.sum() * V0 + dt * force, rtol=1e-4)


def check_plane(x, mass, volume, v, dt):
    force = pushed(x, volume, (x - [0.38, 0.0, 0.38]) @ [0.6, 0.0, 0.8])
    assert force.sum() > 0.1
    expected = mass.sum() * V0 + dt * force.sum() * np.array([0.6, 0.0, 0.8])
    np.testing.assert_allclose(mass @ v, expected, rtol=1e-4)


def check_rough_plane(x, mass, volume, v, dt):
    """The plane moves with the body along x and against it along y: what slips is dt (v - w)."""
    x, distance = x, x[:, 2] - 0.36
    k = 2 * P_WAVE * volume / H**2
    pressed = np.maximum(np.cbrt(volume) / 2 - distance, 0)
    slip = np.minimum(0.1 * dt, 0.5 * pressed)
    expected = mass.sum() * V0 + dt * np.array([0, (k * slip).sum(), (k * pressed).sum()])
    assert (k * slip).sum() > 0
    np.testing.assert_allclose(mass @ v, expected, rtol=1e-4, atol=1e-7)


def check_box(x, mass, volume, v, dt):
    np.testing.assert_allclose(v, np.tile([0.1, 0.2, 0.3], (len(v), 1)), atol=1e-6)


def check_ball(x, mass, volume, v, dt):
    arm = x - [0.5, 0.5, 0.17]
    distance = np.linalg.norm(arm, axis=1)
    force = pushed(x, volume, distance - 0.2) @ (arm / distance[:, None])
    assert np.linalg.norm(force) > 0.02
    np.testing.assert_allclose(mass @ v, mass.sum() * V0 + dt * force, rtol=1e-4)


def in_turned_axes(x):
    """Places about (0.5, 0.5, 0.22) in axes turned by 0.4 about y."""
    c, s = np.cos(0.4), np.sin(0.4)
    axes = np.array([[c, 0, -s], [0, 1, 0], [s, 0, c]])  # rows
    return (x - [0.5, 0.5, 0.22]) @ axes.T, axes


def check_cuboid(x, mass, volume, v, dt):
    """The upper face alone is near."""
    own, axes = in_turned_axes(x)
    force = pushed(x, volume, own[:, 2] - 0.1).sum() * axes[2]
    assert np.linalg.norm(force) > 0.02
    np.testing.assert_allclose(mass @ v, mass.sum() * V0 + dt * force, rtol=1e-4, atol=1e-6)


def check_cylinder(x, mass, volume, v, dt):
    """From inside: the lower end and the wall."""
    own = x - [0.5, 0.5, 0.5]
    across = np.linalg.norm(own[:, :2], axis=1)
    force = np.zeros(3)
    force[2] = pushed(x, volume, 0.12 + own[:, 2]).sum() - pushed(x, volume, 0.12 - own[:, 2]).sum()
    force[:2] = -pushed(x, volume, 0.18 - across) @ (own[:, :2] / across[:, None])
    assert np.all(np.abs(force) > 1e-3)
    np.testing.assert_allclose(mass @ v, mass.sum() * V0 + dt * force, rtol=1e-4)


def check_capsule(x, mass, volume, v, dt):
    arm = x - [0.5, 0.5, 0.27]
    arm[:, 0] -= np.clip(arm[:, 0], -0.2, 0.2)
    distance = np.linalg.norm(arm, axis=1)
    force = pushed(x, volume, distance - 0.1) @ (arm / distance[:, None])
    assert np.linalg.norm(force) > 0.02
    np.testing.assert_allclose(mass @ v, mass.sum() * V0 + dt * force, rtol=1e-4)


def check_mesh(x, mass, volume, v, dt):
    """A cube of 0.6 m, 0.02 m below the middle of the body, once its file is read."""
    force = pushed(x, volume, x[:, 2] - 0.37).sum()
    assert force > 0.02
    expected = mass.sum() * V0 + [0, 0, dt * force]
    np.testing.assert_allclose(mass @ v, expected, rtol=1e-4)


def check_impulse(x, mass, volume, v, dt):
    assert 0 < in_box(x).sum() < len(x)
    np.testing.assert_allclose(
        mass @ v - mass.sum() * V0, 1e-3 * np.array([1.0, 2.0, 3.0]), rtol=2e-3
    )


def check_translate(x, mass, volume, v, dt):
    np.testing.assert_allclose(v, np.where(in_box(x)[:, None], [0.1, 0.2, 0.3], V0), atol=1e-6)


def check_rotate(x, mass, volume, v, dt):
    arm = x - 0.5
    chosen = (np.abs(arm[:, 2]) < 0.1) & (np.hypot(arm[:, 0], arm[:, 1]) < 0.12)
    assert 0 < chosen.sum() < len(x)
    turned = np.stack([-2 * arm[:, 1], 2 * arm[:, 0], 0 * arm[:, 0] + 0.7], 1)
    np.testing.assert_allclose(v, np.where(chosen[:, None], turned, V0), atol=1e-6)


def check_release(x, mass, volume, v, dt):
    held = (x[:, 2] > 0.45) & (x[:, 2] <= 0.6)
    np.testing.assert_allclose(v, np.where(held[:, None], 0, V0), atol=1e-6)


def check_cut(x, mass, volume, v, dt):
    """Well inside, all is held below the layer and slides, slowed, within it."""
    low, high = x[:, 2] < 0.49 - 1.5 * H, x[:, 2] > 0.49 + 1.5 * H
    assert low.any() and high.any()
    np.testing.assert_allclose(v[low], 0, atol=1e-6)
    np.testing.assert_allclose(
        v[high], np.tile([0.2 * V0[0], 0, 0.2 * V0[2]], (high.sum(), 1)), atol=1e-6
    )


def check_damping(x, mass, volume, v, dt):
    np.testing.assert_allclose(v, np.tile(V0 * np.exp(-30 * dt), (len(v), 1)), rtol=1e-5, atol=1e-7)


CASES = {
    "walls": ({"inset": 0.36}, check_walls),
    "plane": ({"point": [0.38, 0, 0.38], "normal": [3, 0, 4], "friction": 0}, check_plane),
    "box": (
        {"centre": [0.5, 0.5, 0.5], "half_size": [2, 2, 2], "velocity": [0.1, 0.2, 0.3]},
        check_box,
    ),
    "ball": ({"centre": [0.5, 0.5, 0.17], "radius": 0.2, "friction": 0}, check_ball),
    "cuboid": (
        {"centre": [0.5, 0.5, 0.22], "half_size": [0.5, 0.5, 0.1], "friction": 0,
         "orientation": [np.cos(0.2), 0, np.sin(0.2), 0]},
        check_cuboid,
    ),
    "cylinder": (
        {"centre": [0.5, 0.5, 0.5], "radius": 0.18, "half_height": 0.12, "inside": True,
         "friction": 0},
        check_cylinder,
    ),
    "capsule": (
        {"centre": [0.5, 0.5, 0.27], "radius": 0.1, "half_height": 0.2, "friction": 0,
         "orientation": [1, 0, 1, 0], "end": 9},
        check_capsule,
    ),
    "mesh": (
        {"centre": [0.5, 0.5, 0.07], "source": "CUBE", "size": 0.6, "resolution": 13,
         "friction": 0},
        check_mesh,
    ),
    "impulse": (BOX | {"force": [1, 2, 3]}, check_impulse),
    "translate": (BOX | {"velocity": [0.1, 0.2, 0.3]}, check_translate),
    "rotate": (
        {"point": [0.5, 0.5, 0.5], "axis": [0, 0, 2], "half_height": 0.1, "radius": 0.12,
         "angular_velocity": 2, "axial_velocity": 0.7},
        check_rotate,
    ),
    "release": ({"normal": [0, 0, 2], "begin": 0.45, "finish": 0.6}, check_release),
    "cut": (
        {"point": [0.5, 2, 0.5], "normal": [0, 1, 0], "lower": 0.49, "upper": 2, "factor": 0.2},
        check_cut,
    ),
    "damping": ({"rate": 30}, check_damping),
}  # fmt: skip


@pytest.mark.parametrize("kind", typing.get_args(AnyBoundary), ids=lambda kind: kind.type)
def test_what_json_says_is_what_a_step_does(kind):
    fields, check = CASES[kind.type]
    check(*after_a_step({"type": kind.type} | fields))


def test_a_moving_plane_with_friction_drags_by_the_slip_of_a_step():
    velocity = [V0[0], V0[1] + 0.1, 0.0]
    check_rough_plane(
        *after_a_step(
            {"type": "plane", "point": [0, 0, 0.36], "friction": 0.5, "velocity": velocity}
        )
    )


def test_the_scenes_damping_is_a_boundary():
    check_damping(*after_a_step(damping=30.0))


@pytest.mark.parametrize("kind", typing.get_args(AnyBoundary), ids=lambda kind: kind.type)
def test_every_field_has_a_default_or_a_meaning_and_goes_through_json(kind):
    fields, _ = CASES[kind.type]
    scene = scene_from_json({"boundaries": [{"type": kind.type} | fields]})
    written = to_json(scene)
    assert scene_from_json(written) == scene
    assert all(not isinstance(value, dict) for value in written["boundaries"][0].values())
    documented = kind.__doc__.split("Attributes:")[1]
    for entry in dataclasses.fields(kind):
        assert entry.name in documented or entry.name in UNSAID, entry.name


@pytest.mark.parametrize(
    ("fields", "message"),
    [
        ({"type": "plane", "normal": [0, 0, 0]}, r"boundaries\[0\].normal: is zero"),
        ({"type": "plane", "particle_radius": [1]}, "unknown key 'particle_radius'"),
        ({"type": "ball", "centre": [0.5, 0.5, 0.5], "radius": 0}, r"boundaries\[0\].radius"),
        (
            {"type": "ball", "centre": [0, 0, 0], "radius": 1, "motion": {"type": "keyframe"}},
            r"boundaries\[0\].motion.type: unknown type 'keyframe'; did you mean 'keyframes'",
        ),
        (
            {"type": "ball", "centre": [0.5, 0.5, 0.5], "radius": 0.2},
            r"boundaries\[0\].centre: \d+ particles start inside",
        ),
        (
            {"type": "mesh", "centre": [0, 0, 0], "size": 1, "source": "no.obj"},
            r"boundaries\[0\].source: no.obj: no such file",
        ),
        ({"type": "walls", "inset": -1}, r"boundaries\[0\].inset"),
        ({"type": "plane", "point": [0, 0, 0.5]}, r"boundaries\[0\].point: \d+ particles start"),
    ],
)
def test_errors_name_the_field(fields, message):
    with pytest.raises(InputError, match=message):
        after_a_step(fields)
