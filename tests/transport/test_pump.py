"""Pump: the shell around the engine - what a full buffer, a busy socket, a timer and the end do to it."""

from __future__ import annotations

import itertools
import json
import os
import socket
import sys
from collections.abc import AsyncIterator, Awaitable, Callable
from contextlib import asynccontextmanager
from pathlib import Path
from typing import Any

import pytest
import trio
import trio.testing

from ddsi.config import Config
from ddsi.engine import Compute, Effect, SendDatagram
from ddsi.structure.errors import ConfigurationError
from ddsi.structure.locator import Locator
from ddsi.transport import Pump, PumpOptions, interface_watch
from ddsi.transport.platform import Interface, open_network_events

_counter = itertools.count()


def options(**settings: Any) -> PumpOptions:
    number = next(_counter)
    tag = f"pump-{os.getpid()}-{number}"
    config = Config(**{"interfaces": ("lo",), "domain_tag": tag, **settings})
    return PumpOptions(domain_id=(os.getpid() + number) % 100, config=config)


@asynccontextmanager
async def running(of: PumpOptions | None = None) -> AsyncIterator[Pump]:
    """A pump whose effects go nowhere."""
    async with trio.open_nursery() as nursery:
        pump = Pump(of or options(), lambda effect: None)
        pump.start()
        nursery.start_soon(pump.run)
        await trio.sleep(0.01)
        try:
            yield pump
        finally:
            pump.close()


def in_trio(test: Callable[[], Awaitable[None]]) -> Callable[[], None]:
    def run() -> None:
        async def limited() -> None:
            with trio.fail_after(10):
                await test()

        trio.run(limited)

    run.__name__, run.__doc__ = test.__name__, test.__doc__
    return run


class Gate:
    """A transport's ``send`` that can be shut, as if the system's buffer were full."""

    def __init__(self, pump: Pump) -> None:
        self.sent: list[bytes] = []
        self.is_open = True
        pump.transport.send = self  # type: ignore[method-assign]

    def __call__(self, parts: Any, locator: Locator) -> bool:
        if self.is_open:
            self.sent.append(b"".join(parts))
        return self.is_open


SOMEBODY = Locator.udp_v4("127.0.0.1", 9)


@in_trio
async def test_what_the_buffer_does_not_take_waits_and_goes_in_order() -> None:
    async with running() as pump:
        gate = Gate(pump)
        gate.is_open = False
        part = bytearray(b"0")
        for number in range(3):
            part[0] = ord(f"{number}")
            pump._send(SendDatagram((SOMEBODY,), [part, b"!"]))
        assert gate.sent == []
        gate.is_open = True
        part[0] = ord("x")  # what waits was copied
        pump._send(SendDatagram((SOMEBODY,), [b"3!"]))
        with trio.fail_after(2):
            while len(gate.sent) < 4:
                await trio.sleep(0.001)
        assert gate.sent[:4] == [b"0!", b"1!", b"2!", b"3!"]


@in_trio
async def test_what_waits_is_bounded_and_what_is_dropped_is_counted() -> None:
    async with running() as pump:
        gate = Gate(pump)
        gate.is_open = False
        for _ in range(1500):
            pump._send(SendDatagram((SOMEBODY,), [b"octets"]))
        assert pump.dropped_at_send == 1500 - 1024
        assert len(pump._backlog) == 1024


@in_trio
async def test_a_backlog_from_before_the_first_task_ran_is_sent() -> None:
    pump = Pump(options(), lambda effect: None)
    gate = Gate(pump)
    gate.is_open = False
    pump.start()
    pump._send(SendDatagram((SOMEBODY,), [b"early"]))
    gate.is_open = True
    async with trio.open_nursery() as nursery:
        nursery.start_soon(pump.run)
        with trio.fail_after(2):
            while b"early" not in gate.sent:
                await trio.sleep(0.001)
        pump.close()


@in_trio
async def test_slow_work_runs_in_a_thread_and_its_result_comes_back() -> None:
    done: list[object] = []
    async with running() as pump:
        pump._act_on([Compute(lambda: 6 * 7, lambda result, now: done.append(result))])
        with trio.fail_after(2):
            while not done:
                await trio.sleep(0.001)
    assert done == [42]


@in_trio
async def test_slow_work_asked_for_before_the_first_task_ran_is_done() -> None:
    done: list[object] = []
    pump = Pump(options(), lambda effect: None)
    pump._act_on([Compute(lambda: "early", lambda result, now: done.append(result))])
    async with trio.open_nursery() as nursery:
        nursery.start_soon(pump.run)
        with trio.fail_after(2):
            while not done:
                await trio.sleep(0.001)
        pump.close()
    assert done == ["early"]


@in_trio
async def test_the_engine_is_called_when_its_timer_is_due_and_not_before() -> None:
    async with running() as pump:
        calls: list[float] = []
        engine: Any = pump.engine
        due = trio.current_time() + 0.05

        def handle_timeout(now: float) -> None:
            calls.append(now)

        engine.next_deadline = lambda: float("inf") if calls else due
        engine.handle_timeout = handle_timeout
        pump.settle()
        with trio.fail_after(2):
            while not calls:
                await trio.sleep(0.001)
        await trio.sleep(0.02)
        assert len(calls) == 1
        assert due <= calls[0] < due + 0.5


@in_trio
async def test_an_earlier_deadline_wakes_the_timer() -> None:
    async with running() as pump:
        engine: Any = pump.engine
        calls: list[float] = []
        deadlines = {"due": trio.current_time() + 60}

        def handle_timeout(now: float) -> None:
            calls.append(now)
            deadlines["due"] = float("inf")

        engine.next_deadline = lambda: deadlines["due"]
        engine.handle_timeout = handle_timeout
        pump.settle()
        await trio.sleep(0.005)
        deadlines["due"] = trio.current_time()
        pump.settle()
        with trio.fail_after(2):
            while not calls:
                await trio.sleep(0.001)


@in_trio
async def test_all_that_is_readable_is_read_and_acted_upon_once() -> None:
    async with running() as pump:
        engine: Any = pump.engine
        received: list[bytes] = []
        settled: list[int] = []
        engine.receive_datagram = lambda octets, source, now: received.append(bytes(octets))
        drain = engine.drain_effects

        def counting() -> list[Effect]:
            settled.append(len(received))
            effects: list[Effect] = drain()
            return effects

        engine.drain_effects = counting
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as sender:
            address = pump.transport.unicast[0].getsockname()
            for number in range(50):
                sender.sendto(f"{number}".encode(), address)
            with trio.fail_after(2):
                while len(received) < 50:
                    await trio.sleep(0.001)
        assert received == [f"{number}".encode() for number in range(50)]
        assert len(settled) <= 3


@in_trio
async def test_closing_twice_is_closing_once_and_nothing_happens_after() -> None:
    async with running() as pump:
        gate = Gate(pump)
        pump.close()
        goodbyes = len(gate.sent)
        assert goodbyes > 0
        pump.close()
        pump.settle()
        pump.before_waiting()
        await trio.sleep(0.01)
        assert len(gate.sent) == goodbyes
        assert all(sock.fileno() == -1 for sock in pump.transport.sockets())


@in_trio
async def test_closing_while_datagrams_pour_in_is_quiet() -> None:
    """The receiving task may have been woken already when its socket is closed."""
    for _ in range(20):
        async with running() as pump:
            with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as sender:
                address = pump.transport.unicast[0].getsockname()
                for _ in range(20):
                    sender.sendto(b"octets", address)
                await trio.lowlevel.checkpoint()
                pump.close()
                await trio.lowlevel.checkpoint()


@in_trio
async def test_closing_before_the_first_task_ran_is_quiet() -> None:
    pump = Pump(options(), lambda effect: None)
    pump.start()
    async with trio.open_nursery() as nursery:
        nursery.start_soon(pump.run)
        pump.close()


@pytest.mark.parametrize("kind", ["trace_file", "pcap_file"])
def test_traces_go_to_the_files_that_the_configuration_names(tmp_path: Path, kind: str) -> None:
    path = tmp_path / "trace"

    @in_trio
    async def run() -> None:
        async with running(options(**{kind: str(path)})):
            await trio.sleep(0.01)

    run()
    octets = path.read_bytes()
    if kind == "trace_file":
        header, *lines = map(json.loads, octets.splitlines())
        assert header["schema"] == "ddsi-trace"
        assert [line["event"] for line in lines][:: len(lines) - 1] == ["participant_created", "participant_closed"]
    else:
        assert octets.startswith(b"\x0a\x0d\x0d\x0a")


def test_a_trace_file_that_cannot_be_opened_is_a_configuration_error_and_leaves_no_socket(tmp_path: Path) -> None:
    async def run() -> None:
        of = options(trace_file=str(tmp_path / "no" / "such" / "folder"))
        with pytest.raises(ConfigurationError, match="trace file"):
            Pump(of, lambda effect: None)
        Pump(PumpOptions(domain_id=of.domain_id, config=Config(interfaces=("lo",), participant_index=0)), print).close()

    trio.run(run)


# --- interfaces that come and go -------------------------------------------------------------------------


@in_trio
async def test_a_new_address_is_read_and_announced_and_an_old_one_is_closed() -> None:
    here, there = (Interface("lo", f"127.0.0.{n}", "255.0.0.0", 65536, is_loopback=True) for n in (1, 2))
    async with running() as pump:
        (old,) = pump.transport.unicast
        heard: list[Locator] = []
        engine: Any = pump.engine
        engine.receive_datagram = lambda octets, source, now: heard.append(source)
        pump.transport._list_interfaces = lambda: [there]
        pump.follow_interfaces()
        assert old.fileno() == -1
        assert [locator.host for locator in pump.engine.discovery.data.default_unicast] == ["127.0.0.2"]
        pump.follow_interfaces()  # nothing new
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as sender:
            sender.bind(("127.0.0.1", 0))
            sender.sendto(b"octets", pump.transport.unicast[0].getsockname())
            source = Locator.udp_v4(*sender.getsockname())
            while source not in heard:
                await trio.sleep(0.001)
        pump.transport._list_interfaces = lambda: [here, there]
        pump.follow_interfaces()
        assert len(pump.transport.unicast) == 2


@in_trio
async def test_what_waits_for_a_socket_that_is_closed_goes_through_another() -> None:
    there = Interface("lo", "127.0.0.2", "255.0.0.0", 65536, is_loopback=True)
    async with running() as pump:
        gate = Gate(pump)
        gate.is_open = False
        pump._send(SendDatagram((SOMEBODY,), [b"patient"]))
        await trio.sleep(0.01)
        pump.transport._list_interfaces = lambda: [there]
        pump.follow_interfaces()
        gate.is_open = True
        while b"patient" not in gate.sent:
            await trio.sleep(0.001)


def test_the_interfaces_are_looked_at_when_the_system_says_so(monkeypatch: pytest.MonkeyPatch) -> None:
    async def main() -> None:
        system, ours = socket.socketpair(socket.AF_UNIX, socket.SOCK_DGRAM)
        ours.setblocking(False)
        monkeypatch.setattr(interface_watch, "open_network_events", lambda: ours)
        looks: list[float] = []
        async with trio.open_nursery() as nursery:
            nursery.start_soon(interface_watch.watch_interfaces, lambda: looks.append(trio.current_time()))
            await trio.testing.wait_all_tasks_blocked()
            assert len(looks) == 1
            for _ in range(20):  # one change is several events
                system.send(b"event")
            with trio.fail_after(5):
                while len(looks) < 2:
                    await trio.sleep(0.01)
            await trio.sleep(0.3)
            assert len(looks) == 2
            nursery.cancel_scope.cancel()
        assert ours.fileno() == -1
        system.close()

    trio.run(main)


def test_without_such_a_system_they_are_looked_at_now_and_then(monkeypatch: pytest.MonkeyPatch) -> None:
    async def main() -> None:
        monkeypatch.setattr(interface_watch, "open_network_events", lambda: None)
        looks: list[float] = []
        with trio.move_on_after(21):
            await interface_watch.watch_interfaces(lambda: looks.append(trio.current_time()))
        assert len(looks) == 5

    trio.run(main, clock=trio.testing.MockClock(autojump_threshold=0))


def test_this_system_tells_of_its_interfaces() -> None:
    """On Linux; elsewhere there is nothing to listen to."""
    events = open_network_events()
    assert (events is not None) == sys.platform.startswith("linux")
    if events is not None:
        events.close()
