"""What users get wrong is answered with one line, status 2, and nothing on the disk."""

import json
import subprocess
import sys
import tracemalloc

import numpy as np
import pytest

from jaxphys.cli.main import run
from jaxphys.gaussians.gaussians import from_points
from jaxphys.gaussians.ply import write_ply


@pytest.fixture
def ball(tmp_path):
    points = np.random.default_rng(0).normal(size=(50, 3)).astype(np.float32)
    write_ply(tmp_path / "ball.ply", from_points(points, np.full(3, 0.5), 0.1))
    return tmp_path / "ball.ply"


def refused(capsys, out, *arguments):
    """The one line that a command with these arguments is refused with."""
    assert run([*map(str, arguments)]) == 2
    lines = capsys.readouterr().err.strip().splitlines()
    assert len(lines) == 1 and lines[0].startswith("jaxphys: ")
    assert not out.exists() or not any(out.iterdir())
    return lines[0]


@pytest.fixture
def animate(capsys, tmp_path):
    out = tmp_path / "out"
    return lambda *arguments: refused(capsys, out, "animate", *arguments, "--out", out)


def config(tmp_path, value):
    path = tmp_path / "scene.json"
    path.write_text(json.dumps(value))
    return path


def test_unknown_material(animate, ball):
    assert "'jelly'" in animate(ball, "--material", "jely")


@pytest.mark.parametrize("name", ["none.ply", "none.glb", "ball.txt", "folder"])
def test_missing_or_foreign_object(animate, tmp_path, name):
    if name == "ball.txt":
        (tmp_path / name).write_text("hello")
    if name == "folder":
        (tmp_path / name).mkdir()
    assert name in animate(tmp_path / name, "--material", "jelly")


def test_no_object_at_all(animate):
    assert "OBJECT" in animate("--material", "jelly")


@pytest.mark.parametrize("content", [b"", b"ply\n", b"solid x", b"\x00" * 100])
def test_broken_splats(animate, tmp_path, content):
    (tmp_path / "x.ply").write_bytes(content)
    assert "x.ply" in animate(tmp_path / "x.ply", "--material", "jelly")


def test_truncated_splats(animate, ball):
    ball.write_bytes(ball.read_bytes()[:-100])
    assert "ball.ply" in animate(ball, "--material", "jelly")


@pytest.mark.parametrize(
    ("parameters", "words"),
    [
        ({"youngs_modulus": 0}, ["youngs_modulus", "> 0"]),
        ({"youngs_modulus": -1e5}, ["youngs_modulus", "> 0"]),
        ({"poisson_ratio": 0.5}, ["poisson_ratio", "-1", "0.5"]),
        ({"density": -2}, ["density", "> 0"]),
        ({"yeld_stress": 1}, ["yeld_stress"]),
    ],
)
def test_parameters_out_of_range(animate, ball, tmp_path, parameters, words):
    line = animate(ball, "--config", config(tmp_path, {"objects": [{"parameters": parameters}]}))
    assert "objects[0].parameters" in line
    assert all(word in line for word in words)


@pytest.mark.parametrize(
    ("thing", "words"),
    [
        ({"centre": [9, 0, 0]}, ["objects[0]", "domain"]),
        ({"size": 90}, ["objects[0]", "domain"]),
        ({"opacity_threshold": 1.0}, ["opacity_threshold"]),
        ({"area": [50, 51, 50, 51, 50, 51]}, ["area"]),
        ({"rotation": [{"axis": [0, 0, 0], "degrees": 3}]}, ["rotation[0].axis"]),
    ],
)
def test_objects_that_do_not_fit(animate, ball, tmp_path, thing, words):
    thing = {"filling": None} | thing
    line = animate(ball, "--config", config(tmp_path, {"objects": [thing]}))
    assert all(word in line for word in words)


def test_unstable_substep_names_the_largest_safe_one(animate, ball, tmp_path):
    scene = config(tmp_path, {"objects": [{"filling": None}]})
    assert "largest safe" in animate(ball, "--config", scene, "--substep", "1.0")


def test_numbers_of_the_command_line(animate, ball):
    assert "--frames" in animate(ball, "--frames", "0")
    assert "--width" in animate(ball, "--width", "1000000")
    assert "--splats" in animate(ball, "--splats", "-3")


def test_out_is_a_file(capsys, ball, tmp_path):
    scene = config(tmp_path, {"objects": [{"filling": None}]})
    before = ball.read_bytes()
    assert run(["animate", str(ball), "--config", str(scene), "--out", str(ball)]) == 2
    assert "is a file" in capsys.readouterr().err
    assert ball.read_bytes() == before


def header(count, style="binary_little_endian", before=""):
    """The header of a .ply of `count` splats of degree 0."""
    names = ["x", "y", "z", "f_dc_0", "f_dc_1", "f_dc_2", "opacity"]
    names += [f"scale_{i}" for i in range(3)] + [f"rot_{i}" for i in range(4)]
    text = f"ply\nformat {style} 1.0\n{before}element vertex {count}\n"
    return (text + "".join(f"property float {name}\n" for name in names) + "end_header\n").encode()


HUGE = 8 * 2**30


@pytest.mark.parametrize(
    ("content", "length", "words"),
    [
        pytest.param(header(10**12), None, "limit", id="a-million-million"),
        pytest.param(header(10**12, "ascii"), None, "limit", id="a-million-million-lines"),
        pytest.param(header(19_999_999), None, "cut off", id="more-than-there-is"),
        pytest.param(header(10**5, "ascii"), HUGE, "a line of", id="one-endless-line"),
        pytest.param(header(3), HUGE, "bytes more", id="gigabytes-of-nothing-after"),
        pytest.param(
            header(19_999_999).replace(b" float ", b" double ").replace(b"x\n", b"x\n" + b"".join(
                b"property double other_%d\n" % i for i in range(60))),
            19_999_999 * 74 * 8 + 10**6, "GiB", id="gigabytes-as-promised",
        ),
        pytest.param(
            header(3, before="element odd 999999999999\nproperty double a\n"), None, "cut off",
            id="endless-element-before",
        ),
        pytest.param(
            header(3, "ascii", before="element odd 999999999999\nproperty double a\n"), None,
            "cut off", id="endless-lines-before",
        ),
        pytest.param(header("9" * 4000), None, "is not known", id="count-of-4000-digits"),
        pytest.param(b"\0" * 9, HUGE, "not a .ply", id="gigabytes-of-zeros"),
        pytest.param(b"\x89PNG\r\n\x1a\n" + b"\0" * 99, None, "not a .ply", id="picture"),
    ],
)  # fmt: skip
def test_enormous_and_foreign_splats_are_not_read_into_memory(
    capsys, tmp_path, content, length, words
):
    path = tmp_path / "x.ply"
    with open(path, "wb") as file:
        file.write(content)
        file.truncate(length)
    tracemalloc.start()
    line = refused(capsys, tmp_path / "a", "render", path, "--out", tmp_path / "a" / "a.png")
    used = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert "x.ply" in line and words in line
    assert len(line) < 400 + len(str(path))
    assert used < 64 * 2**20


TETRAHEDRON = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\n"


@pytest.mark.parametrize(
    ("name", "content", "words"),
    [
        ("far.obj", TETRAHEDRON + "f 1 2 999999999\nf 1 2 4\n", ""),
        ("next.obj", TETRAHEDRON + "f 1 2 5\nf 1 2 4\n", ""),
        ("beyond.obj", TETRAHEDRON + "f 1 2 99999999999999999999999\n", ""),
        ("far.off", "OFF\n4 1 0\n0 0 0\n1 0 0\n0 1 0\n0 0 1\n3 0 1 999999999\n", ""),
        ("below.off", "OFF\n4 1 0\n0 0 0\n1 0 0\n0 1 0\n0 0 1\n3 0 1 -2\n", ""),
        ("nan.obj", TETRAHEDRON.replace("1 0 0", "nan 0 0") + "f 1 2 3\nf 1 2 4\n", "not finite"),
        ("infinite.obj", TETRAHEDRON.replace("v 1", "v inf") + "f 1 2 3\nf 1 2 4\n", "not finite"),
        ("line.obj", TETRAHEDRON + "f 1 1 2\nf 3 3 4\nf 2 2 2\n", "zero area"),
        ("flat.obj", TETRAHEDRON + "f 1 2 3\n", "flat"),
        ("many.stl", b"\0" * 80 + b"\xff" * 4 + b"\0" * 50, ""),
        ("cut.stl", b"\0" * 80 + b"\x02\0\0\0" + b"\0" * 50, ""),
        ("cut.glb", b"glTF\x02\0\0\0\xff\xff\xff\xff" + b"\xff\xff\xff\x7fJSON{}", ""),
        ("picture.glb", b"\x89PNG\r\n\x1a\n" + b"\0" * 99, ""),
    ],
)
def test_broken_meshes(capsys, tmp_path, name, content, words):
    path = tmp_path / name
    path.write_bytes(content if isinstance(content, bytes) else content.encode())
    line = refused(capsys, tmp_path / "a", "splat", path, "--out", tmp_path / "a" / "a.ply")
    assert name in line and words in line


def test_broken_texture(capsys, tmp_path):
    (tmp_path / "a.png").write_bytes(b"\x89PNG\r\n\x1a\n" + b"\0" * 99)
    (tmp_path / "a.mtl").write_text("newmtl a\nmap_Kd a.png\n")
    faces = "vt 0 0\nf 1/1 2/1 3/1\nf 1/1 2/1 4/1\n"
    (tmp_path / "a.obj").write_text("mtllib a.mtl\nusemtl a\n" + TETRAHEDRON + faces)
    out = tmp_path / "a"
    assert "a.png" in refused(capsys, out, "splat", tmp_path / "a.obj", "--out", out / "a.ply")


@pytest.mark.parametrize("name", ["x.obj", "x.glb", "x.stl"])
def test_enormous_meshes_are_refused_by_their_size(capsys, tmp_path, name):
    with open(tmp_path / name, "wb") as file:
        file.truncate(HUGE)
    out = tmp_path / "a"
    line = refused(capsys, out, "splat", tmp_path / name, "--out", out / "a.ply")
    assert name in line and "8.0 GiB" in line


def test_unknown_key_of_a_config_names_the_nearest(animate, ball, tmp_path):
    line = animate(ball, "--config", config(tmp_path, {"fraems": 3}))
    assert "scene.json" in line and "did you mean 'frames'" in line
    line = animate(ball, "--config", config(tmp_path, {"objects": [{"materail": "sand"}]}))
    assert "objects[0]" in line and "did you mean 'material'" in line


def test_out_that_cannot_be_written(capsys, ball, tmp_path):
    blocked = tmp_path / "file"
    blocked.write_text("x")
    assert run(["render", str(ball), "--out", str(blocked / "a.png")]) == 2
    lines = capsys.readouterr().err.splitlines()
    assert len(lines) == 1 and str(blocked) in lines[0]


def test_other_commands(capsys, tmp_path, ball):
    out = tmp_path / "out"
    assert "none.glb" in refused(
        capsys, out, "splat", tmp_path / "none.glb", "--out", tmp_path / "a.ply"
    )
    assert ".ply or .splat" in refused(capsys, out, "splat", ball, "--out", tmp_path / "a.glb")
    assert "none.ply" in refused(
        capsys, out, "render", tmp_path / "none.ply", "--out", tmp_path / "a.png"
    )
    assert "--views" in refused(capsys, out, "render", ball, "--out", out, "--views", "0")
    assert "prompt" in refused(capsys, out, "generate", "  ", "--out", out)
    assert "none.json" in refused(capsys, out, "plan", tmp_path / "none.json")
    assert not (tmp_path / "a.ply").exists() and not (tmp_path / "a.png").exists()


def test_the_command_itself_prints_no_traceback(tmp_path):
    command = [sys.executable, "-m", "jaxphys", "plan", str(tmp_path / "none.json")]
    done = subprocess.run(command, capture_output=True, text=True)
    assert done.returncode == 2
    assert done.stderr.count("\n") == 1 and "none.json: no such file" in done.stderr
