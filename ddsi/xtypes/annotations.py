"""What may stand inside ``Annotated[...]``: the markers behind ``idl.key``, ``idl.bound(8)`` and the like.

Values only; ``resolution.py`` gives them their meaning.  DDS-XTypes 1.3 §7.3.1.2 (builtin annotations).
"""

from __future__ import annotations

import hashlib
from typing import Any

from ..structure.dataclass import dataclass
from ..structure.errors import BadParameter

__all__ = [
    "Array",
    "Bits",
    "Bound",
    "CaseLabels",
    "ElementOf",
    "Flag",
    "HashId",
    "MemberId",
    "MemberName",
    "TypedefName",
    "Unit",
    "autoid_hash",
]

LARGEST_MEMBER_ID = 0x0FFFFFFF


@dataclass(frozen=True, slots=True)
class Flag:
    """A marker without a value: ``idl.key``, ``idl.optional``, ``idl.must_understand``, ``idl.external``."""

    name: str

    def __repr__(self) -> str:
        return f"idl.{self.name}"

    def __call__(self, *_: Any) -> Any:
        raise BadParameter(f"idl.{self.name} stands alone in Annotated[...], without parentheses")


@dataclass(frozen=True, slots=True)
class Bound:
    """The most octets of a string, or elements of a sequence."""

    limit: int

    def __post_init__(self) -> None:
        if isinstance(self.limit, bool) or not isinstance(self.limit, int) or not 0 < self.limit < 2**32:
            raise BadParameter(f"idl.bound takes a number from 1 to 2**32 - 1, not {self.limit!r}")


@dataclass(frozen=True, slots=True)
class Array:
    """The dimensions of an array, outermost first."""

    dimensions: tuple[int, ...]

    def __post_init__(self) -> None:
        for dimension in self.dimensions:
            if isinstance(dimension, bool) or not isinstance(dimension, int) or not 0 < dimension < 2**32:
                raise BadParameter(f"idl.array takes dimensions of 1 or more, not {dimension!r}")
        if not self.dimensions:
            raise BadParameter("idl.array takes at least one dimension, as in idl.array(3, 4)")


@dataclass(frozen=True, slots=True)
class ElementOf:
    """``idl.sequence_of(T)``: the element of a sequence whose Python type does not say it."""

    annotation: Any


@dataclass(frozen=True, slots=True)
class MemberId:
    """``idl.id(n)``: the member id, 0 to 0x0fffffff."""

    number: int

    def __post_init__(self) -> None:
        valid = isinstance(self.number, int) and not isinstance(self.number, bool)
        if not valid or not 0 <= self.number <= LARGEST_MEMBER_ID:
            raise BadParameter(f"idl.id takes a number from 0 to {LARGEST_MEMBER_ID:#x}, not {self.number!r}")


@dataclass(frozen=True, slots=True)
class HashId:
    """``idl.hashid`` or ``idl.hashid("name")``: the member id is the hash of that name, or of the member's own."""

    name: str = ""

    def __call__(self, name: str) -> HashId:
        if not isinstance(name, str):
            raise BadParameter(f"idl.hashid takes a name, not {name!r}")
        return HashId(name)


@dataclass(frozen=True, slots=True)
class MemberName:
    """``idl.name("from")``: the member's name in IDL, where Python cannot have it."""

    name: str

    def __post_init__(self) -> None:
        if not isinstance(self.name, str) or not self.name:
            raise BadParameter(f"idl.name takes the member's name in IDL, not {self.name!r}")


@dataclass(frozen=True, slots=True)
class TypedefName:
    """``idl.typedef("module::Length")``: the IDL alias that the type before it has."""

    name: str

    def __post_init__(self) -> None:
        if not isinstance(self.name, str) or not self.name:
            raise BadParameter(f"idl.typedef takes the alias's name in IDL, not {self.name!r}")


@dataclass(frozen=True, slots=True)
class Unit:
    """``idl.unit("m/s")``: what a number counts, for people and other programs."""

    name: str

    def __post_init__(self) -> None:
        if not isinstance(self.name, str):
            raise BadParameter(f"idl.unit takes a text, not {self.name!r}")


@dataclass(frozen=True, slots=True)
class Bits:
    """``idl.bits(width)``: a field of a bitset, which begins at bit ``at``, or behind the field before it."""

    width: int
    at: int | None = None

    def __post_init__(self) -> None:
        at = 0 if self.at is None else self.at
        for number in (self.width, at):
            if isinstance(number, bool) or not isinstance(number, int):
                raise BadParameter(f"idl.bits takes numbers of bits, not {number!r}")
        if self.width < 1 or at < 0 or at + self.width > 64:
            raise BadParameter(f"idl.bits({self.width}) at bit {at}: a bitset has bits 0 to 63")


@dataclass(frozen=True, slots=True)
class CaseLabels:
    """``idl.case(1, 2)``: the discriminators that select a member of a union; ``is_default``: those of no other case.

    The value of the member in the class; without any labels it marks the discriminator (``idl.switch``).
    """

    labels: tuple[Any, ...] = ()
    is_default: bool = False


def autoid_hash(name: str) -> int:
    """The member id that a name hashes to (DDS-XTypes 1.3 §7.3.1.2.1.1): MD5, 4 octets, little endian, 28 bits."""
    digest = hashlib.md5(name.encode(), usedforsecurity=False).digest()
    return int.from_bytes(digest[:4], "little") & LARGEST_MEMBER_ID
