"""What a fit minimises: from a vector of free numbers to residuals and a loss, as pure functions.

    vector --layout--> simulation, look --motion--> frames --observations--> residuals --> loss

`Problem.loss` and `Problem.residuals` serve by themselves: jit them, differentiate them, hand them
to another search.
"""

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from functools import partial
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array

from jaxphys.core.errors import InputError
from jaxphys.fitting.layout import Layout
from jaxphys.fitting.motion import CHECKPOINTED, MOST_STEPS, motion_at, some, steps_for
from jaxphys.fitting.observed.base import Observed
from jaxphys.fitting.observed.own import Own
from jaxphys.fitting.observed.pictures import Seen
from jaxphys.mpm.loop.adjoint import Adjoint
from jaxphys.mpm.motion import Motion
from jaxphys.mpm.simulation import Simulation
from jaxphys.mpm.state import OK
from jaxphys.scene.look import Look


@dataclass(frozen=True)
class Program:
    """How the motion of some numbers is computed and drawn.

    Attributes:
        steps: between two of the times.
        capacities: pairs of tile and splat, of each observation; 0 where nothing is drawn.
    """

    steps: int
    capacities: tuple[int, ...]


class Comparison(NamedTuple):
    """What a vector gives: the motion at the times, what is drawn of it, the residuals of each
    observation and field, and the loss that these are.
    """

    motion: Motion
    look: Look | None
    residuals: list[Array]
    loss: Array


@dataclass(frozen=True, eq=False)
class Problem:
    """A simulation, what is free of it, and what was observed.

    Attributes:
        simulation, look: with the numbers that are not free.
        layout: of the free ones.
        observed: checked.
        times: of all observations together [s].
        adjoint: for reverse mode.
        steps: between two of the times; None: as many as the numbers of a trial need.
    """

    simulation: Simulation
    look: Look | None
    layout: Layout
    observed: tuple[Observed, ...]
    times: tuple[float, ...]
    adjoint: Adjoint = CHECKPOINTED
    steps: int | None = None
    _compiled: dict = field(default_factory=dict, repr=False)

    @property
    def squares(self) -> bool:
        """Whether the loss is a sum of squares, as Gauss-Newton wants it."""
        return not any(isinstance(one, Own) and one.is_loss for one in self.observed)

    def observing(self, observed: tuple[Observed, ...]) -> "Problem":
        """The same problem with other numbers seen, of the same kinds, times and shapes, which
        shares compiled programs: for many fits of one scene.

        Raises:
            InputError: something else differs than what was seen.
        """
        made = replace(self, observed=observed)
        for one in observed:
            one.check(self.simulation, self.look, None)
        kinds = [(type(one), tuple(np.asarray(one.times, float))) for one in self.observed]
        shapes = jax.tree.map(jnp.shape, self.data())
        if kinds != [(type(one), tuple(np.asarray(one.times, float))) for one in observed]:
            raise InputError("observed: other kinds or times than the problem was made for")
        if shapes != jax.tree.map(jnp.shape, made.data()):
            raise InputError("observed: other shapes than the problem was made for")
        return made

    def data(self) -> tuple[Any, ...]:
        """What the residuals are computed from: a pytree of arrays."""
        return tuple(one.data(self.simulation, self.look) for one in self.observed)

    def changed(self, vector: Array) -> tuple[Simulation, Look | None]:
        """The simulation and what is drawn of it, with the numbers of `vector`."""
        return self.layout.applied(self.simulation, self.look, vector)

    def frames_of(self, one: Observed) -> np.ndarray:
        """Which of the times an observation has, (T,) of its own."""
        return np.searchsorted(self.times, np.asarray(one.times, np.float64))

    def motion(self, vector: Array, horizon, program: Program) -> tuple[Motion, Look | None]:
        """The motion at the times, the first `horizon` of them, and what is drawn of it."""
        simulation, look = self.changed(vector)
        return motion_at(simulation, self.times, program.steps, self.adjoint, horizon), look

    def residuals(self, vector: Array, data: tuple, horizon, program: Program) -> list[Array]:
        """Of each observation, zero from the `horizon`-th of all times on, and of the roughness of
        each field.
        """
        motion, look = self.motion(vector, horizon, program)
        return self.residuals_of(motion, look, vector, data, horizon, program)

    def residuals_of(
        self, motion: Motion, look: Look | None, vector: Array, data, horizon, program: Program
    ) -> list[Array]:
        """The residuals of a motion at the times."""
        found = []
        for one, own, capacity in zip(self.observed, data, program.capacities, strict=True):
            which = self.frames_of(one)
            seen = some(motion, which)
            if isinstance(one, Seen):
                part = one.residuals(seen, look, own, capacity)
            else:
                part = one.residuals(seen, look, own)
            if part.ndim:
                within = (which < horizon).reshape(-1, *[1] * (part.ndim - 1))
                part = jnp.where(within, part, 0)
            found.append(part)
        return [*found, *self.layout.roughness(vector)]

    def loss(self, vector: Array, data: tuple, horizon, program: Program) -> Array:
        """Half the sum of the squares of the residuals, and losses of one's own, (). NaN where the
        simulation fails.
        """
        return self.loss_of(self.residuals(vector, data, horizon, program))

    def loss_of(self, residuals: list[Array]) -> Array:
        """The loss that residuals are, ()."""
        total = jnp.zeros((), self.simulation.model.mass.dtype)
        for i, part in enumerate(residuals):
            one = self.observed[i] if i < len(self.observed) else None
            is_loss = isinstance(one, Own) and one.is_loss
            total = total + (jnp.sum(part) if is_loss else 0.5 * jnp.sum(part**2))
        return total

    # On the host: which program, and the programs.

    def program(self, vector: np.ndarray, before: Program | None = None) -> Program:
        """The program for the numbers of `vector`: that of `before` where it still serves.

        Raises:
            InputError: the numbers give no bound to the time step.
        """
        simulation, look = self.changed(self.cast(vector))
        longest = float(np.max(np.diff([0.0, *self.times])))
        steps = self.steps or steps_for(simulation, longest)
        if before is not None and steps <= before.steps <= 4 * steps:
            return before
        if before is not None:
            return Program(steps, before.capacities)
        program = Program(steps, (0,) * len(self.observed))
        if not any(isinstance(one, Seen) for one in self.observed):
            return program
        motion, look = self.call("motion", program)(self.cast(vector), len(self.times))
        sound = np.flatnonzero(np.asarray(motion.status.code) == OK)
        good = some(motion, sound if len(sound) else np.array([0]))
        return Program(steps, self.capacities(good, look))

    def capacities(self, motion: Motion, look: Look | None) -> tuple[int, ...]:
        """The room that drawing a motion takes, for each observation; 0 where nothing is drawn."""
        return tuple(
            one.capacity(motion, look) if isinstance(one, Seen) and look is not None else 0
            for one in self.observed
        )

    def cast(self, vector) -> Array:
        """A vector in the simulation's dtype."""
        return jnp.asarray(vector, self.simulation.model.mass.dtype)

    def compare(self, vector, data: tuple, horizon: int, program: Program) -> Comparison:
        """What a vector gives, on the host. The motion's program serves any number of steps and
        any room for drawing, and that which compares any motion.
        """
        vector = self.cast(vector)
        motion, look = self.call("motion", program)(vector, horizon)
        residuals, loss = self.call("compared", program)(motion, look, vector, data, horizon)
        return jax.device_get(Comparison(motion, look, residuals, loss))

    def call(self, name: str, program: Program):
        """A compiled function: "gradient" or "normal" of (vector, data, horizon); "motion" of
        (vector, horizon); "compared" of (motion, look, vector, data, horizon): residuals and loss.

        Reverse mode is compiled for a number of steps, all else for any.
        """
        room = program.capacities
        fixed = {"gradient": program, "motion": (), "compared": room, "normal": room}[name]
        if (name, fixed) not in self._compiled:
            self._compiled[name, fixed] = self._made(name, program)
        compiled = self._compiled[name, fixed]
        return compiled if name == "gradient" else partial(compiled, program.steps)

    def _made(self, name: str, program: Program) -> Callable:
        if name == "gradient":
            return jax.jit(jax.value_and_grad(partial(self.loss, program=program)))
        functions: dict[str, Callable] = {
            "motion": self.motion,
            "compared": self._compared,
            "normal": self.normal,
        }
        function = functions[name]

        def of_any_steps(steps, *given):
            return function(*given, program=Program(steps, program.capacities))

        return jax.jit(of_any_steps)

    def _compared(self, motion, look, vector, data, horizon, program: Program):
        residuals = self.residuals_of(motion, look, vector, data, horizon, program)
        return residuals, self.loss_of(residuals)

    def normal(self, vector: Array, data: tuple, horizon, program: Program):
        """(loss, J^T r (P,), J^T J (P, P)) of the residuals r and their derivatives J, by forward
        mode: a column for each free number.
        """

        def columns(direction):
            return jax.jvp(
                lambda v: self.residuals(v, data, horizon, program), (vector,), (direction,)
            )

        directions = jnp.eye(len(vector), dtype=vector.dtype)
        residuals, slopes = jax.vmap(columns, out_axes=(None, 0))(directions)
        slope, gram = jnp.zeros_like(vector), jnp.zeros_like(directions)
        loss = jnp.zeros((), vector.dtype)
        for r, J in zip(residuals, slopes, strict=True):
            J = J.reshape(len(vector), -1)
            loss = loss + 0.5 * jnp.sum(r**2)
            slope = slope + J @ r.ravel()
            gram = gram + J @ J.T
        return loss, slope, gram

    def matched(self, vector: np.ndarray, data: tuple, program: Program) -> tuple:
        """`data` with neighbours found again, where an observation has any."""
        if all(type(one).matched is Observed.matched for one in self.observed):
            return data
        motion, look = self.call("motion", program)(self.cast(vector), len(self.times))
        return self.matched_to(jax.device_get(motion), look, data)

    def matched_to(self, motion: Motion, look: Look | None, data: tuple) -> tuple:
        """`data` with neighbours found again for a motion at the times, if that is sound."""
        if np.any(motion.status.code != OK):
            return data
        return tuple(
            one.matched(some(motion, self.frames_of(one)), look, own)
            for one, own in zip(self.observed, data, strict=True)
        )


def problem(
    simulation: Simulation,
    layout: Layout,
    observed: tuple[Observed, ...],
    *,
    look: Look | None = None,
    end: float | None = None,
    adjoint: Adjoint = CHECKPOINTED,
    steps: int | None = None,
) -> Problem:
    """A problem, its observations checked.

    Raises:
        InputError: nothing was observed, or an observation does not fit, named by frame and field.
    """
    if not observed:
        raise InputError("observed: nothing was observed; give Tracks, Points, Masks or Images")
    for one in observed:
        if not isinstance(one, Observed):
            raise InputError(f"observed: {one!r} is none of Tracks, Points, Masks, Images, Own")
        one.check(simulation, look, end)
    times = sorted({float(t) for one in observed for t in np.asarray(one.times, np.float64)})
    if times[-1] == 0:
        raise InputError("observed: all of it is at time 0, before anything has moved")
    if steps is not None and not 1 <= steps <= MOST_STEPS:
        raise InputError(f"steps: is {steps}; give 1 to {MOST_STEPS} between two of the times")
    return Problem(simulation, look, layout, observed, tuple(times), adjoint, steps)
