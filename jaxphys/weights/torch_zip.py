"""Tensors out of the zip files that `torch.save` writes, with neither torch nor unpickling.

Such a file holds a pickle that names tensors, and one uncompressed member for each storage (a flat
run of numbers that one or several tensors look into). A pickle is a program; here it is walked by
a machine that knows the few instructions that a dictionary of tensors consists of, and whose only
"functions" are the five globals below. Whatever else a file asks for is refused by name.
"""

import math
import pickletools
import struct
import zipfile
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path, PurePosixPath
from typing import Any, NamedTuple

import ml_dtypes
import numpy as np

from jaxphys.core.errors import InputError, shown
from jaxphys.core.finite import all_finite
from jaxphys.core.reading import reading

ZIP, PICKLE = b"PK\x03\x04", b"\x80"
LARGEST_PICKLE = 4 * 1024**2
LONGEST_NAME = 1000
LARGEST_NUMBER = 2**62
MOST_DIMENSIONS = 32

ORDERED_DICT = "collections OrderedDict"
TENSOR = "torch._utils _rebuild_tensor_v2"
PARAMETER = "torch._utils _rebuild_parameter"
STORAGES = {
    "torch FloatStorage": np.float32,
    "torch HalfStorage": np.float16,
    "torch BFloat16Storage": ml_dtypes.bfloat16,
    "torch DoubleStorage": np.float64,
    "torch LongStorage": np.int64,
    "torch IntStorage": np.int32,
    "torch ShortStorage": np.int16,
    "torch CharStorage": np.int8,
    "torch ByteStorage": np.uint8,
    "torch BoolStorage": np.bool_,
}
CONSTANTS = {
    "NONE": None,
    "NEWTRUE": True,
    "NEWFALSE": False,
    "EMPTY_TUPLE": (),
}
LITERALS = {"BININT", "BININT1", "BININT2", "LONG1", "BINFLOAT", "BINUNICODE"}
TUPLE_LENGTHS = {"TUPLE1": 1, "TUPLE2": 2, "TUPLE3": 3}
FOREIGN = (ValueError, LookupError, zipfile.BadZipFile, struct.error, EOFError, OverflowError)
"""What zipfile, pickletools and numpy raise for files that are damaged or forged."""


@dataclass(frozen=True)
class Global:
    """A name that a pickle refers to, such as a function. Never looked up, only compared."""

    name: str


class Storage(NamedTuple):
    """A flat run of numbers, as bytes in this computer's order."""

    content: bytes
    dtype: np.dtype


def read_torch_zip(path: str | Path) -> dict[str, np.ndarray]:
    """The tensors of a file written by `torch.save`, read-only, in the file's order.

    Dictionaries within dictionaries are joined by dots, `{"a": {"b": t}}` to `"a.b"`; values that
    are no tensors (a step count, a version) are left out. Tensors that share memory in the file
    share it here, and transposed ones stay transposed views, so no more memory is taken than the
    file has bytes.

    Raises:
        InputError: the file is missing, damaged, not of this kind, or holds anything but
            dictionaries, tensors and plain values.
    """
    with reading(path) as path, path.open("rb") as file:
        try:
            _check_kind(file.read(4))
            with zipfile.ZipFile(file) as archive:
                tensors = dict(_tensors(_Archive(archive, path.stat().st_size).value()))
        except (*FOREIGN, NotImplementedError, RuntimeError) as error:
            reason = str(error) if isinstance(error, InputError) else f"it is damaged ({error!r})"
            raise InputError(
                f"{path}: not readable as PyTorch weights: {reason}; nothing was run. Put the"
                " original file there, or save its tensors as .safetensors"
            ) from error
        for name, tensor in tensors.items():
            if not all_finite(tensor):
                raise InputError(f"{path}: tensor {shown(name)} holds numbers that are not finite")
        return tensors


def _check_kind(start: bytes) -> None:
    if start.startswith(PICKLE):
        raise InputError("it is a bare pickle or was saved by PyTorch before 1.6, and is not a zip")
    if start != ZIP:
        raise InputError("it is not a zip file")


class _Archive:
    """The members of one file, checked against each other before any is read."""

    def __init__(self, archive: zipfile.ZipFile, size: int):
        self.archive = archive
        self.members = {member.filename: member for member in archive.infolist()}
        if len(self.members) != len(archive.infolist()):
            raise InputError("it has two members of one name")
        pickles = [name for name in self.members if PurePosixPath(name).parts[1:] == ("data.pkl",)]
        if len(pickles) != 1:
            raise InputError(f"it has {len(pickles)} members FOLDER/data.pkl instead of one")
        self.root = pickles[0].removesuffix("/data.pkl")
        program = (f"{self.root}/code/", f"{self.root}/constants.pkl")
        if any(name.startswith(program) for name in self.members):
            raise InputError("it is a TorchScript program and not a dictionary of tensors")
        for member in self.members.values():
            if member.compress_type != zipfile.ZIP_STORED or member.flag_bits & 1:
                raise InputError(f"its member {shown(member.filename)} is compressed or encrypted")
        if sum(member.file_size for member in self.members.values()) > size:
            raise InputError("its members claim to be larger than the file")
        self.swapped = False
        if f"{self.root}/byteorder" in self.members:
            order = self.read("byteorder", largest=16)
            if order not in (b"little", b"big"):
                raise InputError("its byte order is neither little nor big")
            self.swapped = order == b"big"
        self.storages: dict[str, bytes] = {}

    def read(self, name: str, *, largest: int | None = None) -> bytes:
        name = f"{self.root}/{name}"
        if name not in self.members:
            raise InputError(f"it lacks its member {shown(name)}")
        if largest is not None and self.members[name].file_size > largest:
            raise InputError(f"its member {shown(name)} is larger than {largest} bytes")
        return self.archive.read(name)

    def value(self) -> object:
        """What the pickle of this file describes."""
        return _run(self.read("data.pkl", largest=LARGEST_PICKLE), self.storage)

    def storage(self, identity: object) -> Storage:
        """The numbers that a pickle refers to by ("storage", type, key, device, count)."""
        match identity:
            case ("storage", Global(kind), str(key), str(), int(count)) if kind in STORAGES:
                dtype = np.dtype(STORAGES[kind])
            case _:
                raise InputError(f"it wants an external object that is no storage{_of(identity)}")
        if not (key.isascii() and key.isdecimal()):
            raise InputError(f"its storage {shown(key)} is not named by a number")
        if key not in self.storages:
            content = self.read(f"data/{key}")
            if self.swapped:
                content = np.frombuffer(content, f"u{dtype.itemsize}").byteswap().tobytes()
            self.storages[key] = content
        if len(self.storages[key]) != count * dtype.itemsize:
            raise InputError(
                f"its storage {key} has {len(self.storages[key])} bytes, which are not"
                f" {_number(count)} numbers of {dtype}"
            )
        return Storage(self.storages[key], dtype)


def _run(pickle: bytes, storage) -> object:
    """Walks the instructions of `pickle`; `storage(identity)` answers its external references."""
    stack: list = []
    below: list[list] = []  # the stacks under each open mark
    memo: dict[object, object] = {}
    for opcode, argument, _ in pickletools.genops(pickle):
        name = opcode.name
        if name in CONSTANTS:
            stack.append(CONSTANTS[name])
        elif name in LITERALS:
            stack.append(argument)
        elif name in TUPLE_LENGTHS:
            stack.append(tuple([stack.pop() for _ in range(TUPLE_LENGTHS[name])][::-1]))
        elif name in ("BINPUT", "LONG_BINPUT"):
            memo[argument] = stack[-1]
        elif name in ("BINGET", "LONG_BINGET"):
            stack.append(memo[argument])
        elif name == "PROTO":
            pass  # newer protocols are noticed by their instructions
        elif name == "STOP":
            if below or len(stack) != 1:
                raise InputError("its pickle ends with more or less than one value")
            return stack[0]
        elif name == "MARK":
            below.append(stack)
            stack = []
        elif name in ("TUPLE", "SETITEMS", "APPENDS"):
            items, stack = stack, below.pop()
            if name == "TUPLE":
                stack.append(tuple(items))
            elif name == "SETITEMS":
                _set_items(stack[-1], items)
            else:
                _append(stack[-1], items)
        elif name == "EMPTY_DICT":
            stack.append({})
        elif name == "EMPTY_LIST":
            stack.append([])
        elif name == "SETITEM":
            value, key = stack.pop(), stack.pop()
            _set_items(stack[-1], [key, value])
        elif name == "APPEND":
            item = stack.pop()
            _append(stack[-1], [item])
        elif name == "GLOBAL":
            if argument not in (ORDERED_DICT, TENSOR, PARAMETER, *STORAGES):
                raise InputError(f"it wants the global {shown(argument)}, which no tensor needs")
            stack.append(Global(argument))
        elif name == "BINPERSID":
            stack.append(storage(stack.pop()))
        elif name == "REDUCE":
            arguments, function = stack.pop(), stack.pop()
            stack.append(_call(function, arguments))
        elif name == "BUILD":
            # An OrderedDict of a module has its version numbers as an attribute.
            attributes = stack.pop()
            if type(attributes) is not dict or set(attributes) != {"_metadata"}:
                raise InputError("it sets attributes of an object, which no tensor needs")
            if type(stack[-1]) is not dict:
                raise InputError(f"it sets attributes{_of(stack[-1])}, which no tensor needs")
        else:
            raise InputError(f"it uses the pickle instruction {name}, which no tensor needs")
    raise InputError("its pickle has no end")


def _set_items(target: object, items: list) -> None:
    if type(target) is not dict:
        raise InputError(f"it sets items{_of(target)}")
    if len(items) % 2:
        raise InputError("it sets a key without a value")
    for key, value in zip(items[::2], items[1::2], strict=True):
        # Only these hash in constant time: tuples of tuples of the same tuple do not.
        if type(key) not in (str, int):
            raise InputError(f"it has a key{_of(key)} in a dictionary")
        target[key] = value


def _append(target: object, items: list) -> None:
    if type(target) is not list:
        raise InputError(f"it appends to something{_of(target)}")
    target.extend(items)


def _call(function: object, arguments: object) -> object:
    """What the three functions that a dictionary of tensors needs would have made."""
    match function, arguments:
        case Global(name), () if name == ORDERED_DICT:
            return {}
        case Global(name), (Storage() as kept, offset, shape, strides, bool(), {}) if (
            name == TENSOR
        ):
            return _tensor(kept, offset, shape, strides)
        case Global(name), (np.ndarray() as array, bool(), {}) if name == PARAMETER:
            return array
        case Global(name), _:
            raise InputError(f"it calls {shown(name)} with arguments of other kinds")
    raise InputError(f"it calls something{_of(function)}")


def _tensor(storage: Storage, offset: Any, shape: Any, strides: Any) -> np.ndarray:
    """A view into `storage`; offset and strides are counted in its numbers."""
    if type(shape) is not tuple or type(strides) is not tuple or len(shape) != len(strides):
        raise InputError("it has a tensor whose shape and strides do not belong together")
    if len(shape) > MOST_DIMENSIONS:
        raise InputError(f"it has a tensor of {len(shape)} dimensions")
    for number in (offset, *shape, *strides):
        if type(number) is not int or not 0 <= number < LARGEST_NUMBER:
            raise InputError(f"it has a tensor with {_number(number)} in its shape or strides")
    size, width = math.prod(shape), storage.dtype.itemsize
    available = len(storage.content) // width
    if size == 0:
        if math.prod(max(length, 1) for length in shape) >= LARGEST_NUMBER // width:
            raise InputError("it has an empty tensor whose shape is too large")
        empty = np.zeros(shape, storage.dtype)
        empty.flags.writeable = False
        return empty
    strides = [s if length > 1 else 0 for s, length in zip(strides, shape, strict=True)]
    last = offset + sum((n - 1) * s for n, s in zip(shape, strides, strict=True))
    # A repeated view could make a few bytes into a tensor of any size.
    if last >= available or size > available:
        raise InputError(
            f"it has a tensor that needs {max(last + 1, size)} numbers of a storage of {available}"
        )
    return np.ndarray(
        shape, storage.dtype, storage.content, offset * width, [s * width for s in strides]
    )


def _tensors(value: object) -> Iterator[tuple[str, np.ndarray]]:
    """The tensors of nested dictionaries by their joined keys, each dictionary visited once."""
    if type(value) is not dict:
        raise InputError(f"it holds something{_of(value)} and not a dictionary of tensors")
    waiting, visited, names = [("", value)], set(), set()
    while waiting:
        name, value = waiting.pop()
        if len(name) > LONGEST_NAME:
            raise InputError(f"it has a name of {len(name)} characters, {shown(name)}")
        if isinstance(value, np.ndarray):
            if name in names:
                raise InputError(f"two of its tensors are named {shown(name)}")
            names.add(name)
            yield name, value
        elif type(value) is dict:
            if id(value) in visited:
                raise InputError("it has one dictionary in two places, or within itself")
            visited.add(id(value))
            inside = f"{name}." if name else ""
            waiting += [(f"{inside}{key}", value[key]) for key in reversed(value)]


def _of(value: object) -> str:
    """Tells the kind of a value only: nested tuples may be far too long to print."""
    if isinstance(value, Global):
        return f" ({shown(value.name)})"
    return f" (a {type(value).__name__})"


def _number(value: object) -> str:
    small = type(value) is int and abs(value) < 2**64
    return str(value) if small else f"a {type(value).__name__} that is too large or no number"
