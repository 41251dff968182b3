"""Observations: residuals by hand, what is refused, and files there and back."""

from dataclasses import replace

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from jaxphys.core.errors import InputError
from jaxphys.fitting import Images, Masks, Own, Points, Tracks
from jaxphys.fitting.files import read_images, read_points, read_tracks, write_observed
from jaxphys.fitting.observed.points import DIRECTIONS, QUANTILES
from jaxphys.mpm.motion import Motion
from jaxphys.mpm.state import Status
from jaxphys.render.camera import look_at
from tests.mpm.cases import block, simulation_of

COUNT, FRAMES = 12, 3
TIMES = np.array([0.0, 0.01, 0.02])


@pytest.fixture(scope="module")
def simulation():
    return simulation_of(*block(COUNT), dt=1e-3, steps=10, carriers=5)


def compared(observed, motion, data):
    """Residuals, compiled."""
    return np.asarray(jax.jit(lambda m, d: observed.residuals(m, None, d))(motion, data))


def motion(positions) -> Motion:
    frames, count, _ = positions.shape
    zero = jnp.zeros(frames, jnp.int32)
    return Motion(
        jnp.asarray(positions),
        jnp.broadcast_to(jnp.eye(3), (frames, count, 3, 3)),
        jnp.asarray(TIMES[:frames]),
        Status(zero, zero - 1, zero - 1, zero),
        jnp.arange(5),
    )


@pytest.fixture(scope="module")
def places():
    return np.random.default_rng(0).uniform(0.2, 0.6, (FRAMES, COUNT, 3))


def test_tracks_are_differences_over_noise_of_those_that_were_seen(simulation, places):
    which = np.array([7, 2, 9])
    seen = np.ones((FRAMES, 3), bool)
    seen[1, 2] = False
    positions = np.where(seen[..., None], places[:, which] + [0.0, 0.002, 0.0], np.nan)
    tracks = Tracks(positions, TIMES, which, seen, noise=1e-3, weight=4.0)
    tracks.check(simulation, None, 0.02)
    found = compared(tracks, motion(places), tracks.data(simulation, None))
    wanted = np.zeros((FRAMES, 3, 3))
    wanted[..., 1] = -2 * 2  # two deviations, twice for the weight
    wanted[1, 2] = 0
    np.testing.assert_allclose(found, wanted, atol=1e-9)


def test_points_find_their_neighbours_whatever_the_order(simulation, places):
    """The same cloud in another order has no residuals; moved by d, each way sums to d squared."""
    which = np.arange(COUNT)
    clouds = [frame[np.random.default_rng(i).permutation(COUNT)] for i, frame in enumerate(places)]
    points = Points(clouds, TIMES, which, noise=0.5)
    points.check(simulation, None, None)
    here = motion(places)
    data = points.matched(here, None, points.data(simulation, None))
    np.testing.assert_allclose(compared(points, here, data), 0, atol=1e-12)
    shift = np.array([1e-4, 0.0, 0.0])
    there = motion(places + shift)
    residuals = compared(points, there, points.matched(there, None, data))
    # Two ways, each a mean over the points, times the 12 that are independent.
    np.testing.assert_allclose(np.sum(residuals**2, axis=1), 2 * COUNT * 1e-8 / 0.5**2, rtol=1e-9)


def test_clouds_that_are_apart_are_compared_by_their_shadows(simulation, places):
    """Moved by d, sorted projections differ by d . direction: the gradient points home."""
    points = Points(list(places), TIMES, np.arange(COUNT), noise=1.0)
    moved = motion(places + np.array([3.0, 0.0, 0.0]))
    data = points.matched(moved, None, points.data(simulation, None))
    assert np.all(data["apart"])
    residuals = compared(points, moved, data)
    axes = np.asarray(data["directions"])
    power = 9 * np.mean(axes[:, 0] ** 2) * COUNT
    np.testing.assert_allclose(np.sum(residuals**2, axis=1), power, rtol=1e-6)
    assert residuals.shape[1] == 2 * 3 * COUNT + DIRECTIONS * QUANTILES

    def loss(shift):
        x = motion(places)
        x = Motion(x.position + shift, x.deformation, x.time, x.status, x.carriers)
        return jnp.sum(points.residuals(x, None, data) ** 2)

    slope = jax.grad(loss)(jnp.array([3.0, 0.0, 0.0]))
    assert slope[0] > 0.98 * jnp.linalg.norm(slope)


def test_hidden_parts_are_trimmed(simulation, places):
    """Two points that were never seen are the sixth of the worst, and count for nothing."""
    clouds = [frame[:10] for frame in places]
    points = Points(clouds, TIMES, np.arange(COUNT), trim=2.1 / COUNT, noise=1.0)
    here = motion(places)
    data = points.matched(here, None, points.data(simulation, None))
    np.testing.assert_allclose(compared(points, here, data), 0, atol=1e-12)


CAMERA = look_at((1.5, 0.4, 0.4), (0.4, 0.4, 0.4), width=8, height=6)
HOLED = np.array([0.0, np.nan, 0.0])
WIDER = look_at((1.5, 0.4, 0.4), (0.4, 0.4, 0.4), width=9, height=6)
BLIND = replace(CAMERA, focal=CAMERA.focal * jnp.nan)


@pytest.mark.parametrize(
    "make, told",
    [
        (lambda p: Tracks(p[:, :5], TIMES), r"tracks.positions: has shape \(3, 5, 3\)"),
        (lambda p: Tracks(np.where(p == p[1, 3, 0], np.nan, p), TIMES), "frame 1 has entries"),
        (
            lambda p: Tracks(p + np.array([[[0]], [[0]], [[9]]]), TIMES),
            "frame 2, point 0 .* outside",
        ),
        (lambda p: Tracks(p, [0.0, 0.02, 0.01]), "frame 2 is at 0.01 s"),
        (lambda p: Tracks(p, [-1.0, 0.0, 0.01]), "frame 0 is at -1 s"),
        (lambda p: Tracks(p, [0.0, 0.01, 0.5]), "frame 2 is at 0.5 s, after the run ends"),
        (lambda p: Tracks(p, TIMES, noise=0.0), "tracks.noise"),
        (lambda p: Tracks(p[:, :1], TIMES, np.array([99])), "99 is none of the 12"),
        (lambda p: Tracks(p, TIMES[:2]), r"tracks.positions: has shape .* expected \(2, 12, 3\)"),
        (
            lambda p: Tracks(p, TIMES, seen=np.ones((3, 4), bool)),
            r"tracks.seen: has shape \(3, 4\)",
        ),
        (lambda p: Tracks(p, [0.0, np.nan, 0.02]), "tracks.times: frame 1 is not finite"),
        (
            lambda p: Points([p[0], p[1] * np.nan, p[2]], TIMES),
            "points.clouds: frame 1 has entries",
        ),
        (lambda p: Points([p[0], p[1], p[2] - 9], TIMES), "frame 2, point 0 .* outside"),
        (
            lambda p: Points(list(p), TIMES, np.array([-1])),
            "points.particles: -1 is none of the 12",
        ),
        (lambda p: Points([p[0], p[1]], TIMES), "points.clouds: 2 of them for 3"),
        (lambda p: Points([p[0], p[1], p[2, :0]], TIMES), "frame 2 has shape"),
        (lambda p: Images(np.zeros((3, 6, 8, 3)), CAMERA, TIMES), "needs look="),
        (lambda p: Own(None, TIMES), "own.function"),
    ],
)
def test_what_does_not_fit_is_named_by_frame_and_field(make, told, simulation, places):
    with pytest.raises(InputError, match=told):
        make(places).check(simulation, None, 0.02)


@pytest.mark.parametrize(
    "make, told",
    [
        (lambda: Masks(np.zeros((3, 7, 8)), CAMERA, TIMES), r"expected \(1, 3, 6, 8\)"),
        (lambda: Masks(np.full((3, 6, 8), 2.0), CAMERA, TIMES), r"frame 0 has values outside"),
        (lambda: Images(np.zeros((2, 3, 6, 8, 3)), [CAMERA], TIMES), "images.frames: has shape"),
        (lambda: Images(np.zeros((2, 6, 8, 3)), CAMERA, TIMES), "images.frames: has shape"),
        (
            lambda: Images(np.ones((3, 6, 8, 3)) * HOLED[:, None, None, None], CAMERA, TIMES),
            r"images.frames\[0\]: frame 1 has entries that are not finite",
        ),
        (
            lambda: Masks(np.zeros((2, 3, 6, 8)), [CAMERA, WIDER], TIMES),
            r"masks.cameras: have several sizes, \[\(6, 8\), \(6, 9\)\]",
        ),
        (
            lambda: Masks(np.zeros((2, 3, 6, 8)), [CAMERA, BLIND], TIMES),
            r"masks.cameras: number 1 has entries that are not finite",
        ),
    ],
)
def test_pictures_of_another_size_are_refused(make, told, simulation):
    with pytest.raises(InputError, match=told):
        make().check(simulation, object(), None)


def test_files_there_and_back(tmp_path, places):
    tracks = Tracks(places, TIMES, np.arange(COUNT), np.ones((FRAMES, COUNT), bool))
    write_observed(tmp_path / "tracks.npz", tracks)
    found = read_tracks(tmp_path / "tracks.npz", noise=2e-3)
    np.testing.assert_array_equal(found.positions, tracks.positions)
    np.testing.assert_array_equal(found.seen, tracks.seen)
    assert found.noise == 2e-3
    points = Points([places[0], places[1, :4]], TIMES[:2])
    write_observed(tmp_path / "points.npz", points)
    found = read_points(tmp_path / "points.npz", trim=0.1)
    assert [len(cloud) for cloud in found.clouds] == [COUNT, 4] and found.trim == 0.1
    frames = np.random.default_rng(0).random((2, 3, 6, 8, 3)).astype(np.float32)
    write_observed(tmp_path / "images.npz", Images(frames, [CAMERA, CAMERA], TIMES))
    found = read_images(tmp_path / "images.npz", background=0.0)
    np.testing.assert_array_equal(found.frames, frames)
    assert (found.views[1].width, found.views[1].height) == (8, 6)
    np.testing.assert_allclose(found.views[1].focal, CAMERA.focal)


@pytest.mark.parametrize(
    "arrays, told",
    [
        ({"positions": np.zeros((1, 2, 3))}, "'times' is missing"),
        (
            {"position": np.zeros((1, 2, 3)), "times": np.zeros(1)},
            "did you mean 'positions'|'positi",
        ),
        ({"positions": np.array([object()]), "times": np.zeros(1)}, "no .npz file of arrays"),
    ],
)
def test_a_damaged_file_is_named(arrays, told, tmp_path):
    np.savez(tmp_path / "tracks.npz", **arrays)
    with pytest.raises(InputError, match=f"tracks.npz.*({told})"):
        read_tracks(tmp_path / "tracks.npz")
