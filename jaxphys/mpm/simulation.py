"""A simulation ready to run: program, numbers and start, and the same one with other numbers."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import partial
from itertools import pairwise
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array

from jaxphys.mpm.boundaries import Setting
from jaxphys.mpm.changes import (
    Layout,
    gravity_of,
    is_traced,
    parameter,
    with_boundaries,
    with_friction,
    with_parameters,
    with_start,
)
from jaxphys.mpm.loop.rigid_body import free_one, pose_of
from jaxphys.mpm.materials.parameters import DENSITY
from jaxphys.mpm.motion import BodyFrame, Frame
from jaxphys.mpm.state import OK, Config, Model, State
from jaxphys.mpm.stepping import Fixed, Stepping
from jaxphys.mpm.stepping.frame_steps import frame_steps

FIXED = Fixed()
# What `Simulation.with_` takes beside the parameters of the materials.
NAMES = {
    "position",
    "velocity",
    "spin",
    "affine",
    "deformation",
    "gravity",
    "density",
    "friction",
    "boundaries",
}


@partial(
    jax.tree_util.register_dataclass,
    data_fields=("model", "state", "order", "carriers"),
    meta_fields=("config", "counts", "dt", "steps", "given_substep", "stepping"),
)
@dataclass(frozen=True)
class Simulation:
    """Matter, what happens to it, and how it is stepped. A pytree: what a gradient may reach is
    data, the rest static.

    Attributes:
        model, state: what the solver runs, in the solver's order; the state at time 0.
        order: where the solver keeps each particle, int32 (N,): particle p of the object is
            column `order[p]` of the state.
        carriers: which particle, in the object's order, carries each drawn point, int32 (K,).
        config: the solver's program.
        counts: particles of each object; objects follow one another in the object's order.
        dt: time step [s], of fixed steps; of implicit ones the time of a frame.
        steps: fixed time steps a frame.
        given_substep: the largest step that was asked for [s], or None: as the bounds allow.
        stepping: how a frame is stepped through: `Fixed()`, `Adaptive()` or `Implicit()`.
    """

    model: Model
    state: State
    order: Array
    carriers: Array
    config: Config
    counts: tuple[int, ...]
    dt: float
    steps: int
    given_substep: float | None = None
    stepping: Stepping = FIXED

    @property
    def frame_time(self) -> float:
        """Time between frames [s]."""
        return self.dt * self.steps

    @property
    def objects(self) -> tuple[tuple[int, int], ...]:
        """(start, stop) of each object's particles in the object's order."""
        return tuple(pairwise(np.cumsum([0, *self.counts]).tolist()))

    def frame(self, state: State, particles: Array | None = None) -> Frame:
        """A state as it is seen from outside: in the object's order, NaN where it failed.

        Args:
            state: of this simulation.
            particles: those to look at, in the object's order; None: all. Given `carriers`, the
                frame holds what is drawn and no more.
        """
        order = self.order if particles is None else self.order[particles]
        gradient = state.deformation if state.total is None else state.total
        # A product, not a choice: a choice would send a finite zero back as the gradient.
        sound = jnp.where(state.status.code == OK, 1, jnp.nan).astype(state.position.dtype)
        carriers = self.carriers
        if particles is not None:
            carriers = jnp.arange(len(particles), dtype=jnp.int32)
        return Frame(
            jnp.moveaxis(state.position[:, order], -1, 0) * sound,
            jnp.moveaxis(gradient[:, :, order], -1, 0) * sound,
            state.time,
            state.status,
            carriers,
            self._body(state, sound),
        )

    def _body(self, state: State, sound: Array) -> BodyFrame | None:
        free = free_one(self.model.boundaries)
        if free is None or state.rigid is None:
            return None
        place = pose_of(free, state.rigid)
        return BodyFrame(place.centre * sound, place.orientation * sound)

    def with_(
        self,
        *,
        position=None,
        velocity=None,
        spin=None,
        affine=None,
        deformation=None,
        gravity=None,
        density=None,
        friction=None,
        boundaries: Mapping[int, Mapping[str, Any]] | None = None,
        **parameters,
    ) -> "Simulation":
        """The same simulation with other numbers, which may be traced and differentiated.

        Numbers that are known are checked against their ranges, and the time step follows them.
        Traced ones cannot be: a step that they break shows in the status of the motion.

        Args:
            position: at the start [m], (N, 3). Boundaries that act on chosen particles choose anew.
            velocity: at the start [m/s], (3,) for all particles or (N, 3); motion about a
                particle's own middle (`State.affine`) is set to zero.
            spin: at the start, of each object about its centre of mass [rad/s], (3,) for all
                objects or (K, 3), on top of `velocity`, or of what the object moves as a whole.
            affine: velocity gradients about particles' own middles at the start [1/s], (3, 3) or
                (N, 3, 3), instead of those of `velocity` and `spin`.
            deformation: gradients F at the start, with det F > 0, (3, 3) or (N, 3, 3).
            gravity: (3,) [m/s^2].
            density: [kg/m^3], a number or (N,).
            friction: Coulomb's coefficient of every boundary that has one, and between objects if
                their contact has.
            boundaries: other numbers of single boundaries, by their place in the scene's list, such
                as `{0: {"point": (0.0, 0.0, 0.2)}}`. Where these say which particles are meant,
                they are chosen anew; a choice has no slope, so it adds nothing to a gradient. Drawn
                obstacles follow by `look.following(simulation.model.boundaries)`.
            parameters: of the materials, such as `youngs_modulus`: a number or (N,).

        Arrays (N,) and (N, 3) are in the object's order: each object's Gaussians as they were
        given, then what fills it, object after object.

        Raises:
            InputError: a name that nothing here has, a value out of range, or a wrong shape.
        """
        model, state = self.model, self.state
        layout = Layout(self.order, self.objects, state.position.dtype)
        if density is not None:
            mass = model.volume * parameter(layout, DENSITY, density)
            model = replace(model, mass=mass)
        if gravity is not None:
            model = replace(model, gravity=gravity_of(layout, gravity))
        model = with_parameters(self.config, model, layout, parameters, NAMES)
        start = (position, velocity, spin, affine, deformation)
        state = with_start(self.config, model, state, layout, *start)
        if friction is not None:
            model = with_friction(model, layout, friction)
        setting = Setting(self.config.grid, state.position.T, model.volume, layout.dtype)
        moved = position is not None
        listed = with_boundaries(model.boundaries, setting, boundaries or {}, friction, moved)
        free = free_one(listed)
        if free is not None and (friction is not None or boundaries is not None):
            state = state._replace(rigid=free.body(listed))
        return replace(self, model=replace(model, boundaries=listed), state=state)._with_step()

    def _with_step(self) -> "Simulation":
        """With the time step that the numbers allow, where all of them are known."""
        if any(is_traced(leaf) for leaf in jax.tree.leaves((self.model, self.state))):
            return self
        dt, steps = frame_steps(
            self.stepping,
            self.config,
            self.model,
            self.state,
            self.frame_time,
            self.given_substep,
        )
        return replace(self, dt=dt, steps=steps)
