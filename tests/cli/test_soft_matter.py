"""Matter so soft that its own weight presses it flat, and what its error tells to do."""

import json
from pathlib import Path

import pytest

from jaxphys.cli.main import run

BALL = Path(__file__).parents[1] / "data" / "ball.ply"
FRAMES = 48


def animated(out: Path, *settings: str) -> int:
    """Exit status of jelly at E = 100 Pa, which weighs some 1000 Pa on its underside."""
    words = ["animate", str(BALL), "--out", str(out), "--quiet", "--frames", str(FRAMES)]
    small = ("youngs_modulus=100", "domain.spacing=0.125", "width=32", "height=32")
    for setting in (*small, *settings):
        words += ["--set", setting]
    return run(words)


@pytest.mark.slow
def test_what_its_weight_presses_flat_needs_the_law_and_the_floor_that_the_errors_name(
    tmp_path, capsys
):
    nodes, law = "boundaries.0.acts_on=nodes", "law=neo-Hookean"
    # The floor's contact is no stiffer than the matter: it sinks through.
    assert animated(tmp_path / "sinks", law) == 2
    assert "left the grid" in (told := capsys.readouterr().err) and "acts_on" in told
    assert animated(tmp_path / "collapses", nodes) == 2
    assert "thousandth" in (told := capsys.readouterr().err) and f"--set {law}" in told
    assert animated(tmp_path / "holds", nodes, law) == 0
    lines = (tmp_path / "holds" / "metrics.jsonl").read_text().splitlines()
    frames = [json.loads(line) for line in lines]
    assert frames[-1]["frame"] == FRAMES - 1
    first, last = (one["highest"][2] - one["lowest"][2] for one in (frames[0], frames[-1]))
    assert last < 0.5 * first and frames[-1]["fastest"] < 0.5  # squashed, and at rest
    # The floor is at 0.25 m; nodes hold matter to within a cell.
    assert frames[-1]["lowest"][2] > 0.25 - 0.125
