"""Eviction: who gives way when a table that strangers fill is full.

RTPS leaves it open.  Anybody who can reach our ports can invent participants, and endpoints of theirs, faster than
leases run out.  So both tables have a bound (``Config.max_participants``, ``Config.max_endpoints``), and a rule by
which a flood displaces its own kind, not those that we work with:

- of participants, one that has announced no endpoint goes, the longest silent first, once it has been silent for a
  second; and none that security has admitted while there is one that it has not;
- of endpoints, one of the participant that announced most goes, and of these the newest that matches nothing here.  A
  participant that already has its share of the table (the bound divided by their number) displaces nobody.

Where nobody has to go, the newcomer is not stored and its sender is counted (``DropReason.TABLE_FULL_...``).
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from ..discovery.participant_proxy import ParticipantProxy
from ..structure.discovered import DiscoveredEndpointData

if TYPE_CHECKING:
    from .participant import Participant

__all__ = ["Eviction"]

_SILENT_S = 1.0


class Eviction:
    """Chooses the victims; that they go is the discovery agent's doing."""

    def __init__(self, engine: Participant) -> None:
        self._engine = engine
        self._nobody_until = 0.0

    @property
    def participants_are_full(self) -> bool:
        return len(self._engine.participants) >= self._engine.config.max_participants

    @property
    def endpoints_are_full(self) -> bool:
        engine = self._engine
        return len(engine.known_writers) + len(engine.known_readers) >= engine.config.max_endpoints

    def idle_participant(self, now: float) -> ParticipantProxy | None:
        """The participant that makes room for a new one; None when the newcomer has to stay outside."""
        if now < self._nobody_until:
            return None  # looked through a moment ago: a flood must not make each datagram a search
        idle = [proxy for proxy in self._engine.participants.values() if proxy.endpoint_count == 0]
        strangers = [proxy for proxy in idle if not proxy.is_admitted]
        victim = min(strangers or idle, key=lambda proxy: proxy.last_heard, default=None)
        if victim is not None and now - victim.last_heard >= _SILENT_S:
            return victim
        self._nobody_until = victim.last_heard + _SILENT_S if victim is not None else now + _SILENT_S
        return None

    def surplus_endpoint(self, newcomer: ParticipantProxy) -> DiscoveredEndpointData | None:
        """The endpoint that makes room for one of ``newcomer``'s; None when that has to stay outside."""
        engine = self._engine
        share = engine.config.max_endpoints // max(len(engine.participants), 1)
        if newcomer.endpoint_count >= max(share, 1):
            return None
        heaviest = max(engine.participants.values(), key=lambda proxy: proxy.endpoint_count)
        if heaviest is newcomer or heaviest.endpoint_count <= newcomer.endpoint_count + 1:
            return None
        announced: list[DiscoveredEndpointData] = [
            *engine.known_writers.of_participant(heaviest.prefix),
            *engine.known_readers.of_participant(heaviest.prefix),
        ]
        unmatched = [data for data in announced if not engine.matchmaker.is_matched(data)]
        return (unmatched or announced)[-1]
