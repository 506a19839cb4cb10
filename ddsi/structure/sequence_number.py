"""SequenceNumber, FragmentNumber and the sets of them.

RTPS 2.5 §8.3.5.4-8.3.5.8, §9.3.2.6 and §9.4.2.6.  Numbers count from 1; on the wire a sequence number is an
int32 and a uint32, here it is a plain int.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator

from .dataclass import dataclass

__all__ = [
    "MAX_SEQUENCE_NUMBER",
    "MAX_SET_BITS",
    "SEQUENCE_NUMBER_UNKNOWN",
    "FragmentNumber",
    "NumberSet",
    "SequenceNumber",
]

SequenceNumber = int
FragmentNumber = int

SEQUENCE_NUMBER_UNKNOWN: SequenceNumber = -(1 << 32)
MAX_SEQUENCE_NUMBER: SequenceNumber = (1 << 63) - 1
MAX_SET_BITS = 256


@dataclass(frozen=True, slots=True)
class NumberSet:
    """SequenceNumberSet or FragmentNumberSet: up to 256 numbers from ``base`` on, as a bitmap.

    ``bitmap`` is one integer of ``num_bits`` bits whose most significant bit stands for ``base``.
    ``num_bits`` may be 0: then the set is empty and only its base has a meaning.
    """

    base: int
    num_bits: int = 0
    bitmap: int = 0

    @classmethod
    def of(cls, base: int, numbers: Iterable[int]) -> NumberSet:
        """The set of ``numbers``, ascending; those below ``base`` or beyond its 256 bits are left out."""
        bits: list[int] = []
        for number in numbers:
            if number >= base + MAX_SET_BITS:
                break
            if number >= base:
                bits.append(number - base)
        num_bits = bits[-1] + 1 if bits else 0
        bitmap = 0
        for bit in bits:
            bitmap |= 1 << (num_bits - 1 - bit)
        return cls(base, num_bits, bitmap)

    def __iter__(self) -> Iterator[int]:
        """The members, ascending."""
        for bit in range(self.num_bits):
            if self.bitmap >> (self.num_bits - 1 - bit) & 1:
                yield self.base + bit

    def __contains__(self, number: object) -> bool:
        if not isinstance(number, int) or not 0 <= number - self.base < self.num_bits:
            return False
        return bool(self.bitmap >> (self.num_bits - 1 - (number - self.base)) & 1)

    def __bool__(self) -> bool:
        return self.bitmap != 0

    @property
    def end(self) -> int:
        """The first number beyond the bitmap (exclusive)."""
        return self.base + self.num_bits

    def __repr__(self) -> str:
        return f"NumberSet({self.base}/{self.num_bits}: {list(self)})"
