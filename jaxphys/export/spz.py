"""Gaussians as SPZ files, some 20 bytes each before they are zipped (Niantic's `spz` library).

Written is version 3, which every reader of the format knows: a gzip stream of a header of 16 bytes
and then, attribute by attribute over all Gaussians,

    centres      3 x 24 bits, fixed point with as many binary places as the header says
    opacities    8 bits over [0, 1]
    colours      3 x 8 bits, 0.15 * 255 times the coefficient of degree 0, plus 127.5
    scales       3 x 8 bits, 16 (ln s + 10)
    rotations    which of x, y, z, w is the largest (2 bits), the others as sign and 9 bits
    harmonics    3 x 8 bits a coefficient, 128 times it, plus 128

Axes are right, up, back: y is up, so that ours are turned when written and turned back when read.
"""

import gzip
import io
import math
import os
import struct
import zlib

import jax.numpy as jnp
import numpy as np

from jaxphys.core.errors import InputError
from jaxphys.core.files import atomic_path
from jaxphys.core.reading import reading
from jaxphys.export.frames import plain
from jaxphys.export.y_up import to_y_up, to_z_up
from jaxphys.gaussians.gaussians import LOGIT_LIMIT, Gaussians

HEADER = struct.Struct("<IIIBBBB")  # magic, version, count, degree, binary places, flags, reserved
MAGIC = 0x5053474E  # "NGSP"
VERSION = 3
COLOUR = 0.15
EXTENSIONS = 0x2
_HALF = 0.5**0.5
_OTHERS = np.array([[1, 2, 3], [0, 2, 3], [0, 1, 3], [0, 1, 2]])
_MOST = 20_000_000
# Deflate makes nothing smaller than this part of it.
_DENSEST = 1032
# Centres are kept to 2^-17 of the farthest one, and to no less than the format's usual 2^-12.
_PLACES, _USUAL_PLACES, _MOST_PLACES = 17, 12, 23


def binary_places(reach: float) -> int:
    """Binary places for coordinates of at most `reach` [m] in size, as many as 24 bits hold.

    Raises:
        InputError: not even whole metres fit.
    """
    fits = 23 - math.ceil(math.log2(max(reach + 1e-9, 2.0**-20)))
    while fits >= 0 and round(reach * 2**fits) > 2**23 - 1:
        fits -= 1
    if fits < 0:
        raise InputError(f"a centre is {reach:g} m away, more than SPZ can hold; rescale it")
    wanted = max(_PLACES - math.ceil(math.log2(max(reach, 1e-9))), _USUAL_PLACES)
    return min(fits, wanted, _MOST_PLACES)


def write_spz(path: str | os.PathLike, gaussians: Gaussians) -> None:
    """Writes `gaussians` to `path`, whole or not at all; equal values give equal bytes.

    Raises:
        InputError: there are none, or a value is not finite or too large.
    """
    values = plain(to_y_up(gaussians), str(path))
    try:
        places = binary_places(float(np.abs(values.means).max()))
    except InputError as error:
        raise InputError(f"{path}: {error}") from None
    fixed = np.rint(values.means * 2**places).astype("<i4")
    rest = values.harmonics[:, 1:]
    parts = [
        fixed.view(np.uint8).reshape(*fixed.shape, 4)[..., :3],
        _bytes(255 * values.opacities),
        _bytes(255 * COLOUR * values.harmonics[:, 0] + 127.5),
        _bytes(16 * (values.log_scales + 10)),
        _packed_rotations(values.quaternions[:, [1, 2, 3, 0]]),
        _bytes(128 * rest + 128),
    ]
    header = HEADER.pack(MAGIC, VERSION, gaussians.count, gaussians.degree, places, 0, 0)
    # No name and no time in the stream, which would differ from one writing to the next.
    with (
        atomic_path(path) as aside,
        open(aside, "wb") as file,
        gzip.GzipFile(filename="", fileobj=file, mode="wb", mtime=0) as stream,
    ):
        stream.write(header)
        for part in parts:
            stream.write(part.tobytes())


def _bytes(values: np.ndarray) -> np.ndarray:
    return np.clip(np.rint(values), 0, 255).astype(np.uint8)


def _packed_rotations(quaternions: np.ndarray) -> np.ndarray:
    """Words (N,) of unit quaternions x, y, z, w (N, 4)."""
    largest = np.argmax(np.abs(quaternions), axis=1)
    top = np.take_along_axis(quaternions, largest[:, None], axis=1)
    others = np.take_along_axis(quaternions, _OTHERS[largest], axis=1) * np.where(top < 0, -1, 1)
    sizes = np.minimum(np.floor(511 * np.abs(others) / _HALF + 0.5), 511).astype(np.uint32)
    parts = ((others < 0).astype(np.uint32) << np.uint32(9)) | sizes
    word = largest.astype(np.uint32)
    for column in range(3):
        word = (word << np.uint32(10)) | parts[:, column]
    return word.astype("<u4")


def _unpacked_rotations(word: np.ndarray) -> np.ndarray:
    """What `_packed_rotations` packed, (N, 4)."""
    largest = (word >> np.uint32(30)).astype(int)
    parts = np.stack([(word >> np.uint32(shift)) & np.uint32(1023) for shift in (20, 10, 0)], 1)
    others = np.where(parts >> np.uint32(9), -1, 1) * (parts & np.uint32(511)) * (_HALF / 511)
    top = np.sqrt(np.maximum(0, 1 - np.sum(others**2, axis=1)))
    quaternions = np.empty((len(word), 4))
    np.put_along_axis(quaternions, _OTHERS[largest], others, axis=1)
    np.put_along_axis(quaternions, largest[:, None], top[:, None], axis=1)
    return quaternions


def read_spz(path: str | os.PathLike) -> Gaussians:
    """Gaussians from an SPZ file of version 2 or 3, float32, with z up.

    Raises:
        InputError: the file is missing, damaged, cut off, of another version, or of a degree
            above 3.
    """
    with reading(path) as path:
        with open(path, "rb") as file:
            if file.read(4) == b"NGSP":
                raise InputError("an SPZ file of version 4 or newer; save it as version 3")
            file.seek(0)
            size = os.fstat(file.fileno()).st_size
            try:
                with gzip.GzipFile(fileobj=file, mode="rb") as stream:
                    version, degree, places, sizes = _header(stream.read(HEADER.size), size)
                    data = stream.read(sum(sizes) + 1)
            except (gzip.BadGzipFile, EOFError, zlib.error) as error:
                raise InputError(f"is no SPZ file, or damaged ({error}); copy it again") from None
        if len(data) != sum(sizes):
            what = "cut off" if len(data) < sum(sizes) else "longer than its header says"
            raise InputError(f"{what}; copy the file again")
        return to_z_up(_gaussians(data, version, degree, places, sizes))


def _header(data: bytes, size: int) -> tuple[int, int, int, list[int]]:
    """Version, degree, binary places, and the bytes of each attribute."""
    if len(data) < HEADER.size or data[:4] != b"NGSP":
        raise InputError("is no SPZ file (its stream does not begin with 'NGSP'); give an .spz")
    _, version, count, degree, places, flags, _ = HEADER.unpack(data)
    if version not in (2, 3):
        raise InputError(f"an SPZ file of version {version}; versions 2 and 3 can be read")
    if degree > 3:
        raise InputError(f"has harmonics of degree {degree}; save it with degree 3 or less")
    if flags & EXTENSIONS:
        raise InputError("an SPZ file with extensions; save it without them")
    if places > 24:
        raise InputError(f"has {places} binary places in 24 bits; export it again")
    if not 0 < count <= _MOST:
        raise InputError(f"holds {count} Gaussians, expected 1 to {_MOST}")
    rest = 3 * ((degree + 1) ** 2 - 1)
    sizes = [count * of for of in (9, 1, 3, 3, 4 if version == 3 else 3, rest)]
    if sum(sizes) > _DENSEST * size:
        raise InputError(f"cut off: the header promises {count} Gaussians; copy the file again")
    return version, degree, places, sizes


def _gaussians(data: bytes, version: int, degree: int, places: int, sizes: list[int]) -> Gaussians:
    stream = io.BytesIO(data)
    centres, alphas, colours, scales, rotations, rest = (
        np.frombuffer(stream.read(size), np.uint8) for size in sizes
    )
    low, middle, high = np.moveaxis(centres.reshape(-1, 3, 3).astype(np.int32), -1, 0)
    fixed = low | middle << 8 | high << 16
    fixed = (fixed ^ 0x800000) - 0x800000  # the sign of 24 bits
    opacity = alphas / 255
    with np.errstate(divide="ignore"):
        logits = np.clip(np.log(opacity) - np.log(1 - opacity), -LOGIT_LIMIT, LOGIT_LIMIT)
    if version == 3:
        xyzw = _unpacked_rotations(rotations.view("<u4"))
    else:
        xyz = rotations.reshape(-1, 3) / 127.5 - 1
        w = np.sqrt(np.maximum(0, 1 - np.sum(xyz**2, axis=1, keepdims=True)))
        xyzw = np.concatenate([xyz, w], axis=1)
    dc = (colours.reshape(-1, 1, 3) / 255 - 0.5) / COLOUR
    above = (rest.reshape(len(alphas), (degree + 1) ** 2 - 1, 3) - 128.0) / 128
    parts = [
        fixed / 2**places,
        scales.reshape(-1, 3) / 16 - 10,
        xyzw[:, [3, 0, 1, 2]],
        logits,
        np.concatenate([dc, above], axis=1),
    ]
    return Gaussians(*(jnp.asarray(part, jnp.float32) for part in parts))
