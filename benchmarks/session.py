"""Session: what one measurement is given - counts at scale, a domain of its own, and workers under one deadline."""

from __future__ import annotations

import os
import time
from contextlib import ExitStack
from itertools import count as count_up
from types import TracebackType
from typing import Self

from .benchmark import Side
from .worker import Worker

__all__ = ["Session"]

# Domains whose ports (7400 + 250 per domain) lie below those that systems hand out for outgoing traffic.
_FIRST_DOMAIN = 20
_DOMAINS = 80
_serials = count_up(os.getpid())


class Session:
    """As a context manager: workers started through it have ended when the block is left."""

    def __init__(self, *, scale: float = 1.0, deadline_s: float = 60.0) -> None:
        """``scale``: by what the number of samples is multiplied.  ``deadline_s``: for all of this measurement."""
        serial = next(_serials)
        self.domain = _FIRST_DOMAIN + serial % _DOMAINS
        self._tag = f"benchmark-{os.getpid()}-{serial}"
        self._scale = scale
        self._deadline = time.monotonic() + deadline_s
        self._workers = ExitStack()

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, traceback: TracebackType | None
    ) -> None:
        self._workers.close()

    def count(self, full: int, least: int = 2) -> int:
        """So many samples at this session's scale; at least ``least``."""
        return max(int(full * self._scale), least)

    def start(self, side: Side, role: str, **options: object) -> Worker:
        """The role ``role`` of the side's program, in a process of its own."""
        return self.start_module(side.module, role, **options)

    def start_module(self, module: str, role: str, **options: object) -> Worker:
        """As :meth:`start`, for a program that is not a side's own."""
        worker = Worker(module, role, options, tag=self._tag, deadline=self._deadline)
        return self._workers.enter_context(worker)
