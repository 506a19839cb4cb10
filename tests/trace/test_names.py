"""Short names for GUIDs, learnt from events and messages."""

from ddsi.structure import builtin_entity_ids as ids
from ddsi.structure.guid import EntityId, Guid, GuidPrefix
from ddsi.structure.locator import Locator
from ddsi.trace import names as names_module
from ddsi.trace.events import EndpointCreated, ParticipantCreated, ParticipantDiscovered
from ddsi.trace.names import BUILTIN_NAMES, Names
from tests.trace.samples import READER, WRITER, A, B

HERE, GROUP = Locator.udp_v4("127.0.0.1", 7410), Locator.udp_v4("239.255.0.1", 7400)


def test_letters_follow_the_order_of_appearance() -> None:
    names = Names()
    prefixes = [GuidPrefix(number.to_bytes(12, "big")) for number in range(1, 30)]
    assert [names.letter(prefix) for prefix in prefixes][-4:] == ["Z", "AA", "AB", "AC"]
    assert names.letter(prefixes[0]) == "A"


def test_every_builtin_entity_has_a_name() -> None:
    endpoints = [getattr(ids, name) for name in ids.__all__ if name != "BuiltinEndpoints"]
    assert set(endpoints) <= set(BUILTIN_NAMES)
    assert Names().entity(A, ids.SEDP_PUBLICATIONS_READER) == "SEDP pub"


def test_endpoints_are_called_after_their_topics() -> None:
    names = Names()
    second_writer = Guid.of(A, EntityId.user(9, WRITER.entity_id[3]))  # type: ignore[arg-type]
    for endpoint in (WRITER, READER, second_writer, WRITER):
        names.learn_event(EndpointCreated(0.0, A, endpoint, "Square", "ShapeType"))
    assert [names.guid(guid) for guid in (WRITER, READER, second_writer)] == ["Square@A", "Square@B", "Square(2)@A"]
    assert names.entity(B, WRITER.entity_id) == "writer 1"
    assert names.guid(WRITER.participant) == "A"


def test_participants_get_vendor_name_and_addresses() -> None:
    names = Names()
    names.learn_event(ParticipantCreated(0.0, A, 0, b"\x01\xdd", "ours"))
    names.learn_event(ParticipantDiscovered(0.0, A, READER.participant, b"\x01\x10", "", 10.0, (HERE, GROUP)))
    assert str(names.participant(A)) == 'ddsi "ours"'
    assert str(names.participant(B)) == "Cyclone DDS"
    assert names.participant_at(HERE) == B
    assert names.participant_at(GROUP) is None


def test_a_header_does_not_overwrite_what_is_known() -> None:
    names = Names()
    names.learn_header(A, b"\x01\x0f")
    names.learn_header(A, b"\x01\x10")
    assert str(names.participant(A)) == "Fast DDS"


def test_tables_that_strangers_fill_are_bounded() -> None:
    names = Names()
    for number in range(names_module.MAX_PARTICIPANTS + 10):
        names.letter(GuidPrefix(number.to_bytes(12, "big")))
    assert len(names.participants) == names_module.MAX_PARTICIPANTS
    assert names.letter(A) == str(A)
