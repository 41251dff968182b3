"""The report of made-up lines, of which it is known what they should say."""

import json
import math

import pytest

from benchmarks.report import by_problem, error_of, observed_order, read_lines, write_report
from benchmarks.report_figures import ratios
from benchmarks.report_peers import compared, runs_until_ahead


def line(problem, method, resolution, error, seconds, **more):
    return {
        "suite": "work-precision",
        "case": f"{problem}-{resolution}",
        "method": method,
        "problem": problem,
        "resolution": resolution,
        "expected_order": 2,
        "floor": 0.0,
        "code": 0,
        "error": error,
        "seconds": seconds,
        "samples": [[seconds, 1.1 * seconds, 0.9 * seconds]],
        "compile_seconds": 1.0,
        "peak_bytes": 2**30,
        "machine": {"processor": "a processor", "cores": 2},
        "versions": {"jax": "0.0"},
        "commit": "abc",
        "status": "ok",
        **more,
    }


LINES = [
    *(line("bar", "jaxphys-float64", n, 1.0 / n**2, 0.01 * n) for n in (8, 16, 32)),
    *(line("bar", "jaxphys-pic", n, 1.0 / n, 0.01 * n) for n in (8, 16, 32)),
    *(line("cube", "jaxphys-float64", n, 1.0 / n**2, 0.1 * n) for n in (6, 12)),
    line("cube", "jaxphys-pic", 6, 0.01, 0.1),
    line("cube", "jaxphys-pic", 12, None, 0.2, code=3),
    {"suite": "work-precision", "case": "vortex-8", "method": "jaxphys-float64", "cells": 8,
     "status": "exit 1: out of memory"},
    {"suite": "work-precision", "case": "bar-8", "method": "jaxphys", "peer": "x", "ratio": 2.0},
    line("particle", "jaxphys-float64", 50, 0.01, 0.1),
    line("particle", "genesis", 50, 0.01, 0.2),
    {"suite": "work-precision", "case": "peers", "method": "newton", "status": "newton left out"},
    line("picture", "jaxphys", 240, 1e-3, 0.01),
    line("gradient", "jaxphys", 64, 1e-6, 0.5),
]  # fmt: skip


def test_orders_are_fitted_above_the_floor():
    ladder = [entry for entry in LINES if entry.get("problem") == "bar"][:3]
    assert math.isclose(observed_order(ladder), 2.0)
    assert observed_order(ladder[:2]) is None
    # Where the reference is no better than the two finest errors nothing can be fitted.
    assert observed_order([entry | {"floor": 1 / 300} for entry in ladder]) is None


@pytest.mark.parametrize(
    ("change", "expected"),
    [
        ({}, 0.5),
        ({"code": 2}, math.inf),
        ({"error": None}, math.inf),
        ({"error": math.nan}, math.inf),
    ],
)
def test_a_failed_run_has_an_infinite_error(change, expected):
    assert error_of({"error": 0.5, "code": 0, **change}) == expected


def test_a_profile_compares_with_the_fastest_that_is_as_accurate(tmp_path):
    path = tmp_path / "lines.jsonl"
    path.write_text("".join(json.dumps(entry) + "\n" for entry in LINES))
    problems = by_problem(read_lines(path))
    found = ratios({name: problems[name] for name in ("bar", "cube")})
    # PIC on 16 cells is as accurate as float64 on 8, which is twice as fast.
    assert found["jaxphys-pic"][:3] == [1.0, 2.0, 4.0]
    assert found["jaxphys-pic"][3:] == [1.0, math.inf]
    assert found["jaxphys-float64"][:3] == [1.0, 1.0, 1.0]
    # Of the cube PIC on 6 cells is better than float64 on 6, and as good as it on 12.
    assert found["jaxphys-float64"][3] == pytest.approx(6.0)


def test_a_peer_is_met_by_the_fastest_default_that_is_as_accurate():
    problem = {
        "jaxphys-float64": [line("bar", "jaxphys-float64", n, 1 / n**2, 0.01 * n) for n in (8, 16)],
        "jaxphys": [line("bar", "jaxphys", 8, 0.1, 0.001)],
        "jaxphys-pic": [line("bar", "jaxphys-pic", 8, 1e-9, 1e-9)],  # is no default
        "genesis": [line("bar", "genesis", 8, 1 / 64, 0.1), line("bar", "genesis", 64, 1e-4, 0.2)],
        "newton": [line("bar", "newton", 8, 0.2, 0.5), line("bar", "newton", 16, None, 0.5)],
    }
    found = [
        (one["method"], best and best["seconds"]) for _, one, best in compared({"bar": problem})
    ]
    assert found == [("genesis", 0.08), ("genesis", None), ("newton", 0.001)]


@pytest.mark.parametrize(
    ("ours", "theirs", "runs"),
    [
        ((1.0, 0.1), (2.0, 0.2), 1),
        ((5.0, 0.1), (0.0, 1.1), 5),  # 5 + 5 * 0.1 = 5.5 = 5 * 1.1
        ((5.1, 0.1), (0.0, 1.1), 6),
        ((5.0, 0.2), (0.0, 0.1), math.inf),
        ((5.0, 0.2), (None, 0.3), None),
    ],
)
def test_compiling_pays_from_some_run_on(ours, theirs, runs):
    one, other = (dict(zip(("compile_seconds", "seconds"), x, strict=True)) for x in (ours, theirs))
    assert runs_until_ahead(one, other) == runs


def test_the_report_is_made_of_lines_alone_and_is_the_same_again(tmp_path):
    pytest.importorskip("matplotlib")
    folder = tmp_path / "lines"
    folder.mkdir()
    path = folder / "work-precision.jsonl"
    path.write_text("".join(json.dumps(entry) + "\n" for entry in LINES))
    out = tmp_path / "docs"
    write_report(folder, out)
    page = (out / "README.md").read_text()
    assert "a processor, 2 cores, jax 0.0, commit abc" in page
    assert "| bar | 8, 16, 32 | 1.6e-02, 3.9e-03, 9.8e-04 | exact | 2 | 2.00 |" in page
    assert "out of memory" in page and "failed" in page
    assert "On 1 of the 1 problems that a peer can state" in page
    assert "| genesis | 1.0e-02, 0.2 s |" in page and "newton left out" not in page
    before = {one.name: one.read_bytes() for one in out.iterdir()}
    assert set(before) == {"README.md", "error-time.svg", "variants.svg", "profile.svg"}
    write_report(folder, out)
    assert {one.name: one.read_bytes() for one in out.iterdir()} == before


def test_what_parts_cost(tmp_path):
    """The ratio of the lines, with its spread; parts without lines are named, not left out."""
    from benchmarks.report_leave_out import leave_out_page

    def of(part, method, compiled, peak):
        return {
            "suite": "leave-out", "case": part, "method": method, "status": "ok", "cells": 20,
            "compile_seconds": compiled, "peak_bytes": peak,
            "machine": {"processor": "a processor"},
        }  # fmt: skip

    lines = [
        of("walls", "jaxphys", 3.0, 120), of("walls", "smallest", 2.0, 100),
        {"suite": "leave-out", "case": "walls", "method": "jaxphys", "cost": 1.254,
         "cost_low": 1.2, "cost_high": 1.3},
        {**of("ball", "jaxphys", 1.0, 1), "status": "exit 1"}, of("ball", "smallest", 2.0, 100),
    ]  # fmt: skip
    path = tmp_path / "leave-out.jsonl"
    path.write_text("".join(json.dumps(one) + "\n" for one in lines))
    page = leave_out_page(path, ["walls", "ball", "gradient"])
    assert "| walls | 1.25 (1.20 to 1.30) | 1.50 | 1.20 |" in page
    assert "Not measured yet: ball, gradient." in page
    assert "64,000 neo-Hookean particles" in page and "(a processor)" in page
