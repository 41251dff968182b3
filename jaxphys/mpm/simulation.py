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

from jaxphys.core.errors import InputError, nearest
from jaxphys.mpm.materials.catalogue import check_parameter
from jaxphys.mpm.motion import Frame
from jaxphys.mpm.state import OK, Config, Model, State
from jaxphys.mpm.stepping.fixed import choose_substep


@partial(
    jax.tree_util.register_dataclass,
    data_fields=("model", "state", "order", "carriers"),
    meta_fields=("config", "counts", "dt", "steps", "given_substep"),
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
        dt: time step [s].
        steps: time steps a frame.
        given_substep: the largest step that was asked for [s], or None: as the bounds allow.
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
        )

    def with_(
        self,
        *,
        velocity=None,
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
            velocity: at the start [m/s], (3,) for all particles or (N, 3); motion about a
                particle's own middle (`State.affine`) is set to zero.
            gravity: (3,) [m/s^2].
            density: [kg/m^3], a number or (N,).
            friction: Coulomb's coefficient of every boundary that has one.
            boundaries: other numbers of single boundaries, by their place in the scene's list, such
                as `{0: {"point": (0.0, 0.0, 0.2)}}`.
            parameters: of the materials, such as `youngs_modulus`: a number or (N,).

        Arrays (N,) and (N, 3) are in the object's order: each object's Gaussians as they were
        given, then what fills it, object after object.

        Raises:
            InputError: a name that nothing here has, a value out of range, or a wrong shape.
        """
        model, state = self.model, self.state
        if density is not None:
            model = replace(model, mass=model.volume * self._per_particle("density", density))
        known = model.parameters
        omitted = {name for law, _, _ in self.config.segments for name in law.omits}
        for name, value in parameters.items():
            if name in omitted - set(known):
                raise InputError(
                    f"with_: {name} was built as 0, which leaves it out of the program; build the "
                    "scene with a positive one to change it"
                )
            if name not in known:
                names = {*known, "velocity", "gravity", "density", "friction", "boundaries"}
                raise InputError(f"with_: no material here has {name!r}; {nearest(name, names)}")
            model = replace(
                model, parameters=model.parameters | {name: self._per_particle(name, value)}
            )
        if gravity is not None:
            model = replace(model, gravity=_vector("gravity", gravity, model.mass.dtype))
        if friction is not None:
            model = replace(model, boundaries=_with_friction(model.boundaries, friction))
        if boundaries is not None:
            model = replace(model, boundaries=_with_numbers(model.boundaries, boundaries))
        if velocity is not None:
            state = state._replace(
                velocity=self._velocities(velocity), affine=jnp.zeros_like(state.affine)
            )
        return replace(self, model=model, state=state)._with_step()

    def _per_particle(self, name: str, value: Any) -> Array:
        """A number or (N,) in the object's order as (N,) in the solver's."""
        if not _is_traced(value):
            check_parameter(name, value, "with_")
        value = jnp.asarray(value, self.model.mass.dtype)
        count = self.config.particles
        if value.shape not in ((), (count,)):
            raise InputError(f"with_: {name} has shape {value.shape}; give a number or ({count},)")
        return jnp.broadcast_to(value, (count,)) if value.ndim == 0 else self._sorted(value)

    def _sorted(self, value: Array) -> Array:
        """(..., N) from the object's order into the solver's."""
        return jnp.zeros_like(value).at[..., self.order].set(value, unique_indices=True)

    def _velocities(self, velocity: Any) -> Array:
        like = self.state.velocity
        if not _is_traced(velocity) and not np.all(np.isfinite(np.asarray(velocity))):
            raise InputError("with_: velocity has entries that are not finite")
        velocity = jnp.asarray(velocity, like.dtype)
        count = self.config.particles
        if velocity.shape == (3,):
            return jnp.broadcast_to(velocity[:, None], like.shape)
        if velocity.shape != (count, 3):
            raise InputError(
                f"with_: velocity has shape {velocity.shape}; give (3,) or ({count}, 3)"
            )
        return self._sorted(velocity.T)

    def _with_step(self) -> "Simulation":
        """With the time step that the numbers allow, where all of them are known."""
        if any(_is_traced(leaf) for leaf in jax.tree.leaves((self.model, self.state))):
            return self
        dt, steps, _ = choose_substep(
            self.config,
            self.model,
            self.state,
            self.frame_time,
            self.given_substep,
        )
        return replace(self, dt=dt, steps=steps)


def _is_traced(value: Any) -> bool:
    return any(isinstance(leaf, jax.core.Tracer) for leaf in jax.tree.leaves(value))


def _vector(name: str, value: Any, dtype) -> Array:
    if not _is_traced(value) and not np.all(np.isfinite(np.asarray(value))):
        raise InputError(f"with_: {name} has entries that are not finite")
    value = jnp.asarray(value, dtype)
    if value.shape != (3,):
        raise InputError(f"with_: {name} has shape {value.shape}; give (3,)")
    return value


def _with_numbers(boundaries: tuple, changes: Mapping[int, Mapping[str, Any]]) -> tuple:
    made = list(boundaries)
    for index, values in changes.items():
        if index not in range(len(made)):
            raise InputError(f"with_: boundaries[{index}]: there are {len(made)}, counted from 0")
        try:
            made[index] = made[index].changed(**values)
        except InputError as error:
            raise InputError(f"with_: boundaries[{index}].{error}") from None
    return tuple(made)


def _with_friction(boundaries: tuple, friction: Any) -> tuple:
    rough = [i for i, b in enumerate(boundaries) if getattr(b, "friction", None) is not None]
    if not rough:
        raise InputError("with_: no boundary here has friction; build one with friction above 0")
    return _with_numbers(boundaries, {i: {"friction": friction} for i in rough})
