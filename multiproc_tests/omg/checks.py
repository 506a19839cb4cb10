"""How a subscriber's samples are judged, by the suite's rules: each check reads on from the first sample.

``count`` is how many samples (of the first instance, where there are several) make the judgement; the suite asks
for 500.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Awaitable, Callable
from dataclasses import dataclass
from itertools import pairwise

from .codes import Code
from .output import SAMPLE, Output, Sample

__all__ = [
    "Check",
    "any_sample",
    "by_colors",
    "by_instance_or_in_order",
    "by_sizes",
    "deadline_missed",
    "disposed",
    "every_tenth",
    "groups_of_two_or_three",
    "in_order",
    "large",
    "no_history",
    "no_losses",
    "sizes_up_to_20",
    "unregistered",
    "whole_history",
    "whole_sets",
]

Check = Callable[[Output, int], Awaitable[Code]]

# A time-based filter and a lifespan thin the samples out: a tenth of the number is judged, as in the suite.
_THINNED = 10


async def any_sample(output: Output, count: int) -> Code:
    """A well-formed sample has come, and its size is not 0."""
    sample = Sample.from_line(output.line)
    if sample is None:
        return Code.DATA_NOT_RECEIVED
    return Code.OK if sample.size else Code.DATA_NOT_CORRECT


async def by_sizes(output: Output, count: int) -> Code:
    """From one publisher or from both?  Each writes a size of its own; a hand-over from one to the other is one."""
    changes = 0
    last: int | None = None
    received = 0
    async for sample in output.samples():
        changes += last is not None and sample.size != last
        last = sample.size
        if changes > 1:
            return Code.RECEIVING_FROM_BOTH
        received += 1
        if received > count:
            break
    return Code.RECEIVING_FROM_ONE if received > 1 else Code.DATA_NOT_RECEIVED


async def by_colors(output: Output, count: int) -> Code:
    """From one publisher or from both?  Each writes a colour of its own."""
    colors: set[str] = set()
    received = 0
    async for sample in output.samples():
        colors.add(sample.color)
        if len(colors) > 1:
            return Code.RECEIVING_FROM_BOTH
        received += 1
        if received > count:
            break
    return Code.RECEIVING_FROM_ONE if received > 1 else Code.DATA_NOT_RECEIVED


async def in_order(output: Output, count: int) -> Code:
    """The sizes of each instance ascend; some may be missing."""
    return await _successive(output, count, lambda before, now: now > before)


async def no_losses(output: Output, count: int) -> Code:
    """Each size is the successor of the one before, in each instance."""
    return await _successive(output, count, lambda before, now: now == before + 1)


async def _successive(output: Output, count: int, follows: Callable[[int, int], bool]) -> Code:
    sizes: dict[str, int] = {}
    received = 0
    async for sample in output.samples():
        if sample.color in sizes and not follows(sizes[sample.color], sample.size):
            return Code.DATA_NOT_CORRECT
        sizes[sample.color] = sample.size
        received += sample.color == next(iter(sizes))
        if received > count:
            return Code.OK
    return Code.DATA_NOT_RECEIVED


async def sizes_up_to_20(output: Output, count: int) -> Code:
    """The content filter lets sizes of 1 to 20 pass."""
    received = 0
    async for sample in output.samples():
        if not 1 <= sample.size <= 20:
            return Code.DATA_NOT_CORRECT
        received += 1
        if received > count // 2:
            return Code.OK
    return Code.DATA_NOT_RECEIVED


async def no_history(output: Output, count: int) -> Code:
    """The late joiner does not get what was written first."""
    sample = Sample.from_line(output.line)
    return Code.OK if sample is not None and sample.size >= 5 else Code.DATA_NOT_CORRECT


async def whole_history(output: Output, count: int) -> Code:
    """The late joiner begins with the very first sample."""
    sample = Sample.from_line(output.line)
    return Code.OK if sample is not None and sample.size == 1 else Code.DATA_NOT_CORRECT


async def deadline_missed(output: Output, count: int) -> Code:
    """Samples come, but too slowly."""
    return Code.DEADLINE_MISSED if await output.find("on_requested_deadline_missed") else Code.DATA_NOT_RECEIVED


async def every_tenth(output: Output, count: int) -> Code:
    """Of ten samples of an instance one comes.  What the writer's own period adds up to is allowed for."""
    sizes: dict[str, list[int]] = {}
    received = 0
    async for sample in output.samples():
        seen = sizes.setdefault(sample.color, [])
        # Where the first interval began nobody knows.
        if len(seen) >= 2 and not 9 <= sample.size - seen[-1] <= 19:
            return Code.DATA_NOT_CORRECT
        seen.append(sample.size)
        received += sample.color == next(iter(sizes))
        if received > count // _THINNED:
            return Code.OK
    return Code.DATA_NOT_RECEIVED


async def unregistered(output: Output, count: int) -> Code:
    """Each instance that was seen is told to have no writers any more."""
    return await _ended(output, "NOT_ALIVE_NO_WRITERS_INSTANCE_STATE")


async def disposed(output: Output, count: int) -> Code:
    """Each instance that was seen is told to be disposed."""
    return await _ended(output, "NOT_ALIVE_DISPOSED_INSTANCE_STATE")


async def _ended(output: Output, state: str) -> Code:
    seen: set[str] = set()
    ended: set[str] = set()
    while True:
        sample = Sample.from_line(output.line)
        if sample is not None:
            seen.add(sample.color)
        elif state in output.line:
            ended.add(output.line.split()[1])
        if seen == ended:
            return Code.OK
        if await output.find(r"\]", state) is None:
            return Code.DATA_NOT_CORRECT


async def large(output: Output, count: int) -> Code:
    """The payload comes whole: its last octet is what was written."""
    received = 0
    async for sample in output.samples():
        if sample.last_octet != 255:
            return Code.DATA_NOT_CORRECT
        received += 1
        if received > count:
            return Code.OK
    return Code.DATA_NOT_RECEIVED


@dataclass(slots=True)
class _Run:
    """Samples of an instance of which each is the successor of the one before."""

    last_size: int
    length: int = 1
    is_first: bool = True


async def groups_of_two_or_three(output: Output, count: int) -> Code:
    """Of what is written between two reads only the last two or three have not expired."""
    runs: dict[str, _Run] = {}
    has_expired = False
    received = 0
    async for sample in output.samples():
        run = runs.setdefault(sample.color, _Run(sample.size - 1, length=0))
        if sample.size == run.last_size + 1:
            run.last_size += 1
            run.length += 1
        else:
            # The first may be the end of a group that began before we were there.
            if run.length not in (2, 3) and not (run.is_first and run.length == 1):
                return Code.DATA_NOT_CORRECT
            has_expired = has_expired or run.length > 1
            runs[sample.color] = _Run(sample.size, is_first=False)
        received += sample.color == next(iter(runs))
        if received > count // _THINNED:
            return Code.OK if has_expired else Code.DATA_NOT_CORRECT
    return Code.DATA_NOT_RECEIVED


_ORDERED_READ = "Reading with ordered access"
_COHERENT_READ = "Reading coherent sets"
_FEWEST_TO_JUDGE = 6  # of four instances; fewer may be of one instance by chance
_EXCEPTIONS = 0.01  # of the reads: one may come in the middle of a burst


async def by_instance_or_in_order(output: Output, count: int) -> Code:
    """Does each read hand out instance after instance, or all as they were written?

    A read that holds more neighbours of one instance than of two is one by instance.  The suite lets a hundredth of its
    number of samples be exceptions.
    """
    found: Code | None = None
    exceptions = received = reads = 0
    colors: list[str] = []
    first_color = ""
    while received < count:
        sample = Sample.from_line(output.line)
        if sample is not None:
            first_color = first_color or sample.color
            received += sample.color == first_color
            colors.append(sample.color)
        else:
            reads += 1
            judged = _judge_read(colors)
            colors = []
            if judged is not None and found is None:
                found = judged
            elif judged is not None and judged is not found:
                exceptions += 1
            if exceptions > max(1, _EXCEPTIONS * count):
                return Code.DATA_NOT_CORRECT
        if reads > count or await output.find(SAMPLE, _ORDERED_READ) is None:
            return Code.DATA_NOT_RECEIVED
    return found or _judge_read(colors) or Code.DATA_NOT_RECEIVED


def _judge_read(colors: list[str]) -> Code | None:
    """None where it holds too little to tell."""
    if len(colors) <= _FEWEST_TO_JUDGE:
        return None
    same = sum(one == other for one, other in pairwise(colors))
    different = len(colors) - 1 - same
    if same == different:
        return None
    return Code.ORDERED_ACCESS_INSTANCE if same > different else Code.ORDERED_ACCESS_TOPIC


_SET_SIZE, _SET_TOPICS, _SET_INSTANCES = 3, 3, 4  # as the publisher of these cases is told
_FEWEST_SETS, _SETS_PER_SAMPLE = 5, 20  # 500 samples: 25 sets


async def whole_sets(output: Output, count: int) -> Code:
    """Of every instance of every topic, each read returns whole sets: three samples, or three for each of several.

    The sizes of an instance ascend.  The first and the last read of an instance may be cut short.
    """
    wanted = max(_FEWEST_SETS, count // _SETS_PER_SAMPLE)
    samples: dict[tuple[str, str], list[tuple[int, int]]] = {}
    read = 0
    while True:
        sample = Sample.from_line(output.line)
        if sample is not None:
            seen = samples.setdefault((sample.topic, sample.color), [])
            if seen and sample.size <= seen[-1][1]:
                return Code.DATA_NOT_CORRECT
            seen.append((read, sample.size))
        elif _COHERENT_READ in output.line:
            read += 1
        is_all = len(samples) == _SET_TOPICS * _SET_INSTANCES
        if is_all and all(len(seen) >= wanted * _SET_SIZE for seen in samples.values()):
            break
        if await output.find(SAMPLE, _COHERENT_READ) is None or read > 4 * wanted + 50:
            return Code.DATA_NOT_RECEIVED
    for seen in samples.values():
        in_read = Counter(number for number, _ in seen)
        if any(size % _SET_SIZE for size in list(in_read.values())[1:-1]):
            return Code.DATA_NOT_CORRECT
    return Code.OK
