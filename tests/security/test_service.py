"""The hooks over the builtin plugins, from discovery to protected octets; what strangers and insiders may not do."""

from __future__ import annotations

import gc
import math
from dataclasses import replace
from random import Random

import pytest

from ddsi.serialization import ParameterId
from ddsi.spi import (
    ADMITTED,
    PENDING,
    PLAINTEXT,
    SPI_VERSION,
    NoKeys,
    NotForUs,
    Octets,
    Outcome,
    Parts,
    Refused,
    Rejected,
    SendMessage,
    load_hooks,
)
from ddsi.spi import Protection as Level
from ddsi.structure import builtin_entity_ids as ids
from ddsi.structure import vendor
from ddsi.structure.builtin_entity_ids import BuiltinEndpoints
from ddsi.structure.cache_change import CacheChange, ChangeKind
from ddsi.structure.discovered import DiscoveredParticipantData, DiscoveredReaderData, DiscoveredWriterData, Parameter
from ddsi.structure.errors import ConfigurationError, NotAllowedBySecurity
from ddsi.structure.guid import EntityId, EntityKind, Guid
from ddsi.structure.qos import EndpointQos
from ddsi.structure.qos_policies import Property
from ddsi.structure.vendor import VendorId
from ddsi_security import service
from ddsi_security.announced import SecurityInfo, info_parameter, token_parameter
from ddsi_security.authentication.handshake import Handshake
from ddsi_security.authentication.not_trusted import NotTrusted
from ddsi_security.authentication.signatures import SoftwareKey
from ddsi_security.cryptographic import AesGcmGmac
from ddsi_security.cryptographic.key_material import KeyMaterial
from ddsi_security.cryptographic.session_keys import ReceiverKey
from ddsi_security.generic_message import (
    AUTH_REQUEST,
    GenericMessage,
    MessageIdentity,
    read_generic_message,
    write_generic_message,
)
from ddsi_security.handles import DatawriterCryptoHandle, SharedSecretHandle
from ddsi_security.local_endpoint import BUILTIN_SECURE_TOPICS
from ddsi_security.tokens import DataHolder

from .seam import KEYSTORE, NOW_NS, Side, deliver, introduce, match_builtin_topics, properties_of

USER_WRITER = EntityId.user(1, EntityKind.WRITER_WITH_KEY)
USER_READER = EntityId.user(2, EntityKind.READER_WITH_KEY)
VOLATILE_WRITER = ids.PARTICIPANT_VOLATILE_MESSAGE_SECURE_WRITER
VOLATILE_READER = ids.PARTICIPANT_VOLATILE_MESSAGE_SECURE_READER
GOVERNANCES = ("governance", "governance_all_oa", "governance_all_sign", "governance_sign_enc", "governance_data")


def heartbeat(writer: EntityId, reader: EntityId) -> bytes:
    return bytes.fromhex("07011c00") + reader + writer + bytes(20)


def writer_data(side: Side, topic: str = "Square") -> DiscoveredWriterData:
    return DiscoveredWriterData(
        guid=side.endpoint(USER_WRITER), topic_name=topic, type_name="ShapeType", qos=EndpointQos()
    )


def reader_data(side: Side, topic: str = "Square") -> DiscoveredReaderData:
    return DiscoveredReaderData(
        guid=side.endpoint(USER_READER), topic_name=topic, type_name="ShapeType", qos=EndpointQos()
    )


def trusting_pair(governance: str = "governance", *, seed: int = 0) -> tuple[Side, Side]:
    """Alice and Bob, authenticated and with all keys of the builtin topics."""
    alice, bob = Side("alice", governance, seed=seed), Side("bob", governance, seed=seed)
    introduce(alice, bob)
    match_builtin_topics(alice, bob)
    deliver(alice, bob)
    return alice, bob


# --- becoming acquainted --------------------------------------------------------------------------------------------


@pytest.mark.parametrize("governance", GOVERNANCES)
def test_two_identities_of_one_authority_admit_each_other(governance: str) -> None:
    alice, bob = trusting_pair(governance)
    assert alice.has_admitted(bob)
    assert bob.has_admitted(alice)
    for one, other in ((alice, bob), (bob, alice)):
        for topic in BUILTIN_SECURE_TOPICS:
            writer, reader = topic.writer_id, topic.reader_id
            assert one.decided[(one.endpoint(writer), other.endpoint(reader))] is ADMITTED, topic.name
            assert one.decided[(one.endpoint(reader), other.endpoint(writer))] is ADMITTED, topic.name


def announcing(side: Side, *parameters: Parameter) -> DiscoveredParticipantData:
    """What somebody says in the clear in this participant's name."""
    changed = {**dict(side.data.security_parameters), **dict(parameters)}
    return replace(side.data, security_parameters=tuple(changed.items()))


@pytest.mark.parametrize(
    "forged",
    [
        token_parameter(ParameterId.PERMISSIONS_TOKEN, DataHolder("another access control plugin")),
        token_parameter(ParameterId.PERMISSIONS_TOKEN, DataHolder()),
        info_parameter(ParameterId.PARTICIPANT_SECURITY_INFO, SecurityInfo(0, 0)),
    ],
    ids=["another plugin", "no permissions", "no protection"],
)
def test_what_a_peer_signed_counts_and_not_what_was_announced_in_its_name(forged: Parameter) -> None:
    alice, bob = Side("alice"), Side("bob")
    alice.hooks.remote_participant(announcing(bob, forged), 0.0)
    bob.hooks.remote_participant(alice.data, 0.0)
    deliver(alice, bob)
    assert alice.has_admitted(bob)
    shown = alice.hooks.participant_security(bob.guid).permissions_token
    assert shown.class_id == bob.hooks.participant_security(bob.guid).permissions_token.class_id


def test_a_peer_that_signs_another_governance_is_refused_whatever_was_announced() -> None:
    alice, bob = Side("alice"), Side("bob", "governance_data")
    alice.hooks.remote_participant(announcing(bob, *alice.data.security_parameters[2:]), 0.0)
    bob.hooks.remote_participant(announcing(alice, *bob.data.security_parameters[2:]), 0.0)
    deliver(alice, bob)
    refusal = alice.decided[(alice.guid, bob.guid)]
    assert isinstance(refusal, Refused)
    assert "governance protects participants otherwise" in refusal.reason


def test_the_guid_is_bound_to_the_subject() -> None:
    assert Side("alice", seed=1).guid[:6] == Side("alice", seed=2).guid[:6] == bytes.fromhex("8504d3a1f5c5")
    assert Side("alice", seed=1).guid != Side("alice", seed=2).guid


def test_all_secure_endpoints_are_announced() -> None:
    alice = Side("alice")
    assert alice.data.builtin_endpoints == BuiltinEndpoints(0xF_0FFF_0000)
    assert [pid for pid, _ in alice.data.security_parameters] == [0x1001, 0x1002, 0x1005]


def test_nothing_is_decided_before_the_handshake_is() -> None:
    alice, bob = Side("alice"), Side("bob")
    assert alice.hooks.remote_participant(bob.data, 0.0) is PENDING
    assert alice.match(VOLATILE_WRITER, bob, VOLATILE_READER) == Refused("its participant is not authenticated")
    assert (
        alice.match(ids.PARTICIPANT_STATELESS_MESSAGE_WRITER, bob, ids.PARTICIPANT_STATELESS_MESSAGE_READER) is ADMITTED
    )


@pytest.mark.parametrize("seed", range(20))
def test_keys_may_come_in_any_order(seed: int) -> None:
    alice, bob = Side("alice", seed=seed), Side("bob", seed=seed)
    introduce(alice, bob)
    dice = Random(seed)
    sides = [(alice, bob), (bob, alice)]
    matches = [(one, other, topic) for topic in BUILTIN_SECURE_TOPICS for one, other in sides]
    dice.shuffle(matches)
    for one, other, topic in matches:
        one.match(topic.writer_id, other, topic.reader_id)
        one.match(topic.reader_id, other, topic.writer_id)
        if dice.random() < 0.5:
            deliver(alice, bob, dice=dice)
    deliver(alice, bob, dice=dice)
    for one, _ in sides:
        assert set(one.decided.values()) == {ADMITTED}


def test_keys_that_come_before_their_endpoint_wait_for_it() -> None:
    alice, bob = trusting_pair()
    alice.hooks.local_writer(writer_data(alice))
    bob.hooks.local_reader(reader_data(bob))
    assert alice.match(USER_WRITER, bob, USER_READER, "Square") is PENDING
    deliver(alice, bob)  # alice's keys are with bob, who knows nothing of her writer yet
    assert bob.match(USER_READER, alice, USER_WRITER, "Square") is ADMITTED
    deliver(alice, bob)
    assert alice.decided[(alice.endpoint(USER_WRITER), bob.endpoint(USER_READER))] is ADMITTED


def test_where_only_the_payload_is_protected_the_writer_waits_for_nobody() -> None:
    """Cyclone DDS's readers have no key then."""
    alice, bob = trusting_pair("governance_data")
    alice.hooks.local_writer(writer_data(alice))
    bob.hooks.local_reader(reader_data(bob))
    assert alice.match(USER_WRITER, bob, USER_READER, "Square") is ADMITTED
    assert bob.match(USER_READER, alice, USER_WRITER, "Square") is PENDING
    deliver(alice, bob)
    assert bob.decided[(bob.endpoint(USER_READER), alice.endpoint(USER_WRITER))] is ADMITTED


# --- octets ---------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("governance", GOVERNANCES)
def test_what_one_protects_the_other_opens(governance: str) -> None:
    alice, bob = trusting_pair(governance)
    writer, reader = ids.SEDP_PUBLICATIONS_SECURE_WRITER, ids.SEDP_PUBLICATIONS_SECURE_READER
    plain = heartbeat(writer, reader)
    protected = alice.protect(writer, bob.endpoint(reader), plain)
    message = b"RTPS\x02\x04\x01\xdd" + alice.guid.prefix + protected
    sent = b"".join(alice.hooks.encode_message((bob.endpoint(reader),), (message,)))
    received = bob.hooks.decode_message(sent, alice.guid.prefix) if sent != message else sent
    assert isinstance(received, (bytes, bytearray, memoryview))
    assert bytes(received).endswith(protected)
    if protected != plain:
        assert bytes(bob.open(protected, alice)) == plain  # type: ignore[arg-type]


def test_what_follows_the_first_is_judged_by_the_same_rules() -> None:
    """It goes a shorter way, until its endpoint is gone."""
    alice, bob = trusting_pair()
    writer, reader = ids.SEDP_PUBLICATIONS_SECURE_WRITER, ids.SEDP_PUBLICATIONS_SECURE_READER
    receiver, plain = bob.endpoint(reader), heartbeat(writer, reader)
    for _ in range(3):
        assert bytes(bob.open(alice.protect(writer, receiver, plain), alice)) == plain  # type: ignore[arg-type]
    assert bob.hooks._protection._openers, "the shorter way is there"
    posing = alice.protect(writer, receiver, heartbeat(ids.SEDP_SUBSCRIPTIONS_SECURE_WRITER, reader))
    assert isinstance(bob.open(posing, alice), Rejected)
    altered = bytearray(alice.protect(writer, receiver, plain))
    altered[40] ^= 1
    assert isinstance(bob.open(bytes(altered), alice), Rejected)
    bob.hooks.unmatch(bob.endpoint(reader), alice.endpoint(writer))
    assert isinstance(bob.open(alice.protect(writer, receiver, plain), alice), Outcome)


def test_a_payload_is_opened_by_the_reader_it_is_for() -> None:
    alice, bob = trusting_pair()
    alice.hooks.local_writer(writer_data(alice))
    bob.hooks.local_reader(reader_data(bob))
    alice.match(USER_WRITER, bob, USER_READER, "Square")
    bob.match(USER_READER, alice, USER_WRITER, "Square")
    deliver(alice, bob)
    payload = b"\0\1\0\0" + b"BLUE" * 10
    protected = bytes(alice.hooks.encode_payload(alice.endpoint(USER_WRITER), payload))
    assert b"BLUE" not in protected
    assert bob.hooks.protects_payload(alice.endpoint(USER_WRITER))
    assert bytes(bob.hooks.decode_payload(alice.endpoint(USER_WRITER), protected)) == payload  # type: ignore[arg-type]


class AddingInlineQos(AesGcmGmac):
    """Tells in the inline QoS how to decode, as the OMG allows."""

    def payload_sealer(self, sending_datawriter_crypto: DatawriterCryptoHandle) -> None:
        return None

    def encode_serialized_payload(
        self, extra_inline_qos: bytearray, plain_buffer: Octets, sending_datawriter_crypto: DatawriterCryptoHandle
    ) -> Parts | Refused:
        extra_inline_qos += bytes(4)
        return super().encode_serialized_payload(extra_inline_qos, plain_buffer, sending_datawriter_crypto)


def test_extra_inline_qos_is_refused_and_not_lost_in_silence() -> None:
    alice = Side("alice", extra={"dds.sec.crypto.plugin": f"{__name__}:AddingInlineQos"})
    alice.hooks.local_writer(writer_data(alice))
    with pytest.raises(ConfigurationError, match="AddingInlineQos adds extra_inline_qos to a payload"):
        alice.hooks.encode_payload(alice.endpoint(USER_WRITER), bytes(8))


@pytest.mark.parametrize(
    ("governance", "vendor", "is_believed"),
    [
        ("governance_data", vendor.OUR_VENDOR_ID, False),
        ("governance_data", vendor.CYCLONE, False),
        ("governance_data", vendor.FAST_DDS, True),
        ("governance_data", vendor.RTI, True),
        ("governance_meta_sign", vendor.CYCLONE, True),
    ],
)
def test_an_end_that_nothing_protects_is_believed_only_of_who_cannot_do_better(
    governance: str, vendor: VendorId, is_believed: bool
) -> None:
    """A key hash alone, where payloads are protected; Fast DDS and RTI send no more than that."""
    alice, bob = Side("alice", governance), Side("bob", governance)
    alice.data = replace(alice.data, vendor_id=vendor)
    introduce(alice, bob)
    match_builtin_topics(alice, bob)
    alice.hooks.local_writer(writer_data(alice))
    bob.hooks.local_reader(reader_data(bob))
    alice.match(USER_WRITER, bob, USER_READER, "Square")
    bob.match(USER_READER, alice, USER_WRITER, "Square")
    deliver(alice, bob)
    outcome = bob.hooks.decode_payload(alice.endpoint(USER_WRITER), b"")
    assert outcome == b"" if is_believed else isinstance(outcome, Rejected)


def test_there_is_nothing_to_send_where_nobody_has_a_key() -> None:
    alice, bob = Side("alice"), Side("bob")
    introduce(alice, bob)
    writer = ids.SEDP_PUBLICATIONS_SECURE_WRITER
    stranger = Guid.of(bob.guid.prefix, ids.SEDP_PUBLICATIONS_SECURE_READER)
    assert alice.protect(writer, stranger, heartbeat(writer, stranger.entity_id)) == b""


def test_the_key_of_one_endpoint_speaks_for_no_other() -> None:
    alice, bob = trusting_pair()
    writer, reader = ids.SEDP_PUBLICATIONS_SECURE_WRITER, ids.SEDP_PUBLICATIONS_SECURE_READER
    forged = heartbeat(ids.SEDP_SUBSCRIPTIONS_SECURE_WRITER, reader)
    protected = alice.protect(writer, bob.endpoint(reader), forged)
    assert isinstance(bob.open(protected, alice), Rejected)


def test_info_ts_may_travel_under_the_key_of_a_writer() -> None:
    """Fast DDS sends it so."""
    alice, bob = trusting_pair()
    writer, reader = ids.SEDP_PUBLICATIONS_SECURE_WRITER, ids.SEDP_PUBLICATIONS_SECURE_READER
    info_ts = bytes.fromhex("09010800 0102030405060708")
    protected = alice.protect(writer, bob.endpoint(reader), info_ts)
    assert bytes(bob.open(protected, alice)) == info_ts  # type: ignore[arg-type]


def test_without_keys_nothing_opens() -> None:
    alice, bob = trusting_pair()
    stranger = Side("bob", seed=9)
    writer, reader = ids.SEDP_PUBLICATIONS_SECURE_WRITER, ids.SEDP_PUBLICATIONS_SECURE_READER
    protected = alice.protect(writer, bob.endpoint(reader), heartbeat(writer, reader))
    assert isinstance(stranger.open(protected, alice), NoKeys)
    assert isinstance(bob.open(protected, stranger), NoKeys)


@pytest.mark.parametrize(
    ("governance", "entity", "clear", "in_message", "in_both"),
    [
        ("governance", ids.SEDP_PUBLICATIONS_SECURE_WRITER, False, False, True),
        ("governance", VOLATILE_WRITER, False, False, True),
        ("governance", ids.SEDP_PUBLICATIONS_WRITER, False, True, True),
        ("governance", ids.PARTICIPANT_STATELESS_MESSAGE_WRITER, True, True, True),
        ("governance", ids.SPDP_WRITER, False, False, False),
        ("governance_data", ids.SEDP_PUBLICATIONS_WRITER, True, True, True),
        ("governance_data", ids.SPDP_WRITER, False, False, False),
    ],
)
def test_what_must_be_protected_is_told_by_governance_and_not_by_the_sender(
    governance: str, entity: EntityId, clear: bool, in_message: bool, in_both: bool
) -> None:
    alice, bob = trusting_pair(governance)
    sender = bob.endpoint(entity)
    assert alice.hooks.admits(sender, Level.NONE) is clear
    assert alice.hooks.admits(sender, Level.MESSAGE) is in_message
    assert alice.hooks.admits(sender, Level.MESSAGE | Level.SUBMESSAGE) is in_both


def test_cyclone_dds_may_discover_in_clear_as_it_knows_no_other_way() -> None:
    alice, bob = Side("alice"), Side("bob")
    bob.data = replace(bob.data, vendor_id=b"\x01\x10")
    introduce(alice, bob)
    assert alice.hooks.admits(bob.endpoint(ids.SEDP_PUBLICATIONS_WRITER), Level.NONE)
    assert not alice.hooks.admits(bob.endpoint(USER_WRITER), Level.NONE)


# --- refusals -------------------------------------------------------------------------------------------------------


def test_what_permissions_forbid_fails_the_call_and_names_document_and_right() -> None:
    carol = Side("carol")
    carol.hooks.local_reader(reader_data(carol))
    with pytest.raises(NotAllowedBySecurity, match=r"carol\.permissions\.p7s.*publish"):
        carol.hooks.local_writer(writer_data(carol))
    with pytest.raises(NotAllowedBySecurity, match="Secret"):
        carol.hooks.local_reader(reader_data(carol, "Secret"))


def test_a_remote_endpoint_without_the_right_is_refused_on_our_side_too() -> None:
    """Who lies about itself meets the same check here, by its signed permissions."""
    alice, carol = Side("alice"), Side("carol")
    introduce(alice, carol)
    match_builtin_topics(alice, carol)
    deliver(alice, carol)
    alice.hooks.local_reader(reader_data(alice))
    refusal = alice.match(USER_READER, carol, USER_WRITER, "Square")
    assert isinstance(refusal, Refused)
    assert "publish" in refusal.reason


def test_who_announces_no_identity_is_refused_where_governance_says_so() -> None:
    alice, bob = Side("alice"), Side("bob")
    for data in (
        replace(bob.data, security_parameters=()),
        replace(bob.data, builtin_endpoints=BuiltinEndpoints(0)),
    ):
        refusal = alice.hooks.remote_participant(data, 0.0)
        assert isinstance(refusal, Refused)
        assert "announces no identity" in refusal.reason


def test_another_governance_is_told_by_what_differs() -> None:
    alice, bob = Side("alice"), Side("bob", "governance_data")
    refusal = alice.hooks.remote_participant(bob.data, 0.0)
    assert isinstance(refusal, Refused)
    assert refusal.reason == (
        "its governance protects participants otherwise: rtps protected and discovery protected and liveliness "
        "protected and rtps encrypted and discovery encrypted and liveliness encrypted here, not there, and governance "
        "admits only authenticated participants"
    )
    assert alice.hooks.remote_participant_changed(replace(bob.data, entity_name="x"), 1.0) == refusal


def test_an_announcement_belongs_on_the_topic_that_governance_says() -> None:
    alice, bob = trusting_pair()
    assert alice.hooks.admits_announcement(writer_data(bob), is_secure=True)
    assert not alice.hooks.admits_announcement(writer_data(bob), is_secure=False)
    alice, bob = trusting_pair("governance_data")
    assert alice.hooks.admits_announcement(writer_data(bob), is_secure=False)


# --- messages -------------------------------------------------------------------------------------------------------


def _as_from(sender: Side, message: SendMessage, **changes: object) -> CacheChange:
    changed = replace(read_generic_message(message.change.payload), **changes)  # type: ignore[arg-type]
    return CacheChange(
        message.change.kind, Guid.of(sender.guid.prefix, message.writer), 1, write_generic_message(changed)
    )


def test_keys_for_others_are_passed_over_in_silence() -> None:
    """Fast DDS shows everybody all keys."""
    alice, bob = trusting_pair()
    alice.hooks.local_writer(writer_data(alice))
    alice.match(USER_WRITER, bob, USER_READER, "Square")
    alice.act()
    change = _as_from(alice, alice.under_way[0], destination_participant_guid=Guid(b"\x77" * 16))
    assert isinstance(bob.hooks.receive_message(change, 0.0), NotForUs)
    bob.act()


def test_nobody_brings_the_keys_of_another() -> None:
    alice, bob = trusting_pair()
    alice.hooks.local_writer(writer_data(alice))
    bob.hooks.local_reader(reader_data(bob))
    alice.match(USER_WRITER, bob, USER_READER, "Square")
    alice.act()
    other = Guid.of(Side("carol").guid.prefix, USER_WRITER)
    bob.hooks.receive_message(_as_from(alice, alice.under_way[0], source_endpoint_guid=other), 0.0)
    assert not bob.hooks._remotes[alice.guid.prefix].early


def test_a_message_whose_source_is_not_its_sender_is_not_read() -> None:
    alice, bob = trusting_pair()
    alice.hooks.local_writer(writer_data(alice))
    alice.match(USER_WRITER, bob, USER_READER, "Square")
    alice.act()
    identity = MessageIdentity(Guid.of(Side("carol").guid.prefix, VOLATILE_WRITER), 1)
    outcome = bob.hooks.receive_message(_as_from(alice, alice.under_way[0], message_identity=identity), 0.0)
    assert isinstance(outcome, Rejected)
    assert "not its sender" in outcome.reason


def test_early_keys_are_bounded() -> None:
    alice, bob = trusting_pair()
    alice.hooks.local_writer(writer_data(alice))
    alice.match(USER_WRITER, bob, USER_READER, "Square")
    alice.act()
    for key in range(2000):
        reader = Guid.of(bob.guid.prefix, EntityId.user(key, EntityKind.READER_WITH_KEY))
        bob.hooks.receive_message(_as_from(alice, alice.under_way[0], destination_endpoint_guid=reader), 0.0)
    assert len(bob.hooks._remotes[alice.guid.prefix].early) == 512


# --- the end --------------------------------------------------------------------------------------------------------


def test_nothing_stays_of_a_participant_that_is_gone() -> None:
    alice, bob = trusting_pair()
    alice.hooks.remote_participant_lost(bob.guid)
    alice.act()
    assert not alice.hooks._keys.pairs
    assert not alice.hooks._keys.by_remote
    assert not alice.hooks._keys.by_handle
    assert not alice.hooks._remotes


def test_it_may_come_back() -> None:
    alice, bob = trusting_pair()
    alice.hooks.remote_participant_lost(bob.guid)
    bob.hooks.remote_participant_lost(alice.guid)
    alice.decided.clear()
    bob.decided.clear()
    introduce(alice, bob)
    assert alice.has_admitted(bob)
    assert bob.has_admitted(alice)


@pytest.mark.parametrize("forgetful", ["alice", "bob"])
def test_who_forgot_the_other_is_authenticated_anew_and_gets_all_keys_again(forgetful: str) -> None:
    """Its lease ran out on one side only.  Alice begins handshakes, Bob asks for them."""
    alice, bob = trusting_pair()
    one, other = (alice, bob) if forgetful == "alice" else (bob, alice)
    one.hooks.remote_participant_lost(other.guid)
    for side in (one, other):
        side.decided.clear()
    one.hooks.remote_participant(other.data, 10.0)
    for step in range(60):
        now = 10.0 + step * 0.1
        one.hooks.handle_timeout(now)
        other.hooks.handle_timeout(now)
        deliver(alice, bob, now=now)
    assert one.has_admitted(other)
    assert other.has_admitted(one), "said once more: the core begins anew"
    match_builtin_topics(alice, bob)
    deliver(alice, bob, now=17.0)
    for side in (one, other):
        assert set(side.decided.values()) == {ADMITTED}
    writer, reader = ids.SEDP_PUBLICATIONS_SECURE_WRITER, ids.SEDP_PUBLICATIONS_SECURE_READER
    for sender, receiver in ((alice, bob), (bob, alice)):
        plain = heartbeat(writer, reader)
        protected = sender.protect(writer, receiver.endpoint(reader), plain)
        assert bytes(receiver.open(protected, sender)) == plain  # type: ignore[arg-type]


def test_nobody_is_taken_to_have_forgotten_us_who_still_has_our_keys() -> None:
    """A stranger asks for authentication in Bob's name, for a minute, while Bob's messages come as ever."""
    alice, bob = trusting_pair()
    alice.decided.clear()
    writer, reader = ids.SEDP_PUBLICATIONS_SECURE_WRITER, ids.SEDP_PUBLICATIONS_SECURE_READER
    source = bob.endpoint(ids.PARTICIPANT_STATELESS_MESSAGE_WRITER)
    for second in range(60):
        message = GenericMessage(
            message_identity=MessageIdentity(source, second + 50),
            destination_participant_guid=alice.guid,
            message_class_id=AUTH_REQUEST,
            message_data=(DataHolder("DDS:Auth:PKI-DH:1.0+AuthReq", (), (("future_challenge", bytes(32)),)),),
        )
        change = CacheChange(ChangeKind.ALIVE, source, second + 50, write_generic_message(message))
        alice.hooks.receive_message(change, float(second))
        alice.act(float(second))
        alice.open(bob.protect(writer, alice.endpoint(reader), heartbeat(writer, reader)), bob)
    assert not alice.decided
    assert not alice.under_way


def test_what_expires_is_taken_out_as_an_event() -> None:
    alice, bob = trusting_pair()
    alice.clock_ns = NOW_NS + 20 * 365 * 86_400 * 10**9
    alice.hooks.handle_timeout(alice.hooks.next_deadline())
    alice.act()
    (reason, *_) = alice.revoked
    assert reason.startswith("the identity certificate ended at 2036-11-19T00:28:0")
    refusal = alice.decided[(alice.guid, bob.guid)]
    assert isinstance(refusal, Refused)
    assert "ended at 2036-11-19T" in refusal.reason
    assert isinstance(alice.hooks.remote_participant(bob.data, 1.0), Refused), "nor is it asked again"


# --- the end --------------------------------------------------------------------------------------------------------


def alive(*kinds: type) -> dict[int, object]:
    return {id(found): found for found in gc.get_objects() if isinstance(found, kinds)}


@pytest.mark.parametrize("governance", GOVERNANCES)
def test_no_key_outlives_its_participant(governance: str) -> None:
    kinds = (KeyMaterial, ReceiverKey, SharedSecretHandle, Handshake, SoftwareKey)
    before = alive(*kinds)
    alice, bob = trusting_pair(governance)
    alice.hooks.local_writer(writer_data(alice))
    bob.hooks.local_reader(reader_data(bob))
    bob.match(USER_READER, alice, USER_WRITER, "Square")
    alice.match(USER_WRITER, bob, USER_READER, "Square")
    deliver(alice, bob)
    made = [found for name, found in alive(*kinds).items() if name not in before]
    assert {type(found) for found in made} >= {KeyMaterial, SharedSecretHandle, SoftwareKey}
    for side in (alice, bob):
        side.hooks.local_participant_deleted()
        assert side.hooks.drain_effects() == ()
        assert side.hooks.next_deadline() == math.inf
    for found in made:
        match found:
            case KeyMaterial():
                assert not any(found.master_sender_key), found
                assert not any(found.master_salt), found
                assert not any(found.master_receiver_specific_key), found
            case ReceiverKey():
                assert not any(found._master), found
            case SharedSecretHandle():
                assert found.shared_secret == b""
            case Handshake():
                assert not getattr(found, "secret", b"")
            case SoftwareKey():
                with pytest.raises(NotTrusted, match="returned"):
                    found.sign(b"")


def test_a_participant_that_cannot_be_made_keeps_no_key(monkeypatch: pytest.MonkeyPatch) -> None:
    returned: list[SoftwareKey] = []

    def close(key: SoftwareKey) -> None:
        returned.append(key)

    monkeypatch.setattr(SoftwareKey, "close", close)
    with pytest.raises(ConfigurationError, match="grant"):
        Side("alice", extra={"dds.sec.access.permissions": f"file:{KEYSTORE}/bob.permissions.p7s"})
    assert len(returned) == 1


# --- the factory ----------------------------------------------------------------------------------------------------


def test_without_security_properties_nobody_asks_it() -> None:
    assert load_hooks({"application.name": "x"}, entropy=bytes, wall_clock=lambda: 0) is PLAINTEXT


def test_it_is_made_for_this_version_of_the_seam() -> None:
    assert service.load.spi_version == SPI_VERSION


@pytest.mark.parametrize("missing", sorted(properties_of("alice")))
def test_a_property_that_is_missing_is_named(missing: str) -> None:
    properties = {name: Property(value) for name, value in properties_of("alice").items() if name != missing}
    hooks = load_hooks(properties, entropy=Random(0).randbytes, wall_clock=lambda: NOW_NS)
    with pytest.raises(ConfigurationError, match=missing.replace(".", r"\.")):
        from ddsi.spi import LocalParticipant

        hooks.local_participant(
            LocalParticipant(guid=Guid(bytes(15) + b"\1"), domain_id=1, domain_tag="", properties=properties)
        )


def test_a_generic_message_shows_no_key() -> None:
    alice, bob = trusting_pair()
    alice.hooks.local_writer(writer_data(alice))
    alice.match(USER_WRITER, bob, USER_READER, "Square")
    alice.act()
    message: GenericMessage = read_generic_message(alice.under_way[0].change.payload)
    key = message.message_data[0].binary_properties[0][1]
    assert key.hex() not in repr(message)
    assert repr(key) not in repr(message)
