"""The examples of the README run as they are printed there."""

import re
import shutil
from pathlib import Path

import imageio.v3
import jax
import jax.numpy as jnp
import numpy as np
import pytest

import jaxphys

ROOT = Path(__file__).parents[2]


@pytest.fixture
def run(tmp_path, monkeypatch):
    """Runs the README's block that holds a word, beside a ball; returns its names."""
    shutil.copy(ROOT / "tests" / "data" / "ball.ply", tmp_path / "ball.ply")
    monkeypatch.chdir(tmp_path)

    def block(word):
        blocks = re.findall(r"```python\n(.*?)```", (ROOT / "README.md").read_text(), re.DOTALL)
        (example,) = [block for block in blocks if word in block]
        names = {}
        exec(compile(example, "README.md", "exec"), names)
        return names

    return block


def test_library_example(run):
    names = run("jax.grad")
    by_young, by_velocity = names["by_young"], names["by_velocity"]
    assert jnp.isfinite(by_young) and jnp.isfinite(by_velocity).all() and abs(by_young) > 1e-10
    assert by_young.shape == () and by_velocity.shape == (3,)


@pytest.mark.filterwarnings("ignore::pytest.PytestUnraisableExceptionWarning")  # of imageio
@pytest.mark.slow
def test_from_a_video_to_a_material(run):
    """The film is written here, by a throw that the example does not know."""
    scene = jaxphys.default_scene("jelly", spacing=0.15)
    simulation, look = jaxphys.build(scene, jaxphys.load("ball.ply"))
    thrown = simulation.with_(youngs_modulus=2.5e4, velocity=(0.4, 0.2, -2.0))
    motion = jax.jit(lambda thrown: jaxphys.rollout_frames(thrown, 9))(thrown)
    motion.check()
    camera = jaxphys.orbit((1.25, 1.25, 0.8), 3.0, -1.0, 0.2, width=64, height=48)
    options = {"background": 1.0, "capacity": 1 << 16}
    pictures = [jaxphys.draw(look, motion[t], camera, **options) for t in range(9)]
    assert not any(bool(picture.overflow) for picture in pictures)
    colours = np.clip([np.asarray(picture.colour) for picture in pictures], 0, 1)
    imageio.v3.imwrite(
        "thrown.mp4",
        (255 * colours + 0.5).astype(np.uint8),
        plugin="FFMPEG",
        fps=24,
        macro_block_size=1,
        output_params=["-crf", "10"],
    )
    fit = run("Images(")["fit"]
    assert fit.values["youngs_modulus"] == pytest.approx(2.5e4, rel=0.03)
    np.testing.assert_allclose(fit.values["velocity"], [0.4, 0.2, -2.0], atol=0.03)
    low, high = fit.uncertainty["youngs_modulus"]
    assert low < fit.values["youngs_modulus"] < high < 1.05 * low
