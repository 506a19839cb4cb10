"""Every event survives the way to JSON and back, and the schema names each of them."""

import inspect
import json

import pytest

from ddsi.structure.cache_change import ChangeKind
from ddsi.structure.discovered import DiscoveredParticipantData, DiscoveredWriterData
from ddsi.structure.locator import Locator
from ddsi.structure.qos import EndpointQos
from ddsi.structure.qos_policies import (
    DataRepresentation,
    DataRepresentationId,
    DataTags,
    KeepAll,
    Partition,
    Reliable,
    UserData,
)
from ddsi.trace import events as e
from ddsi.trace.event import Category, MalformedTrace, TraceEvent
from tests.trace.samples import HERE, READER, SAMPLES, V6, WRITER, A


def all_event_classes() -> set[type[TraceEvent]]:
    found = {value for value in vars(e).values() if inspect.isclass(value) and issubclass(value, TraceEvent)}
    return {event_type for event_type in found if not event_type.__name__.startswith("_")} - {TraceEvent}


def test_every_event_class_is_in_the_table_and_has_a_sample_here() -> None:
    assert set(e.EVENT_TYPES.values()) == all_event_classes()
    assert {type(sample) for sample in SAMPLES} == all_event_classes()


def test_names_and_categories_are_stable_words() -> None:
    for name, event_type in e.EVENT_TYPES.items():
        assert name == event_type.NAME
        expected = "".join(f"_{letter.lower()}" if letter.isupper() else letter for letter in event_type.__name__)
        assert name == expected.removeprefix("_")
        assert isinstance(event_type.CATEGORY, Category)
        assert event_type.__doc__


@pytest.mark.parametrize("sample", SAMPLES, ids=lambda sample: sample.NAME)
def test_an_event_survives_json(sample: TraceEvent) -> None:
    text = json.dumps(sample.to_json(), allow_nan=False)
    assert e.from_json(json.loads(text)) == sample


def test_the_json_form_is_readable() -> None:
    assert e.MessageSent(1.25, A, (HERE, V6), b"RTPS").to_json() == {
        "event": "message_sent",
        "now": 1.25,
        "participant": "01dd0000:00000000:0000000a",
        "destinations": ["udpv4/127.0.0.1:7410", "udpv6/[::1]:7411"],
        "octets": "52545053",
    }
    assert e.ChangeWritten(1.0, A, WRITER, 5, ChangeKind.ALIVE, 24).to_json() == {
        "event": "change_written",
        "now": 1.0,
        "participant": "01dd0000:00000000:0000000a",
        "writer": "01dd0000:00000000:0000000a:00000102",
        "sequence_number": 5,
        "kind": "alive",
        "payload_octets": 24,
    }


@pytest.mark.parametrize(
    "locator",
    [
        HERE,
        V6,
        Locator(1, 7400, b"\x01" + bytes(11) + b"\x7f\x00\x00\x01"),  # UDPv4 with octets where zeros belong
        Locator(-1, 0, bytes(16)),
        Locator(19, 5, bytes(range(16))),
        Locator(0x4FFF0000, 0xFFFFFFFF, bytes(16)),
    ],
)
def test_every_locator_survives_json(locator: Locator) -> None:
    event = e.MessageReceived(0.0, A, locator, b"")
    assert e.from_json(event.to_json()) == event


@pytest.mark.parametrize(
    "change",
    [
        {"event": "no_such"},
        {"event": 5},
        {"now": "soon"},
        {"now": True},
        {"participant": "01dd"},
        {"octets": "5254505"},
        {"octets": 5},
        {"destinations": "udpv4/127.0.0.1:7410"},
        {"destinations": ["udpv4/127.0.0.300:7410"]},
        {"destinations": ["carrier pigeon"]},
        {"destinations": [None]},
    ],
    ids=str,
)
def test_what_is_no_event_is_refused(change: dict[str, object]) -> None:
    form = e.MessageSent(1.25, A, (HERE,), b"RTPS").to_json()
    with pytest.raises(MalformedTrace):
        e.from_json({**form, **change})
    del form["octets"]
    with pytest.raises(MalformedTrace, match="octets"):
        e.from_json(form)


def test_a_field_with_a_default_may_be_absent_and_an_unknown_one_is_left_out() -> None:
    form = e.LinkDropped(1.0, A, HERE, b"RTPS").to_json()
    del form["reason"]
    assert e.from_json({**form, "from_a_later_version": 1}) == e.LinkDropped(1.0, A, HERE, b"RTPS")


def test_discovery_events_are_made_from_discovered_data() -> None:
    announced = DiscoveredParticipantData(
        guid=READER.participant, vendor_id=b"\x01\x10", metatraffic_unicast=(HERE,), default_unicast=(HERE, V6)
    )
    assert e.ParticipantDiscovered.of(1.0, A, announced) == e.ParticipantDiscovered(
        1.0, A, READER.participant, b"\x01\x10", "", 100.0, (HERE, V6)
    )
    qos = EndpointQos(
        reliability=Reliable(),
        history=KeepAll(),
        partition=Partition("a", "b*"),
        data_representation=DataRepresentation(DataRepresentationId.XCDR2, DataRepresentationId.XCDR1),
        user_data=UserData(b"mine"),
        data_tags=DataTags(("class", "secret"), ("by", "us")),
    )
    writer = DiscoveredWriterData(guid=WRITER, topic_name="Square", type_name="ShapeType", qos=qos)
    event = e.EndpointCreated.of(1.0, A, writer)
    assert type(event) is e.EndpointCreated
    assert event.qos == (
        ("reliability", "Reliable(max_blocking_time=0.1)"),
        ("history", "KeepAll()"),
        ("partition", "Partition('a', 'b*')"),
        ("data_tags", "DataTags(('class', 'secret'), ('by', 'us'))"),
        ("data_representation", "DataRepresentation(XCDR2, XCDR1)"),
    )
