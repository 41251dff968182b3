"""What a case of the catalogue is, and how a cell of it is judged.

A cell (case x method) is `right` (every measure within its tolerance), a failure by its code with
the last good state kept, `refused` (one `InputError` before anything ran), or `wrong`: a number out
of its tolerance, something not finite, or a failure that lost the state. What a case must come to
is part of the case; controls must come to `wrong`.
"""

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any, NamedTuple

import jax
import numpy as np

from jaxphys.core.errors import InputError

RIGHT, REFUSED, WRONG = "right", "refused", "wrong"


class Measure(NamedTuple):
    """One number that must be small: `value` against `most`."""

    name: str
    value: float
    most: float


class Cell(NamedTuple):
    """What came of a case by a method.

    outcome: `right`, `refused`, `wrong`, or the name of a failure's code; measures: what was held
    against its tolerance; message: the line that a user would read; steps: taken; stable: largest
    stable time step of the start [s].
    """

    outcome: str
    measures: tuple[Measure, ...] = ()
    message: str = ""
    steps: int | None = None
    stable: float | None = None


@dataclass(frozen=True)
class Case:
    """One entry of the catalogue.

    Attributes:
        name, group: for people.
        run: method -> `Cell`; an `InputError` that it raises is a refusal.
        methods: that can state the case.
        expects: outcomes that are right for it, most often one.
        by: what it is held against.
        quick: whether it is one of the fast subset.
        build: dtype -> the scene that is run, where it is one of matter.
    """

    name: str
    group: str
    run: Callable[[str], Cell]
    methods: tuple[str, ...]
    by: str
    expects: frozenset[str] = field(default=frozenset({RIGHT}))
    quick: bool = False
    build: Callable[[str], Any] | None = None


def judged(measures: tuple[Measure, ...], **more) -> Cell:
    """`right` or `wrong`; what is not a number is wrong."""
    fine = all(bool(m.value <= m.most) for m in measures)
    return Cell(RIGHT if fine else WRONG, measures, **more)


def line_of(case: Case, method: str) -> dict:
    """A line of the suite: the case by one method, and whether it came to what it must."""
    try:
        cell = case.run(method)
    except InputError as error:
        cell = Cell(REFUSED, message=str(error))
    worst = max(cell.measures, key=lambda m: _excess(m), default=None)
    return {
        "suite": "extreme",
        "case": case.name,
        "group": case.group,
        "method": method,
        "by": case.by,
        "outcome": cell.outcome,
        "expects": sorted(case.expects),
        "status": "ok" if cell.outcome in case.expects else f"unexpected {cell.outcome}",
        "measure": worst and worst.name,
        "error": worst and _number(worst.value),
        "most": worst and worst.most,
        "measures": {m.name: _number(m.value) for m in cell.measures},
        "message": cell.message,
        "steps": cell.steps,
        "largest_stable_dt": cell.stable,
    }


def _number(value: float) -> float | None:
    return float(value) if np.isfinite(value) else None  # JSON has no NaN


def _excess(measure: Measure) -> float:
    ratio = measure.value / measure.most if measure.most else measure.value
    return ratio if np.isfinite(ratio) else np.inf


def all_finite(tree) -> bool:
    """Whether every number of a pytree is finite."""
    return all(np.isfinite(np.asarray(leaf)).all() for leaf in jax.tree.leaves(tree))
