"""tshark reads what we send: no packet of ours is malformed, and nothing in it is unknown."""

from __future__ import annotations

import struct
import sys
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from .framework import Namespace, async_test, capture, namespace, scenario
from .matrix import find_case
from .matrix.dissection import OUR_PACKETS, complaints
from .matrix.stories import Cast, Story, deliver, deliver_late
from .peers.catalogue import CYCLONE_C, FAST_DDS, OURS
from .peers.options import Options
from .peers.peer import Peer

KEYED = Options(dispose=True)
PLAYS: dict[str, tuple[Story, Options, dict[str, Any]]] = {
    "keyed": (deliver, KEYED, {}),
    "xcdr2": (deliver, replace(KEYED, representation=2), {}),
    "appendable": (deliver, Options(appendable=True, representation=2), {}),
    "unregister": (deliver, Options(unregister=True), {}),
    "late": (deliver_late, Options(keyless=True), {"readers": 0}),
    "fragments": (deliver, Options(keyless=True, topic="Blob", blob_octets=200_000, count=2), {}),
    "unicast": (deliver, Options(unicast=True, partitions=("a", "b*")), {}),
}


@pytest.mark.parametrize("name", PLAYS)
@async_test
async def test_what_we_send_to_ourselves_is_well_formed(name: str, tmp_path: Path) -> None:
    """Discovery, data, dispose, unregister, history, fragments and goodbye, as both of our sides send them."""
    await check_our_packets(name, OURS, OURS, tmp_path)


@pytest.mark.peers
@pytest.mark.parametrize("name", ["keyed", "late", "fragments"])
@pytest.mark.parametrize(("publisher", "subscriber"), [(OURS, CYCLONE_C), (CYCLONE_C, OURS)])
@async_test
async def test_what_we_send_to_cyclone_is_well_formed(
    name: str, publisher: Peer, subscriber: Peer, tmp_path: Path
) -> None:
    """The same where a peer of another make asks the questions."""
    await check_our_packets(name, publisher, subscriber, tmp_path)


@pytest.mark.parametrize("governance", ["encrypt-all", "sign-all", "all-origin"])
@async_test
async def test_what_we_protect_is_well_formed(governance: str, tmp_path: Path) -> None:
    """Secured: the handshake, and all envelopes; what is signed only is read within them too."""
    case = find_case(governance)
    await run_and_check(case.story, case.publisher_options(), case.subscriber_options(), OURS, OURS, tmp_path)


async def check_our_packets(name: str, publisher: Peer, subscriber: Peer, folder: Path) -> None:
    story, options, changes = PLAYS[name]
    await run_and_check(story, replace(options, **changes), options, publisher, subscriber, folder)


async def run_and_check(
    story: Story, written: Options, read: Options, publisher: Peer, subscriber: Peer, folder: Path
) -> None:
    publisher.locate()
    subscriber.locate()
    with namespace() as host:
        async with capture(host, folder / "run.pcapng") as captured:
            await play(story, written, read, publisher, subscriber, host)
        assert captured.count(f"rtps && {OUR_PACKETS}") > 10
        assert complaints(captured) == []


async def play(
    story: Story, written: Options, read: Options, publisher: Peer, subscriber: Peer, host: Namespace
) -> None:
    async with scenario(f"dissection of {publisher} to {subscriber}", deadline=60) as stage:
        await story(Cast(stage, host, host, publisher, subscriber, written, read))


# --- that the check can fail -----------------------------------------------------------------------------------


def message(*submessages: bytes) -> bytes:
    return b"RTPS\x02\x04\x01\xdd" + bytes(12) + b"".join(submessages)


def submessage(kind: int, body: bytes, flags: int = 1) -> bytes:
    return struct.pack("<BBH", kind, flags, len(body)) + body


def announcement(*parameters: bytes) -> bytes:
    """A DATA of SPDP with these parameters."""
    head = struct.pack("<HH4s4sq", 0, 16, b"\0\0\0\0", b"\0\1\0\xc2", 1 << 32)
    return submessage(0x15, head + b"\x00\x03\x00\x00" + b"".join(parameters) + struct.pack("<HH", 1, 0), flags=5)


GOOD = message(submessage(0x09, bytes(8)), announcement(struct.pack("<HHBBH", 0x15, 4, 2, 4, 0)))
WRONG = {
    "a submessage nobody knows": (message(submessage(0x7F, bytes(4))), "submessageId: Unknown"),
    "a submessage of a vendor": (message(submessage(0x80, bytes(4))), "submessageId: Vendor-specific"),
    "a parameter nobody knows": (message(announcement(struct.pack("<HHI", 0x00F5, 4, 0))), "parameterId: Unknown"),
    "a heartbeat cut short": (message(submessage(0x07, bytes(10))), "should be >= 28"),
}


@async_test
async def test_well_formed_packets_raise_no_complaint(tmp_path: Path) -> None:
    """The hand-made packets below are wrong only where they are meant to be."""
    with namespace() as host:
        async with capture(host, tmp_path / "good.pcapng") as captured:
            send_in(host, GOOD)
        assert captured.count(f"rtps && {OUR_PACKETS}") == 1
        assert complaints(captured) == []


@pytest.mark.parametrize("what", WRONG)
@async_test
async def test_packets_that_are_wrong_raise_a_complaint(what: str, tmp_path: Path) -> None:
    """A check that cannot fail says nothing."""
    datagram, complaint = WRONG[what]
    with namespace() as host:
        async with capture(host, tmp_path / "wrong.pcapng") as captured:
            send_in(host, datagram)
        assert any(complaint in line for line in complaints(captured))


@pytest.mark.peers
@async_test
async def test_others_do_raise_complaints(tmp_path: Path) -> None:
    """Fast DDS ends every message with a submessage of its own: seen if asked for, not counted as ours."""
    FAST_DDS.locate()
    with namespace() as host:
        async with capture(host, tmp_path / "fastdds.pcapng") as captured:
            await play(deliver, Options(keyless=True), Options(keyless=True), FAST_DDS, FAST_DDS, host)
        assert complaints(captured) == []
        assert complaints(captured, "rtps.vendorId == 0x010f") != []


def send_in(host: Namespace, datagram: bytes) -> None:
    program = f"import socket; socket.socket(2, 2).sendto({datagram!r}, ('127.0.0.1', 7410))"
    host.run(sys.executable, "-c", program)
