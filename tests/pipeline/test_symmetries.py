"""The same motion, whichever way it is asked for: moved, turned, scaled, listed otherwise, cut in
two, looked at more often. For every material, from the scene to its frames.

Each case states the same fall on a floor in another way, and maps its frames back. Distances are
root mean squares over all frames and Gaussians, in cells.
"""

from dataclasses import replace

import numpy as np
import pytest

from jaxphys.core.rotations import axis_angle_to_matrix
from jaxphys.gaussians.gaussians import Gaussians, from_points, select
from jaxphys.mpm.materials.catalogue import MATERIALS
from jaxphys.pipeline.frames import simulate
from jaxphys.scene import Domain, Filling, Object, Plane, Rotation, Scene
from jaxphys.scene.build import build

SPACING = 1 / 12
SIDE = 15 * SPACING
MIDDLE = np.full(3, SIDE / 2)
FRAMES = 6


def ball(count=300) -> Gaussians:
    """A hollow ball, but for a dent: no turn maps it onto itself."""
    index = np.arange(count) + 0.5
    z = 1 - 2 * index / count
    turn = np.pi * (1 + 5**0.5) * index
    ring = np.sqrt(1 - z**2)
    points = np.stack([ring * np.cos(turn), ring * np.sin(turn), z], axis=1)
    points *= 1 - 0.25 * np.exp(-4 * np.sum((points - [0.6, 0.0, 0.8]) ** 2, axis=1))[:, None]
    return from_points(points.astype(np.float32), np.full(3, 0.5), 0.1)


def falling(material: str) -> Scene:
    """An object that meets the floor at a slant and rebounds, slumps, dents or breaks."""
    thing = Object(
        material=material,
        size=0.45,
        centre=(0.62, 0.6, 0.59),
        velocity=(0.4, 0.0, -2.0),
        spin=(0.0, 1.0, 0.0),
        filling=Filling(),
    )
    return Scene(
        objects=(thing,),
        boundaries=(Plane((0.6, 0.6, 0.33), friction=0.4),),
        domain=Domain((SIDE,) * 3, SPACING),
        frames=FRAMES,
        frame_time=0.02,
    )


def places(scene: Scene, *objects: Gaussians) -> np.ndarray:
    """Where the Gaussians are, (T, K, 3) [m]."""
    simulation, _ = build(scene, *objects, dtype="float64")
    return simulate(simulation, scene.frames, particles=simulation.carriers).check().position


def apart(a: np.ndarray, b: np.ndarray, spacing: float = SPACING) -> float:
    return float(np.sqrt(np.mean(np.sum((a - b) ** 2, axis=-1)))) / spacing


def on_object(scene: Scene, **changes) -> Scene:
    return replace(scene, objects=(replace(scene.objects[0], **changes),))


def moved(scene: Scene, shift: np.ndarray) -> Scene:
    thing, plane = scene.objects[0], scene.boundaries[0]
    scene = on_object(scene, centre=tuple(np.add(thing.centre, shift)))
    return replace(scene, boundaries=(replace(plane, point=tuple(np.add(plane.point, shift))),))


def turned(scene: Scene, axis, degrees: float) -> tuple[Scene, np.ndarray]:
    """The scene turned about the middle of its domain, gravity too, and the matrix."""
    R = np.asarray(axis_angle_to_matrix(np.asarray(axis, float), np.radians(degrees)), np.float64)

    def point(x):
        return tuple(MIDDLE + R @ (np.asarray(x) - MIDDLE))

    def vector(v):
        return tuple(R @ np.asarray(v))

    thing, plane = scene.objects[0], scene.boundaries[0]
    # The size of an object is that of its box, which a turn changes; here it is that of the ball.
    scene = on_object(
        scene,
        centre=point(thing.centre),
        velocity=vector(thing.velocity),
        spin=vector(thing.spin),
        rotation=(Rotation(tuple(axis), degrees),),
    )
    plane = replace(plane, point=point(plane.point), normal=vector(plane.normal))
    return replace(scene, boundaries=(plane,), gravity=vector(scene.gravity)), R


def scaled(scene: Scene, length: float, time: float, stress: float) -> Scene:
    thing, plane = scene.objects[0], scene.boundaries[0]
    values = dict(MATERIALS[thing.material].defaults) | thing.parameters
    units = {"density": stress * (time / length) ** 2}
    units |= dict.fromkeys(("youngs_modulus", "yield_stress", "hardening"), stress)
    speed = length / time
    scene = on_object(
        scene,
        size=length * thing.size,
        centre=tuple(length * np.asarray(thing.centre)),
        velocity=tuple(speed * np.asarray(thing.velocity)),
        spin=tuple(np.asarray(thing.spin) / time),
        parameters={name: value * units.get(name, 1.0) for name, value in values.items()},
    )
    return replace(
        scene,
        boundaries=(replace(plane, point=tuple(length * np.asarray(plane.point))),),
        domain=Domain(tuple(length * np.asarray(scene.domain.size)), length * SPACING),
        gravity=tuple(speed / time * np.asarray(scene.gravity)),
        frame_time=time * scene.frame_time,
    )


@pytest.fixture(scope="module")
def known():
    """The motion of each material as first stated, simulated once."""
    found = {}

    def motion(material: str) -> np.ndarray:
        if material not in found:
            found[material] = places(falling(material), ball())
        return found[material]

    return motion


HARD = ("metal", "sand")
every_material = pytest.mark.parametrize(
    "material", [m if m in HARD else pytest.param(m, marks=pytest.mark.slow) for m in MATERIALS]
)
SOFT = ("sand",)
some_materials = pytest.mark.parametrize(
    "material", [m if m in SOFT else pytest.param(m, marks=pytest.mark.slow) for m in MATERIALS]
)


@every_material
def test_the_object_meets_the_floor(known, material):
    motion = known(material)
    # Falling free it would be 0.25 m lower after 0.1 s: the floor has acted.
    fallen = motion[0, :, 2].mean() - motion[-1, :, 2].mean()
    assert fallen < 0.2 and motion[..., 2].min() > 0.33 - 0.3 * SPACING


@every_material
def test_moved_by_a_third_of_a_cell(known, material):
    shift = SPACING / 3 * np.array([1.0, -1.0, 1.0])
    motion = places(moved(falling(material), shift), ball())
    assert apart(motion - shift, known(material)) < 0.05


@every_material
def test_listed_in_another_order(known, material):
    order = np.random.default_rng(1).permutation(300)
    motion = places(falling(material), select(ball(), order))
    assert apart(motion, known(material)[:, order]) < 0.02


@some_materials
def test_turned_by_a_right_angle(known, material):
    scene, R = turned(falling(material), (1.0, 0.0, 0.0), 90.0)
    motion = places(scene, ball())
    assert apart((motion - MIDDLE) @ R + MIDDLE, known(material)) < 0.05


@some_materials
def test_turned_to_no_axis_of_the_grid(known, material):
    scene, R = turned(falling(material), (1.0, 2.0, 0.0), 37.0)
    size = falling(material).objects[0].size
    scene = on_object(scene, size=size * extent_of(R))
    motion = places(scene, ball())
    # The box of a turned object has another middle.
    back = (motion - MIDDLE) @ R + MIDDLE
    back -= (back[0] - known(material)[0]).mean(axis=0)
    assert apart(back, known(material)) < 0.12


def extent_of(R: np.ndarray) -> float:
    """Longest side of the turned ball's box over that of the ball's."""
    points = np.asarray(ball().means)
    return float(np.ptp(points @ R.T, axis=0).max() / np.ptp(points, axis=0).max())


@some_materials
def test_scaled_in_length_time_and_stress(known, material):
    motion = places(scaled(falling(material), 3.0, 0.5, 10.0), ball())
    assert apart(motion / 3.0, known(material)) < 1e-3


@some_materials
def test_looked_at_twice_as_often(known, material):
    scene = replace(falling(material), frames=2 * FRAMES - 1, frame_time=0.01)
    assert apart(places(scene, ball())[::2], known(material)) < 0.02


def test_cut_into_two_that_touch():
    axis = np.arange(8) - 3.5
    block = np.stack(np.meshgrid(axis, axis, axis, indexing="ij"), axis=-1).reshape(-1, 3)
    whole = from_points(block.astype(np.float32), np.full(3, 0.5), 0.3)
    step = 0.5 * SPACING
    common = {"filling": None, "velocity": (0.4, 0.0, -2.0)}
    scene = on_object(falling("jelly"), size=7 * step, centre=(0.6, 0.6, 0.6), spin=(0, 0, 0))
    scene = on_object(scene, **common)
    left = np.flatnonzero(block[:, 0] < 0)
    right = np.flatnonzero(block[:, 0] > 0)
    thing = scene.objects[0]
    halves = tuple(replace(thing, centre=(0.6 + sign * 2 * step, 0.6, 0.6)) for sign in (-1.0, 1.0))
    motion = places(replace(scene, objects=halves), select(whole, left), select(whole, right))
    expected = places(scene, whole)
    assert apart(motion, expected[:, np.concatenate([left, right])]) < 0.05
