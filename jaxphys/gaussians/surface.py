"""Gaussians that cover the surface of a mesh: even samples, coloured, flat along the normal."""

from dataclasses import dataclass

import jax.numpy as jnp
import numpy as np
from scipy.spatial import cKDTree

from jaxphys.core.errors import InputError
from jaxphys.gaussians.gaussians import Gaussians, from_points
from jaxphys.gaussians.mesh import Mesh
from jaxphys.gaussians.thinning import thin

# Candidates per sample wanted, before the crowded ones are thinned out.
_OVERSAMPLING = 3
# Standard deviation over sample spacing: the least at which random surface points are covered to
# nine tenths by discs of opacity 0.95 (tests/gaussians/test_mesh.py).
_SIZE_OVER_SPACING = 0.75
_NEIGHBOURS = 6


@dataclass(frozen=True)
class SurfaceSamples:
    """N points on a surface.

    Attributes:
        points: (N, 3).
        normals: unit, (N, 3).
        colours: RGB in [0, 1], (N, 3).
        spacing: distance to the neighbouring samples, (N,).
    """

    points: np.ndarray
    normals: np.ndarray
    colours: np.ndarray
    spacing: np.ndarray


def _shrink(image: np.ndarray, factor: int) -> np.ndarray:
    """Box average over factor x factor texels; colours weighted by alpha."""
    height, width = (max(size // factor, 1) for size in image.shape[:2])
    rows = np.linspace(0, image.shape[0], height, endpoint=False).astype(int)
    columns = np.linspace(0, image.shape[1], width, endpoint=False).astype(int)

    def total(values):
        return np.add.reduceat(np.add.reduceat(values, rows, axis=0), columns, axis=1)

    weight = np.maximum(image[..., 3:], 1e-6)
    colour = total(image[..., :3] * weight) / total(weight)
    alpha = total(image[..., 3:]) / total(np.ones_like(weight))
    return np.concatenate([colour, alpha], axis=-1)


def _lookup(image: np.ndarray, uv: np.ndarray) -> np.ndarray:
    """Bilinear values (N, 4) of a repeating texture at uv (N, 2), v upwards."""
    height, width = image.shape[:2]
    x, y = uv[:, 0] * width - 0.5, (1 - uv[:, 1]) * height - 0.5
    x0, y0 = np.floor(x).astype(int), np.floor(y).astype(int)
    fx, fy = (x - x0)[:, None], (y - y0)[:, None]
    left, right = x0 % width, (x0 + 1) % width
    top, bottom = y0 % height, (y0 + 1) % height
    upper = image[top, left] * (1 - fx) + image[top, right] * fx
    lower = image[bottom, left] * (1 - fx) + image[bottom, right] * fx
    return upper * (1 - fy) + lower * fy


def _texel_size(mesh: Mesh, index: int) -> float:
    """Mean length on the surface of one texel of texture `index`."""
    used = mesh.texture == index
    a, b, c = np.moveaxis(mesh.uvs[used], 1, 0)
    u, v = b - a, c - a
    covered = 0.5 * np.abs(u[:, 0] * v[:, 1] - u[:, 1] * v[:, 0]).sum()
    texels = covered * np.prod(mesh.textures[index].shape[:2])
    return float(np.sqrt(mesh.areas()[used].sum() / max(texels, 1)))


def _colours(mesh: Mesh, face: np.ndarray, weights: np.ndarray, spacing: float) -> np.ndarray:
    """RGBA (N, 4) at barycentric `weights` (N, 3) of `face` (N,), averaged over about `spacing`."""
    colour = np.einsum("nk,nkc->nc", weights, mesh.colours[face])
    uv = np.einsum("nk,nkc->nc", weights, mesh.uvs[face])
    for index, image in enumerate(mesh.textures):
        here = mesh.texture[face] == index
        if here.any():
            factor = max(int(spacing / _texel_size(mesh, index)), 1)
            coarse = _shrink(image, factor) if factor > 1 else image
            colour[here] *= _lookup(coarse, uv[here])
    return colour


def _draw(mesh: Mesh, areas: np.ndarray, count: int, spacing: float, random) -> tuple:
    """`count` random samples: faces stratified by area, points uniform within each."""
    total = np.cumsum(areas)
    position = (np.arange(count) + random.random(count)) / count * total[-1]
    face = np.minimum(np.searchsorted(total, position, side="right"), len(areas) - 1)
    a, b = random.random((2, count))
    root = np.sqrt(a)
    weights = np.stack([1 - root, root * (1 - b), root * b], axis=-1)
    colour = _colours(mesh, face, weights, spacing)
    present = colour[:, 3] >= mesh.cutoff[face]
    return face[present], weights[present], colour[present]


def sample_surface(mesh: Mesh, count: int, seed: int = 0) -> SurfaceSamples:
    """`count` evenly spread points of the surface; the same seed gives the same points.

    Points are uniform by area, then thinned to keep apart from their neighbours; the two sides of
    a thin wall do not compete. Parts that a texture's alpha cuts out get no points.

    Raises:
        InputError: `count` is not positive, or the texture cuts everything out.
    """
    if count < 1:
        raise InputError(f"{count} surface samples: give at least 1")
    random = np.random.default_rng(seed)
    doubled = mesh.doubled_normals()
    length = np.linalg.norm(doubled, axis=1)
    areas = 0.5 * length
    spacing = float(np.sqrt(areas.sum() / count))
    wanted = _OVERSAMPLING * count
    face, weights, colour = _draw(mesh, areas, wanted, spacing, random)
    share = len(face) / wanted
    if share == 0:
        raise InputError("the texture's alpha cuts the whole surface out; check its alpha channel")
    if share < 1:
        spacing *= np.sqrt(share)
        face, weights, colour = _draw(mesh, areas, int(wanted / share) + 1, spacing, random)
    points = np.einsum("nk,nkc->nc", weights, mesh.triangles[face])
    normals = doubled[face] / length[face, None]
    return _thinned(points, normals, np.clip(colour[:, :3], 0, 1), count, spacing)


def even_samples(
    points: np.ndarray,
    normals: np.ndarray,
    colours: np.ndarray,
    count: int,
    *,
    oriented: bool = True,
) -> SurfaceSamples:
    """`count` evenly spread ones of dense samples (N, 3) of a surface, N > count, with unit normals
    and colours in [0, 1]; the two sides of a thin wall do not compete, if normals are `oriented`.

    Raises:
        InputError: `count` is not positive.
    """
    if count < 1:
        raise InputError(f"{count} surface samples: give at least 1")
    near = min(_NEIGHBOURS, len(points) - 1)
    radius = cKDTree(points).query(points, k=near + 1)[0][:, -1] if near else np.ones(1)
    area = np.pi * np.sum(radius**2) / (near + 0.5)
    return _thinned(points, normals, colours, count, float(np.sqrt(area / count)), oriented)


def _thinned(
    points, normals, colours, count: int, spacing: float, oriented: bool = True
) -> SurfaceSamples:
    features = np.concatenate([points, spacing * normals], axis=1) if oriented else points
    kept = thin(features, count)
    return SurfaceSamples(
        points[kept], normals[kept], colours[kept], _spacing(features[kept], spacing)
    )


def _spacing(features: np.ndarray, spacing: float) -> np.ndarray:
    """Side of the square that each sample has to itself, from the distance to the sixth neighbour.

    A disc of that radius holds six and a half samples. Where the surface is thinner than a few
    spacings the disc is cut; the bound keeps such sizes near the mean.
    """
    neighbours = min(_NEIGHBOURS, len(features) - 1)
    if neighbours < 1:
        return np.full(len(features), spacing)
    distance = cKDTree(features).query(features, k=neighbours + 1)[0][:, -1]
    return np.clip(distance * np.sqrt(np.pi / (neighbours + 0.5)), 0.5 * spacing, 1.5 * spacing)


def facing(normals: np.ndarray) -> np.ndarray:
    """Quaternions (N, 4) whose third axis is along unit `normals` (N, 3), up to sign.

    A disc is the same from both sides, so the normal is turned to z >= 0 first, where the shortest
    rotation from z is well defined.
    """
    upward = np.where(normals[:, 2:] < 0, -normals, normals)
    x, y, z = upward.T
    quaternions = np.stack([1 + z, -y, x, np.zeros_like(x)], axis=-1)
    return quaternions / np.linalg.norm(quaternions, axis=1, keepdims=True)


def gaussians_from_mesh(
    mesh: Mesh,
    count: int,
    seed: int = 0,
    *,
    opacity: float = 0.95,
    thickness: float = 0.1,
    degree: int = 0,
    dtype=jnp.float32,
) -> Gaussians:
    """`count` flat Gaussians that cover the mesh without holes.

    Args:
        mesh: from `load_mesh`.
        count: of Gaussians, at least 1.
        seed: of the random samples; the same gives the same Gaussians.
        opacity: of each, in [0, 1].
        thickness: standard deviation along the normal over that along the surface, above 0.
        degree: of the harmonics; those above 0 are zero.
        dtype: of the result.

    Raises:
        InputError: see `sample_surface`; or `thickness` is not positive.
    """
    return gaussians_from_samples(
        sample_surface(mesh, count, seed),
        opacity=opacity,
        thickness=thickness,
        degree=degree,
        dtype=dtype,
    )


def gaussians_from_samples(
    samples: SurfaceSamples,
    *,
    opacity: float = 0.95,
    thickness: float = 0.1,
    degree: int = 0,
    dtype=jnp.float32,
) -> Gaussians:
    """A flat Gaussian at each sample, as `gaussians_from_mesh` takes them."""
    if not thickness > 0:
        raise InputError(f"thickness {thickness}: give a positive number")
    sizes = _SIZE_OVER_SPACING * samples.spacing[:, None] * np.array([1, 1, thickness])
    return from_points(
        samples.points.astype(dtype),
        samples.colours,
        sizes,
        opacity=opacity,
        quaternions=facing(samples.normals),
        degree=degree,
    )
