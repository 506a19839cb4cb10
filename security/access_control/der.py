"""DER: a strict, bounded reader of ASN.1's distinguished encoding (ITU-T X.690 §10), as far as CMS needs it.

It reads tag-length-value triples one after the other and knows nothing of what they mean.  Only what DER allows is
read - definite lengths in the shortest form, tags of one octet - so that one value has one encoding and nothing can
hide in a second.  All octets are untrusted: whatever they hold, it raises :class:`MalformedMessage`, never reads beyond
its end, and never allocates by a length that the octets do not have.
"""

from __future__ import annotations

from enum import IntEnum
from typing import NamedTuple

from ddsi.structure.errors import MalformedMessage

__all__ = ["Der", "DerReader", "Tag", "object_identifier"]


class Tag(IntEnum):
    """Identifier octets: class, constructed or not, number (X.690 §8.1.2)."""

    INTEGER = 0x02
    OCTET_STRING = 0x04
    NULL = 0x05
    OBJECT_IDENTIFIER = 0x06
    SEQUENCE = 0x30
    SET = 0x31
    # context-specific: primitive (IMPLICIT octets), and constructed
    CONTEXT_0_PRIMITIVE = 0x80
    CONTEXT_0 = 0xA0
    CONTEXT_1 = 0xA1
    CONTEXT_2 = 0xA2
    CONTEXT_3 = 0xA3


class Der(NamedTuple):
    """One element: its identifier octet, its content, and the whole of it with tag and length."""

    tag: int
    content: memoryview
    encoding: memoryview


class DerReader:
    """Reads the elements of ``octets`` in turn; ``element`` says in errors what they are the content of."""

    __slots__ = ("_element", "_octets", "_position")

    def __init__(self, octets: bytes | memoryview, element: str) -> None:
        self._octets = memoryview(octets)
        self._position = 0
        self._element = element

    @property
    def at_end(self) -> bool:
        return self._position == len(self._octets)

    def next(self, tag: int | None = None) -> Der:
        """The next element; with ``tag``, it must be of that one."""
        start = self._position
        if len(self._octets) - start < 2:
            raise self._malformed("an element is cut off")
        found = self._octets[start]
        if found & 0x1F == 0x1F:
            raise self._malformed("a tag of more than one octet")
        if tag is not None and found != tag:
            raise self._malformed(f"tag {tag:#04x} is expected, {found:#04x} is there")
        begin, length = self._length(start + 1)
        if length > len(self._octets) - begin:
            raise self._malformed(f"{length} octets are announced, {len(self._octets) - begin} are there")
        self._position = begin + length
        return Der(found, self._octets[begin : begin + length], self._octets[start : begin + length])

    def optional(self, tag: int) -> Der | None:
        """The next element if it has this tag; else None, and nothing is read."""
        return self.next() if not self.at_end and self._octets[self._position] == tag else None

    def enter(self, tag: int, element: str) -> DerReader:
        """A reader of the content of the next element, which must have this tag."""
        return DerReader(self.next(tag).content, element)

    def end(self) -> None:
        """There must be nothing more."""
        if not self.at_end:
            raise self._malformed(f"{len(self._octets) - self._position} octets too many")

    def _length(self, position: int) -> tuple[int, int]:
        """Where the content begins, and its octets (X.690 §8.1.3, with the restriction of §10.1)."""
        first = self._octets[position]
        if first < 0x80:
            return position + 1, first
        count = first & 0x7F
        # Four octets say more than any document may have; none at all is BER's indefinite form.
        if not 1 <= count <= 4 or len(self._octets) - position - 1 < count:
            raise self._malformed("a length that is not DER")
        octets = self._octets[position + 1 : position + 1 + count]
        length = int.from_bytes(octets, "big")
        if octets[0] == 0 or length < 0x80:
            raise self._malformed("a length that is not in its shortest form")
        return position + 1 + count, length

    def _malformed(self, reason: str) -> MalformedMessage:
        return MalformedMessage(reason, element=self._element, offset=self._position)


_MOST_ARC_OCTETS = 5


def object_identifier(content: memoryview) -> str:
    """The content of an OBJECT IDENTIFIER in dots (X.690 §8.19).  Raises MalformedMessage."""
    arcs: list[int] = []
    arc = octets = 0
    for octet in content:
        octets += 1
        if octets > _MOST_ARC_OCTETS or (octets == 1 and octet == 0x80):
            raise MalformedMessage("an arc that is not DER, or too large", element="object identifier")
        arc = arc << 7 | octet & 0x7F
        if not octet & 0x80:
            arcs.append(arc)
            arc = octets = 0
    if octets or not arcs:
        raise MalformedMessage("it is cut off", element="object identifier")
    first = min(arcs[0] // 40, 2)
    return ".".join(map(str, (first, arcs[0] - first * 40, *arcs[1:])))
