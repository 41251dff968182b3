"""What a user asks for, as frozen dataclasses that read from and write to JSON (`json.py`).

World coordinates are the solver's: right-handed, z up, the domain is [0, size]. SI units; angles
in degrees.
"""

import math
from dataclasses import dataclass, field, replace
from typing import Literal

from jaxphys.core.errors import InputError
from jaxphys.core.fields import (
    DURATION,
    LENGTH,
    PLACE,
    RATE,
    SEED,
    SPEED,
    Checked,
    between,
    vector,
)
from jaxphys.mpm.boundaries import AnyBoundary, Vector
from jaxphys.mpm.meeting import Meeting
from jaxphys.mpm.stepping import Adaptive, Fixed, Stepping
from jaxphys.mpm.transfer.schemes import Transfer
from jaxphys.scene.view import ANGLE, View

Area = tuple[float, float, float, float, float, float]
Up = Literal["x", "-x", "y", "-y", "z", "-z"]

MOST_SPLATS = 20_000_000
MOST_NODES = 512**3


@dataclass(frozen=True)
class Rotation(Checked):
    """A turn about an axis.

    Attributes:
        axis: of any length but zero.
        degrees: right-handed.
    """

    axis: Vector = field(metadata=PLACE)
    degrees: float = field(metadata=ANGLE)


@dataclass(frozen=True)
class Region(Checked):
    """A box of an object, at rest, with material parameters of its own; particles on its faces are
    outside, as in boxes of boundaries.

    Attributes:
        centre, half_size: in the domain, at time 0 [m].
        parameters: by name, as `jaxphys materials` lists them.
    """

    centre: Vector = field(metadata=PLACE)
    half_size: Vector = field(metadata=LENGTH)
    parameters: dict[str, float] = field(default_factory=dict)


@dataclass(frozen=True)
class Filling(Checked):
    """Particles inside a hollow object (see `jaxphys.gaussians.filling`).

    Attributes:
        spacing: of the cells that are searched [m]; null: half the grid's spacing.
        density_threshold: summed opacity above which a cell counts as solid; null: a quarter of
            the median over the cells that hold Gaussians.
        search_threshold: density that a ray must meet to have hit something; null: as above.
        search_count: how many of the six directions must hit for a cell to be inside.
        exclude_direction, ray_direction: 0 to 5 for +x, -x, +y, -y, +z, -z; -1 for none. The first
            is not searched; along the second, solid parts must be crossed an odd number of times.
        per_cell: particles for every cell's volume inside.
        maximum: largest number of particles to add.
        area: (x0, x1, y0, y1, z0, z1) in the domain [m]; null: everywhere.
        smooth: smooth the density field first.
        relax: spread the new particles to blue noise; some 25 s for 30,000 on two cores, and only
            where jax-md is installed (the extra `relax`).
        show: draw them too, each as a round Gaussian in the colour of the nearest one, for objects
            that come apart.
    """

    spacing: float | None = field(default=None, metadata=LENGTH)
    density_threshold: float | None = field(default=None, metadata=between(0, 1e9))
    search_threshold: float | None = field(default=None, metadata=between(0, 1e9))
    search_count: int = field(default=6, metadata=between(0, 6))
    exclude_direction: int = field(default=-1, metadata=between(-1, 5))
    ray_direction: int = field(default=-1, metadata=between(-1, 5))
    per_cell: int = field(default=1, metadata=between(1, 1000))
    maximum: int = field(default=500_000, metadata=between(1, 100_000_000))
    area: Area | None = field(default=None, metadata=PLACE)
    smooth: bool = False
    relax: bool = False
    show: bool = False


@dataclass(frozen=True)
class Object(Checked):
    """One thing in the scene.

    Attributes:
        source: path of a .ply, a mesh or a directory of `generate`; null: the one named on the
            command line.
        material: a name that `jaxphys materials` lists.
        law: one of the other laws that the material may have; null: its own.
        mean_volume: stress at the volume that neighbours share, without which what hardly changes
            its volume (Poisson's ratio from 0.49 on) bends too little; of elastic laws.
        parameters: what differs from the material's defaults, by name.
        regions: boxes with other parameters; later ones win.
        size: longest side after rotation [m].
        centre: of the bounding box, in the domain [m].
        up: the axis of the source that points upwards.
        rotation: turns in the order given, about the object's centre, once it is upright.
        crop: leave out what is not the object: background, floaters and oversized splats of a
            capture, by a rule (`jaxphys.gaussians.cropping`).
        velocity: at the start [m/s].
        spin: at the start, about the centre [rad/s].
        opacity_threshold: Gaussians below it take no part and are not drawn.
        area: (x0, x1, y0, y1, z0, z1) in the rotated source's own units: only what is inside
            moves; null: all.
        filling: null leaves the object hollow.
        splats: number of Gaussians made where the source is a mesh.
        grain: above 0 every Gaussian is drawn as a grain: round, half as wide, and darker by a
            random share of its brightness up to this one.
    """

    source: str | None = None
    material: str = "jelly"
    law: str | None = None
    mean_volume: bool = False
    parameters: dict[str, float] = field(default_factory=dict)
    regions: tuple[Region, ...] = ()
    size: float = field(default=1.0, metadata=LENGTH)
    centre: Vector = field(default=(1.25, 1.25, 1.0), metadata=PLACE)
    up: Up = "z"
    rotation: tuple[Rotation, ...] = ()
    crop: bool = False
    velocity: Vector = field(default=(0.0, 0.0, 0.0), metadata=SPEED)
    spin: Vector = field(default=(0.0, 0.0, 0.0), metadata=RATE)
    opacity_threshold: float = field(default=0.02, metadata=between(0, 1))
    area: Area | None = field(default=None, metadata=PLACE)
    filling: Filling | None = field(default_factory=Filling)
    splats: int = field(default=20_000, metadata=between(1, MOST_SPLATS))
    grain: float = field(default=0.0, metadata=between(0, 1))

    def made_of(self, material: str) -> "Object":
        """The same thing of a material, with the numbers that this one has by itself."""
        return replace(
            self, material=material, law=None, mean_volume=False, parameters={}, regions=()
        )


@dataclass(frozen=True)
class Domain(Checked):
    """The box that is simulated.

    Attributes:
        size: of its sides [m]; a side that is no multiple of the spacing reaches into the grid's
            last cell.
        spacing: of the grid [m].
    """

    size: Vector = field(default=(2.5, 2.5, 2.0), metadata=vector(LENGTH))
    spacing: float = field(default=1 / 32, metadata=LENGTH)

    def __post_init__(self):
        super().__post_init__()
        if min(self.shape) < 8:
            raise InputError(
                f"size: {self.size} holds fewer than 8 nodes a side at spacing {self.spacing}; "
                "make the domain larger or the spacing finer"
            )
        if math.prod(self.shape) > MOST_NODES:
            raise InputError(
                f"spacing: {self.spacing} makes a grid of {'x'.join(map(str, self.shape))} nodes, "
                "more than 512x512x512; make it coarser"
            )

    @property
    def shape(self) -> tuple[int, int, int]:
        """Number of grid nodes along each axis."""
        # Round-off must not add a cell to a side that is a multiple of the spacing.
        x, y, z = (math.ceil(side / self.spacing - 1e-6) + 1 for side in self.size)
        return x, y, z


@dataclass(frozen=True)
class Ground(Checked):
    """The floor that is drawn (physics has its own, in `boundaries`).

    Attributes:
        height: [m].
        colour: red, green, blue in [0, 1].
        shadow: darkness of the soft shadow under what is near the floor, in [0, 1].
    """

    height: float = field(default=0.1, metadata=PLACE)
    colour: Vector = field(default=(0.86, 0.86, 0.85), metadata=between(0, 1))
    shadow: float = field(default=0.45, metadata=between(0, 1))


@dataclass(frozen=True)
class Generation(Checked):
    """How the object of a scene came from a sentence.

    Attributes:
        prompt: the sentence.
        steps: of optimisation; null: the default of the prior.
        splats: number of Gaussians at most; null: the default of the prior.
        prior: the 2D prior: "bundled", a name of `jaxphys weights list` such as
            "stable-diffusion", or a folder in diffusers' layout; or "library", the parametric model
            that the sentence names instead of any prior.
        shape_prior: the 3D prior: "bundled", "point-e", or a folder with Point-E's files.
        negative: what the 2D prior moves away from; the 3D priors do not read it.
        stages: "two", as the paper has them: geometry under both priors, then appearance under the
            2D prior alone with densification; or "one", all of it at once. null: two for a
            published 2D prior, one for the bundled one.
        distillation: where the noise comes from with which the 2D prior judges pictures: "sds"
            draws it, "ism" (interval score matching) finds it by inversion, at more than three
            times the cost.
        perp_neg: whether pictures move away from the views that they must not show (Perp-Neg), at
            twice the cost.
        refiner: who refines the sentence; "auto" asks an endpoint, then a local model, then rules.
        precision: of a published prior's weights and computation.
        attention_slice: queries that a published prior attends from at a time; null: all.
    """

    prompt: str
    steps: int | None = field(default=None, metadata=between(0, 1_000_000))
    splats: int | None = field(default=None, metadata=between(1, MOST_SPLATS))
    prior: str = "bundled"
    shape_prior: str = "bundled"
    negative: str = ""
    stages: Literal["one", "two"] | None = None
    distillation: Literal["sds", "ism"] = "sds"
    perp_neg: bool = False
    refiner: Literal["auto", "endpoint", "local", "rules"] = "auto"
    precision: Literal["bfloat16", "float32"] = "bfloat16"
    attention_slice: int | None = field(default=1024, metadata=between(1, 1_000_000))


@dataclass(frozen=True)
class Scene(Checked):
    """Everything that decides a run: the same scene and objects give the same bytes.

    Attributes:
        objects: at least one.
        gravity: [m/s^2].
        boundaries: in the order in which they act.
        domain: the simulated box and its grid.
        transfer: how particles and grid exchange velocities.
        contact: between the objects, each of which then has a velocity field of its own; null: they
            share one, and cling where they meet.
        damping: the grid's velocity decays at this rate [1/s].
        frames: pictures of the video, the first one at rest.
        fps: pictures a second of the video.
        frame_time: simulated time between pictures [s]; null: 1 / fps, real time.
        stepping: how a frame is stepped through: "fixed" takes equal steps, "adaptive" looks at the
            bounds again every few steps, "implicit" solves for the velocities, which pays for stiff
            matter in slow motion. null: adaptive in films (`animate`, `generate`), and fixed
            elsewhere, where a gradient may be wanted.
        substep: time step [s], which makes steps fixed; null: as large as the bounds allow.
        unsafe_substep: take `substep` even beyond the bounds.
        camera: where from.
        width, height: of the pictures [pixels].
        background: red, green, blue in [0, 1].
        ground: null draws none.
        obstacle_colour: red, green, blue in [0, 1] of the obstacles that keep matter out; null
            draws none. Containers, planes and walls are never drawn.
        splats_follow: "total" stretches splats with all of the deformation, so that bent metal
            stays
            bent; "elastic" leaves out plastic flow, so that grains stay grains.
        regularise_colours: normalise and clamp colours, with one range for each object.
        seed: of every random choice.
        generation: where the first object comes from, if from a sentence.
    """

    objects: tuple[Object, ...] = (Object(),)
    gravity: Vector = field(default=(0.0, 0.0, -9.81), metadata=between(-1e6, 1e6))
    boundaries: tuple[AnyBoundary, ...] = ()
    domain: Domain = Domain()
    transfer: Transfer = Transfer()
    contact: Meeting | None = None
    damping: float = field(default=0.0, metadata=between(0, 1e12))
    frames: int = field(default=48, metadata=between(1, 100_000))
    fps: float = field(default=24.0, metadata=between(0.1, 1000.0))
    frame_time: float | None = field(default=None, metadata=between(1e-9, 1e6))
    stepping: Stepping | None = None
    substep: float | None = field(default=None, metadata=DURATION)
    unsafe_substep: bool = False
    camera: View = View()
    width: int = field(default=1958, metadata=between(8, 8192))
    height: int = field(default=1090, metadata=between(8, 8192))
    background: Vector = field(default=(1.0, 1.0, 1.0), metadata=between(0, 1))
    ground: Ground | None = None
    obstacle_colour: Vector | None = field(default=(0.45, 0.5, 0.58), metadata=between(0, 1))
    splats_follow: Literal["total", "elastic"] = "total"
    regularise_colours: bool = True
    seed: int = field(default=0, metadata=SEED)
    generation: Generation | None = None

    def __post_init__(self):
        super().__post_init__()
        if not self.objects:
            raise InputError("objects: a scene needs at least one object")
        if self.contact is not None and len(self.objects) < 2:
            raise InputError(
                "contact: is between objects, and there is one; set it to null, or list another"
            )
        if self.substep is not None and self.stepping not in (None, Fixed()):
            raise InputError(
                f"substep: {self.substep} is a fixed step, but stepping is not; leave out one of "
                "them"
            )

    def filmed(self) -> "Scene":
        """The same scene with the stepping that films have where it names none."""
        if self.stepping is not None:
            return self
        return replace(self, stepping=Adaptive() if self.substep is None else Fixed())

    @property
    def seconds_per_frame(self) -> float:
        """Simulated time between two pictures [s]."""
        return 1 / self.fps if self.frame_time is None else self.frame_time
