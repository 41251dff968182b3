"""Reads OBJ, MTL and textures out of an archive, as samples of coloured surface."""

import io
import posixpath
from itertools import pairwise
from typing import NamedTuple
from zipfile import ZipFile

import numpy as np
from PIL import Image

GLASS = 0.35  # materials less opaque than this are left out


class Material(NamedTuple):
    """Diffuse colour (3,) in [0, 1], opacity, and a texture (H, W, 3) or None."""

    colour: np.ndarray
    opacity: float
    texture: np.ndarray | None


class Triangles(NamedTuple):
    """Corners (T, 3, 3), texture coordinates (T, 3, 2), material index (T,), and the materials."""

    corners: np.ndarray
    coordinates: np.ndarray
    material: np.ndarray
    materials: list[Material]


DEFAULT = Material(np.array([0.8, 0.8, 0.8]), 1.0, None)


def resolve(archive: ZipFile, folder: str, name: str) -> str | None:
    """The member of `archive` that `name` means beside `folder`, whatever its case and slashes."""
    wanted = posixpath.normpath(posixpath.join(folder, name.strip().replace("\\", "/"))).lower()
    return next((member for member in archive.namelist() if member.lower() == wanted), None)


def read_texture(archive: ZipFile, member: str) -> np.ndarray:
    """(H, W, 3) in [0, 1], at most 256 pixels a side."""
    image = Image.open(io.BytesIO(archive.read(member)))
    image.thumbnail((256, 256))
    return np.asarray(image.convert("RGB"), np.float32) / 255


def read_materials(archive: ZipFile, member: str) -> dict[str, Material]:
    """The materials of an MTL file by name."""
    found, name = {}, None
    for line in archive.read(member).decode("latin-1").splitlines():
        words = line.split()
        if not words:
            continue
        if words[0] == "newmtl":
            name = " ".join(words[1:])
            found[name] = DEFAULT
        elif name is None:
            continue
        elif words[0] == "Kd":
            found[name] = found[name]._replace(colour=np.array(words[1:4], float))
        elif words[0] == "d":
            found[name] = found[name]._replace(opacity=float(words[-1]))
        elif words[0] == "map_Kd":
            path = resolve(archive, posixpath.dirname(member), words[-1])
            if path is not None:
                found[name] = found[name]._replace(texture=read_texture(archive, path))
    return found


def read(archive: ZipFile, member: str) -> Triangles:
    """The triangles of an OBJ file; polygons become fans. Normals and groups are not read."""
    vertices, coordinates, corners, of_triangle = [], [], [], []
    library, index_of, materials, current = {}, {}, [DEFAULT], 0
    for line in archive.read(member).decode("latin-1").splitlines():
        head, _, rest = line.partition(" ")
        if head == "v":
            vertices.append(rest.split()[:3])
        elif head == "vt":
            coordinates.append(rest.split()[:2])
        elif head == "f":
            polygon = [word.split("/") for word in rest.split()]
            polygon = [
                (
                    number(corner[0], len(vertices)),
                    number(corner[1], len(coordinates)) if len(corner) > 1 and corner[1] else -1,
                )
                for corner in polygon
            ]
            for second, third in pairwise(polygon[1:]):
                corners.append((polygon[0], second, third))
                of_triangle.append(current)
        elif head == "usemtl":
            name = rest.strip()
            if name not in index_of:
                index_of[name] = len(materials)
                materials.append(library.get(name, DEFAULT))
            current = index_of[name]
        elif head == "mtllib":
            path = resolve(archive, posixpath.dirname(member), rest)
            if path is not None:
                library |= read_materials(archive, path)
    if not corners:
        raise ValueError(f"{member}: no faces")
    index = np.array(corners)
    # The extra last row serves corners without texture coordinates (index -1).
    table = np.array([*coordinates, ["0", "0"]], np.float32)
    return Triangles(
        np.array(vertices, np.float64)[index[..., 0]],
        table[index[..., 1]],
        np.array(of_triangle),
        materials,
    )


def number(text: str, count: int) -> int:
    """A zero-based index from OBJ's one-based or negative (relative to the end) one."""
    value = int(text)
    return value - 1 if value > 0 else count + value


def sample(triangles: Triangles, count: int, rng: np.random.Generator):
    """`count` points over the opaque surface: points, unit normals and albedo, each (count, 3)."""
    opaque = np.array([material.opacity >= GLASS for material in triangles.materials])
    corners = triangles.corners
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    area = np.linalg.norm(normals, axis=1)
    weight = area * opaque[triangles.material]
    if not weight.sum() > 0:
        weight = area
    at = (np.arange(count) + rng.random(count)) / count * weight.sum()
    chosen = np.minimum(np.searchsorted(np.cumsum(weight), at), len(area) - 1)
    u, v = rng.random((2, count, 1))
    flip = u + v > 1
    u, v = np.where(flip, 1 - u, u), np.where(flip, 1 - v, v)
    barycentric = np.concatenate([1 - u - v, u, v], 1)[..., None]
    points = (corners[chosen] * barycentric).sum(1)
    coordinates = (triangles.coordinates[chosen] * barycentric).sum(1)
    material = triangles.material[chosen]
    colours = np.array([m.colour for m in triangles.materials])[material]
    for index, entry in enumerate(triangles.materials):
        if entry.texture is not None and (mine := material == index).any():
            height, width = entry.texture.shape[:2]
            s, t = np.nan_to_num(coordinates[mine]).T % 1
            column = np.minimum((s * width).astype(int), width - 1)
            colours[mine] = entry.texture[
                np.minimum(((1 - t) * height).astype(int), height - 1), column
            ]
    return points, normals[chosen] / np.maximum(area[chosen, None], 1e-30), np.clip(colours, 0, 1)
