"""Between particles and grid: kernels, schemes, stencils; sums, their tangents and transposes."""

from .kernels import Kernel as Kernel
from .schemes import AFLIP as AFLIP
from .schemes import APIC as APIC
from .schemes import FLIP as FLIP
from .schemes import PIC as PIC
from .schemes import Transfer as Transfer
from .stencil import Stencil as Stencil
from .stencil import Window as Window
from .stencil import stencil as stencil
from .sums import gather as gather
from .sums import gather_slopes as gather_slopes
from .sums import gather_tangent as gather_tangent
from .sums import scatter as scatter
from .sums import scatter_tangent as scatter_tangent
from .sums import scatter_transpose as scatter_transpose
from .sums import vectors_of as vectors_of
