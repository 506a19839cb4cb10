"""Reads the captures that lie beside it: the UDP payloads of each, and the facts of its JSON file."""

from __future__ import annotations

import json
import struct
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any

HERE = Path(__file__).parent
SECURED = sorted(path.stem for path in HERE.glob("sec-*.pcap"))
PLAIN = sorted(path.stem for path in HERE.glob("*.pcap") if path.stem not in SECURED)


@dataclass(frozen=True)
class Capture:
    """``datagrams`` are the RTPS ones, in order; ``others`` counts those that are something else."""

    name: str
    datagrams: tuple[bytes, ...]
    others: int
    facts: dict[str, Any]


@cache
def load(name: str) -> Capture:
    payloads = list(_udp_payloads((HERE / f"{name}.pcap").read_bytes()))
    rtps = tuple(payload for payload in payloads if payload.startswith(b"RTPS"))
    facts = json.loads((HERE / f"{name}.json").read_text())
    return Capture(name, rtps, len(payloads) - len(rtps), facts)


def _udp_payloads(octets: bytes) -> Iterator[bytes]:
    """Every frame is Ethernet, IPv4 and UDP, none is an IP fragment: the captures were chosen so."""
    assert octets[:4] == b"\xd4\xc3\xb2\xa1", "classic pcap, little endian, microseconds"
    position = 24
    while position < len(octets):
        length, wire_length = struct.unpack_from("<II", octets, position + 8)
        assert length == wire_length, "nothing was cut off"
        ip = octets[position + 16 + 14 : position + 16 + length]
        position += 16 + length
        total_length = int.from_bytes(ip[2:4], "big")
        udp = ip[4 * (ip[0] & 15) : total_length]
        assert int.from_bytes(udp[4:6], "big") == len(udp)
        yield udp[8:]
