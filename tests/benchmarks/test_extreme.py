"""The catalogue of extreme cases: its fast cells, its controls, and its size."""

import json

import pytest

from benchmarks.extreme import catalogue
from benchmarks.extreme.case import REFUSED, RIGHT, WRONG, Case, Cell, Measure, judged, line_of
from benchmarks.extreme.lone import STRESSES, march
from benchmarks.extreme.table import table
from jaxphys.core.errors import InputError

CASES = catalogue()
# One dtype: a program for each takes longer than all its cases.
FAST = ("adaptive float64", "picture float32", "gradient float64")
SHARED = ("control: 63 particles told as 64", "control: a picture one per cent too opaque")


def _fast(case: Case) -> bool:
    own = case.group not in ("grid", "steps", "control") or case.name in SHARED
    pictures = case.group == "picture" and "tile" not in case.name
    return case.quick and own and (pictures or case.group != "picture" or case.name in SHARED)


@pytest.mark.parametrize("case", [c for c in CASES if _fast(c)], ids=lambda c: c.name)
def test_a_cell_ends_as_it_must(case):
    for method in set(case.methods) & set(FAST):
        line = line_of(case, method)
        assert line["status"] == "ok", line


def test_the_catalogue_is_large_and_has_controls():
    assert len({case.name for case in CASES}) >= 80
    assert sum(case.group == "control" for case in CASES) >= 5
    known = {RIGHT, REFUSED, WRONG}
    assert all(case.expects & known or all(map(str.isupper, case.expects)) for case in CASES)


def test_what_is_not_a_number_is_wrong():
    assert judged((Measure("x", 0.5, 1.0),)).outcome == RIGHT
    for value in (float("nan"), float("inf"), 1.5):
        assert judged((Measure("x", 0.5, 1.0), Measure("y", value, 1.0))).outcome == WRONG

    def refuses(method):
        raise InputError("no")

    line = line_of(Case("a", "g", refuses, ("m",), "b"), "m")
    assert line["outcome"] == REFUSED and line["status"] == "unexpected refused"


def test_the_reference_breathes_as_an_oscillator():
    """Hencky's law and F = exp(g) I: g'' = -w^2 g with w^2 = 4 E / ((1 - 2 nu) rho dx^2)."""
    import numpy as np

    E, nu, density, spacing, g = 1e3, 0.3, 1e3, 0.1, 1e-3
    w = 2 / spacing * (E / (1 - 2 * nu) / density) ** 0.5
    steps = 4000
    F = np.exp(g) * np.eye(3)[None]
    given = {"E": np.full(1, E), "nu": np.full(1, nu), "density": np.full(1, density)}
    half = np.full(steps, np.pi / w / steps)
    F, _ = march(STRESSES["Hencky"], F, np.zeros((1, 3, 3)), half, **given, spacing=spacing)
    np.testing.assert_allclose(F[0], np.exp(-g) * np.eye(3), atol=2e-3 * g)


def test_the_table_counts_what_is_unexpected():
    def line(name, cell, expects=RIGHT, group="g"):
        return line_of(Case(name, group, lambda m: cell, ("m",), "b", frozenset({expects})), "m")

    lines = [
        line("a", judged((Measure("x", 1e-7, 1e-6),), steps=3)),
        line("b", Cell("COLLAPSED"), "COLLAPSED"),
        line("c", Cell(WRONG)),
        line("d", Cell(WRONG), WRONG, "control"),
    ]
    text = table([json.loads(json.dumps(one)) for one in lines], "f")
    assert "1 right, 1 clear failures, 1 controls" in text.replace("\n", " ")
    assert "1 unexpected" in text and "right 1e-07 (3)" in text and "**wrong, unexpected**" in text
