"""What happens to a material that shows what it is, where an object that is let fall does not tell.

An event is a scene with the objects that it was made for; the materials have their defaults.
`experiments.showcase` films them. Lengths in metres: paste and cream hold their own weight up to
some centimetres, so that these scenes are of a table's size.
"""

from collections.abc import Callable
from functools import partial
from typing import NamedTuple

import numpy as np

from jaxphys.gaussians import Gaussians
from jaxphys.guidance.library import gaussians_of, library_object
from jaxphys.library.model import finish
from jaxphys.library.palette import COLOURS
from jaxphys.library.patterns import sectors
from jaxphys.library.shapes import ball, block, cylinder, lathe, limb, ring, tube
from jaxphys.library.solids import Parts
from jaxphys.mpm.boundaries import Box, Cuboid, Plane, Translate, Walls
from jaxphys.scene.scene import Domain, Filling, Ground, Object, Region, Scene
from jaxphys.scene.view import View

CARRIED = 14  # slices of a strand that leave the nozzle one after another
# What only stands there is a skin, held by the grid; heavy, as it would else shorten the step.
FIRM = {"density": 10_000.0}
TABLE = (0.55, 0.66, 0.78)  # white matter shows on what is not white


class Event(NamedTuple):
    """A scene, and what makes the Gaussians of each of its objects."""

    scene: Scene
    makers: tuple[Callable[[], Gaussians], ...]

    def objects(self) -> tuple[Gaussians, ...]:
        """The Gaussians, which take some seconds."""
        return tuple(make() for make in self.makers)


def gaussians(parts: Parts, count: int) -> Gaussians:
    """Shapes whose parts are named by their colours, as Gaussians."""
    return gaussians_of(
        finish(parts, {name: np.array(colour) for name, colour in COLOURS.items()}, {}), count
    )


def toothpaste(spacing: float = 0.0125) -> Event:
    """A strand comes out of a nozzle that goes along a toothbrush."""
    floor, bristles, gap = 0.06, 0.1, 0.03
    radius, length, along, down = 0.025, 0.42, 0.22, 0.38
    nozzle = floor + bristles + 2 * radius + gap
    start, y = 0.42, 0.2
    colours = limb((0, 0, 0), (0, 0, length - 2 * radius), radius)
    colours = colours.coat("red", sectors(3, 0.26)).coat(
        "turquoise", lambda u, v, p: (3 * u + 0.5) % 1 < 0.26
    )
    strand = Object(
        material="toothpaste",
        size=length,
        centre=(start, y, nozzle + length / 2),
        velocity=(along, 0.0, -down),
        filling=Filling(show=True),
    )
    # Each slice moves with the nozzle until it is out of it. They overlap a little, since what lies
    # on a face belongs to no box.
    pitch = length / CARRIED
    carried = tuple(
        Translate(
            centre=(start, y, nozzle + (k + 0.5) * pitch),
            half_size=(2 * radius, 2 * radius, 0.505 * pitch),
            velocity=(along, 0.0, -down),
            end=(k + 0.5) * pitch / down,
        )
        for k in range(CARRIED)
    )
    head, wide = 0.3, 0.09
    tufts = block(head, wide, bristles - 0.03, 0.01).at(0, 0, 0.03 + (bristles - 0.03) / 2)
    tufts = tufts.shade(lambda u, v, p: 0.9 + 0.1 * np.cos(2 * np.pi * p[:, 0] / 0.03))
    handle = [
        block(head + 0.04, wide + 0.02, 0.03, 0.012).at(z=0.015),
        tube(
            [(-0.16, 0, 0.015), (-0.25, 0, 0.02), (-0.45, 0, 0.03)], [0.03, 0.02, 0.028], flat=0.6
        ),
    ]
    brush = Object(
        material="elastic",
        parameters=FIRM,
        size=0.62,
        centre=(start + 0.16 - 0.14, y, floor + bristles / 2),
        filling=None,
    )
    held = Box(centre=brush.centre, half_size=(0.4, 0.06, bristles / 2))
    scene = Scene(
        objects=(strand, brush),
        boundaries=(Plane((0.4, y, floor), friction=0.6), *carried, held),
        domain=Domain((1.0, 0.4, nozzle + length + 0.08), spacing),
        frames=38,
        camera=View(azimuth=-72.0, elevation=20.0, distance=0.95, target=(0.5, y, 0.16)),
        splats_follow="elastic",
        background=TABLE,
        ground=Ground(floor, colour=TABLE),
    )
    return Event(
        scene,
        (
            partial(gaussians, {"white": colours}, 4000),
            partial(gaussians, {"white": tufts, "blue": handle}, 6000),
        ),
    )


def cream(spacing: float = 0.018) -> Event:
    """A swirl of whipped cream is put onto pancakes, and a strawberry into it."""
    floor, cakes, high, berry_at = 0.06, 0.135, 0.217, 0.72
    middle = 0.4
    cake = lathe([(0, 0), (0.185, 0), (0.205, 0.025), (0.185, 0.05), (0, 0.05)])
    cake = cake.coat("light brown", lambda u, v, p: (0.19 - np.hypot(p[:, 0], p[:, 1])) / 0.01)
    stack = cake.copies([(0, 0, 0), (0.008, 0.004, 0.0425), (-0.005, 0.006, 0.085)])
    t = np.linspace(0, 1, 40)
    angle, out = 2 * np.pi * 3.2 * t, 0.3 * (1 - t) ** 0.8
    path = np.stack([out * np.cos(angle), out * np.sin(angle), 0.1 + 0.5 * t], -1)
    swirl = tube(path, 0.13 - 0.1 * t**2, sharp=True, sides=10, winds=True)
    core = lathe([(0, 0.02), (0.33, 0.02), (0.3, 0.12), (0, 0.55)])
    return Event(
        Scene(
            objects=(
                Object(
                    material="cream",
                    size=0.27,
                    centre=(middle, middle, floor + cakes + 0.1 + high / 2),
                    velocity=(0.0, 0.0, -0.8),
                    filling=Filling(show=True),
                ),
                Object(
                    material="elastic",
                    parameters=FIRM,
                    size=0.42,
                    centre=(middle, middle, floor + cakes / 2),
                    filling=None,
                ),
                Object(
                    material="elastic",
                    parameters={"density": 800.0},
                    size=0.13,
                    centre=(middle, middle, berry_at),
                ),
            ),
            boundaries=(
                Plane((middle, middle, floor), friction=0.6),
                Walls(),
                Box((middle, middle, floor + cakes / 2), (0.21, 0.21, cakes / 2)),
                Translate(centre=(middle, middle, berry_at), half_size=(0.1, 0.1, 0.1), end=0.3),
            ),
            domain=Domain((2 * middle, 2 * middle, 0.9), spacing),
            frames=28,
            camera=View(elevation=16.0, distance=1.45, target=(middle, middle, 0.27)),
            splats_follow="elastic",
            background=TABLE,
            ground=Ground(floor, colour=TABLE),
        ),
        (
            partial(gaussians, {"white": [swirl, core]}, 8000),
            partial(gaussians, {"golden": stack}, 6000),
            lambda: library_object("strawberry", 0, 2000)[0],
        ),
    )


def muscle(spacing: float = 0.05) -> Event:
    """A muscle hangs from a bone and lifts a weight, again and again."""
    middle, floor, top = 0.75, 0.2, 1.55
    # Upright from z = 0: two tendons and the belly between them.
    profile = [(0.06, 0.0), (0.065, 0.1), (0.1, 0.18), (0.165, 0.34), (0.18, 0.47), (0.165, 0.6)]
    profile += [(0.1, 0.76), (0.065, 0.84), (0.06, 0.95)]
    spindle = lathe(profile).coat("red", lambda u, v, p: np.abs(p[:, 2] - 0.47) < 0.31)
    fibres = sectors(14, 0.3)
    belly = spindle.coat(
        "dark red", lambda u, v, p: fibres(u, v, p) & (np.abs(p[:, 2] - 0.47) < 0.31)
    )
    length, tendon = 0.95, 0.17
    centre = (middle, middle, top - length / 2)
    tough = {"youngs_modulus": 3e4, "fibre_tension": 0.0}
    ends = tuple(
        Region((middle, middle, z), (0.2, 0.2, tendon / 2), tough)
        for z in (top - tendon / 2, top - length + tendon / 2)
    )
    iron = {
        "dark grey": [
            ball(0.15).at(z=0.15),
            cylinder(0.1, 0.04),
            ring(0.085, 0.035).turn("x", 90).at(z=0.34),
        ]
    }
    high = 0.46
    return Event(
        Scene(
            objects=(
                Object(material="muscle", regions=ends, size=length, centre=centre),
                Object(
                    material="elastic",
                    size=high,
                    centre=(middle, middle, top - length + 0.09 - high / 2),
                ),
            ),
            boundaries=(
                Plane((middle, middle, floor), friction=0.5),
                Cuboid(
                    centre=(middle, middle, top),
                    half_size=(0.45, 0.09, 0.07),
                    rounding=0.06,
                    surface="sticky",
                ),
            ),
            domain=Domain((2 * middle, 2 * middle, 1.85), spacing),
            damping=1.0,
            frames=36,
            camera=View(elevation=8.0),
            ground=Ground(floor),
            obstacle_colour=(0.9, 0.86, 0.76),
        ),
        (partial(gaussians, {"cream": belly}, 5000), partial(gaussians, iron, 2500)),
    )


EVENTS: dict[str, Callable[..., Event]] = {
    "toothpaste": toothpaste,
    "cream": cream,
    "muscle": muscle,
}
