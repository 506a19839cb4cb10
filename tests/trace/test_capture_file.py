"""Capture files of others: both formats, both byte orders, real ones, and broken ones."""

import contextlib
import io
import struct

import pytest
from hypothesis import given
from hypothesis import strategies as st

from ddsi.structure.errors import MalformedMessage
from ddsi.structure.locator import Locator
from ddsi.trace.capture_file import read_capture
from ddsi.trace.events import MessageSent
from ddsi.trace.ip_packet import udp_packet
from ddsi.trace.pcapng import PcapngSink

HERE, THERE = Locator.udp_v4("127.0.0.1", 7410), Locator.udp_v4("127.0.0.1", 7412)
PACKET = udp_packet(HERE, THERE, b"RTPS....")


def pcap(order: str, magic: int, *packets: bytes, link_type: int = 101, fraction: int = 250_000) -> bytes:
    octets = struct.pack(order + "IHHiIII", magic, 2, 4, 0, 0, 65535, link_type)
    for packet in packets:
        octets += struct.pack(order + "IIII", 1_700_000_000, fraction, len(packet), len(packet)) + packet
    return octets


def pcapng_block(order: str, block_type: int, body: bytes) -> bytes:
    length = struct.pack(order + "I", len(body) + 12)
    return struct.pack(order + "I", block_type) + length + body + length


def pcapng(order: str, *blocks: tuple[int, bytes]) -> bytes:
    section = (0x0A0D0D0A, struct.pack(order + "IHHq", 0x1A2B3C4D, 1, 0, -1))
    return b"".join(pcapng_block(order, *block) for block in (section, *blocks))


def interface(order: str, *options: tuple[int, bytes]) -> tuple[int, bytes]:
    body = struct.pack(order + "HHI", 101, 0, 0)
    for code, value in options:
        body += struct.pack(order + "HH", code, len(value)) + value + bytes(-len(value) % 4)
    return 1, body


def packet_block(
    order: str, units: int, packet: bytes, *, number: int = 0, original: int | None = None
) -> tuple[int, bytes]:
    lengths = (len(packet), len(packet) if original is None else original)
    head = struct.pack(order + "IIIII", number, units >> 32, units & 0xFFFFFFFF, *lengths)
    return 6, head + packet + bytes(-len(packet) % 4)


def times_ns(octets: bytes) -> list[int]:
    """The time of each datagram, once it is sure that it is ours."""
    datagrams = list(read_capture(io.BytesIO(octets)))
    assert all((d.source, d.destination, d.octets) == (HERE, THERE, b"RTPS....") for d in datagrams)
    return [datagram.time_ns for datagram in datagrams]


@pytest.mark.parametrize("order", ["<", ">"])
def test_pcap_in_both_byte_orders_and_resolutions(order: str) -> None:
    assert times_ns(pcap(order, 0xA1B2C3D4, PACKET, PACKET)) == [1_700_000_000_250_000_000] * 2
    assert times_ns(pcap(order, 0xA1B23C4D, PACKET)) == [1_700_000_000_000_250_000]


@pytest.mark.parametrize("order", ["<", ">"])
def test_pcapng_in_both_byte_orders_and_any_resolution(order: str) -> None:
    offset = struct.pack(order + "q", 1000)
    octets = pcapng(
        order,
        (0x80000001, b"unknown."),
        interface(order),  # microseconds, if nothing is said
        interface(order, (9, b"\x09"), (14, offset)),  # nanoseconds, from 1000 s on
        interface(order, (9, b"\x8a")),  # 2^-10 s
        packet_block(order, 5_000_001, PACKET),
        packet_block(order, (1 << 32) + 7, PACKET, number=1),
        packet_block(order, 512, PACKET, number=2),
        (3, struct.pack(order + "I", len(PACKET)) + PACKET),  # simple packet: no time
    )
    assert times_ns(octets) == [5_000_001_000, 1_000_000_000_000 + (1 << 32) + 7, 500_000_000, 0]


def test_a_second_section_has_its_own_byte_order_and_interfaces() -> None:
    first = pcapng("<", interface("<"), interface("<"), packet_block("<", 1, PACKET, number=1))
    second = pcapng(">", interface(">"), packet_block(">", 2, PACKET))
    assert times_ns(first + second) == [1000, 2000]
    with pytest.raises(MalformedMessage, match="interface 1 is not described"):
        times_ns(first + pcapng(">", interface(">"), packet_block(">", 2, PACKET, number=1)))


def test_a_packet_cut_by_the_snap_length_is_passed_over() -> None:
    assert times_ns(pcapng("<", interface("<"), packet_block("<", 1, PACKET[:30], original=len(PACKET)))) == []


@pytest.mark.parametrize(
    ("octets", "why"),
    [
        (b"", "the file ends"),
        (b"%PDF-1.4", "neither pcap nor pcapng"),
        (pcap("<", 0xA1B2C3D4)[:-1], "pcap header"),
        (pcap("<", 0xA1B2C3D4, PACKET)[:-1], "the file ends"),
        (pcap("<", 0xA1B2C3D4) + struct.pack("<IIII", 0, 0, 1 << 30, 1 << 30), "a frame of 1073741824 octets"),
        (b"\x0a\x0d\x0d\x0a\x1c\x00\x00\x00ABCD" + bytes(16), "no byte-order magic"),
        (pcapng("<")[:-4] + b"\x00\x00\x00\x00", "the two lengths of a block differ"),
        (pcapng("<") + struct.pack("<II", 5, 0xFFFFFFFC), "a block of 4294967292 octets"),
        (pcapng("<") + struct.pack("<II", 5, 13) + bytes(5), "a block of 13 octets"),
        (pcapng("<") + struct.pack("<II", 5, 8), "a block of 8 octets"),
        (pcapng("<", packet_block("<", 1, PACKET)), "interface 0 is not described"),
        (pcapng("<", interface("<"), (6, bytes(12) + struct.pack("<II", 99, 99))), "reaches beyond its block"),
        (pcapng("<", interface("<"), (6, bytes(16))), "too short"),
        (pcapng("<", (1, bytes(8) + struct.pack("<HH", 2, 50))), "reaches beyond its block"),
        (pcapng("<", (3, struct.pack("<I", 4) + bytes(4))), "of no interface"),
    ],
)
def test_a_broken_file_is_refused_with_the_reason(octets: bytes, why: str) -> None:
    with pytest.raises(MalformedMessage, match=why):
        list(read_capture(io.BytesIO(octets)))


def ours() -> bytes:
    stream = io.BytesIO()
    sink = PcapngSink(stream)
    for number in range(3):
        sink(MessageSent(float(number), b"prefix of 12", (THERE,), b"RTPS" + bytes(number)))  # type: ignore[arg-type]
    return stream.getvalue()


@pytest.mark.parametrize("whole", [ours(), pcap("<", 0xA1B2C3D4, PACKET, PACKET)], ids=["pcapng", "pcap"])
def test_every_prefix_gives_fewer_datagrams_or_malformed_message(whole: bytes) -> None:
    all_datagrams = list(read_capture(io.BytesIO(whole)))
    refused = 0
    for end in range(len(whole)):
        found = []
        try:
            for datagram in read_capture(io.BytesIO(whole[:end])):
                found.append(datagram)
        except MalformedMessage:
            refused += 1
        assert found == all_datagrams[: len(found)] != all_datagrams
    assert refused > len(whole) * 0.9


@given(st.data())
def test_a_changed_file_raises_nothing_but_malformed_message(data: st.DataObject) -> None:
    octets = bytearray(data.draw(st.sampled_from([ours(), pcap(">", 0xA1B23C4D, PACKET)])))
    for _ in range(data.draw(st.integers(1, 6))):
        octets[data.draw(st.integers(0, len(octets) - 1))] = data.draw(st.integers(0, 255))
    with contextlib.suppress(MalformedMessage):
        for datagram in read_capture(io.BytesIO(octets)):
            assert len(datagram.octets) <= len(octets)


@given(st.binary(max_size=200))
def test_noise_raises_nothing_but_malformed_message(noise: bytes) -> None:
    for head in (b"", pcap("<", 0xA1B2C3D4), pcapng("<", interface("<"))):
        with contextlib.suppress(MalformedMessage):
            list(read_capture(io.BytesIO(head + noise)))
