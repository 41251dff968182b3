"""`jaxphys splat` and `jaxphys render`: what they write, and that nothing is left of a failure."""

import numpy as np
import pytest
from PIL import Image

from jaxphys.cli.main import run
from jaxphys.gaussians.ply import read_ply

WHITE = (255, 255, 255)
# Of the two halves of the texture, hence of the box: its -x half is red, its +x half blue.
RED, BLUE = (220, 20, 20), (20, 20, 220)


def write_box(folder):
    """A textured .obj of a box 1 x 2 x 0.6 (y up), red where x < 0 and blue where x > 0."""
    picture = np.empty((8, 64, 3), np.uint8)
    picture[:, :32], picture[:, 32:] = RED, BLUE
    Image.fromarray(picture).save(folder / "paint.png")
    (folder / "box.mtl").write_text("newmtl paint\nKd 1 1 1\nmap_Kd paint.png\n")
    corners = [(x, y, z) for x in (-0.5, 0.5) for y in (-1, 1) for z in (-0.3, 0.3)]
    lines = ["mtllib box.mtl", "usemtl paint"]
    lines += [f"v {x} {y} {z}" for x, y, z in corners]
    # Not to the edges: textures repeat, and values between texels would mix the two colours.
    lines += [f"vt {0.5 + 0.8 * x} 0.5" for x, _, _ in corners]
    quads = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
    lines += ["f " + " ".join(f"{i + 1}/{i + 1}" for i in quad) for quad in quads]
    path = folder / "box.obj"
    path.write_text("\n".join(lines) + "\n")
    return path


@pytest.fixture(scope="module")
def box(tmp_path_factory):
    """The mesh and the splats that the command makes of it."""
    folder = tmp_path_factory.mktemp("box")
    mesh, out = write_box(folder), folder / "box.ply"
    assert run(["splat", str(mesh), "--out", str(out), "--count", "1500", "--seed", "3"]) == 0
    return mesh, out


def draw(file, out, *options):
    """Runs the command on small pictures."""
    size = ["--width", "64", "--height", "48"]
    return run(["render", str(file), "--out", str(out), "--overwrite", *size, *options])


def picture(path):
    """Pixels (H, W, 3) as numbers that can be subtracted."""
    return np.asarray(Image.open(path)).astype(int)


def close(pixels, colour, within=40):
    """Which pixels are about of this colour."""
    return np.abs(pixels - np.asarray(colour)).max(axis=-1) <= within


def test_splats_have_the_mesh_s_shape_count_and_colours(box):
    gaussians = read_ply(box[1])
    means = np.asarray(gaussians.means)
    assert len(means) == 1500
    # y-up files are turned: their height is z.
    np.testing.assert_allclose(np.ptp(means, axis=0), [1.0, 0.6, 2.0], atol=0.06)
    dc = np.asarray(gaussians.harmonics[:, 0])
    clear = np.abs(means[:, 0]) > 0.1
    assert ((dc[:, 0] > dc[:, 2]) == (means[:, 0] < 0))[clear].all()


def test_the_same_seed_writes_the_same_bytes(box, tmp_path):
    mesh, splats = box
    for name, seed in (("a.ply", "3"), ("b.ply", "4")):
        out = tmp_path / name
        assert run(["splat", str(mesh), "--out", str(out), "--count", "1500", "--seed", seed]) == 0
    assert (tmp_path / "a.ply").read_bytes() == splats.read_bytes()
    assert (tmp_path / "b.ply").read_bytes() != splats.read_bytes()


def test_a_glb_and_the_viewers_format(tmp_path):
    import trimesh

    ball = trimesh.creation.icosphere(subdivisions=2)
    ball.visual.vertex_colors = (20, 200, 20, 255)
    ball.export(tmp_path / "ball.glb")
    out = tmp_path / "new" / "ball.splat"
    assert run(["splat", str(tmp_path / "ball.glb"), "--out", str(out), "--count", "300"]) == 0
    assert out.stat().st_size == 300 * 32
    assert [path.name for path in out.parent.iterdir()] == ["ball.splat"]


def test_one_picture_shows_the_object_on_its_background(box, tmp_path):
    out = tmp_path / "box.png"
    # From -y, hence red on the left and blue on the right.
    assert draw(box[1], out, "--azimuth", "-90", "--elevation", "0") == 0
    pixels = picture(out)
    assert pixels.shape == (48, 64, 3)
    assert close(pixels[20:28, 22:30], RED).all() and close(pixels[20:28, 34:42], BLUE).all()
    corners = pixels[[0, 0, -1, -1], [0, -1, 0, -1]]
    np.testing.assert_array_equal(corners, np.broadcast_to(WHITE, (4, 3)))
    # Control: from behind left and right change places.
    assert draw(box[1], out, "--azimuth", "90", "--elevation", "0") == 0
    assert close(picture(out)[20:28, 22:30], BLUE).all()


def test_camera_options_do_what_they_say(box, tmp_path):
    def seen(*options, background=WHITE):
        out = tmp_path / "box.png"
        assert draw(box[1], out, "--azimuth", "-90", "--elevation", "0", *options) == 0
        return ~close(picture(out), background, within=8)

    near, far = seen("--distance", "4"), seen("--distance", "8")
    wide = seen("--distance", "4", "--field-of-view", "70")
    assert 3 < near.sum() / far.sum() < 6
    assert wide.sum() < 0.5 * near.sum()
    # From the front the box is 2 high, from above 0.6 deep.
    above = seen("--distance", "4", "--elevation", "89")
    assert np.ptp(np.nonzero(above)[0]) < 0.6 * np.ptp(np.nonzero(near)[0])
    green = seen("--distance", "4", "--background", "0", "1", "0", background=(0, 255, 0))
    assert (green == near).mean() > 0.97


def test_a_turn_shows_every_side(box, tmp_path):
    out = tmp_path / "turn"
    assert draw(box[1], out, "--azimuth", "-90", "--elevation", "0", "--views", "4") == 0
    assert sorted(path.name for path in out.glob("*.png")) == [f"{i:04d}.png" for i in range(4)]
    views = [picture(out / f"{i:04d}.png") for i in range(4)]
    share = [(close(view, RED).sum(), close(view, BLUE).sum()) for view in views]
    # Front, +x, back, -x: both halves, blue alone, both, red alone.
    assert min(share[0]) > 100 and min(share[2]) > 100
    assert share[1][1] > 100 > 5 > share[1][0] and share[3][0] > 100 > 5 > share[3][1]
    for i in range(4):
        assert np.abs(views[i] - views[i - 1]).max() > 100


@pytest.mark.parametrize("stage", ["splat", "render"])
def test_a_failure_while_writing_leaves_nothing(box, tmp_path, monkeypatch, capsys, stage):
    def fail(*_):
        raise OSError(28, "No space left on device", "out")

    monkeypatch.setattr("os.replace", fail)
    out = tmp_path / "out"
    if stage == "splat":
        status = run(["splat", str(box[0]), "--out", str(out / "a.ply"), "--count", "50"])
    else:
        status = draw(box[1], out / "a.png")
    assert status == 2 and capsys.readouterr().err == "jaxphys: out: No space left on device\n"
    assert not any(out.iterdir())


def test_a_failure_keeps_what_was_there(box, tmp_path, capsys):
    for name, command in (("a.ply", "splat"), ("a.png", "render")):
        (tmp_path / name).write_bytes(b"before")
        (tmp_path / "broken.ply").write_bytes(b"ply\n")
        broken, out = str(tmp_path / "broken.ply"), str(tmp_path / name)
        assert run([command, broken, "--out", out, "--overwrite"]) == 2
        assert "broken.ply" in capsys.readouterr().err
        assert (tmp_path / name).read_bytes() == b"before"
