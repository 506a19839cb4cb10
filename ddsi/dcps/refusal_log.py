"""RefusalLog: what keeps our endpoints from matching, as lines of Python's ``logging``, when it happens.

The logger is ``ddsi.matching``.  Whoever has not set up logging hears nothing of it; ``match_refusals``, ``explain``
and the statuses tell the same.  A pair that is refused by its partition is nobody's mistake: that is told at the level
INFO, all else at WARNING.
"""

from __future__ import annotations

import logging

from ..discovery.matching import RefusalKind
from ..engine import Participant
from ..engine.explaining import judged_pair
from ..structure.guid import Guid
from ..trace.wording import printable

__all__ = ["LOGGER_NAME", "RefusalLog"]

LOGGER_NAME = "ddsi.matching"
_log = logging.getLogger(LOGGER_NAME)
_log.addHandler(logging.NullHandler())  # at the logger above it, this would silence security too

_MOST_LINES = 1000
"""For each participant: strangers may announce any number of endpoints that fit nothing."""
_MOST_CHARACTERS = 1000


class RefusalLog:
    """Of one participant."""

    def __init__(self) -> None:
        self._line_count = 0

    def tell(self, engine: Participant, local: Guid, remote: Guid) -> None:
        """The pair is refused: everything that stands between the two, with remedies, on one line."""
        refusal = engine.matchmaker.refusals.get((local, remote))
        if refusal is None or self._line_count > _MOST_LINES:
            return
        level = logging.INFO if refusal.kind is RefusalKind.PARTITION else logging.WARNING
        if not _log.isEnabledFor(level):
            return
        self._line_count += 1
        if self._line_count > _MOST_LINES:
            _log.warning("%s: more endpoints do not match; no more of them are told", engine.guid)
            return
        own_writer = engine.local_writers.get(local) or engine.local_writers.get(remote)
        own_reader = engine.local_readers.get(local) or engine.local_readers.get(remote)
        writer = own_writer.data if own_writer is not None else engine.known_writers.get(remote)
        reader = own_reader.data if own_reader is not None else engine.known_readers.get(remote)
        if writer is None or reader is None:
            return  # it has gone in the meantime
        causes = judged_pair(engine, writer, reader, engine.now, may_ask=False).disagreements
        text = "; ".join(
            f"{one.policy}: offered {one.offered}, requested {one.requested}{one.detail and f': {one.detail}'}"
            f" (remedy: {one.remedy})"
            for one in causes
        )
        _log.log(
            level,
            "topic %s: writer %s and reader %s do not match: %s",
            printable(writer.topic_name),
            writer.guid,
            reader.guid,
            printable(text or str(refusal), limit=_MOST_CHARACTERS),
        )
