"""The framework on its own: namespaces, the cable between two, the relay and its weather, captures."""

from __future__ import annotations

import os
import socket
import sys
import time
from pathlib import Path

import pytest

from .framework import (
    CALM,
    Link,
    Namespace,
    Process,
    Relay,
    Scenario,
    Unavailable,
    Weather,
    async_test,
    capture,
    namespace,
    namespace_pair,
    relayed_namespaces,
    scenario,
)
from .framework.relay import is_udp_frame

RECEIVER = """
import socket, sys
address, group = sys.argv[1:]
s = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
s.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 1 << 20)
s.bind(("", 7000))
s.setsockopt(socket.IPPROTO_IP, socket.IP_ADD_MEMBERSHIP, socket.inet_aton(group) + socket.inet_aton(address))
print("READY", flush=True)
while True:
    print("GOT", s.recv(65536).decode(), flush=True)
"""

SENDER = """
import socket, sys, time
address, target, count = sys.argv[1:]
s = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
s.setsockopt(socket.IPPROTO_IP, socket.IP_MULTICAST_IF, socket.inet_aton(address))
for line in sys.stdin:
    for i in range(int(count)):
        s.sendto(f"{line.strip()} {i}".encode(), (target, 7000))
        time.sleep(0.0005)
    print("SENT", flush=True)
"""

GROUP = "239.255.0.1"


async def start_receiver(stage: Scenario, host: Namespace, name: str = "receiver") -> Process:
    receiver = await stage.start(name, [sys.executable, "-c", RECEIVER, host.address, GROUP], namespace=host)
    await receiver.expect("READY")
    return receiver


async def start_sender(stage: Scenario, host: Namespace, target: str, count: int = 1) -> Process:
    return await stage.start("sender", [sys.executable, "-c", SENDER, host.address, target, str(count)], namespace=host)


def namespace_exists(name: str) -> bool:
    return Path("/run/netns", name).exists()


# --- namespaces ----------------------------------------------------------------------------------------------


def test_a_namespace_has_nothing_but_a_loopback_and_is_removed() -> None:
    """No packet can leave it, and nothing of it stays behind, also after an exception."""
    with pytest.raises(KeyError), namespace() as host:
        assert str(os.getpid()) in host.name
        interfaces = host.run("ls", "/sys/class/net").split()
        # tunnel modules of the kernel may add fallback devices, which are down
        up = [line for line in host.ip("-o", "link", "show", "up").splitlines() if line]
        assert "lo" in interfaces
        assert len(up) == 1
        assert "MULTICAST" in up[0]
        assert host.ip("route", "get", GROUP).split()[:4] == ["multicast", GROUP, "dev", "lo"]
        raise KeyError
    assert not namespace_exists(host.name)


def test_two_namespaces_at_once_have_different_names() -> None:
    """Tests may run side by side."""
    with namespace() as first, namespace() as second:
        assert first.name != second.name


@async_test
async def test_multicast_and_unicast_work_within_a_namespace() -> None:
    """What discovery needs: a group on the loopback, and the loopback address."""
    with namespace() as host:
        async with scenario("loopback", deadline=20) as stage:
            receiver = await start_receiver(stage, host)
            for target in (GROUP, "127.0.0.1"):
                sender = await start_sender(stage, host, target)
                await sender.send(target)
                await receiver.expect(f"GOT {target} 0")


@async_test
async def test_what_is_sent_in_one_namespace_is_not_seen_in_another() -> None:
    """The same addresses, the same port, two networks."""
    with namespace() as here, namespace() as there:
        async with scenario("isolation", deadline=20) as stage:
            near = await start_receiver(stage, here, "near")
            far = await start_receiver(stage, there, "far")
            sender = await start_sender(stage, here, GROUP)
            await sender.send("hello")
            await near.expect("GOT hello 0")
            assert not far.matches("GOT .*")


@async_test
async def test_a_pair_of_namespaces_is_joined_by_a_cable() -> None:
    """Multicast and unicast cross it; with the interface down nothing does, and up again everything."""
    with namespace_pair() as (left, right):
        async with scenario("cable", deadline=20) as stage:
            receiver = await start_receiver(stage, right)
            for target in (GROUP, right.address):
                sender = await start_sender(stage, left, target)
                await sender.send(target)
                await receiver.expect(f"GOT {target} 0")
            left.interface_down()
            left.interface_up()
            await sender.send("again")
            await receiver.expect("GOT again 0")


# --- weather -------------------------------------------------------------------------------------------------


def decisions(link: Link, packets: int = 2000, interval: float = 0.001) -> list[list[float]]:
    return [link.fate(100, number * interval) for number in range(packets)]


def make_link(weather: Weather, seed: int = 1, name: str = "b") -> Link:
    return Link("a", name, weather=weather, seed=seed, now=0.0)


STORM = Weather(loss=0.1, delay=0.05, jitter=0.02, duplicate=0.05, reorder=0.1, blackout_every=0.5, blackout_for=0.1)


def test_same_seed_same_decisions() -> None:
    """A run can be had again; another seed, or another link, has decisions of its own."""
    assert decisions(make_link(STORM)) == decisions(make_link(STORM))
    assert decisions(make_link(STORM, seed=2)) != decisions(make_link(STORM))
    assert decisions(make_link(STORM, name="c")) != decisions(make_link(STORM))


def test_calm_weather_changes_nothing() -> None:
    """Every packet arrives when it is sent."""
    assert decisions(make_link(CALM)) == [[number * 0.001] for number in range(2000)]


def test_probabilities_are_kept() -> None:
    """What is asked for is about what happens, and the counters tell it."""
    link = make_link(Weather(loss=0.1, duplicate=0.2, reorder=0.3))
    fates = decisions(link, 10_000)
    lost = sum(not fate for fate in fates)
    duplicated = sum(len(fate) == 2 for fate in fates)
    assert 850 < lost < 1150
    assert 0.18 < duplicated / (10_000 - lost) < 0.22
    counters = link.counters
    assert (counters.packets, counters.octets) == (10_000, 1_000_000)
    assert (counters.lost, counters.duplicated) == (lost, duplicated)
    assert counters.arrivals == 10_000 - lost + duplicated
    assert 0.28 < counters.reordered / (10_000 - lost) < 0.32


def test_more_loss_loses_the_same_packets_and_more() -> None:
    """Changing one probability leaves the other decisions alone, so that a failure can be narrowed down."""
    light = {number for number, fate in enumerate(decisions(make_link(Weather(loss=0.1)))) if not fate}
    heavy = {number for number, fate in enumerate(decisions(make_link(Weather(loss=0.2, delay=0.1)))) if not fate}
    assert light < heavy


def test_jitter_alone_never_reorders() -> None:
    """Within its bounds, and in order; only ``reorder`` lets packets overtake."""
    arrivals = [fate[0] for fate in decisions(make_link(Weather(delay=0.05, jitter=0.05)))]
    assert arrivals == sorted(arrivals)
    assert all(0.05 <= arrival - number * 0.001 <= 0.1001 for number, arrival in enumerate(arrivals))
    mixed = [fate[0] for fate in decisions(make_link(Weather(delay=0.05, reorder=0.1)))]
    assert mixed != sorted(mixed)


def test_blackouts_come_and_go() -> None:
    """In a blackout nothing passes; it lasts as long as it is said to, and is followed by others."""
    link = make_link(Weather(blackout_every=0.2, blackout_for=0.05))
    dark = [not fate for fate in decisions(link, 4000)]
    beginnings = [number for number in range(1, 4000) if dark[number] and not dark[number - 1]]
    assert 11 <= len(beginnings) <= 27  # every 0.15 to 0.35 s in 4 s
    for beginning in beginnings[:-1]:
        assert 48 <= dark[beginning:].index(False) <= 52
    assert link.counters.blacked_out == sum(dark)


@pytest.mark.parametrize("wrong", [{"loss": 1.5}, {"duplicate": -0.1}, {"delay": -1.0}])
def test_impossible_weather_is_refused(wrong: dict[str, float]) -> None:
    """A probability is between 0 and 1, a duration is not negative."""
    (name,) = wrong
    with pytest.raises(ValueError, match=name):
        Weather(**wrong)


def test_only_udp_is_exposed_to_the_weather() -> None:
    """UDP over IPv4 and its fragments; not ARP, IGMP, IPv6, nor what is too short to tell."""
    ethernet = b"\x02" * 12
    ip = bytes.fromhex("4500001c00010000401100007f0000017f000001")
    assert is_udp_frame(ethernet + b"\x08\x00" + ip)
    assert not is_udp_frame(ethernet + b"\x08\x06" + ip)
    assert not is_udp_frame(ethernet + b"\x86\xdd" + ip)
    assert not is_udp_frame(ethernet + b"\x08\x00" + ip[:9] + b"\x02" + ip[10:])
    assert not is_udp_frame(ethernet + b"\x08\x00" + ip[:8])


# --- the relay -----------------------------------------------------------------------------------------------


async def exchange(stage: Scenario, hosts: dict[str, Namespace], target: str, count: int) -> list[int]:
    """Sends numbered datagrams from a to b; returns the numbers that came, as they came."""
    receiver = await start_receiver(stage, hosts["b"])
    sender = await start_sender(stage, hosts["a"], target, count)
    await sender.send("n")
    await sender.expect("SENT")
    # The last word must come: say it until it does.
    await sender.close_input()
    last = await start_sender(stage, hosts["a"], target)
    for _ in range(50):
        await last.send("end")
        await last.expect("SENT")
    await receiver.expect("GOT end 0")
    return [int(match[1]) for match in receiver.matches(r"GOT n (\d+)")]


@async_test
async def test_a_relay_in_calm_weather_delivers_everything_in_order() -> None:
    """Unicast and multicast, between all ends."""
    with relayed_namespaces("a", "b", "c") as (hosts, relay):
        for target in (hosts["b"].address, GROUP):
            async with scenario("calm relay", deadline=30) as stage:
                assert await exchange(stage, hosts, target, 200) == list(range(200))
    assert relay.links["a", "b"].counters.packets == 500
    assert relay.links["a", "c"].counters.packets == 250  # only what was for everybody
    assert relay.links["c", "a"].counters.packets == 0


@async_test
async def test_a_relay_loses_duplicates_and_reorders_as_its_seed_says() -> None:
    """What arrives is exactly what a link with the same seed decides, packet by packet."""
    weather = Weather(loss=0.2, duplicate=0.2, reorder=0.2, delay=0.005)
    with relayed_namespaces("a", "b", weather=weather, seed=7) as (hosts, relay):
        async with scenario("bad weather", deadline=30) as stage:
            received = await exchange(stage, hosts, hosts["b"].address, 400)
    foreseen = decisions(Link("a", "b", weather=weather, seed=7, now=0.0), 400)
    assert sorted(received) == sorted(number for number, fate in enumerate(foreseen) for _ in fate)
    assert received != sorted(received)
    assert relay.links["a", "b"].counters.lost > 50
    assert "a->b" in relay.report()


@async_test
async def test_a_relay_delays() -> None:
    """A packet takes as long as the weather says, there and back."""
    with relayed_namespaces("a", "b", weather=Weather(delay=0.1)) as (hosts, _):
        async with scenario("delay", deadline=20) as stage:
            receiver = await start_receiver(stage, hosts["b"])
            sender = await start_sender(stage, hosts["a"], hosts["b"].address)
            began = time.monotonic()
            await sender.send("slow")
            await receiver.expect("GOT slow 0")
            assert 0.1 <= time.monotonic() - began < 1.0


@async_test
async def test_links_are_cut_and_healed_and_the_weather_changes() -> None:
    """One direction at a time, while the processes run."""
    with relayed_namespaces("a", "b") as (hosts, relay):
        async with scenario("cut", deadline=20) as stage:
            receiver = await start_receiver(stage, hosts["b"])
            sender = await start_sender(stage, hosts["a"], hosts["b"].address)

            async def send(word: str) -> None:
                await sender.send(word)
                await sender.expect("SENT")
                await wait_until_relayed(relay, word)

            await send("one")
            relay.cut("a", "b")
            await send("two")
            relay.heal("a", "b")
            relay.set_weather(Weather(loss=1.0), source="a")
            await send("three")
            relay.set_weather(CALM)
            await send("four")
            await receiver.expect("GOT four 0")
            assert [match[1] for match in receiver.matches(r"GOT (\w+) 0")] == ["one", "four"]
    counters = relay.links["a", "b"].counters
    assert (counters.blacked_out, counters.lost) == (1, 1)
    with pytest.raises(KeyError):
        relay.cut("a", "nobody")


@async_test
async def test_packets_that_hold_certain_octets_are_dropped() -> None:
    """So many of them as was said, and no others."""
    with relayed_namespaces("a", "b") as (hosts, relay):
        relay.drop(b"bad", 2)
        async with scenario("drop", deadline=20) as stage:
            receiver = await start_receiver(stage, hosts["b"])
            sender = await start_sender(stage, hosts["a"], hosts["b"].address)
            for word in ("good", "bad", "bad", "bad", "last"):
                await sender.send(word)
                await sender.expect("SENT")
            await receiver.expect("GOT last 0")
            assert [match[1] for match in receiver.matches(r"GOT (\w+) 0")] == ["good", "bad", "last"]
    assert relay.dropped == 2


async def wait_until_relayed(relay: Relay, word: str) -> None:
    number = ["one", "two", "three", "four"].index(word) + 1
    deadline = time.monotonic() + 5
    while relay.links["a", "b"].counters.packets < number:
        assert time.monotonic() < deadline, relay.report()
        time.sleep(0.005)


@async_test
async def test_an_interface_of_a_relay_goes_away_and_returns() -> None:
    """While it is down nothing arrives, and the relay neither fails nor spins."""
    with relayed_namespaces("a", "b") as (hosts, relay):
        async with scenario("interface", deadline=20) as stage:
            receiver = await start_receiver(stage, hosts["b"])
            sender = await start_sender(stage, hosts["a"], hosts["b"].address)
            hosts["b"].interface_down()
            await sender.send("unheard")
            await sender.expect("SENT")
            used = time.process_time()
            time.sleep(0.3)
            assert time.process_time() - used < 0.1
            hosts["b"].interface_up()
            await sender.send("heard")
            await receiver.expect("GOT heard 0")
            assert not receiver.matches("GOT unheard 0")
    assert relay.unreachable >= 1


@async_test
async def test_a_relay_carries_datagrams_larger_than_a_frame() -> None:
    """IP fragments are frames like others; a datagram of 60 kB arrives whole."""
    sender = "import socket; socket.socket(2, 2).sendto(b'x' * 60000, ('10.78.0.2', 7000))"
    with relayed_namespaces("a", "b") as (hosts, relay):
        async with scenario("large", deadline=20) as stage:
            receiver = await start_receiver(stage, hosts["b"])
            hosts["a"].run(sys.executable, "-c", sender)
            assert len((await receiver.expect("GOT (x+)"))[1]) == 60_000
    assert relay.links["a", "b"].counters.packets == 41


# --- captures ------------------------------------------------------------------------------------------------


DNS_QUERY = bytes.fromhex("0001 0100 0001 0000 0000 0000 01 61 00 0001 0001")


@async_test
async def test_a_capture_holds_what_was_sent_and_tshark_reads_it(tmp_path: Path) -> None:
    """From the first packet after its beginning to the last before its end."""
    with namespace() as host:
        async with capture(host, tmp_path / "capture.pcapng") as captured:
            send_in(host, [DNS_QUERY] * 3)
        assert captured.count("dns") == 3
        rows = captured.fields("dns", "dns.qry.name", "dns.id")
        assert rows == [{"dns.qry.name": ["a"], "dns.id": ["0x0001"]}] * 3
        assert captured.malformed("udp") == []
        assert captured.marks("dns", r"^Name: ") == ["Name: a"]


@async_test
async def test_a_capture_tells_malformed_from_well_formed(tmp_path: Path) -> None:
    """The check does fail on packets that deserve it."""
    with namespace() as host:
        async with capture(host, tmp_path / "capture.pcapng") as captured:
            send_in(host, [DNS_QUERY, DNS_QUERY[:-3], DNS_QUERY])
        (line,) = captured.malformed("udp")
        assert "frame.number=2 " in line


def send_in(host: Namespace, datagrams: list[bytes]) -> None:
    program = f"import socket; s = socket.socket(2, 2); [s.sendto(d, ('127.0.0.1', 53)) for d in {datagrams!r}]"
    host.run(sys.executable, "-c", program)


def test_missing_programs_are_named(monkeypatch: pytest.MonkeyPatch) -> None:
    """A machine without the means is told what to install."""
    monkeypatch.setenv("PATH", "/nowhere")
    with pytest.raises(Unavailable, match="apt-get install iproute2"), namespace():
        pass


def test_sockets_of_the_test_itself_stay_where_they_are() -> None:
    """Opening a tap enters the namespace with a thread of its own; ours does not move."""
    before = os.readlink("/proc/self/ns/net")
    with relayed_namespaces("a", "b"):
        assert os.readlink("/proc/self/ns/net") == before
        with socket.socket() as probe:
            assert os.readlink(f"/proc/self/task/{os.getpid()}/ns/net") == before
            assert probe.fileno() >= 0
