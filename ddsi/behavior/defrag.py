"""Defragmenter: joins the fragments of large samples.  Other name: defrag.

RTPS 2.5 §8.4.14.1 (large data).  One per remote writer, whoever reads it, so that a large sample is joined once.
Samples are told apart by number and by whom they are addressed to, as a filtering writer may send one number to one
reader only.

A sample's octets are allocated when its first fragment comes, as large as the fragment says, so both the size of one
sample and the sum of all unfinished ones have a bound, and their number too.
"""

from __future__ import annotations

import math
from collections.abc import Iterator

from ..structure.sequence_number import MAX_SET_BITS, NumberSet

__all__ = ["AssemblyKey", "Defragmenter", "PartialSample"]

AssemblyKey = tuple[bytes, bytes, int]
"""Destination prefix, reader entity id (UNKNOWN for everybody), sequence number."""


class PartialSample:
    """A sample of which some fragments are here.  Fragment numbers count from 1."""

    __slots__ = ("_arrived", "_missing_count", "fragment_size", "inline_qos", "last_arrival", "octets", "timestamp")

    def __init__(self, sample_size: int, fragment_size: int) -> None:
        self.octets = bytearray(sample_size)
        self.fragment_size = fragment_size
        self._missing_count = -(-sample_size // fragment_size)
        self._arrived = bytearray(self._missing_count)
        self.inline_qos: object | None = None
        self.timestamp: int | None = None
        self.last_arrival = -math.inf

    @property
    def fragment_count(self) -> int:
        return len(self._arrived)

    @property
    def is_complete(self) -> bool:
        return self._missing_count == 0

    def add(self, first: int, count: int, fragments: bytes | memoryview) -> None:
        """``count`` fragments from number ``first`` on, as they lie in the sample one after the other."""
        size = self.fragment_size
        offset = (first - 1) * size
        end = min(offset + count * size, len(self.octets))
        for index in range(first - 1, min(first - 1 + count, len(self._arrived))):
            if not self._arrived[index]:
                self._arrived[index] = 1
                self._missing_count -= 1
        self.octets[offset:end] = fragments[: end - offset]

    def missing(self, up_to: int | None = None) -> NumberSet:
        """The fragments that are not here, of those up to ``up_to`` (inclusive; all); at most 256 from the first."""
        end = len(self._arrived) if up_to is None else min(up_to, len(self._arrived))
        first = self._arrived.find(0, 0, end)
        if first < 0:
            return NumberSet(end + 1)
        return NumberSet.of(first + 1, (index + 1 for index in self._holes(first, min(end, first + MAX_SET_BITS))))

    def _holes(self, start: int, end: int) -> Iterator[int]:
        index = self._arrived.find(0, start, end)
        while index >= 0:
            yield index
            index = self._arrived.find(0, index + 1, end)


class Defragmenter:
    """The unfinished samples of one remote writer; ``max_octets`` and ``max_samples`` bound them."""

    __slots__ = ("_max_octets", "_max_samples", "_octets", "_partial", "dropped", "keeps_lowest")

    def __init__(self, *, max_octets: int, max_samples: int, keeps_lowest: bool) -> None:
        """``keeps_lowest``: when full, the highest number goes (a reliable writer will send it again, and the
        lowest is what everybody waits for); else the oldest goes (best effort: it will never be finished)."""
        self._max_octets = max_octets
        self._max_samples = max_samples
        self.keeps_lowest = keeps_lowest
        self._octets = 0
        self._partial: dict[AssemblyKey, PartialSample] = {}
        self.dropped = 0

    def __len__(self) -> int:
        return len(self._partial)

    @property
    def octets(self) -> int:
        return self._octets

    def add(
        self,
        key: AssemblyKey,
        *,
        sample_size: int,
        fragment_size: int,
        first: int,
        count: int,
        fragments: bytes | memoryview,
        now: float,
    ) -> PartialSample | None:
        """Fragments of one sample: returns it when they complete it, None while some are missing or it was refused."""
        sample = self._partial.get(key)
        if sample is None:
            sample = self._start(key, sample_size, fragment_size)
            if sample is None:
                return None
        elif len(sample.octets) != sample_size or sample.fragment_size != fragment_size:
            self.dropped += 1  # a writer that contradicts itself: what came first is believed
            return None
        sample.last_arrival = now
        sample.add(first, count, fragments)
        if not sample.is_complete:
            return None
        self._remove(key)
        return sample

    def partial(self, key: AssemblyKey) -> PartialSample | None:
        return self._partial.get(key)

    def partial_for(self, prefix: bytes, reader_id: bytes) -> dict[int, PartialSample]:
        """The unfinished samples that this reader will get, by number."""
        unknown_prefix, unknown_id = bytes(12), bytes(4)
        return {
            number: sample
            for (to_prefix, to_reader, number), sample in self._partial.items()
            if to_prefix in (prefix, unknown_prefix) and to_reader in (reader_id, unknown_id)
        }

    def notice_number(self, sequence_number: int) -> None:
        """Everything below this number will never be wanted: it was delivered (best effort), or is settled."""
        for key in [key for key in self._partial if key[2] < sequence_number]:
            self._remove(key)

    def forget(self, start: int, end: int) -> None:
        """Numbers in [start, end) are irrelevant or lost."""
        for key in [key for key in self._partial if start <= key[2] < end]:
            self._remove(key)

    def prune(self, prefix: bytes, reader_id: bytes, above_sn: int) -> None:
        """A reader is deleted: drop what was meant for it alone and has not reached it (numbers above ``above_sn``).

        Left here it would hold memory that the other readers' samples need (Cyclone DDS: defrag_prune).
        """
        for key in [key for key in self._partial if key[0] == prefix and key[1] == reader_id and key[2] > above_sn]:
            self._remove(key)

    def _start(self, key: AssemblyKey, sample_size: int, fragment_size: int) -> PartialSample | None:
        if sample_size > self._max_octets:
            self.dropped += 1
            return None
        while self._partial and (
            len(self._partial) >= self._max_samples or self._octets + sample_size > self._max_octets
        ):
            victim = max(self._partial, key=lambda held: held[2]) if self.keeps_lowest else next(iter(self._partial))
            self.dropped += 1
            if self.keeps_lowest and victim[2] <= key[2]:
                return None
            self._remove(victim)
        sample = self._partial[key] = PartialSample(sample_size, fragment_size)
        self._octets += sample_size
        return sample

    def _remove(self, key: AssemblyKey) -> None:
        self._octets -= len(self._partial.pop(key).octets)
