"""DER as far as this plugin reads it by itself: the header of an element, and INTEGER.  ITU-T X.690 §8, §10.

Certificates are parsed by the cryptographic library; but it gives a name only re-encoded, and hashes of names must
cover the octets as they are.  Knows nothing of types; tags of one octet only.
"""

from __future__ import annotations

from typing import NamedTuple

__all__ = ["Element", "integer_octets", "read_element", "read_integer"]

_INTEGER = 0x02
_MAX_LENGTH_OCTETS = 4


class Element(NamedTuple):
    """``octets[start:end]`` is the content; ``end`` is exclusive, and where the next element begins."""

    tag: int
    start: int
    end: int


def read_element(octets: bytes, position: int) -> Element:
    """The header of the element at ``position``.  Untrusted; raises ValueError when it does not lie inside."""
    if not 0 <= position <= len(octets) - 2:
        raise ValueError("the element's header is missing")
    tag, length = octets[position], octets[position + 1]
    start = position + 2
    if length >= 0x80:
        count = length - 0x80
        if not 1 <= count <= _MAX_LENGTH_OCTETS or start + count > len(octets):
            raise ValueError("the element's length cannot be read")
        length = int.from_bytes(octets[start : start + count], "big")
        start += count
    if start + length > len(octets):
        raise ValueError("the element is longer than its surroundings")
    return Element(tag, start, start + length)


def read_integer(octets: bytes) -> int | None:
    """The number, if the octets are exactly one INTEGER that is not negative; else None.  Untrusted."""
    try:
        element = read_element(octets, 0)
    except ValueError:
        return None
    if element.tag != _INTEGER or element.end != len(octets) or element.start == element.end:
        return None
    number = int.from_bytes(octets[element.start :], "big", signed=True)
    return number if number >= 0 else None


def integer_octets(number: int) -> bytes:
    """The INTEGER of a number from 0 to 2^32767: the mirror of :func:`read_integer`."""
    content = number.to_bytes(number.bit_length() // 8 + 1, "big")
    if len(content) < 0x80:
        return bytes((_INTEGER, len(content))) + content
    length = len(content).to_bytes((len(content).bit_length() + 7) // 8, "big")
    return bytes((_INTEGER, 0x80 + len(length))) + length + content
