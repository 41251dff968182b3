"""From a sentence to a video with the published priors, on tiny random checkpoints."""

import json
import shutil

import numpy as np
import pytest
from PIL import Image

from jaxphys.cli.main import run
from jaxphys.core.errors import InputError
from jaxphys.guidance.published.point_e import PointESampling, sample_point_e
from jaxphys.pipeline.generate import generate
from jaxphys.scene import Domain, Object, Scene
from tests import checkpoints

SCENE = Scene(
    objects=(
        Object(parameters={"youngs_modulus": 2e3}, size=0.4, centre=(0.5, 0.5, 0.5), filling=None),
    ),
    domain=Domain((1.0, 1.0, 1.0), 1 / 14),
    frames=2,
    frame_time=0.01,
    width=32,
    height=24,
)
LAYOUTS = ("plain", "sharded", "old", "fp16")


@pytest.fixture(scope="module")
def made(tmp_path_factory):
    """A run with a layout of the same Stable Diffusion, made once."""
    folder = tmp_path_factory.mktemp("runs")

    def run_of(layout):
        if not (folder / layout).exists():
            weights = checkpoints.stable_diffusion(folder / "weights" / layout, layout)
            options = {"prior": str(weights), "refiner": "rules", "steps": 2, "splats": 40}
            generate("a strawberry", SCENE, folder / layout, precision="float32", **options)
        return folder / layout

    return run_of


@pytest.mark.parametrize(
    "layout", ["plain", *(pytest.param(one, marks=pytest.mark.slow) for one in LAYOUTS[1:])]
)
def test_every_layout_reaches_a_video(made, layout):
    out = made(layout)
    assert (out / "motion.mp4").stat().st_size > 0
    known = json.loads((out / "config.json").read_text())["generation"]
    assert known["prior"].endswith(layout) and known["precision"] == "float32"


@pytest.mark.slow
@pytest.mark.parametrize("layout", ["sharded", "old"])
def test_layouts_of_one_checkpoint_make_the_same_object(made, layout):
    name = "gaussians.ply"
    assert (made(layout) / name).read_bytes() == (made("plain") / name).read_bytes()


@pytest.mark.slow
def test_another_checkpoint_makes_another_object(made):
    """What distillation does depends on the weights: half precision moves the last digits."""
    name = "gaussians.ply"
    assert (made("fp16") / name).read_bytes() != (made("plain") / name).read_bytes()


@pytest.mark.slow
def test_point_e_reaches_a_video(tmp_path, monkeypatch):
    monkeypatch.setenv("JAXPHYS_WEIGHTS", str(tmp_path))
    monkeypatch.setitem(sample_point_e.__kwdefaults__, "config", PointESampling(steps=3))
    checkpoints.point_e_files(tmp_path / "point-e")
    checkpoints.clip(tmp_path / "clip-vit-large-patch14")
    checkpoints.point_e_files(tmp_path / "elsewhere", ".safetensors")
    runs = {}
    for name in ("point-e", str(tmp_path / "elsewhere")):
        out = tmp_path / "out" / name.rsplit("/", 1)[-1]
        options = {"shape_prior": name, "refiner": "rules", "steps": 1, "splats": 1100}
        generate("a strawberry", SCENE, out, precision="float32", **options)
        assert (out / "motion.mp4").stat().st_size > 0
        runs[name] = (out / "gaussians.ply").read_bytes()
    assert len(set(runs.values())) == 1


def test_what_is_missing_is_said_before_anything_is_written(tmp_path, monkeypatch):
    monkeypatch.setenv("JAXPHYS_WEIGHTS", str(tmp_path / "weights"))
    for options in ({"prior": "stable-diffusion"}, {"shape_prior": "point-e"}):
        with pytest.raises(InputError, match=r"JAXPHYS_WEIGHTS"):
            generate("a strawberry", SCENE, tmp_path / "out", **options)
    with pytest.raises(InputError, match="no folder and no name"):
        generate("a strawberry", SCENE, tmp_path / "out", prior="stable-difusion")
    broken = checkpoints.stable_diffusion(tmp_path / "broken")
    shutil.rmtree(broken / "vae")
    with pytest.raises(InputError, match="vae"):
        generate("a strawberry", SCENE, tmp_path / "out", prior=str(broken))
    assert not (tmp_path / "out").exists()


def test_image_command_paints(tmp_path):
    folder = checkpoints.stable_diffusion(tmp_path / "weights", prediction="v_prediction")
    pictures = {}
    for name, more in {
        "plain": [],
        "again": [],
        "negative": ["--negative", "a lemon"],
        "ancestral": ["--sampler", "ddpm", "--width", "24"],
    }.items():
        out = tmp_path / f"{name}.png"
        options = ["--prior", str(folder), "--steps", "3", "--out", str(out), *more]
        assert run(["image", "a strawberry", *options]) == 0
        pictures[name] = np.asarray(Image.open(out))
    assert pictures["plain"].shape == (16, 16, 3)
    assert pictures["ancestral"].shape == (16, 24, 3)
    assert (pictures["plain"] == pictures["again"]).all()
    assert (pictures["plain"] != pictures["negative"]).any()


@pytest.mark.parametrize(
    ("more", "said"),
    [
        (["--out", "x.jpg"], "must end in .png"),
        (["--out", "x.png", "--width", "17"], "multiple of 2"),
        (["--out", "x.png", "--steps", "2000"], "1 to 1000"),
        (["--out", "x.png", "--steps", "0"], "at least 1"),
    ],
)
def test_image_command_refuses(tmp_path, capsys, monkeypatch, more, said):
    monkeypatch.chdir(tmp_path)
    folder = checkpoints.stable_diffusion(tmp_path / "weights")
    assert run(["image", "a can", "--prior", str(folder), *more]) == 2
    assert said in capsys.readouterr().err
    assert not list(tmp_path.glob("x.*"))
