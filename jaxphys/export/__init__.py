"""Gaussians and motions of them for other programs: the formats, what each loses, their writers.

What is lost by all of them: the range that a scene's colours are regularised by, the floor and its
shadow, and everything that is not drawn. docs/formats.md has the table.
"""

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from jaxphys.gaussians.gaussians import Gaussians
from jaxphys.gaussians.ply import write_ply

from .compressed_ply import compressed_ply_writer as compressed_ply_writer
from .compressed_ply import read_compressed_ply as read_compressed_ply
from .compressed_ply import write_compressed_ply as write_compressed_ply
from .continuous_axes import continuous_axes as continuous_axes
from .frames import Frames as Frames
from .frames import NumberedGaussians as NumberedGaussians
from .gltf import write_glb as write_glb
from .numbered import numbered_name as numbered_name
from .numbered import write_numbered as write_numbered
from .spz import read_spz as read_spz
from .spz import write_spz as write_spz
from .usd import write_usda as write_usda


@dataclass(frozen=True)
class Format:
    """A format.

    Attributes:
        suffix: of its files.
        up: the axis that points upwards in its files.
        loses: of what a Gaussian is, in a sentence.
        begin: gives a writer of one motion's frames, each to a file of its own; None: one file
            holds the whole motion, see `write_usda`.
    """

    suffix: str
    up: str
    loses: str
    begin: Callable[[], Callable[[Path, Gaussians], None]] | None


FORMATS = {
    "ply": Format(
        ".ply",
        "z",
        "nothing: float32 as computed.",
        lambda: write_ply,
    ),
    "compressed-ply": Format(
        ".compressed.ply",
        "z",
        "centres to 1/4094 (x, z) and 1/2046 (y) of the extent of 256 neighbours, logarithms of"
        " scales likewise of their range, axes to 0.3 degrees, colours to 1/510 of their range,"
        " opacities to 1/510, harmonics above degree 0 to 1/64 and within 4; the order of the"
        " Gaussians, and the sign of quaternions.",
        compressed_ply_writer,
    ),
    "gltf": Format(
        ".glb",
        "y",
        "opacities and scales to float32 (no logit, no logarithm); what is farther than three"
        " standard deviations from a centre is not drawn.",
        lambda: write_glb,
    ),
    "spz": Format(
        ".spz",
        "y",
        "centres to 2^-17 of the largest coordinate, or 0.12 mm where that is finer; scales to"
        " 3.2 % and between 0.045 mm and 379 m, axes to 0.3 degrees, colours to 0.004 and between"
        " -0.44 and 1.44, opacities to 1/510, harmonics above degree 0 to 1/256 and within 1; the"
        " sign of quaternions.",
        lambda: write_spz,
    ),
    "usd": Format(
        ".usda",
        "z",
        "opacities and scales to float32 (no logit, no logarithm).",
        None,
    ),
}
