"""What a ``shape_main`` prints, read once from top to bottom: events to wait for, and samples."""

from __future__ import annotations

import re
from collections.abc import AsyncIterator
from dataclasses import dataclass

from ..framework import ExpectationFailed, Process

__all__ = ["SAMPLE", "Output", "Sample", "Samples"]

SAMPLE = r"\[\d+\]"
"""What the suite takes for a sample: its size, wherever in a line."""

_COLUMNS = re.compile(r"(\w+) +(\w+) +(\d+) (\d+) \[(\d+)\](?: \{(\d+)\})?")


@dataclass(frozen=True, slots=True)
class Sample:
    """One line of a sample; ``last_octet`` of its payload, if it has one."""

    topic: str
    color: str
    size: int
    last_octet: int | None = None

    @classmethod
    def from_line(cls, line: str) -> Sample | None:
        found = _COLUMNS.fullmatch(line.rstrip())
        if found is None:
            return None
        return cls(found[1], found[2], int(found[5]), int(found[6]) if found[6] else None)


class Output:
    """The output of one process.  ``patience``: how many seconds each next event may take."""

    def __init__(self, process: Process, patience: float) -> None:
        self.process = process
        self.patience = patience
        self.line = ""
        """The line that was found last."""

    async def find(self, *patterns: str, timeout: float | None = None) -> str | None:
        """The first of these patterns (case aside) to be found in a line; None if none is within ``timeout`` seconds.

        Without one, within the patience.  A line in which several are found counts as the one that is named first.
        """
        anything = ".*(?:" + "|".join(patterns) + ").*"
        try:
            found = await self.process.expect(f"(?i:{anything})", timeout=timeout or self.patience)
        except ExpectationFailed:
            return None
        self.line = found[0]
        return next(pattern for pattern in patterns if re.search(pattern, self.line, re.IGNORECASE))

    def samples(self) -> Samples:
        """The sample in the line found last, and all that follow, until the patience ends."""
        return Samples(self)


class Samples(AsyncIterator[Sample]):
    """The samples of an output; not a generator, as a check that has seen enough just leaves it."""

    def __init__(self, output: Output) -> None:
        self._output = output
        self._is_first = True

    async def __anext__(self) -> Sample:
        while True:
            if not self._is_first and await self._output.find(SAMPLE) is None:
                raise StopAsyncIteration
            self._is_first = False
            sample = Sample.from_line(self._output.line)
            if sample is not None:
                return sample
