"""A motion made up for tests of pages, and a reader of packed motions that shares no code with the
writer's."""

import base64
import zlib

import numpy as np

from jaxphys.page.motion_data import Moving, pack
from jaxphys.page.videos import Entry


def tumbling(count=300, frames=5, seed=0, grow=0.3):
    """Gaussians on a ball that falls, turns and stretches, with axes in random order and sign."""
    random = np.random.default_rng(seed)
    points = random.normal(size=(count, 3))
    points /= np.linalg.norm(points, axis=1, keepdims=True)
    turns = random.normal(size=(count, 4))
    sizes = np.log(random.uniform(0.02, 0.2, size=(count, 3)))
    means, quaternions, log_scales = [], [], []
    for t in range(frames):
        angle = 0.15 * t
        turn = np.array([np.cos(angle / 2), 0.0, 0.0, np.sin(angle / 2)])
        spun = points @ rotation(turn).T
        means.append(spun * (1 + grow * t / frames) + [0, 0, 2 - 0.1 * t])
        quaternions.append(product(turn, turns) * random.choice([-1, 1], size=(count, 1)))
        log_scales.append(sizes + 0.02 * t)
    return Moving(
        means=np.stack(means),
        quaternions=np.stack(quaternions),
        log_scales=np.stack(log_scales),
        colours=0.5 + 0.5 * points,
        opacities=random.uniform(0.2, 1, count),
        seconds=np.arange(frames) / 24,
    )


def rotation(q):
    """(..., 3, 3) of quaternions (..., 4) of any length: v -> q v q^-1."""
    w, x, y, z = np.moveaxis(q / np.linalg.norm(q, axis=-1, keepdims=True), -1, 0)
    K = np.zeros((*w.shape, 3, 3))
    K[..., 0, 1], K[..., 0, 2], K[..., 1, 2] = -z, y, -x
    K[..., 1, 0], K[..., 2, 0], K[..., 2, 1] = z, -y, x
    return np.eye(3) + 2 * w[..., None, None] * K + 2 * K @ K


def product(p, q):
    w, v = p[..., :1], p[..., 1:]
    W, V = q[..., :1], q[..., 1:]
    real = w * W - np.sum(v * V, -1, keepdims=True)
    return np.concatenate([real, w * V + W * v + np.cross(np.broadcast_to(v, V.shape), V)], -1)


def covariances(quaternions, log_scales):
    A = rotation(quaternions) * np.exp(log_scales)[..., None, :]
    return A @ np.swapaxes(A, -1, -2)


def unpacked(header, payload):
    """Means, quaternions, log scales and RGBA of a packed motion."""
    data = zlib.decompress(base64.b64decode(payload), wbits=-15)
    count, frames = header["count"], header["frames"]
    shades = np.frombuffer(data[: 4 * count], np.uint8).reshape(4, count).T / 255
    planes = np.frombuffer(data[4 * count :], np.uint8).reshape(frames, 9, 2, count)
    changes = planes[:, :, 0].astype(np.int64) + 256 * planes[:, :, 1].astype(np.int64)
    words = np.cumsum(changes, axis=0) % 65536
    means = np.moveaxis(words[:, :3], 1, 2) * header["step"] + header["low"]
    turns = np.moveaxis(words[:, 3:6], 1, 2)
    missing = turns[..., 0] // 2048 + 2 * (turns[..., 1] // 2048)
    small = (turns % 2048 / 2047 - 0.5) * 2**0.5
    rest = np.sqrt(np.maximum(1 - np.sum(small**2, -1), 0))
    quaternions = np.zeros((frames, count, 4))
    for place in range(4):
        here = missing == place
        quaternions[here, place] = rest[here]
        others = [axis for axis in range(4) if axis != place]
        for k, axis in enumerate(others):
            quaternions[here, axis] = small[here, k]
    sizes = np.moveaxis(words[:, 6:], 1, 2) * header["size_step"] + header["size_low"]
    return means, quaternions, sizes, shades


def entry(moving=None, title="a ball", **changes):
    moving = moving or tumbling(frames=24)
    given = {
        "title": title,
        "facts": {"Material": "jelly"},
        "film": b"no film",
        "motion": pack(moving, 4_000_000),
        "view": {
            "target": [0.0, 0.0, 1.0],
            "distance": 7.0,
            "azimuth": -1.0,
            "elevation": 0.25,
            "axes": np.eye(3).tolist(),
            "field": 0.7,
            "aspect": 1.5,
        },
        "surroundings": {
            "background": [1.0, 1.0, 1.0],
            "colour": [0.8, 0.8, 0.7],
            "place": [0.0, 0.0, -1.0, 2.0],
        },
        "fps": 24.0,
    }
    return Entry(**(given | changes))
