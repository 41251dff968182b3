"""docs/materials.md: its tables are those of the declarations, and its example runs as printed."""

import re
import shutil
from pathlib import Path

import jax.numpy as jnp

from jaxphys.cli.listing import materials_markdown
from jaxphys.mpm import MATERIALS
from jaxphys.mpm.materials import catalogue

ROOT = Path(__file__).parents[2]
TEXT = (ROOT / "docs" / "materials.md").read_text()


def test_the_tables_are_what_is_declared():
    assert materials_markdown() in TEXT


def test_the_example_runs(tmp_path, monkeypatch):
    shutil.copy(ROOT / "tests" / "data" / "ball.ply", tmp_path / "ball.ply")
    monkeypatch.chdir(tmp_path)
    before, names = dict(catalogue._materials), {}
    try:
        for block in re.findall(r"```python\n(.*?)```", TEXT, re.DOTALL):
            exec(compile(block, "materials.md", "exec"), names)
        assert {"gum", "clay"} <= set(MATERIALS)
    finally:
        catalogue._materials.clear()
        catalogue._materials.update(before)
    places = names["motion"].position
    # It falls: 1 m/s for two pictures at 24 a second, and a little faster.
    fallen = float(jnp.mean(places[0, :, 2] - places[-1, :, 2]))
    assert 2 / 24 < fallen < 2 / 24 + 0.05
