import dataclasses
from functools import partial
from itertools import islice

import numpy as np
import pytest

from jaxphys.core.errors import InputError
from jaxphys.gaussians.gaussians import from_points
from jaxphys.mpm.loop.frames import advance_frame
from jaxphys.mpm.loop.status import check
from jaxphys.mpm.materials.catalogue import MATERIALS
from jaxphys.mpm.materials.fracture import FRACTURE, number_of_pieces
from jaxphys.pipeline.frames import frames
from jaxphys.scene import scene_from_json, to_json
from jaxphys.scene.build import build
from jaxphys.scene.defaults import SPACING, default_scene


@pytest.mark.parametrize("name", MATERIALS)
def test_every_material_has_a_scene_that_is_valid(name):
    scene = default_scene(name)
    assert scene_from_json(to_json(scene)) == scene
    thing = scene.objects[0]
    assert thing.material == name
    # The scene shows what the material's name means anywhere else.
    assert thing.parameters == {}
    low, high = thing.centre[2] - thing.size / 2, thing.centre[2] + thing.size / 2
    assert scene.ground.height < low and high < scene.domain.size[2] - 4 * scene.domain.spacing


def test_unknown_material():
    with pytest.raises(InputError, match="'sand'"):
        default_scene("snad")


@pytest.mark.parametrize("name", MATERIALS)
def test_a_finer_grid_shows_the_same_scene(name):
    scene = default_scene(name)
    for spacing in (0.12, 0.1, 0.08, 0.053):
        other = default_scene(name, spacing=spacing)
        assert other.domain.spacing == spacing
        domain = dataclasses.replace(other.domain, spacing=scene.domain.spacing)
        assert dataclasses.replace(other, domain=domain) == scene


def hollow_ball(count=600):
    """Gaussians all over a sphere, grey."""
    points = np.random.default_rng(0).normal(size=(count, 3))
    points /= 2 * np.linalg.norm(points, axis=1, keepdims=True)
    size = 0.5 * np.sqrt(np.pi / count)
    return from_points(points.astype(np.float32), np.array([0.6, 0.6, 0.6]), size)


def after(name, count, spacing=0.1):
    """Positions (N, 3) of a ball's particles in the material's scene, at the start and after some
    frames, and the fastest speed then.
    """
    simulation, _ = build(default_scene(name, spacing=spacing), hollow_ball())
    end = run(simulation, count)
    speed = np.linalg.norm(np.asarray(end.velocity), axis=0)
    return np.asarray(simulation.state.position).T, np.asarray(end.position).T, speed.max()


def ended(name, count, spacing):
    """The solver's state after some frames."""
    return run(build(default_scene(name, spacing=spacing), hollow_ball()).simulation, count)


def run(simulation, count):
    end = advance_frame(
        simulation.config,
        simulation.model,
        simulation.state,
        simulation.dt,
        count * simulation.steps,
    )
    check(end.status)
    return end


def out_of_shape(before, now):
    """Root mean square distance of points from where the best rigid motion would take them, over
    that from their middle (Kabsch 1976).
    """
    before, now = before - before.mean(0), now - now.mean(0)
    U, _, Vt = np.linalg.svd(before.T @ now)
    U[:, 2] *= np.linalg.det(U @ Vt)
    return np.sqrt(np.mean((before @ (U @ Vt) - now) ** 2) / np.mean(before**2))


def test_elastic_bounces_and_keeps_its_shape():
    before, now, _ = after("elastic", 13)
    assert out_of_shape(before, now) < 0.05
    floor = default_scene("elastic").ground.height
    assert now[:, 2].min() > floor + 0.1  # in the air again


def test_metal_keeps_its_dent():
    before, now, speed = after("metal", 24)
    assert out_of_shape(before, now) > 0.05
    assert speed < 1.2  # of 4.8 m/s at the impact; it still rocks


def test_jelly_wobbles_and_comes_to_rest():
    before, now, speed = after("jelly", 6)
    assert out_of_shape(before, now) > 0.1
    before, now, speed = after("jelly", 72)
    assert speed < 0.4  # of 2 m/s at the impact; a ball rolls on
    assert np.ptp(now[:, 2]) < np.ptp(before[:, 2])  # it sags


def test_sand_runs_into_a_heap():
    before, now, speed = after("sand", 22)
    assert np.ptp(now[:, 2]) < 0.6 * np.ptp(before[:, 2])
    assert np.ptp(now[:, 0]) > 1.5 * np.ptp(before[:, 0])
    assert speed < 0.2


@pytest.mark.slow
def test_what_fractures_breaks_into_pieces():
    """Pieces are what hangs together by unbroken matter: crumbs between them hold nothing."""
    end = ended("fracture", 18, SPACING)
    damage = np.asarray(end.history[FRACTURE.history_names.index("damage")])
    position = np.asarray(end.position).T
    pieces = partial(number_of_pieces, radius=1.1 * SPACING, minimum_size=len(position) // 50)
    assert pieces(position[damage < 1]) >= 2
    assert 0.05 < np.mean(damage >= 1) < 0.5


def heights(name, *counts, spacing=0.1):
    """How high a ball in the material's scene reaches above the floor at its middle [m], at the
    start and after these numbers of frames.
    """
    scene = default_scene(name, spacing=spacing)
    simulation, _ = build(scene, hollow_ball())
    start = np.asarray(simulation.state.position).T
    middle = np.linalg.norm(start[:, :2] - scene.objects[0].centre[:2], axis=1) < 0.1
    ends = (np.asarray(run(simulation, count).position).T for count in counts)
    return [at[middle, 2].max() - scene.ground.height for at in (start, *ends)]


@pytest.mark.slow
def test_foam_keeps_its_dent_for_a_while_and_loses_it():
    # The bar leaves it at some 1.1 s; then it comes back to where its own weight lets it.
    start, pressed, soon, late = heights("memory-foam", 20, 34, 96)
    assert pressed < 0.7 * start and late > pressed + 0.15
    assert soon < late - 0.2 * (late - pressed)


@pytest.mark.slow
def test_muscle_shortens_and_lengthens_again():
    """Contracted after 0.4 s and slack after 0.8 s."""
    start, short, long = heights("muscle", 10, 19)
    assert short < 0.85 * start
    assert long > short + 0.1 * start


@pytest.mark.slow
def test_snow_crumbles_on_a_log_and_is_packed_by_a_floor():
    """What lies loose has grown by half for good: most of it where the scene's log pulls it apart,
    on both sides, and next to nothing without the log. What is packed has lost a tenth.

    Of even snow: on this grid the scene's lumps are too near each other to part.
    """
    scene = default_scene("snow", spacing=0.1)
    simulation, _ = build(scene.filmed(), hollow_ball())
    numbers = MATERIALS["snow"].defaults
    even = simulation.with_(
        **{name: numbers[name] for name in scene.objects[0].regions[0].parameters}
    )
    log = len(scene.boundaries) - 1

    def fallen(simulation):
        *_, moment = islice(frames(simulation), 9)
        check(moment.state.status)
        across = np.asarray(moment.state.position).T - scene.boundaries[log].centre
        right = np.array([np.sin(np.pi / 3), 0.5, 0.0])  # of the picture, seen from -60 degrees
        return np.exp(np.asarray(moment.state.history[0])), across @ right

    volume, across = fallen(even)
    loose = volume > 1.5
    assert np.mean(loose) > 0.5
    assert min(np.mean(across[loose] > 0.1), np.mean(across[loose] < -0.1)) > 0.3
    volume, _ = fallen(even.with_(boundaries={log: {"centre": (0.3, 0.3, 2.2)}}))
    assert np.mean(volume > 1.5) < 0.05
    assert np.mean(volume < 0.9) > 0.3
