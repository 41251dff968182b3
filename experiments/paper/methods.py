"""Ours and two configurations of this program in the roles of the methods that the paper compares.

None is the original: DreamPhysics (Huang et al. 2024) asks a video prior and Feature Splatting (Qiu
et al. 2024) segments a capture by features; neither is here. What is kept of each is what the paper
says of its motion and colours, see `Method`.
"""

import dataclasses
from dataclasses import dataclass

from experiments.paper.things import Shown, scene_of, sentence_of
from jaxphys.scene.defaults import SPACING
from jaxphys.scene.scene import Generation, Scene


@dataclass(frozen=True)
class Method:
    """A way to move an object that is there; the defaults are ours.

    Attributes:
        name: in tables.
        width, height: of the pictures, those that the paper gives the method [pixels].
        guided: the stiffness is found by `guided.stiffness`, in place of the material's own.
        regularised: colours are normalised and clamped.
        nodes: of the grid along the domain's longest side; None: by the scene's spacing.
        materials: those that it knows; None: all.
    """

    name: str
    width: int = 1958
    height: int = 1090
    guided: bool = False
    regularised: bool = True
    nodes: int | None = None
    materials: tuple[str, ...] | None = None

    def knows(self, shown: Shown) -> bool:
        """Whether it can move something of this material."""
        return self.materials is None or shown.material in self.materials


OURS = Method("ours")
DREAM = Method("DreamPhysics-like", 800, 800, guided=True, regularised=False)
FEATURE = Method("Feature-Splatting-like", 512, 512, nodes=32, materials=("elastic", "sand"))
METHODS = (OURS, DREAM, FEATURE)


def scene_for(
    method: Method,
    shown: Shown,
    *,
    stiffness: float | None = None,
    spacing: float = SPACING,
    frames: int | None = None,
    scale: float = 1.0,
) -> Scene:
    """The scene that a method films.

    Args:
        method, shown: who moves what.
        stiffness: Young's modulus [Pa]; None: the material's own.
        spacing: of the grid [m], where the method does not say.
        frames: so many pictures over the scene's time; None: as many as it has.
        scale: of the pictures' sides.
    """
    scene = scene_of(shown, spacing)
    if method.nodes is not None:
        longest = max(scene.domain.size)
        domain = dataclasses.replace(scene.domain, spacing=longest / (method.nodes - 1))
        scene = dataclasses.replace(scene, domain=domain)
    if stiffness is not None:
        (thing,) = scene.objects
        parameters = {**thing.parameters, "youngs_modulus": stiffness}
        scene = dataclasses.replace(
            scene, objects=(dataclasses.replace(thing, parameters=parameters),)
        )
    count = frames or scene.frames
    return dataclasses.replace(
        scene,
        frames=count,
        fps=scene.fps * count / scene.frames,
        width=even(scale * method.width),
        height=even(scale * method.height),
        regularise_colours=method.regularised,
        generation=Generation(sentence_of(shown.name)),
    )


def even(side: float) -> int:
    """The nearest even number of pixels, as encoders want."""
    return 2 * round(side / 2)
