"""Structured events of what the engine does, and their rendering as JSON lines, pcapng, words and diagrams.

The debugging tool of everything else.  The engine holds one :data:`~ddsi.trace.sink.TraceSink` or None; nothing is
built, not even the event, when it is None.  This room has no file, no socket and no clock: writers are given a
stream, times are those that the engine was given.  The written schema is ``docs/trace.md``.
"""
