"""PhysGaussian's configuration file as it is (Xie et al. 2024): every key that their
`utils/decode_param.py` reads, misspelt live ones included, with its default and range.

Fields are named as the keys. None stands for a key that is absent.
"""

from dataclasses import dataclass, field

from jaxphys.core.fields import DURATION, LENGTH, PLACE, between, direction
from jaxphys.scene.physgaussian_boundaries import Condition

Vector = tuple[float, float, float]
Area = tuple[float, float, float, float, float, float]

CELLS = between(1, 4096)
COUNT = between(1, 100_000_000)
DIRECTION = between(-1, 5)
FLAG = {"zero_or_one": True}
RATIO = {"above": -1, "most": 0.5}


@dataclass(frozen=True)
class MaterialBox:
    """`additional_material_params`: a box of another material; `size` is half its sides."""

    point: Vector = field(metadata=PLACE)
    size: Vector = field(metadata=LENGTH)
    E: float
    nu: float = field(metadata=RATIO)
    density: float | None = None


@dataclass(frozen=True)
class ParticleFilling:
    """`particle_filling`. `max_partciels_per_cell` is the spelling that they read."""

    n_grid: int | None = field(default=None, metadata=CELLS)
    density_threshold: float = 5.0
    search_threshold: float = 3.0
    max_particles_num: int = field(default=2_000_000, metadata=COUNT)
    max_partciels_per_cell: int = field(default=1, metadata=COUNT)
    max_particles_per_cell: int | None = field(
        default=None,
        metadata=COUNT | {"keys": ("max_particles_per_cell", "max_particles_per cell")},
    )
    search_exclude_direction: int = field(default=5, metadata=DIRECTION)
    ray_cast_direction: int = field(default=4, metadata=DIRECTION)
    boundary: Area | None = field(default=None, metadata=PLACE)
    smooth: bool = field(default=False, metadata=FLAG)
    visualize: bool = field(default=False, metadata=FLAG)


@dataclass(frozen=True)
class Config:
    """The whole file."""

    # What it is made of, and the grid.
    material: str = "jelly"
    grid_lim: float = field(default=2.0, metadata=LENGTH)
    n_grid: int = field(default=50, metadata=CELLS)
    nu: float = field(default=0.4, metadata=RATIO)
    E: float = 1e5
    yield_stress: float = 0.0
    hardening: float = 0.0
    xi: float = 0.0
    friction_angle: float = 25.0
    plastic_viscosity: float | None = None
    g: Vector | None = None
    density: float = 200.0
    rpic_damping: float | None = None
    pic_damping: float | None = None
    softening: float | None = None
    grid_v_damping_scale: float = field(default=1.1, metadata={"above": 0})
    additional_material_params: tuple[MaterialBox, ...] = ()
    # Time.
    substep_dt: float = field(default=1e-4, metadata=DURATION)
    frame_dt: float = field(default=1e-2, metadata=DURATION)
    frame_num: int = field(default=100, metadata=between(1, 100_000))
    # What is done to the splats before.
    opacity_threshold: float = 0.02
    rotation_degree: tuple[float, ...] = ()
    rotation_axis: tuple[int, ...] = field(default=(), metadata=between(0, 2))
    sim_area: Area | None = field(default=None, metadata=PLACE)
    scale: float = field(default=1.0, metadata=LENGTH)
    particle_filling: ParticleFilling | None = None
    # The camera.
    mpm_space_viewpoint_center: Vector = field(default=(1.0, 1.0, 1.0), metadata=PLACE)
    mpm_space_vertical_upward_axis: Vector = field(default=(0.0, 0.0, 1.0), metadata=direction())
    default_camera_index: int = field(default=0, metadata=between(-1, 1_000_000))
    show_hint: bool = field(default=False, metadata=FLAG)
    init_azimuthm: float = 0.0
    init_elevation: float = 0.0
    init_radius: float | None = None
    move_camera: bool = field(default=False, metadata=FLAG)
    delta_a: float = 0.0
    delta_e: float = 0.0
    delta_r: float | None = None
    boundary_conditions: tuple[Condition, ...] = ()
