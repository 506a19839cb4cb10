"""PLAINTEXT answers every hook, changes nothing and keeps nothing."""

from __future__ import annotations

import inspect
import math

from ddsi.spi import (
    ADMITTED,
    NO_OVERHEAD,
    NOT_FOR_US,
    PLAINTEXT,
    Announcement,
    LocalParticipant,
    ProtectedEndpoint,
    Protection,
    SecurityHooks,
)
from ddsi.structure.builtin_entity_ids import BuiltinEndpoints
from ddsi.structure.discovered import DiscoveredParticipantData, DiscoveredReaderData
from ddsi.structure.guid import EntityId, Guid, GuidPrefix
from ddsi.structure.qos import EndpointQos
from ddsi.structure.security_information import EndpointSecurity, ParticipantSecurity

PREFIX = GuidPrefix(b"p" * 12)
GUID = Guid.of(PREFIX, EntityId.PARTICIPANT)
READER = DiscoveredReaderData(
    guid=Guid.of(PREFIX, EntityId(b"\0\0\1\4")), topic_name="t", type_name="T", qos=EndpointQos()
)


def test_it_answers_every_hook_of_the_protocol() -> None:
    """A hook that is added to the protocol and forgotten here would fail at a user's, not in a test."""
    hooks: SecurityHooks = PLAINTEXT
    for name, member in inspect.getmembers(SecurityHooks, inspect.isfunction):
        if name.startswith("_"):
            continue
        ours = getattr(hooks, name)
        assert list(inspect.signature(ours).parameters) == list(inspect.signature(member).parameters)[1:], name


def test_everybody_is_admitted_as_he_is() -> None:
    candidate = LocalParticipant(guid=GUID, domain_id=0, domain_tag="", properties={})
    assert PLAINTEXT.local_participant(candidate) == GUID
    assert PLAINTEXT.remote_participant(DiscoveredParticipantData(guid=GUID), 0.0) is ADMITTED
    assert PLAINTEXT.remote_participant_changed(DiscoveredParticipantData(guid=GUID), 0.0) is ADMITTED
    assert PLAINTEXT.match(GUID, READER) is ADMITTED
    assert PLAINTEXT.admits_announcement(READER, is_secure=False)
    assert all(PLAINTEXT.admits(GUID, protection) for protection in Protection)
    assert PLAINTEXT.admits(GUID, Protection.NONE)


def test_nothing_is_announced_and_no_endpoint_protected() -> None:
    announcement = PLAINTEXT.announcement()
    assert announcement == Announcement((), BuiltinEndpoints(0), ())
    for protection in (PLAINTEXT.local_reader(READER), PLAINTEXT.local_endpoint_changed(READER)):
        assert protection == ProtectedEndpoint(
            (), discovery_protected=False, liveliness_protected=False, key_protected=False
        )
    assert not PLAINTEXT.protects_payload(GUID)


def test_nobody_is_authenticated_and_nothing_is_said_to_be_protected() -> None:
    assert PLAINTEXT.participant_security(GUID) == ParticipantSecurity(is_authenticated=False, subject_name="")
    assert PLAINTEXT.endpoint_security(READER) == EndpointSecurity(is_authenticated=False, subject_name="")
    assert not PLAINTEXT.opens_after_joining(GUID)


def test_octets_pass_as_they_are_and_are_not_copied() -> None:
    octets = bytearray(b"octets")
    parts = (b"a", b"b")
    assert PLAINTEXT.encode_payload(GUID, octets) is octets
    assert PLAINTEXT.decode_payload(GUID, octets) is octets
    assert PLAINTEXT.encode_submessage(GUID, (), parts) is parts
    assert PLAINTEXT.encode_message((), parts) is parts
    assert PLAINTEXT.overhead(GUID, ()) is NO_OVERHEAD


def test_what_is_protected_cannot_be_for_us() -> None:
    assert PLAINTEXT.decode_submessage(b"", PREFIX) is NOT_FOR_US
    assert PLAINTEXT.decode_message(b"", PREFIX) is NOT_FOR_US


def test_it_wants_nothing() -> None:
    PLAINTEXT.handle_timeout(1.0)
    PLAINTEXT.unmatch(GUID, GUID)
    PLAINTEXT.remote_endpoint_lost(GUID)
    PLAINTEXT.remote_participant_lost(GUID)
    PLAINTEXT.local_endpoint_deleted(GUID)
    assert PLAINTEXT.next_deadline() == math.inf
    assert list(PLAINTEXT.drain_effects()) == []


def test_properties_of_a_candidate_are_not_shown() -> None:
    candidate = LocalParticipant(guid=GUID, domain_id=0, domain_tag="", properties={"dds.sec.auth.password": "secret"})
    assert "secret" not in repr(candidate)
