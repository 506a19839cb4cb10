"""The capture file that a trace becomes: its octets, what tshark makes of it, and reading it back."""

import io
import shutil
import struct
import subprocess
from pathlib import Path

import pytest

from ddsi.structure.guid import GuidPrefix
from ddsi.structure.locator import Locator
from ddsi.trace.capture_file import CapturedDatagram, captured_messages, read_capture
from ddsi.trace.events import MessageReceived, MessageSent, Remark
from ddsi.trace.pcapng import PcapngSink

A = GuidPrefix(bytes.fromhex("01dd0000000000000000000a"))
B = GuidPrefix(bytes.fromhex("01dd0000000000000000000b"))
A_ADDRESS, B_ADDRESS = Locator.udp_v4("127.0.0.1", 7410), Locator.udp_v4("127.0.0.1", 7412)
GROUP = Locator.udp_v4("239.255.0.1", 7400)
V6 = Locator(2, 7400, bytes(15) + b"\x01")
# Header, INFO_DST to B, HEARTBEAT 1..5 #2 of the SEDP publications writer, final.
HEARTBEAT = (
    b"RTPS\x02\x04\x01\xdd" + A
    + b"\x0e\x01\x0c\x00" + B
    + b"\x07\x03\x1c\x00" + bytes.fromhex("000003c7000003c2")
    + struct.pack("<iIiII", 0, 1, 0, 5, 2)
)  # fmt: skip
# Header, ACKNACK base 4, missing 4 and 6, #1.
ACKNACK = (
    b"RTPS\x02\x04\x01\xdd" + B
    + b"\x06\x01\x1c\x00" + bytes.fromhex("000003c7000003c2")
    + struct.pack("<iIIII", 0, 4, 3, 0xA0000000, 1)
)  # fmt: skip


def test_octets_of_a_file() -> None:
    stream = io.BytesIO()
    PcapngSink(stream, epoch_offset=1.0, addresses={A: A_ADDRESS})(MessageSent(0.000_000_001, A, (GROUP,), b"RTPS"))
    octets = stream.getvalue()
    section = octets[:40]
    assert section == (
        struct.pack("<II", 0x0A0D0D0A, 40)  # block type, total length
        + struct.pack("<IHHq", 0x1A2B3C4D, 1, 0, -1)  # byte order, version 1.0, length unknown
        + struct.pack("<HH", 4, 4) + b"ddsi" + bytes(4)  # application; end of options
        + struct.pack("<I", 40)
    )  # fmt: skip
    interface = octets[40 : 40 + 64]
    assert interface == (
        struct.pack("<II", 1, 64)
        + struct.pack("<HHI", 101, 0, 0)  # RAW, reserved, no snap length
        + struct.pack("<HH", 2, 26) + b"01dd0000:00000000:0000000a" + bytes(2)  # name
        + struct.pack("<HH", 9, 1) + b"\x09" + bytes(3)  # resolution: 10^-9 s
        + bytes(4)
        + struct.pack("<I", 64)
    )  # fmt: skip
    packet = octets[40 + 64 :]
    assert packet[:28] == struct.pack("<IIIIIII", 6, 76, 0, 0, 1_000_000_001, 32, 32)
    assert packet[28:60][12:24] == bytes((127, 0, 0, 1, 239, 255, 0, 1)) + struct.pack(">HH", 7410, 7400)
    assert packet[56:60] == b"RTPS"
    assert packet[60:] == struct.pack("<HHI", 2, 4, 2) + bytes(4) + struct.pack("<I", 76)  # flags: outbound


def test_what_is_written_is_read_back() -> None:
    stream = io.BytesIO()
    sink = PcapngSink(stream, epoch_offset=1_700_000_000.0, addresses={A: A_ADDRESS, B: B_ADDRESS})
    sink(MessageSent(0.5, A, (B_ADDRESS, V6), HEARTBEAT))
    sink(Remark(0.6, A, "is no packet"))
    sink(MessageReceived(0.75, A, B_ADDRESS, ACKNACK))
    stream.seek(0)
    v6_loopback = Locator(2, 0, bytes(15) + b"\x01")
    assert list(read_capture(stream)) == [
        CapturedDatagram(1_700_000_000_500_000_000, A_ADDRESS, B_ADDRESS, HEARTBEAT),
        CapturedDatagram(1_700_000_000_500_000_000, v6_loopback, V6, HEARTBEAT),
        CapturedDatagram(1_700_000_000_750_000_000, B_ADDRESS, A_ADDRESS, ACKNACK),
    ]
    stream.seek(0)
    assert list(captured_messages(read_capture(stream))) == [
        MessageSent(0.0, A, (B_ADDRESS,), HEARTBEAT),
        MessageSent(0.0, A, (V6,), HEARTBEAT),
        MessageSent(0.25, B, (A_ADDRESS,), ACKNACK),
    ]


@pytest.mark.parametrize(("each_once", "count"), [(True, 1), (False, 3)])
def test_a_message_between_traced_participants_is_written_once(*, each_once: bool, count: int) -> None:
    stream = io.BytesIO()
    sink = PcapngSink(stream, each_once=each_once)
    sink(MessageSent(0.5, A, (GROUP,), HEARTBEAT))
    sink(MessageReceived(0.6, B, A_ADDRESS, HEARTBEAT))
    sink(MessageReceived(0.6, GroupMember, A_ADDRESS, HEARTBEAT))
    stream.seek(0)
    assert len(list(read_capture(stream))) == count


GroupMember = GuidPrefix(bytes(11) + b"\x0c")


def test_a_message_too_large_for_udp_is_counted() -> None:
    sink = PcapngSink(io.BytesIO())
    sink(MessageSent(0.5, A, (GROUP,), bytes(70_000)))
    assert sink.skipped_count == 1


@pytest.mark.skipif(shutil.which("tshark") is None, reason="tshark is not installed (Debian: apt install tshark)")
def test_tshark_decodes_the_file_as_rtps(tmp_path: Path) -> None:
    path = tmp_path / "trace.pcapng"
    with path.open("wb") as stream:
        sink = PcapngSink(stream, epoch_offset=1_700_000_000.25, addresses={A: A_ADDRESS, B: B_ADDRESS})
        sink(MessageSent(0.5, A, (GROUP, V6), HEARTBEAT))
        sink(MessageReceived(0.75, A, B_ADDRESS, ACKNACK))
    fields = ["frame.time_epoch", "frame.interface_name", "_ws.col.Protocol", "rtps.sm.id", "udp.checksum.status"]
    checks = ["-o", "udp.check_checksum:TRUE", "-o", "ip.check_checksum:TRUE"]
    command = [
        "tshark",
        "-n",
        "-r",
        str(path),
        *checks,
        "-T",
        "fields",
        *(word for name in fields for word in ("-e", name)),
    ]
    done = subprocess.run(command, capture_output=True, text=True, timeout=60, check=True)
    rows = [line.split("\t") for line in done.stdout.splitlines()]
    good = "1"
    assert rows == [
        ["1700000000.750000000", str(A), "RTPS", "0x0e,0x07", good],
        ["1700000000.750000000", str(A), "RTPS", "0x0e,0x07", good],
        ["1700000001.000000000", str(A), "RTPS", "0x06", good],
    ]
    expert = subprocess.run(
        ["tshark", "-n", "-r", str(path), *checks, "-Y", "_ws.malformed || _ws.expert.severity >= 0x600000"],
        capture_output=True,
        text=True,
        timeout=60,
        check=True,
    )
    assert expert.stdout == ""
