"""A scene at a size that runs while somebody looks at it."""

import math
from dataclasses import replace

from jaxphys.scene.scene import Filling, Object, Scene


def reduced(scene: Scene, nodes: int) -> Scene:
    """The scene on a grid of at most so many nodes, with fillings that suit it; itself where its
    grid is small enough. The same objects in the same places, made of the same.
    """
    domain = scene.domain
    while math.prod(domain.shape) > nodes:
        factor = max((math.prod(domain.shape) / nodes) ** (1 / 3), 1.01)
        domain = replace(domain, spacing=domain.spacing * factor)
    if domain == scene.domain:
        return scene
    objects = tuple(_filled_for(thing, domain.spacing) for thing in scene.objects)
    return replace(scene, domain=domain, objects=objects)


def _filled_for(thing: Object, spacing: float) -> Object:
    filling = thing.filling
    if filling is None or filling.spacing is None:
        return thing
    return replace(thing, filling=_coarser(filling, 0.5 * spacing))


def _coarser(filling: Filling, spacing: float) -> Filling:
    assert filling.spacing is not None
    return replace(filling, spacing=max(filling.spacing, spacing))
