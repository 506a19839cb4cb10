"""Python values to octets and back, for sequences and arrays of primitives: as buffers, never element by element.

Generated codecs call these.  Each function here may be slow to *refuse*, since a refusal is diagnosed anew with the
member's path (``value_check.py``), but takes what is right at the cost of one copy in C.  What counts as an octet
string, a number buffer or a list is DESIGN's rule: anything with the buffer protocol whose items are of the
element's format moves as it stands; other sequences of numbers are packed by one :mod:`struct` call, which checks
type and range of each.
"""

from __future__ import annotations

import math
import struct
import sys
from array import array
from collections.abc import Callable, Iterable
from typing import Any

__all__ = [
    "array_numbers",
    "array_octets",
    "beyond",
    "booleans",
    "booleans_from",
    "chars",
    "flatten",
    "needs_swap",
    "nest",
    "number_array",
    "numbers",
    "octets",
    "sequence",
    "wchars",
    "wchars_from",
]

Buffer = bytes | bytearray | memoryview

_LITTLE_HOST = sys.byteorder == "little"

_FORMATS = {
    # What memoryview.format may say for a code: C's long is its int or its long long, whichever has that size.
    "b": "b", "h": "h", "i": "il", "q": "ql", "f": "f",
    "B": "B", "H": "H", "I": "IL", "Q": "QL", "d": "d",
}  # fmt: skip


def needs_swap(*, little_endian: bool) -> bool:
    """True when numbers of this byte order are not this machine's."""
    return little_endian != _LITTLE_HOST


def octets(value: Any) -> Buffer:
    """The octets of a ``sequence<octet>``: any contiguous buffer of single octets as it is; else a copy.

    A list or other sequence of integers 0..255 is taken too.  Raises TypeError or ValueError for anything else.
    """
    if isinstance(value, (bytes, bytearray)):
        return value
    try:
        view = memoryview(value)
    except TypeError:
        return bytes(sequence(value))
    if view.itemsize != 1 or not view.ndim:  # bytes(3) would be three zeros
        return bytes(sequence(view.tolist()))
    if view.format in ("b", "<b"):  # signed: -1 is no octet
        return bytes(view.tolist())
    return view.cast("B") if view.c_contiguous else view.tobytes()


def numbers(value: Any, code: str, size: int, order: str, *, swap: bool) -> tuple[Any, int]:
    """(buffer, count) for a sequence of numbers: ``code`` is the element's struct letter, ``order`` < or >.

    The buffer may be ``value`` itself.  Raises TypeError, ValueError, OverflowError or struct.error.
    """
    if isinstance(value, (list, tuple)):
        return struct.pack(f"{order}{len(value)}{code}", *value), len(value)
    if isinstance(value, array):
        if value.typecode in _FORMATS[code] and value.itemsize == size:
            if swap:
                value = value[:]
                value.byteswap()
            return value, len(value)
        return numbers(value.tolist(), code, size, order, swap=swap)
    try:
        view = memoryview(value)
    except (TypeError, ValueError):
        return numbers(list(sequence(value)), code, size, order, swap=swap)
    return _numbers_of_view(view, code, size, order, swap=swap)


def _numbers_of_view(view: memoryview, code: str, size: int, order: str, *, swap: bool) -> tuple[Any, int]:
    if not view.ndim:
        raise TypeError("a single number is no sequence")
    letter = view.format.lstrip("@=<>")
    foreign = view.format[:1] == (">" if _LITTLE_HOST else "<")
    if letter in _FORMATS[code] and view.itemsize == size:
        if foreign == swap:
            return (view if view.c_contiguous else view.tobytes()), view.nbytes // size
        swapped = array(code, view.tobytes())
        swapped.byteswap()
        return swapped, len(swapped)
    if foreign or letter not in _ARRAY_CODES:
        raise TypeError(f"a buffer of format {view.format!r} does not hold numbers of format {code!r}")
    # Another width or signedness: by value, so that what does not fit is refused.
    return numbers(array(letter, view.tobytes()).tolist(), code, size, order, swap=swap)


_ARRAY_CODES = frozenset("bBhHiIlLqQfd")


def number_array(code: str, buffer: Any, start: int, end: int, *, swap: bool) -> array[Any]:
    """The numbers of ``buffer[start:end]``, copied.  Raises IndexError if the buffer ends before ``end``."""
    if end > len(buffer):
        raise IndexError("numbers beyond the end")
    result: array[Any] = array(code)
    if end - start < 1024:
        result.frombytes(buffer[start:end])
    else:
        with memoryview(buffer) as view:
            result.frombytes(view[start:end])
    if swap:
        result.byteswap()
    return result


def booleans(value: Any) -> bytes:
    """One octet for each, 0 or 1.  Raises TypeError unless all are booleans (Python's or numpy's)."""
    packed = bytes(sequence(value.tolist() if hasattr(value, "tolist") else value))
    if packed.strip(b"\x00\x01"):
        raise ValueError("a boolean is True or False")
    return packed


def booleans_from(packed: Buffer) -> list[bool]:
    """Raises IndexError for an octet that is neither 0 nor 1."""
    return [(False, True)[octet] for octet in packed]


def chars(value: Iterable[str]) -> bytes:
    """One octet for each character; a str, or any sequence of one-character strings.

    IDL's char is an octet without a character set; code points 0..255 stand for themselves (ISO 8859-1).
    """
    return (value if isinstance(value, str) else _joined(value)).encode("latin-1")


def wchars(value: Iterable[str], *, little_endian: bool) -> bytes:
    """Two octets for each UTF-16 code unit."""
    joined = value if isinstance(value, str) else _joined(value)
    return joined.encode("utf-16-le" if little_endian else "utf-16-be", "surrogatepass")


def wchars_from(packed: Any, *, little_endian: bool) -> str:
    return bytes(packed).decode("utf-16-le" if little_endian else "utf-16-be", "surrogatepass")


def _joined(value: Iterable[str]) -> str:
    items = list(sequence(value))
    if any(len(item) != 1 for item in items):
        raise ValueError("a char is a string of one character")
    return "".join(items)


def sequence(value: Any) -> Any:
    """The value, if it is a sequence of elements; TypeError for a string, and for what is merely iterable."""
    if isinstance(value, memoryview):
        value = value.tolist()  # with several dimensions it does not iterate over its rows
    if isinstance(value, (str, dict)) or not hasattr(value, "__getitem__") or not hasattr(value, "__len__"):
        raise TypeError(f"not a sequence: {type(value).__name__}")
    return value


def flatten(value: Any, dimensions: tuple[int, ...]) -> Any:
    """The elements of a (possibly nested) array in row-major order, as a buffer or a flat sequence.

    Raises ValueError unless each level has its dimension.  A buffer, or a flat sequence of all the elements,
    is taken as it is when its size fits.
    """
    if value.__class__ is not str:  # characters may come as a string
        sequence(value)
    if len(dimensions) == 1:
        if len(value) != dimensions[0]:
            raise ValueError(f"{len(value)} elements where the array has {dimensions[0]}")
        return value
    shape = getattr(value, "shape", None)
    if shape is not None and tuple(shape) == dimensions:
        return value.reshape(-1) if hasattr(value, "reshape") else value
    total = math.prod(dimensions)
    if len(value) == total != dimensions[0] and (shape is None or len(shape) == 1):
        return value
    if len(value) != dimensions[0]:
        raise ValueError(f"{len(value)} rows where the array has {dimensions[0]}")
    flat: list[Any] = []
    for row in value:
        flat += list(flatten(row, dimensions[1:]))
    return flat


def array_octets(value: Any, dimensions: tuple[int, ...]) -> Buffer:
    """The octets of an octet array; ValueError unless there are as many as the array has."""
    packed = octets(flatten(value, dimensions))
    _check_count(len(packed), dimensions)
    return packed


def array_numbers(value: Any, dimensions: tuple[int, ...], code: str, size: int, order: str, *, swap: bool) -> Any:
    """The buffer of a numeric array; ValueError unless there are as many numbers as the array has."""
    packed, count = numbers(flatten(value, dimensions), code, size, order, swap=swap)
    _check_count(count, dimensions)
    return packed


def beyond(allow: Callable[[Any], bool], value: Any, dimensions: tuple[int, ...]) -> bool:
    """Whether one of the numbers, in rows of rows if there are several dimensions, is not allowed."""
    flat = flatten(value, dimensions) if dimensions else value
    return not all(map(allow, flat.tolist() if hasattr(flat, "tolist") else flat))


def _check_count(count: int, dimensions: tuple[int, ...]) -> None:
    if count != math.prod(dimensions):
        raise ValueError(f"{count} elements where the array has {math.prod(dimensions)}")


def nest(flat: Any, dimensions: tuple[int, ...]) -> Any:
    """The inverse of :func:`flatten`: rows of rows; the innermost are slices of ``flat``, of its own type."""
    if len(dimensions) == 1:
        return flat
    stride = len(flat) // dimensions[0]
    return [nest(flat[start : start + stride], dimensions[1:]) for start in range(0, len(flat), stride)]
