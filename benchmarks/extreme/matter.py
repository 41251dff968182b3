"""Small scenes of matter, the programs that step through them, and what is measured at the end.

All scenes have 64 particles, so that those of one law and one grid share their programs.
"""

from functools import partial
from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np

from benchmarks.extreme.case import WRONG, Cell, Measure, all_finite, judged
from benchmarks.extreme.lone import STRESSES, lame, march
from jaxphys.core.errors import InputError
from jaxphys.mpm import state as codes
from jaxphys.mpm.grid import Grid
from jaxphys.mpm.loop.adaptive import rollout_adaptively
from jaxphys.mpm.loop.frames import advance_frame
from jaxphys.mpm.loop.implicit.rollout import implicit_rollout
from jaxphys.mpm.loop.status import check
from jaxphys.mpm.loop.window import windowed
from jaxphys.mpm.materials.elasticity import NEO_HOOKEAN
from jaxphys.mpm.state import OK, Config, Model, State, initial_state
from jaxphys.mpm.stepping import Adaptive, Implicit
from jaxphys.mpm.stepping.bounds import largest_stable_dt

COUNT, SPACING, NODES = 64, 0.1, 16
MIDDLE = np.array([0.75, 0.75, 0.75])
MOST_STEPS = 1024
ADAPTIVE = ("adaptive float32", "adaptive float64")
FIXED = ("fixed float32", "fixed float64")
IMPLICIT = ("implicit float64",)
NAMES = {
    getattr(codes, name): name
    for name in [
        "NOT_FINITE",
        "LEFT_GRID",
        "STEP_TOO_LARGE",
        "LEFT_WINDOW",
        "INVERTED",
        "COLLAPSED",
        "UNSTABLE_STEP",
        "TOO_MANY_STEPS",
        "NOT_CONVERGED",
    ]
}


class Scene(NamedTuple):
    """What is stepped for `bounds` times its largest stable step, or for `time` [s]; numbers: as
    they were given, in numpy; fixed: share of the largest stable step, for fixed steps.
    """

    config: Config
    model: Model
    state: State
    numbers: dict
    bounds: float
    time: float | None
    fixed: float


class Run(NamedTuple):
    """A scene that was stepped through: its end, and the steps [s] that were taken."""

    scene: Scene
    end: State
    lengths: np.ndarray
    implicit: bool


def cube(size: float = 1.0, centre=(0.75, 0.75, 0.75)) -> np.ndarray:
    """4 x 4 x 4 places [m] half a cell apart, times `size`, about `centre`."""
    line = (np.arange(4) - 1.5) * SPACING / 2 * size
    return np.stack(np.meshgrid(line, line, line, indexing="ij"), -1).reshape(-1, 3) + centre


def apart(seed: int = 0) -> np.ndarray:
    """4 x 4 x 4 places [m] none of which shares a node with another, anywhere in their cells."""
    line = 2.0 + 3 * np.arange(4)
    nodes = np.stack(np.meshgrid(line, line, line, indexing="ij"), -1).reshape(-1, 3)
    return SPACING * (nodes + np.random.default_rng(seed).uniform(-0.45, 0.45, (COUNT, 3)))


def strained(size: float, seed: int = 1) -> np.ndarray:
    """Random F (64, 3, 3) within about `size` of none."""
    return np.eye(3) + size * np.random.default_rng(seed).uniform(-1, 1, (COUNT, 3, 3))


def scene(
    dtype: str,
    position,
    *,
    E=1e5,
    nu=0.3,
    density=1000.0,
    velocity=None,
    F=None,
    affine=None,
    law=NEO_HOOKEAN,
    nodes=(NODES,) * 3,
    window: bool = False,
    bounds: float = 24.0,
    time: float | None = None,
    fixed: float = 0.5,
    without_check: bool = False,
    replaced: dict | None = None,
) -> Scene:
    """A scene; replaced: fields of the state that `initial_state` would refuse."""
    count = len(position)

    def full(value):
        return np.broadcast_to(np.asarray(value, np.float64), (count,)).copy()

    def or_else(value, shape, default):
        return np.broadcast_to(default if value is None else value, (count, *shape)).copy()

    numbers = {
        "position": np.asarray(position, np.float64),
        "E": full(E),
        "nu": full(nu),
        "density": full(density),
        "velocity": or_else(velocity, (3,), np.zeros(3)),
        "F": or_else(F, (3, 3), np.eye(3)),
        "affine": or_else(affine, (3, 3), np.zeros((3, 3))),
    }
    config = Config(Grid(nodes, SPACING), ((law, 0, count),), check_step=not without_check)
    volume = np.full(count, SPACING**3 / 8)
    model = Model(
        mass=jnp.asarray(numbers["density"] * volume, dtype),
        volume=jnp.asarray(volume, dtype),
        parameters={
            "youngs_modulus": jnp.asarray(numbers["E"], dtype),
            "poisson_ratio": jnp.asarray(numbers["nu"], dtype),
        },
        gravity=None,
    )
    start = initial_state(
        config, position, numbers["velocity"], numbers["F"], numbers["affine"], dtype=dtype
    )
    for name, value in (replaced or {}).items():
        start = start._replace(**{name: jnp.asarray(value, dtype)})
    if window:
        config = windowed(config, start)
    return Scene(config, model, start, numbers, bounds, time, fixed)


@partial(jax.jit, static_argnums=0)
def _adaptively(config, model, state, duration):
    stepping = Adaptive(most_steps=MOST_STEPS)
    return rollout_adaptively(config, model, state, stepping, duration=duration, record=MOST_STEPS)


@partial(jax.jit, static_argnums=0)
def _implicitly(config, model, state, duration):
    return implicit_rollout(config, model, state, time=duration, stepping=Implicit(most_steps=64))


def stepped(made: Scene, method: str) -> tuple[Run, float | None]:
    """The run of a scene by a method, and its largest stable step [s]: none where the start has no
    bound.
    """
    config, model, state = made.config, made.model, made.state
    dtype = state.position.dtype
    try:
        stable = largest_stable_dt(config, model, state).limit
    except InputError:
        if made.time is None:
            raise
        stable = None
    duration = made.time or made.bounds * stable
    how = method.split()[0]
    if how == "implicit":
        end, report = _implicitly(config, model, state, jnp.asarray(duration, dtype))
        lengths = np.asarray(report.lengths)[: int(report.steps)]
    elif how == "fixed":
        dt = made.fixed * stable
        lengths = np.full(max(1, round(duration / dt)), dt).astype(dtype)
        end = advance_frame(config, model, state, jnp.asarray(dt, dtype), jnp.int32(len(lengths)))
    else:
        end, steps = _adaptively(config, model, state, jnp.asarray(duration, dtype))
        lengths = np.asarray(steps.dt)[: int(steps.count)]
    return Run(made, end, lengths, how == "implicit"), stable


def run(build, measures, method: str) -> Cell:
    """A cell: `build(dtype)` stepped through by a method, and `measures(run)` of its end."""
    made = build(method.split()[1])
    found, stable = stepped(made, method)
    code = int(found.end.status.code)
    more = {"steps": len(found.lengths), "stable": stable}
    if code == OK:
        if not all_finite(found.end):
            return Cell(WRONG, message="not finite, and no status says so", **more)
        return judged(tuple(measures(found)), **more)
    try:
        check(found.end.status)
    except InputError as error:
        message = str(error)
    kept = all(
        np.array_equal(getattr(found.end, name), getattr(made.state, name), equal_nan=True)
        for name in ("position", "velocity", "affine", "deformation")
    )
    if not kept:
        return Cell(WRONG, message=f"the last good state is lost: {message}", **more)
    return Cell(NAMES[code], message=message, **more)


# What is measured.


def _eps(run: Run) -> float:
    return float(jnp.finfo(run.end.position.dtype).eps)


def _public(state: State, name: str) -> np.ndarray:
    value = np.asarray(getattr(state, name), np.float64)
    rest = getattr(state.residual, name, None) if state.residual is not None else None
    value = value if rest is None else value + np.asarray(rest, np.float64)
    return np.moveaxis(value, -1, 0)


def as_alone(run: Run, name: str = "neo-Hookean", rounding: float = 1.0, who=slice(None)):
    """F, C, x and v against those of particles alone (`lone.march`), and by implicit steps momentum
    and energy only. rounding: how many times more than usual the case is moved by a rounding.
    """
    if run.implicit:
        return conserved(run)
    numbers, eps, lengths = run.scene.numbers, _eps(run), run.lengths.astype(np.float64)
    matter = {key: numbers[key][who] for key in ("E", "nu", "density")}
    start = numbers["F"][who], numbers["affine"][who]
    F, C = march(STRESSES[name], *start, lengths, **matter, spacing=SPACING)
    place, velocity, span = numbers["position"], numbers["velocity"], lengths.sum()
    off = {
        "F": (_public(run.end, "deformation")[who] - F) / np.abs(F).max(),
        # What it does in a step: where C is nearly nothing, its own size says nothing.
        "C dt": (_public(run.end, "affine")[who] - C) * lengths.max(),
        "x": (_public(run.end, "position") - place - velocity * span)[who] / SPACING,
        "v dt": (_public(run.end, "velocity") - velocity)[who] * lengths.max() / SPACING,
    }
    cells = np.abs(place).max() / SPACING
    room = 500 * eps * rounding
    more = {"x": 1 + 0.01 * cells}
    return tuple(
        Measure(key, np.abs(value).max(), room * more.get(key, 1)) for key, value in off.items()
    )


def totals(made: Scene, state: State):
    """Momentum, angular momentum about the middle, and energy, with their scales."""
    mass = np.asarray(made.model.mass, np.float64)
    x, v = _public(state, "position"), np.moveaxis(np.asarray(state.velocity, np.float64), -1, 0)
    C, F = (_public(state, name) for name in ("affine", "deformation"))
    x = x - mass @ x / mass.sum()
    inertia = mass * SPACING**2 / 4
    spin = np.stack([C[:, 2, 1] - C[:, 1, 2], C[:, 0, 2] - C[:, 2, 0], C[:, 1, 0] - C[:, 0, 1]], 1)
    momentum = mass @ v
    turning = mass @ np.cross(x, v) + inertia @ spin
    moving = 0.5 * (mass @ np.sum(v**2, axis=1) + inertia @ np.sum(C**2, axis=(1, 2)))
    mu, lam = lame(made.numbers["E"], made.numbers["nu"])
    log = np.log(np.linalg.det(F))
    squares = np.sum(F**2, axis=(1, 2))
    stored = np.asarray(made.model.volume, np.float64) @ (
        mu * (0.5 * (squares - 3) - log) + 0.5 * lam * log**2
    )
    return momentum, turning, moving + stored


def conserved(run: Run, swing: float = 0.1):
    """Momentum and angular momentum, and an energy that grows no more than leapfrog steps let it
    (a share `swing`, of neo-Hookean matter).
    """
    first, last = totals(run.scene, run.scene.state), totals(run.scene, run.end)
    mass = float(np.sum(np.asarray(run.scene.model.mass, np.float64)))
    speed = np.sqrt(2 * max(first[2], last[2]) / mass)
    steps = max(len(run.lengths), 1)
    room = 3 * _eps(run) * (steps + 2)
    turning = np.abs(last[1] - first[1]).max() / (mass * speed * 2 * SPACING)
    momentum = Measure("momentum", np.abs(last[0] - first[0]).max() / (mass * speed), room)
    gained = max(last[2] / first[2] - 1, 0.0) if np.isfinite(last[2]) else np.inf
    energy = Measure("energy gained", gained, 1e-3 if run.implicit else swing)
    if run.implicit:
        return momentum, energy  # angular momentum is kept to the square of a step only
    return momentum, Measure("angular momentum", turning, room), energy
