"""Captures of Gaussians that are known, in the formats that tools leave, written without the code
under test: matrices by hand, binary files by `struct`.
"""

import json
import math
import struct
from pathlib import Path

import jax.numpy as jnp
import numpy as np
from PIL import Image

from jaxphys.gaussians.gaussians import Gaussians, to_splats
from jaxphys.render import look_at, position, render

FIELD = math.radians(40)


def eyes(count: int, distance: float) -> np.ndarray:
    """Places all around, not all at one height: a spiral."""
    index = np.arange(count) + 0.5
    height = 0.8 * (1 - 2 * index / count)
    turn = index * math.pi * (3 - math.sqrt(5))
    flat = np.sqrt(1 - height**2)
    return distance * np.stack([flat * np.cos(turn), flat * np.sin(turn), height], axis=1)


def pictures(gaussians: Gaussians, places: np.ndarray, side: int) -> list[np.ndarray]:
    """What is seen from places that look at the origin, uint8 (H, W, 4)."""
    found = []
    for place in places:
        camera = look_at(place, np.zeros(3), field_of_view=FIELD, width=side, height=side)
        image = render(to_splats(gaussians, position(camera)), camera, background=0.0)
        alpha = jnp.clip(image.alpha, 0, 1)[..., None]
        colour = jnp.clip(image.colour / jnp.maximum(alpha, 1e-3), 0, 1)
        both = np.asarray(jnp.concatenate([colour, alpha], axis=-1))
        found.append((255 * both + 0.5).astype(np.uint8))
    return found


def frames_of(place: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Right, up and backwards of a camera at a place that looks at the origin, z up."""
    back = place / np.linalg.norm(place)
    right = np.cross([0.0, 0.0, 1.0], back)
    right /= np.linalg.norm(right)
    return right, np.cross(back, right), back


def write_transforms(folder: Path, places: np.ndarray, seen: list[np.ndarray], held: int) -> None:
    """As the synthetic scenes of NeRF: the last `held` pictures are in transforms_test.json."""
    entries = []
    for index, (place, picture) in enumerate(zip(places, seen, strict=True)):
        (folder / "shots").mkdir(parents=True, exist_ok=True)
        Image.fromarray(picture).save(folder / "shots" / f"r_{index}.png")
        matrix = np.eye(4)
        matrix[:3, :3] = np.stack(frames_of(place), axis=1)
        matrix[:3, 3] = place
        entries.append({"file_path": f"./shots/r_{index}", "transform_matrix": matrix.tolist()})
    cut = len(entries) - held
    for name, some in (("train", entries[:cut]), ("test", entries[cut:])):
        told = {"camera_angle_x": FIELD, "frames": some}
        (folder / f"transforms_{name}.json").write_text(json.dumps(told))


def write_colmap(
    folder: Path,
    places: np.ndarray,
    seen: list[np.ndarray],
    points: np.ndarray,
    colours: np.ndarray,
    turn: np.ndarray,
    binary: bool,
) -> None:
    """COLMAP's model in a world that is turned by `turn`, in which y points down, say."""
    model = folder / "sparse" / "0"
    model.mkdir(parents=True)
    (folder / "images").mkdir()
    side = seen[0].shape[0]
    focal = 0.5 * side / math.tan(FIELD / 2)
    poses = []
    for index, (place, picture) in enumerate(zip(places, seen, strict=True)):
        Image.fromarray(picture).save(folder / "images" / f"p{index:03d}.png")
        right, up, back = frames_of(place)
        rotation = np.stack([right, -up, -back]) @ turn.T
        translation = -rotation @ (turn @ place)
        poses.append((*quaternion_of(rotation), *translation))
    where = points @ turn.T
    bytes_of = np.round(255 * colours).astype(int)
    if binary:
        data = struct.pack("<Q", 1) + struct.pack("<iiQQ4d", 7, 1, side, side, focal, focal,
                                                  side / 2, side / 2)  # fmt: skip
        (model / "cameras.bin").write_bytes(data)
        data = struct.pack("<Q", len(poses))
        for index, pose in enumerate(poses):
            data += struct.pack("<i7di", index + 1, *pose, 7) + f"p{index:03d}.png".encode() + b"\0"
            data += struct.pack("<Qddq", 1, 3.0, 4.0, -1)
        (model / "images.bin").write_bytes(data)
        data = struct.pack("<Q", len(where))
        for index, (place, colour) in enumerate(zip(where, bytes_of, strict=True)):
            data += struct.pack("<Q3d3BdQ", index, *place, *colour, 0.5, 2)
            data += struct.pack("<iiii", 1, 0, 2, 0)
        (model / "points3D.bin").write_bytes(data)
        return
    (model / "cameras.txt").write_text(
        f"# Camera list\n7 SIMPLE_PINHOLE {side} {side} {focal} {side / 2} {side / 2}\n"
    )
    (model / "images.txt").write_text(
        "# Image list\n"
        + "".join(
            f"{i + 1} {' '.join(map(str, pose))} 7 p{i:03d}.png\n\n" for i, pose in enumerate(poses)
        )
    )
    (model / "points3D.txt").write_text(
        "".join(
            f"{i} {' '.join(map(str, p))} {' '.join(map(str, c))} 0.5 1 0\n"
            for i, (p, c) in enumerate(zip(where, bytes_of, strict=True))
        )
    )


def quaternion_of(rotation: np.ndarray) -> np.ndarray:
    """w, x, y, z of a rotation: the eigenvector of Bar-Itzhack (2000), for the largest value."""
    r = rotation
    k = np.array(
        [
            [r[0, 0] - r[1, 1] - r[2, 2], 0, 0, 0],
            [r[1, 0] + r[0, 1], r[1, 1] - r[0, 0] - r[2, 2], 0, 0],
            [r[2, 0] + r[0, 2], r[2, 1] + r[1, 2], r[2, 2] - r[0, 0] - r[1, 1], 0],
            [r[2, 1] - r[1, 2], r[0, 2] - r[2, 0], r[1, 0] - r[0, 1], np.trace(r)],
        ]
    )
    x, y, z, w = np.linalg.eigh(k)[1][:, -1]
    return np.array([w, x, y, z])
