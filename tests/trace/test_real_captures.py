"""Captures of real vendors, through the reader and the diagram."""

import io

import pytest

from ddsi.trace.capture_file import captured_messages, read_capture
from ddsi.trace.pcapng import PcapngSink
from ddsi.trace.sequence_diagram import sequence_diagram
from tests.captures.capture import HERE, PLAIN, SECURED, load


def messages_of(name: str) -> list[bytes]:
    with (HERE / f"{name}.pcap").open("rb") as stream:
        return [event.octets for event in captured_messages(read_capture(stream))]


def diagram_of(name: str) -> list[str]:
    with (HERE / f"{name}.pcap").open("rb") as stream:
        return list(sequence_diagram(captured_messages(read_capture(stream)), width=160))


@pytest.mark.parametrize("name", [*PLAIN, *SECURED])
def test_the_reader_finds_what_an_independent_one_finds(name: str) -> None:
    capture = load(name)
    assert messages_of(name) == list(capture.datagrams)
    with (HERE / f"{name}.pcap").open("rb") as stream:
        assert len(list(read_capture(stream))) == len(capture.datagrams) + capture.others


@pytest.mark.parametrize("name", [*PLAIN, *SECURED])
def test_a_capture_is_drawn_without_anything_that_is_not_understood(name: str) -> None:
    lines = diagram_of(name)
    text = "\n".join(lines)
    assert "malformed" not in text
    assert "unknown submessage" not in text
    assert len(lines) > len(load(name).datagrams)
    assert all(line.isprintable() and len(line) <= 160 for line in lines)
    assert any("DATA SPDP #1" in line for line in lines)


def test_a_conversation_between_two_vendors_reads_well() -> None:
    lines = diagram_of("cyclone-to-fastdds")
    assert lines[0].endswith("  Cyclone DDS")
    assert lines[1].endswith('  Fast DDS "alice"')
    text = "\n".join(line[14:] for line in lines)
    expected = [
        "├────────▶│     DATA SEDP pub #1: Square (ShapeType)",
        "├────────▶│     DATA Square #1, HEARTBEAT Square 1..1 count 2",
        "│◀────────┤     ACKNACK Square base 2 count 1 final",
        "├────────▶│     DATA Square #6 dispose, HEARTBEAT Square 2..6 count 7 final",
    ]
    at = -1
    for line in expected:
        at = text.find(line, at + 1)
        assert at >= 0, line


def test_protected_submessages_are_named_as_such() -> None:
    text = "\n".join(diagram_of(SECURED[0]))
    assert "protected AES256_GCM Kx key[" in text
    assert "without its end" not in text


def test_a_capture_survives_being_written_as_pcapng() -> None:
    with (HERE / "dust-to-cyclone.pcap").open("rb") as stream:
        events = list(captured_messages(read_capture(stream)))
    written = io.BytesIO()
    sink = PcapngSink(written)
    for event in events:
        sink(event)
    written.seek(0)
    again = list(captured_messages(read_capture(written)))
    assert [(event.participant, event.destinations, event.octets) for event in again] == [
        (event.participant, event.destinations, event.octets) for event in events
    ]
    assert [event.now for event in again] == pytest.approx([event.now for event in events], abs=2e-9)
