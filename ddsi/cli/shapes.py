"""``ddsi shapes``: the OMG's shapes demo in the terminal, with any vendor's shapes demo on the other side."""

from __future__ import annotations

import argparse
import random
from collections.abc import Awaitable, Callable
from pathlib import Path

import trio

from ..config.secure import secure
from ..dcps import DataReader, DataWriter, DomainParticipant, Publisher, Subscriber, Topic
from ..structure.errors import DdsTimeout
from ..structure.guid import Guid
from ..structure.qos import Qos
from ..structure.qos_policies import (
    BestEffort,
    DataRepresentation,
    DataRepresentationId,
    History,
    KeepAll,
    KeepLast,
    Partition,
    Reliable,
    TransientLocal,
    Volatile,
)
from ..structure.sample_info import InstanceState
from ..structure.status import (
    InconsistentTopic,
    OfferedIncompatibleQos,
    PublicationMatched,
    RequestedIncompatibleQos,
    SecurityRefused,
    Status,
    SubscriptionMatched,
)
from .arguments import add_domain, count, octets, rate, seconds
from .exit_status import CommandError, ExitStatus
from .runner import run as run_async
from .shape_display import FieldDisplay, LineDisplay, ShapeDisplay
from .shape_field import DrawnShape
from .shape_motion import MovingShape
from .shape_types import EXTENSIBILITIES, TOPICS, Shape, shape_form
from .terminal import is_terminal

__all__ = ["SUMMARY", "add_arguments", "run"]

SUMMARY = "publish or subscribe the shapes of the OMG's demo, drawn in the terminal"

_DEFAULT_COLOURS = ("BLUE",)
_ACKNOWLEDGMENT_S = 5.0
_BLOCKING_S = 10.0
_RATE_HZ = 20.0


def add_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("role", choices=("pub", "sub"), help="publish moving shapes, or subscribe and show them")
    add_domain(parser)
    parser.add_argument(
        "-t", "--topic", type=_names, metavar="NAMES", help=f"default: pub Square, sub {','.join(TOPICS)}"
    )
    parser.add_argument(
        "-c", "--colour", "--color", type=_names, metavar="NAMES", help="pub: default BLUE; sub: default all"
    )
    parser.add_argument(
        "-n",
        "--count",
        type=count,
        metavar="N",
        help="end after so many samples of each instance (pub) or in all (sub)",
    )
    parser.add_argument("--time", type=seconds, metavar="SECONDS", help="end after so long")
    parser.add_argument(
        "--rate", type=rate, default=_RATE_HZ, metavar="HZ", help=f"pub: samples a second (default: {_RATE_HZ:g})"
    )
    parser.add_argument("--size", type=count, default=30, metavar="N", help="pub: the shape's size (default: 30)")
    parser.add_argument(
        "--wait",
        type=count,
        metavar="N",
        help="pub: begin when so many readers are matched (with --time: at most so long)",
    )
    parser.add_argument("--at-end", choices=("dispose", "unregister"), help="pub: what becomes of the instances")
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
    qos = parser.add_argument_group("QoS")
    reliability = qos.add_mutually_exclusive_group()
    reliability.add_argument("-r", "--reliable", action="store_true", help="default for pub")
    reliability.add_argument(
        "-b", "--best-effort", action="store_true", help="default for sub, which so matches anybody"
    )
    qos.add_argument("--transient-local", action="store_true", help="late joiners get the history (sub: ask for it)")
    history = qos.add_mutually_exclusive_group()
    history.add_argument("--keep-last", type=count, metavar="N", help="samples of each instance (default: 1)")
    history.add_argument("--keep-all", action="store_true")
    qos.add_argument("-p", "--partition", type=_names, default=(), metavar="NAMES")
    qos.add_argument("-x", "--xcdr", type=int, choices=(1, 2), help="representation: default pub 1, sub both")
    types = parser.add_argument_group("type")
    types.add_argument(
        "--extensibility", choices=EXTENSIBILITIES, default="final", help="default: final, as the vendors' demos"
    )
    types.add_argument(
        "--payload", type=octets, metavar="OCTETS", help="the type of the OMG's suite, with so many octets more"
    )


def _names(text: str) -> tuple[str, ...]:
    return tuple(name for name in text.split(",") if name)


def _property(text: str) -> tuple[str, str]:
    name, equals, value = text.partition("=")
    if not (name and equals):
        raise argparse.ArgumentTypeError(f"a property is NAME=VALUE, not {text!r}")
    return name, value


def run(arguments: argparse.Namespace) -> int:
    publishes = arguments.role == "pub"
    topics = arguments.topic or (TOPICS[:1] if publishes else TOPICS)
    if len(set(topics)) < len(topics):
        raise CommandError("a topic is named twice")
    display: ShapeDisplay = LineDisplay()
    if is_terminal():
        doing = "publishes" if publishes else "subscribes to"
        display = FieldDisplay(f"ddsi shapes {doing} {', '.join(topics)} in domain {arguments.domain}", topics)
    role = _Publishing(arguments, topics, display) if publishes else _Subscribing(arguments, topics, display)
    return run_async(role.run)


class _Role:
    """What publishing and subscribing have in common: a participant, a display, an end."""

    kind = ""

    def __init__(self, arguments: argparse.Namespace, topics: tuple[str, ...], display: ShapeDisplay) -> None:
        self.arguments = arguments
        self.topics = topics
        self.display = display
        self.form = shape_form(arguments.extensibility, arguments.payload)

    async def run(self) -> int:
        status: int = ExitStatus.OK
        qos = Qos(entity_name=f"ddsi shapes {self.arguments.role}", properties=dict(self.arguments.property))
        if self.arguments.secure:
            qos = secure(self.arguments.secure) | qos
        try:
            async with DomainParticipant(self.arguments.domain, qos=qos) as participant, trio.open_nursery() as nursery:
                nursery.start_soon(self.display.paint)
                nursery.start_soon(self._watch_participant, participant)
                status = await self.play(participant, nursery)
                nursery.cancel_scope.cancel()
        finally:
            self.display.finish()
        return status

    async def play(self, participant: DomainParticipant, nursery: trio.Nursery) -> int:
        raise NotImplementedError

    @property
    def group_qos(self) -> Qos:
        return Qos(partition=Partition(*self.arguments.partition))

    def qos(self, *, reliable_by_default: bool) -> Qos:
        arguments = self.arguments
        is_reliable = arguments.reliable or (reliable_by_default and not arguments.best_effort)
        history: History = KeepAll() if arguments.keep_all else KeepLast(arguments.keep_last or 1)
        qos = Qos(
            reliability=Reliable(max_blocking_time=_BLOCKING_S) if is_reliable else BestEffort(),
            durability=TransientLocal() if arguments.transient_local else Volatile(),
            history=history,
        )
        if arguments.xcdr is not None:
            chosen = DataRepresentationId.XCDR2 if arguments.xcdr == 2 else DataRepresentationId.XCDR1
            qos |= Qos(data_representation=DataRepresentation(chosen))
        return qos

    async def _watch_participant(self, participant: DomainParticipant) -> None:
        """Tell of whoever security keeps out altogether."""
        async for event in participant.events():
            if isinstance(event, SecurityRefused):
                self.display.notice(f"refused participant {event.remote}: {event.reason}")

    async def watch(self, entity: DataWriter[Shape] | DataReader[Shape]) -> None:
        """Tell of matches, and of whoever does not match."""
        topic = entity.topic.name
        async for event in entity.events():
            self._tell(topic, event)

    def _tell(self, topic: str, event: Status) -> None:
        match event:
            case PublicationMatched():
                self.display.match(topic, "reader", event.current_count)
            case SubscriptionMatched():
                self.display.match(topic, "writer", event.current_count)
            case OfferedIncompatibleQos():
                self._tell_incompatible(topic, "reader", event.last_subscription_handle, event)
            case RequestedIncompatibleQos():
                self._tell_incompatible(topic, "writer", event.last_publication_handle, event)
            case InconsistentTopic():
                self.display.notice(f"{topic}: somebody uses it for another type, {event.remote_type_name}")
            case SecurityRefused():
                self.display.notice(f"{topic}: refused {event.remote}: {event.reason}")
            case _:
                pass  # Deadlines and the like are not set here.

    def _tell_incompatible(
        self, topic: str, kind: str, remote: Guid, event: OfferedIncompatibleQos | RequestedIncompatibleQos
    ) -> None:
        reasons = "; ".join(map(str, event.incompatibilities))
        self.display.notice(f"{topic}: {kind} {remote} does not match: {reasons}")


class _Publishing(_Role):
    """Writes every shape, moves it, waits, and so on."""

    async def play(self, participant: DomainParticipant, nursery: trio.Nursery) -> int:
        publisher = Publisher(participant, self.group_qos)
        qos = self.qos(reliable_by_default=True)
        writers = [DataWriter(publisher, Topic(participant, name, self.form.type), qos) for name in self.topics]
        for writer in writers:
            nursery.start_soon(self.watch, writer)
        with trio.move_on_after(self.arguments.time) if self.arguments.time else trio.CancelScope() as limit:
            if self.arguments.wait:
                for writer in writers:
                    await writer.wait_for_matched(self.arguments.wait)
            await self._write_all(writers)
        if limit.cancelled_caught and self.arguments.count:
            self.display.notice(f"not everything was written in {self.arguments.time:g} s")
            return ExitStatus.NOT_AS_HOPED
        return await self._finish(writers)

    async def _write_all(self, writers: list[DataWriter[Shape]]) -> None:
        chance = random.Random()
        colours = self.arguments.colour or _DEFAULT_COLOURS
        moving = [(writer, color, MovingShape(self.arguments.size, chance)) for writer in writers for color in colours]
        rounds = 0
        while self.arguments.count is None or rounds < self.arguments.count:
            for writer, color, shape in moving:
                await writer.write(self.form.sample(color, shape.x, shape.y, shape.size))
                self.display.show(DrawnShape(writer.topic.name, color, shape.x, shape.y, shape.size))
                shape.move()
            rounds += 1
            await trio.sleep(1 / self.arguments.rate)

    async def _finish(self, writers: list[DataWriter[Shape]]) -> int:
        ends: dict[str, Callable[[DataWriter[Shape], Shape], Awaitable[None]]] = {
            "dispose": DataWriter.dispose,
            "unregister": DataWriter.unregister,
        }
        for writer in writers:
            for color in self.arguments.colour or _DEFAULT_COLOURS:
                if self.arguments.at_end:
                    await ends[self.arguments.at_end](writer, self.form.sample(color, 0, 0, 0))
        try:
            for writer in writers:
                await writer.wait_for_acknowledgments(_ACKNOWLEDGMENT_S)
        except DdsTimeout as error:
            self.display.notice(str(error))
            return ExitStatus.NOT_AS_HOPED
        return ExitStatus.OK


class _Subscribing(_Role):
    """Shows whatever comes."""

    def __init__(self, arguments: argparse.Namespace, topics: tuple[str, ...], display: ShapeDisplay) -> None:
        super().__init__(arguments, topics, display)
        self._received = 0
        self._complete = trio.Event()

    async def play(self, participant: DomainParticipant, nursery: trio.Nursery) -> int:
        subscriber = Subscriber(participant, self.group_qos)
        qos = self.qos(reliable_by_default=False)
        for name in self.topics:
            reader = DataReader(subscriber, Topic(participant, name, self.form.type), qos)
            nursery.start_soon(self.watch, reader)
            nursery.start_soon(self._read, reader)
        with trio.move_on_after(self.arguments.time) if self.arguments.time else trio.CancelScope():
            await self._complete.wait()
        if self.arguments.count and not self._complete.is_set():
            self.display.notice(f"{self._received} of {self.arguments.count} samples came in {self.arguments.time:g} s")
            return ExitStatus.NOT_AS_HOPED
        return ExitStatus.OK

    async def _read(self, reader: DataReader[Shape]) -> None:
        topic = reader.topic.name
        async for sample in reader:
            shape = sample.data
            if self.arguments.colour and shape.color not in self.arguments.colour:
                continue
            if sample.info.valid_data:
                self.display.show(DrawnShape(topic, shape.color, shape.x, shape.y, shape.shapesize))
                self._received += 1
                if self.arguments.count and self._received >= self.arguments.count:
                    self._complete.set()
                    return
            elif sample.info.instance_state == InstanceState.NOT_ALIVE_DISPOSED:
                self.display.remove(topic, shape.color, "disposed")
            else:
                self.display.remove(topic, shape.color, "no writers")
