"""What a constitutive law is to the solver."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np
from jax import Array

Parameters = dict[str, Array]


@dataclass(frozen=True)
class Law:
    """A constitutive law: what turns a particle's deformation into stress. Static: no arrays.

    Attributes:
        name: what messages call it.
        parameters: names of the per-particle parameters that it reads, each an array that
            broadcasts against (...).
        history: initial value of each scalar history variable; empty for a law without memory.
        history_names: their names, in the same order.
        update: (parameters, F_trial (3, 3, ...), history (H, ...)) -> (F (3, 3, ...),
            kirchhoff_stress (3, 3, ...) [Pa], history (H, ...)). Return map and stress together,
            with at most one eigen-decomposition. The stress is symmetric, and it is tau = J sigma,
            so that the force on a node carries it times the rest volume.
        energy: (parameters, F (3, 3, ...), history (H, ...)) -> stored energy per rest volume
            [J/m^3], shape (...), of an F and a history that `update` gave; the stress that it gave
            with them is this energy's derivative.
        principal_energy: (parameters, singular values of F (3, ...), the smallest one negative
            where F is inverted) -> the same energy of matter without damage, which is the stiffest;
            the time step bound differentiates it.
        plastic: whether `update` may return another F than it was given.
        spectral: whether `update` decomposes F F^T into principal stretches.
        breaks: whether it loses its tension for good, so that pieces are worth counting.
        without: (parameter, law) pairs: the law that this one becomes where the parameter is zero.
        omits: parameters that this law leaves out of the program, being such a one.
    """

    name: str
    parameters: tuple[str, ...]
    history: tuple[float, ...]
    history_names: tuple[str, ...]
    update: Callable[[Parameters, Array, Array], tuple[Array, Array, Array]]
    energy: Callable[[Parameters, Array, Array], Array]
    principal_energy: Callable[[Parameters, Array], Array]
    plastic: bool
    spectral: bool = False
    breaks: bool = False
    without: tuple[tuple[str, "Law"], ...] = ()
    omits: tuple[str, ...] = ()

    def reduced(self, values: Mapping) -> "Law":
        """The law that does the same for these values of its parameters, numbers or arrays, and
        traces no more than they need.
        """
        for name, simpler in self.without:
            if not np.any(values[name]):
                return simpler.reduced(values)
        return self

    def __repr__(self) -> str:
        return f"Law({self.name!r})"
