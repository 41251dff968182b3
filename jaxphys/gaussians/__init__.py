"""3D Gaussians: the pytree, harmonics, files, meshes, density control, filling and colour."""

from .colour import ColourRange as ColourRange
from .colour import colour_range as colour_range
from .colour import regularise as regularise
from .colour import to_unit_interval as to_unit_interval
from .gaussians import Gaussians as Gaussians
from .gaussians import axes as axes
from .gaussians import concatenate as concatenate
from .gaussians import covariances as covariances
from .gaussians import from_points as from_points
from .gaussians import opacities as opacities
from .gaussians import opacity_to_logit as opacity_to_logit
from .gaussians import require_finite as require_finite
from .gaussians import scales as scales
from .gaussians import select as select
from .gaussians import to_splats as to_splats
from .gaussians import transform as transform
from .gaussians import view_colours as view_colours
from .gaussians import with_degree as with_degree
from .mesh import Mesh as Mesh
from .mesh import load_mesh as load_mesh
from .ply import read_ply as read_ply
from .ply import write_ply as write_ply
from .splat_file import write_splat as write_splat
from .surface import gaussians_from_mesh as gaussians_from_mesh
from .surface import sample_surface as sample_surface
