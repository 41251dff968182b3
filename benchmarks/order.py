"""Suite 'order': problems with known answers on a ladder of grids, in float64 and float32.

A line's `error` is the L2 error of the displacement against the truth, relative to the motion; `h`
is dx over the body's size, `dt` the time step over the motion's duration. `observed_order` compares
with the next coarser grid, and is null on the coarsest. See docs/validation.md for the problems.
"""

import math
import time
from collections.abc import Callable

import jax

from benchmarks.case import Case, Prepared

LADDERS = {
    "free-bar": (8, 16, 32, 64),
    "held-bar": (8, 16, 32, 64),
    "sudden-column": (8, 16, 32, 64),
    "rotation": (4, 8, 16, 32),
    "vortex": (8, 16, 32),
    "cube": (6, 12, 24),
}
EXPECTED = {
    "free-bar": 2,
    "held-bar": 1,
    "sudden-column": 1,
    "rotation": 2,
    "vortex": 2,
    "cube": 2,
}


def build(name: str, cells: int, dtype: str):
    """The problem on a grid with dx = size / cells; the vortex and the cube are sized 1 m."""
    from jaxphys.problems.bar import Bar, free_bar, held_bar
    from jaxphys.problems.column import Column, sudden_column
    from jaxphys.problems.cube import Cube, free_cube
    from jaxphys.problems.vortex import Vortex, plate, vortex

    spin = Vortex(amplitude=0.0, spin=1.0)
    # float32 holds a displacement of 1e-5 of the body no better than to a percent.
    bar = Bar(speed=1e-5 if dtype == "float64" else 1e-2)
    builders: dict[str, Callable] = {
        "free-bar": lambda: free_bar(bar, cells, dtype=dtype),
        "held-bar": lambda: held_bar(bar, cells, dtype=dtype),
        "sudden-column": lambda: sudden_column(
            Column(gravity=1e-3 if dtype == "float64" else 1.0), cells, dtype=dtype
        ),
        "rotation": lambda: plate(spin, cells, math.pi / 2, dtype=dtype),
        "vortex": lambda: vortex(Vortex(), 1 / cells, 0.5, dtype=dtype),
        "cube": lambda: free_cube(Cube(), cells, dtype=dtype),
    }
    return builders[name]()


def prepare(name: str, cells: int, dtype: str) -> Prepared:
    """Compiles the problem, and solves it and the next coarser one to learn the order."""
    jax.config.update("jax_enable_x64", True)
    from jaxphys.problems.discrete import displacement_errors, solve

    problem = build(name, cells, dtype)
    start = time.perf_counter()
    first = jax.block_until_ready(solve(problem))
    compile_seconds = time.perf_counter() - start
    start = time.perf_counter()
    jax.block_until_ready(solve(problem))
    compile_seconds -= time.perf_counter() - start
    error, largest = displacement_errors(problem, first)
    order = None
    if cells != LADDERS[name][0]:
        coarse = build(name, cells // 2, dtype)
        order = math.log2(displacement_errors(coarse, solve(coarse))[0] / error)
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
            "expected_order": EXPECTED[name],
            "observed_order": order,
        },
    )


def cases(quick: bool) -> list[Case]:
    """Every level of every ladder; `quick` takes the first three of the cheap ones."""
    chosen = []
    for name, ladder in LADDERS.items():
        if quick and name in ("vortex", "cube"):
            continue
        for cells in ladder[:3] if quick else ladder:
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
