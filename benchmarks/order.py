"""Suite 'order': problems with known answers on a ladder of grids, in float64 and float32.

A line's `error` is the L2 error of the displacement against the truth, relative to the motion; `h`
is dx over the body's size, `dt` the time step over the motion's duration. `observed_order` compares
with the next coarser grid, and is null on the coarsest. See docs/validation.md for the problems.
"""

import math
import time
from itertools import pairwise

import jax

from benchmarks.case import Case, Prepared
from jaxphys.problems.catalogue import PROBLEMS
from jaxphys.problems.discrete import displacement_errors, solve
from jaxphys.problems.problem import Problem, displacement_error

EXPENSIVE = ("vortex", "cube")


def prepare(name: str, cells: int, dtype: str) -> Prepared:
    """Compiles the problem, and solves it and the next coarser one to learn the order."""
    jax.config.update("jax_enable_x64", True)
    known = PROBLEMS[name]
    problem = known.build(cells, dtype)
    start = time.perf_counter()
    first = jax.block_until_ready(solve(problem))
    compile_seconds = time.perf_counter() - start
    start = time.perf_counter()
    jax.block_until_ready(solve(problem))
    compile_seconds -= time.perf_counter() - start
    error, largest = displacement_errors(problem, first)
    order = None
    if cells != known.ladder[0]:
        order = math.log2(known.error(cells // 2, dtype) / error)
    return Prepared(
        call=lambda: jax.block_until_ready(solve(problem)),
        work=float(problem.count * problem.steps),
        compile_seconds=compile_seconds,
        error=lambda: error,
        extra={
            "problem": name,
            "h": 1 / cells,
            "dt": 1 / problem.steps,
            "error_largest": largest,
            "expected_order": known.order,
            "observed_order": order,
        },
    )


def _has_an_order(problem: Problem) -> bool:
    """Whether its error is a displacement's, of a known order, on grids each twice as fine."""
    doubled = all(b == 2 * a for a, b in pairwise(problem.ladder))
    known = problem.norm is displacement_error and problem.order is not None
    # The other resolutions are no spacings.
    return known and doubled and problem.resolution == "cells"


def cases(quick: bool) -> list[Case]:
    """Every level of every ladder; `quick` takes the first two of the cheap ones."""
    chosen = []
    for name, problem in PROBLEMS.items():
        if not _has_an_order(problem) or (quick and name in EXPENSIVE):
            continue
        for cells in problem.ladder[:2] if quick else problem.ladder:
            for dtype in ("float64",) if quick else ("float64", "float32"):
                chosen.append(
                    Case(
                        name=f"{name}-{cells}",
                        method="jaxphys" if dtype == "float64" else "jaxphys-float32",
                        prepare=lambda name=name, cells=cells, dtype=dtype: prepare(
                            name, cells, dtype
                        ),
                        size={"cells": cells},
                        dtype=dtype,
                    )
                )
    return chosen
