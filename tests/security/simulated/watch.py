"""Reads what everybody sends, as somebody without keys would: finds plain text, and nonces that were used twice."""

from __future__ import annotations

from collections.abc import Iterator

from ddsi.messages.raw_submessage import SubmessageKind, iterate_submessages
from ddsi.trace.event import TraceEvent
from ddsi.trace.events import MessageSent

__all__ = ["Watch"]

_PREFIXES = (SubmessageKind.SEC_PREFIX, SubmessageKind.SRTPS_PREFIX)
_NO_KEY_ID = bytes(4)


class Watch:
    """A trace sink.  ``repeated``: keys and nonces that protected two different things."""

    def __init__(self) -> None:
        self.sent: list[bytes] = []
        self.repeated: list[str] = []
        self.nonces: dict[tuple[bytes, ...], bytes] = {}

    def __call__(self, event: TraceEvent) -> None:
        if isinstance(event, MessageSent):
            self.sent.append(event.octets)
            for key, nonce, protected in _nonces(event.octets):
                before = self.nonces.setdefault((*key, nonce), protected)
                if before is not protected and before != protected:
                    self.repeated.append(f"{nonce.hex()} under {b' '.join(key).hex()}")

    def holds(self, octets: bytes) -> bool:
        return any(octets in message for message in self.sent)


def _nonces(message: bytes) -> Iterator[tuple[tuple[bytes, ...], bytes, bytes]]:
    """Of each envelope in sight: whose key (sender and key id, or the two that share one), nonce, and what follows."""
    sender, destination = message[8:20], bytes(12)
    for raw in iterate_submessages(memoryview(message), start=20):
        if raw.kind == SubmessageKind.INFO_DST:
            destination = bytes(raw.body[:12])
        elif raw.kind in _PREFIXES:
            header = bytes(raw.body[:20])
            key_id, nonce = header[4:8], header[8:20]
            key = (sender, key_id) if key_id != _NO_KEY_ID else (*sorted((sender, destination)), key_id)
            yield key, nonce, message[raw.end :]
