"""How a fit looks for the numbers: a search takes an evaluator and a vector, and gives one vector
after the other, each better than the one before.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any, ClassVar, NamedTuple

import numpy as np
import optax
from scipy.optimize import minimize

from jaxphys.fitting.evaluation import Evaluator

DONE, FLAT, FAILED = "converged", "nothing left to gain", "the simulation fails at the start"
NO_SLOPE = "stopped where derivatives are not finite"


class Step(NamedTuple):
    """Where a search is.

    Attributes:
        vector: (P,).
        loss: there.
        reason: why the search ends here, or "" if it goes on.
    """

    vector: np.ndarray
    loss: float
    reason: str = ""


def within(H: np.ndarray, g: np.ndarray, radius: float) -> tuple[np.ndarray, bool]:
    """(step, whether the radius holds it back): what lowers g . step + step . H step / 2 most of
    all steps that are no longer than `radius` (Nocedal and Wright 2006, section 4.3).

    Directions of which H knows nothing are held to a hundred.
    """
    values, directions = np.linalg.eigh(0.5 * (H + H.T))
    values = np.maximum(values, 1e-7 * max(values.max(), 0.0)) + 1e-4
    along = directions.T @ g

    def length(damping: float) -> float:
        return float(np.linalg.norm(along / (values + damping)))

    low, high = 0.0, float(np.linalg.norm(g)) / radius
    held = length(low) > radius
    for _ in range(60 if held else 0):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if length(middle) > radius else (low, middle)
    return -directions @ (along / (values + (high if held else 0.0))), held


@dataclass(frozen=True)
class GaussNewton:
    """Gauss-Newton's steps within a radius that is trusted (Levenberg and Marquardt's method;
    Nocedal and Wright 2006, algorithm 4.1): a column of derivatives for each free number, by
    forward mode.

    For up to some ten numbers, and residuals. Lengths are in units of `Free.scale`: far from the
    end the numbers that matter most move first, and those that matter little hardly.

    Attributes:
        iterations: at most, of each stage.
        tolerance: converged when a step changes no number by more than this share of what is much.
        longest: step, in units of what is much.
    """

    type: ClassVar[str] = "gauss-newton"
    iterations: int = 40
    tolerance: float = 1e-4
    longest: float = 1.0

    def run(self, ask: Evaluator, vector, free: np.ndarray, frames: int) -> Iterator[Step]:
        """One accepted step after the other.

        Args:
            ask: what to minimise.
            vector: where to begin, (P,).
            free: which numbers may change, bool (P,).
            frames: so many of the times are compared.
        """
        radius, farthest = self.longest, ask.problem.layout.farthest()
        for _ in range(self.iterations):
            ask.match(vector)
            loss, slope, gram = ask.normal(vector, frames)
            if not np.isfinite(loss):
                yield Step(vector, loss, FAILED)
                return
            if not (np.all(np.isfinite(slope)) and np.all(np.isfinite(gram))):
                yield Step(vector, loss, NO_SLOPE)
                return
            # What stands at its end and would go beyond it waits.
            member = free & ~((np.abs(vector) >= farthest) & (vector * slope < 0))
            if not member.any():
                yield Step(vector, loss, DONE)
                return
            scale = ask.problem.layout.scale(vector)[member]
            g = slope[member] * scale
            H = gram[np.ix_(member, member)] * np.outer(scale, scale)
            while True:
                step, held = within(H, g, radius)
                trial = vector.copy()
                trial[member] += step * scale
                trial = np.clip(trial, -farthest, farthest)
                new = ask.loss(trial, frames)
                small = bool(np.max(np.abs(step)) < self.tolerance)
                if new <= loss:
                    break
                radius = 0.25 * float(np.linalg.norm(step))
                if small:
                    yield Step(vector, loss, FLAT if held else DONE)
                    return
            predicted = -(g @ step + 0.5 * step @ H @ step)
            gained = (loss - new) / max(predicted, 1e-300)
            if gained < 0.25:
                radius = 0.5 * float(np.linalg.norm(step))
            elif gained > 0.75 and held:
                radius = min(2 * radius, self.longest)
            vector = trial
            yield Step(vector, new, (FLAT if held else DONE) if small else "")
            if small:
                return


@dataclass(frozen=True)
class LBFGS:
    """L-BFGS with a line search (SciPy's; Zhu et al. 1997), by reverse mode. For many numbers and a
    loss without noise.

    Attributes:
        iterations: at most.
        tolerance: converged when the loss falls by less than this share of itself.
        memory: steps that are remembered.
    """

    type: ClassVar[str] = "l-bfgs"
    iterations: int = 100
    tolerance: float = 1e-6
    memory: int = 10

    def run(self, ask: Evaluator, vector, free: np.ndarray, frames: int) -> Iterator[Step]:
        """As `GaussNewton.run`. Neighbours are found once, at the start."""
        ask.match(vector)
        scale = ask.problem.layout.scale(vector) * free
        loss, _ = ask.gradient(vector, frames)
        if not np.isfinite(loss):
            yield Step(vector, loss, FAILED)
            return
        size = max(abs(loss), 1e-300)
        best: dict[str, Any] = {"loss": loss, "vector": vector}

        def function(place):
            here = vector + place * scale
            loss, slope = ask.gradient(here, frames)
            if loss < best["loss"]:
                best.update(loss=loss, vector=here)
            # A failed simulation is a wall that the line search turns back from.
            loss = min(loss, 1e6 * size)
            return loss / size, slope * scale / size

        farthest = ask.problem.layout.farthest()
        unit = np.where(scale > 0, scale, 1.0)
        low, high = (-farthest - vector) / unit, (farthest - vector) / unit
        steps: list[Step] = []
        found = minimize(
            function,
            np.zeros(len(vector)),
            jac=True,
            method="L-BFGS-B",
            bounds=list(zip(low, high, strict=True)),
            callback=lambda _: steps.append(Step(best["vector"], best["loss"])),
            options={
                "maxiter": self.iterations,
                "ftol": self.tolerance,
                "gtol": 1e-12,
                "maxcor": self.memory,
            },
        )
        yield from steps
        reason = DONE if found.success else str(found.message).lower()
        yield Step(best["vector"], best["loss"], reason)


@dataclass(frozen=True)
class Adam:
    """Adam with a cosine schedule (Kingma and Ba 2015), by reverse mode. For very many numbers,
    pictures, and losses with noise.

    Attributes:
        iterations: exactly.
        rate: of the first steps, in units of what is much.
        match_every: iterations between finding neighbours again.
    """

    type: ClassVar[str] = "adam"
    iterations: int = 200
    rate: float = 0.05
    match_every: int = 5

    def run(self, ask: Evaluator, vector, free: np.ndarray, frames: int) -> Iterator[Step]:
        """As `GaussNewton.run`, but that a step may be worse than the one before."""
        optimiser = optax.adam(optax.cosine_decay_schedule(self.rate, self.iterations, 0.01))
        scale = ask.problem.layout.scale(vector) * free
        place = np.zeros(len(vector), np.float32)
        state = optimiser.init(place)
        failures, farthest = 0, ask.problem.layout.farthest()
        for iteration in range(self.iterations):
            here = np.clip(vector + np.asarray(place, np.float64) * scale, -farthest, farthest)
            if iteration % self.match_every == 0:
                ask.match(here)
            loss, slope = ask.gradient(here, frames)
            if not (np.isfinite(loss) and np.all(np.isfinite(slope))):
                failures += 1
                if failures > 3 or iteration == 0:
                    yield Step(here, loss, FAILED if iteration == 0 else "the simulation fails")
                    return
                place = np.asarray(place) * 0.5  # half way back
                continue
            updates, state = optimiser.update(np.asarray(slope * scale, np.float32), state)
            place = optax.apply_updates(place, updates)
            yield Step(here, loss, DONE if iteration == self.iterations - 1 else "")


Search = GaussNewton | LBFGS | Adam


def chosen(size: int, squares: bool, pictures: bool) -> tuple[Search, str]:
    """The search that costs least for so many numbers, and why.

    Args:
        size: how many numbers are free.
        squares: whether the loss is a sum of squares.
        pictures: whether pictures are compared, whose loss is rough.
    """
    if squares and size <= 12:
        return GaussNewton(), f"{size} free numbers: a forward derivative for each is cheapest"
    if pictures or not squares:
        why = "pictures" if squares else "a loss that is no sum of squares"
        return Adam(), f"{size} free numbers and {why}: one reverse derivative a step"
    return LBFGS(), f"{size} free numbers: one reverse derivative a step, with a line search"
