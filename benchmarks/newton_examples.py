"""Suite 'newton-examples': two examples of Newton's implicit MPM, run here and by Newton.

The scenes are those of `newton_scenes`. Of the beam, `error` is the root mean square distance of
the particles at the end from explicit float64 steps of half the length, over the beam's length, and
`error_finer` that from explicit float64 steps on cells of half the size. Grains cannot be matched
one to one, so of sand both are distances of each coordinate in sorted order, over the block's size.

    python -m benchmarks run newton-examples --out FILE.jsonl [--quick]
"""

import time
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
LONGEST = {"beam": 1 / 60, "sand": 1 / 60}  # implicit steps of ours [s]


def explicit(example: Example, share: float = 1.0) -> tuple[State, dict[str, int]]:
    """The end by explicit steps, `share` of those that are taken by default."""
    dt = SAFETY * share * largest_stable_dt(example.config, example.model, example.state).dt
    steps = int(np.ceil(example.time / dt))
    end = advance_frame(example.config, example.model, example.state, example.time / steps, steps)
    check(end.status)
    return end, {"steps": steps}


def implicit(example: Example, longest: float) -> tuple[State, dict[str, int]]:
    """The end by backward Euler in steps of at most `longest` [s]."""
    state, counts = example.state, np.zeros(3, int)
    frames = int(np.ceil(example.time / longest - 1e-6))
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
def reference(name: str, finer: int, size: tuple[tuple[str, float], ...]) -> np.ndarray:
    """Where explicit float64 steps lead: of half the length, or on finer cells."""
    example = EXAMPLES[name]("float64", finer=finer, **dict(size))
    return places(explicit(example, 0.5 if finer == 1 else 1.0)[0])


def places(state: State) -> np.ndarray:
    """Of the particles [m], (N, 3)."""
    return np.asarray(state.position, np.float64).T


def measures(name: str, size: dict[str, float], end: np.ndarray) -> dict[str, Any]:
    """What a line tells of an end, (N, 3) [m], besides its error."""
    example = EXAMPLES[name](**size)
    start, key = places(example.state), tuple(size.items())
    found: dict[str, Any] = {
        "error_finer": distance(name, end, reference(name, 2, key), example.size),
        "moved": distance("", end, start, example.size),
        "time": example.time,
        "particles": len(end),
    }
    if name == "beam":
        middle = abs(start[:, 0] - np.median(start[:, 0])) < 1e-3
        found |= {"sunk": float((start - end)[middle, 2].mean())}
        found |= {"turned": _turned(start[middle, 1:], end[middle, 1:])}
    else:
        x, y, z = (end - MIDDLE).T
        quantiles = {"left": (x, 1), "right": (x, 99), "front": (y, 1), "top": (z, 99)}
        found |= {key: float(np.percentile(*pair)) for key, pair in quantiles.items()}
        found |= {"height": float(z.mean()), "on_box": float((z > 1.5).mean())}
    return found


def _turned(before: np.ndarray, after: np.ndarray) -> float:
    """By how much a cross-section (N, 2) has turned about its middle, least squares [degrees]."""
    a, b = before - before.mean(axis=0), after - after.mean(axis=0)
    sine, cosine = np.sum(a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]), np.sum(a * b)
    return float(np.degrees(np.arctan2(sine, cosine)))


def ours(name: str, size: dict[str, float], longest: float | None = None) -> Prepared:
    """A run by our steps, compiled: explicit ones, or implicit ones of at most `longest` [s]."""
    jax.config.update("jax_enable_x64", True)
    example = EXAMPLES[name](**size)
    run = partial(explicit, example) if longest is None else partial(implicit, example, longest)
    start = time.perf_counter()
    end, counts = run()
    first = time.perf_counter() - start
    return Prepared(
        lambda: jax.block_until_ready(run()[0]),
        work=example.time,
        error=lambda: distance(
            name, places(end), reference(name, 1, tuple(size.items())), example.size
        ),
        once=True,
        extra=counts | {"first_seconds": first},
        found=lambda: measures(name, size, places(end)),
    )


def newton(name: str, size: dict[str, float]) -> Prepared:
    """A run by Newton, once its kernels are compiled."""
    jax.config.update("jax_enable_x64", True)
    example, session = EXAMPLES[name](**size), Session(NEWTON, limit=1800.0)
    session.load(replace(example.matter, steps=2))
    session.run()
    session.load(example.matter)
    said: dict[str, Any] = {}

    def end() -> np.ndarray:
        return session.end()["position"]

    return Prepared(
        lambda: said.update(session.run()),
        work=example.time,
        error=lambda: distance(name, end(), reference(name, 1, tuple(size.items())), example.size),
        once=True,
        extra={"steps": example.steps, "peer_versions": session.ready["versions"]},
        found=lambda: measures(name, size, end()) | {"peak_bytes": said["peak_bytes"]},
    )


def left_out_lines() -> list[dict]:
    """A line that says why Newton cannot be run, where it cannot."""
    if not NEWTON.missing:
        return []
    line = {"suite": "newton-examples", "case": "all", "method": "newton"}
    return [line | {"status": NEWTON.missing}]


def cases(quick: bool) -> list[Case]:
    """Each example by explicit steps, by implicit ones, and by Newton where it can be run."""
    found = []
    for name in EXAMPLES:
        size = QUICK[name] if quick else {}
        methods = {
            "jaxphys": partial(ours, name, size),
            "jaxphys-implicit": partial(ours, name, size, LONGEST[name]),
        }
        if not NEWTON.missing:
            methods["newton"] = partial(newton, name, size)
        found += [Case(name, method, prepare, rounds=1) for method, prepare in methods.items()]
    return found
