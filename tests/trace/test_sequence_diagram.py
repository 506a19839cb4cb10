"""The diagram, as it stands on the terminal."""

import textwrap

import pytest

from ddsi.messages.acknack import AckNack
from ddsi.messages.data import Data
from ddsi.messages.header import Header
from ddsi.messages.heartbeat import Heartbeat
from ddsi.messages.interpreter import InfoDestination, InfoTimestamp
from ddsi.messages.submessages import Submessage
from ddsi.structure.cache_change import ChangeKind
from ddsi.structure.guid import EntityId, GuidPrefix
from ddsi.structure.locator import Locator
from ddsi.structure.sequence_number import NumberSet
from ddsi.trace import events as e
from ddsi.trace.event import Category, TraceEvent
from ddsi.trace.reasons import DropReason
from ddsi.trace.sequence_diagram import SequenceDiagram, sequence_diagram
from tests.trace.samples import READER, SAMPLES, WRITER, A, B

C = GuidPrefix(bytes.fromhex("01dd0000000000000000000c"))
AT_A, AT_B = Locator.udp_v4("10.0.0.1", 7410), Locator.udp_v4("10.0.0.2", 7410)
GROUP = Locator.udp_v4("239.255.0.1", 7400)
W, R = WRITER.entity_id, READER.entity_id


def message(sender: GuidPrefix, *submessages: Submessage) -> bytes:
    return Header((2, 4), b"\x01\xdd", sender).encode() + b"".join(submessage.encode() for submessage in submessages)


def data(number: int) -> Data:
    return Data(EntityId.UNKNOWN, W, number, None, b"\x00\x01\x00\x00abcd")


def heartbeat(last: int, count: int) -> Heartbeat:
    return Heartbeat(EntityId.UNKNOWN, W, 1, last, count)


def lossy_link() -> list[TraceEvent]:
    """A writes two samples; the second is lost, and repaired."""
    first = message(A, InfoTimestamp(1), data(1))
    second = message(A, InfoTimestamp(2), data(2))
    beat = message(A, heartbeat(2, 1))
    nack = message(B, InfoDestination(A), AckNack(R, W, NumberSet.of(2, [2]), 1))
    repair = message(A, InfoDestination(B), InfoTimestamp(2), data(2))
    return [
        e.ParticipantCreated(5.0, A, 0, b"\x01\xdd", "writer"),
        e.ParticipantCreated(5.0, B, 0, b"\x01\xdd", "reader"),
        e.EndpointCreated(5.0, A, WRITER, "Square", "ShapeType"),
        e.EndpointCreated(5.0, B, READER, "Square", "ShapeType"),
        e.ChangeWritten(6.0, A, WRITER, 1, ChangeKind.ALIVE, 8),
        e.MessageSent(6.0, A, (GROUP,), first),
        e.MessageReceived(6.0005, B, AT_A, first),
        e.SampleDelivered(6.0005, B, READER, WRITER, 1),
        e.ChangeWritten(6.1, A, WRITER, 2, ChangeKind.ALIVE, 8),
        e.MessageSent(6.1, A, (GROUP,), second),
        e.LinkDropped(6.1, A, GROUP, second, "loss", B),
        e.TimerFired(6.2, A, "heartbeat", 6.2),
        e.MessageSent(6.2, A, (GROUP,), beat),
        e.LinkDelayed(6.2, A, GROUP, beat, 0.01, B),
        e.MessageReceived(6.2105, B, AT_A, beat),
        e.MessageSent(6.2105, B, (AT_A,), nack),
        e.MessageReceived(6.211, A, AT_B, nack),
        e.MessageSent(6.211, A, (AT_B,), repair),
        e.LinkDuplicated(6.211, A, AT_B, repair, 2, B),
        e.MessageReceived(6.2115, B, AT_A, repair),
        e.SampleDelivered(6.2115, B, READER, WRITER, 2),
        e.MessageReceived(6.2115, B, AT_A, repair),
        e.Dropped(6.2115, B, DropReason.DUPLICATE, AT_A, "#2", WRITER),
    ]


LOSSY_LINK = """
A = 01dd0000:00000000:0000000a  ddsi "writer"
B = 01dd0000:00000000:0000000b  ddsi "reader"

        time  A         B
    0.000000  ●         │     participant created in domain 0
    0.000000  │         ●     participant created in domain 0
    0.000000  ●         │     created writer Square@A (ShapeType)
    0.000000  │         ●     created reader Square@B (ShapeType)
    1.000000  ●         │     wrote Square #1 (8 octets)
    1.000500  ├────────▶│     DATA Square #1
    1.000500  │         ●     delivered Square #1 of A
    1.100000  ●         │     wrote Square #2 (8 octets)
    1.100000  ├┄┄┄┄✗    │     lost (loss): DATA Square #2
    1.200000  ├┄┄┄┄┄┄┄┄▶│     delayed by 10 ms: HEARTBEAT Square 1..2 count 1
    1.210500  ├────────▶│     HEARTBEAT Square 1..2 count 1
    1.211000  │◀────────┤     ACKNACK Square base 2 missing {2} count 1
    1.211000  ├┄┄┄┄┄┄┄┄▶│     duplicated, 2 in all: DATA Square #2
    1.211500  ├────────▶│     DATA Square #2
    1.211500  │         ●     delivered Square #2 of A
    1.211500  ├────────▶│     DATA Square #2
    1.211500  │         ●     dropped from Square@A: duplicate (#2)
"""


def test_a_lossy_link() -> None:
    assert "\n".join(sequence_diagram(lossy_link())) == LOSSY_LINK.strip()


def test_in_ascii() -> None:
    lines = list(sequence_diagram(lossy_link(), ascii_only=True))
    assert all(line.isascii() for line in lines)
    assert "    1.100000  |....x    |     lost (loss): DATA Square #2" in lines
    assert "    1.211000  |<--------|     ACKNACK Square base 2 missing {2} count 1" in lines


def test_colour_only_adds_escapes() -> None:
    plain, coloured = list(sequence_diagram(lossy_link())), list(sequence_diagram(lossy_link(), colour=True))
    lost = next(line for line in coloured if "lost (loss)" in line)
    assert "\x1b[31m" in lost
    stripped = [line.replace("\x1b[", "\x00") for line in coloured]
    for escape in ("0m", "1m", "2m", "31m", "32m", "33m", "34m", "35m", "36m"):
        stripped = [line.replace(f"\x00{escape}", "") for line in stripped]
    assert [line.rstrip() for line in stripped] == plain


def test_long_text_goes_on_below() -> None:
    many = message(A, *[heartbeat(last, last) for last in range(1, 5)])
    lines = list(sequence_diagram([e.MessageReceived(0.0, B, AT_A, many)], width=70))
    assert lines[4:] == [
        "    0.000000  │◀────────┤     HEARTBEAT writer 1 1..1 count 1,",
        "              │         │     HEARTBEAT writer 1 1..2 count 2,",
        "              │         │     HEARTBEAT writer 1 1..3 count 3,",
        "              │         │     HEARTBEAT writer 1 1..4 count 4",
    ]


def test_what_nobody_here_received_is_drawn_when_it_is_sent() -> None:
    """By INFO_DST, by multicast to those who showed themselves, by announced addresses, else beside the sender."""
    lines = sequence_diagram(
        [
            e.MessageSent(0.0, A, (GROUP,), message(A, heartbeat(1, 1))),
            e.MessageSent(0.1, B, (AT_A,), message(B, heartbeat(1, 1))),
            e.ParticipantDiscovered(0.2, A, READER.participant, b"\x01\x10", "", 10.0, (AT_B,)),
            e.MessageSent(0.3, A, (AT_B,), message(A, heartbeat(1, 2))),
            e.MessageSent(0.4, A, (AT_A, AT_B), message(A, InfoDestination(C), heartbeat(1, 3))),
            e.MessageSent(0.5, B, (GROUP,), message(B, heartbeat(1, 4))),
        ],
        width=120,
    )
    drawn = textwrap.dedent("""
            0.000000  ├──▶      │         │     to udpv4/239.255.0.1:7400: HEARTBEAT writer 1 1..1 count 1
            0.100000  │         ├──▶      │     to udpv4/10.0.0.1:7410: HEARTBEAT writer 1 1..1 count 1
            0.200000  ●         │         │     discovered B (Cyclone DDS, lease 10 s)
            0.300000  ├────────▶│         │     HEARTBEAT writer 1 1..1 count 2
            0.400000  ├─────────┼────────▶│     HEARTBEAT writer 1 1..1 count 3
            0.500000  │◀────────┤         │     HEARTBEAT writer 1 1..1 count 4
    """)
    assert [line.strip() for line in lines][5:] == [line.strip() for line in drawn.strip().splitlines()]


def test_the_same_octets_sent_again_and_received_by_nobody_are_drawn() -> None:
    octets = message(A, heartbeat(1, 1))
    lines = list(
        sequence_diagram(
            [
                e.MessageSent(0.0, A, (AT_B,), octets),
                e.MessageReceived(0.1, B, AT_A, octets),
                e.MessageSent(1.0, A, (AT_B,), octets),
            ]
        )
    )
    assert [line[:24] for line in lines[4:]] == ["    0.100000  ├────────▶", "    1.000000  ├──▶      "[:24]]


def test_own_and_foreign_messages_say_so() -> None:
    own = message(A, heartbeat(1, 1))
    for_c = message(B, InfoDestination(C), heartbeat(1, 1))
    lines = list(
        sequence_diagram(
            [
                e.MessageSent(0.0, A, (GROUP,), own),
                e.MessageReceived(0.1, A, AT_A, own),
                e.MessageReceived(0.2, A, AT_B, for_c),
                e.MessageReceived(0.3, A, AT_B, b"\x00"),
            ],
            width=120,
        )
    )
    assert [line[40:] for line in lines[5:]] == [
        "to udpv4/239.255.0.1:7400: HEARTBEAT writer 1 1..1 count 1",
        "own message: HEARTBEAT writer 1 1..1 count 1",
        "for C: HEARTBEAT writer 1 1..1 count 1",
        "from udpv4/10.0.0.2:7410: 1 octet, not an RTPS message",
    ]


def test_categories_choose_what_is_drawn() -> None:
    lines = list(sequence_diagram(lossy_link(), categories={Category.LINK}))
    assert [line.split()[0] for line in lines[4:]] == ["1.100000", "1.200000", "1.211000"]
    with_timers = list(sequence_diagram(lossy_link(), categories=set(Category)))
    assert "    1.200000  ●         │     timer heartbeat" in with_timers


@pytest.mark.parametrize("width", [60, 80, 200])
def test_more_participants_than_columns_share_the_last(width: int) -> None:
    prefixes = [GuidPrefix(b"\x01\xdd" + bytes(8) + number.to_bytes(2, "big")) for number in range(50)]
    events = [e.MessageReceived(0.0, prefixes[0], AT_B, message(prefix, heartbeat(1, 1))) for prefix in prefixes[1:]]
    lines = list(sequence_diagram(events, width=width))
    rows = [line for line in lines if line.startswith("    0.000000")]
    assert len(rows) == 49
    assert all(len(line) <= width for line in lines)
    assert lines[51].endswith("…")
    assert "AX to A: HEARTBEAT" in lines[-1] + lines[-2]


def test_line_by_line_a_newcomer_brings_a_new_head() -> None:
    diagram = SequenceDiagram()
    first = diagram.lines(e.Remark(0.0, A, "begins"))
    assert first == [f"A = {A}", "", "        time  A", "    0.000000  ●     begins"]
    second = diagram.lines(e.MessageReceived(0.5, A, AT_B, message(B, heartbeat(1, 1))))
    assert second == [
        "",
        f"B = {B}  ddsi",
        "",
        "        time  A         B",
        "    0.500000  │◀────────┤     HEARTBEAT writer 1 1..1 count 1",
    ]
    assert len(diagram.lines(e.Remark(1.0, B, "ends"))) == 1


def test_every_event_is_drawn_and_nothing_in_it_moves_the_cursor() -> None:
    evil = e.Remark(2.0, A, "a\r\n\x1b[2J\u202eb")
    lines = list(sequence_diagram([*SAMPLES, evil], categories=set(Category), width=150))
    assert all(line.isprintable() for line in lines)
    assert (
        sum(" ● " in line for line in lines) == len([s for s in SAMPLES if s.CATEGORY not in ("message", "link")]) + 2
    )


def test_nothing_gives_no_rows() -> None:
    assert list(sequence_diagram([])) == ["", "        time"]
