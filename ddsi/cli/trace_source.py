"""Where a trace is read from: JSON lines, pcap or pcapng, told apart by how they begin; to the end, or as they grow."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import BinaryIO

from ..structure.errors import MalformedMessage
from ..trace.capture_file import captured_messages, read_capture
from ..trace.event import MalformedTrace, TraceEvent
from ..trace.sink import MAX_LINE_CHARACTERS, read_json_lines
from .exit_status import CommandError

__all__ = ["TraceSource"]

_PIECE_OCTETS = 1 << 16
_MAGIC_OCTETS = 4
_CAPTURE_MAGICS = (
    b"\n\r\r\n",  # pcapng
    b"\xa1\xb2\xc3\xd4",  # pcap: both byte orders, micro- and nanoseconds
    b"\xd4\xc3\xb2\xa1",
    b"\xa1\xb2\x3c\x4d",
    b"\x4d\x3c\xb2\xa1",
)


class TraceSource:
    """The events of one file.  ``wait``, if given, is called at the file's end: then it is tried again, for ever."""

    def __init__(self, stream: BinaryIO, name: str, wait: Callable[[], None] | None = None) -> None:
        self._stream = stream
        self._name = name
        self._wait = wait
        self._unread = b""

    def events(self) -> Iterator[TraceEvent]:
        """One after the other.  Raises CommandError where the file is not what it began as; what came before stands."""
        self._unread = self._start()
        try:
            if self._unread in _CAPTURE_MAGICS:
                yield from captured_messages(read_capture(self))
            else:
                yield from read_json_lines(self._lines())
        except (MalformedTrace, MalformedMessage) as error:
            raise CommandError(f"{self._name} is broken: {error}") from error

    def read(self, count: int, /) -> bytes:
        """At most ``count`` octets; none at the end of a file that is not waited for."""
        if self._unread:
            octets, self._unread = self._unread[:count], self._unread[count:]
            return octets
        while not (octets := self._stream.read(count)) and self._wait is not None:
            self._wait()
        return octets

    def _start(self) -> bytes:
        start = b""
        while len(start) < _MAGIC_OCTETS and (octets := self.read(_MAGIC_OCTETS - len(start))):
            start += octets
        return start

    def _lines(self) -> Iterator[str]:
        rest = b""
        while octets := self.read(_PIECE_OCTETS):
            *whole, rest = (rest + octets).split(b"\n")
            yield from (line.decode(errors="replace") for line in whole)
            if len(rest) > MAX_LINE_CHARACTERS:
                raise MalformedTrace(f"a line is longer than {MAX_LINE_CHARACTERS} characters")
        if rest:
            yield rest.decode(errors="replace")
