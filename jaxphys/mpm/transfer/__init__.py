"""Between particles and grid: the kernel, the stencil, the sums, their tangents and transposes."""

from .kernel import base_node as base_node
from .kernel import inside as inside
from .kernel import weights as weights
from .stencil import Stencil as Stencil
from .stencil import Window as Window
from .stencil import stencil as stencil
from .sums import gather as gather
from .sums import gather_slopes as gather_slopes
from .sums import gather_tangent as gather_tangent
from .sums import scatter as scatter
from .sums import scatter_tangent as scatter_tangent
from .sums import scatter_transpose as scatter_transpose
