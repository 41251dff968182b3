"""A motion of Gaussians as one text file of USD (.usda): a `ParticleField3DGaussianSplat`.

The schema is OpenUSD's, since version 26.03 (usdVol): centres, standard deviations and opacities
as they are, quaternions w, x, y, z, coefficients of the harmonics Gaussian by Gaussian. What
changes has a time sample a frame, what does not is written once; between samples readers
interpolate, linearly and along the shorter arc. Metres, z up.
"""

import os
import tempfile
from collections.abc import Iterator
from pathlib import Path
from typing import IO

import numpy as np

from jaxphys.core.errors import InputError
from jaxphys.core.files import atomic_path
from jaxphys.export.frames import Frames, plain

PRIM = "ParticleField3DGaussianSplat"
_ROWS = 8192
_BLOCK = 1 << 20


class _Attribute:
    """One attribute over time. Its samples wait in a file of their own until the ones of all
    attributes before it are written: a motion need not fit into memory.
    """

    def __init__(self, kind: str, name: str, folder: Path):
        self._kind, self._name, self._folder = kind, name, folder
        self._samples: IO[str] | None = None
        self._last: tuple[float, np.ndarray] | None = None
        self._first: tuple[float, np.ndarray] | None = None

    def add(self, code: float, values: np.ndarray) -> None:
        """The values (N, C) at a time."""
        values = values.astype(np.float32)
        if self._first is None or self._last is None:
            self._first = self._last = (code, values)
            return
        if self._samples is None and not np.array_equal(values, self._first[1]):
            self._samples = tempfile.TemporaryFile("w+", dir=self._folder)  # noqa: SIM115
            self._sample(*self._first)
            # It stayed as it was up to the frame before.
            if self._last[0] != self._first[0]:
                self._sample(*self._last)
        if self._samples is not None:
            self._sample(code, values)
        self._last = (code, values)

    def _sample(self, code: float, values: np.ndarray) -> None:
        assert self._samples is not None
        self._samples.write(f"            {code:.9g}: ")
        self._samples.writelines(_text(values))
        self._samples.write(",\n")

    def write(self, file: IO[str]) -> None:
        """Writes the attribute as lines of a prim."""
        assert self._first is not None
        if self._samples is None:
            file.write(f"        {self._kind}[] {self._name} = ")
            file.writelines(_text(self._first[1]))
            file.write("\n")
            return
        file.write(f"        {self._kind}[] {self._name}.timeSamples = {{\n")
        self._samples.seek(0)
        while block := self._samples.read(_BLOCK):
            file.write(block)
        file.write("        }\n")

    def close(self) -> None:
        """Lets go of the samples."""
        if self._samples is not None:
            self._samples.close()


def _text(values: np.ndarray) -> Iterator[str]:
    """An array (N, C) as USD writes it; nine digits are as much as float32 holds."""
    width = values.shape[1]
    row = "%.9g" if width == 1 else "(" + ", ".join(["%.9g"] * width) + ")"
    yield "["
    for start in range(0, len(values), _ROWS):
        part = values[start : start + _ROWS]
        yield ", " if start else ""
        yield ", ".join([row] * len(part)) % tuple(part.ravel().tolist())
    yield "]"


def write_usda(path: str | os.PathLike, frames: Frames, rate: float) -> None:
    """Writes a motion to `path`, whole or not at all; equal values give equal bytes.

    Args:
        path: the file.
        frames: one or more, of the same Gaussians; frame n has the time code n.
        rate: frames a second, the file's `timeCodesPerSecond`.

    Raises:
        InputError: there are none, their number or degree changes, or a value is not finite or too
            large.
    """
    with atomic_path(path) as aside:
        attributes = [
            _Attribute(kind, name, aside.parent)
            for kind, name in (
                ("float3", "extent"),
                ("point3f", "positions"),
                ("quatf", "orientations"),
                ("float3", "scales"),
                ("float", "opacities"),
                ("float3", "radiance:sphericalHarmonicsCoefficients"),
            )
        ]
        try:
            codes, shape = _collect(attributes, frames, str(path))
            degree = round(shape[1] ** 0.5) - 1
            with open(aside, "w", encoding="ascii", newline="\n") as file:
                file.write(_beginning(codes, rate, degree))
                for attribute in attributes:
                    attribute.write(file)
                file.write("    }\n}\n")
        finally:
            for attribute in attributes:
                attribute.close()


def _collect(
    attributes: list[_Attribute], frames: Frames, path: str
) -> tuple[list[int], tuple[int, ...]]:
    """The time codes, and the shape of the harmonics."""
    codes: list[int] = []
    shape: tuple[int, ...] | None = None
    for frame in frames:
        values = plain(frame.gaussians, path)
        if shape not in (None, values.harmonics.shape):
            raise InputError(f"{path}: frame {frame.number} has other Gaussians than those before")
        shape = values.harmonics.shape
        scales = np.exp(values.log_scales)
        # Readers cut splats off at three standard deviations.
        reach = 3 * scales.max(axis=1, keepdims=True)
        extent = [(values.means - reach).min(axis=0), (values.means + reach).max(axis=0)]
        parts = (
            np.stack(extent),
            values.means,
            values.quaternions,
            scales,
            values.opacities[:, None],
            values.harmonics.reshape(-1, 3),
        )
        for attribute, part in zip(attributes, parts, strict=True):
            attribute.add(frame.number, part)
        codes.append(frame.number)
    if shape is None:
        raise InputError(f"{path}: there are no frames to write")
    return codes, shape


def _beginning(codes: list[int], rate: float, degree: int) -> str:
    return f"""#usda 1.0
(
    defaultPrim = "World"
    endTimeCode = {codes[-1]}
    framesPerSecond = {rate:.9g}
    metersPerUnit = 1
    startTimeCode = {codes[0]}
    timeCodesPerSecond = {rate:.9g}
    upAxis = "Z"
)

def Xform "World"
{{
    def {PRIM} "Splats"
    {{
        uniform token projectionModeHint = "perspective"
        uniform token sortingModeHint = "zDepth"
        uniform int radiance:sphericalHarmonicsDegree = {degree}
"""
