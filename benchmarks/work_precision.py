"""Suite 'work-precision': error against run time, for what a user can turn.

Every problem of the catalogue on its ladder of grids, in float64 and otherwise as it is by default;
on three of them (a bar, a vortex, a ringing cube) also in float32, with other steps, transfers,
kernels and particles a cell, and on the cube the peer; two more peers where they can state the
problem and are installed (`work_precision_peers`). Beside them pictures against a dense picture
in float64, and gradients against those of `Plain` in float64. A line's `error` is the problem's own
norm.

What is timed is the compiled rollout from start to end, without compiling, which is told apart.
"""

import time
from functools import partial

from benchmarks.case import Case, Prepared
from benchmarks.work_precision_more import gradient_cases, picture_cases
from benchmarks.work_precision_peers import facts, left_out
from benchmarks.work_precision_peers import methods as peer_methods

# Grids of each problem, coarsest first; those that are quick come with --quick.
LADDERS = {
    "free-bar": (8, 16, 32, 64),
    "held-bar": (8, 16, 32, 64),
    "sudden-column": (8, 16, 32, 64),
    "particle": (50, 100, 200, 400),
    "rotation": (4, 8, 16, 32),
    "vortex": (8, 12, 16, 24),
    "cube": (6, 9, 12, 18),
    "ringing-cube": (6, 9, 12, 18),
    "cantilever": (2, 4, 8),
    "colliding-bars": (16, 32, 64),
    "spinning-disc": (4, 8, 16),
    "sliding-block": (2, 4, 8),
    "sticking-block": (2, 4, 8),
    "hertz": (4, 6, 8),
    "taylor-bar": (2, 3, 4),
    "poiseuille": (4, 8, 16, 32),
    "bingham": (4, 8, 16, 32),
    "taylor-green": (4, 8, 16, 32),
    "dam-break": (4, 8, 16),
    "grains-1": (6, 12, 24),
    "grains-2": (6, 12, 24),
}
QUICK = {
    "free-bar": (8, 16),
    "ringing-cube": (6, 9),
    "taylor-green": (4, 8),
    "sliding-block": (4,),
}
# What is varied, on which grids.
VARIED = {"free-bar": (8, 16, 32), "vortex": (8, 12, 16), "ringing-cube": (6, 9, 12)}
QUICK_VARIED = {"ringing-cube": (6,)}
VARIANTS: dict[str, dict] = {
    "half-steps": {"courant": 0.2},
    "long-steps": {"courant": 0.8},
    "adaptive": {"stepping": "adaptive"},
    "pic": {"scheme": "pic"},
    "flip": {"scheme": "flip"},
    "aflip": {"scheme": "aflip"},
    "cubic": {"kernel": "cubic"},
    "per-axis-1": {"per_axis": 1},
    "per-axis-3": {"per_axis": 3},
    "midpoint": {"stepping": "midpoint"},
    "backward-euler": {"stepping": "backward-euler"},
}
QUICK_VARIANTS = ("flip", "cubic", "per-axis-1", "adaptive")
# The vortex has its particles on rings, and both it and the cube no small steps to save.
WITHOUT = {
    "vortex": {"per-axis-1", "per-axis-3", "midpoint", "backward-euler"},
    "ringing-cube": {"half-steps", "long-steps"},
}
PEER_CASES = ("ringing-cube",)
IMPLICIT_COURANT = 4.0


def transfer_of(scheme: str = "apic", kernel: str = "quadratic"):
    """The transfer with these names."""
    from jaxphys.mpm.transfer import AFLIP, APIC, FLIP, PIC, Transfer

    made = {"apic": APIC, "pic": PIC, "flip": FLIP, "aflip": AFLIP}[scheme]()
    return Transfer(scheme=made, kernel=kernel)


def build(name: str, resolution: int, dtype: str = "float64", stepping: str = "fixed", **changes):
    """A problem as the catalogue has it, or with changes."""
    from jaxphys.problems.bar import Bar, free_bar
    from jaxphys.problems.catalogue import PROBLEMS
    from jaxphys.problems.ringing import Ringing, ringing
    from jaxphys.problems.vortex import Vortex, vortex

    if {"scheme", "kernel"} & set(changes):
        changes["transfer"] = transfer_of(
            changes.pop("scheme", "apic"), changes.pop("kernel", "quadratic")
        )
    if stepping != "fixed":
        changes["staggered"] = False  # nobody knows half of a step that is not there yet
    if not changes:
        return PROBLEMS[name].build(resolution, dtype)
    builders = {
        "free-bar": lambda **more: free_bar(
            Bar(speed=1e-5 if dtype == "float64" else 1e-2), resolution, **more
        ),
        "vortex": lambda **more: vortex(Vortex(), 1 / resolution, 0.5, **more),
        "ringing-cube": lambda **more: ringing(Ringing(), resolution, **more),
    }
    return builders[name](dtype=dtype, **changes)


def runner(problem, stepping: str):
    """A function () -> state that runs the problem from start to end."""
    import jax.numpy as jnp

    from jaxphys.mpm.loop.frames import advance_adaptively, advance_frame, advance_implicitly
    from jaxphys.mpm.stepping import Adaptive, Implicit

    config, model, state = problem.config, problem.model, problem.state
    dtype = state.position.dtype
    duration = problem.dt * problem.steps
    if stepping == "fixed":
        dt, steps = jnp.asarray(problem.dt, dtype), jnp.asarray(problem.steps, jnp.int32)
        return partial(advance_frame, config, model, state, dt, steps)
    one = jnp.ones((), dtype)
    if stepping == "adaptive":
        return partial(
            advance_adaptively, config, model, state, Adaptive(), jnp.asarray(duration, dtype), one
        )
    implicit = Implicit(theta={"midpoint": 0.5, "backward-euler": 1.0}[stepping])
    pieces = max(1, round(problem.steps * 0.5 / IMPLICIT_COURANT))
    length = jnp.asarray(duration / pieces, dtype)

    def run():
        now = state
        for _ in range(pieces):
            now = advance_implicitly(config, model, now, implicit, length, one)
        return now

    return run


def prepare(name: str, resolution: int, changes: dict) -> Prepared:
    """Our solver on a problem."""
    import jax

    jax.config.update("jax_enable_x64", True)
    from jaxphys.problems.catalogue import PROBLEMS

    problem = build(name, resolution, **changes)
    run = runner(problem, changes.get("stepping", "fixed"))
    start = time.perf_counter()
    end = jax.block_until_ready(run())
    compile_seconds = time.perf_counter() - start
    start = time.perf_counter()
    jax.block_until_ready(run())
    compile_seconds -= time.perf_counter() - start
    known = PROBLEMS[name]
    return Prepared(
        lambda: jax.block_until_ready(run()),
        work=float(problem.count * problem.steps),
        compile_seconds=compile_seconds,
        error=lambda: known.norm(problem, end),
        extra=facts(
            known,
            resolution,
            problem.count,
            int(end.status.taken) - int(problem.state.status.taken),
            int(end.status.code),
        ),
    )


def prepare_peer(name: str, resolution: int) -> Prepared:
    """Taichi's CPU backend on two threads, in float32, with the same particles and steps."""
    import jax

    jax.config.update("jax_enable_x64", True)
    import numpy as np

    from benchmarks.peers.taichi_mpm import build as build_peer

    problem = build(name, resolution, dtype="float32")
    model, state = problem.model, problem.state
    case = {
        "position": np.asarray(state.position, np.float64).T,
        "velocity": np.asarray(state.velocity, np.float64).T,
        "affine": np.moveaxis(np.asarray(state.affine, np.float64), -1, 0),
        "nodes": problem.config.grid.shape[0],
        "spacing": 1.0,
        "law": "neo-Hookean",
        "mass": float(model.mass[0]),
        "volume": float(model.volume[0]),
        "youngs_modulus": float(model.parameters["youngs_modulus"][0]),
        "poisson_ratio": float(model.parameters["poisson_ratio"][0]),
        "dt": problem.dt,
        "gravity": (0.0, 0.0, 0.0),
    }
    advance, positions = build_peer(case)
    advance(problem.steps)
    end = state._replace(position=positions().T)
    from jaxphys.problems.catalogue import PROBLEMS

    known = PROBLEMS[name]
    error = known.norm(problem, end)
    return Prepared(
        lambda: advance(problem.steps),
        work=float(problem.count * problem.steps),
        error=lambda: error,
        extra=facts(known, resolution, problem.count, problem.steps),
    )


def left_out_lines() -> list[dict]:
    """A line for every peer that cannot be run here, saying why."""
    suite = {"suite": "work-precision", "case": "peers"}
    return [{**suite, "method": name, "status": why} for name, why in left_out()]


def cases(quick: bool) -> list[Case]:
    """The whole sweep: one case for every grid of every problem, its methods in turn."""
    varied, ladders = (QUICK_VARIED, QUICK) if quick else (VARIED, LADDERS)
    found = []
    # Coarse grids of all problems first, so that a sweep that is cut short has seen them all.
    for name, resolution in sorted(
        ((name, resolution) for name, ladder in ladders.items() for resolution in ladder),
        key=lambda one: ladders[one[0]].index(one[1]),
    ):
        methods = {"jaxphys-float64": partial(prepare, name, resolution, {})}
        if resolution in varied.get(name, ()):
            methods["jaxphys"] = partial(prepare, name, resolution, {"dtype": "float32"})
            for variant in QUICK_VARIANTS if quick else VARIANTS:
                if variant not in WITHOUT.get(name, ()):
                    methods[f"jaxphys-{variant}"] = partial(
                        prepare, name, resolution, VARIANTS[variant]
                    )
            if name in PEER_CASES:
                methods["taichi"] = partial(prepare_peer, name, resolution)
        peers = peer_methods(name, resolution, quick)
        for method, run in (methods | peers).items():
            single = method in ("jaxphys", "taichi", *peers)
            found.append(
                Case(
                    f"{name}-{resolution}",
                    method,
                    run,
                    {"cells": resolution},
                    dtype="float32" if single else "float64",
                    rounds=1,
                )
            )
    return [*found, *picture_cases(quick), *gradient_cases(quick)]
