"""Captures of known Gaussians through readers, optimisation and command, to held-out pictures."""

import dataclasses
import json
import shutil
from pathlib import Path

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from PIL import Image
from scipy.spatial.transform import Rotation

from jaxphys.cli.main import run
from jaxphys.core.errors import InputError
from jaxphys.gaussians import from_points, read_ply
from jaxphys.pipeline.reconstruct import reconstruct
from jaxphys.reconstruction.capture import read_capture, read_picture, turned, upright
from jaxphys.reconstruction.optimise import camera_of, order
from jaxphys.reconstruction.similarity import (
    peak_signal_to_noise,
    photometric,
    structural_similarity,
)
from jaxphys.reconstruction.start import hull, initial_gaussians, room
from jaxphys.render import to_pixels

from .captures import eyes, pictures, write_colmap, write_transforms

COUNT, HELD, SIDE, DISTANCE = 20, 4, 48, 2.5
FEW = {"steps": 150, "splats": 600, "degree": 0}


@pytest.fixture(scope="module")
def thing():
    """A ball with a red and a blue side and a green cap, so that it has a front and a top."""
    random = np.random.default_rng(0)
    points = random.normal(size=(500, 3))
    points *= 0.5 / np.linalg.norm(points, axis=1, keepdims=True)
    colours = np.where(points[:, :1] > 0, [[0.9, 0.2, 0.1]], [[0.1, 0.2, 0.9]])
    colours = np.where(points[:, 2:] > 0.35, [[0.1, 0.8, 0.2]], colours)
    return from_points(points, colours, 0.05)


@pytest.fixture(scope="module")
def shots(thing):
    places = eyes(COUNT, DISTANCE)
    return places, pictures(thing, places, SIDE)


@pytest.fixture(scope="module")
def synthetic(shots, tmp_path_factory):
    folder = tmp_path_factory.mktemp("synthetic")
    write_transforms(folder, *shots, held=HELD)
    return folder


@pytest.fixture(scope="module")
def made(synthetic, tmp_path_factory):
    out = tmp_path_factory.mktemp("made") / "out"
    return out, reconstruct(synthetic, out, **FEW)


def test_held_out_pictures(made):
    """Far better than the hull it starts from, on pictures that it never saw."""
    out, result = made
    assert result["judged_on"] == "held-out pictures" and result["pictures"] == HELD
    assert result["started_from"] == "hull"
    assert result["psnr"] > 20 and result["ssim"] > 0.8
    assert result["gaussians"] == read_ply(out / "gaussians.ply").count <= FEW["splats"]
    assert sorted(p.name for p in out.iterdir() if p.name[0] != ".") == [
        "gaussians.ply", "held_out.png", "result.json", "timing.json",
    ]  # fmt: skip
    sheet = np.asarray(Image.open(out / "held_out.png"), float)
    assert sheet.shape == (2 * SIDE, HELD * SIDE, 3)  # seen above drawn
    seen, drawn = sheet[:SIDE], sheet[SIDE:]
    assert np.abs(seen - drawn).mean() < 0.3 * np.abs(seen - np.roll(drawn, SIDE, axis=1)).mean()


def test_the_object_stands_where_it_stood(made):
    """Its middle at the origin, its radius, and the green cap on top."""
    gaussians = read_ply(made[0] / "gaussians.ply")
    means, colour = np.asarray(gaussians.means), np.asarray(gaussians.harmonics[:, 0])
    np.testing.assert_allclose(np.median(means, axis=0), 0, atol=0.08)
    assert np.quantile(np.linalg.norm(means, axis=1), 0.9) == pytest.approx(0.5, abs=0.08)
    green = colour[:, 1] > colour[:, [0, 2]].max(axis=1) + 0.5
    assert means[green, 2].mean() > 0.3 and means[~green, 2].mean() < 0.2


def test_interrupted_it_ends_in_the_same_bytes(synthetic, made, tmp_path):
    out = tmp_path / "out"

    def stop(step):
        if step == 50:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        reconstruct(synthetic, out, **FEW, watch=stop)
    assert not (out / "gaussians.ply").exists()
    seen = []
    assert reconstruct(synthetic, out, **FEW, watch=seen.append) == made[1]
    assert seen[0] == 51
    assert (out / "gaussians.ply").read_bytes() == (made[0] / "gaussians.ply").read_bytes()


def test_the_command_and_then_a_motion(synthetic, tmp_path, capsys):
    out = tmp_path / "out"
    few = ["--steps", "3", "--splats", "300", "--quiet", "--json"]
    assert run(["reconstruct", str(synthetic), "--out", str(out), *few]) == 0
    assert json.loads(capsys.readouterr().out)["steps"] == 3
    film = ["--set", "domain.spacing=0.15", "--frames", "2", "--width", "64", "--height", "36"]
    assert run(["animate", str(out), "--out", str(tmp_path / "film"), "--quiet", *film]) == 0
    assert (tmp_path / "film" / "motion.mp4").stat().st_size > 0


@pytest.mark.parametrize("binary", [True, False])
def test_colmap(thing, shots, tmp_path, binary):
    """In a world that lies on its side, cameras see points where the pictures show them."""
    places, seen = shots
    turn = Rotation.from_euler("xyz", [90, 20, 10], degrees=True).as_matrix()
    points = np.asarray(thing.means, np.float64)[::10]
    colours = np.clip(np.asarray(thing.harmonics[::10, 0]) * 0.28209479 + 0.5, 0, 1)
    write_colmap(tmp_path, places, seen, points, colours, turn, binary)
    capture = read_capture(tmp_path)
    assert [shot.held_out for shot in capture.shots] == [i % 8 == 0 for i in range(COUNT)]
    np.testing.assert_allclose(capture.points, points @ turn.T, atol=1e-5)
    np.testing.assert_allclose(capture.colours, colours, atol=3e-3)
    stands = turned(capture, upright(capture))
    up = stands.shots[0].rotation[1]
    for shot, place, picture in zip(stands.shots, places, seen, strict=True):
        assert np.linalg.norm(shot.position) == pytest.approx(DISTANCE, rel=1e-6)
        assert shot.position[2] == pytest.approx(place[2], abs=0.35)  # upright, by its cameras
        np.testing.assert_array_equal(read_picture(shot, 400), picture)
        pixels = np.asarray(to_pixels(camera_of(shot, picture), jnp.asarray(stands.points)))
        assert np.all(picture[pixels[:, 1].astype(int), pixels[:, 0].astype(int), 3] > 128)
    assert up.shape == (3,)


def test_a_world_that_says_what_is_up_stays(synthetic):
    np.testing.assert_array_equal(upright(read_capture(synthetic)), np.eye(3))


def test_transforms_are_the_cameras(thing, synthetic, shots):
    capture = read_capture(synthetic)
    assert sum(shot.held_out for shot in capture.shots) == HELD
    for shot, place in zip(capture.shots, shots[0], strict=True):
        np.testing.assert_allclose(shot.position, place, atol=1e-12)
    half = read_picture(capture.shots[0], SIDE // 2)
    assert half.shape == (SIDE // 2, SIDE // 2, 4)
    camera = camera_of(capture.shots[0], half)
    middle = to_pixels(camera, jnp.zeros((1, 3)))
    np.testing.assert_allclose(middle, [[SIDE / 4, SIDE / 4]], atol=1e-4)


def test_hull_of_a_ball(synthetic):
    capture = read_capture(synthetic)
    centre, half = room(capture.shots)
    np.testing.assert_allclose(centre, 0, atol=1e-6)
    assert half == pytest.approx(DISTANCE * np.tan(np.radians(20)), rel=1e-6)
    seen = [read_picture(shot, 400) for shot in capture.shots]
    points, colours = hull(capture.shots, seen, 10_000, 0)
    radius = np.linalg.norm(points, axis=1)
    assert 0.5 < np.median(radius) < 0.6  # with the splats' own size
    front = points[:, 0] > 0.3
    assert np.all(colours[front & (abs(points[:, 2]) < 0.2)][:, 0] > 0.5)
    empty = [np.zeros_like(picture) for picture in seen]
    assert hull(capture.shots, empty, 100, 0) is None


def test_what_is_started_from(synthetic):
    capture = read_capture(synthetic)
    seen = [read_picture(shot, 400) for shot in capture.shots]
    none = np.zeros((0, 3), np.float32)
    options = {"count": 100, "degree": 1, "seed": 0}
    opaque = [np.concatenate([p[..., :3], np.full_like(p[..., 3:], 255)], -1) for p in seen]
    for given, points, source in (
        (seen, none, "hull"),
        (opaque, none, "chance"),
        (seen, np.full((7, 3), 0.1, np.float32), "points"),
    ):
        made, found = initial_gaussians(capture.shots, given, points, points, **options)
        assert found == source and made.count == (7 if len(points) else 100) and made.degree == 1


def test_similarity():
    """Against its definition, window by window, with zeros around the pictures."""
    random = np.random.default_rng(0)
    a, b = random.random((2, 13, 9, 2))
    x = np.arange(11) - 5
    weights = np.exp(-(x[:, None] ** 2 + x**2) / (2 * 1.5**2))
    weights = (weights / weights.sum())[..., None]
    around = ((5, 5), (5, 5), (0, 0))
    every = []
    for i, j in np.ndindex(13, 9):
        p, q = (np.pad(one, around)[i : i + 11, j : j + 11] for one in (a, b))
        mean = lambda one: np.sum(weights * one, axis=(0, 1))  # noqa: E731
        vp, vq = mean(p * p) - mean(p) ** 2, mean(q * q) - mean(q) ** 2
        covariance = mean(p * q) - mean(p) * mean(q)
        above = (2 * mean(p) * mean(q) + 1e-4) * (2 * covariance + 9e-4)
        every.append(above / ((mean(p) ** 2 + mean(q) ** 2 + 1e-4) * (vp + vq + 9e-4)))
    found = jax.jit(structural_similarity)(jnp.asarray(a), jnp.asarray(b))
    np.testing.assert_allclose(found, np.mean(every), rtol=1e-6)
    np.testing.assert_allclose(structural_similarity(jnp.asarray(a), jnp.asarray(a)), 1, rtol=1e-9)
    level = peak_signal_to_noise(jnp.zeros((4, 4, 3)), jnp.full((4, 4, 3), 0.1))
    assert float(level) == pytest.approx(20)  # dB: a tenth off everywhere


def test_slope_of_the_loss():
    random = np.random.default_rng(1)
    a, b, d = (jnp.asarray(random.random((16, 16, 3))) for _ in range(3))
    slope = jax.grad(lambda p: photometric(p, b, 0.2))(a)
    h = 1e-6
    difference = (photometric(a + h * d, b, 0.2) - photometric(a - h * d, b, 0.2)) / (2 * h)
    assert float(jnp.vdot(slope, d)) == pytest.approx(float(difference), rel=1e-5)


def test_every_picture_in_turn():
    turns = order([3, 2], 12, seed=1)
    assert len(turns) == 12
    every = {(0, 0), (0, 1), (0, 2), (1, 0), (1, 1)}
    assert set(turns[:5]) == set(turns[5:10]) == every


def spoiled(source: Path, folder: Path, change) -> Path:
    shutil.copytree(source, folder)
    path = folder / "transforms_train.json"
    told = json.loads(path.read_text())
    change(told)
    path.write_text(json.dumps(told))
    return folder


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (lambda t: t.pop("frames"), r"transforms_train\.json.*frames"),
        (lambda t: t.update(k1=0.1), "distortion"),
        (lambda t: t["frames"][2].update(file_path="nowhere"), r"frames\[2\].file_path.*nowhere"),
        (lambda t: t["frames"][1].pop("transform_matrix"), r"frames\[1\].*transform_matrix"),
        (lambda t: t["frames"][1]["transform_matrix"][0].__setitem__(0, 9.0), "no rotation"),
        (lambda t: t["frames"][1]["transform_matrix"][0].__setitem__(3, float("nan")), "NaN|nan"),
        (lambda t: t.pop("camera_angle_x"), "fl_x"),
        (lambda t: t.update(w=480, h=480), "480 x 480|is 48 x 48"),
    ],
)
def test_what_cannot_be_used(synthetic, tmp_path, change, words):
    folder = spoiled(synthetic, tmp_path / "capture", change)
    if "480" in words:  # the same shape, another size: the cameras are brought to it
        assert read_picture(read_capture(folder).shots[0], 400).shape[0] == SIDE
        return
    with pytest.raises(InputError, match=words):
        reconstruct(folder, tmp_path / "out", **FEW)
    assert not (tmp_path / "out").exists()


def test_what_is_no_capture(tmp_path):
    with pytest.raises(InputError, match="neither transforms"):
        read_capture(tmp_path)
    model = tmp_path / "sparse" / "0"
    model.mkdir(parents=True)
    (model / "cameras.bin").write_bytes(b"\1\0\0\0\0\0\0\0abc")
    (model / "images.bin").write_bytes(b"")
    with pytest.raises(InputError, match=r"cameras\.bin.*cut off"):
        read_capture(tmp_path)


def test_pictures_that_cannot_be_used(synthetic, tmp_path):
    folder = tmp_path / "capture"
    shutil.copytree(synthetic, folder)
    (folder / "transforms_train.json").unlink()
    with pytest.raises(InputError, match="for judging alone"):
        read_capture(folder)
    shot = read_capture(synthetic).shots[0]
    whole = shot.path.read_bytes()
    for name, content, words in (
        ("cut.png", whole[: len(whole) // 2], "cut"),
        ("text.png", b"no picture", "cannot"),
        ("broken.png", whole[:20] + b"\0\0\0\0" + whole[24:], "broken"),
        ("wide.png", None, "is 90 x 48"),
    ):
        path = tmp_path / name
        if content is None:
            Image.new("RGB", (90, SIDE)).save(path)
        else:
            path.write_bytes(content)
        with pytest.raises(InputError, match=words) as caught:
            read_picture(dataclasses.replace(shot, path=path), 400)
        assert str(path) in str(caught.value)
