"""What every observation can do.

An observation turns a simulated motion into residuals: differences, divided by the noise that is
expected of them, so that half the sum of their squares is the negative logarithm of a likelihood
and several observations add up.
"""

from abc import ABC, abstractmethod
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np
from jax import Array

from jaxphys.core.errors import InputError
from jaxphys.mpm.motion import Motion
from jaxphys.mpm.simulation import Simulation
from jaxphys.scene.look import Look


@dataclass(frozen=True, eq=False)
class Observed(ABC):
    """Base of observations: T frames at `times` [s], increasing, from the start of the simulation.

    Attributes:
        noise: standard deviation that is expected of what was observed, in its units; None: a
            small share of it, which each kind says.
        weight: how much it counts beside other observations.
    """

    name: ClassVar[str]
    noise: float | None = field(default=None, kw_only=True)
    weight: float = field(default=1.0, kw_only=True)

    if TYPE_CHECKING:  # a field of each, behind what was seen

        @property
        def times(self) -> np.ndarray: ...

    def fail(self, field: str, text: str) -> InputError:
        """An error that names the observation and the field."""
        return InputError(f"{self.name}.{field}: {text}")

    def check(self, simulation: Simulation, look: Look | None, end: float | None) -> None:
        """Refuses what cannot be compared with the simulation.

        Args:
            simulation, look: what is fitted.
            end: of the run [s]; None: it may go on.

        Raises:
            InputError: naming the frame and the field.
        """
        times = np.asarray(self.times, np.float64)
        if times.ndim != 1 or not len(times):
            raise self.fail("times", f"has shape {times.shape}; give (T,) seconds")
        if not np.all(np.isfinite(times)):
            raise self.fail("times", f"frame {_first(~np.isfinite(times))} is not finite")
        if times[0] < 0 or np.any(np.diff(times) <= 0):
            bad = 0 if times[0] < 0 else int(np.argmax(np.diff(times) <= 0)) + 1
            raise self.fail("times", f"frame {bad} is at {times[bad]:g} s; give times from 0 on "
                            "that increase")  # fmt: skip
        if end is not None and times[-1] > end * (1 + 1e-6):
            raise self.fail("times", f"frame {len(times) - 1} is at {times[-1]:g} s, after the "
                            f"run ends at {end:g} s")  # fmt: skip
        if self.noise is not None and not self.noise > 0:
            raise self.fail("noise", f"is {self.noise}; give a number above 0")
        if not self.weight > 0:
            raise self.fail("weight", f"is {self.weight}; give a number above 0")
        self.check_own(simulation, look)

    unit: ClassVar[str] = ""

    @abstractmethod
    def noise_of(self, simulation: Simulation) -> float:
        """The noise that is expected, given or not."""

    def arranged(self, residuals: np.ndarray, simulation: Simulation):
        """(residuals, axes): with what lies beside each other next to each other, and the axes
        along which it does.
        """
        return residuals, (0,)

    @abstractmethod
    def check_own(self, simulation: Simulation, look: Look | None) -> None:
        """What is particular to a kind of observation. Raises `InputError`."""

    @abstractmethod
    def data(self, simulation: Simulation, look: Look | None) -> Any:
        """What the residuals are computed from, a pytree of arrays."""

    @abstractmethod
    def residuals(self, motion: Motion, look: Look | None, data: Any) -> Array:
        """Differences over their noise, any shape that begins with T.

        motion: the frames of this observation, T of them.
        """

    def matched(self, motion: Motion, look: Look | None, data: Any) -> Any:
        """`data` with what is held fixed between iterations, such as who is whose neighbour, found
        again for a motion. On the host.
        """
        return data


def _first(wrong: np.ndarray) -> int:
    return int(np.flatnonzero(wrong)[0])


def refuse_not_finite(observed: Observed, field: str, array: np.ndarray) -> None:
    """Raises `InputError` with the first frame of (T, ...) that holds a number that is not
    finite.
    """
    wrong = ~np.isfinite(array).reshape(len(array), -1).all(axis=1)
    if wrong.any():
        raise observed.fail(field, f"frame {_first(wrong)} has entries that are not finite")


def refuse_unknown(observed: Observed, particles: np.ndarray, count: int) -> None:
    """Raises `InputError` where `particles` are no (M,) whole numbers below `count`."""
    if particles.ndim != 1 or particles.dtype.kind not in "iu":
        raise observed.fail("particles", "give (M,) whole numbers")
    wrong = (particles < 0) | (particles >= count)
    if wrong.any():
        raise observed.fail("particles", f"{particles[wrong][0]} is none of the {count}")


def refuse_outside(observed: Observed, field: str, frame: int, points, simulation) -> None:
    """Raises `InputError` where points (M, 3) [m] of a frame lie outside of the domain."""
    extent = np.array(simulation.config.grid.extent)
    wrong = np.any((points < 0) | (points > extent), axis=-1)
    if wrong.any():
        place = np.asarray(points)[_first(wrong)]
        raise observed.fail(
            field,
            f"frame {frame}, point {_first(wrong)} at {np.round(place, 4).tolist()} m is outside "
            f"of the domain, which ends at {np.round(extent, 4).tolist()} m",
        )


def size_of(simulation: Simulation) -> float:
    """Length of the longest side of the bounding box of what is simulated, at rest [m]."""
    position = np.asarray(simulation.state.position)
    return float(np.max(position.max(axis=1) - position.min(axis=1)))
