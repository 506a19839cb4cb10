"""Network: hosts, datagrams between them, and virtual time.

It stands where sockets, the kernel and the wire stand in a real run: datagrams of UDP, unicast and multicast, that
may be lost, come twice, late, or in another order (RTPS 2.5 §9.1 promises no more).  Everything that is to happen
lies in one heap, and equal times are served in the order in which they were asked for, so a seed decides everything.

Time moves only in :meth:`Network.run_until`, from one event to the next: a quiet hour costs nothing.
"""

from __future__ import annotations

import heapq
from collections import Counter
from collections.abc import Callable, Collection, Sequence

from ..structure.guid import GuidPrefix
from ..structure.locator import Locator
from ..trace.events import LinkDelayed, LinkDropped, LinkDuplicated
from ..trace.sink import TraceSink
from .dice import Dice
from .link import GOOD_WEATHER, SAME_HOST, LinkConditions

__all__ = ["Network", "Port", "SimulationStuck"]

_MAX_EVENTS_AT_ONE_INSTANT = 200_000

Host = bytes
"""A host is named by the 16 octets of its address, as in a Locator."""


class SimulationStuck(AssertionError):
    """Events beget events and time does not move: two machines talk to each other without end."""


class Port:
    """An open socket: where datagrams for one locator come out.  ``owner`` is the participant that holds it."""

    __slots__ = ("locator", "owner", "receive")

    def __init__(self, locator: Locator, owner: GuidPrefix, receive: Callable[[bytes, Locator], None]) -> None:
        self.locator = locator
        self.owner = owner
        self.receive = receive


class Network:
    """One network with its clock.  ``now`` is in seconds and begins at 0.

    ``delivered``, ``sent`` and ``dropped`` (by reason) count datagrams; one that is sent to several destinations, or
    to a group of several members, counts once for each.  ``watch`` is shown every message that is sent, once.
    ``loses`` is asked of every datagram on its way from one participant to another, and may take it away.
    """

    def __init__(
        self, dice: Dice, conditions: LinkConditions = GOOD_WEATHER, *, trace: TraceSink | None = None
    ) -> None:
        self.now = 0.0
        self.conditions = conditions
        self.sent = 0
        self.delivered = 0
        self.dropped: Counter[str] = Counter()
        self.watch: Callable[[GuidPrefix, bytes], None] | None = None
        self.loses: Callable[[GuidPrefix, GuidPrefix, bytes], bool] = lambda sender, receiver, octets: False
        self._dice = dice
        self._trace = trace
        self._events: list[tuple[float, int, Callable[[], None]]] = []
        self._order = 0
        self._ports: dict[Locator, Port] = {}
        self._groups: dict[Locator, dict[Locator, Port]] = {}
        self._links: dict[tuple[Host, Host], LinkConditions] = {}
        self._sides: dict[Host, int] = {}  # of a partition; empty: the network is whole
        self._unplugged: dict[Host, None] = {}
        self._last_arrival: dict[tuple[Host, Host], float] = {}

    # --- ports -------------------------------------------------------------------------------------------

    def open(self, port: Port, groups: Sequence[Locator] = ()) -> None:
        """Listen at the port's locator, and to these multicast groups."""
        assert port.locator not in self._ports, f"{port.locator} is taken"
        self._ports[port.locator] = port
        for group in groups:
            self._groups.setdefault(group, {})[port.locator] = port

    def close(self, locator: Locator) -> None:
        del self._ports[locator]
        for members in self._groups.values():
            members.pop(locator, None)

    # --- the weather -------------------------------------------------------------------------------------

    def set_link(self, source: Host, destination: Host, conditions: LinkConditions) -> None:
        """Other conditions than the general ones, in this direction only."""
        self._links[(source, destination)] = conditions

    def partition(self, *sides: Collection[Host]) -> None:
        """Cut the network: only hosts of one side reach each other.  A host that is named nowhere is a side of its own
        with all others that are not named."""
        self._sides = {host: number for number, side in enumerate(sides, 1) for host in side}

    def heal(self) -> None:
        """End every partition and plug every host in."""
        self._sides = {}
        self._unplugged = {}

    def unplug(self, host: Host) -> None:
        """A blackout of one host: nothing goes in or out.  Its own processes still reach each other."""
        self._unplugged[host] = None

    def plug(self, host: Host) -> None:
        self._unplugged.pop(host, None)

    def _is_cut(self, source: Host, destination: Host) -> bool:
        if source == destination:
            return False
        if source in self._unplugged or destination in self._unplugged:
            return True
        return self._sides.get(source, 0) != self._sides.get(destination, 0)

    def link(self, source: Host, destination: Host) -> LinkConditions:
        """The conditions that hold from one host to another."""
        conditions = self._links.get((source, destination))
        if conditions is not None:
            return conditions
        return SAME_HOST if source == destination else self.conditions

    # --- datagrams ---------------------------------------------------------------------------------------

    def send(self, source: Port, destinations: Sequence[Locator], octets: bytes) -> None:
        """One datagram to each destination; a group is all its members but the sender."""
        if self.watch is not None:
            self.watch(source.owner, octets)
        for destination in destinations:
            if destination.is_multicast:
                for locator, member in list(self._groups.get(destination, {}).items()):
                    if locator != source.locator:
                        self._send(source, destination, member, octets)
                continue
            port = self._ports.get(destination)
            if port is None:  # nobody listens: an ICMP message that no participant would see
                self.sent += 1
                self.dropped["closed"] += 1
            else:
                self._send(source, destination, port, octets)

    def _send(self, source: Port, destination: Locator, target: Port, octets: bytes) -> None:
        self.sent += 1
        from_host, to_host = source.locator.address, target.locator.address
        link = self.link(from_host, to_host)
        if self._is_cut(from_host, to_host):
            self._drop(source, destination, target, octets, "partition")
        elif len(octets) > link.mtu:
            self._drop(source, destination, target, octets, "mtu")
        elif self._dice.chance(link.loss) or self.loses(source.owner, target.owner, octets):
            self._drop(source, destination, target, octets, "loss")
        else:
            copies = 2 if self._dice.chance(link.duplication) else 1
            if copies > 1 and self._trace is not None:
                owner, receiver = source.owner, target.owner
                self._trace(LinkDuplicated(self.now, owner, destination, octets, copies, receiver))
            for _ in range(copies):
                self._forward(source, destination, target, octets, link)

    def _forward(self, source: Port, destination: Locator, target: Port, octets: bytes, link: LinkConditions) -> None:
        pair = (source.locator.address, target.locator.address)
        arrival = max(
            self.now + self._dice.between(link.delay, link.delay + link.jitter), self._last_arrival.get(pair, 0.0)
        )
        if self._dice.chance(link.reordering):
            late = self._dice.between(0.0, link.reordering_delay)
            if self._trace is not None:
                self._trace(LinkDelayed(self.now, source.owner, destination, octets, late, target.owner))
            arrival += late
        else:
            self._last_arrival[pair] = arrival
        self.at(arrival, lambda: self._arrive(source.locator, target, octets))

    def _arrive(self, source: Locator, target: Port, octets: bytes) -> None:
        if self._ports.get(target.locator) is not target:
            self.dropped["closed"] += 1
            return
        self.delivered += 1
        target.receive(octets, source)

    def _drop(self, source: Port, destination: Locator, target: Port, octets: bytes, reason: str) -> None:
        self.dropped[reason] += 1
        if self._trace is not None:
            self._trace(LinkDropped(self.now, source.owner, destination, octets, reason, target.owner))

    # --- time --------------------------------------------------------------------------------------------

    def at(self, when: float, action: Callable[[], None]) -> None:
        """Do this then (or now, if that is past)."""
        self._order += 1
        heapq.heappush(self._events, (max(when, self.now), self._order, action))

    def run_until(self, deadline: float, until: Callable[[], bool] | None = None) -> bool:
        """Let everything happen up to ``deadline`` (inclusive), or until the condition holds; returns whether it does.

        The condition is looked at after each event.  Raises SimulationStuck if time does not move any more.
        """
        events = self._events
        at_this_instant = 0
        if until is not None and until():
            return True
        while events and events[0][0] <= deadline:
            when, _, action = heapq.heappop(events)
            at_this_instant = at_this_instant + 1 if when == self.now else 0
            if at_this_instant > _MAX_EVENTS_AT_ONE_INSTANT:
                raise SimulationStuck(f"more than {_MAX_EVENTS_AT_ONE_INSTANT} events at {self.now} s")
            self.now = when
            action()
            if until is not None and until():
                return True
        self.now = max(self.now, deadline)
        return until is None
