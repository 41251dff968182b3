"""What distillation asks of a prior: an image guide judges pictures, a shape guide points.

A guide is a prior together with what it is told of one prompt. All are pytrees of arrays, made to
be passed into jitted functions.
"""

import re
from typing import NamedTuple, Protocol

from jax import Array

from jaxphys.guidance.diffusion.score_distillation import Distillation, DistillationConfig


class ImageGuide(Protocol):
    """A 2D prior told a prompt."""

    @property
    def resolution(self) -> int:
        """Pixels a side of the pictures that it judges."""

    def distil(
        self,
        images: Array,
        azimuth: Array,
        elevation: Array,
        key: Array,
        config: DistillationConfig,
        progress: Array | float,
    ) -> Distillation:
        """Loss of pictures (B, R, R, 3) in [0, 1] seen from azimuths and elevations (B,) [rad]."""


class ShapeGuide(Protocol):
    """A 3D prior told a prompt. Points are in the object frame: centred, z up, front +x, longest
    side about 1; colours in [0, 1]."""

    def sample(self, key: Array, count: int) -> tuple[Array, Array]:
        """Points (M, 3) and colours (M, 3) of one object, M >= count."""

    def distil(
        self,
        points: Array,
        colours: Array,
        key: Array,
        config: DistillationConfig,
        progress: Array | float,
    ) -> Distillation:
        """Loss of centres (N, 3) and their colours (N, 3)."""


class Guides(NamedTuple):
    """The two guides of one prompt."""

    image: ImageGuide
    shape: ShapeGuide


def object_of(prompt: str) -> str:
    """The part of a refined prompt that names the object, its first."""
    return prompt.split(",")[0].strip()


def phrases_of(prompt: str, count: int) -> list[str]:
    """A refined prompt in parts that say one thing each: the object with all that comes before the
    first comma, then at most `count` phrases.

    Those are the pieces of the object's part if it has several ("a teapot", "a blue lid" and "a
    long spout" of "a teapot with a blue lid and a long spout"), then the traits behind commas. What
    would be too many is left together in the last one.
    """
    head = object_of(prompt)
    traits = [piece for part in prompt.split(",")[1:] for piece in _pieces(part)]
    phrases = [*(_pieces(head) if len(_pieces(head)) > 1 else []), *traits]
    if len(phrases) > count:
        phrases = [*phrases[: count - 1], ", ".join(phrases[count - 1 :])] if count else []
    return [head, *phrases]


def _pieces(part: str) -> list[str]:
    """What stands before "with", and each of the things behind it."""
    first, *rest = re.split(r"(?:^|\s)with\s", part.strip())
    listed = [first, *(piece for text in rest for piece in re.split(r"\sand\s", text))]
    return [piece.strip() for piece in listed if piece.strip()]
