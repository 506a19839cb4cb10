"""The plain hooks let everything pass as it is, and implement the whole protocol."""

from __future__ import annotations

import inspect

from ddsi.spi import ADMITTED, NO_OVERHEAD, NOT_FOR_US, PLAINTEXT, LocalParticipant, SecurityHooks
from ddsi.structure.discovered import DiscoveredParticipantData
from ddsi.structure.guid import GUID_UNKNOWN, Guid, GuidPrefix

GUID = Guid(bytes(range(16)))


def test_it_answers_every_hook() -> None:
    hooks: SecurityHooks = PLAINTEXT
    asked = {name for name, _ in inspect.getmembers(SecurityHooks, inspect.isfunction) if not name.startswith("_")}
    assert asked <= {name for name, _ in inspect.getmembers(hooks, inspect.ismethod)}


def test_participants_stay_who_they_are_and_everybody_is_admitted() -> None:
    candidate = LocalParticipant(guid=GUID, domain_id=0, domain_tag="", properties={})
    assert PLAINTEXT.local_participant(candidate) == GUID
    assert PLAINTEXT.remote_participant(DiscoveredParticipantData(guid=GUID), 0.0) is ADMITTED
    assert PLAINTEXT.announcement().parameters == ()


def test_octets_go_out_as_they_are() -> None:
    parts = (b"head", memoryview(b"payload"))
    assert PLAINTEXT.encode_submessage(GUID, (GUID_UNKNOWN,), parts) is parts
    assert PLAINTEXT.encode_message((), parts) is parts
    assert PLAINTEXT.encode_payload(GUID, parts[1]) is parts[1]
    assert PLAINTEXT.overhead(GUID, ()) is NO_OVERHEAD


def test_clear_octets_come_in_and_protected_ones_are_for_others() -> None:
    payload = memoryview(b"payload")
    assert PLAINTEXT.decode_payload(GUID, payload) is payload
    assert PLAINTEXT.decode_message(payload, GuidPrefix(GUID[:12])) is NOT_FOR_US
    assert PLAINTEXT.decode_submessage(payload, GuidPrefix(GUID[:12])) is NOT_FOR_US
    assert PLAINTEXT.admits_clear_message(GUID[:12])
    assert PLAINTEXT.admits_clear_submessage(GUID)


def test_properties_of_a_candidate_are_not_shown() -> None:
    candidate = LocalParticipant(guid=GUID, domain_id=0, domain_tag="", properties={"dds.sec.auth.password": "secret"})
    assert "secret" not in repr(candidate)
