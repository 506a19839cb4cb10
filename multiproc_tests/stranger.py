"""A stranger who points at a victim: ``python -m multiproc_tests.stranger SOURCE VICTIM TARGET PORT DOMAIN``.

From the address SOURCE it sends announcements that name VICTIM, and whatever else an engine might answer, to
TARGET:PORT, and says how much: ``SENT announcements octets``.
"""

from __future__ import annotations

import socket
import sys
import time

from ddsi.discovery.builtin_endpoints import ANNOUNCED_ENDPOINTS
from ddsi.discovery.parameters import encode_participant
from ddsi.messages.acknack import AckNack
from ddsi.messages.data import Data
from ddsi.messages.header import Header
from ddsi.messages.heartbeat import Heartbeat
from ddsi.structure import builtin_entity_ids as ids
from ddsi.structure.discovered import DiscoveredParticipantData
from ddsi.structure.guid import EntityId, Guid, GuidPrefix
from ddsi.structure.locator import Locator
from ddsi.structure.sequence_number import NumberSet
from ddsi.structure.vendor import PROTOCOL_VERSION

VENDOR = b"\1\x55"
PARTICIPANTS = 20
REPETITIONS = 5


def announcement(prefix: GuidPrefix, victim: str, domain: int) -> bytes:
    locators = (Locator.udp_v4(victim, 7410), Locator.udp_v4(victim, 7411))
    data = DiscoveredParticipantData(
        guid=Guid.of(prefix, EntityId.PARTICIPANT),
        vendor_id=VENDOR,
        domain_id=domain,
        metatraffic_unicast=locators[:1],
        default_unicast=locators[1:],
        builtin_endpoints=ANNOUNCED_ENDPOINTS
        | ids.BuiltinEndpoints.PARTICIPANT_STATELESS_MESSAGE_WRITER
        | ids.BuiltinEndpoints.PARTICIPANT_STATELESS_MESSAGE_READER,
        lease_duration=60.0,
    )
    return Data(ids.SPDP_READER, ids.SPDP_WRITER, 1, None, encode_participant(data)).encode()


def questions(count: int) -> bytes:
    """HEARTBEATs of its builtin writers, requests of its builtin readers, and a message of security."""
    beats = (
        Heartbeat(EntityId.UNKNOWN, writer, 1, 100, count).encode()
        for writer in (ids.SEDP_PUBLICATIONS_WRITER, ids.SEDP_SUBSCRIPTIONS_WRITER, ids.PARTICIPANT_MESSAGE_WRITER)
    )
    asks = (
        AckNack(reader, writer, NumberSet(1, 32, (1 << 32) - 1), count).encode()
        for reader, writer in (
            (ids.SEDP_PUBLICATIONS_READER, ids.SEDP_PUBLICATIONS_WRITER),
            (ids.SEDP_SUBSCRIPTIONS_READER, ids.SEDP_SUBSCRIPTIONS_WRITER),
        )
    )
    message = Data(
        ids.PARTICIPANT_STATELESS_MESSAGE_READER, ids.PARTICIPANT_STATELESS_MESSAGE_WRITER, count, None,
        b"\0\1\0\0" + bytes(400),
    )  # fmt: skip
    return b"".join((*beats, *asks, message.encode()))


def main(source: str, victim: str, target: str, port: str, domain: str) -> None:
    out = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    out.bind((source, 0))
    sent = 0
    for count in range(1, REPETITIONS + 1):
        for number in range(PARTICIPANTS):
            prefix = GuidPrefix(VENDOR + number.to_bytes(10, "big"))
            header = Header(PROTOCOL_VERSION, VENDOR, prefix).encode()
            for said in (announcement(prefix, victim, int(domain)), questions(count)):
                sent += out.sendto(header + said, (target, int(port)))
        time.sleep(0.2)
    print("SENT", PARTICIPANTS * REPETITIONS, sent, flush=True)


if __name__ == "__main__":
    main(*sys.argv[1:])
