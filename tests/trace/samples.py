"""One event of each kind at least, between writer and reader of the topic Square."""

import math

from ddsi.structure.cache_change import ChangeKind
from ddsi.structure.guid import Guid, GuidPrefix
from ddsi.structure.locator import Locator
from ddsi.trace import events as e
from ddsi.trace.event import TraceEvent
from ddsi.trace.reasons import DropReason, LossReason, RejectReason, SampleLossReason, TypeStep

A = GuidPrefix(bytes.fromhex("01dd0000000000000000000a"))
B = GuidPrefix(bytes.fromhex("01dd0000000000000000000b"))
WRITER = Guid.of(A, bytes.fromhex("00000102"))
READER = Guid.of(B, bytes.fromhex("00000107"))
HERE = Locator.udp_v4("127.0.0.1", 7410)
V6 = Locator(2, 7411, bytes(15) + b"\x01")

SAMPLES: list[TraceEvent] = [
    e.MessageSent(1.25, A, (HERE, V6), b"RTPS"),
    e.MessageReceived(1.25, A, V6, b"RTPS\x00\xff"),
    e.Dropped(1.25, A, DropReason.UNKNOWN_WRITER, HERE, "before its announcement", WRITER),
    e.Dropped(1.25, A, DropReason.QUEUE_FULL, None),
    e.ParticipantCreated(0.0, A, 7, b"\x01\xdd", "nominé"),
    e.ParticipantClosed(9.5, A),
    e.ParticipantDiscovered(1.0, A, Guid.of(B, bytes.fromhex("000001c1")), b"\x01\x10", "", math.inf, (HERE,)),
    e.ParticipantChanged(1.0, A, Guid.of(B, bytes.fromhex("000001c1")), b"\x01\x10", "b", 10.0, ()),
    e.ParticipantLost(1.0, A, Guid.of(B, bytes.fromhex("000001c1")), LossReason.LEASE_EXPIRED, "10 s of silence"),
    e.EndpointCreated(1.0, A, WRITER, "Square", "ShapeType", (("reliability", "Reliable()"), ("history", "KeepAll()"))),
    e.EndpointClosed(1.0, A, WRITER),
    e.EndpointDiscovered(1.0, A, READER, "Square", "ShapeType"),
    e.EndpointChanged(1.0, A, READER, "Square", "ShapeType", (("partition", "Partition(names=[a])"),)),
    e.EndpointLost(1.0, A, READER, LossReason.GOODBYE),
    e.Matched(1.0, A, WRITER, READER, "Square"),
    e.Unmatched(1.0, A, WRITER, READER, "Square", LossReason.QOS_CHANGED),
    e.Incompatible(1.0, A, WRITER, READER, "Square", "reliability", "BestEffort()", "Reliable()"),
    e.TypesCompared(1.0, A, WRITER, READER, "Square", TypeStep.ASSIGNABLE, "another, and it fits"),
    e.TopicInconsistent(1.0, A, WRITER, READER, "Square", "ShapeType", "OtherType"),
    e.ChangeWritten(1.0, A, WRITER, 1 << 60, ChangeKind.NOT_ALIVE_DISPOSED, 24),
    e.SampleDelivered(1.0, B, READER, WRITER, 3),
    e.SampleLost(1.0, B, READER, WRITER, 4, 6, SampleLossReason.NOT_AVAILABLE),
    e.SampleRejected(1.0, B, READER, WRITER, 7, RejectReason.SAMPLES_LIMIT),
    e.Acknowledged(1.0, A, WRITER, READER, 3),
    e.TimerFired(1.0, A, "heartbeat", 0.999),
    e.LivelinessChanged(1.0, B, READER, WRITER, False),
    e.StatusChanged(1.0, B, READER, "subscription_matched", "1 writer"),
    e.SecurityEvent(1.0, A, READER, "handshake_failed", "the certificate has expired"),
    e.SecurityEvent(1.0, A, None, "governance_read"),
    e.LinkDropped(1.0, A, HERE, b"RTPS", "partition", B),
    e.LinkDelayed(1.0, A, HERE, b"RTPS", 0.25),
    e.LinkDuplicated(1.0, A, HERE, b"RTPS", 2),
    e.Remark(1.0, A, "B restarts"),
]
