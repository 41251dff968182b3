"""The library example of the README runs as it is printed there."""

import re
import shutil
from pathlib import Path

import jax.numpy as jnp

ROOT = Path(__file__).parents[2]


def test_library_example(tmp_path, monkeypatch):
    blocks = re.findall(r"```python\n(.*?)```", (ROOT / "README.md").read_text(), re.DOTALL)
    (example,) = [block for block in blocks if "jaxphys.build" in block]
    shutil.copy(ROOT / "tests" / "data" / "ball.ply", tmp_path / "ball.ply")
    monkeypatch.chdir(tmp_path)
    names = {}
    exec(compile(example, "README.md", "exec"), names)
    by_young, by_velocity = names["by_young"], names["by_velocity"]
    assert jnp.isfinite(by_young) and jnp.isfinite(by_velocity).all() and abs(by_young) > 1e-10
    assert by_young.shape == () and by_velocity.shape == (3,)
