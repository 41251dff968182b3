"""What particles give to the grid and take from it.

With w and d = x_i - x_p of the kernel, a particle gives momentum and gathers velocity,

    m_i v_i = sum_p w m_p (v_p + a C_p d),      v_i' the same after forces and boundaries,
    u_p = sum_i w v_i',    B_p = sum_i w v_i' d^T,    C_p' = inverse_inertia / dx^2 B_p,
    v_p' = u_p + b (v_p - sum_i w v_i),
    x_p' = x_p + dt u_p,    F_p' = (I + dt C_p') F_p,

where a is 1 with an affine part and 0 without, and the blend b is how much of its own velocity a
particle keeps. PIC: a = b = 0 (Harlow 1964); FLIP: a = 0 (Brackbill and Ruppel 1986; blended with
PIC, Zhu and Bridson 2005); APIC: a = 1, b = 0 (Jiang et al. 2015); affine FLIP: a = 1 (Fei et al.
2021, AFLIP). Particles move with the grid, by u_p, in all of them. It is what Fei et al. take for
AFLIP and FLIP: what v_p has beyond u_p the grid cannot see, and no force holds it.
"""

from dataclasses import dataclass, field
from typing import ClassVar, get_args

from jaxphys.core.errors import InputError, shown
from jaxphys.core.fields import Checked, between, one_of
from jaxphys.mpm.transfer.kernels import KERNELS, Kernel, KernelName

SHARE = between(0, 1)


@dataclass(frozen=True)
class PIC(Checked):
    """Velocities are those of the grid. Keeps momentum, damps all that is not uniform."""

    type: ClassVar[str] = "pic"
    affine: ClassVar[bool] = False
    blend: ClassVar[float] = 0.0


@dataclass(frozen=True)
class FLIP(Checked):
    """Velocities change by what those of the grid change by.

    Attributes:
        blend: share of that, the rest being PIC; 1 for no damping and all the noise.
    """

    type: ClassVar[str] = "flip"
    affine: ClassVar[bool] = False
    blend: float = field(default=0.99, metadata=SHARE)


@dataclass(frozen=True)
class APIC(Checked):
    """Velocities are those of the grid, and so are their gradients. Keeps angular momentum."""

    type: ClassVar[str] = "apic"
    affine: ClassVar[bool] = True
    blend: ClassVar[float] = 0.0


@dataclass(frozen=True)
class AFLIP(Checked):
    """FLIP with the velocity gradients of APIC.

    Attributes:
        blend: share of FLIP, the rest being APIC.
    """

    type: ClassVar[str] = "aflip"
    affine: ClassVar[bool] = True
    blend: float = field(default=0.99, metadata=SHARE)


Scheme = PIC | FLIP | APIC | AFLIP


@dataclass(frozen=True)
class Transfer(Checked):
    """How particles and grid exchange velocities. Part of the program.

    Attributes:
        scheme: PIC(), FLIP(blend), APIC() or AFLIP(blend).
        kernel: "quadratic" or "cubic" B-splines.
    """

    scheme: Scheme = APIC()
    kernel: KernelName = field(default="quadratic", metadata=one_of(KernelName))

    def __post_init__(self):
        super().__post_init__()
        if not isinstance(self.scheme, Scheme):
            known = ", ".join(f"{one.__name__}()" for one in get_args(Scheme))
            raise InputError(f"scheme: {shown(self.scheme)} is none of {known}")

    @property
    def spline(self) -> Kernel:
        """The kernel itself."""
        return KERNELS[self.kernel]

    @property
    def keeps_velocity(self) -> bool:
        """Whether a particle has a velocity that the grid does not, from one step to the next."""
        return self.scheme.blend > 0
