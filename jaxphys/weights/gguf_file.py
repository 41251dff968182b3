"""GGUF, the file format of llama.cpp: metadata and quantised arrays in one file.

Layout (all little-endian): "GGUF", version, number of arrays, number of metadata entries; the
entries (name, type, value); for each array its name, dimensions (the fastest first), type and
offset; then, aligned, the data. The header is walked here, with every length held against the
file's end, because the `gguf` package trusts lengths and takes seconds for a vocabulary; the
package's part is what the types of quantised blocks mean.
"""

import math
import mmap
import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from jaxphys.core.errors import InputError, shown
from jaxphys.core.finite import all_finite
from jaxphys.core.reading import reading

MAGIC = b"GGUF"
VERSIONS = (2, 3)
STRING, ARRAY = 8, 9
SCALARS = {
    0: "<u1", 1: "<i1", 2: "<u2", 3: "<i2", 4: "<u4", 5: "<i4", 6: "<f4", 7: "?",
    10: "<u8", 11: "<i8", 12: "<f8",
}  # fmt: skip
ALIGNMENT = 32
MOST_DIMENSIONS = 4

# Names of arrays in files of the Llama architecture -> those of the original checkpoints.
RENAMES = (
    (r"^token_embd\.", "model.embed_tokens."),
    (r"^output_norm\.", "model.norm."),
    (r"^output\.", "lm_head."),
    (r"^blk\.(\d+)\.", r"model.layers.\1."),
    (r"\.attn_(q|k|v)\.", r".self_attn.\1_proj."),
    (r"\.attn_output\.", ".self_attn.o_proj."),
    (r"\.ffn_(gate|up|down)\.", r".mlp.\1_proj."),
    (r"\.attn_norm\.", ".input_layernorm."),
    (r"\.ffn_norm\.", ".post_attention_layernorm."),
)
# Arrays whose rows are stored in another order, with the metadata that says how many heads there
# are: the first that is there.
QUERY_HEADS, KEY_HEADS = "llama.attention.head_count", "llama.attention.head_count_kv"
HEADS = (
    (r"\.q_proj\.weight$", (QUERY_HEADS,)),
    (r"\.k_proj\.weight$", (KEY_HEADS, QUERY_HEADS)),
)


class _Damaged(Exception):
    """The bytes are not those of a GGUF file; says how."""


class _Header:
    """A cursor over the file's bytes."""

    def __init__(self, data: mmap.mmap):
        self.data, self.offset = data, 0

    def take(self, count: int) -> bytes:
        end = self.offset + count
        if end > len(self.data):
            raise _Damaged(f"it ends early, at {len(self.data)} bytes")
        self.offset, start = end, self.offset
        return self.data[start:end]

    def scalar(self, kind: str) -> Any:
        return np.frombuffer(self.take(np.dtype(kind).itemsize), kind)[0].item()

    def string(self) -> str:
        try:
            return self.take(self.scalar("<u8")).decode()
        except UnicodeDecodeError:
            raise _Damaged(f"no text before byte {self.offset}") from None

    def value(self) -> Any:
        kind = self.scalar("<u4")
        if kind == STRING:
            return self.string()
        if kind in SCALARS:
            return self.scalar(SCALARS[kind])
        if kind != ARRAY:
            raise _Damaged(f"unknown type {kind} of metadata before byte {self.offset}")
        kind, count = self.scalar("<u4"), self.scalar("<u8")
        if kind == STRING:
            return [self.string() for _ in range(count)]
        if kind not in SCALARS:
            raise _Damaged(f"unknown type {kind} of list before byte {self.offset}")
        entries = np.dtype(SCALARS[kind])
        return np.frombuffer(self.take(count * entries.itemsize), entries).tolist()


@dataclass(frozen=True)
class _Entry:
    """An array: its shape (the fastest dimension last), `gguf` type and place in the file."""

    shape: tuple[int, ...]
    kind: Any
    start: int
    size: int


@dataclass(frozen=True)
class GGUFFile:
    """What a file holds.

    Attributes:
        path: of the file, for errors.
        metadata: by the file's names; lists are lists.
        arrays: float32, by the names and in the layout of the original checkpoint; each is
            dequantised when it is asked for.
    """

    path: Path
    metadata: dict[str, Any]
    arrays: Mapping[str, np.ndarray]


class _Arrays(Mapping[str, np.ndarray]):
    def __init__(self, path: Path, data: mmap.mmap, entries: dict, metadata: dict[str, Any]):
        self.path, self.data, self.entries, self.metadata = path, data, entries, metadata

    def __iter__(self) -> Iterator[str]:
        return iter(self.entries)

    def __len__(self) -> int:
        return len(self.entries)

    def __getitem__(self, name: str) -> np.ndarray:
        from gguf.quants import dequantize, quant_shape_to_byte_shape

        entry = self.entries[name]
        raw = np.frombuffer(self.data, np.uint8, entry.size, entry.start)
        try:
            rows = raw.reshape(quant_shape_to_byte_shape(entry.shape, entry.kind))
            array = dequantize(rows, entry.kind)
        except (ValueError, NotImplementedError):
            raise InputError(
                f"{self.path}: array {shown(name)} of type {entry.kind.name} and shape"
                f" {entry.shape} cannot be read"
            ) from None
        if not all_finite(array):
            raise InputError(f"{self.path}: array {shown(name)} holds numbers that are not finite")
        for pattern, keys in HEADS:
            if re.search(pattern, name):
                key = next((key for key in keys if key in self.metadata), keys[0])
                return _rows_in_order(array, self.metadata.get(key), f"{self.path}: {key}")
        return array


def _rows_in_order(array: np.ndarray, heads: Any, field: str) -> np.ndarray:
    """Undoes llama.cpp's order of a head's rows, which has the two of a rotated pair side by side
    instead of half a head apart.
    """
    if not isinstance(heads, int) or heads < 1 or array.shape[0] % (2 * heads):
        raise InputError(f"{field}: {shown(heads)} does not fit {array.shape[0]} rows")
    pairs = array.reshape(heads, -1, 2, *array.shape[1:])
    return pairs.swapaxes(1, 2).reshape(array.shape)


def read_gguf(path: str | Path) -> GGUFFile:
    """The file's metadata and arrays.

    Raises:
        InputError: the file is missing, damaged or of another kind, or `gguf` is not installed.
    """
    try:
        import gguf
    except ModuleNotFoundError:
        raise InputError(
            f"{path}: reading GGUF files needs the package gguf;"
            " pip install 'jaxphys-splats[models]'"
        ) from None
    with reading(path) as path:
        with path.open("rb") as file:
            if not path.stat().st_size:
                raise InputError(f"{path}: is empty; give a .gguf file")
            data = mmap.mmap(file.fileno(), 0, access=mmap.ACCESS_READ)
        try:
            metadata, entries = _walk(_Header(data), gguf)
        except _Damaged as problem:
            raise InputError(f"{path}: is no usable GGUF file: {problem}; get it again") from None
        return GGUFFile(path, metadata, _Arrays(path, data, entries, metadata))


def _walk(header: _Header, gguf: Any) -> tuple[dict[str, Any], dict[str, _Entry]]:
    if header.take(4) != MAGIC:
        raise _Damaged("it does not begin with 'GGUF'")
    version = header.scalar("<u4")
    if version not in VERSIONS:
        raise _Damaged(f"version {version} instead of {' or '.join(map(str, VERSIONS))}")
    arrays, entries = header.scalar("<u8"), header.scalar("<u8")
    metadata = {}
    for _ in range(entries):
        name = header.string()
        if name in metadata:
            raise _Damaged(f"metadata {shown(name)} is there twice")
        metadata[name] = header.value()
    infos = [_array_info(header, gguf) for _ in range(arrays)]
    alignment = metadata.get("general.alignment", ALIGNMENT)
    if not isinstance(alignment, int) or alignment < 1:
        raise _Damaged(f"general.alignment: {shown(alignment)}")
    first = -(-header.offset // alignment) * alignment
    found = {}
    for name, shape, kind, offset in infos:
        for pattern, replacement in RENAMES:
            name = re.sub(pattern, replacement, name)
        if name in found:
            raise _Damaged(f"array {shown(name)} is there twice")
        block, size = gguf.GGML_QUANT_SIZES.get(kind, (0, 0))
        if not block or shape[-1] % block:
            raise _Damaged(f"array {shown(name)} of shape {shape} cannot be of type {kind.name}")
        entry = _Entry(shape, kind, first + offset, math.prod(shape) // block * size)
        if entry.start + entry.size > len(header.data):
            raise _Damaged(f"array {shown(name)} lies beyond its end")
        found[name] = entry
    return metadata, found


def _array_info(header: _Header, gguf: Any) -> tuple[str, tuple[int, ...], Any, int]:
    name, dimensions = header.string(), header.scalar("<u4")
    if not 1 <= dimensions <= MOST_DIMENSIONS:
        raise _Damaged(f"array {shown(name)} has {dimensions} dimensions")
    shape = tuple(header.scalar("<u8") for _ in range(dimensions))[::-1]
    code, offset = header.scalar("<u4"), header.scalar("<u8")
    try:
        return name, shape, gguf.GGMLQuantizationType(code), offset
    except ValueError:
        raise _Damaged(f"array {shown(name)} is of the unknown type {code}") from None
