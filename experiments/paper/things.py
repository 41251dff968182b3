"""What is made and moved: the paper's objects, its materials, and the scenes that show them."""

import dataclasses
from typing import NamedTuple

from experiments.scorer.sentences import SENTENCES
from jaxphys.mpm.boundaries import Capsule, Keyframes
from jaxphys.scene.defaults import FLOOR, INTO_PICTURE, MIDDLE, SPACING, default_scene
from jaxphys.scene.scene import Object, Scene


class Shown(NamedTuple):
    """An object, by its name among `SENTENCES`, and what it is made of."""

    name: str
    material: str


# The paper's text names these with their materials, but for the sand, of which it says no object.
MAIN = {
    "elastic burger": Shown("burger", "elastic"),
    "fracture sponge": Shown("sponge", "fracture"),
    "jelly pancakes": Shown("pancakes", "jelly"),
    "metal can": Shown("can", "metal"),
    "sand ice cream": Shown("ice cream", "sand"),
}
# Of the supplement's five it says no more: objects that it names, in materials of our choice.
SUPPLEMENT = {
    "elastic vase with flowers": Shown("vase with flowers", "elastic"),
    "fracture nigiri": Shown("nigiri", "fracture"),
    "jelly strawberry": Shown("strawberry", "jelly"),
    "metal microphone": Shown("microphone", "metal"),
    "sand rose": Shown("rose", "sand"),
}
SHOWN = MAIN | SUPPLEMENT

CAN, PRESS = 0.75, 0.12  # height of the can and radius of what is pressed onto it [m]
DEEP = 0.3  # how far that goes down from touch [m]


def sentence_of(name: str, *, wordy: bool = False) -> str:
    """What a user asks for; wordy: with surroundings, which refinement is there to leave out."""
    rest = " on a wooden table in a sunny kitchen in the morning light" if wordy else ""
    return SENTENCES[name] + rest


def scene_of(shown: Shown, spacing: float = SPACING) -> Scene:
    """The scene in which an object is filmed, on a grid of some spacing [m] or, of what breaks, one
    that is fine enough: planes of weakness that are thinner than a cell and a half do not part.
    """
    if shown.material == "fracture":
        spacing = min(spacing, SPACING)
    if shown == MAIN["metal can"]:
        return pressed(default_scene("metal", spacing=spacing))
    return default_scene(shown.material, spacing=spacing)


def pressed(scene: Scene) -> Scene:
    """The scene's object upright on the floor, pushed on the top: a bar comes down onto it and
    lifts off again. The dent stays.
    """
    thing = Object(
        material=scene.objects[0].material,
        size=CAN,
        centre=(MIDDLE, MIDDLE, FLOOR + CAN / 2 + 0.01),
    )
    bar = Capsule(
        centre=(MIDDLE, MIDDLE, FLOOR + CAN + PRESS + 0.05),
        orientation=INTO_PICTURE,
        radius=PRESS,
        half_height=0.45,
        friction=0.3,
        motion=Keyframes(
            times=(0.1, 0.8, 1.0, 1.5),
            displacements=tuple((0.0, 0.0, z) for z in (0.0, -DEEP - 0.05, -DEEP - 0.05, 0.45)),
            interpolation="smooth",
        ),
    )
    return dataclasses.replace(scene, objects=(thing,), boundaries=(*scene.boundaries, bar))
