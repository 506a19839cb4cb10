"""What ``ddsi echo`` and ``ddsi pub`` share: a participant, a topic of others, its type, and who is matched."""

from __future__ import annotations

import argparse
import sys
from collections.abc import AsyncIterator, Callable, Iterator, Sequence
from contextlib import asynccontextmanager, suppress
from pathlib import Path
from typing import Any

import trio

from ..config.secure import secure
from ..dcps import DataReader, DataWriter, DomainParticipant, Publisher, Subscriber
from ..structure.discovered import DiscoveredReaderData, DiscoveredWriterData
from ..structure.errors import BadParameter, DdsError, PreconditionNotMet
from ..structure.qos import EndpointQos, Qos
from ..structure.status import (
    InconsistentTopic,
    OfferedIncompatibleQos,
    PublicationMatched,
    RequestedIncompatibleQos,
    SampleLost,
    SecurityRefused,
    Status,
    SubscriptionMatched,
)
from ..trace.wording import count_text
from ..xtypes import Extensibility, type_support
from ..xtypes.idl_compiler import IdlError
from ..xtypes.idl_compiler.loading import load_file
from .arguments import add_domain, count, seconds
from .exit_status import CommandError
from .fitting_qos import common_partition
from .tables import shown

__all__ = ["TopicSession", "add_security", "add_topic_arguments", "load_type", "participant_qos"]

Peer = DiscoveredWriterData | DiscoveredReaderData

_PATIENCE_S = 3.0
"""After so long with nobody there, the command says that it waits."""
_SETTLING_S = 0.2
"""A participant's endpoints come in a burst; QoS is made to fit all of them."""


def add_topic_arguments(parser: argparse.ArgumentParser) -> None:
    """Those before the QoS: topic, domain, type, end, security."""
    parser.add_argument("topic", metavar="TOPIC", help="the topic's name")
    add_domain(parser)
    parser.add_argument(
        "--type",
        metavar="FILE.idl::NAME",
        help="its type, where nobody tells it; NAME as in module::Name, and not needed if FILE has one struct alone",
    )
    parser.add_argument(
        "--default-extensibility",
        type=Extensibility,
        choices=list(Extensibility),
        default=Extensibility.APPENDABLE,
        metavar="KIND",
        help="of types in FILE that say none: appendable (default, as in IDL 4.2), final or mutable",
    )
    parser.add_argument("-n", "--count", type=count, metavar="N", help="end after so many samples")
    parser.add_argument("--timeout", type=seconds, metavar="SECONDS", help="end after so long in all")
    add_security(parser)


def add_security(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "--secure",
        type=Path,
        metavar="DIR",
        help="with the identity and the rights in this folder, such as `ddsi keystore create` makes",
    )
    parser.add_argument(
        "--property",
        type=_property,
        action="append",
        default=[],
        metavar="NAME=VALUE",
        help="a property of the participant, such as dds.sec.log.log_file=FILE; repeatable",
    )


def participant_qos(arguments: argparse.Namespace, name: str) -> Qos:
    """That of a participant under the command's name, secured where that was asked for."""
    qos = Qos(entity_name=name, properties=dict(arguments.property))
    return secure(arguments.secure) | qos if arguments.secure else qos


def _property(text: str) -> tuple[str, str]:
    name, equals, value = text.partition("=")
    if not (name and equals):
        raise argparse.ArgumentTypeError(f"a property is NAME=VALUE, not {text!r}")
    return name, value


def load_type(text: str, default_extensibility: Extensibility) -> type[Any]:
    """The class of ``FILE.idl::module::Name``.  Raises CommandError or OSError."""
    filename, _, name = text.partition("::")
    try:
        namespace: Any = load_file(filename, include=(), defines={}, default_extensibility=default_extensibility)
    except IdlError as error:
        raise CommandError(str(error).partition("\n")[0]) from error
    types = dict(_types_of(namespace))
    if not name and len(types) == 1:
        return next(iter(types.values()))
    if name not in types:
        there = ", ".join(types) or "none"
        raise CommandError(f"{filename} has no struct {name!r}; there are {there}: say --type {filename}::NAME")
    return types[name]


def _types_of(namespace: Any) -> Iterator[tuple[str, type[Any]]]:
    """Every struct in an IDL file by its name there."""
    for name in namespace:
        member = getattr(namespace, name)
        if hasattr(member, "idl_warnings"):
            yield from _types_of(member)
        elif isinstance(member, type):
            with suppress(BadParameter):  # an enum or a union
                yield type_support(member).type_name, member


class TopicSession:
    """One run of such a command; ``seeks`` says of whom."""

    seeks = "writer"

    def __init__(self, arguments: argparse.Namespace, command: str) -> None:
        self.arguments = arguments
        self.command = command
        self.topic: str = arguments.topic
        self._loaded = load_type(arguments.type, arguments.default_extensibility) if arguments.type else None

    def notice(self, text: str) -> None:
        """A sentence on standard error."""
        print(f"{self.command}: {shown(self.topic)}: {text}", file=sys.stderr, flush=True)

    def participant(self) -> DomainParticipant:
        return DomainParticipant(self.arguments.domain, qos=participant_qos(self.arguments, self.command))

    # --- finding -----------------------------------------------------------------------------------------

    async def find_type(self, participant: DomainParticipant) -> type[Any]:
        """The type that was given, or else the one that others tell of; waited for as long as it takes."""
        if self._loaded is not None:
            return self._loaded
        async with self._patience(participant, "and is asked what it is made of"):
            try:
                return await participant.discover_type(self.topic, timeout=None)
            except PreconditionNotMet as error:
                raise CommandError(f"{error}. Give its type: --type FILE.idl::NAME") from error

    async def find_peers(
        self, participant: DomainParticipant, of: Callable[[], Sequence[Peer]], type_name: str, least: int
    ) -> list[EndpointQos]:
        """The QoS of the topic's writers or readers with this type's name; ``least`` of them are waited for.

        ``of`` is the participant's ``discovered_publications`` or ``discovered_subscriptions``.
        """

        def there() -> list[EndpointQos]:
            return [peer.qos for peer in of() if peer.topic_name == self.topic and peer.type_name == type_name]

        async with self._patience(participant, f"but a {self.seeks} of {shown(type_name)!r} is wanted"):
            while len(there()) < least:
                await participant.wait_for_discovery()
        await trio.sleep(_SETTLING_S)
        return there()

    @asynccontextmanager
    async def _patience(self, participant: DomainParticipant, otherwise: str) -> AsyncIterator[None]:
        """After a while without what is looked for, say so; ``otherwise`` is what to say of others that are there."""

        async def say() -> None:
            await trio.sleep(_PATIENCE_S)
            known: list[Peer] = [*participant.discovered_publications(), *participant.discovered_subscriptions()]
            others = [peer for peer in known if peer.topic_name == self.topic]
            there = f"{_described(others[0])} is there, {otherwise}" if others else "nobody is there yet"
            self.notice(f"{there}; waiting (Ctrl+C ends, `ddsi ls endpoints` shows what there is)")

        async with trio.open_nursery() as nursery:
            nursery.start_soon(say)
            yield
            nursery.cancel_scope.cancel()

    # --- watching ----------------------------------------------------------------------------------------

    async def watch_participant(self, participant: DomainParticipant) -> None:
        """Tell of whoever security keeps out altogether."""
        async for event in participant.events():
            if isinstance(event, SecurityRefused):
                self.notice(f"refused participant {event.remote}: {shown(event.reason)}")

    async def watch(self, entity: DataWriter[Any] | DataReader[Any]) -> None:
        """Tell of matches, and of whoever does not match."""
        async for event in entity.events():
            text = _event_text(event)
            if text:
                self.notice(text)

    async def follow_partitions(
        self,
        participant: DomainParticipant,
        group: Publisher | Subscriber,
        of: Callable[[], Sequence[Peer]],
        type_name: str,
    ) -> None:
        """Join the partitions of those who come later."""
        current = group.qos.partition
        while True:
            await participant.wait_for_discovery()
            peers = [peer.qos for peer in of() if peer.topic_name == self.topic and peer.type_name == type_name]
            partition = common_partition(peers)
            if peers and current is not None and set(partition.names) - set(current.names):
                try:
                    group.set_qos(Qos(partition=partition))
                except DdsError as error:
                    self.notice(str(error))
                current = partition


def _described(peer: Peer) -> str:
    kind = "writer" if isinstance(peer, DiscoveredWriterData) else "reader"
    return f"a {kind} of {shown(peer.type_name)!r}"


def _event_text(event: Status) -> str:
    match event:
        case PublicationMatched():
            return f"{count_text(event.current_count, 'reader')} matched"
        case SubscriptionMatched():
            return f"{count_text(event.current_count, 'writer')} matched"
        case OfferedIncompatibleQos():
            reasons = "; ".join(map(str, event.incompatibilities))
            return f"reader {event.last_subscription_handle} does not match: {shown(reasons)}"
        case RequestedIncompatibleQos():
            reasons = "; ".join(map(str, event.incompatibilities))
            return f"writer {event.last_publication_handle} does not match: {shown(reasons)}"
        case InconsistentTopic():
            between = f": {shown(event.reason)}" if event.reason else ""
            return f"somebody uses it for another type, {shown(event.remote_type_name)}{between}"
        case SampleLost():
            return f"{count_text(event.total_count_change, 'sample')} lost: {shown(event.reason)}"
        case SecurityRefused():
            return f"refused {event.remote}: {shown(event.reason)}"
        case _:
            return ""
