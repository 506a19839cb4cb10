"""Domains: to which domains a rule applies.  DDS-Security 1.1 §9.4.1.2.2 and §9.4.1.3.2.2; tags are 1.2's.

Vendors: Cyclone DDS knows domains up to 230 and refuses documents that name others; Fast DDS takes a range without a
maximum for one of a single domain.  Documents for a mixed system do well to write both ends.
"""

from __future__ import annotations

from ddsi.structure.dataclass import dataclass
from ddsi.structure.errors import MalformedMessage

from .wildcard import check_expression, matching
from .xml_document import Node

__all__ = ["DomainRange", "Domains"]


@dataclass(frozen=True, slots=True)
class DomainRange:
    """Domain ids from ``first`` to ``last``, both included; ``last`` is None where the end is open."""

    first: int
    last: int | None

    def __contains__(self, domain_id: object) -> bool:
        return isinstance(domain_id, int) and self.first <= domain_id and (self.last is None or domain_id <= self.last)

    def __str__(self) -> str:
        if self.last is None:
            return f"{self.first} and above"
        return str(self.first) if self.first == self.last else f"{self.first} to {self.last}"


@dataclass(frozen=True, slots=True)
class Domains:
    """Those in one of ``ranges`` (or all ids, if there are none) that have a tag which one of ``tags`` matches.

    ``tags`` are expressions.  Without any, every tag is meant, as in documents of 1.1, which know none.
    """

    ranges: tuple[DomainRange, ...] = ()
    tags: tuple[str, ...] = ()

    def include(self, domain_id: int, domain_tag: str = "") -> bool:
        if self.ranges and not any(domain_id in ids for ids in self.ranges):
            return False
        return not self.tags or matching(self.tags, domain_tag)

    def __str__(self) -> str:
        ids = ", ".join(map(str, self.ranges)) or "all"
        return f"domains {ids}" + (f" with tag {' or '.join(map(repr, self.tags))}" if self.tags else "")

    @classmethod
    def from_node(cls, node: Node) -> Domains:
        """From a ``<domains>`` that is valid by the schema.  Raises DocumentError."""
        ranges: list[DomainRange] = []
        tags: list[str] = []
        for child in node.nodes:
            if child.tag == "id":
                ranges.append(DomainRange(int(child.text), int(child.text)))
            elif child.tag == "id_range":
                ranges.append(_range(child))
            elif child.tag == "tag":
                # To the letter: what would be a wildcard in it is put in brackets, where it is none.
                tags.append("".join(f"[{character}]" if character in "*?[" else character for character in child.text))
            else:
                tags.append(expression_of(child))
        return cls(tuple(ranges), tuple(tags))


def _range(node: Node) -> DomainRange:
    low, high = node.find("min"), node.find("max")
    if low is None and high is None:
        raise node.error("<id_range> has neither <min> nor <max>", remedy="add at least one")
    ids = DomainRange(int(low.text) if low else 0, int(high.text) if high else None)
    if ids.last is not None and ids.first > ids.last:
        raise node.error(f"the range from {ids.first} to {ids.last} is empty", remedy="exchange <min> and <max>")
    return ids


def expression_of(node: Node) -> str:
    """The text of an element as an expression of ``wildcard.py``.  Raises DocumentError."""
    try:
        check_expression(node.text)
    except MalformedMessage as error:
        raise node.error(f"<{node.tag}>: {error.reason}") from error
    return node.text
