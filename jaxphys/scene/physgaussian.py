"""Scenes written for PhysGaussian (Xie et al. 2024): their configuration file as our `Scene`,
with notes.

Keys and meanings follow `utils/decode_param.py` of the PhysGaussian repository, misspelt live
keys included. Where their solver does
something other than what the key says, the scene here does what the key says, and a note tells of
the difference.
"""

import math
from dataclasses import dataclass
from typing import Any

from jaxphys.core.errors import InputError, nearest
from jaxphys.mpm.boundaries import Vector
from jaxphys.mpm.plasticity import UNIAXIAL
from jaxphys.scene.physgaussian_boundaries import read_boundary
from jaxphys.scene.reader import Reader
from jaxphys.scene.scene import Domain, Filling, Object, Region, Rotation, Scene, View

MATERIAL_KEYS = {
    "material", "grid_lim", "n_grid", "nu", "E", "yield_stress", "hardening", "xi",
    "friction_angle", "plastic_viscosity", "g", "density", "rpic_damping", "pic_damping",
    "softening", "grid_v_damping_scale", "additional_material_params",
}  # fmt: skip
TIME_KEYS = {"substep_dt", "frame_dt", "frame_num"}
PREPROCESSING_KEYS = {
    "opacity_threshold", "rotation_degree", "rotation_axis", "sim_area", "scale",
    "particle_filling",
}  # fmt: skip
CAMERA_KEYS = {
    "mpm_space_viewpoint_center", "mpm_space_vertical_upward_axis", "default_camera_index",
    "show_hint", "init_azimuthm", "init_elevation", "init_radius", "move_camera", "delta_a",
    "delta_e", "delta_r",
}  # fmt: skip
KEYS = MATERIAL_KEYS | TIME_KEYS | PREPROCESSING_KEYS | CAMERA_KEYS | {"boundary_conditions"}
FILLING_KEYS = {
    "n_grid", "density_threshold", "search_threshold", "max_particles_num",
    "max_partciels_per_cell", "max_particles_per_cell", "max_particles_per cell",
    "search_exclude_direction", "ray_cast_direction", "boundary", "smooth", "visualize",
}  # fmt: skip
MATERIALS = {
    "jelly": ("jelly", None),
    "metal": ("metal", None),
    "sand": ("sand", None),
    "foam": ("metal", "foam is visco-plastic there; here it yields like metal, without viscosity"),
    "plasticine": ("metal", "plasticine softens as it yields there; here it yields like metal"),
    "snow": ("sand", "snow has no stress at all there and falls as dust; here it is sand"),
}


@dataclass(frozen=True)
class Imported:
    """A scene and one line for each thing that runs otherwise than in PhysGaussian."""

    scene: Scene
    notes: tuple[str, ...]


def is_physgaussian(value: Any) -> bool:
    """Whether decoded JSON looks like PhysGaussian's format rather than ours."""
    return isinstance(value, dict) and "objects" not in value and bool(KEYS & set(value))


def _parameters(read: Reader, material: str, notes: list[str]) -> dict[str, float]:
    parameters = {
        "youngs_modulus": read.number("E", 1e5),
        "poisson_ratio": read.number("nu", 0.4),
        "density": read.number("density", 200.0),
    }
    if material == "metal":
        # Theirs is the radius of the cylinder in |dev tau|, ours the stress of a uniaxial test.
        parameters["yield_stress"] = read.number("yield_stress", 0.0) / UNIAXIAL
        notes.append(
            "metal: their stress carries an extra factor of the stretch; here it is Kirchhoff's"
        )
        if read.number("hardening", 0.0) == 1:
            # Their radius grows by 2 mu xi for each unit of plastic strain.
            twice_mu = parameters["youngs_modulus"] / (1 + parameters["poisson_ratio"])
            parameters["hardening"] = twice_mu * read.number("xi", 0.0) / UNIAXIAL**2
        elif read.number("hardening", 0.0) != 0:
            notes.append("hardening: only the value 1 switches it on; left off")
    if material == "sand":
        parameters["friction_angle"] = read.number("friction_angle", 25.0)
        notes.append("sand: their particles share one mean volume; here each has its own")
        notes.append("sand: volume gained in separation is corrected here (Tampubolon et al. 2017)")
    for key, why in {
        "plastic_viscosity": "no law here is viscous",
        "softening": "belongs to plasticine",
        "rpic_damping": "transfers here are APIC",
    }.items():
        if read.number(key, 0.1 if key == "softening" else 0.0) != 0 and key in read:
            notes.append(f"{key}: left out, {why}")
    if "pic_damping" in read:
        notes.append("pic_damping: read but never used by PhysGaussian; left out")
    return parameters


def _regions(read: Reader) -> tuple[Region, ...]:
    regions = []
    for i, item in enumerate(read.items("additional_material_params")):
        part = Reader(
            item,
            {"point", "size", "E", "nu", "density"},
            f"{read.where}.additional_material_params[{i}]",
        )
        parameters = {"youngs_modulus": part.number("E"), "poisson_ratio": part.number("nu")}
        if "density" in part:
            parameters["density"] = part.number("density")
        regions.append(Region(part.numbers("point", 3), part.numbers("size", 3), parameters))
    return tuple(regions)


def _rotations(read: Reader) -> tuple[Rotation, ...]:
    degrees = read.numbers("rotation_degree", None, [])
    axes = read.numbers("rotation_axis", None, [])
    if len(degrees) != len(axes):
        raise InputError(
            f"{read.where}.rotation_axis: {len(axes)} axes for {len(degrees)} angles; give one each"
        )
    for axis in axes:
        if axis not in (0, 1, 2):
            raise InputError(f"{read.where}.rotation_axis: {axis:g} is none of 0, 1, 2")
    units: list[Vector] = [(1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0)]
    return tuple(
        Rotation(units[int(axis)], angle) for axis, angle in zip(axes, degrees, strict=True)
    )


def _filling(
    value: Any, where: str, domain: Domain, cells: int, notes: list[str]
) -> Filling | None:
    if value is None:
        return None
    read = Reader(value, FILLING_KEYS, where)
    area = read.values.get("boundary")
    area = None if area is None else read.numbers("boundary", 6)
    side = domain.size[0] if area is None else max(area[i + 1] - area[i] for i in (0, 2, 4))
    per_cell = "max_partciels_per_cell"
    for spelling in ("max_particles_per_cell", "max_particles_per cell"):
        if spelling in read:
            per_cell = spelling
            notes.append(f"particle_filling.{spelling}: ignored by PhysGaussian, taken here")
    if read.flag("visualize"):
        notes.append("particle_filling.visualize: filled particles are not drawn; left out")
    notes.append(
        "particle_filling: an enormous Gaussian is bounded here, where theirs loops without end"
    )
    return Filling(
        spacing=side / read.whole("n_grid", 4 * cells),
        density_threshold=read.number("density_threshold", 5.0),
        search_threshold=read.number("search_threshold", 3.0),
        exclude_direction=read.whole("search_exclude_direction", 5),
        ray_direction=read.whole("ray_cast_direction", 4),
        per_cell=read.whole(per_cell, 1),
        maximum=read.whole("max_particles_num", 2_000_000),
        area=area,
        smooth=read.flag("smooth"),
        relax=False,
    )


def _camera(read: Reader, frame_time: float, notes: list[str]) -> View:
    if read.number("default_camera_index", 0) >= 0:
        notes.append("default_camera_index: cameras.json is not read; the camera frames the motion")
    if "init_radius" in read or "delta_r" in read:
        notes.append(
            "init_radius, delta_r: in the splat file's units there; the camera frames the motion"
        )
    if read.numbers("mpm_space_vertical_upward_axis", 3, [0, 0, 1]) != (0, 0, 1):
        notes.append("mpm_space_vertical_upward_axis: z is up here; left out")
    if read.flag("show_hint"):
        notes.append("show_hint: left out")
    moves = 1 / frame_time if read.flag("move_camera") else 0.0
    return View(
        # Their horizontal axes are (1, 1, 0) and its normal: azimuth 0 looks from 45 degrees.
        azimuth=read.number("init_azimuthm", 0.0) + 45.0,
        elevation=read.number("init_elevation", 0.0),
        target=read.numbers("mpm_space_viewpoint_center", 3, [1, 1, 1]),
        turn=moves * read.number("delta_a", 0.0),
        rise=moves * read.number("delta_e", 0.0),
    )


def _gravity(read: Reader, notes: list[str]) -> Vector:
    if "g" not in read:
        notes.append("g: absent, where PhysGaussian fails on its own default; gravity is 0")
        return (0.0, 0.0, 0.0)
    return read.numbers("g", 3)


def from_physgaussian(value: Any, where: str = "config") -> Imported:
    """Our scene for a decoded PhysGaussian configuration.

    Raises:
        InputError: an unknown key, a wrong type or a number out of range, naming the field.
    """
    read, notes = Reader(value, KEYS, where), []
    name = read.text("material", "jelly")
    if name not in MATERIALS:
        raise InputError(f"{where}.material: unknown material {name!r}; {nearest(name, MATERIALS)}")
    material, note = MATERIALS[name]
    if note:
        notes.append(f"material: {note}")
    side, cells = read.number("grid_lim", 2.0), read.whole("n_grid", 50)
    if side <= 0 or cells < 1:
        raise InputError(f"{where}.n_grid, grid_lim: {cells} and {side} must be above 0")
    try:
        # As many nodes as theirs, so that their walls, counted in nodes from the ends, are ours.
        span = side - side / cells
        domain = Domain(size=(span, span, span), spacing=side / cells)
        substep, frame_time = read.number("substep_dt", 1e-4), read.number("frame_dt", 1e-2)
        if not 0 < substep <= frame_time:
            raise InputError(
                f"substep_dt: {substep} must be above 0 and at most frame_dt = {frame_time}"
            )
        steps = frame_time / substep
        if abs(steps - round(steps)) > 1e-6 * steps:
            notes.append(
                f"substep_dt: theirs runs {int(steps)} whole steps a frame; here time adds up"
            )
        decay = read.number("grid_v_damping_scale", 1.1)
        if decay <= 0:
            raise InputError(f"grid_v_damping_scale: {decay} must be above 0")
        notes.append(
            "bounds: leaving the grid or losing finiteness stops the run with an error here"
        )
        if material != "jelly":
            notes.append(
                "rendering: splats follow the total deformation here, theirs its elastic part only"
            )
        thing = Object(
            material=material,
            parameters=_parameters(read, material, notes),
            regions=_regions(read),
            size=read.number("scale", 1.0),
            centre=(1.0, 1.0, 1.0),
            rotation=_rotations(read),
            opacity_threshold=read.number("opacity_threshold", 0.02),
            area=read.numbers("sim_area", 6) if value.get("sim_area") is not None else None,
            filling=_filling(
                value.get("particle_filling"), f"{where}.particle_filling", domain, cells, notes
            ),
        )
        boundaries = tuple(
            read_boundary(item, f"{where}.boundary_conditions[{i}]", substep, notes)
            for i, item in enumerate(read.items("boundary_conditions"))
        )
        scene = Scene(
            objects=(thing,),
            gravity=_gravity(read, notes),
            boundaries=boundaries,
            domain=domain,
            damping=-math.log(min(decay, 1.0)) / substep + 0.0,
            frames=read.whole("frame_num", 100),
            fps=min(max(round(1 / frame_time), 1), 1000),
            frame_time=frame_time,
            substep=substep,
            camera=_camera(read, frame_time, notes),
        )
    except InputError as error:
        message = str(error)
        raise InputError(message if message.startswith(where) else f"{where}.{message}") from None
    return Imported(scene, tuple(dict.fromkeys(notes)))
