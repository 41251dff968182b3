"""The fit: stages of a search, and what is told of its end."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import jax
import numpy as np

from jaxphys.core.errors import InputError
from jaxphys.fitting.evaluation import Evaluator, Memory
from jaxphys.fitting.free import Field, Free
from jaxphys.fitting.layout import STATE, Layout, layout
from jaxphys.fitting.motion import CHECKPOINTED, still
from jaxphys.fitting.observed.base import Observed
from jaxphys.fitting.observed.pictures import Seen
from jaxphys.fitting.problem import Problem, problem
from jaxphys.fitting.result import SHOWN, Fit, Misfit
from jaxphys.fitting.search import FAILED, Search, Step, chosen
from jaxphys.fitting.uncertainty import Uncertainty, independent_residuals, laplace
from jaxphys.mpm.loop.adjoint import Adjoint
from jaxphys.mpm.loop.status import check
from jaxphys.mpm.simulation import Simulation
from jaxphys.mpm.state import OK
from jaxphys.scene.build import build
from jaxphys.scene.look import Look
from jaxphys.scene.scene import Scene
from jaxphys.scene.source import load_object

MOST_INTERVALS = 64  # numbers up to which a fit says how sure it is of each
GROWING = 0.5, 0.75  # of the times, that Gauss-Newton sees before it sees all
FEWEST_TIMES = 6  # for that
FIRST_FRAMES = 1 / 3  # of the times, in which what the motion started with is found


@dataclass(frozen=True)
class Stage:
    """A part of a fit.

    Attributes:
        names: of the free numbers that change; None: all.
        share: of the times, the first ones, that are compared.
        search: None: that of the fit.
    """

    names: tuple[str, ...] | None = None
    share: float = 1.0
    search: Search | None = None

    def __post_init__(self):
        if not 0 < self.share <= 1:
            raise InputError(f"stage: share is {self.share}; give one in (0, 1]")


def fit(
    scene_or_simulation: Scene | Simulation,
    free: Mapping[str, Free | Field],
    observed: Observed | Sequence[Observed],
    *,
    look: Look | None = None,
    end: float | None = None,
    search: Search | None = None,
    stages: Sequence[Stage] | None = None,
    starts: int = 1,
    seed: int = 0,
    level: float = 0.9,
    adjoint: Adjoint = CHECKPOINTED,
    steps: int | None = None,
    memory: Memory | None = None,
    watch: Callable[[], None] | None = None,
) -> Fit:
    """Finds numbers with which a simulation moves as was observed::

        fit = jaxphys.fit(
            simulation,
            free={"youngs_modulus": Log(2e4), "velocity": Free((0.0, 0.0, -1.0))},
            observed=Tracks(positions, times),
        )
        print(fit)

    Args:
        scene_or_simulation: what moves. Of a scene the sources are read, and its look is drawn.
        free: what may change, by the names of `Simulation.with_`; `boundaries.0.velocity` is a
            number of the scene's first boundary, `boundaries.1.motion.spin` one of how the second
            moves, `gaussians.harmonics` one of what is drawn.
        observed: what was seen, one or several.
        look: what is drawn of a simulation; `build` gives it.
        end: of the run [s], after which nothing can have been observed; None: that of a scene, and
            of a simulation any time.
        search: None: what suits the number of free numbers; `Fit.search` says which and why.
        stages: None: what the motion starts with (velocity, ...) from the first third of the times,
            where something else is free as well, then all from all of them, to which
            Gauss-Newton comes by a half and three quarters of them.
        starts: so many places to start from are tried, all but the first drawn around it, a step
            that is much away; the fit goes on from the best.
        seed: of those.
        level: of the intervals.
        adjoint: how gradients go back.
        steps: between two of the times, in every trial: one compilation, and a trial that they
            are too few for is a wall. None: as many as each trial's numbers need.
        memory: of earlier evaluations, to go on where a fit was stopped.
        watch: called after each evaluation; may raise KeyboardInterrupt.

    Raises:
        InputError: a name, a start or an observation that cannot be used, by frame and field, or a
            number that nothing observed depends on.
        SimulationError: the simulation fails where the fit starts.
    """
    simulation, look, end = _subject(scene_or_simulation, look, end)
    observations = (observed,) if isinstance(observed, Observed) else tuple(observed)
    numbers = layout(free, simulation, look)
    asked = problem(
        simulation, numbers, observations, look=look, end=end, adjoint=adjoint, steps=steps
    )
    return solved(asked, search, stages, starts, seed, level, memory, watch)


def solved(
    asked: Problem,
    search: Search | None = None,
    stages: Sequence[Stage] | None = None,
    starts: int = 1,
    seed: int = 0,
    level: float = 0.9,
    memory: Memory | None = None,
    watch: Callable[[], None] | None = None,
) -> Fit:
    """The fit of a problem, with the arguments of `fit`. Problems that differ in nothing but what
    was seen share their compiled programs (`Problem.observing`).
    """
    numbers = asked.layout
    pictures = any(isinstance(one, Seen) for one in asked.observed)
    suited, why = chosen(numbers.size, asked.squares, pictures)
    if search is not None:
        suited, why = search, "as asked for"
    if suited.type == "gauss-newton" and not asked.squares:
        raise InputError("search: Gauss-Newton needs residuals, and one observation is a loss")
    ask = Evaluator(asked, memory or Memory(), watch)
    given = None if stages is None else tuple(stages)
    plan = given or default_stages(numbers, suited, len(asked.times))
    vector = _best_start(ask, numbers, starts, seed)
    _refuse_what_nothing_depends_on(ask, vector, suited)
    begun, step, history = vector, Step(vector, np.inf), []
    for number, stage in enumerate(plan):
        member = np.ones(numbers.size, bool)
        if stage.names is not None:
            _known(stage.names, numbers)
            member = numbers.member(stage.names)
        frames = frames_of(asked, stage.share)
        if number and suited.type == "gauss-newton" and np.isinf(ask.loss(vector, frames)):
            vector = begun  # what is right in the first frames may fail in later ones
        best: Step | None = None
        for step in (stage.search or suited).run(ask, vector, member, frames):
            history.append(_row(number, step, numbers))
            if best is None or step.loss <= best.loss:
                best = step
        if best is None or not np.isfinite(best.loss):
            break
        vector = best.vector
    ask.memory.save()
    return _ended(ask, begun, vector, history, f"{suited.type} ({why})", step.reason, level)


def _subject(given: Scene | Simulation, look: Look | None, end: float | None):
    """(simulation, look, end of the run [s] or None)."""
    if isinstance(given, Simulation):
        return given, look, end
    objects = [
        load_object(thing, None, given.seed + i, f"objects[{i}]")
        for i, thing in enumerate(given.objects)
    ]
    simulation, own = build(given, *objects)
    return simulation, look or own, end or (given.frames - 1) * given.seconds_per_frame


def default_stages(numbers: Layout, search: Search, times: int) -> tuple[Stage, ...]:
    """What the motion starts with first, where something else is free; then everything.

    Gauss-Newton sees more and more of the times: a long motion that is far off after a contact
    has slopes that lead nowhere, a short one leads near.
    """
    state = tuple(e.name for e in numbers.entries if e.name in STATE)
    growing = search.type == "gauss-newton" and times >= FEWEST_TIMES
    whole = tuple(Stage(None, share) for share in GROWING if growing)
    if state and len(state) < len(numbers.entries):
        return Stage(state, FIRST_FRAMES), *whole, Stage()
    return *whole, Stage()


def frames_of(asked: Problem, share: float) -> int:
    """How many of the times a share is: at least one in which something has moved."""
    count = max(1, round(share * len(asked.times)))
    return max(count, 2) if asked.times[0] == 0 else count


def _known(names, numbers: Layout) -> None:
    free = {entry.name for entry in numbers.entries}
    if unknown := set(names) - free:
        raise InputError(f"stage: {sorted(unknown)[0]!r} is not free; free: {sorted(free)}")


def _best_start(ask: Evaluator, numbers: Layout, starts: int, seed: int) -> np.ndarray:
    """The start, or the best of several around it."""
    start = numbers.start()
    if starts <= 1:
        return start
    random = np.random.default_rng(seed)
    places = [start]
    for _ in range(starts - 1):
        places.append(start + numbers.scale(start) * random.normal(size=numbers.size))
    frames = len(ask.problem.times)
    losses = [ask.loss(place, frames) for place in places]
    return places[int(np.argmin(losses))]


def _refuse_what_nothing_depends_on(ask: Evaluator, vector: np.ndarray, search: Search) -> None:
    frames = len(ask.problem.times)
    if search.type == "gauss-newton":
        loss, slope, gram = ask.normal(vector, frames)
        felt = np.diag(gram) > 0
    else:
        loss, slope = ask.gradient(vector, frames)
        felt = slope != 0
    if not np.isfinite(loss):
        program = ask.program(vector)
        motion, _ = ask.problem.call("motion", program)(ask.problem.cast(vector), frames)
        motion.check()
        raise InputError("observed: the loss is not finite at the start, though nothing fails")
    for entry in ask.problem.layout.entries:
        if not felt[entry.start : entry.stop].any():
            raise InputError(
                f"free[{entry.name!r}]: nothing that was observed depends on it; hold it fixed"
            )


def _row(stage: int, step: Step, numbers: Layout) -> dict:
    row: dict[str, Any] = {
        "stage": stage,
        "loss": float(f"{step.loss:.9g}") if np.isfinite(step.loss) else None,
    }
    if numbers.size <= SHOWN:
        values = numbers.values(step.vector)
        row["values"] = {
            name: np.asarray(value, np.float64).round(12).tolist() for name, value in values.items()
        }
    return row


def _ended(ask, begun, vector, history, search: str, reason: str, level: float) -> Fit:
    asked, numbers = ask.problem, ask.problem.layout
    program, count = ask.program(vector), len(asked.times)
    data = asked.matched(vector, asked.data(), program)
    end = asked.compare(vector, data, count, program)
    if np.any(end.motion.status.code != OK):
        check(end.motion[int(np.argmax(end.motion.status.code != OK))].status)
    before = ask.program(begun)
    at_start = asked.compare(begun, asked.matched(begun, asked.data(), before), count, before)
    unmoved = still(asked.simulation, asked.times)
    own = asked.matched_to(unmoved, end.look, asked.data())
    compared = asked.call("compared", program)
    at_rest, _ = jax.device_get(compared(unmoved, end.look, asked.cast(vector), own, count))
    simulation, look = asked.changed(asked.cast(vector))
    uncertainty = None
    if asked.squares and numbers.size <= MOST_INTERVALS:
        uncertainty = _how_sure(asked, vector, data, program, end.residuals, level)
    values = {
        name: float(value) if np.ndim(value) == 0 else np.asarray(value, np.float64)
        for name, value in numbers.values(vector).items()
    }
    misfits = tuple(
        _misfit(one, asked.simulation, *parts)
        for one, *parts in zip(
            asked.observed, end.residuals, at_start.residuals, at_rest, strict=False
        )
    )
    if reason == "":
        reason = "stopped at the number of iterations that was allowed"
    return Fit(
        values=values,
        uncertainty=uncertainty,
        misfits=misfits,
        history=tuple(history),
        simulation=simulation,
        look=look,
        motion=end.motion,
        search=search,
        reason=reason if history else FAILED,
        loss=float(end.loss),
        vector=vector,
    )


def _how_sure(asked, vector, data, program, residuals, level) -> Uncertainty | None:
    normal = asked.call("normal", program)
    _, _, gram = jax.device_get(normal(asked.cast(vector), data, len(asked.times)))
    if not np.all(np.isfinite(gram)):
        return None
    parts = [
        one.arranged(part, asked.simulation)
        for one, part in zip(asked.observed, residuals, strict=False)
    ]
    arrays, axes = [part for part, _ in parts], [along for _, along in parts]
    return laplace(
        asked.layout,
        vector,
        np.asarray(gram, np.float64),
        squares=sum(float(np.sum(np.square(part, dtype=np.float64))) for part in arrays),
        count=sum(int(np.count_nonzero(part)) for part in arrays),
        independent=independent_residuals(arrays, axes),
        level=level,
    )


def _misfit(one: Observed, simulation: Simulation, now, then, unmoved) -> Misfit:
    noise = one.noise_of(simulation)

    def rms(residuals: np.ndarray) -> float:
        power = np.sum(np.square(residuals, dtype=np.float64))
        count = max(np.count_nonzero(residuals), 1)
        return float(np.sqrt(power / count / one.weight) * noise)

    return Misfit(one.name, one.unit, float(noise), rms(now), rms(then), rms(unmoved))
