"""Gaussians from whatever file a scene names."""

from pathlib import Path

from jaxphys.core.errors import InputError
from jaxphys.core.reading import reading
from jaxphys.export.compressed_ply import is_compressed_ply, read_compressed_ply
from jaxphys.export.spz import read_spz
from jaxphys.gaussians.gaussians import Gaussians
from jaxphys.gaussians.ply import read_ply
from jaxphys.gaussians.splat_file import read_splat
from jaxphys.scene.model_folder import splats_in
from jaxphys.scene.scene import Object

SPLATS = (".ply", ".spz", ".splat")
MESHES = (".obj", ".glb", ".gltf", ".stl", ".off")


def find(source: str, beside: Path | None) -> Path:
    """The path of a source: as it stands, or relative to the directory of the scene's file.

    Raises:
        InputError: a folder without splats.
    """
    path = Path(source)
    if beside is not None and not path.is_absolute() and (beside / path).exists():
        path = beside / path
    return splats_in(path) if path.is_dir() else path


def load_object(thing: Object, beside: Path | None, seed: int, where: str) -> Gaussians:
    """The Gaussians of an object: read, or made from a mesh.

    Raises:
        InputError: no source, or one that cannot be read, with the file's name.
    """
    if thing.source is None:
        raise InputError(f"{where}.source: is missing; name splats (.ply) or a mesh (.obj, .glb)")
    return load(find(thing.source, beside), count=thing.splats, seed=seed)


def load(path: str | Path, *, count: int = 20_000, seed: int = 0) -> Gaussians:
    """The Gaussians of a file of splats (.ply, compressed or not, .spz, .splat), of a folder of
    them, or of a mesh.

    Args:
        path: the file; or a folder of `generate`, or of a trained model (see `splats_in`).
        count: Gaussians that a mesh becomes.
        seed: of the random points on a mesh.

    Raises:
        InputError: the file is missing, foreign or broken.
    """
    path = Path(path)
    if path.is_dir():
        path = splats_in(path)
    suffix = path.suffix.lower()
    if not path.exists():
        raise InputError(f"{path}: no such file")
    if suffix in SPLATS:
        gaussians = _read(path, suffix)
        if not gaussians.count:
            raise InputError(f"{path}: holds no Gaussians; export it again")
        return gaussians
    if suffix in MESHES:
        from jaxphys.gaussians.mesh import load_mesh
        from jaxphys.gaussians.surface import gaussians_from_mesh

        with reading(path):
            return gaussians_from_mesh(load_mesh(path), count, seed)
    raise InputError(
        f"{path}: neither splats ({', '.join(SPLATS)}) nor a mesh ({', '.join(MESHES)}); convert it"
        " to one"
    )


def _read(path: Path, suffix: str) -> Gaussians:
    if suffix == ".spz":
        return read_spz(path)
    if suffix == ".splat":
        return read_splat(path)
    return read_compressed_ply(path) if is_compressed_ply(path) else read_ply(path)
