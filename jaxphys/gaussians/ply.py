"""Gaussians as .ply files, in the layout of the 3D Gaussian Splatting project (Kerbl et al. 2023).

Written: binary little endian, one `vertex` element, all properties float, in the order
`x y z nx ny nz f_dc_* f_rest_* opacity scale_* rot_*`; `f_rest` is channel-major (all coefficients
of red, then green, then blue). Read: fields by name, in any order and numeric type, ascii or binary
of either byte order, with other fields and elements passed over.
"""

import os
from pathlib import Path
from typing import BinaryIO

import jax.numpy as jnp
import numpy as np

from jaxphys.core.errors import InputError, shown
from jaxphys.core.fields import LARGEST
from jaxphys.core.files import atomic_path
from jaxphys.core.reading import reading
from jaxphys.gaussians.gaussians import (
    LOG_SCALE_LIMIT,
    LOGIT_LIMIT,
    Gaussians,
    require_finite,
)

_TYPES = {
    "char": "i1",
    "int8": "i1",
    "uchar": "u1",
    "uint8": "u1",
    "short": "i2",
    "int16": "i2",
    "ushort": "u2",
    "uint16": "u2",
    "int": "i4",
    "int32": "i4",
    "uint": "u4",
    "uint32": "u4",
    "float": "f4",
    "float32": "f4",
    "double": "f8",
    "float64": "f8",
}
ORDERS = {"ascii": "<", "binary_little_endian": "<", "binary_big_endian": ">"}
_REST_COUNTS = {0: 0, 9: 1, 24: 2, 45: 3}
_HEADER_LINES = 4096
# A text line this long holds no row of numbers; a table this large is no scene that could be drawn.
_LINE_BYTES = 2**16
_TABLE_BYTES = 4 * 2**30
_POSITION = ["x", "y", "z"]
_NORMAL = ["nx", "ny", "nz"]
_DC = [f"f_dc_{i}" for i in range(3)]
_SCALE = [f"scale_{i}" for i in range(3)]
_ROTATION = [f"rot_{i}" for i in range(4)]


def _fields(degree: int) -> list[str]:
    rest = [f"f_rest_{i}" for i in range(3 * ((degree + 1) ** 2 - 1))]
    return [*_POSITION, *_NORMAL, *_DC, *rest, "opacity", *_SCALE, *_ROTATION]


def write_ply(path: str | os.PathLike, gaussians: Gaussians) -> None:
    """Writes `gaussians` to `path`, whole or not at all; equal values give equal bytes.

    Numbers are stored as float32 and normals as zeros.

    Raises:
        InputError: a value is not finite, or does not fit float32.
    """
    require_finite(gaussians, str(path))
    count = gaussians.count
    rest = np.asarray(gaussians.harmonics[:, 1:]).transpose(0, 2, 1)
    rest = rest.reshape(count, rest.shape[1] * rest.shape[2])
    columns = [
        gaussians.means,
        np.zeros((count, 3)),
        gaussians.harmonics[:, 0],
        rest,
        gaussians.opacity_logits[:, None],
        gaussians.log_scales,
        gaussians.quaternions,
    ]
    with np.errstate(over="ignore"):
        table = np.concatenate([np.asarray(c).astype("<f4") for c in columns], axis=1)
    if not np.isfinite(table).all():
        raise InputError(f"{path}: a value is beyond float32, the type of .ply files; rescale it")
    header = ["ply", "format binary_little_endian 1.0", f"element vertex {count}"]
    header += [f"property float {name}" for name in _fields(gaussians.degree)]
    header += ["end_header", ""]
    with atomic_path(path) as aside, open(aside, "wb") as file:
        file.write("\n".join(header).encode())
        file.write(table.tobytes())


class Element:
    """An element of a header: its name, how many there are, and its properties as (name, type)."""

    def __init__(self, name: str, count: int):
        self.name, self.count = name, count
        self.properties: list[tuple[str, str]] = []
        self.has_list = False

    def dtype(self, order: str) -> np.dtype:
        """Of one of them, in the byte order "<" or ">"."""
        return np.dtype([(name, order + kind) for name, kind in self.properties])


def read_header(file: BinaryIO, path) -> tuple[str, list[Element]]:
    """The format's name and the elements; leaves `file` at the first byte of data."""
    if file.readline(16).rstrip() != b"ply":
        raise InputError(f"{path}: not a .ply file (it does not begin with 'ply'); give a .ply")
    style, elements = None, []
    for _ in range(_HEADER_LINES):
        line = file.readline(4096)
        words = line.decode("ascii", errors="replace").split()
        if not line.endswith(b"\n"):
            break
        match words:
            case ["end_header"]:
                if style is None:
                    raise InputError(f"{path}: header without a 'format' line; export it again")
                return style, elements
            case [] | ["comment" | "obj_info", *_]:
                pass
            case ["format", name, "1.0"] if name in ORDERS:
                style = name
            case ["element", name, count] if count.isdecimal() and len(count) < 20:
                elements.append(Element(name, int(count)))
            case ["property", "list", *_] if elements:
                elements[-1].has_list = True
            case ["property", kind, name] if elements and kind in _TYPES:
                if name in dict(elements[-1].properties):
                    raise InputError(f"{path}: field {shown(name)} stands twice; export it again")
                elements[-1].properties.append((name, _TYPES[kind]))
            case _:
                raise InputError(f"{path}: header line {shown(' '.join(words))} is not known")
    raise InputError(f"{path}: the header has no end; the file is cut off or not a .ply")


def _read_table(file: BinaryIO, path, style: str, elements: list[Element], limit: int):
    """The vertex element as a structured array."""
    before: list[Element] = []
    for element in elements:
        if element.name == "vertex":
            break
        before.append(element)
    else:
        raise InputError(f"{path}: no 'vertex' element; export Gaussians as a 3DGS .ply")
    if not element.properties:
        raise InputError(f"{path}: its 'vertex' element has no fields; export a 3DGS .ply")
    if element.has_list or any(other.has_list for other in before):
        raise InputError(f"{path}: list properties up to 'vertex' cannot be read; export it again")
    if element.count > limit:
        raise InputError(
            f"{path}: {element.count} Gaussians, more than the limit of {limit}; thin it out or "
            f"raise `limit`"
        )
    dtype = element.dtype(ORDERS[style])
    truncated = InputError(
        f"{path}: cut off: the header promises {element.count} Gaussians; copy the file again"
    )
    if element.count * dtype.itemsize > _TABLE_BYTES:
        raise InputError(
            f"{path}: {element.count * dtype.itemsize / 2**30:.1f} GiB of Gaussians, more than the "
            f"limit of {_TABLE_BYTES // 2**30}; thin it out"
        )
    names = dtype.names or ()
    if style == "ascii":
        skipped = sum(other.count for other in before)
        values = _read_lines(file, path, skipped, element.count, len(names), truncated)
        return {name: values[:, i] for i, name in enumerate(names)}
    skipped = sum(other.count * other.dtype("<").itemsize for other in before)
    wanted = element.count * dtype.itemsize
    start = file.tell() + skipped
    available = os.fstat(file.fileno()).st_size - start
    if available < wanted:
        raise truncated
    if available > wanted and element is elements[-1]:
        raise InputError(
            f"{path}: {available - wanted} bytes more than the header promises; the file was "
            f"damaged (a text-mode copy does this) or written wrongly: export it again"
        )
    file.seek(start)
    table = np.frombuffer(file.read(wanted), dtype)
    return {name: table[name] for name in names}


def _read_lines(file: BinaryIO, path, skipped: int, count: int, width: int, truncated: InputError):
    """`count` text lines of `width` numbers, after `skipped` others, as float64 (count, width)."""
    # A number takes two bytes at least, with what parts it from the next.
    if 2 * count * width > os.fstat(file.fileno()).st_size - file.tell() + 1:
        raise truncated

    def next_line() -> bytes:
        line = file.readline(_LINE_BYTES)
        if not line:
            raise truncated
        if len(line) == _LINE_BYTES:
            raise InputError(f"{path}: a line of more than {_LINE_BYTES} bytes; export it again")
        return line

    for _ in range(skipped):
        next_line()
    values = np.empty((count, width))
    for row in values:
        words = next_line().split()
        if len(words) != width:
            raise InputError(f"{path}: a line does not hold {width} numbers")
        try:
            row[:] = np.array(words, dtype=np.float64)
        except ValueError as error:
            raise InputError(f"{path}: a line holds something that is no number") from error
    return values


def _require(path, table: dict[str, np.ndarray]) -> int:
    """The degree of the harmonics; InputError where a field is missing."""
    if "packed_position" in table:
        raise InputError(f"{path}: a compressed .ply; read it with `read_compressed_ply`")
    missing = [name for name in _fields(0) if name not in table and name not in _NORMAL]
    if missing:
        known = "a mesh or point cloud" if "f_dc_0" in missing else "an incomplete export"
        raise InputError(
            f"{path}: no field '{missing[0]}' ({len(missing)} missing): {known}, not Gaussians; "
            f"export a 3DGS .ply"
        )
    rest = sum(name.startswith("f_rest_") for name in table)
    if rest not in _REST_COUNTS:
        raise InputError(
            f"{path}: {rest} fields f_rest_*, expected 0, 9, 24 or 45; export with harmonics of "
            f"degree 3 or less"
        )
    absent = [f"f_rest_{i}" for i in range(rest) if f"f_rest_{i}" not in table]
    if absent:
        raise InputError(f"{path}: no field '{absent[0]}' among {rest} f_rest_*; export it again")
    return _REST_COUNTS[rest]


def _require_finite_fields(path, names: list[str], values: np.ndarray) -> None:
    bad = ~(np.abs(values) <= LARGEST)
    if bad.any():
        column = int(np.argmax(bad.any(axis=0)))
        rows = bad[:, column]
        raise InputError(
            f"{path}: field '{names[column]}' is not finite, or beyond {LARGEST:g}, for "
            f"{rows.sum()} of {rows.size} Gaussians (first: {np.argmax(rows)}); leave these out by "
            "jaxphys.gaussians.read_ply(FILE, drop_invalid=True), and write_ply the rest"
        )


def read_ply(
    path: str | os.PathLike,
    *,
    dtype=jnp.float32,
    limit: int = 20_000_000,
    drop_invalid: bool = False,
) -> Gaussians:
    """Gaussians from the .ply file at `path`.

    An infinite opacity logit (opacity 0 or 1) and an infinitely flat scale (log 0) are moved to the
    nearest usable value; anything else that is not finite is an error, or, with `drop_invalid`,
    leaves its Gaussian out.

    Args:
        path: the file.
        dtype: of the result; float32 keeps the bits of a float32 file.
        limit: the most Gaussians accepted, so that a damaged header cannot exhaust memory.
        drop_invalid: leave out Gaussians with a NaN instead of raising.

    Raises:
        InputError: the file is missing, cut off, not a Gaussian .ply, too large, of a degree above
            3, or holds values that are not finite.
    """
    with reading(path) as path:
        with open(path, "rb") as file:
            style, elements = read_header(file, path)
            table = _read_table(file, path, style, elements, limit)
        return _gaussians(path, table, dtype, drop_invalid)


def _gaussians(path: Path, table: dict[str, np.ndarray], dtype, drop_invalid: bool) -> Gaussians:
    names = _fields(_require(path, table))
    names = [name for name in names if name not in _NORMAL]
    with np.errstate(over="ignore"):
        values = np.stack([table[name].astype(dtype) for name in names], axis=-1)
    opacity, scale = names.index("opacity"), names.index("scale_0")
    logits, log_scales = values[:, opacity], values[:, scale : scale + 3]
    logits[np.isinf(logits)] = np.sign(logits[np.isinf(logits)]) * LOGIT_LIMIT
    log_scales[np.isneginf(log_scales)] = -LOG_SCALE_LIMIT
    if drop_invalid:
        values = values[(np.abs(values) <= LARGEST).all(axis=1)]
    _require_finite_fields(path, names, values)
    count = values.shape[0]
    dc = values[:, 3:6].reshape(count, 1, 3)
    rest = values[:, 6:opacity].reshape(count, 3, (opacity - 6) // 3).transpose(0, 2, 1)
    parts = [
        values[:, :3],
        values[:, scale : scale + 3],
        values[:, scale + 3 :],
        values[:, opacity],
        np.concatenate([dc, rest], axis=1),
    ]
    return Gaussians(*(jnp.asarray(part) for part in parts))


def read_points(path: str | os.PathLike, *, limit: int = 20_000_000) -> tuple[np.ndarray, ...]:
    """Points (N, 3) and colours in [0, 1] (N, 3), both float32, from a .ply of a point cloud.

    Colours are the fields red, green, blue, bytes or numbers in [0, 1]; grey where there are none.

    Args:
        path: the file.
        limit: the most points accepted.

    Raises:
        InputError: the file is missing, cut off, no .ply, or has no finite places.
    """
    with reading(path) as path:
        with open(path, "rb") as file:
            style, elements = read_header(file, path)
            table = _read_table(file, path, style, elements, limit)
        if missing := [name for name in _POSITION if name not in table]:
            raise InputError(f"{path}: no field '{missing[0]}'; give a .ply of points")
        points = np.stack([np.asarray(table[name], np.float64) for name in _POSITION], axis=1)
        _require_finite_fields(path, _POSITION, points)
        if any(name not in table for name in ("red", "green", "blue")):
            return points.astype(np.float32), np.full(points.shape, 0.5, np.float32)
        colours = np.stack([table[name] for name in ("red", "green", "blue")], axis=1)
        largest = 255.0 if colours.size and colours.max() > 1 else 1.0
        return points.astype(np.float32), np.clip(colours / largest, 0, 1).astype(np.float32)
