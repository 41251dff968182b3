"""Suite 'implicit': explicit against implicit steps over stiffness, on four small scenes.

Work is counted in simulated seconds, so that a ratio is one of speed. A line's `error` is the root
mean square distance of the particles at the end from where explicit steps of half the length lead,
over the body's size; `passes` counts what is about one explicit step's work: all steps of explicit
runs, of implicit ones the products with the second derivative, the evaluations of the energy, and
FIXED and LINEARISED for each step and each Newton iteration.

    python -m benchmarks.implicit --out FILE.jsonl [--quick]    counts and errors alone, no timing
"""

import argparse
import json
import sys
import time
from functools import cache, partial
from pathlib import Path
from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np

from benchmarks.case import Case, Prepared
from jaxphys.mpm.boundaries import Plane, Setting, prepare
from jaxphys.mpm.grid import Grid
from jaxphys.mpm.loop.frames import advance_frame
from jaxphys.mpm.loop.implicit.rollout import implicit_rollout
from jaxphys.mpm.loop.status import check
from jaxphys.mpm.materials.elasticity import FIXED_COROTATED
from jaxphys.mpm.state import Config, Model, State, initial_state
from jaxphys.mpm.stepping.bounds import largest_stable_dt
from jaxphys.mpm.stepping.fixed import SAFETY
from jaxphys.mpm.stepping.implicit import Implicit

DX, DENSITY = 0.1, 1000.0
FIXED, LINEARISED = 3, 3  # passes of an implicit step, and of a Newton iteration, besides the rest
MODULI = (1e6, 1e7, 1e8, 1e9, 1e10, 1e11)
SHARES = (64, 16, 4)  # implicit steps at least, in a run
THETAS = {"backward-euler": 1.0, "midpoint": 0.5}


class Scene(NamedTuple):
    """What is stepped for `time` [s]; size: of the body [m]."""

    config: Config
    model: Model
    state: State
    time: float
    size: float


def _lattice(cells, corner) -> np.ndarray:
    lines = [(np.arange(2 * n) + 0.5) * DX / 2 + c for n, c in zip(cells, corner, strict=True)]
    return np.stack(np.meshgrid(*lines, indexing="ij"), axis=-1).reshape(-1, 3)


def _scene(points, moduli, boundaries, length: float, size: float, nodes=(14, 12, 12)) -> Scene:
    count, grid = len(points), Grid(nodes, DX)
    volume = np.full(count, DX**3 / 8)
    made = prepare(boundaries, Setting(grid, points, volume, np.dtype(np.float64)))
    config = Config(grid, ((FIXED_COROTATED, 0, count),), check_step=False)
    model = Model(
        mass=jnp.asarray(DENSITY * volume),
        volume=jnp.asarray(volume),
        parameters={
            "youngs_modulus": jnp.broadcast_to(jnp.asarray(moduli, jnp.float64), (count,)),
            "poisson_ratio": jnp.full(count, 0.3),
        },
        gravity=jnp.asarray([0.0, 0.0, -9.8]),
        boundaries=made,
    )
    return Scene(config, model, initial_state(config, points, boundaries=made), length, size)


def _floor(surface="separate", friction=0.3) -> Plane:
    return Plane((0.0, 0.0, 0.4), (0.0, 0.0, 1.0), surface, friction)


def block(modulus: float) -> Scene:
    """A block that stands on a floor settles under its weight, which appears at once."""
    points = _lattice((3, 3, 3), (0.4, 0.4, 0.4))
    return _scene(points, modulus, (_floor(),), 0.3, 0.3)


def beam(modulus: float) -> Scene:
    """A beam that is held at one end bends under its own weight."""
    points = _lattice((8, 2, 2), (0.4, 0.5, 0.6))
    wall = Plane((0.425, 0.0, 0.0), (1.0, 0.0, 0.0), "sticky")
    return _scene(points, modulus, (wall,), 0.4, 0.8, nodes=(17, 12, 12))


def press(modulus: float) -> Scene:
    """A plate presses a block by a tenth."""
    points = _lattice((3, 3, 3), (0.4, 0.4, 0.4))
    plate = Plane((0.0, 0.0, 0.7), (0.0, 0.0, -1.0), "separate", None, velocity=(0.0, 0.0, -0.1))
    return _scene(points, modulus, (_floor("separate", None), plate), 0.3, 0.3)


def inclusion(modulus: float) -> Scene:
    """A soft block with a stiff core falls two centimetres and bounces."""
    points = _lattice((4, 4, 4), (0.4, 0.4, 0.42))
    core = np.all(np.abs(points - points.mean(axis=0)) < DX, axis=1)
    return _scene(points, np.where(core, modulus, 1e5), (_floor(),), 0.3, 0.4)


SCENES = {f.__name__: f for f in (block, beam, press, inclusion)}


def explicit_step(scene: Scene) -> float:
    """The step [s] that a run takes by default."""
    return SAFETY * largest_stable_dt(scene.config, scene.model, scene.state).dt


def explicit(scene: Scene, dt: float) -> tuple[State, int]:
    """The end, in steps of at most `dt` [s], and how many."""
    steps = int(np.ceil(scene.time / dt))
    end = advance_frame(scene.config, scene.model, scene.state, scene.time / steps, steps)
    check(end.status)
    return end, steps


def implicit(scene: Scene, theta: float, least: int) -> tuple[State, dict[str, int]]:
    """The end, in `least` steps or more, and what they took."""
    state, counts = scene.state, np.zeros(5, int)
    stepping = Implicit(theta=theta)
    for _ in range(least):
        state, report = _advance(scene.config, stepping, scene.model, state, scene.time / least)
        counts += np.array([report.steps, report.rejected, *report.effort])
    check(state.status)
    names = ("steps", "rejected", "newton", "products", "evaluations")
    found = dict(zip(names, counts.tolist(), strict=True))
    passes = found["products"] + found["evaluations"]
    tried = found["steps"] + found["rejected"]
    return state, found | {"passes": passes + LINEARISED * found["newton"] + FIXED * tried}


@partial(jax.jit, static_argnums=(0, 1))
def _advance(config, stepping, model, state, length):
    return implicit_rollout(config, model, state, time=length, stepping=stepping)


def distance(scene: Scene, one: State, other: State) -> float:
    """Root mean square distance of the particles, over the body's size."""
    square = jnp.sum((one.position - other.position) ** 2, axis=0)
    return float(jnp.sqrt(jnp.mean(square))) / scene.size


@cache
def reference(name: str, modulus: float) -> State:
    """The end by explicit steps of half the length."""
    scene = SCENES[name](modulus)
    return explicit(scene, 0.5 * explicit_step(scene))[0]


def counted(name: str, modulus: float, method: str, least: int = 0) -> dict:
    """A line of counts and error, without a time."""
    scene = SCENES[name](modulus)
    line = {"suite": "implicit", "scene": name, "modulus": modulus, "method": method}
    try:
        if method == "explicit":
            end, steps = explicit(scene, explicit_step(scene))
            found = {"steps": steps, "passes": steps}
        else:
            end, found = implicit(scene, THETAS[method], least)
            found["least"] = least
    except ValueError as error:
        return line | {"least": least, "status": str(error)}
    return line | found | {"error": distance(scene, end, reference(name, modulus)), "status": "ok"}


def table(quick: bool):
    """All lines of counts."""
    for modulus in MODULI[::2] if quick else MODULI:
        for name in SCENES:
            yield counted(name, modulus, "explicit")
            for method in THETAS:
                for least in SHARES[1:2] if quick else SHARES:
                    yield counted(name, modulus, method, least)


def timed(name: str, modulus: float, method: str, least: int) -> Prepared:
    """One run, compiled and called."""
    jax.config.update("jax_enable_x64", True)
    scene = SCENES[name](modulus)
    if method == "explicit":
        dt = explicit_step(scene)
        run = lambda: explicit(scene, dt)[0]  # noqa: E731
    else:
        run = lambda: implicit(scene, THETAS[method], least)[0]  # noqa: E731
    start = time.perf_counter()
    jax.block_until_ready(run())
    first = time.perf_counter() - start
    start = time.perf_counter()
    end = jax.block_until_ready(run())
    return Prepared(
        call=lambda: jax.block_until_ready(run()),
        work=scene.time,
        compile_seconds=first - (time.perf_counter() - start),
        error=lambda: distance(scene, end, reference(name, modulus)),
        extra={"modulus": modulus},
    )


def cases(quick: bool) -> list[Case]:
    """Each scene at three stiffnesses: backward Euler, the midpoint rule, and explicit steps."""
    methods = {
        "jaxphys": ("backward-euler", 16),
        "jaxphys-midpoint": ("midpoint", 16),
        "explicit": ("explicit", 0),
    }
    return [
        Case(
            name=f"{name}-{modulus:.0e}",
            method=method,
            prepare=partial(timed, name, modulus, *how),
            dtype="float64",
            rounds=1,
        )
        for name in (("block",) if quick else SCENES)
        for modulus in ((1e8,) if quick else (1e6, 1e8, 1e10))
        for method, how in methods.items()
    ]


def main() -> None:
    """Entry point: the table of counts."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.implicit", description=__doc__)
    parser.add_argument("--out", type=Path, required=True)
    parser.add_argument("--quick", action="store_true")
    options = parser.parse_args()
    jax.config.update("jax_enable_x64", True)
    options.out.parent.mkdir(parents=True, exist_ok=True)
    with options.out.open("a") as out:
        for line in table(options.quick):
            out.write(json.dumps(line) + "\n")
            out.flush()
            print(line, file=sys.stderr)


if __name__ == "__main__":
    main()
