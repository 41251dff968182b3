"""Scenes written for PhysGaussian (Xie et al. 2024): their configuration file as our `Scene`,
with notes.

Keys and meanings follow `utils/decode_param.py` of the PhysGaussian repository, misspelt live
keys included. Where their solver does
something other than what the key says, the scene here does what the key says, and a note tells of
the difference.
"""

import dataclasses
import math
from dataclasses import dataclass
from typing import Any, Literal

from jaxphys.core.dataclass_reader import from_json
from jaxphys.core.errors import InputError, nearest, one_line, shown
from jaxphys.mpm.boundaries import Vector
from jaxphys.mpm.materials.plasticity import UNIAXIAL
from jaxphys.scene.model_folder import FiledCamera
from jaxphys.scene.physgaussian_camera import seen_from
from jaxphys.scene.physgaussian_config import Config, ParticleFilling
from jaxphys.scene.scene import Domain, Filling, Object, Region, Rotation, Scene

KEYS = {entry.name for entry in dataclasses.fields(Config)}
AXES: tuple[Vector, ...] = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))
MATERIALS = {
    "jelly": ("jelly", None),
    "metal": ("metal", None),
    "sand": ("sand", None),
    "foam": ("plasticine", "foam is the law that is called plasticine here"),
    "plasticine": ("plasticine", None),
    "snow": ("snow", "snow has no stress at all there and falls as dust; here it is snow"),
}
GRAINS = ("sand", "snow")


@dataclass(frozen=True)
class Imported:
    """A scene and one line for each thing that runs otherwise than in PhysGaussian."""

    scene: Scene
    notes: tuple[str, ...]


def is_physgaussian(value: Any) -> bool:
    """Whether decoded JSON looks like PhysGaussian's format rather than ours."""
    return isinstance(value, dict) and "objects" not in value and bool(KEYS & set(value))


def _parameters(config: Config, material: str, notes: list[str]) -> dict[str, float]:
    parameters = {
        "youngs_modulus": config.E,
        "poisson_ratio": config.nu,
        "density": config.density,
    }
    if material == "metal":
        # Theirs is the radius of the cylinder in |dev tau|, ours the stress of a uniaxial test.
        parameters["yield_stress"] = config.yield_stress / UNIAXIAL
        notes.append(
            "metal: their stress carries an extra factor of the stretch; here it is Kirchhoff's"
        )
        if config.hardening == 1:
            # Their radius grows by 2 mu xi for each unit of plastic strain.
            twice_mu = config.E / (1 + config.nu)
            parameters["hardening"] = twice_mu * config.xi / UNIAXIAL**2
        elif config.hardening != 0:
            notes.append("hardening: only the value 1 switches it on; left off")
    if config.material == "foam":
        parameters["yield_stress"] = config.yield_stress
        # Theirs multiplies the norm of the rate of flow, which in shear is the rate over sqrt(2).
        parameters["plastic_viscosity"] = (config.plastic_viscosity or 0.0) / 2
        notes.append("foam: their stress carries an extra factor of the stretch, as metal's does")
    if config.material == "plasticine":
        parameters["yield_stress"] = config.yield_stress / UNIAXIAL
        parameters["plastic_viscosity"] = 0.0
        notes.append("plasticine: their stress is fixed corotated's; here it is Hencky's")
    if material == "sand":
        parameters["friction_angle"] = config.friction_angle
        notes.append("sand: their particles share one mean volume; here each has its own")
        notes.append("sand: volume gained in separation is corrected here (Tampubolon et al. 2017)")
    left_out = {
        "plastic_viscosity": "belongs to foam",
        "softening": "no law here loses its yield stress",
        "rpic_damping": "transfers here are APIC",
    }
    for key, why in left_out.items():
        if getattr(config, key) and (key, config.material) != ("plastic_viscosity", "foam"):
            notes.append(f"{key}: left out, {why}")
    if config.pic_damping is not None:
        notes.append("pic_damping: read but never used by PhysGaussian; left out")
    return parameters


def _regions(config: Config) -> tuple[Region, ...]:
    return tuple(
        Region(
            box.point,
            box.size,
            {"youngs_modulus": box.E, "poisson_ratio": box.nu}
            | ({} if box.density is None else {"density": box.density}),
        )
        for box in config.additional_material_params
    )


def _rotations(config: Config) -> tuple[Rotation, ...]:
    degrees, axes = config.rotation_degree, config.rotation_axis
    if len(degrees) != len(axes):
        raise InputError(
            f"rotation_axis: {len(axes)} axes for {len(degrees)} angles; give one each"
        )
    return tuple(Rotation(AXES[axis], angle) for axis, angle in zip(axes, degrees, strict=True))


def _filling(
    filling: ParticleFilling | None, domain: Domain, cells: int, notes: list[str]
) -> Filling | None:
    if filling is None:
        return None
    area = filling.boundary
    side = domain.size[0] if area is None else max(area[i + 1] - area[i] for i in (0, 2, 4))
    per_cell = filling.max_partciels_per_cell
    if filling.max_particles_per_cell is not None:
        per_cell = filling.max_particles_per_cell
        notes.append("particle_filling.max_particles_per_cell: ignored by PhysGaussian, taken here")
    notes.append(
        "particle_filling: an enormous Gaussian is bounded here, where theirs loops without end"
    )
    return Filling(
        spacing=side / (filling.n_grid or 4 * cells),
        density_threshold=filling.density_threshold,
        search_threshold=filling.search_threshold,
        exclude_direction=filling.search_exclude_direction,
        ray_direction=filling.ray_cast_direction,
        per_cell=per_cell,
        maximum=filling.max_particles_num,
        area=area,
        smooth=filling.smooth,
        relax=False,
        show=filling.visualize,
    )


def _gravity(config: Config, notes: list[str]) -> Vector:
    if config.g is None:
        notes.append("g: absent, where PhysGaussian fails on its own default; gravity is 0")
        return (0.0, 0.0, 0.0)
    return config.g


def from_physgaussian(
    value: Any, where: str = "config", cameras: tuple[FiledCamera, ...] | None = None
) -> Imported:
    """Our scene for a decoded PhysGaussian configuration.

    Args:
        value: what `json` made.
        where: the file, for errors.
        cameras: of the model's photographs; None: not known.

    Raises:
        InputError: an unknown key, a wrong type or a number out of range, naming the field.
    """
    config = from_json(Config, value, where)
    notes: list[str] = []
    try:
        return Imported(_scene(config, cameras, notes), tuple(dict.fromkeys(notes)))
    except InputError as error:
        if str(error).startswith(one_line(where)):
            raise
        raise InputError(f"{where}.{error}") from None


def _scene(config: Config, cameras: tuple[FiledCamera, ...] | None, notes: list[str]) -> Scene:
    name = config.material
    if name not in MATERIALS:
        raise InputError(f"material: unknown material {shown(name)}; {nearest(name, MATERIALS)}")
    material, note = MATERIALS[name]
    if note:
        notes.append(f"material: {note}")
    side, cells = config.grid_lim, config.n_grid
    # As many nodes as theirs, so that their walls, counted in nodes from the ends, are ours.
    span = side - side / cells
    domain = Domain(size=(span, span, span), spacing=side / cells)
    substep, frame_time = config.substep_dt, config.frame_dt
    if substep > frame_time:
        raise InputError(f"substep_dt: {substep} must be at most frame_dt = {frame_time}")
    steps = frame_time / substep
    if abs(steps - round(steps)) > 1e-6 * steps:
        notes.append(f"substep_dt: theirs runs {int(steps)} whole steps a frame; here time adds up")
    notes.append("bounds: leaving the grid or losing finiteness stops the run with an error here")
    # Theirs always follow the elastic part. Of grains it is all that makes sense; what stays bent
    # would show it in its splats' places but not in their shapes.
    follow: Literal["elastic", "total"] = "elastic" if material in GRAINS else "total"
    if material in ("metal", "plasticine"):
        notes.append(
            "rendering: splats follow the total deformation here, theirs its elastic part only"
        )
    fps = min(max(round(1 / frame_time), 1), 1000)
    view, width, height = seen_from(config, fps, cameras, notes)
    thing = Object(
        material=material,
        parameters=_parameters(config, material, notes),
        regions=_regions(config),
        size=config.scale,
        centre=(1.0, 1.0, 1.0),
        rotation=_rotations(config),
        opacity_threshold=config.opacity_threshold,
        area=config.sim_area,
        filling=_filling(config.particle_filling, domain, cells, notes),
    )
    return Scene(
        objects=(thing,),
        gravity=_gravity(config, notes),
        boundaries=tuple(entry.ours(substep, notes) for entry in config.boundary_conditions),
        domain=domain,
        damping=-math.log(min(config.grid_v_damping_scale, 1.0)) / substep + 0.0,
        frames=config.frame_num,
        fps=fps,
        frame_time=frame_time,
        substep=substep,
        camera=view,
        width=width,
        height=height,
        splats_follow=follow,
    )
