"""Gaussians as binary glTF (.glb) with Khronos' extension KHR_gaussian_splatting.

glTF 2.0 section 4.4 has the container, the extension's README the attributes: a primitive of
points, scales and opacities as they are (no logarithm, no logit), quaternions x, y, z, w, colours
as the coefficients of 3D Gaussian splatting. All are float32. `COLOR_0`, which readers that do not
know the extension draw as points, is linear as glTF's colours are. Axes: y is up.
"""

import json
import os
import struct
from typing import Any

import numpy as np

from jaxphys.core.files import atomic_path
from jaxphys.export.frames import Plain, plain
from jaxphys.export.y_up import to_y_up
from jaxphys.gaussians.gaussians import Gaussians
from jaxphys.gaussians.harmonics import DC

NAME = "KHR_gaussian_splatting"
FLOAT, BYTE, ARRAY_BUFFER, POINTS = 5126, 5121, 34962, 0
_KINDS = {1: "SCALAR", 3: "VEC3", 4: "VEC4"}


def write_glb(path: str | os.PathLike, gaussians: Gaussians) -> None:
    """Writes `gaussians` to `path`, whole or not at all; equal values give equal bytes.

    Raises:
        InputError: there are none, or a value is not finite or too large.
    """
    values = plain(to_y_up(gaussians), str(path))
    views: list[dict[str, Any]] = []
    accessors: list[dict[str, Any]] = []
    attributes: dict[str, int] = {}
    data: list[bytes] = []
    offset = 0
    for name, array in _attributes(values, gaussians.degree).items():
        raw = array.tobytes()
        views.append(
            {"buffer": 0, "byteOffset": offset, "byteLength": len(raw), "target": ARRAY_BUFFER}
        )
        accessor = {
            "bufferView": len(accessors),
            "componentType": BYTE if array.dtype == np.uint8 else FLOAT,
            "count": len(array),
            "type": _KINDS[array.shape[1]],
        }
        if array.dtype == np.uint8:
            accessor["normalized"] = True
        if name == "POSITION":
            accessor |= {"min": array.min(axis=0).tolist(), "max": array.max(axis=0).tolist()}
        attributes[name] = len(accessors)
        accessors.append(accessor)
        data.append(raw)  # every attribute is a multiple of 4 bytes a Gaussian
        offset += len(raw)
    text = json.dumps(_document(views, accessors, attributes, offset), separators=(",", ":"))
    words = text.encode()
    words += b" " * (-len(words) % 4)
    with atomic_path(path) as aside, open(aside, "wb") as file:
        file.write(struct.pack("<4sII", b"glTF", 2, 12 + 8 + len(words) + 8 + offset))
        file.write(struct.pack("<I4s", len(words), b"JSON") + words)
        file.write(struct.pack("<I4s", offset, b"BIN\0"))
        for raw in data:
            file.write(raw)


def _attributes(values: Plain, degree: int) -> dict[str, np.ndarray]:
    """Each attribute (N, 1, 3 or 4), float32 or uint8."""
    parts: dict[str, np.ndarray] = {
        "POSITION": values.means,
        f"{NAME}:ROTATION": values.quaternions[:, [1, 2, 3, 0]],
        f"{NAME}:SCALE": np.exp(values.log_scales),
        f"{NAME}:OPACITY": values.opacities[:, None],
    }
    for order in range(degree + 1):
        for index in range(2 * order + 1):
            name = f"{NAME}:SH_DEGREE_{order}_COEF_{index}"
            parts[name] = values.harmonics[:, order**2 + index]
    floats = {name: np.ascontiguousarray(array, "<f4") for name, array in parts.items()}
    return floats | {"COLOR_0": _fallback(values)}


def _fallback(values: Plain) -> np.ndarray:
    """Colours and opacities (N, 4) as bytes of linear light."""
    rgb = np.clip(values.harmonics[:, 0] * DC + 0.5, 0, 1)
    linear = np.where(rgb <= 0.04045, rgb / 12.92, ((rgb + 0.055) / 1.055) ** 2.4)
    rgba = np.concatenate([linear, values.opacities[:, None]], axis=1)
    return np.rint(255 * rgba).astype(np.uint8)


def _document(views: list, accessors: list, attributes: dict, size: int) -> dict[str, Any]:
    splats = {
        "kernel": "ellipse",
        "colorSpace": "srgb_rec709_display",
        "projection": "perspective",
        "sortingMethod": "cameraDistance",
    }
    primitive = {"mode": POINTS, "attributes": attributes, "extensions": {NAME: splats}}
    return {
        "asset": {"version": "2.0", "generator": "jaxphys"},
        "extensionsUsed": [NAME],
        "scene": 0,
        "scenes": [{"nodes": [0]}],
        "nodes": [{"mesh": 0}],
        "meshes": [{"primitives": [primitive]}],
        "accessors": accessors,
        "bufferViews": views,
        "buffers": [{"byteLength": size}],
    }
