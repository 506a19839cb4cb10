"""Node: one simulated participant: an engine, its place on the network, and its wake-ups.

It does for its engine what the transport does in a real run: gives it datagrams, timeouts and the application's
calls, and acts on every effect at once.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable
from dataclasses import dataclass, field
from typing import cast

from ..behavior.content_filter import CompileFilter, Evaluate
from ..config import Config
from ..engine import (
    Compute,
    DataAvailable,
    DiscoveryChanged,
    MatchRefused,
    Participant,
    ParticipantSetup,
    SendDatagram,
    StatusChanged,
    WriterProgress,
)
from ..spi import SecurityHooks, load_hooks
from ..structure.discovered import ContentFilterProperty
from ..structure.guid import Guid, GuidPrefix
from ..structure.locator import Locator
from ..structure.qos import Qos, reader_qos, writer_qos
from ..structure.qos_policies import Properties
from ..structure.status import Status
from ..trace.events import Remark
from ..trace.sink import TraceSink
from ..xtypes.type_object import TypeDescription
from .dice import Dice
from .endpoints import SIMULATED_KEYS, BookKeeper, NodeReader, NodeWriter
from .groups import NodePublisher, NodeSubscriber
from .network import Network, Port
from .vendor_hooks import VendorHooks
from .vendors import Vendor

__all__ = ["Node", "NodeSetup"]

_WALL_CLOCK_AT_START = 1_700_000_000 * 1_000_000_000  # nanoseconds since 1970


@dataclass(frozen=True, slots=True, kw_only=True)
class NodeSetup:
    """Where a node stands and how it announces itself.  ``address``: its host, IPv4.  ``peers``: hosts to call by
    unicast.  ``clock_error``: seconds that its wall clock is wrong by.  ``properties``: those of its QoS; security is
    loaded by them, as in a participant with sockets, unless ``make_hooks`` makes other hooks.
    ``vendor``: whose stack it plays."""

    name: str
    address: str
    domain_id: int = 0
    participant_index: int = 0
    config: Config = field(default_factory=Config)
    multicast: bool = True
    peers: tuple[str, ...] = ()
    max_message_octets: int = 1452
    clock_error: float = 0.0
    properties: Properties = field(default_factory=dict)
    make_hooks: Callable[[], SecurityHooks] | None = None
    vendor: Vendor | None = None

    def meets(self, other: NodeSetup) -> bool:
        """Are both in one domain, under one tag?"""
        return (self.domain_id, self.config.domain_tag) == (other.domain_id, other.config.domain_tag)


class Node:
    """A participant that can be killed, closed and started again.  ``engine`` is the present one."""

    engine: Participant

    def __init__(self, setup: NodeSetup, network: Network, dice: Dice, trace: TraceSink | None) -> None:
        self.setup = setup
        self.name = setup.name
        self.network = network
        self.writers: list[NodeWriter] = []
        self.readers: list[NodeReader] = []
        self.statuses: list[tuple[float, Guid, Status]] = []
        self.discovery_changes = 0
        self.timeout_count = 0
        self.is_up = False
        self.played: VendorHooks | None = None  # the vendor's habits, where it plays one
        self._dice = dice
        self._trace = trace
        self._wake_at = math.inf
        self.start()

    def __repr__(self) -> str:
        return f"<Node {self.name} at {self.setup.address}, {'up' if self.is_up else 'down'}>"

    @property
    def now(self) -> float:
        return self.network.now

    @property
    def guid(self) -> Guid:
        return self.engine.guid

    @property
    def host(self) -> bytes:
        """Its host's address, as the network wants it."""
        return self.port.locator.address

    # --- a participant's life ----------------------------------------------------------------------------

    def start(self, prefix: GuidPrefix | None = None) -> None:
        """Come up, under a GUID that nobody had before, or under a given one."""
        assert not self.is_up
        setup = self.setup
        config = setup.config if setup.vendor is None else setup.vendor.config(setup.config)
        ports, domain_id, index = setup.config.ports, setup.domain_id, setup.participant_index
        metatraffic = Locator.udp_v4(setup.address, ports.metatraffic_unicast(domain_id, index))
        user = Locator.udp_v4(setup.address, ports.user_unicast(domain_id, index))
        group = Locator.udp_v4(setup.config.multicast_address, ports.metatraffic_multicast(domain_id))
        groups = (group,) if setup.multicast else ()
        prefix = prefix or GuidPrefix(config.vendor_id + self._dice.octets(10))
        self.engine = engine = Participant(
            ParticipantSetup(
                domain_id=domain_id,
                guid_prefix=prefix,
                config=config,
                metatraffic_unicast=(metatraffic,),
                metatraffic_multicast=groups,
                default_unicast=(user,),
                announce_to=(*groups, *self._peer_locators()),
                max_message_octets=setup.max_message_octets,
                entity_name=setup.name,
                properties=setup.properties,
            ),
            random=self._dice.fork_random(),
            wall_clock=self._wall_clock,
            hooks=self._make_hooks(),
            trace=self._trace,
        )
        if self.played is not None:
            self.played.joined(engine)
        engine.recorder = self._books = BookKeeper(engine, self._trace)
        prefix = engine.guid.prefix  # security may have adjusted it
        self.port = Port(metatraffic, prefix, self._receive)
        self._user_port = Port(user, prefix, self._receive)
        self.network.open(self.port, groups)
        self.network.open(self._user_port)
        self.is_up = True
        self._wake_at = math.inf
        engine.start(self.now)
        self.pump()

    def kill(self) -> None:
        """Gone without a goodbye, as a process that crashes."""
        self.remark("is killed")
        self._go_down()

    def close(self) -> None:
        """Leave with a goodbye."""
        self.engine.close(self.now)
        self.pump()
        self._go_down()

    def restart(self, *, goodbye: bool = False) -> None:
        """Go, with or without goodbye, and come back at once, as another participant without endpoints."""
        if self.is_up:
            self.close() if goodbye else self.kill()
        self.remark("starts again")
        self.start()

    def _go_down(self) -> None:
        self.is_up = False
        self._wake_at = math.inf
        for writer in self.writers:
            writer.is_deleted = True
        for reader in self.readers:
            reader.is_deleted = True
        self.network.close(self.port.locator)
        self.network.close(self._user_port.locator)

    def remark(self, text: str) -> None:
        """A line in the trace."""
        if self._trace is not None:
            self._trace(Remark(self.now, self.guid.prefix, f"{self.name} {text}"))

    # --- endpoints ---------------------------------------------------------------------------------------

    def writer(
        self,
        topic: str = "Square",
        qos: Qos = Qos(),
        *,
        keyed: bool = False,
        filters: bool = False,
        type_name: str = "T",
        compile_filter: CompileFilter | None = None,
        publisher: NodePublisher | None = None,
        types: TypeDescription | None = None,
    ) -> NodeWriter:
        """``filters``: each change has a destination.  ``compile_filter``: it evaluates readers' content filters.

        ``types``: what is announced of the type; the octets that are written are of none.
        """
        local = self.engine.create_writer(
            topic, type_name, writer_qos(qos), self.now, is_keyed=keyed, filters=filters, compile_filter=compile_filter,
            group=publisher.group if publisher is not None else None, types=types,
        )  # fmt: skip
        writer = NodeWriter(self, local)
        self.writers.append(writer)
        self.pump()
        return writer

    def reader(
        self,
        topic: str = "Square",
        qos: Qos = Qos(),
        *,
        keyed: bool = False,
        takes: bool = True,
        uses_filter: bool = False,
        type_name: str = "T",
        content_filter: tuple[ContentFilterProperty, Evaluate] | None = None,
        subscriber: NodeSubscriber | None = None,
        types: TypeDescription | None = None,
    ) -> NodeReader:
        keys = SIMULATED_KEYS if keyed else None
        group = subscriber.group if subscriber is not None else None
        local = self.engine.create_reader(
            topic, type_name, reader_qos(qos), self.now, is_keyed=keyed, keys=keys, uses_filter=uses_filter,
            content_filter=content_filter, group=group, types=types,
        )  # fmt: skip
        reader = NodeReader(self, local, self._books.books[local.guid], takes=takes)
        self.readers.append(reader)
        self.pump()
        return reader

    def publisher(self) -> NodePublisher:
        return NodePublisher(self)

    def subscriber(self) -> NodeSubscriber:
        return NodeSubscriber(self)

    def live_writers(self) -> list[NodeWriter]:
        return [writer for writer in self.writers if not writer.is_deleted]

    def live_readers(self) -> list[NodeReader]:
        return [reader for reader in self.readers if not reader.is_deleted]

    # --- driving the engine --------------------------------------------------------------------------------

    def pump(self) -> None:
        """Act on all that the engine wants done, and arrange to be woken when it wants to be."""
        while effects := self.engine.drain_effects():
            for effect in effects:
                match effect:
                    case SendDatagram(destinations=destinations, parts=parts):
                        self.network.send(self.port, destinations, b"".join(parts))
                    case StatusChanged(entity, status):
                        self.statuses.append((self.now, entity, status))
                    case DataAvailable(guid):
                        self._take(guid)
                    case Compute(job, computed):
                        computed(job(), self.now)
                    case DiscoveryChanged():
                        self.discovery_changes += 1
                    case WriterProgress():
                        pass  # nobody waits: a write that finds no room is refused
                    case MatchRefused():
                        pass  # the trace tells it
        self._arm()

    def statuses_of(self, kind: type[Status]) -> list[Status]:
        """The statuses of one kind so far, of all endpoints, oldest first."""
        return [status for _, _, status in self.statuses if isinstance(status, kind)]

    def _take(self, guid: Guid) -> None:
        for reader in self.readers:
            if reader.guid == guid and reader.takes and not reader.is_deleted:
                reader.history.seen()
                reader.taken.extend(reader.history.take())
                self.engine.samples_taken(reader.local, self.now)

    def _receive(self, octets: bytes, source: Locator) -> None:
        heard = octets if self.played is None else self.played.understood(octets)
        # As from a socket: into a buffer that holds something else soon, of which nobody may keep a part.
        buffer = bytearray(heard)
        self.engine.receive_datagram(memoryview(buffer), source, self.now)
        buffer[:] = b"\xdd" * len(buffer)
        self.pump()

    def _arm(self) -> None:
        deadline = self.engine.next_deadline()
        if deadline < self._wake_at:
            self._wake_at = deadline
            engine = self.engine
            self.network.at(deadline, lambda: self._wake(engine, deadline))

    def _wake(self, engine: Participant, at: float) -> None:
        """Only the earliest wake-up counts; those that were overtaken by an earlier one find nothing to do."""
        if engine is not self.engine or not self.is_up or at != self._wake_at:
            return
        self._wake_at = math.inf
        if engine.next_deadline() <= self.now:
            self.timeout_count += 1
            engine.handle_timeout(self.now)
        self.pump()

    def _wall_clock(self) -> int:
        return _WALL_CLOCK_AT_START + int((self.now + self.setup.clock_error) * 1e9)

    def _make_hooks(self) -> SecurityHooks:
        setup = self.setup
        if setup.make_hooks is not None:
            hooks = setup.make_hooks()
        else:
            hooks = load_hooks(setup.properties, entropy=self._dice.octets, wall_clock=self._wall_clock)
        if setup.vendor is None:
            return hooks
        self.played = VendorHooks(hooks, setup.vendor.quirks)
        return cast(SecurityHooks, self.played)  # what it does not name itself, it passes on

    def _peer_locators(self) -> Iterable[Locator]:
        """Each peer's host at every index that a participant there may have taken."""
        config, domain_id = self.setup.config, self.setup.domain_id
        for address in self.setup.peers:
            for index in range(config.max_auto_participant_index + 1):
                yield Locator.udp_v4(address, config.ports.metatraffic_unicast(domain_id, index))
