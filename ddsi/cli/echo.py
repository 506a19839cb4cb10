"""``ddsi echo``: what is written to a topic, printed as it comes, whatever its type.

The type is that which the topic's writers tell of (DDS-XTypes 1.3 §7.6.3.3), and the reader requests what they offer.
"""

from __future__ import annotations

import argparse
import json
from typing import Any

import trio

from ..dcps import DataReader, DomainParticipant, Sample, Subscriber, Topic
from ..structure.qos import Qos
from ..structure.sample_info import InstanceState
from ..xtypes import type_support
from ..xtypes.model import StructType
from .arguments import add_json
from .exit_status import ExitStatus
from .fitting_qos import common_partition, requested_of
from .runner import run as run_async
from .sample_text import sample_lines
from .terminal import terminal_width
from .topic_session import TopicSession, add_topic_arguments
from .value_forms import Form, form_of

__all__ = ["SUMMARY", "add_arguments", "run"]

SUMMARY = "print the samples of a topic, of whatever type, as they come"

_STATES = {
    InstanceState.ALIVE: "alive",
    InstanceState.NOT_ALIVE_DISPOSED: "disposed",
    InstanceState.NOT_ALIVE_NO_WRITERS: "no writers",
}


def add_arguments(parser: argparse.ArgumentParser) -> None:
    add_topic_arguments(parser)
    add_json(parser)
    parser.add_argument("--whole", action="store_true", help="also the rest of long lists and texts")


def run(arguments: argparse.Namespace) -> int:
    return run_async(_Echo(arguments).run)


class _Echo(TopicSession):
    def __init__(self, arguments: argparse.Namespace) -> None:
        super().__init__(arguments, "ddsi echo")
        self._received = 0

    async def run(self) -> int:
        timeout, wanted = self.arguments.timeout, self.arguments.count
        async with self.participant() as participant:
            with trio.move_on_after(timeout) if timeout else trio.CancelScope():
                async with trio.open_nursery() as nursery:
                    nursery.start_soon(self.watch_participant, participant)
                    await self._print_samples(participant, nursery)
                    nursery.cancel_scope.cancel()
        if self._received < (wanted or 1):
            came = f"{self._received} of {wanted} samples" if wanted else "nothing"
            self.notice(f"{came} came in {timeout:g} s")
            return ExitStatus.NOT_AS_HOPED
        return ExitStatus.OK

    async def _print_samples(self, participant: DomainParticipant, nursery: trio.Nursery) -> None:
        type_ = await self.find_type(participant)
        support = type_support(type_)
        writers = participant.discovered_publications
        peers = await self.find_peers(participant, writers, support.type_name, 1)
        subscriber = Subscriber(participant, Qos(partition=common_partition(peers)))
        reader = DataReader(subscriber, Topic(participant, self.topic, type_), requested_of(peers))
        nursery.start_soon(self.watch, reader)
        nursery.start_soon(self.follow_partitions, participant, subscriber, writers, support.type_name)
        async for sample in reader:
            self._print(support.struct, sample)
            self._received += 1
            if self._received == self.arguments.count:
                return

    def _print(self, struct: StructType, sample: Sample[Any]) -> None:
        state = _STATES[sample.info.instance_state if not sample.info.valid_data else InstanceState.ALIVE]
        form: dict[str, Form] = form_of(struct, sample.data)
        if not sample.info.valid_data:  # all but the key is defaults
            form = {member.name_in_idl: form[member.name_in_idl] for member in struct.members if member.is_key}
        if self.arguments.json:
            print(json.dumps(_json(sample, state, form)), flush=True)
            return
        head = "" if sample.info.valid_data else f"{state}: "
        lines = sample_lines(form, terminal_width() - len(head), whole=self.arguments.whole)
        is_block = len(lines) > 1
        print("\n".join([head + lines[0], *lines[1:], *(["---"] if is_block else [])]), flush=True)


def _json(sample: Sample[Any], state: str, form: dict[str, Form]) -> dict[str, object]:
    return {
        "data" if sample.info.valid_data else "key": form,
        "state": state,
        "writer": str(sample.info.publication_handle),
        "source_timestamp": float(sample.info.source_timestamp),
    }
