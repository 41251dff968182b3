"""The motion of Gaussians packed for a page: 18 bytes a Gaussian and frame before compression.

What is packed, in this order: colours and opacities, four planes of N bytes; then for each frame
nine channels (x, y, z in 16 bits; three words of the rotation and three logarithms of standard
deviations in 11 and 12, see `quantise`), each a plane of N low bytes and one of N high bytes. Words
of a frame are differences to the frame before, modulo 65536, those of the first frame to zero. All
of it is compressed as raw deflate, which browsers undo by themselves, and written in base64.
"""

import base64
import math
import zlib
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from jaxphys.core.ellipsoid_axes import nearest_axes, unit
from jaxphys.core.errors import InputError
from jaxphys.gaussians.thinning import enlarged_by, some_of
from jaxphys.page.quantise import SHAPE_LEVELS, quantised, quantised_rotations

FEWEST_FRAMES = 24  # frames are left out down to these before Gaussians are
FEWEST_GAUSSIANS = 64


@dataclass(frozen=True)
class Moving:
    """Gaussians that move, as plain arrays; T frames, N Gaussians.

    Attributes:
        means: (T, N, 3) [m].
        quaternions: (T, N, 4), w, x, y, z of any length.
        log_scales: (T, N, 3), logarithms of the standard deviations [log m].
        colours: (N, 3), the same from all sides, in [0, 1].
        opacities: (N,) in [0, 1].
        seconds: (T,) simulated time [s].
        notes: what was left out, one sentence each.
    """

    means: np.ndarray
    quaternions: np.ndarray
    log_scales: np.ndarray
    colours: np.ndarray
    opacities: np.ndarray
    seconds: np.ndarray
    notes: tuple[str, ...] = field(default=())


@dataclass(frozen=True)
class Packed:
    """What a page holds of a motion.

    Attributes:
        header: for JSON: counts, times [s], least values and steps of the quantisation.
        payload: base64.
        stride: every so many of the frames are there.
        notes: what was left out.
    """

    header: dict[str, Any]
    payload: str
    stride: int
    notes: tuple[str, ...]


def thinned(moving: Moving, count: int) -> Moving:
    """`count` of the Gaussians, enlarged; says so."""
    total = moving.means.shape[1]
    chosen = some_of(total, count)
    factor = enlarged_by(total, len(chosen))
    return replace(
        moving,
        means=moving.means[:, chosen],
        quaternions=moving.quaternions[:, chosen],
        log_scales=moving.log_scales[:, chosen] + math.log(factor),
        colours=moving.colours[chosen],
        opacities=moving.opacities[chosen],
        notes=(*moving.notes, thinning_note(total, len(chosen))),
    )


def thinning_note(total: int, count: int) -> str:
    """What a page says of Gaussians that were left out."""
    factor = enlarged_by(total, count)
    return f"Thinned from {total} Gaussians to {count}, each {factor:.2f} times as large."


def pack(moving: Moving, largest: int) -> Packed:
    """A motion in at most `largest` characters of base64.

    What does not fit loses frames first, half of them at a time down to 24 or so, then Gaussians;
    the notes say so.

    Raises:
        InputError: so small a limit holds no motion, or a number is not finite.
    """
    if not all(np.isfinite(a).all() for a in (moving.means, moving.quaternions, moving.log_scales)):
        raise InputError("a Gaussian's place or shape is not finite; make the run again")
    total, stride, chosen = len(moving.means), 1, moving
    while True:
        header, payload = _packed(every(chosen, stride))
        if len(payload) <= largest:
            break
        if -(-total // (2 * stride)) >= FEWEST_FRAMES:
            stride *= 2
            continue
        count = chosen.means.shape[1]
        fewer = int(count * 0.9 * largest / len(payload))
        if fewer < min(count, FEWEST_GAUSSIANS):
            raise InputError(
                f"--megabytes: {largest / 1e6:g} MB hold no {FEWEST_GAUSSIANS} Gaussians of"
                f" {total} frames; allow more"
            )
        chosen = thinned(moving, fewer)
    notes = chosen.notes
    if stride > 1:
        notes = (*notes, f"One of {stride} frames is here; the film has all {total}.")
    return Packed(header, payload, stride, notes)


def every(moving: Moving, stride: int) -> Moving:
    """One of `stride` frames, the first one among them."""
    return replace(
        moving,
        means=moving.means[::stride],
        quaternions=moving.quaternions[::stride],
        log_scales=moving.log_scales[::stride],
        seconds=moving.seconds[::stride],
    )


def continued(quaternions: np.ndarray, log_scales: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The same ellipsoids (T, N, 4) and (T, N, 3), each frame's axes named after those before it.
    Words then change little from frame to frame, and compress.
    """
    q, s = unit(np.array(quaternions, np.float64)), np.array(log_scales, np.float64)
    for t in range(1, len(q)):
        q[t], s[t] = nearest_axes(q[t - 1], q[t], s[t])
    return q, s


def _packed(moving: Moving) -> tuple[dict[str, Any], str]:
    """Header and base64 of a motion as it is."""
    frames, count = moving.means.shape[:2]
    quaternions, log_scales = continued(moving.quaternions, moving.log_scales)
    places, low, step = quantised(moving.means, axis=(0, 1))
    sizes, least, size_step = quantised(log_scales, levels=SHAPE_LEVELS)
    words = np.concatenate([places, quantised_rotations(quaternions), sizes], axis=-1)
    words = np.diff(words, axis=0, prepend=np.zeros_like(words[:1]))  # modulo 65536
    words = np.ascontiguousarray(np.swapaxes(words, 1, 2))  # (T, 9, N)
    planes = np.stack([words & 255, words >> 8], axis=2).astype(np.uint8)
    shades = np.concatenate([moving.colours, moving.opacities[:, None]], axis=1)
    shades = np.round(255 * np.clip(shades, 0, 1)).astype(np.uint8).T
    packer = zlib.compressobj(6, zlib.DEFLATED, -15)
    body = packer.compress(shades.tobytes() + planes.tobytes()) + packer.flush()
    header = {
        "count": count,
        "frames": frames,
        "seconds": [round(float(time), 6) for time in moving.seconds],
        "low": low.tolist(),
        "step": step.tolist(),
        "size_low": float(least),
        "size_step": float(size_step),
    }
    return header, base64.b64encode(body).decode()
