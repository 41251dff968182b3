"""What a constitutive law is to the solver."""

from collections.abc import Callable
from dataclasses import dataclass

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
        energy: (parameters, F (3, 3, ...)) -> stored energy per rest volume [J/m^3] without damage,
            shape (...).
        principal_energy: (parameters, singular values of F (3, ...), the smallest one negative
            where F is inverted) -> the same energy; the time step bound differentiates it.
        plastic: whether `update` may return another F than it was given.
    """

    name: str
    parameters: tuple[str, ...]
    history: tuple[float, ...]
    history_names: tuple[str, ...]
    update: Callable[[Parameters, Array, Array], tuple[Array, Array, Array]]
    energy: Callable[[Parameters, Array], Array]
    principal_energy: Callable[[Parameters, Array], Array]
    plastic: bool

    def __repr__(self) -> str:
        return f"Law({self.name!r})"
