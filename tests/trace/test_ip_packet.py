"""IP and UDP headers around a message: the octets, the checksums, and taking them off again."""

import pytest

from ddsi.structure.locator import Locator
from ddsi.trace.ip_fragments import IpFragment, IpReassembler
from ddsi.trace.ip_packet import udp_datagram_of_frame, udp_packet

RAW, ETHERNET, NULL, SLL, SLL2 = 101, 1, 0, 113, 276
V4_SOURCE, V4_DESTINATION = Locator.udp_v4("192.168.0.1", 0x1234), Locator.udp_v4("192.168.0.199", 7400)
V6_SOURCE = Locator(2, 7411, bytes.fromhex("fe800000000000000000000000000001"))
V6_DESTINATION = Locator(2, 7400, bytes.fromhex("ff020000000000000000000000000001"))


def one_complement_sum(octets: bytes) -> int:
    """RFC 1071, the slow way: with the checksum inside, a correct packet gives 0xffff."""
    octets += bytes(len(octets) % 2)
    total = sum(int.from_bytes(octets[at : at + 2], "big") for at in range(0, len(octets), 2))
    while total >> 16:
        total = (total & 0xFFFF) + (total >> 16)
    return total


def test_ipv4_octets() -> None:
    packet = udp_packet(V4_SOURCE, V4_DESTINATION, b"RTPS!", identification=7)
    assert packet[:10].hex(" ") == "45 00 00 21 00 07 00 00 40 11"  # version, length 33, identification 7, TTL 64, UDP
    assert packet[12:20] == bytes((192, 168, 0, 1, 192, 168, 0, 199))
    assert packet[20:26].hex(" ") == "12 34 1c e8 00 0d"  # ports, length 13
    assert packet[28:] == b"RTPS!"
    assert one_complement_sum(packet[:20]) == 0xFFFF
    assert one_complement_sum(packet[12:20] + bytes((0, 17, 0, 13)) + packet[20:]) == 0xFFFF


def test_ipv6_octets() -> None:
    packet = udp_packet(V6_SOURCE, V6_DESTINATION, b"RTPS")
    assert packet[:8].hex(" ") == "60 00 00 00 00 0c 11 40"  # version 6, length 12, UDP, 64 hops
    assert packet[8:40] == V6_SOURCE.address + V6_DESTINATION.address
    assert packet[40:46].hex(" ") == "1c f3 1c e8 00 0c"  # ports, length 12
    assert one_complement_sum(packet[8:40] + bytes((0, 0, 0, 12, 0, 0, 0, 17)) + packet[40:]) == 0xFFFF


def test_a_udp_checksum_that_comes_out_as_zero_is_sent_as_all_ones() -> None:
    """RFC 768: zero would mean that there is none, which IPv6 forbids."""
    packet = udp_packet(V4_SOURCE, V4_DESTINATION, b"\x00\x00")
    needed = packet[26:28]  # with the checksum itself as data, the sum over everything is all ones
    assert udp_packet(V4_SOURCE, V4_DESTINATION, needed)[26:28] == b"\xff\xff"


@pytest.mark.parametrize(("source", "destination"), [(V4_SOURCE, V4_DESTINATION), (V6_SOURCE, V6_DESTINATION)])
@pytest.mark.parametrize("size", [0, 1, 20, 65507])
def test_what_is_put_around_a_message_comes_off_again(source: Locator, destination: Locator, size: int) -> None:
    octets = bytes(range(256)) * 256
    packet = udp_packet(source, destination, octets[:size])
    datagram = udp_datagram_of_frame(RAW, packet, IpReassembler())
    assert datagram is not None
    assert (datagram.source, datagram.destination, datagram.octets) == (source, destination, octets[:size])


def test_a_message_that_no_datagram_holds_is_refused() -> None:
    with pytest.raises(ValueError, match="65507"):
        udp_packet(V4_SOURCE, V4_DESTINATION, bytes(65508))


def test_locators_of_other_kinds_become_the_loopback() -> None:
    packet = udp_packet(Locator(16, 9, bytes(16)), Locator(16, 1 << 20 | 5, bytes(16)), b"")
    datagram = udp_datagram_of_frame(RAW, packet, IpReassembler())
    assert datagram is not None
    assert (str(datagram.source), str(datagram.destination)) == ("udpv4/127.0.0.1:9", "udpv4/127.0.0.1:5")


@pytest.mark.parametrize(
    ("link_type", "header"),
    [
        (ETHERNET, bytes(12) + b"\x08\x00"),
        (ETHERNET, bytes(12) + b"\x81\x00\x00\x05\x08\x00"),
        (ETHERNET, bytes(12) + b"\x88\xa8\x00\x05\x81\x00\x00\x05\x08\x00"),
        (NULL, b"\x02\x00\x00\x00"),
        (SLL, bytes(14) + b"\x08\x00"),
        (SLL2, b"\x08\x00" + bytes(18)),
        (RAW, b""),
    ],
    ids=["ethernet", "vlan", "two vlans", "null", "sll", "sll2", "raw"],
)
def test_link_layers(link_type: int, header: bytes) -> None:
    frame = header + udp_packet(V4_SOURCE, V4_DESTINATION, b"RTPS") + b"padding"
    datagram = udp_datagram_of_frame(link_type, frame, IpReassembler())
    assert datagram is not None
    assert datagram.octets == b"RTPS"


def test_what_is_no_whole_udp_datagram_is_passed_over() -> None:
    packet = udp_packet(V4_SOURCE, V4_DESTINATION, b"RTPS")
    v6_packet = udp_packet(V6_SOURCE, V6_DESTINATION, b"RTPS")
    arp = bytes(12) + b"\x08\x06" + bytes(28)
    tcp = packet[:9] + b"\x06" + packet[10:]
    for link_type, frame in [(ETHERNET, arp), (RAW, tcp), (RAW, b""), (RAW, b"\x00"), (999, packet)]:
        assert udp_datagram_of_frame(link_type, frame, IpReassembler()) is None
    for end in range(len(packet)):
        assert udp_datagram_of_frame(RAW, packet[:end], IpReassembler()) is None
    for end in range(len(v6_packet)):
        assert udp_datagram_of_frame(RAW, v6_packet[:end], IpReassembler()) is None


def ipv4_fragments(octets: bytes, *, size: int) -> list[bytes]:
    """The packet with these octets as a router would cut it."""
    whole = udp_packet(V4_SOURCE, V4_DESTINATION, octets, identification=77)
    header, body = whole[:20], whole[20:]
    fragments = []
    for offset in range(0, len(body), size):
        piece = body[offset : offset + size]
        more = 0x2000 if offset + size < len(body) else 0
        length, place = (20 + len(piece)).to_bytes(2, "big"), (more | offset // 8).to_bytes(2, "big")
        fragments.append(header[:2] + length + header[4:6] + place + header[8:] + piece)
    return fragments


@pytest.mark.parametrize("order", [1, -1])
def test_ipv4_fragments_are_joined_in_any_order(order: int) -> None:
    octets = bytes(range(250)) * 20
    reassembler = IpReassembler()
    results = [udp_datagram_of_frame(RAW, part, reassembler) for part in ipv4_fragments(octets, size=1480)[::order]]
    assert [result is not None for result in results] == [False, False, False, True]
    assert results[-1] is not None
    assert results[-1].octets == octets


def test_ipv6_fragments_are_joined() -> None:
    whole = udp_packet(V6_SOURCE, V6_DESTINATION, bytes(range(100)))
    header, body = whole[:40], whole[40:]

    def fragment(offset: int, piece: bytes, *, more: bool) -> bytes:
        extension = bytes((17, 0)) + (offset | more).to_bytes(2, "big") + b"\x00\x00\x00\x4d"
        return header[:4] + (8 + len(piece)).to_bytes(2, "big") + bytes((44,)) + header[7:] + extension + piece

    reassembler = IpReassembler()
    assert udp_datagram_of_frame(RAW, fragment(64, body[64:], more=False), reassembler) is None
    datagram = udp_datagram_of_frame(RAW, fragment(0, body[:64], more=True), reassembler)
    assert datagram is not None
    assert datagram.octets == bytes(range(100))


def test_fragments_that_never_complete_stay_within_a_bound() -> None:
    reassembler = IpReassembler()
    for number in range(1000):
        assert reassembler.add(number.to_bytes(4, "big"), IpFragment(0, bytes(8), True)) is None
    assert len(reassembler._partials) == 64
    # The oldest went, the newest are still there to be completed.
    assert reassembler.add((0).to_bytes(4, "big"), IpFragment(8, b"end", False)) is None
    assert reassembler.add((999).to_bytes(4, "big"), IpFragment(8, b"end", False)) == bytes(8) + b"end"


def test_overlapping_and_oversized_fragments_are_given_up() -> None:
    reassembler = IpReassembler()
    assert reassembler.add(b"a", IpFragment(0, bytes(16), True)) is None
    assert reassembler.add(b"a", IpFragment(0, bytes(16), True)) is None  # the same once more: nothing happens
    assert reassembler.add(b"a", IpFragment(8, bytes(16), False)) is None  # overlap
    assert reassembler.add(b"b", IpFragment(65528, bytes(16), False)) is None
    assert len(reassembler._partials) <= 1
