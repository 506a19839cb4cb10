"""How many handshakes go on at once, and who waits for how long.  DDS-Security 1.1 leaves it open (§8.3.4).

Anybody can announce participants and ask for handshakes in their names.  Each would have us make keys, verify
signatures and say again for a long time what nobody hears.  So only some handshakes go on at once; the others wait.

Who waits must not wait for ever behind strangers that never answer.  While somebody waits, a turn is short
(:data:`TURN_S`).  Then the next takes the seat, and who had it waits again, behind all others, and keeps what it has
reached.  Seats that become free go by turns to who has waited longest, and to who has waited longest of those that have
*said* something.  Honest participants speak, so a silent crowd does not delay them; and a crowd that speaks cannot keep
those out that say nothing before they are spoken to (Fast DDS).  With a table of 1000 participants, each of them
hostile, a newcomer has its turn within 1000 / :data:`MAX_HANDSHAKES` * :data:`TURN_S` seconds, which is 16.

It knows Guids and no handshake; :mod:`.admission` does what it says.
"""

from __future__ import annotations

import math
from typing import Final

from ddsi.structure.guid import Guid

__all__ = ["MAX_HANDSHAKES", "TURN_S", "WaitingRoom"]

MAX_HANDSHAKES: Final = 128
"""At once, unless property ``dds.sec.auth.max_handshakes`` says another number.  What so many cost, with RSA and on one
processor, is computed in half a second."""
TURN_S: Final = 2.0
"""Long enough to say everything four times, and for the peer's own repetitions, a second apart, to come."""


class WaitingRoom:
    """Of one participant, with so many ``seats``.  Everybody who is known is in it once at most, which bounds it."""

    def __init__(self, seats: int = MAX_HANDSHAKES) -> None:
        self._seat_count = seats
        self._seats: dict[Guid, float] = {}  # since when, the earliest first
        self._waiting: dict[Guid, None] = {}  # in order of arrival
        self._speaking: dict[Guid, None] = {}  # those of them that said something, in order of their first word
        self._speaking_are_next = True

    def enter(self, guid: Guid) -> None:
        """It wants a handshake, and will be given a seat by :meth:`next`."""
        if guid not in self._seats:
            self._waiting.setdefault(guid)

    def spoke(self, guid: Guid) -> bool:
        """It said something; does it wait?  Then this may shorten the waiting."""
        if guid in self._waiting:
            self._speaking.setdefault(guid)
            return True
        return False

    def leave(self, guid: Guid) -> None:
        """Its handshake is done, or given up, or it is gone."""
        self._seats.pop(guid, None)
        self._waiting.pop(guid, None)
        self._speaking.pop(guid, None)

    def is_seated(self, guid: Guid) -> bool:
        return guid in self._seats

    def seat_next(self, now: float) -> Guid | None:
        """Who has its turn from now on; None while nobody waits or no seat is free."""
        if not self._waiting or len(self._seats) >= self._seat_count:
            return None
        line = self._speaking if self._speaking and self._speaking_are_next else self._waiting
        self._speaking_are_next = not self._speaking_are_next
        guid = next(iter(line))
        self.leave(guid)
        self._seats[guid] = now
        return guid

    def end_turn(self, now: float) -> Guid | None:
        """Who has to wait again, as its turn is over and there are others; None where nobody has to."""
        if now < self.next_deadline():
            return None
        guid = next(iter(self._seats))
        del self._seats[guid]
        self._waiting[guid] = None
        return guid

    def next_deadline(self) -> float:
        """When the first turn is over; ``math.inf`` while nobody waits for it."""
        if not self._waiting or len(self._seats) < self._seat_count:
            return math.inf
        return next(iter(self._seats.values())) + TURN_S

    @property
    def waiting_count(self) -> int:
        return len(self._waiting)

    def __repr__(self) -> str:
        return f"<WaitingRoom {len(self._seats)} seated, {len(self._waiting)} waiting>"
