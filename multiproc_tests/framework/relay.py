"""A relay that joins network namespaces and lets the weather at their packets; no kernel support (netem) is needed.

Each namespace gets a tap device.  A thread of ours reads the frames of all of them, asks the :class:`.weather.Link`
between the two ends what becomes of each, and writes it to the other end when its time has come.  It is a switch with
fixed addresses: end number N (from 1) has 10.78.0.N and 02:00:00:00:00:NN, and knows those of the others, so that no
ARP is needed.  Only UDP over IPv4 is exposed to the weather; what little else there is (IGMP) passes undisturbed, so
that it uses up no decisions.
"""

from __future__ import annotations

import heapq
import itertools
import os
import selectors
import threading
import time
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager, suppress
from dataclasses import dataclass

from .namespace import Namespace, bare_namespace
from .tap import open_tap
from .weather import CALM, Link, Weather

__all__ = ["Relay", "is_udp_frame", "relayed_namespaces"]

MAX_FRAME_OCTETS = 1 << 16
MAX_FRAMES_ON_THE_WAY = 200_000
"""Frames that are delayed at one time; what exceeds this is dropped and counted as overflowed."""

MAX_FRAMES_PER_TURN = 64
"""Frames read from one end before the others have their turn."""

_REASSEMBLY_OCTETS = 128 << 20
# Linux keeps an incomplete datagram for 30 s, and has 4 MiB for all of them, which is 78 of 41 KB: after so many,
# nothing that comes in fragments is received until the first are 30 s old.  A test of how losses are repaired would
# then be one of how long that takes.


@dataclass(frozen=True, slots=True)
class _End:
    namespace: Namespace
    name: str
    mac: bytes
    device: int


class Relay:
    """The switch between the ends, and the weather on each link.

    ``links`` holds one Link for each ordered pair of names, ``links["a", "b"]`` for what a sends to b.
    ``unreachable`` counts copies that an end did not take because its interface was down, ``dropped`` the packets that
    :meth:`drop` was told of.
    """

    def __init__(self, ends: list[_End], *, weather: Weather, seed: int) -> None:
        now = time.monotonic()
        self.seed = seed
        self.unreachable = 0
        self.dropped = 0
        self._wanted: dict[bytes, int] = {}
        self.links = {
            (a.name, b.name): Link(a.name, b.name, weather=weather, seed=seed, now=now)
            for a, b in itertools.permutations(ends, 2)
        }
        self._ends = ends
        self._end_by_mac = {end.mac: end for end in ends}
        self._on_the_way: list[tuple[float, int, _End, bytes]] = []
        self._order = itertools.count()
        self._lock = threading.Lock()
        self._is_closing = False
        self._failure: BaseException | None = None
        self._wake_reading, self._wake_writing = os.pipe()
        self._thread = threading.Thread(target=self._run, name="relay", daemon=True)

    # --- what a test does ----------------------------------------------------------------------------------

    def set_weather(self, weather: Weather, source: str | None = None, destination: str | None = None) -> None:
        """Changes the weather on all links, or on those from ``source``, or to ``destination``, or the one of both."""
        now = time.monotonic()
        with self._lock:
            for link in self._chosen(source, destination):
                link.set_weather(weather, now=now)

    def cut(self, source: str | None = None, destination: str | None = None) -> None:
        """Lets nothing pass, on the links chosen as for ``set_weather``, until :meth:`heal`."""
        with self._lock:
            for link in self._chosen(source, destination):
                link.is_cut = True

    def heal(self, source: str | None = None, destination: str | None = None) -> None:
        with self._lock:
            for link in self._chosen(source, destination):
                link.is_cut = False

    def drop(self, octets: bytes, count: int = 1) -> None:
        """Loses the next ``count`` packets that hold these octets, on whatever link, before the weather sees them."""
        with self._lock:
            self._wanted[octets] = count

    def report(self) -> str:
        """The seed, and one line of counters for each link."""
        with self._lock:
            lines = [f"{link.name}: {link.counters}" for link in self.links.values()]
        head = f"relay, seed {self.seed}, unreachable={self.unreachable} dropped={self.dropped}"
        return "\n".join([head, *lines])

    def _chosen(self, source: str | None, destination: str | None) -> list[Link]:
        chosen = [
            link
            for (a, b), link in self.links.items()
            if (source is None or a == source) and (destination is None or b == destination)
        ]
        if not chosen:
            raise KeyError(f"no link from {source!r} to {destination!r}; there are {sorted(self.links)}")
        return chosen

    # --- the thread ----------------------------------------------------------------------------------------

    def start(self) -> None:
        self._thread.start()

    def close(self) -> None:
        """Stops forwarding and raises what went wrong in the thread, if anything did."""
        self._is_closing = True
        os.write(self._wake_writing, b"x")
        self._thread.join()
        os.close(self._wake_reading)
        os.close(self._wake_writing)
        if self._failure is not None:
            raise RuntimeError("the relay's thread failed") from self._failure

    def _run(self) -> None:
        try:
            with selectors.DefaultSelector() as selector:
                selector.register(self._wake_reading, selectors.EVENT_READ, None)
                for end in self._ends:
                    selector.register(end.device, selectors.EVENT_READ, end)
                while not self._is_closing:
                    for key, _ in selector.select(self._seconds_until_next()):
                        if key.data is not None:
                            self._read(key.data)
                    self._deliver_due()
        except BaseException as error:  # kept for close(), which runs in the test's thread
            self._failure = error

    def _seconds_until_next(self) -> float | None:
        return max(0.0, self._on_the_way[0][0] - time.monotonic()) if self._on_the_way else None

    def _read(self, source: _End) -> None:
        for _ in range(MAX_FRAMES_PER_TURN):
            try:
                frame = os.read(source.device, MAX_FRAME_OCTETS)
            except BlockingIOError:
                return
            except OSError:  # EIO: the interface is down
                return
            target = self._end_by_mac.get(frame[:6])
            for end in [target] if target else self._ends:
                if end is not source:
                    self._forward(frame, source, end)

    def _forward(self, frame: bytes, source: _End, destination: _End) -> None:
        now = time.monotonic()
        if not is_udp_frame(frame):
            self._write(destination, frame)
            return
        link = self.links[source.name, destination.name]
        with self._lock:
            if self._is_wanted(frame):
                return
            arrivals = link.fate(len(frame), now)
        for arrival in arrivals:
            if arrival <= now and not self._on_the_way:
                self._write(destination, frame)
            elif len(self._on_the_way) < MAX_FRAMES_ON_THE_WAY:
                heapq.heappush(self._on_the_way, (arrival, next(self._order), destination, frame))
            else:
                link.counters.overflowed += 1

    def _is_wanted(self, frame: bytes) -> bool:
        for octets, count in self._wanted.items():
            if count and octets in frame:
                self._wanted[octets] = count - 1
                self.dropped += 1
                return True
        return False

    def _deliver_due(self) -> None:
        now = time.monotonic()
        while self._on_the_way and self._on_the_way[0][0] <= now:
            _, _, destination, frame = heapq.heappop(self._on_the_way)
            self._write(destination, frame)

    def _write(self, destination: _End, frame: bytes) -> None:
        try:
            os.write(destination.device, frame)
        except OSError:  # EIO: the interface is down
            self.unreachable += 1


def is_udp_frame(frame: bytes) -> bool:
    """Does this Ethernet frame hold UDP over IPv4, or a fragment of it?"""
    return len(frame) > 23 and frame[12:14] == b"\x08\x00" and frame[23] == 17


@contextmanager
def relayed_namespaces(
    *names: str, weather: Weather = CALM, seed: int = 0, mtu: int = 1500
) -> Iterator[tuple[dict[str, Namespace], Relay]]:
    """Namespaces by name, at most 99, each with an interface ``tap0`` to the others through a relay.

    Interface and relay are gone at the end.  The relay's counters stay readable.
    """
    if not 2 <= len(set(names)) == len(names) <= 99:
        raise ValueError(f"a relay joins 2 to 99 namespaces with different names, not {names!r}")
    with ExitStack() as stack:
        ends = [_make_end(stack, name, number, mtu) for number, name in enumerate(names, start=1)]
        for end in ends:
            others = {other.namespace.address: _mac_text(other.mac) for other in ends if other is not end}
            end.namespace.neighbours = others
            end.namespace.interface_up()
        relay = Relay(ends, weather=weather, seed=seed)
        relay.start()
        stack.callback(relay.close)
        yield {end.name: end.namespace for end in ends}, relay


def _make_end(stack: ExitStack, name: str, number: int, mtu: int) -> _End:
    made = stack.enter_context(bare_namespace())
    made.interface, made.address, made.network_octets = "tap0", f"10.78.0.{number}", 24
    made.ip("link", "set", "lo", "up")
    # IPv6 would send router solicitations and the like over the relay.  Where the setting is read-only, it does.
    made.set_sysctl("net.ipv6.conf.all.disable_ipv6", "1")
    made.set_sysctl("net.ipv6.conf.default.disable_ipv6", "1")
    made.set_sysctl("net.ipv4.ipfrag_high_thresh", str(_REASSEMBLY_OCTETS))
    mac = bytes((2, 0, 0, 0, 0, number))
    device = open_tap(made, "tap0", _mac_text(mac))
    stack.callback(_close_quietly, device)
    made.ip("link", "set", "tap0", "mtu", str(mtu))
    return _End(made, name, mac, device)


def _mac_text(mac: bytes) -> str:
    return ":".join(f"{octet:02x}" for octet in mac)


def _close_quietly(device: int) -> None:
    with suppress(OSError):
        os.close(device)
