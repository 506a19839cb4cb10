"""Coherent sets and group order on the wire: what we say, and what we understand.  RTPS 2.5 §8.7.5, §8.7.6, §9.6.4."""

from __future__ import annotations

from dataclasses import dataclass, field

import pytest

from ddsi.discovery.endpoint_parameters import decode_writer, encode_writer
from ddsi.messages.data import Data
from ddsi.messages.gap import Gap
from ddsi.messages.header import Header
from ddsi.messages.heartbeat import Heartbeat, HeartbeatGroupInfo
from ddsi.messages.raw_submessage import SubmessageKind, iterate_submessages
from ddsi.serialization.parameter_id import ParameterId as P
from ddsi.serialization.parameter_list import ParameterList
from ddsi.simulation import Domain, LinkConditions, NodeReader, NodeWriter
from ddsi.simulation.endpoints import payload_of
from ddsi.structure.guid import EntityId, EntityKind
from ddsi.structure.qos import Qos
from ddsi.structure.qos_policies import AccessScope, BestEffort, KeepAll, Presentation, Reliable
from ddsi.structure.sequence_number import NumberSet
from ddsi.structure.status import SampleLost
from ddsi.structure.vendor import PROTOCOL_VERSION
from tests.engine.xor_security import XorSecurity

TOPIC, GROUP = AccessScope.TOPIC, AccessScope.GROUP
UNKNOWN = "ffffffff00000000"


def number(value: int) -> str:
    """A SequenceNumber in hexadecimal, little-endian: high, then low."""
    return bytes(4).hex() + value.to_bytes(4, "little").hex()


@dataclass
class Overheard:
    """What user endpoints say, in order: of each DATA its number and inline QoS; HEARTBEATs of the group."""

    data: list[tuple[int, dict[P, str]]] = field(default_factory=list)
    group_sns: list[int] = field(default_factory=list)
    writers: list[NodeWriter] = field(default_factory=list)
    infos: list[HeartbeatGroupInfo] = field(default_factory=list)

    def __call__(self, sender: bytes, octets: bytes) -> None:
        for raw in iterate_submessages(octets):
            if raw.kind == SubmessageKind.DATA:
                said = Data.decode(raw.flags, raw.body)
                if not said.writer_id.is_builtin:
                    parameters = said.inline_qos or ParameterList(little_endian=True)
                    self.data.append((said.writer_sn, {P(pid): bytes(value).hex() for pid, value in parameters}))
            elif raw.kind == SubmessageKind.HEARTBEAT:
                heartbeat = Heartbeat.decode(raw.flags, raw.body)
                if heartbeat.group_info is not None:
                    self.group_sns.append(heartbeat.group_info.current_gsn)
                    self.infos.append(heartbeat.group_info)


def overheard(policy: Presentation) -> Overheard:
    """Of two writers A and B of a publisher: A, then a set of A, B, A, then B."""
    domain = Domain()
    qos = Qos(presentation=policy, reliability=Reliable(), history=KeepAll())
    here, there = domain.node(), domain.node()
    publisher = here.publisher()
    a, b = (here.writer(topic, qos, publisher=publisher) for topic in "ab")
    subscriber = there.subscriber()
    for topic in "ab":
        there.reader(topic, qos, subscriber=subscriber)
    assert domain.run_until(domain.all_matched, 10)
    domain.run(1)
    heard = Overheard()
    domain.network.watch = heard
    a.write()
    with publisher.coherent_changes():
        for writer in (a, b, a):
            writer.write()
    b.write()
    domain.run(1)
    heard.writers = [a, b]
    return heard


def test_without_coherent_access_nothing_is_said() -> None:
    heard = overheard(Presentation(TOPIC, ordered_access=True))
    assert [(sn, said) for sn, said in heard.data if said] == []
    assert heard.group_sns == []


def test_a_change_says_where_its_writers_part_of_the_set_begins_and_the_end_says_that_it_is_none() -> None:
    heard = overheard(Presentation(TOPIC, coherent_access=True))
    expected: list[tuple[int, dict[P, str]]] = [
        (1, {}),
        (2, {P.COHERENT_SET: number(2)}),
        (3, {P.COHERENT_SET: number(2)}),
        (4, {P.COHERENT_SET: UNKNOWN}),
        (1, {P.COHERENT_SET: number(1)}),
        (2, {P.COHERENT_SET: UNKNOWN}),
        (3, {}),
    ]
    assert sorted(map(repr, heard.data)) == sorted(map(repr, expected))


def test_with_group_scope_changes_are_numbered_over_all_writers() -> None:
    heard = overheard(Presentation(GROUP, coherent_access=True))
    said = [parameters for _, parameters in heard.data]
    digests = {parameters.pop(P.WRITER_GROUP_INFO) for parameters in said if P.WRITER_GROUP_INFO in parameters}
    assert len(digests) == 1
    assert len(digests.pop()) == 8
    expected = [
        {P.GROUP_SEQ_NUM: number(1)},
        {P.COHERENT_SET: number(2), P.GROUP_COHERENT_SET: number(2), P.GROUP_SEQ_NUM: number(2)},
        {P.COHERENT_SET: number(2), P.GROUP_COHERENT_SET: number(2), P.GROUP_SEQ_NUM: number(4)},
        {P.COHERENT_SET: UNKNOWN, P.GROUP_COHERENT_SET: number(2), P.GROUP_SEQ_NUM: number(5)},
        {P.COHERENT_SET: number(1), P.GROUP_COHERENT_SET: number(2), P.GROUP_SEQ_NUM: number(3)},
        {P.COHERENT_SET: UNKNOWN, P.GROUP_COHERENT_SET: number(2), P.GROUP_SEQ_NUM: number(5)},
        {P.GROUP_SEQ_NUM: number(6)},
    ]
    assert sorted(map(repr, said)) == sorted(repr(dict(sorted(row.items(), key=_as_sent))) for row in expected)
    assert max(heard.group_sns) == 6


def test_a_heartbeat_says_which_number_its_writer_wrote_last_also_where_all_have_it() -> None:
    """RTPS 2.5 §8.3.8.6: who is matched later learns whether it missed something of the open set."""
    heard = overheard(Presentation(GROUP, coherent_access=True))
    assert all(info.first_gsn - 1 <= info.last_gsn <= info.current_gsn for info in heard.infos)
    a, b = heard.writers
    assert [writer.local.group_info(4, 3).last_gsn for writer in (a, b)] == [5, 6]  # type: ignore[union-attr]


def _as_sent(entry: tuple[P, str]) -> int:
    return (P.COHERENT_SET, P.GROUP_COHERENT_SET, P.GROUP_SEQ_NUM).index(entry[0])


def test_with_group_scope_endpoints_announce_their_group() -> None:
    domain = Domain()
    here = domain.node()
    for scope, is_said in ((TOPIC, False), (GROUP, True)):
        writer = here.writer("t", Qos(presentation=Presentation(scope)), publisher=here.publisher())
        announced = decode_writer(encode_writer(writer.local.data), b"\x01\xdd")
        assert (announced.group_entity_id != EntityId.UNKNOWN) is is_said
        assert not is_said or announced.group_entity_id.kind == EntityKind.WRITER_GROUP
        assert announced.group_entity_id == writer.local.data.group_entity_id


# --- what others say -------------------------------------------------------------------------------------


class Spoken:
    """A best-effort pair; what the writer says is made up here, and its reader shows what it makes of it."""

    def __init__(self, *, coherent: bool = True) -> None:
        domain = Domain()
        offered = Qos(presentation=Presentation(GROUP, True, True), reliability=BestEffort())
        wanted = Presentation(TOPIC, coherent_access=coherent)
        self.writer: NodeWriter = domain.node().writer("t", offered)
        self.node = domain.node()
        self.reader: NodeReader = self.node.reader("t", Qos(presentation=wanted, history=KeepAll()))
        assert domain.run_until(domain.all_matched, 10)
        domain.run(1)

    def hear(self, submessage: bytes) -> None:
        header = Header(PROTOCOL_VERSION, b"\x01\xdd", self.writer.guid.prefix).encode()
        source = self.writer.node.port.locator
        self.node.engine.receive_datagram(bytearray(header + submessage), source, self.node.now)
        self.node.pump()

    def data(
        self, sn: int, *parameters: tuple[int, bytes], has_sample: bool = True, little_endian: bool = True
    ) -> None:
        inline = ParameterList(little_endian=little_endian)
        for pid, value in parameters:
            inline.add(pid, value)
        payload = payload_of(self.writer.guid, sn, 8) if has_sample else b""
        data = Data(EntityId.UNKNOWN, self.writer.guid.entity_id, sn, inline if parameters else None, payload)
        self.hear(data.encode(little_endian=little_endian))

    def seen(self) -> list[int]:
        return [change.sequence_number for _, change in self.reader.taken]


def set_sn(value: int, byteorder: str = "little") -> tuple[int, bytes]:
    high = value >> 32
    octets = high.to_bytes(4, byteorder, signed=True) + (value & 0xFFFFFFFF).to_bytes(4, byteorder)  # type: ignore[arg-type]
    return P.COHERENT_SET, octets


NOBODYS = set_sn(-1 << 32)


@pytest.mark.parametrize(
    ("parameters", "has_sample", "expected"),
    [
        ((NOBODYS,), False, [1, 2]),
        ((set_sn(1),), False, [1, 2]),
        ((), True, [1, 2, 3]),
        ((NOBODYS,), True, [1, 2, 3]),
        ((set_sn(3),), True, [1, 2]),
        (((P.GROUP_COHERENT_SET, set_sn(1)[1]),), False, [1, 2]),
    ],
)
def test_every_way_to_end_a_set_is_understood(
    parameters: tuple[tuple[int, bytes], ...], has_sample: bool, expected: list[int]
) -> None:
    spoken = Spoken()
    spoken.data(1, set_sn(1))
    spoken.data(2, set_sn(1))
    assert spoken.seen() == []
    spoken.data(3, *parameters, has_sample=has_sample)
    assert spoken.seen() == expected


def test_the_other_byte_order_is_understood() -> None:
    spoken = Spoken()
    spoken.data(1, set_sn(1, "big"), little_endian=False)
    assert spoken.seen() == []
    spoken.data(2, set_sn(-1 << 32, "big"), has_sample=False, little_endian=False)
    assert spoken.seen() == [1]


@pytest.mark.parametrize("value", [0, -5, 1 << 62, (1 << 63) - 1])
def test_a_set_under_an_impossible_number_is_none(value: int) -> None:
    spoken = Spoken()
    spoken.data(1, set_sn(value))
    assert spoken.seen() == [1]


def test_values_that_are_too_short_are_none() -> None:
    spoken = Spoken()
    spoken.data(1, (P.COHERENT_SET, bytes(4)))
    assert spoken.seen() == [1]


def test_what_was_filtered_out_of_a_set_is_not_missing() -> None:
    filtered = (P.STATUS_INFO, b"\0\0\0\4")
    spoken = Spoken()
    spoken.data(1, set_sn(1))
    spoken.data(2, set_sn(1), filtered, has_sample=False)
    gap = Gap(EntityId.UNKNOWN, spoken.writer.guid.entity_id, 3, NumberSet(4), filtered_count=1)
    spoken.hear(gap.encode())
    spoken.data(4, set_sn(1))
    spoken.data(5)
    assert spoken.seen() == [1, 4, 5]


def test_a_gap_within_a_set_tells_at_once_that_it_is_lost() -> None:
    """Its end may be among what will not come, and the writer silent from then on."""
    spoken = Spoken()
    spoken.data(1, set_sn(1))
    gap = Gap(EntityId.UNKNOWN, spoken.writer.guid.entity_id, 2, NumberSet(4))
    spoken.hear(gap.encode())
    lost = [status.total_count for status in spoken.node.statuses_of(SampleLost) if isinstance(status, SampleLost)]
    assert lost == [1]


def test_who_does_not_ask_sees_samples_at_once_and_no_ends() -> None:
    spoken = Spoken(coherent=False)
    spoken.data(1, set_sn(1))
    assert spoken.seen() == [1]
    spoken.data(2, NOBODYS, has_sample=False)
    assert spoken.seen() == [1]
    spoken.data(3)
    assert spoken.seen() == [1, 3]


# --- protected -------------------------------------------------------------------------------------------


@pytest.mark.parametrize("topic", ["SecretOfTheDay", "Open"])
@pytest.mark.parametrize("seed", range(4))
def test_sets_are_seen_whole_among_secured_participants(topic: str, seed: int) -> None:
    """What ends a set has no payload to protect, and is protected all the same."""
    domain = Domain(seed, conditions=LinkConditions(loss=0.2, reordering=0.2))
    here, there = (domain.node(make_hooks=XorSecurity) for _ in range(2))
    qos = Qos(reliability=Reliable(), history=KeepAll(), presentation=Presentation(GROUP, True, True))
    publisher, subscriber = here.publisher(), there.subscriber()
    writers = [here.writer(topic + name, qos, publisher=publisher) for name in "ab"]
    readers = [there.reader(topic + name, qos, takes=False, subscriber=subscriber) for name in "ab"]
    assert domain.run_until(domain.all_matched, 60)
    with publisher.coherent_changes():
        for writer in writers:
            writer.write()
        domain.run(2)
        assert [len(reader.history) for reader in readers] == [0, 0]
        for writer in writers:
            writer.write(5000)
    assert domain.run_until(lambda: all(reader.history.has_news for reader in readers), 30)
    assert [len(reader.history) for reader in readers] == [2, 2]
