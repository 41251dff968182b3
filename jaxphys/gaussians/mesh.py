"""Textured meshes from files, as plain triangles with colours (needs the extra `mesh`: trimesh)."""

import json
import logging
import os
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from jaxphys.core.errors import InputError
from jaxphys.core.files import atomic_path
from jaxphys.core.reading import reading

# glTF prescribes y up, and most .obj exporters write it; CAD and scanning formats have z up.
_UP = {".glb": "y", ".gltf": "y", ".obj": "y"}
_OPAQUE = -1.0
# Readers hold a file several times over.
_FILE_BYTES = 2**30
_MOST_ELEMENTS = 10**8
# Of all textures of a mesh together; a picture may be thousands of times larger than its file.
_MOST_TEXELS = 8192**2
# Squares of areas of triangles between these lengths still fit float64.
_SHORTEST, _LONGEST = 1e-15, 1e15
_MOST_REPEATS = 1e6


@dataclass(frozen=True)
class Mesh:
    """F triangles with colours, in numpy.

    Attributes:
        triangles: corners, z up, shape (F, 3, 3), in the units of the file.
        colours: RGBA in [0, 1] at the corners, shape (F, 3, 4); multiplies the texture.
        uvs: texture coordinates of the corners, v upwards, shape (F, 3, 2).
        textures: RGBA images in [0, 1], each (H, W, 4).
        texture: index into `textures` for each triangle, -1 for none, shape (F,).
        cutoff: alpha below which the surface is not there; -1 where the material is opaque. (F,).
    """

    triangles: np.ndarray
    colours: np.ndarray
    uvs: np.ndarray
    textures: tuple[np.ndarray, ...]
    texture: np.ndarray
    cutoff: np.ndarray

    def doubled_normals(self) -> np.ndarray:
        """Normals of length twice the triangle's area, shape (F, 3)."""
        a, b, c = np.moveaxis(self.triangles, 1, 0)
        return np.cross(b - a, c - a)

    def areas(self) -> np.ndarray:
        """Triangle areas, shape (F,)."""
        return 0.5 * np.linalg.norm(self.doubled_normals(), axis=1)


def _import_trimesh():
    try:
        import trimesh
    except ImportError as error:
        raise InputError(
            "reading meshes needs trimesh: pip install 'jaxphys-splats[mesh]'"
        ) from error
    # It tells the user of what it meets, tracebacks included, unless somebody listens.
    logging.getLogger("trimesh").addHandler(logging.NullHandler())
    return trimesh


def _encode(linear: np.ndarray) -> np.ndarray:
    """Linear light to sRGB values (IEC 61966-2-1), alpha untouched."""
    rgb = np.clip(linear[..., :3], 0, 1)
    bright = 1.055 * np.maximum(rgb, 1e-8) ** (1 / 2.4) - 0.055
    rgb = np.where(rgb <= 0.0031308, 12.92 * rgb, bright)
    return np.concatenate([rgb, linear[..., 3:]], axis=-1)


def _rgba(values, dtype=np.float64) -> np.ndarray:
    """Bytes or floats, RGB or RGBA, as float RGBA in [0, 1]."""
    values = np.asarray(values)
    scale = 255 if np.issubdtype(values.dtype, np.integer) else 1
    values = np.clip(values.astype(dtype) / dtype(scale), 0, 1)
    if values.shape[-1] == 3:
        values = np.concatenate([values, np.ones_like(values[..., :1])], axis=-1)
    return values


def _material(material, linear: bool) -> tuple[np.ndarray, Any, float]:
    """A material's factor (RGBA, display values), its image or None, and its alpha cutoff.

    glTF multiplies the decoded texture by a factor in linear light. Encoding the factor and
    multiplying display values gives the same for a power law, and sRGB is nearly one.
    """
    if hasattr(material, "baseColorFactor"):
        factor, image = material.baseColorFactor, material.baseColorTexture
        mode = (material.alphaMode or "OPAQUE").upper()
        cutoff = {"OPAQUE": _OPAQUE, "MASK": material.alphaCutoff or 0.5}.get(mode, 0.5)
    else:
        factor, image = getattr(material, "diffuse", None), getattr(material, "image", None)
        cutoff = 0.5 if image is not None and "A" in image.getbands() else _OPAQUE
        # Many .mtl files leave Kd black under a texture; viewers then show the texture.
        if image is not None and factor is not None and not np.any(np.asarray(factor)[:3]):
            factor = None
    factor = np.ones(4) if factor is None else _rgba(factor)
    return (_encode(factor) if linear else factor), image, cutoff


def _require_companions(path: Path) -> None:
    """An .obj names its .mtl, and that its images: a missing or broken one would silently leave it
    grey.
    """
    from PIL import Image

    def named(file: Path, keyword: str) -> list[Path]:
        lines = file.read_text(errors="replace").splitlines()
        found = [words for line in lines if (words := line.split(None, 1))[:1] == [keyword]]
        if any(len(words) < 2 or "\0" in words[1] for words in found):
            raise InputError(f"{file}: a line {keyword} names no file; export it again")
        return [file.parent / words[1].strip().replace("\\", "/") for words in found]

    for library in named(path, "mtllib"):
        if not library.is_file():
            raise InputError(f"{path}: its materials {library} are missing; put the file there")
        texels = 0
        for image in named(library, "map_Kd"):
            if not image.is_file():
                image = image.parent / image.name.split()[-1]  # "map_Kd -s 1 1 1 name.png"
            if not image.is_file():
                raise InputError(f"{library}: its texture {image} is missing; put the file there")
            try:
                with Image.open(image) as opened:
                    texels += _texels(opened)
                    _require_texels(texels, library)
                    opened.load()
            except InputError:
                raise
            except Exception as error:  # decoders of a dozen formats raise whatever they meet
                raise InputError(
                    f"{library}: its texture {image} cannot be read ({error}); export it again"
                ) from error


def _require_few_elements(path: Path) -> None:
    """An accessor without data stands for zeros, as many as it says."""
    with path.open("rb") as file:
        start = file.read(20)
        binary = start[:4] == b"glTF"
        text = file.read(int.from_bytes(start[12:16], "little")) if binary else start + file.read()
    try:
        count = sum(accessor["count"] for accessor in json.loads(text)["accessors"])
    except (ValueError, LookupError, TypeError, RecursionError):
        return  # it is no glTF, which its own reader will tell
    if not count <= _MOST_ELEMENTS:
        raise InputError(
            f"{path}: promises {count:.3g} corners and indices, more than the limit of "
            f"{_MOST_ELEMENTS:.3g}; simplify the mesh"
        )


def load_mesh(path: str | os.PathLike, *, up: str | None = None) -> Mesh:
    """The triangles of a mesh file, with every part's transform, material and texture applied.

    Formats: those of trimesh (.obj with .mtl and images, .glb, .gltf, .stl, .ply, .off, ...).

    Args:
        path: the file.
        up: which axis of the file points up, "y" or "z"; by default y for .glb, .gltf and .obj, z
            for others. y-up files are turned, (x, y, z) -> (x, -z, y), since the world has z up.

    Raises:
        InputError: trimesh is not installed; the file or a texture is missing, cannot be parsed,
            holds no triangles, has corners that are not finite, or no extent along some axis.
    """
    if up not in (None, "y", "z"):
        raise InputError(f"up={up!r}: give 'y' or 'z'")
    with reading(path, _FILE_BYTES) as path:
        mesh = _joined(
            path, _parts(path, _import_trimesh()), up or _UP.get(path.suffix.lower(), "z")
        )
        _require_solid(path, mesh)
        return mesh


def write_triangles(path: str | os.PathLike, triangles: np.ndarray) -> None:
    """Writes triangles (F, 3, 3) as a .ply file that `load_mesh` reads to the last digit."""
    count = len(triangles)
    header = [
        "ply",
        "format binary_little_endian 1.0",
        f"element vertex {3 * count}",
        *(f"property double {axis}" for axis in "xyz"),
        f"element face {count}",
        "property list uchar int vertex_indices",
        "end_header",
    ]
    faces = np.zeros(count, [("corners", "u1"), ("index", "<i4", 3)])
    faces["corners"], faces["index"] = 3, np.arange(3 * count).reshape(-1, 3)
    with atomic_path(path) as aside:
        corners = np.ascontiguousarray(triangles, "<f8").tobytes()
        aside.write_bytes("\n".join([*header, ""]).encode() + corners + faces.tobytes())


def _parts(path: Path, trimesh) -> list[tuple[np.ndarray, object]]:
    """The transform (4, 4) and the geometry of each part of a file."""
    if path.suffix.lower() == ".obj":
        _require_companions(path)
    if path.suffix.lower() in (".glb", ".gltf"):
        _require_few_elements(path)
    try:
        scene = trimesh.load_scene(path, process=False)
        nodes = [scene.graph[node] for node in scene.graph.nodes_geometry]
        return [(matrix, scene.geometry[name]) for matrix, name in nodes]
    except Exception as error:  # parsers of a dozen formats raise whatever they meet
        raise InputError(
            f"{path}: cannot be read as a mesh ({type(error).__name__}: {error}); export it again"
            f" as .glb, .obj, .stl or .ply"
        ) from error


def _texels(image) -> int:
    """Read from a picture's header, before it is unpacked."""
    return image.size[0] * image.size[1]


def _require_texels(count: int, path: Path) -> None:
    if count > _MOST_TEXELS:
        raise InputError(
            f"{path}: its textures have {count / 1e6:.0f} million pixels, more than the limit of "
            f"{_MOST_TEXELS / 1e6:.0f}; scale them down"
        )


def _joined(path: Path, parts: list[tuple[np.ndarray, Any]], up: str) -> Mesh:
    pieces = []
    images: dict[int, int] = {}
    textures: list[np.ndarray] = []
    texels = 0
    linear = path.suffix.lower() in (".glb", ".gltf")
    for matrix, part in parts:
        faces = getattr(part, "faces", None)
        if faces is None or len(faces) == 0:
            continue
        if np.ndim(part.vertices) != 2 or np.shape(part.vertices)[1] != 3:
            raise InputError(f"{path}: corners that are no three numbers each; export it again")
        outside = (np.asarray(faces) < 0) | (np.asarray(faces) >= len(part.vertices))
        if outside.any():
            raise InputError(
                f"{path}: {outside.any(axis=1).sum()} of {len(faces)} triangles name corners that "
                f"the file does not hold (it has {len(part.vertices)}); export it again"
            )
        corners = np.asarray(part.vertices, np.float64)[faces]
        with np.errstate(invalid="ignore", over="ignore"):  # told below, for all parts together
            corners = corners @ matrix[:3, :3].T + matrix[:3, 3]
        colours, uvs = np.ones((*corners.shape[:2], 4)), np.zeros((*corners.shape[:2], 2))
        index, cutoff = -1, _OPAQUE
        if part.visual.kind == "texture":
            try:
                factor, image, cutoff = _material(part.visual.material, linear)
                if part.visual.uv is None:
                    image = None
                if image is not None and id(image) not in images:
                    images[id(image)] = len(textures)
                    texels += _texels(image)
                    _require_texels(texels, path)
                    textures.append(_rgba(np.asarray(image.convert("RGBA")), np.float32))
            except InputError:
                raise
            except Exception as error:  # of a kind that no material has, or a broken picture
                raise InputError(
                    f"{path}: a material cannot be used ({type(error).__name__}: {error}); export "
                    "it again"
                ) from error
            colours = colours * factor
            if image is not None:
                index, uvs = images[id(image)], np.asarray(part.visual.uv, np.float64)[faces]
            vertex = part.vertex_attributes.get("color")
        else:
            vertex = None
        if part.visual.kind == "vertex":
            vertex = part.visual.vertex_colors
        if vertex is not None:
            values = _rgba(vertex)
            colours = colours * (_encode(values) if linear else values)[faces]
        elif part.visual.kind == "face":
            colours = colours * _rgba(part.visual.face_colors)[:, None]
        count = len(faces)
        pieces.append((corners, colours, uvs, np.full(count, index), np.full(count, cutoff)))
    if not pieces:
        raise InputError(f"{path}: no triangles (a point cloud or an empty file); give a surface")
    corners, colours, uvs, texture, cutoffs = (np.concatenate(p) for p in zip(*pieces, strict=True))
    bad = ~(np.abs(corners) < _LONGEST).all(axis=(1, 2))
    if bad.any():
        raise InputError(
            f"{path}: {bad.sum()} of {bad.size} triangles have corners that are not finite or "
            f"beyond {_LONGEST:g} (first: {np.argmax(bad)}); repair the mesh"
        )
    if not np.isfinite(colours).all():
        raise InputError(f"{path}: colours that are not finite; repair the mesh")
    if up == "y":
        # Not -z: a zero without sign is read again as it is.
        corners = np.stack([corners[..., 0], 0 - corners[..., 2], corners[..., 1]], axis=-1)
    uvs = np.clip(np.nan_to_num(uvs), -_MOST_REPEATS, _MOST_REPEATS)
    return Mesh(corners, colours, uvs, tuple(textures), texture, cutoffs)


def _require_solid(path: Path, mesh: Mesh) -> None:
    extent = np.ptp(mesh.triangles.reshape(-1, 3), axis=0)
    if extent.min() <= 1e-6 * extent.max():
        axis = "xyz"[int(np.argmin(extent))]
        raise InputError(
            f"{path}: flat, no extent along {axis}: it encloses no volume; give it thickness"
        )
    if extent.max() < _SHORTEST:
        raise InputError(f"{path}: is smaller than {_SHORTEST:g} in all; scale it up")
    if not mesh.areas().sum() > 0:
        raise InputError(f"{path}: every triangle has zero area; repair the mesh")
