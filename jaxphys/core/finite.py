"""Whether large arrays hold numbers only."""

import numpy as np

# The bits of the exponent, which are all set in infinities and NaN, by bytes and kind of float.
_EXPONENTS: dict[str, tuple[type[np.unsignedinteger], int]] = {
    "float16": (np.uint16, 0x7C00),
    "bfloat16": (np.uint16, 0x7F80),
    "float32": (np.uint32, 0x7F800000),
    "float64": (np.uint64, 0x7FF0000000000000),
}
_AT_ONCE = 2**16


def all_finite(array: np.ndarray) -> bool:
    """Whether no element is infinite or NaN; whatever is no floating point is finite.

    Reads each element once, in pieces, and computes with integers: numpy has no fast way for
    half precision.
    """
    if array.dtype.name not in _EXPONENTS:
        return True
    kind, bits = _EXPONENTS[array.dtype.name]
    flat = np.ascontiguousarray(array).reshape(-1).view(kind)
    exponent = kind(bits)
    pieces = (flat[start : start + _AT_ONCE] for start in range(0, flat.size, _AT_ONCE))
    return not any(((piece & exponent) == exponent).any() for piece in pieces)
