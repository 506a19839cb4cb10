"""Our own witness: says of the builtin topics who is there, who writes, who reads, and who has gone.

Options as those of ``ddsi_shapes``; the role, which the command line wants, does not matter.  It ends when something
comes on standard input.
"""

from __future__ import annotations

import sys
from collections.abc import Callable
from typing import Any

import trio

import ddsi

from .ddsi_shapes import participant_qos, wait_for_input
from .protocol import parse_arguments, say


async def tell(what: str, reader: ddsi.BuiltinTopicReader[Any], name_of: Callable[[Any], str]) -> None:
    """One line for each sample: what became of which entity, and what security says of it."""
    async for sample in reader:
        security = sample.data.security
        who = security.subject_name if security.is_authenticated else "UNAUTHENTICATED"
        is_participant = isinstance(security, ddsi.ParticipantSecurity)
        is_protected = security.is_rtps_protected if is_participant else security.is_payload_protected
        way = "PROTECTED" if is_protected else "CLEAR"
        say(what, sample.info.instance_state.name, name_of(sample.data), way, who)


async def main() -> None:
    o = parse_arguments()
    async with (
        ddsi.DomainParticipant(o.domain, qos=participant_qos(o)) as participant,
        trio.open_nursery() as nursery,
    ):
        participants = ddsi.BuiltinTopicReader(participant, ddsi.ParticipantBuiltinTopicData)
        publications = ddsi.BuiltinTopicReader(participant, ddsi.PublicationBuiltinTopicData)
        subscriptions = ddsi.BuiltinTopicReader(participant, ddsi.SubscriptionBuiltinTopicData)
        nursery.start_soon(tell, "PARTICIPANT", participants, lambda data: data.vendor_name)
        nursery.start_soon(tell, "PUBLICATION", publications, lambda data: data.topic_name)
        nursery.start_soon(tell, "SUBSCRIPTION", subscriptions, lambda data: data.topic_name)
        say("GUID", participant.guid.hex())
        await wait_for_input()
        nursery.cancel_scope.cancel()


if __name__ == "__main__":
    sys.exit(trio.run(main))
