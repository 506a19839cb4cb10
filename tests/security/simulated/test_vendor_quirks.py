"""Vendors that cannot be installed here, played by their quirks, with a standard participant of ours.

Both authenticate, exchange keys, and get every reliable sample of the other, small and large, whatever is lost.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable
from copy import copy
from dataclasses import replace
from pathlib import Path

import pytest

from ddsi.messages.data import Data
from ddsi.messages.data_frag import DataFrag
from ddsi.messages.raw_submessage import SubmessageKind, iterate_submessages
from ddsi.messages.receiver import MessageReceiver
from ddsi.messages.submessages import Submessage
from ddsi.simulation import VENDORS, Domain, LinkConditions, Node, NodeReader, NodeWriter, Vendor, invariants
from ddsi.simulation import quirks as q
from ddsi.simulation.scenario import Scenario
from ddsi.simulation.vendors import CYCLONE_DDS, FAST_DDS, OPENDDS
from ddsi.spi import HookEffect, SendMessage
from ddsi.structure.guid import Guid, GuidPrefix
from ddsi.structure.qos import Qos
from ddsi.structure.qos_policies import KeepAll, Properties, Reliable, TransientLocal
from ddsi.structure.vendor import OUR_VENDOR_ID
from ddsi.trace.events import MessageSent
from ddsi.trace.generic_message import generic_message_in
from ddsi.trace.reasons import DropReason
from ddsi_security.generic_message import AUTH, GenericMessage, read_generic_message, write_generic_message

from .keystores import GOVERNANCES, make_identities
from .watch import Watch

RELIABLE = Qos(reliability=Reliable(), history=KeepAll(), durability=TransientLocal())
ROUGH = LinkConditions(loss=0.1, duplication=0.05, reordering=0.1, jitter=0.001)
LARGE = 70_000
PAYLOAD_OVERHEAD = 44  # ENCRYPT; DDS-Security 1.1 §9.5.2.3 to §9.5.2.5


def _fits(vendor: Vendor, governance: str) -> bool:
    return vendor.has_origin_authentication or "ORIGIN" not in GOVERNANCES[governance].metadata


PAIRS = [(vendor, governance) for vendor in VENDORS for governance in GOVERNANCES if _fits(vendor, governance)]
QUICK = {"encrypt", "message", "nothing"}


# OpenDDS, which differs most, under every governance; the rest of the product is for whoever has time.
CASES = [
    pytest.param(
        vendor,
        governance,
        marks=[] if vendor is OPENDDS or governance in QUICK else [pytest.mark.slow],
        id=f"{vendor.name}, {governance}",
    )
    for vendor, governance in PAIRS
]


@pytest.fixture(scope="module")
def identities(tmp_path_factory: pytest.TempPathFactory) -> dict[str, list[Properties]]:
    folder: Path = tmp_path_factory.mktemp("keystores")
    return {name: make_identities(folder / name, name) for name in GOVERNANCES}


def both_ways(domain: Domain, first: Node, second: Node) -> list[tuple[NodeWriter, NodeReader]]:
    """Some samples before the two have met and some after; then a late joiner on either side."""
    pairs = [
        (sender.writer("Square", RELIABLE), receiver.reader("Square", RELIABLE))
        for sender, receiver in ((first, second), (second, first))
    ]
    for size in (50, LARGE, 0, LARGE + 1, 1300, 50):
        for writer, _ in pairs:
            writer.write(size)
        domain.run_until(domain.all_matched, 60)
    for writer, reader in list(pairs):
        pairs.append((writer, reader.node.reader("Square", RELIABLE)))
    everything = [1, 2, 3, 4, 5, 6]
    assert domain.run_until(lambda: all(r.session(w.guid).numbers == everything for w, r in pairs), 60)
    return pairs


def rest(domain: Domain) -> None:
    """Everything is settled, nobody asks in vain, and no invariant is broken."""
    assert domain.run_until(domain.all_matched, 60)
    domain.run(1)
    assert domain.run_until(lambda: invariants.is_at_rest(domain), 60)
    assert invariants.at_rest(domain) == []
    assert invariants.quiet(domain, 30) == []


def has_to_act(quirk: type[q.Quirk], governance: str) -> bool:
    """Does a pair that exchanges samples under this governance bring the quirk about?"""
    draft = GOVERNANCES[governance]
    if quirk is q.NonStandardPayload:
        return draft.data != "NONE"
    if quirk is q.NoParticipantTokens:
        return draft.rtps == "NONE"
    if quirk in (q.NeedsParticipantToken, q.NeedsReaderToken):
        return False  # what they wait for may be there already
    if quirk is q.ProtectedTimestamp:
        return True  # on the volatile topic, if nowhere else
    # Keys are for others only where there is a third participant; the last is of keyed topics.
    return quirk not in (q.HeartbeatForAll, q.GapWhenAsked, q.DisposeByKeyHash)


@pytest.mark.parametrize(("vendor", "governance"), CASES)
@pytest.mark.parametrize("seed", [0, *(pytest.param(seed, marks=pytest.mark.slow) for seed in range(1, 5))])
def test_a_pair_gets_every_sample_both_ways(
    vendor: Vendor, governance: str, seed: int, identities: dict[str, list[Properties]]
) -> None:
    watch = Watch()
    domain = Domain(seed, conditions=ROUGH, trace=watch)
    ours = domain.node(properties=identities[governance][0])
    other = domain.node(properties=identities[governance][1], vendor=vendor)
    both_ways(domain, *((ours, other) if seed % 2 else (other, ours)))
    rest(domain)
    assert not watch.repeated
    assert other.played is not None
    for quirk in vendor.quirks:
        if quirk in (q.DropsCountZero, q.RefusesAckNackFromZero, q.OpensAfterJoining):
            assert other.played.acts[quirk] == 0, "we say nothing that this vendor does not understand"
        elif has_to_act(quirk, governance):
            assert other.played.acts[quirk] > 0


@pytest.mark.parametrize("vendor", [CYCLONE_DDS, FAST_DDS], ids=lambda vendor: vendor.name)
def test_keys_of_three(vendor: Vendor, identities: dict[str, list[Properties]]) -> None:
    """One volatile topic for all: what is for others is neither acted upon nor waited for, and all have their keys."""
    acts: Counter[type[q.Quirk]] = Counter()
    for seed in range(4):
        domain = Domain(seed, conditions=LinkConditions(loss=0.2))
        nodes = [
            domain.node(properties=properties, vendor=played)
            for properties, played in zip(identities["encrypt"], (vendor, None, None), strict=True)
        ]
        writers = [node.writer("Square", RELIABLE) for node in nodes]
        readers = [node.reader("Square", RELIABLE) for node in nodes]
        for writer in writers:
            writer.write(LARGE)
            writer.write(50)
        assert domain.run_until(domain.all_matched, 60)
        rest(domain)
        assert all(reader.session(writer.guid).numbers == [1, 2] for reader in readers for writer in writers)
        assert nodes[0].played is not None
        acts.update(nodes[0].played.acts)
    for quirk in (q.KeysForEverybody,) if vendor is FAST_DDS else (q.GapWhenAsked, q.HeartbeatForAll):
        assert acts[quirk] > 0


@pytest.mark.parametrize(
    "start", [pytest.param(start, marks=[pytest.mark.slow] if start else []) for start in range(0, 240, 12)]
)
def test_every_invariant_holds_where_secured_vendors_meet(start: int, identities: dict[str, list[Properties]]) -> None:
    for seed in range(start, start + 12):
        vendor, governance = PAIRS[seed * 7 % len(PAIRS)]
        watch = Watch()
        Scenario.from_seed(seed).run(watch, properties=identities[governance], vendors=(None, vendor))
        assert not watch.repeated, f"seed {seed}, {governance}"


# --- samples that are protected whole -------------------------------------------------------------------------------


def fragments_of(sent: list[tuple[GuidPrefix, bytes]], sender: Node) -> list[DataFrag]:
    """Those of user samples that a participant sent; legible where only payloads are protected."""
    return [
        submessage
        for owner, octets in sent
        if owner == sender.guid.prefix
        for submessage, _ in MessageReceiver(octets)
        if isinstance(submessage, DataFrag) and not submessage.writer_id.is_builtin
    ]


def protected_size(size: int) -> int:
    """Padded to a multiple of 4 (§9.5.3.3), and with what protection adds."""
    return -(-size // 4) * 4 + PAYLOAD_OVERHEAD


def is_part_of_whole(fragment: DataFrag, size: int) -> bool:
    """Of a sample that was protected in one piece?  Else the sample has its own size, and each run is longer."""
    if fragment.sample_size == size:
        assert len(fragment.serialized_payload) >= fragment.run_length + PAYLOAD_OVERHEAD
        return False
    assert fragment.sample_size == protected_size(size)
    assert len(fragment.serialized_payload) < fragment.run_length + 4
    return True


def test_each_reader_gets_the_form_that_it_can_open(identities: dict[str, list[Properties]]) -> None:
    """OpenDDS joins first, all others open each run; both read the same writer."""
    domain = Domain(1, conditions=ROUGH)
    sent: list[tuple[GuidPrefix, bytes]] = []
    domain.network.watch = lambda owner, octets: sent.append((owner, octets))
    ours, opendds, another = (
        domain.node(properties=properties, vendor=vendor)
        for properties, vendor in zip(identities["payload"], (None, OPENDDS, None), strict=True)
    )
    writer = ours.writer("Square", RELIABLE)
    readers = [node.reader("Square", RELIABLE) for node in (opendds, another)]
    assert domain.run_until(domain.all_matched, 30)
    change = writer.write(LARGE)
    assert change is not None
    assert domain.run_until(lambda: all(len(reader.taken) == 1 for reader in readers), 30)
    forms = Counter(is_part_of_whole(fragment, len(change.payload)) for fragment in fragments_of(sent, ours))
    assert forms[True] >= 40
    assert forms[False] >= 40
    assert opendds.played is not None
    # Whom INFO_DST names is not to be mistaken: what was for the other is not heard at all.
    assert opendds.played.acts[q.OpensAfterJoining] <= forms[False]


def test_only_opendds_is_sent_samples_that_were_protected_whole(identities: dict[str, list[Properties]]) -> None:
    for vendor in (None, *VENDORS):
        domain = Domain(1)
        sent: list[tuple[GuidPrefix, bytes]] = []
        domain.network.watch = lambda owner, octets, sent=sent: sent.append((owner, octets))
        ours = domain.node(properties=identities["payload"][0])
        other = domain.node(properties=identities["payload"][1], vendor=vendor)
        writer, reader = ours.writer("Square", RELIABLE), other.reader("Square", RELIABLE)
        change = writer.write(LARGE)
        assert change is not None
        assert domain.run_until(lambda reader=reader: len(reader.taken) == 1, 30)  # type: ignore[misc]
        forms = {is_part_of_whole(fragment, len(change.payload)) for fragment in fragments_of(sent, ours)}
        assert forms == {vendor is OPENDDS}


def test_what_opendds_sends_looks_like_it(identities: dict[str, list[Properties]]) -> None:
    """Whole samples, flag N, big-endian envelopes whose last has no length."""
    domain = Domain(1)
    sent: list[tuple[GuidPrefix, bytes]] = []
    domain.network.watch = lambda owner, octets: sent.append((owner, octets))
    ours = domain.node(properties=identities["payload"][0])
    opendds = domain.node(properties=identities["payload"][1], vendor=OPENDDS)
    both_ways(domain, ours, opendds)
    fragments = fragments_of(sent, opendds)
    assert {fragment.sample_size for fragment in fragments} == {protected_size(LARGE + 5), protected_size(1305)}
    assert all(fragment.non_standard_payload for fragment in fragments)
    envelopes = [
        (raw, octets)
        for owner, octets in sent
        if owner == opendds.guid.prefix
        for raw in iterate_submessages(octets)
        if raw.kind in (SubmessageKind.SEC_PREFIX, SubmessageKind.SEC_POSTFIX)
    ]
    assert envelopes, "those of its keys"
    for raw, octets in envelopes:
        assert not raw.little_endian
        is_open = raw.kind == SubmessageKind.SEC_POSTFIX and raw.end == len(octets)
        assert octets[raw.offset + 2 : raw.offset + 4] == (b"\0\0" if is_open else b"\0\x14")


@pytest.mark.parametrize("governance", ["encrypt", "sign", "submessage"])
def test_a_protected_time_stamp_is_that_of_the_sample(governance: str, identities: dict[str, list[Properties]]) -> None:
    domain = Domain(1, conditions=ROUGH)
    ours = domain.node(properties=identities[governance][0])
    vendor = Vendor(FAST_DDS.vendor_id, (q.ProtectedTimestamp,))
    other = domain.node(properties=identities[governance][1], vendor=vendor, clock_error=-3600.0)
    pairs = both_ways(domain, ours, other)
    for writer, reader in pairs:
        received = [change.source_timestamp for change in reader.session(writer.guid).changes]
        assert received == [change.source_timestamp for change in writer.written.values()]


# --- keys and handshakes --------------------------------------------------------------------------------------------


def kinds_sent(domain_messages: list[MessageSent], sender: Node) -> Counter[str]:
    outlines = (
        generic_message_in(submessage)
        for event in domain_messages
        if event.octets[8:20] == sender.guid.prefix
        for submessage, _ in MessageReceiver(event.octets)
        if isinstance(submessage, Data)
    )
    return Counter(outline.kind for outline in outlines if outline is not None)


@pytest.mark.parametrize("governance", ["payload", "nothing"])
@pytest.mark.parametrize("first", [0, 1])
def test_who_has_no_keys_to_send_shows_by_its_answers_that_it_is_authenticated(
    governance: str, first: int, identities: dict[str, list[Properties]]
) -> None:
    """Without them nothing else would tell that the final arrived, and it would be repeated for long."""
    messages: list[MessageSent] = []
    domain = Domain(first, trace=lambda event: messages.append(event) if isinstance(event, MessageSent) else None)
    ours = domain.node(properties=identities[governance][first])
    opendds = domain.node(properties=identities[governance][1 - first], vendor=OPENDDS)
    writer, reader = ours.writer("Square", RELIABLE), opendds.reader("Square", RELIABLE)
    writer.write()
    assert domain.run_until(lambda: len(reader.taken) == 1, 10)
    domain.run(20)
    assert opendds.played is not None
    assert opendds.played.acts[q.NoParticipantTokens] > 0
    assert kinds_sent(messages, ours)["final"] <= 2


@pytest.mark.parametrize(
    ("quirk", "governance"), [(q.NeedsParticipantToken, "nothing"), (q.NeedsReaderToken, "payload")]
)
def test_keys_of_no_kind_are_sent_to_those_who_wait_for_them(
    quirk: type[q.Quirk], governance: str, identities: dict[str, list[Properties]]
) -> None:
    """Nothing is to be opened with them, but who does not get them waits for ever."""
    waits = 0
    for seed in range(4):
        domain = Domain(seed, conditions=ROUGH)
        ours = domain.node(properties=identities[governance][0])
        other = domain.node(properties=identities[governance][1], vendor=Vendor(OUR_VENDOR_ID, (quirk,)))
        both_ways(domain, ours, other)
        rest(domain)
        assert other.played is not None
        waits += other.played.acts[quirk]
    assert waits > 0


class BareHandshake(q.Quirk):
    """Handshake messages without the optional properties (OpenDDS): hashes, and what the reader has seen before."""

    def post(self, effect: HookEffect) -> HookEffect | None:
        return _rewritten(effect, self._bare)

    @staticmethod
    def _bare(message: GenericMessage) -> GenericMessage:
        token = message.message_data[0]
        needed = {
            "Reply": ("c.", "dh2", "challenge", "signature"),
            "Final": ("challenge", "signature"),
            "+Req": ("c.", "dh1", "challenge1"),
        }
        prefixes = next((kept for end, kept in needed.items() if token.class_id.endswith(end)), ("",))
        properties = tuple(item for item in token.binary_properties if item[0].startswith(prefixes))
        return replace(message, message_data=(replace(token, binary_properties=properties),))


class ParticipantAsSource(q.Quirk):
    """The source of a handshake message is the participant, not its stateless writer (OpenDDS)."""

    def post(self, effect: HookEffect) -> HookEffect | None:
        return _rewritten(effect, self._of_participant)

    @staticmethod
    def _of_participant(message: GenericMessage) -> GenericMessage:
        identity = message.message_identity
        return replace(message, message_identity=replace(identity, source_guid=identity.source_guid.participant))


def _rewritten(effect: HookEffect, change_message: Callable[[GenericMessage], GenericMessage]) -> HookEffect:
    """A handshake message with something in it changed; others as they are."""
    if not isinstance(effect, SendMessage):
        return effect
    message = read_generic_message(effect.change.payload)
    if message.message_class_id != AUTH:
        return effect
    change = copy(effect.change)
    change.payload = write_generic_message(change_message(message))
    return replace(effect, change=change)


@pytest.mark.parametrize("first", [0, 1])
def test_handshakes_as_opendds_has_them(first: int, identities: dict[str, list[Properties]]) -> None:
    vendor = Vendor(OPENDDS.vendor_id, (*OPENDDS.quirks, BareHandshake, ParticipantAsSource))
    domain = Domain(first, conditions=ROUGH)
    ours = domain.node(properties=identities["encrypt"][first])
    other = domain.node(properties=identities["encrypt"][1 - first], vendor=vendor)
    both_ways(domain, ours, other)
    assert other.played is not None
    assert other.played.acts[BareHandshake] > 0
    assert other.played.acts[ParticipantAsSource] > 0


# --- where we are not liberal ---------------------------------------------------------------------------------------


def test_discovery_in_clear_is_taken_from_cyclone_alone(identities: dict[str, list[Properties]]) -> None:
    """All messages are to be protected; Cyclone DDS leaves its plain topics out, and nobody else may."""
    for vendor_id, is_taken in ((CYCLONE_DDS.vendor_id, True), (OPENDDS.vendor_id, False), (OUR_VENDOR_ID, False)):
        domain = Domain(1)
        ours = domain.node(properties=identities["message"][0])
        other = domain.node(properties=identities["message"][1], vendor=Vendor(vendor_id, (q.PlainTopicsInClear,)))
        other.writer("Square", RELIABLE).write()
        reader = ours.reader("Square", RELIABLE)
        domain.run(10)
        assert bool(reader.taken) is is_taken
        assert bool(ours.engine.drops[DropReason.CLEAR_TEXT]) is not is_taken


class AlwaysNonStandard(q.Quirk):
    """Flag N on everything."""

    def say(self, sender: Guid, receivers: tuple[Guid, ...], submessage: Submessage) -> Submessage | None:
        if not isinstance(submessage, Data | DataFrag) or sender.entity_id.is_builtin:
            return submessage
        return replace(submessage, non_standard_payload=True)


@pytest.mark.parametrize(("governance", "is_taken"), [("payload", True), ("submessage", False)])
def test_flag_n_is_taken_where_the_payload_is_protected(
    governance: str, is_taken: bool, identities: dict[str, list[Properties]]
) -> None:
    domain = Domain(1)
    ours = domain.node(properties=identities[governance][0])
    other = domain.node(properties=identities[governance][1], vendor=Vendor(OUR_VENDOR_ID, (AlwaysNonStandard,)))
    writer, reader = other.writer("Square", RELIABLE), ours.reader("Square", RELIABLE)
    assert domain.run_until(domain.all_matched, 30)
    for size in (50, LARGE):
        writer.write(size)
    domain.run(5)
    assert len(reader.taken) == (2 if is_taken else 0)
    assert bool(ours.engine.drops[DropReason.UNSUPPORTED]) is not is_taken
    assert invariants.is_at_rest(domain), "its number is not asked for again and again"
