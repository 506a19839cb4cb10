"""How values are written in QoS profile files: durations, numbers, literals, octets.

OMG DDS-XML 1.0 §7.2 (value types), and the spellings of RTI Connext and Fast DDS where they differ.  Every function
takes an element and returns its value, or raises ValueError with what would have been right.
"""

from __future__ import annotations

import base64
import binascii
import math
from collections.abc import Callable, Mapping

from .xml_document import Element

__all__ = [
    "boolean",
    "count",
    "count_or_zero",
    "duration",
    "integer",
    "literal",
    "octets",
    "octets_in_dotted_hex",
    "text",
]

_INFINITE = {"DURATION_INFINITY", "DURATION_INFINITE", "DURATION_INFINITE_SEC", "DURATION_INFINITE_NSEC"}
_ZERO = {"DURATION_ZERO", "DURATION_ZERO_SEC", "DURATION_ZERO_NSEC"}
_MOST_SECONDS = 0x7FFFFFFF  # which is infinity itself: DDS 1.4 §2.3.3, DURATION_INFINITE_SEC
_NANOSECONDS = 1_000_000_000
_TRUE = {"true", "1", "yes", "boolean_true"}
_FALSE = {"false", "0", "no", "boolean_false"}


def text(element: Element) -> str:
    """Any text."""
    return element.text


def boolean(element: Element) -> bool:
    said = _plain(element.text).lower()
    if said in _TRUE:
        return True
    if said in _FALSE:
        return False
    raise ValueError("true or false")


def integer(element: Element) -> int:
    """A number that fits 32 bits, decimal or hexadecimal."""
    said = element.text
    try:
        value = int(said, 16 if said.lower().startswith("0x") else 10)
    except ValueError:
        value = 1 << 32
    if not -(1 << 31) <= value < 1 << 31:
        raise ValueError("a whole number of 32 bits")
    return value


def count(element: Element) -> int:
    """A number of things, or LENGTH_UNLIMITED, which is -1."""
    if _plain(element.text) in ("LENGTH_UNLIMITED", "LENGTH_UNLIMITED_QOS"):
        return -1
    try:
        return integer(element)
    except ValueError:
        raise ValueError("a whole number, or LENGTH_UNLIMITED") from None


def count_or_zero(element: Element) -> int:
    """As :func:`count`, where 0 means no limit too, as in Fast DDS."""
    return count(element) or -1


def literal(meanings: Mapping[str, object], suffix: str = "") -> Callable[[Element], object]:
    """One of these words.  ``suffix`` is what the OMG appends, and may be missing, as in Fast DDS."""

    def read(element: Element) -> object:
        said = _plain(element.text).removesuffix(suffix)
        if said not in meanings:
            raise ValueError(" or ".join(f"{word}{suffix}" for word in meanings))
        return meanings[said]

    return read


def duration(element: Element) -> float:
    """Seconds: of ``<sec>`` and ``<nanosec>``, either of which may be missing, or of one word."""
    expected = "<sec> and <nanosec>, or DURATION_INFINITY"
    if not element.children:
        said = _plain(element.text)
        if said in _INFINITE:
            return math.inf
        if said in _ZERO:
            return 0.0
        raise ValueError(expected)
    parts: dict[str, int] = {}
    for child in element.children:
        said = _plain(child.text)
        if child.name not in ("sec", "nanosec") or child.name in parts or child.children:
            raise ValueError(f"{expected}, each once; <{child.name}> is one too many")
        if said in _INFINITE:
            parts[child.name] = _MOST_SECONDS
        elif said in _ZERO:
            parts[child.name] = 0
        elif said.isascii() and said.isdecimal() and len(said) <= 10:
            parts[child.name] = int(said)
        else:
            raise ValueError(f"{expected}; {child.name} is a whole number or DURATION_INFINITE_{child.name.upper()}")
    if parts.get("sec", 0) >= _MOST_SECONDS:
        return math.inf
    nanoseconds = parts.get("nanosec", 0)
    if nanoseconds >= _NANOSECONDS:
        if "sec" not in parts:  # DURATION_INFINITE_NSEC alone
            return math.inf
        raise ValueError(f"{expected}; nanosec is below {_NANOSECONDS}")
    return parts.get("sec", 0) + nanoseconds / _NANOSECONDS


def octets(element: Element) -> bytes:
    """Base64, as the OMG's schema has it, or RTI's numbers between commas."""
    said = "".join(element.text.split())
    if "," in said or said.isdecimal() or said.lower().startswith("0x"):
        return _numbers(said.split(","))
    try:
        return base64.b64decode(said, validate=True)
    except (binascii.Error, ValueError):
        raise ValueError("octets in base64, or numbers from 0 to 255 between commas") from None


def octets_in_dotted_hex(element: Element) -> bytes:
    """Fast DDS's: two digits each, between dots."""
    said = element.text
    try:
        return bytes(int(part, 16) for part in said.split(".")) if said else b""
    except ValueError:
        raise ValueError("octets in hexadecimal between dots, such as 3A.0F") from None


def _numbers(parts: list[str]) -> bytes:
    try:
        return bytes(int(part, 0) for part in parts if part)
    except ValueError:
        raise ValueError("numbers from 0 to 255 between commas") from None


def _plain(said: str) -> str:
    """The word without the prefix of the C interface, which RTI allows."""
    return said.removeprefix("DDS_")
