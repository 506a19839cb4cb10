"""Defragmenter: joins the fragments of large samples.  Other name: defrag.

RTPS 2.5 §8.4.14.1 (large data).  One per remote writer, whoever reads it, so that a large sample is joined once.

Fragments may be addressed to all readers of the participant or to one of them.  What is addressed to one reader alone
(a filtering writer sends so) is joined for that reader.  But a writer also addresses *repairs* to the one reader
that asked, and these belong to the sample whose other fragments came for all: where there is such a sample, they are
joined with it.

A sample's octets are allocated when its first fragment comes, as large as the fragment says, so both the size of one
sample and the sum of all unfinished ones have a bound, and their number too.  The sum is over all writers of a
participant (:class:`DefragBudget`); where it is exhausted, the writer that holds most gives way.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from enum import Enum

from ddsi.structure.sequence_number import MAX_SET_BITS, NumberSet

__all__ = ["FRAGMENT_SILENCE", "DefragBudget", "Defragmenter", "Keep", "PartialSample"]

FRAGMENT_SILENCE = 0.002
"""When no fragment of a sample has come for so many seconds, the missing ones are not just late."""
_TO_ALL = bytes(4)


class Keep(Enum):
    """Which unfinished samples of one writer are worth most when there is no room for all."""

    LOWEST = "the lowest numbers: everybody waits for them, and a reliable writer sends the others again"
    HIGHEST = "the highest numbers: in a best-effort stream lower ones will never be finished"
    NEWEST = "those that began last: where anybody may have sent anything, a number says nothing"


class PartialSample:
    """A sample of which some fragments are here.  Fragment numbers count from 1.

    ``memory``: octets that it occupies, those of the sample and one for each fragment.  ``reader_id``: the reader that
    it is for, UNKNOWN (zeros) for all.  ``is_sealed``: what is joined is the protected
    form of the sample, which can be opened only when it is complete.
    """

    __slots__ = (
        "_arrived",
        "_missing_count",
        "asked_at",
        "fragment_size",
        "inline_qos",
        "is_sealed",
        "last_arrival",
        "memory",
        "octets",
        "reader_id",
        "timestamp",
    )

    def __init__(
        self, sample_size: int, fragment_size: int, reader_id: bytes = _TO_ALL, *, is_sealed: bool = False
    ) -> None:
        self.octets = bytearray(sample_size)
        self.fragment_size = fragment_size
        self.reader_id = reader_id
        self.is_sealed = is_sealed
        self._missing_count = -(-sample_size // fragment_size)
        self._arrived = bytearray(self._missing_count)
        self.memory = sample_size + self._missing_count
        self.inline_qos: object | None = None
        self.timestamp: int | None = None
        self.last_arrival = -math.inf
        self.asked_at = -math.inf

    @property
    def fragment_count(self) -> int:
        return len(self._arrived)

    @property
    def is_complete(self) -> bool:
        return self._missing_count == 0

    def is_like(self, sample_size: int, fragment_size: int, *, is_sealed: bool) -> bool:
        """May fragments that say so belong to it?"""
        return self.fragment_size == fragment_size and len(self.octets) == sample_size and self.is_sealed is is_sealed

    def is_silent(self, now: float, *, may_repeat: bool) -> bool:
        """Is it time to ask for what is missing: nothing has come for a moment, nor is an answer under way?"""
        if now - self.last_arrival < FRAGMENT_SILENCE:
            return False
        return may_repeat or self.last_arrival >= self.asked_at

    def add(self, first: int, count: int, fragments: bytes | memoryview) -> None:
        """``count`` fragments from number ``first`` on, as they lie in the sample one after the other."""
        size = self.fragment_size
        offset = (first - 1) * size
        end = min(offset + count * size, len(self.octets))
        for index in range(first - 1, min(first - 1 + count, len(self._arrived))):
            if not self._arrived[index]:
                self._arrived[index] = 1
                self._missing_count -= 1
        if not (isinstance(fragments, memoryview) and fragments.obj is self.octets):
            self.octets[offset:end] = fragments[: end - offset]

    def place_of(self, first: int, count: int) -> memoryview | None:
        """Where these fragments will lie, for who makes them; None if any of them is here.

        Whatever is written there, they are here only when they are added.
        """
        if 1 in self._arrived[first - 1 : first - 1 + count]:
            return None
        size = self.fragment_size
        return memoryview(self.octets)[(first - 1) * size : (first - 1 + count) * size]

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


class DefragBudget:
    """The memory that all defragmenters of a participant share.  ``octets``: how much of it is taken."""

    __slots__ = ("_members", "max_octets", "octets")

    def __init__(self, max_octets: int) -> None:
        self.max_octets = max_octets
        self.octets = 0
        self._members: dict[int, Defragmenter] = {}

    def join(self, member: Defragmenter) -> None:
        self._members[id(member)] = member

    def leave(self, member: Defragmenter) -> None:
        self._members.pop(id(member), None)

    def heaviest(self) -> Defragmenter:
        """Who holds most; of equals the one that came first."""
        return max(self._members.values(), key=lambda member: member.octets)


class Defragmenter:
    """The unfinished samples of one remote writer, ``max_samples`` of them and of ``budget`` octets at most."""

    __slots__ = ("_budget", "_count", "_max_samples", "_partial", "dropped", "keep", "octets")

    def __init__(self, budget: DefragBudget, *, max_samples: int, keep: Keep) -> None:
        self._budget = budget
        self._max_samples = max_samples
        self.keep = keep
        self.octets = 0
        self.dropped = 0
        self._count = 0
        # By number, in the order in which they began; then by the reader that it is for.
        self._partial: dict[int, dict[bytes, PartialSample]] = {}
        budget.join(self)

    def __len__(self) -> int:
        return self._count

    def __contains__(self, sequence_number: object) -> bool:
        """Are fragments of this sample here, for whomever?"""
        return sequence_number in self._partial

    def add(
        self,
        sequence_number: int,
        reader_id: bytes,
        *,
        sample_size: int,
        fragment_size: int,
        first: int,
        count: int,
        fragments: bytes | memoryview,
        now: float,
        is_sealed: bool = False,
        begun: PartialSample | None = None,
    ) -> PartialSample | None:
        """Fragments of one sample: the sample as far as it is here now, or None when they were refused.

        When it :attr:`~PartialSample.is_complete` it is not held any more.  Sealed fragments and opened ones are never
        joined.  ``begun``: of :meth:`begin`, if the fragments were put there.
        """
        sample = self._sample_for(sequence_number, reader_id)
        if sample is not None and not sample.is_like(sample_size, fragment_size, is_sealed=is_sealed):
            self.dropped += 1
            if self.keep is not Keep.NEWEST:
                return None  # a writer that contradicts itself: what came first is believed
            self._remove(sequence_number, sample)
            sample = None
        if sample is None:
            sample = self._start(sequence_number, reader_id, sample_size, fragment_size, begun, is_sealed=is_sealed)
            if sample is None:
                return None
        sample.last_arrival = now
        sample.add(first, count, fragments)
        if sample.is_complete:
            self._remove(sequence_number, sample)
        return sample

    def begin(
        self, sequence_number: int, reader_id: bytes, octets: int, *, sample_size: int, fragment_size: int
    ) -> PartialSample | None:
        """The sample in which so many ``octets`` may be put before it is known whether they are to be believed.

        One that is not here yet is not held: it exists for these fragments alone until they are added, and only where
        they are half of it at least, so that nobody makes us take much more memory than he has sent octets.
        """
        samples = self._partial.get(sequence_number)
        if samples is None:
            is_large_part = 2 * octets >= sample_size
            return PartialSample(sample_size, fragment_size, bytes(reader_id)) if is_large_part else None
        sample = samples.get(_TO_ALL) or samples.get(reader_id)
        if sample is None or not sample.is_like(sample_size, fragment_size, is_sealed=False):
            return None
        return sample

    def partial_for(self, reader_id: bytes) -> dict[int, PartialSample]:
        """The unfinished samples that this reader will get, by number."""
        found: dict[int, PartialSample] = {}
        for number, samples in self._partial.items():
            sample = samples.get(_TO_ALL) or samples.get(reader_id)
            if sample is not None:
                found[number] = sample
        return found

    def notice_number(self, sequence_number: int) -> None:
        """Everything below this number will never be wanted: it was delivered (best effort), or is settled."""
        for number in [number for number in self._partial if number < sequence_number]:
            self._remove_number(number)

    def prune(self, reader_id: bytes) -> None:
        """A reader is deleted: drop what was meant for it alone.

        Left here it would hold memory that the other readers' samples need (Cyclone DDS: defrag_prune).
        """
        for number, samples in list(self._partial.items()):
            sample = samples.get(reader_id)
            if sample is not None:
                self._remove(number, sample)

    def close(self) -> None:
        """The writer is gone: give everything back."""
        for number in list(self._partial):
            self._remove_number(number)
        self._budget.leave(self)

    def _sample_for(self, number: int, reader_id: bytes) -> PartialSample | None:
        samples = self._partial.get(number)
        if samples is None:
            return None
        sample = samples.get(_TO_ALL) or samples.get(reader_id)
        if sample is None and reader_id == _TO_ALL:
            # Repairs came before any fragment for all: from here on what one reader has got is for all.
            sample, *others = samples.values()
            for other in others:
                self._remove(number, other)
            del samples[sample.reader_id]
            samples[_TO_ALL] = sample
            sample.reader_id = _TO_ALL
        return sample

    def _start(
        self,
        number: int,
        reader_id: bytes,
        sample_size: int,
        fragment_size: int,
        begun: PartialSample | None,
        *,
        is_sealed: bool,
    ) -> PartialSample | None:
        octets = sample_size - (-sample_size // fragment_size)
        if octets > self._budget.max_octets:
            self.dropped += 1
            return None
        while self._count >= self._max_samples:
            if not self._give_way(number):
                return None
        while self._budget.octets + octets > self._budget.max_octets:
            heaviest = self._budget.heaviest()
            if not heaviest._give_way(number if heaviest is self else None):
                return None
        sample = begun or PartialSample(sample_size, fragment_size, bytes(reader_id), is_sealed=is_sealed)
        self._partial.setdefault(number, {})[sample.reader_id] = sample
        self._count += 1
        self.octets += sample.memory
        self._budget.octets += sample.memory
        return sample

    def _give_way(self, newcomer: int | None) -> bool:
        """Drop one sample to make room; False when the ``newcomer`` (a number of this writer) is the one to go."""
        self.dropped += 1
        match self.keep:
            case Keep.LOWEST:
                victim = max(self._partial)
                if newcomer is not None and victim <= newcomer:
                    return False
            case Keep.HIGHEST:
                victim = min(self._partial)
            case Keep.NEWEST:
                victim = next(iter(self._partial))
        self._remove_number(victim)
        return True

    def _remove_number(self, number: int) -> None:
        for sample in list(self._partial[number].values()):
            self._remove(number, sample)

    def _remove(self, number: int, sample: PartialSample) -> None:
        samples = self._partial[number]
        del samples[sample.reader_id]
        if not samples:
            del self._partial[number]
        self._count -= 1
        self.octets -= sample.memory
        self._budget.octets -= sample.memory
