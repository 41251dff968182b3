"""Water and other weakly compressible fluids: pressure from the volume, and Newton's viscosity."""

from jax import Array

from jaxphys.mpm.materials.deriving import law_of_volume
from jaxphys.mpm.materials.law import Parameters
from jaxphys.mpm.materials.parameters import BULK_MODULUS, Parameter

GAMMA = 7
VISCOSITY = Parameter(
    "viscosity",
    "shear stress over shear rate of what flows however little it is pushed: of water 0.001, of "
    "honey 10",
    "Pa s",
    low_included=True,
)


def tait_energy(parameters: Parameters, J: Array) -> Array:
    """Stored energy per rest volume [J/m^3], (...), of the volume J over that at rest, (...), whose
    pressure is Tait's, p = K / 7 (J^-7 - 1) (Monaghan 1994, eq. 2).

    It resists compression ever more, and being pulled apart by no more than K / 7.
    """
    return parameters["bulk_modulus"] / GAMMA * (J ** (1 - GAMMA) / (GAMMA - 1) + J - 7 / 6)


def _rest(parameters: Parameters) -> tuple[Array, Array]:
    return parameters["bulk_modulus"], 3 * parameters["bulk_modulus"]


def _viscosity(parameters: Parameters) -> Array:
    return parameters["viscosity"]


INVISCID = law_of_volume(
    "fluid without viscosity",
    (BULK_MODULUS,),
    tait_energy,
    rest=_rest,
    omits=("viscosity",),
)
FLUID = law_of_volume(
    "Newtonian fluid",
    (BULK_MODULUS, VISCOSITY),
    tait_energy,
    viscosity=_viscosity,
    rest=_rest,
    without=(("viscosity", INVISCID),),
)
