"""Every event in words."""

import pytest

from ddsi.trace import events as e
from ddsi.trace.event import Category, TraceEvent
from ddsi.trace.event_text import event_text
from ddsi.trace.names import Names
from ddsi.trace.reasons import DropReason
from tests.trace.samples import SAMPLES, A

TEXTS = """
message_sent
message_received
dropped from Square@A: unknown_writer (before its announcement)
dropped: queue_full
participant created in domain 7
participant closed
discovered B (Cyclone DDS, lease infinite)
B changed
lost B: lease_expired (10 s of silence)
created writer Square@A (ShapeType), Reliable(), KeepAll()
closed writer Square@A
discovered reader Square@B (ShapeType)
reader Square@B changed, Partition(names=[a])
lost reader Square@B: goodbye
matched writer Square@A with reader Square@B
unmatched Square@A from Square@B: qos_changed
no match of Square@A and Square@B: reliability offered BestEffort(), requested Reliable()
types of Square@A and Square@B: assignable (another, and it fits)
no match of Square@A and Square@B: type ShapeType here, OtherType there
disposed Square #1152921504606846976 (24 octets)
delivered Square #3 of A
lost Square #4..6 of A: not_available
rejected Square #7 of A: samples_limit
Square@B has Square up to #3
timer heartbeat (1 ms late)
Square@A is not alive for Square
subscription_matched of Square@B (1 writer)
security: handshake_failed Square@B (the certificate has expired)
security: governance_read
lost (partition)
delayed by 250 ms
duplicated, 2 in all
B restarts
""".strip().splitlines()


def known_names() -> Names:
    names = Names()
    for event in SAMPLES:
        names.learn_event(event)
    return names


@pytest.mark.parametrize(("event", "text"), list(zip(SAMPLES, TEXTS, strict=True)), ids=TEXTS)
def test_texts(event: TraceEvent, text: str) -> None:
    assert event_text(event, known_names()) == text


def test_only_messages_are_left_to_be_described_elsewhere() -> None:
    for event in SAMPLES:
        assert (event_text(event, known_names()) == event.NAME) == (event.CATEGORY is Category.MESSAGE)


def test_foreign_details_stay_on_the_line() -> None:
    event = e.Dropped(0.0, A, DropReason.MALFORMED_MESSAGE, None, "x\n\x1b[31m" + "y" * 500)
    text = event_text(event, Names())
    assert text.isprintable()
    assert len(text) < 220
