"""Suite 'newton-examples': two examples of Newton's implicit MPM, run here and by Newton.

The scenes are those of `newton_scenes`; methods are explicit steps, the same on cells of half the
size, backward Euler, and Newton's own. Of the beam, `error` is the root mean square distance of the
particles at the end from explicit float64 steps of half the length, over the beam's length, and
`error_finer` that from explicit float64 steps on the finer cells. Grains cannot be matched one to
one, so of sand it is that of each coordinate in sorted order, over the block's size.

    python -m benchmarks run newton-examples --out FILE.jsonl [--quick]
"""

import time
from collections.abc import Callable
from dataclasses import replace
from functools import cache, partial
from typing import Any

import jax
import numpy as np

from benchmarks.case import Case, Prepared
from benchmarks.newton_scenes import MIDDLE, Example, beam, sand
from benchmarks.peers.remote import NEWTON, Session
from jaxphys.mpm.loop.frames import advance_frame
from jaxphys.mpm.loop.implicit.rollout import implicit_rollout
from jaxphys.mpm.loop.status import check
from jaxphys.mpm.state import State
from jaxphys.mpm.stepping.bounds import largest_stable_dt
from jaxphys.mpm.stepping.fixed import SAFETY
from jaxphys.mpm.stepping.implicit import Implicit

EXAMPLES = {f.__name__: f for f in (beam, sand)}
QUICK = {"beam": {"steps": 2, "cell": 0.5}, "sand": {"steps": 2, "cell": 0.4}}


def explicit(example: Example, share: float = 1.0) -> tuple[State, dict[str, int]]:
    """The end by explicit steps, `share` of those that are taken by default."""
    dt = SAFETY * share * largest_stable_dt(example.config, example.model, example.state).dt
    steps = max(1, int(np.ceil(example.time / dt)))
    end = advance_frame(example.config, example.model, example.state, example.time / steps, steps)
    check(end.status)
    return end, {"steps": steps}


def implicit(example: Example, longest: float) -> tuple[State, dict[str, int]]:
    """The end by backward Euler in steps of at most `longest` [s]."""
    state, counts = example.state, np.zeros(3, int)
    frames = max(1, int(np.ceil(example.time / longest - 1e-6)))
    for _ in range(frames):
        state, report = _advance(example.config, example.model, state, example.time / frames)
        counts += np.array([report.steps, report.rejected, report.effort.products])
        check(state.status)
    return state, dict(zip(("steps", "rejected", "products"), counts.tolist(), strict=True))


@partial(jax.jit, static_argnums=0)
def _advance(config, model, state, length):
    return implicit_rollout(config, model, state, time=length, stepping=Implicit())


def distance(name: str, one: np.ndarray, other: np.ndarray, size: float) -> float:
    """Of the beam's particles one by one, of sand's as heaps, over the body's size; (N, 3) [m]."""
    if name == "sand":
        one, other = np.sort(one, axis=0), np.sort(other, axis=0)
    return float(np.sqrt(np.mean(np.sum((one - other) ** 2, axis=1)))) / size


@cache
def reference(name: str, size: tuple[tuple[str, float], ...], finer: int = 1) -> np.ndarray:
    """Where explicit float64 steps lead: of half the length, or on finer cells."""
    example = EXAMPLES[name]("float64", finer=finer, **dict(size))
    return places(explicit(example, 0.5 if finer == 1 else 1.0)[0])


def places(state: State) -> np.ndarray:
    """Of the particles [m], (N, 3)."""
    return np.asarray(state.position, np.float64).T


def measures(name: str, size: dict[str, float], end: np.ndarray) -> dict[str, float]:
    """What a line tells of an end, (N, 3) [m], besides its error.

    Of the beam: `error_finer`; by how much its middle has turned [degrees] and sunk [m]. Of sand,
    places [m] in the example's own axes: first and last percentile of x, last of y and z, mean
    height, and the share that lies as high as the box's top.
    """
    example = EXAMPLES[name](**size)
    start = places(example.state)
    if name == "beam":
        finer = reference(name, tuple(size.items()), finer=2)
        middle = abs(start[:, 0] - np.median(start[:, 0])) < 1e-3
        return {
            "error_finer": distance(name, end, finer, example.size),
            "moved": distance(name, end, start, example.size),
            "sunk": float((start - end)[middle, 2].mean()),
            "turned": _turned(start[middle, 1:], end[middle, 1:]),
        }
    x, y, z = (end - MIDDLE).T
    quantiles = {"left": (x, 1), "right": (x, 99), "front": (y, 99), "top": (z, 99)}
    found = {key: float(np.percentile(*pair)) for key, pair in quantiles.items()}
    return found | {"height": float(z.mean()), "on_box": float((z > 1.5).mean())}


def _turned(before: np.ndarray, after: np.ndarray) -> float:
    """By how much a cross-section (N, 2) has turned about its middle, least squares [degrees]."""
    a, b = before - before.mean(axis=0), after - after.mean(axis=0)
    sine, cosine = np.sum(a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]), np.sum(a * b)
    return float(np.degrees(np.arctan2(sine, cosine)))


def prepared(name: str, size: dict[str, float], method: str) -> Prepared:
    """A method's run, compiled."""
    jax.config.update("jax_enable_x64", True)
    finer = 2 if method == "jaxphys-finer" else 1
    example = EXAMPLES[name](**size, finer=finer)
    start = time.perf_counter()
    run = RUNS[method](example)
    compiled = time.perf_counter() - start
    done: list[tuple[np.ndarray, dict[str, Any]]] = []

    def error() -> float:
        return distance(name, done[0][0], reference(name, tuple(size.items())), example.size)

    return Prepared(
        lambda: done.append(run()),
        work=example.time,
        compile_seconds=compiled,
        error=error,
        once=True,
        extra={"particles": len(example.model.mass), "time": example.time},
        found=lambda: done[0][1] | measures(name, size, done[0][0]),
    )


def ours(method: Callable, example: Example) -> Callable[[], tuple[np.ndarray, dict[str, Any]]]:
    """A run of ours, compiled by one of no time at all."""
    method(replace(example, steps=0))

    def run():
        end, counts = method(example)
        return places(end), counts

    return run


def newton(example: Example) -> Callable[[], tuple[np.ndarray, dict[str, Any]]]:
    """A run of Newton's, whose kernels two steps have compiled."""
    session = Session(NEWTON, limit=1800.0)
    session.load(replace(example.matter, steps=2))
    session.run()
    session.load(example.matter)

    def run():
        said = session.run()
        told = {"steps": example.steps, "peak_bytes": said["peak_bytes"]}
        return session.end()["position"], told | {"peer_versions": session.ready["versions"]}

    return run


RUNS = {
    "jaxphys": partial(ours, explicit),
    "jaxphys-finer": partial(ours, explicit),
    "jaxphys-implicit": partial(ours, partial(implicit, longest=1 / 60)),
    "newton": newton,
}


def left_out_lines() -> list[dict]:
    """A line that says why Newton cannot be run, where it cannot."""
    if not NEWTON.missing:
        return []
    line = {"suite": "newton-examples", "case": "all", "method": "newton"}
    return [line | {"status": NEWTON.missing}]


def cases(quick: bool) -> list[Case]:
    """Each example by explicit steps, by implicit ones, and by Newton where it can be run."""
    methods = [method for method in RUNS if method != "newton" or not NEWTON.missing]
    return [
        Case(name, method, partial(prepared, name, QUICK[name] if quick else {}, method), rounds=1)
        for name in EXAMPLES
        for method in methods
    ]
