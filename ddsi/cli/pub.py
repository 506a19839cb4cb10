"""``ddsi pub``: write to a topic of others, whatever its type; values as fields or as JSON.

The type is that which the topic's endpoints tell of (DDS-XTypes 1.3 §7.6.3.3), and the writer offers what its readers
request.
"""

from __future__ import annotations

import argparse
from typing import Any

import trio

from ..dcps import DataWriter, DomainParticipant, Publisher, Topic
from ..structure.errors import DdsTimeout
from ..structure.qos import Qos
from ..trace.wording import count_text
from ..xtypes import type_support
from .arguments import octets, rate
from .exit_status import CommandError, ExitStatus
from .fitting_qos import common_partition, offered_to
from .runner import run as run_async
from .topic_session import TopicSession, add_topic_arguments
from .typed_values import typed_form
from .value_forms import value_of

__all__ = ["IS_INTERMIXED", "SUMMARY", "add_arguments", "run"]

SUMMARY = "write samples to a topic, of whatever type"
IS_INTERMIXED = True
"""Options may stand between topic and values."""

_ACKNOWLEDGMENT_S = 5.0


def add_arguments(parser: argparse.ArgumentParser) -> None:
    add_topic_arguments(parser)
    parser.add_argument(
        "values",
        nargs="*",
        metavar="VALUE",
        help="field=value, with paths such as pose.points[2].x, or JSON in braces; what is not said has its default",
    )
    parser.add_argument(
        "--rate", type=rate, metavar="HZ", help="so many a second, until --count or Ctrl+C (default: one in all)"
    )
    parser.add_argument(
        "--wait", type=octets, default=1, metavar="N", help="begin when so many readers are matched (default: 1)"
    )
    parser.add_argument("--at-end", choices=("dispose", "unregister"), help="what becomes of the instance")


def run(arguments: argparse.Namespace) -> int:
    return run_async(_Publication(arguments).run)


class _Publication(TopicSession):
    seeks = "reader"

    def __init__(self, arguments: argparse.Namespace) -> None:
        super().__init__(arguments, "ddsi pub")
        self._form = typed_form(arguments.values)
        self._count = arguments.count or (None if arguments.rate else 1)
        self._written = 0
        self._is_done = False
        if self._loaded is not None:
            self._sample(self._loaded)  # mistakes are told before anybody is waited for

    def _sample(self, type_: type[Any]) -> Any:
        """The sample, checked.  BadParameter with the member's path."""
        support = type_support(type_)
        sample = value_of(support.struct, self._form)
        support.serializer(support.representations[0])(sample)
        return sample

    async def run(self) -> int:
        timeout = self.arguments.timeout
        async with self.participant() as participant:
            with trio.move_on_after(timeout) if timeout else trio.CancelScope():
                async with trio.open_nursery() as nursery:
                    nursery.start_soon(self.watch_participant, participant)
                    await self._publish(participant, nursery)
                    nursery.cancel_scope.cancel()
        if self._is_done or (self._count is None and self._written):
            return ExitStatus.OK
        self.notice(f"{count_text(self._written, 'sample')} written in {timeout:g} s")
        return ExitStatus.NOT_AS_HOPED

    async def _publish(self, participant: DomainParticipant, nursery: trio.Nursery) -> None:
        type_ = await self.find_type(participant)
        support = type_support(type_)
        sample = self._sample(type_)
        readers = participant.discovered_subscriptions
        peers = await self.find_peers(participant, readers, support.type_name, self.arguments.wait)
        publisher = Publisher(participant, Qos(partition=common_partition(peers)))
        qos = offered_to(peers, support.representations)
        writer = DataWriter(publisher, Topic(participant, self.topic, type_), qos)
        nursery.start_soon(self.watch, writer)
        nursery.start_soon(self.follow_partitions, participant, publisher, readers, support.type_name)
        if self.arguments.wait:
            await writer.wait_for_matched(self.arguments.wait)
        await self._write(writer, sample)
        if self.arguments.at_end == "dispose":
            await writer.dispose(sample)
        elif self.arguments.at_end == "unregister":
            await writer.unregister(sample)
        try:
            await writer.wait_for_acknowledgments(_ACKNOWLEDGMENT_S)
        except DdsTimeout as error:
            raise CommandError(str(error)) from error
        self._is_done = True

    async def _write(self, writer: DataWriter[Any], sample: Any) -> None:
        while True:
            await writer.write(sample)
            self._written += 1
            if self._written == self._count:
                return
            if self.arguments.rate:
                await trio.sleep(1 / self.arguments.rate)
