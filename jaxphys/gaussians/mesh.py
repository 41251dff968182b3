"""Textured meshes from files, as plain triangles with colours (needs the extra `mesh`: trimesh)."""

import os
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from jaxphys.core.errors import InputError

# glTF prescribes y up, and most .obj exporters write it; CAD and scanning formats have z up.
_UP = {".glb": "y", ".gltf": "y", ".obj": "y"}
_OPAQUE = -1.0
# Readers hold a file several times over.
_FILE_BYTES = 2**30


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
    return trimesh


def _encode(linear: np.ndarray) -> np.ndarray:
    """Linear light to sRGB values (IEC 61966-2-1), alpha untouched."""
    rgb = np.clip(linear[..., :3], 0, 1)
    bright = 1.055 * np.maximum(rgb, 1e-8) ** (1 / 2.4) - 0.055
    rgb = np.where(rgb <= 0.0031308, 12.92 * rgb, bright)
    return np.concatenate([rgb, linear[..., 3:]], axis=-1)


def _rgba(values) -> np.ndarray:
    """Bytes or floats, RGB or RGBA, as float RGBA."""
    values = np.asarray(values)
    scale = 255 if np.issubdtype(values.dtype, np.integer) else 1
    values = values.astype(np.float64) / scale
    if values.shape[-1] == 3:
        values = np.concatenate([values, np.ones_like(values[..., :1])], axis=-1)
    return values


def _material(material, linear: bool) -> tuple[np.ndarray, object, float]:
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
        rests = [line.split(None, 1)[1].strip() for line in lines if line.startswith(keyword + " ")]
        return [file.parent / rest.replace("\\", "/") for rest in rests]

    for library in named(path, "mtllib"):
        if not library.is_file():
            raise InputError(f"{path}: its materials {library} are missing; put the file there")
        for image in named(library, "map_Kd"):
            if not image.is_file():
                image = image.parent / image.name.split()[-1]  # "map_Kd -s 1 1 1 name.png"
            if not image.is_file():
                raise InputError(f"{library}: its texture {image} is missing; put the file there")
            try:
                with Image.open(image) as opened:
                    opened.load()
            except Exception as error:  # decoders of a dozen formats raise whatever they meet
                raise InputError(
                    f"{library}: its texture {image} cannot be read ({error}); export it again"
                ) from error


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
    path = Path(path)
    if up not in (None, "y", "z"):
        raise InputError(f"up={up!r}: give 'y' or 'z'")
    if not path.is_file():
        raise InputError(f"{path}: no such file; check the path")
    if path.stat().st_size > _FILE_BYTES:
        raise InputError(
            f"{path}: {path.stat().st_size / 2**30:.1f} GiB, more than the limit of "
            f"{_FILE_BYTES // 2**30}; simplify the mesh"
        )
    trimesh = _import_trimesh()
    suffix = path.suffix.lower()
    if suffix == ".obj":
        _require_companions(path)
    try:
        scene = trimesh.load_scene(path, process=False)
        parts = [(scene.graph[node], node) for node in scene.graph.nodes_geometry]
    except Exception as error:  # parsers of a dozen formats raise whatever they meet
        raise InputError(
            f"{path}: cannot be read as a mesh ({type(error).__name__}: {error}); export it again"
            f" as .glb, .obj, .stl or .ply"
        ) from error
    pieces = []
    images: dict[int, int] = {}
    textures: list[np.ndarray] = []
    linear = suffix in (".glb", ".gltf")
    for (matrix, name), _ in parts:
        part = scene.geometry[name]
        faces = getattr(part, "faces", None)
        if faces is None or len(faces) == 0:
            continue
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
            factor, image, cutoff = _material(part.visual.material, linear)
            colours = colours * factor
            if image is not None and part.visual.uv is not None:
                if id(image) not in images:
                    images[id(image)] = len(textures)
                    textures.append(_rgba(np.asarray(image.convert("RGBA"))))
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
    corners, colours, uvs, texture, cutoff = (np.concatenate(p) for p in zip(*pieces, strict=True))
    bad = ~np.isfinite(corners).all(axis=(1, 2))
    if bad.any():
        raise InputError(
            f"{path}: {bad.sum()} of {bad.size} triangles have corners that are not finite (first: "
            f"{np.argmax(bad)}); repair the mesh"
        )
    if (up or _UP.get(suffix, "z")) == "y":
        corners = np.stack([corners[..., 0], -corners[..., 2], corners[..., 1]], axis=-1)
    mesh = Mesh(corners, colours, np.nan_to_num(uvs), tuple(textures), texture, cutoff)
    extent = np.ptp(corners.reshape(-1, 3), axis=0)
    if extent.min() <= 1e-6 * extent.max():
        axis = "xyz"[int(np.argmin(extent))]
        raise InputError(
            f"{path}: flat, no extent along {axis}: it encloses no volume; give it thickness"
        )
    if not mesh.areas().sum() > 0:
        raise InputError(f"{path}: every triangle has zero area; repair the mesh")
    return mesh
