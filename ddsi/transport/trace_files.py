"""Opens the files that a configuration wants traces in.  ``ddsi.trace`` makes their content."""

from __future__ import annotations

import sys
from contextlib import ExitStack
from typing import TextIO

from ..config import Config
from ..structure.errors import ConfigurationError
from ..trace.event import Category
from ..trace.pcapng import PcapngSink
from ..trace.sink import JsonLinesSink, TraceSink, only, tee

__all__ = ["open_trace"]


def open_trace(config: Config, files: ExitStack, *, epoch_offset: float) -> TraceSink | None:
    """A sink for what ``config`` asks for, None when tracing is off.  ``files`` closes what is opened here.

    ``epoch_offset``: seconds to add to the engine's clock to have seconds since 1970.
    """
    sinks: list[TraceSink] = []
    try:
        if config.trace_file:
            lines = JsonLinesSink(_text_stream(config, files), epoch_offset=epoch_offset)
            sinks.append(only(lines, categories=_categories(config.trace_level)))
        if config.pcap_file:
            stream = files.enter_context(open(config.pcap_file, "wb"))  # noqa: SIM115 - closed by the stack
            sinks.append(PcapngSink(stream, epoch_offset=epoch_offset))
    except OSError as error:
        raise ConfigurationError(f"a trace file cannot be opened: {error}") from error
    if not sinks:
        return None
    return sinks[0] if len(sinks) == 1 else tee(*sinks)


_LEVELS: tuple[tuple[str, tuple[Category, ...]], ...] = (
    ("severe", (Category.REMARK, Category.SECURITY)),
    ("warning", (Category.DROP,)),
    ("info", (Category.STATUS, Category.MATCHING)),
    ("config", (Category.DISCOVERY,)),
    ("fine", (Category.DATA,)),
    ("finer", (Category.TIMER, Category.LINK)),
    ("finest", (Category.MESSAGE,)),
)
"""Each level of ``Tracing/Verbosity`` adds these categories to those of the levels before it."""


def _categories(level: str) -> set[Category]:
    categories: set[Category] = set()
    for name, added in _LEVELS:
        categories.update(added)
        if name == level:
            break
    return categories


def _text_stream(config: Config, files: ExitStack) -> TextIO:
    if config.trace_file in ("stdout", "stderr"):
        return sys.stdout if config.trace_file == "stdout" else sys.stderr
    mode = "a" if config.trace_append else "w"
    stream: TextIO = open(config.trace_file, mode, buffering=1, encoding="utf-8")  # type: ignore[assignment]  # noqa: SIM115
    return files.enter_context(stream)
