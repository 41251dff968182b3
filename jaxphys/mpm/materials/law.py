"""What a constitutive law is to the solver."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass

import jax.numpy as jnp
import numpy as np
from jax import Array

from jaxphys.mpm.materials.parameters import Alternative, Parameter

Parameters = dict[str, Array]


def as_they_are(parameters: Parameters) -> Parameters:
    """Nothing of them is worth working out beforehand."""
    return parameters


@dataclass(frozen=True)
class Law:
    """A constitutive law: what turns a particle's deformation into stress. Static: no arrays.

    Its functions are written for one particle, element by element, and serve (3, 3, ...) alike.

    Attributes:
        name: what messages call it.
        declared: the per-particle parameters that it reads; arrays that broadcast against (...).
        history: initial value of each scalar history variable; empty for a law without memory.
        history_names: their names, in the same order.
        update: (parameters, F_trial (3, 3, ...), history (H, ...), dt) -> (F (3, 3, ...),
            kirchhoff_stress (3, 3, ...) [Pa], history (H, ...)). Return map and stress together,
            with at most one eigen-decomposition. The stress is symmetric, and it is tau = J sigma,
            so that the force on a node carries it times the rest volume. dt: the time [s] over
            which F became F_trial; only laws whose stress depends on rates read it.
        energy: (parameters, F (3, 3, ...), history (H, ...)) -> stored energy per rest volume
            [J/m^3], shape (...), of an F and a history that `update` gave; what of the stress that
            it gave with them is no friction is this energy's derivative. None for a law that
            stores none.
        principal_energy: (parameters, singular values of F (3, ...), the smallest one negative
            where F is inverted) -> the same energy of matter without damage, which is the stiffest;
            the bounds on the time step differentiate it. None for a law whose stiffness depends on
            directions in the matter, which must then say its `moduli`.
        plastic: whether `update` may return another F than it was given.
        spectral: whether `update` decomposes F F^T into principal stretches.
        breaks: whether it loses its tension for good, so that pieces are worth counting.
        without: (parameter, law) pairs: the law that this one becomes where the parameter is zero.
        omits: parameters that this law leaves out of the program, being such a one.
        shares_volume: whether its stress is that of the mean volume around a particle
            (`mean_volume`): the loop then writes the one row of its history, log(Jm / J).
        trial: (parameters, F (3, 3, ...), history) -> Kirchhoff stress (3, 3, ...) [Pa] of an F
            that flows no further: the derivative of `energy` while the history stands still, for
            implicit steps. None: the stress that `update` gives, or of a plastic law the derivative
            of `principal_energy`.
        alternatives: other ways to give some of its parameters.
        prepare: adds to the parameters what no step should work out again; doing it twice does
            nothing.
        rest: parameters -> (wave, lone) moduli at rest [Pa], as `stepping.bounds.moduli` gives
            them; None: those, by differentiation. The wave modulus is also what contact is as
            stiff as.
        moduli: (parameters, F) -> (wave, lone) moduli of the deformed state [Pa], in place of those
            of `principal_energy`.
        hardened: (parameters, history) -> the parameters that the energy has at that history, for a
            law that gets stiffer or softer.
        viscosity: parameters -> dynamic viscosity [Pa s] of a stress that is explicit in the rate
            of strain, which bounds the time step on its own.
    """

    name: str
    declared: tuple[Parameter, ...]
    history: tuple[float, ...]
    history_names: tuple[str, ...]
    update: Callable[[Parameters, Array, Array, Array], tuple[Array, Array, Array]]
    energy: Callable[[Parameters, Array, Array], Array] | None
    principal_energy: Callable[[Parameters, Array], Array] | None
    plastic: bool
    spectral: bool = False
    breaks: bool = False
    shares_volume: bool = False
    without: tuple[tuple[str, "Law"], ...] = ()
    omits: tuple[str, ...] = ()
    alternatives: tuple[Alternative, ...] = ()
    prepare: Callable[[Parameters], Parameters] = as_they_are
    rest: Callable[[Parameters], tuple[Array, Array]] | None = None
    moduli: Callable[[Parameters, Array], tuple[Array, Array]] | None = None
    hardened: Callable[[Parameters, Array], Parameters] | None = None
    viscosity: Callable[[Parameters], Array] | None = None

    trial: Callable[[Parameters, Array, Array], Array] | None = None

    @property
    def parameters(self) -> tuple[str, ...]:
        """Names of the parameters that it reads."""
        return tuple(parameter.name for parameter in self.declared)

    def reduced(self, values: Mapping) -> "Law":
        """The law that does the same for these values of its parameters, numbers or arrays, and
        traces no more than they need.
        """
        for name, simpler in self.without:
            if not np.any(values[name]):
                return simpler.reduced(values)
        return self

    def at_start(self, like: Array) -> Array:
        """The history (H, ...) that it begins with, of particles `like` (...)."""
        initial = jnp.array(self.history, like.dtype).reshape(-1, *[1] * like.ndim)
        return jnp.broadcast_to(initial, (len(self.history), *like.shape))

    def present(self, parameters: Parameters, history: Array | None) -> Parameters:
        """The parameters that its energy has at a history (H, ...); None: as it began."""
        if self.hardened is None or history is None:
            return parameters
        return self.hardened(parameters, history)

    def __repr__(self) -> str:
        return f"Law({self.name!r})"
