"""Strangers on a real network: nobody is made to send more to a victim than he was asked, on a capture."""

from __future__ import annotations

import json
import sys
from pathlib import Path

import pytest
import trio

from ddsi.simulation.invariants import is_announcement

from .framework import async_test, capture, namespace, scenario
from .peers.keystore import shared_keystore
from .peers.peer import network_environment

SOURCE, VICTIM = "127.0.0.66", "127.0.0.77"
DOMAIN, PORT = 1, 7660
"""The port that the first participant of that domain hears announcements on."""

LISTENER = """
import sys
import trio, ddsi

async def main(keystore):
    qos = ddsi.Qos(properties={
        "dds.sec.auth.identity_ca": f"file:{keystore}/identity_ca.pem",
        "dds.sec.auth.identity_certificate": f"file:{keystore}/alice.pem",
        "dds.sec.auth.private_key": f"file:{keystore}/alice.key",
        "dds.sec.access.permissions_ca": f"file:{keystore}/permissions_ca.pem",
        "dds.sec.access.governance": f"file:{keystore}/encrypt-all.p7s",
        "dds.sec.access.permissions": f"file:{keystore}/alice.permissions.p7s",
    }) if keystore else None
    async with ddsi.DomainParticipant(1, qos=qos) as participant:
        print("READY", flush=True)
        await trio.to_thread.run_sync(sys.stdin.readline)
        known = len(participant.discovered_participants())
        print("KNOWN", known, *(f"{reason}={count}" for reason, count in participant.drop_counts().items()), flush=True)

trio.run(main, sys.argv[1])
"""


@pytest.mark.parametrize("is_secured", [False, True], ids=["plain", "secured"])
@async_test
async def test_a_victim_that_strangers_announce_gets_no_more_than_they_sent(is_secured: bool, tmp_path: Path) -> None:
    """One announcement at most for each that names it, and nothing else: no handshake, no ACKNACK, no HEARTBEAT."""
    keystore = str(shared_keystore().folder) if is_secured else ""
    with namespace() as host:
        async with (
            scenario("a stranger and a victim", deadline=30) as stage,
            capture(host, tmp_path / "strangers.pcapng") as captured,
        ):
            network = network_environment(host.interface)
            listener = await stage.start(
                "listener", [sys.executable, "-c", LISTENER, keystore], namespace=host, environment=network
            )
            await listener.expect("READY")
            command = [
                sys.executable,
                "-m",
                "multiproc_tests.stranger",
                SOURCE,
                VICTIM,
                host.address,
                str(PORT),
                str(DOMAIN),
            ]
            stranger = await stage.start("stranger", command, namespace=host)
            sent = await stranger.expect(r"SENT (\d+) (\d+)")
            await trio.sleep(1)  # whatever would be repeated, is
            await listener.send("")
            known = await listener.expect(r"KNOWN (\d+).*")
            assert int(known[1]) == (0 if is_secured else 20), "they were heard; whom security refuses is nobody"
            await listener.expect_exit(0)
    to_victim = captured.fields(f"udp && ip.dst == {VICTIM} && !icmp", "udp.payload")
    octets = [bytes.fromhex(row["udp.payload"][0]) for row in to_victim]
    announcements = int(sent[1])
    assert 0 < len(octets) <= announcements
    assert all(is_announcement(each) for each in octets)
    assert sum(map(len, octets)) < int(sent[2])
    assert captured.count(f"udp && ip.dst == {SOURCE} && !icmp") == 0


NOISE = """
import socket, sys, time
target, port = sys.argv[1], int(sys.argv[2])
head = b"RTPS" + bytes((2, 4, 1, 0x55)) + b"a stranger.."
out = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
while True:
    for octets in (
        b"noise",
        b"RTPS" + bytes((1, 0)) + bytes(20),
        head + bytes((0x15, 5, 8, 0)) + bytes(8),
        head + bytes((0x0E, 1, 12, 0)) + b"another one." + bytes((0x55, 1, 0, 0)),
    ):
        out.sendto(octets, (target, port))
    time.sleep(0.1)
"""


@async_test
async def test_ls_shows_what_was_dropped_by_its_reasons() -> None:
    with namespace() as host:
        async with scenario("strangers, and ddsi ls --stats", deadline=30) as stage:
            await stage.start("stranger", [sys.executable, "-c", NOISE, host.address, str(PORT)], namespace=host)
            words = ("ls", "--stats", "--json", "--domain", str(DOMAIN), "--time", "2")
            ls = await stage.start(
                "ls", [sys.executable, "-m", "ddsi.cli", *words], namespace=host,
                environment=network_environment(host.interface),
            )  # fmt: skip
            await ls.expect_exit(0, timeout=20)
    shown = json.loads("\n".join(line.text for line in ls.lines if line.stream == "out"))
    reasons = {"not_rtps", "unsupported_version", "malformed_message", "not_for_us", "unsupported"}
    assert reasons <= set(shown["stats"]["dropped"])
    assert all(shown["stats"]["dropped"][reason] > 0 for reason in reasons)
