"""Experiments with fits: one tiny case through the command, and what counts as covered or right."""

import json

import numpy as np
import pytest

from experiments import lines
from experiments.fitting import coverage, held_out, kill, laws, published
from experiments.fitting.__main__ import main
from jaxphys.fitting import Uncertainty


@pytest.mark.slow
def test_a_case_runs_once_and_its_table_is_made(tmp_path, capsys):
    """The trophy, of 68 particles: near, and not run again when it is there."""
    out = tmp_path / "lines.jsonl"
    arguments = ["published", "--out", str(out), "--quick", "--only", "trophy"]
    main(arguments)
    with out.open("a") as file:
        file.write('{"case": "half wri')  # as a kill leaves it
    main(arguments)
    (line,) = lines.read(out)
    assert line["status"] == "ok" and line["case"] == "trophy, tracks"
    assert abs(line["errors"]["friction_angle"]) < 2 and line["velocity_error"] < 0.01
    assert line["misfit"] < 2 * line["noise"] < line["misfit_still"]
    capsys.readouterr()
    main(["published", "--table", str(out)])
    assert "| trophy | tracks | `friction_angle` | 40 | 10 |" in capsys.readouterr().out


def test_a_case_that_fails_is_told_and_the_next_one_runs(tmp_path):
    from jaxphys.core.errors import InputError

    def broken():
        raise InputError("no such thing")

    lines.run({"a": broken, "b": lambda: {"x": 1}}, tmp_path / "lines.jsonl")
    first, second = lines.read(tmp_path / "lines.jsonl")
    assert first["status"] == "failed" and first["reason"] == "no such thing"
    assert second["status"] == "ok" and second["x"] == 1


def sure(low: float, high: float) -> Uncertainty:
    ends = np.array([low]), np.array([high])
    one = np.array([0.0])
    return Uncertainty(("x",), one, *ends, 0.9, one, one[None], 10.0, ())


def test_coverage_counts_what_intervals_hold():
    """Negative control: of intervals a quarter as wide as they should be, few hold the truth."""
    random = np.random.default_rng(0)
    found = random.normal(size=2000)

    def counted(half: float) -> float:
        rows = [{"held": coverage.held(sure(x - half, x + half), {"x": 0.0})} for x in found]
        kept, of = coverage.share(rows, "x")
        return kept / of

    assert counted(1.645) == pytest.approx(0.9, abs=0.02)
    assert counted(1.645 / 4) == pytest.approx(0.319, abs=0.03)
    assert coverage.held(sure(1.0, 2.0), {"x": 2.5}) == {"x": False}


def test_errors_are_decades_or_differences():
    assert published.error_of("viscosity", 2e3, 200.0) == pytest.approx(1)
    assert published.error_of("poisson_ratio", 0.25, 0.3) == pytest.approx(-0.05)


def test_a_fit_succeeds_by_what_it_calls_determined():
    line = {
        "errors": {"viscosity": 0.5},
        "intervals": {"viscosity": {"determined": False}},
        "velocity_error": 0.01,
        "misfit": 5e-4,
        "noise": 5e-4,
    }
    assert held_out.succeeded(line)
    assert not held_out.succeeded(line | {"intervals": {"viscosity": {"determined": True}}})
    assert not held_out.succeeded(line | {"misfit": 8e-4})
    assert not held_out.succeeded(line | {"velocity_error": 0.06})


def test_draws_are_the_same_for_the_same_seed_and_even_over_laws():
    draws = held_out.drawn()
    assert draws == held_out.drawn() and draws != held_out.drawn(seed=1)
    assert [d.law for d in draws].count("sand") == 3


def test_the_law_is_chosen_by_later_frames():
    """The fluid fits what it saw a little better and what came later far worse."""
    row = {"status": "ok", "true": "elastic", "held_out_still": 0.1}
    made = [
        row | {"law": "elastic", "misfit": 1.1e-3, "held_out": 1e-3},
        row | {"law": "fluid", "misfit": 1.0e-3, "held_out": 5e-2},
    ]
    text = laws.table(made)
    assert "by the fit error: 0 of 1; by the held-out frames: 1 of 1" in text
    assert "**1.10 / 1.00**" in text


@pytest.mark.slow
def test_a_fit_killed_ten_times_ends_in_the_same_bytes():
    line = kill.case(kills=10, cells=4)
    assert line["kills"] >= 5 and line["differ"] == []
    assert {"result.json", "values.npz", "history.jsonl"} <= set(line["files"])


def test_a_file_that_differs_would_be_seen(tmp_path):
    (tmp_path / "result.json").write_text(json.dumps(1))
    (tmp_path / ".book").mkdir()
    (tmp_path / ".book" / "keeping").write_text("x")
    assert kill.files_of(tmp_path) == {"result.json": b"1"}
