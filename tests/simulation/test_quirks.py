"""Each quirk does what it says, and a participant of ours gets along with it; security apart (tests/security)."""

from __future__ import annotations

import pytest

from ddsi.config import Config
from ddsi.messages.acknack import AckNack
from ddsi.messages.data import Data
from ddsi.messages.data_frag import DataFrag
from ddsi.messages.gap import Gap
from ddsi.messages.heartbeat import Heartbeat
from ddsi.messages.raw_submessage import SubmessageKind, iterate_submessages
from ddsi.messages.submessages import Submessage
from ddsi.serialization.parameter_id import ParameterId
from ddsi.serialization.parameter_list import ParameterList
from ddsi.simulation import VENDORS, Domain, LinkConditions, Node, NodeReader, NodeWriter, Vendor, invariants
from ddsi.simulation import quirks as q
from ddsi.simulation.scenario import Scenario
from ddsi.simulation.vendors import CYCLONE_DDS, DUST_DDS, FAST_DDS, OPENDDS, RTI_CONNEXT, RUST_DDS
from ddsi.spi import PLAINTEXT, Overhead
from ddsi.spi.plaintext import Plaintext
from ddsi.structure.cache_change import ChangeKind
from ddsi.structure.guid import EntityId, Guid, GuidPrefix
from ddsi.structure.qos import Qos
from ddsi.structure.qos_policies import KeepAll, KeepLast, Reliable, TransientLocal
from ddsi.structure.sequence_number import NumberSet
from ddsi.structure.vendor import OUR_VENDOR_ID, VENDOR_NAMES
from ddsi.trace.reasons import DropReason

RELIABLE = Qos(reliability=Reliable(), history=KeepAll())
KEPT = RELIABLE | Qos(durability=TransientLocal())
ROUGH = LinkConditions(loss=0.15, duplication=0.05, reordering=0.1, jitter=0.001)
WRITER_ID, READER_ID = EntityId(b"\0\0\1\2"), EntityId(b"\0\0\1\7")
WRITER = Guid.of(GuidPrefix(b"\1\3" + bytes(10)), WRITER_ID)
READER = Guid.of(GuidPrefix(b"\1\xdd" + bytes(10)), READER_ID)


class Protecting(Plaintext):
    """Hooks that say that they protect payloads."""

    def overhead(self, sender: Guid, receivers: tuple[Guid, ...]) -> Overhead:
        return Overhead(payload=44)


def said(quirk: q.Quirk, submessage: Submessage) -> Submessage | None:
    return quirk.say(WRITER, (READER,), submessage)


def acknack(base: int, *members: int, count: int = 1) -> AckNack:
    return AckNack(READER_ID, WRITER_ID, NumberSet.of(base, members), count)


def fragment(payload: bytes) -> DataFrag:
    return DataFrag(READER_ID, WRITER_ID, 1, 1, 1, 1000, 5000, None, payload)


# --- one by one -----------------------------------------------------------------------------------------------------


def test_what_have_you_has_base_zero_and_a_request_keeps_its_own() -> None:
    quirk = q.AckNackFromZero(PLAINTEXT)
    assert said(quirk, acknack(1)) == acknack(0)
    for other in (acknack(1, 1), acknack(2)):
        assert said(quirk, other) is other


def test_what_have_you_has_count_zero() -> None:
    quirk = q.AckNackCountZero(PLAINTEXT)
    assert said(quirk, acknack(1, count=7)) == acknack(1, count=0)
    for other in (acknack(1, 1, count=7), acknack(2, count=7), AckNack(READER_ID, WRITER_ID, NumberSet(1), 7, True)):
        assert said(quirk, other) is other


def test_a_gap_is_said_when_it_is_asked_for_again() -> None:
    quirk, gap = q.GapWhenAsked(PLAINTEXT), Gap(READER_ID, WRITER_ID, 3, NumberSet(5))
    assert said(quirk, gap) is None
    assert said(quirk, gap) is gap
    assert said(quirk, Gap(READER_ID, WRITER_ID, 6, NumberSet(7))) is None


def test_an_instance_ends_without_a_payload() -> None:
    quirk = q.DisposeByKeyHash(PLAINTEXT)
    inline = ParameterList([(ParameterId.KEY_HASH, bytes(16)), (ParameterId.STATUS_INFO, b"\0\0\0\1")])
    end = Data(READER_ID, WRITER_ID, 2, inline, b"\0\1\0\0key!", is_key=True)
    assert said(quirk, end) == Data(READER_ID, WRITER_ID, 2, inline)
    sample = Data(READER_ID, WRITER_ID, 1, None, b"\0\1\0\0data")
    assert said(quirk, sample) is sample


def test_a_payload_is_called_non_standard_where_it_is_protected() -> None:
    sample = Data(READER_ID, WRITER_ID, 1, None, b"\0\1\0\0data")
    assert said(q.NonStandardPayload(PLAINTEXT), sample) is sample
    for submessage in (sample, fragment(bytes(1000))):
        flagged = said(q.NonStandardPayload(Protecting()), submessage)
        assert isinstance(flagged, Data | DataFrag)
        assert flagged.non_standard_payload
    heartbeat = Heartbeat(READER_ID, WRITER_ID, 1, 1, 1)
    assert said(q.NonStandardPayload(Protecting()), heartbeat) is heartbeat


@pytest.mark.parametrize(
    ("quirk", "submessage", "is_heard"),
    [
        (q.DropsCountZero, acknack(1, count=0), False),
        (q.DropsCountZero, acknack(1, count=1), True),
        (q.DropsCountZero, Heartbeat(READER_ID, WRITER_ID, 1, 1, 0), False),
        (q.OpensAfterJoining, fragment(bytes(1000 + 40)), False),  # a run that was protected by itself
        (q.OpensAfterJoining, fragment(bytes(1000 + 3)), True),  # one that was padded
    ],
)
def test_what_is_not_understood(quirk: type[q.Quirk], submessage: Submessage, is_heard: bool) -> None:
    assert quirk(PLAINTEXT).hear(READER[:12], submessage) is is_heard


def test_base_zero_is_understood_from_those_who_are_known_for_it() -> None:
    domain = Domain(1)
    cyclone, *others = [domain.node(vendor=vendor) for vendor in (CYCLONE_DDS, FAST_DDS, RTI_CONNEXT, DUST_DDS, None)]
    assert domain.run_until(domain.are_introduced, 5)
    quirk = q.RefusesAckNackFromZero(PLAINTEXT)
    quirk.engine = cyclone.engine
    assert [quirk.hear(node.guid[:12], acknack(0)) for node in others] == [True, True, False, False]
    assert all(quirk.hear(node.guid[:12], acknack(1)) for node in others)
    assert not quirk.hear(bytes(12), acknack(0)), "nobody knows who that is"


def _octets(text: str) -> bytes:
    return bytes.fromhex(text)


HEADER = b"RTPS\2\4\1\3" + bytes(12)
SIGNED = _octets(
    "3101 0400 01010101"  # SEC_PREFIX
    "0701 0400 02020202"  # the submessage
    "3201 0400 03030303"  # SEC_POSTFIX
)


def test_the_headers_of_an_envelope_turn_round_and_nothing_in_it() -> None:
    quirk = q.BigEndianEnvelopes(PLAINTEXT)
    assert quirk.wrap(WRITER, (READER,), SIGNED) == _octets("3100 0004 01010101 0701 0400 02020202 3200 0004 03030303")
    body = _octets("3101 0400 01010101 3001 0800 0202020202020202 3201 0400 03030303")
    assert quirk.wrap(WRITER, (READER,), body) == _octets(
        "3100 0004 01010101 3000 0008 0202020202020202 3200 0004 03030303"
    )


def test_an_envelope_in_a_signed_message_stays_as_it_was_signed() -> None:
    """What is signed holds an envelope, with an encrypted submessage in it."""
    inner = _octets("0c01 0400 09090909 3101 0400 01010101 3001 0400 02020202 3201 0400 03030303")
    message = HEADER + _octets("3301 0400 01010101") + inner + _octets("3401 0400 03030303")
    turned = HEADER + _octets("3300 0004 01010101") + inner + _octets("3400 0004 03030303")
    assert q.BigEndianEnvelopes(PLAINTEXT).finish(message) == turned
    in_clear = HEADER + SIGNED
    assert q.BigEndianEnvelopes(PLAINTEXT).finish(in_clear) is in_clear


def test_the_last_postfix_has_no_length() -> None:
    quirk = q.LengthlessPostfix(PLAINTEXT)
    assert quirk.finish(HEADER + SIGNED) == HEADER + SIGNED[:-8] + _octets("3201 0000 03030303")
    followed = HEADER + SIGNED + _octets("0701 0400 02020202")
    assert quirk.finish(followed) is followed


def test_a_submessage_of_the_vendors_own_ends_the_message() -> None:
    quirk = q.VendorSubmessageBehind(PLAINTEXT)
    own = _octets("8001 3c00") + bytes(60)
    assert quirk.finish(HEADER + SIGNED) == HEADER + SIGNED + own
    open_end = HEADER + SIGNED[:-6] + bytes(2) + SIGNED[-4:]  # the postfix reaches to the end, wherever that is
    assert quirk.finish(open_end) == HEADER + SIGNED + own


# --- in a domain ----------------------------------------------------------------------------------------------------


def both_ways(domain: Domain, first: Node, second: Node) -> list[tuple[NodeWriter, NodeReader]]:
    """Each writes small samples and one of more than 64 KiB, ends an instance, and the other has all of it."""
    pairs = []
    for sender, receiver in ((first, second), (second, first)):
        pairs.append((sender.writer("Square", KEPT, keyed=True), receiver.reader("Square", KEPT, keyed=True)))
    for number in range(12):
        for writer, _ in pairs:
            writer.write(70_000 if number == 7 else 40, key=number % 3)
        domain.run(0.01)
    for writer, reader in pairs:
        writer.end(ChangeKind.NOT_ALIVE_DISPOSED, key=1)
        assert domain.run_until(lambda w=writer, r=reader: r.session(w.guid).numbers == [*range(1, 14)], 30)  # type: ignore[misc]
    return pairs


def rest(domain: Domain) -> None:
    """Everything is settled, nobody asks in vain, and no invariant is broken."""
    assert domain.run_until(domain.all_matched, 10)
    domain.run(1)
    assert domain.run_until(lambda: invariants.is_at_rest(domain), 30)
    assert invariants.at_rest(domain) == []
    assert invariants.quiet(domain, 30) == []


@pytest.mark.parametrize("seed", range(4))
@pytest.mark.parametrize("vendor", VENDORS, ids=lambda vendor: vendor.name)
def test_reliable_samples_arrive_both_ways(vendor: Vendor, seed: int) -> None:
    domain = Domain(seed, conditions=ROUGH)
    ours, other = domain.node(), domain.node(vendor=vendor)
    both_ways(domain, ours, other)
    rest(domain)
    assert other.engine.config.vendor_id == vendor.vendor_id == other.guid[:2]
    assert ours.engine.participants[other.guid.prefix].vendor_id == vendor.vendor_id
    assert other.played is not None
    for quirk in vendor.quirks:
        if quirk in (q.DropsCountZero, q.RefusesAckNackFromZero, q.OpensAfterJoining):
            assert other.played.acts[quirk] == 0, "we say nothing that this vendor does not understand"
        elif quirk in (q.AckNackCountZero, q.AckNackFromZero, q.DisposeByKeyHash, q.VendorSubmessageBehind):
            assert other.played.acts[quirk] > 0


@pytest.mark.parametrize("seed", range(3))
@pytest.mark.parametrize(
    "quirk",
    [quirk for name in q.__all__ if (quirk := getattr(q, name)) is not q.Quirk],
    ids=lambda quirk: quirk.__name__,
)
def test_each_quirk_alone_is_lived_with(quirk: type[q.Quirk], seed: int) -> None:
    domain = Domain(seed, conditions=ROUGH)
    both_ways(domain, domain.node(), domain.node(vendor=Vendor(OUR_VENDOR_ID, (quirk,))))
    rest(domain)


def test_an_instance_ends_by_its_key_hash_alone() -> None:
    domain = Domain(1)
    ours, rti = domain.node(), domain.node(vendor=RTI_CONNEXT)
    ((_, _), (writer, reader)) = both_ways(domain, ours, rti)
    assert reader.session(writer.guid).changes[-1].payload == b""
    info, _ = reader.taken[-1]
    assert (info.instance_handle, info.valid_data) == (b"\x01", False)
    writer.delete()
    assert domain.run_until(lambda: writer.guid not in reader.local.behavior.writers, 5), "endpoints end so, too"


def test_big_endian_submessages_are_read() -> None:
    domain = Domain(2, conditions=ROUGH)
    ours, other = domain.node(), domain.node(vendor=Vendor(OUR_VENDOR_ID, (q.BigEndianSubmessages,)))
    orders: dict[GuidPrefix, set[bool]] = {ours.guid.prefix: set(), other.guid.prefix: set()}
    kinds = (SubmessageKind.DATA, SubmessageKind.DATA_FRAG, SubmessageKind.HEARTBEAT, SubmessageKind.ACKNACK)

    def watch(owner: GuidPrefix, octets: bytes) -> None:
        if not invariants.is_announcement(octets):
            orders[owner].update(raw.little_endian for raw in iterate_submessages(octets) if raw.kind in kinds)

    domain.network.watch = watch
    both_ways(domain, ours, other)
    assert orders == {ours.guid.prefix: {True}, other.guid.prefix: {False}}


@pytest.mark.parametrize("seed", range(6))
def test_numbers_of_others_are_asked_for_once_and_not_waited_for(seed: int) -> None:
    """HEARTBEATs speak of samples for others, and the GAPs that would explain them have to be asked for."""
    domain = Domain(seed, conditions=LinkConditions(loss=0.4))
    patient = Config(lease_duration=100.0)  # where so much is lost, a shorter one ends by chance now and then
    cyclone = domain.node(vendor=CYCLONE_DDS, config=patient)
    ours = [domain.node(config=patient), domain.node(config=patient)]
    writer = cyclone.writer("keys", RELIABLE, filters=True)
    readers = [node.reader("keys", RELIABLE, uses_filter=True) for node in ours]
    assert domain.run_until(domain.all_matched, 10)
    for number in range(30):
        writer.write(destination=ours[number % 3 // 2].guid)
        domain.run(0.003)
    rest(domain)
    assert [len(reader.taken) for reader in readers] == [20, 10]
    assert cyclone.played is not None
    assert cyclone.played.acts[q.HeartbeatForAll] > 0
    assert cyclone.played.acts[q.GapWhenAsked] > 0


@pytest.mark.parametrize("seed", range(4))
def test_what_the_history_no_longer_holds_is_explained_late(seed: int) -> None:
    """KEEP_LAST: the GAP for what was replaced comes when it is asked for a second time."""
    domain = Domain(seed, conditions=LinkConditions(loss=0.4))
    cyclone, ours = domain.node(vendor=CYCLONE_DDS), domain.node()
    writer, reader = cyclone.writer("Square", KEPT | Qos(history=KeepLast(2))), ours.reader("Square", KEPT)
    for _ in range(40):
        writer.write()
        domain.run(0.002)
    rest(domain)
    assert reader.session(writer.guid).numbers[-2:] == [39, 40]


def test_rustdds_cuts_finely() -> None:
    domain = Domain(1)
    both_ways(domain, domain.node(), rust := domain.node(vendor=RUST_DDS))
    assert rust.writers[0].local.behavior.fragment_octets == 256


def test_runs_that_cannot_be_opened_are_not_heard_and_count_as_never_come() -> None:
    """OpenDDS, and somebody who does not know it: what the honest side is spared by knowing the vendor."""
    domain = Domain(1)

    class Longer(Plaintext):
        def encode_payload(self, writer: Guid, payload: bytes | bytearray | memoryview) -> bytes:
            return bytes(payload) + bytes(44)

        def overhead(self, sender: Guid, receivers: tuple[Guid, ...]) -> Overhead:
            return Overhead(payload=44)

    careless, opendds = domain.node(make_hooks=Longer), domain.node(vendor=OPENDDS)
    writer, reader = careless.writer("Square", RELIABLE), opendds.reader("Square", RELIABLE)
    assert domain.run_until(domain.all_matched, 5)
    writer.write(5000)
    domain.run(1)
    assert not reader.taken
    assert opendds.played is not None
    assert opendds.played.acts[q.OpensAfterJoining] > 3
    assert opendds.engine.drops[DropReason.MALFORMED_MESSAGE] == 0


def test_a_restarted_node_still_plays_its_vendor() -> None:
    domain = Domain(1)
    node = domain.node(vendor=CYCLONE_DDS)
    before = node.played
    node.restart()
    assert node.played is not None
    assert node.played is not before
    assert node.guid[:2] == CYCLONE_DDS.vendor_id


def test_vendors_have_names_and_each_quirk_has_a_vendor_or_a_host() -> None:
    assert [vendor.name for vendor in VENDORS] == sorted(vendor.name for vendor in VENDORS)
    assert all(vendor.vendor_id in VENDOR_NAMES for vendor in VENDORS)
    played = {quirk for vendor in VENDORS for quirk in vendor.quirks} | {q.BigEndianSubmessages}
    assert played == {getattr(q, name) for name in q.__all__} - {q.Quirk}


@pytest.mark.parametrize(
    "start", [pytest.param(start, marks=[pytest.mark.slow] if start else []) for start in range(0, 192, 16)]
)
def test_every_invariant_holds_where_vendors_meet(start: int) -> None:
    for seed in range(start, start + 16):
        Scenario.from_seed(seed).run(vendors=(None, VENDORS[seed % len(VENDORS)]))
