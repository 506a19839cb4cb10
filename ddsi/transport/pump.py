"""Pump: the trio shell around one engine.  The only place that reads the clock.

It drains readable sockets in batches, runs the engine to completion, acts on its effects and re-arms one timer.
Nothing is awaited between reading the engine's state and acting on it, so cancellation cannot tear it.

Small samples that are written in one burst share a datagram: what the engine has queued leaves when its message is
full, when the writing task yields (a flusher task runs then), or after a millisecond.
"""

from __future__ import annotations

import math
import os
import socket
import time
from collections import deque
from collections.abc import Callable
from contextlib import ExitStack, suppress
from dataclasses import field, replace
from random import SystemRandom
from typing import TYPE_CHECKING

import trio

from ..behavior.reader_history_cache import ReaderHistoryCache
from ..config import Config
from ..engine import Compute, Effect, Participant, ParticipantSetup, SendDatagram
from ..spi import load_hooks
from ..structure.dataclass import dataclass
from ..structure.guid import GuidPrefix
from ..structure.locator import Locator
from ..structure.qos_policies import Properties
from .interface_watch import watch_interfaces
from .lead import Lead
from .udp import UdpTransport

if TYPE_CHECKING:
    from ..trace.sink import TraceSink

__all__ = ["Pump", "PumpOptions"]

_KEPT_OCTETS = 8 << 20
"""glibc gives memory back to the system when 128 KiB lie free, and each large sample would fault its pages in anew.  A
block of this size, once it is freed, lets it keep twice as much (mallopt(3), M_MMAP_THRESHOLD): some samples of a MiB,
which are there protected, in one piece and decoded."""
_BATCH = 64
_MAX_BACKLOG = 1024
_OPERATIONS_BEFORE_YIELD = 64
_SECONDS_BEFORE_YIELD = 0.001
_BURST_S = 0.001  # writes that follow each other faster may share datagrams
_COMPUTE_THREADS = 2


@dataclass(frozen=True, slots=True, kw_only=True)
class PumpOptions:
    """What a participant is made of besides its configuration."""

    domain_id: int
    config: Config
    entity_name: str = ""
    user_data: bytes = b""
    properties: Properties = field(default_factory=dict)


class Pump:
    """Opened by the constructor (sockets and engine), set going by :meth:`start`, driven by the task :meth:`run`.

    ``on_effect`` takes every effect that is not about the network: data, statuses, progress.
    """

    def __init__(
        self, options: PumpOptions, on_effect: Callable[[Effect], None], trace: TraceSink | None = None
    ) -> None:
        self._on_effect = on_effect
        self._files = ExitStack()
        self.transport = UdpTransport(options.domain_id, options.config)
        self._files.callback(self.transport.close)
        try:
            now = trio.current_time()
            if trace is None:
                trace = self._configured_trace(options.config, now)
            self.engine = Participant(
                self._setup(options),
                random=SystemRandom(),
                wall_clock=time.time_ns,
                hooks=load_hooks(options.properties, entropy=os.urandom, wall_clock=time.time_ns),
                trace=trace,
                send=self._send,
            )
        except BaseException:
            self._files.close()
            raise
        self._timer_scope: trio.CancelScope | None = None
        self._flusher = trio.lowlevel.ParkingLot()
        self._flush_wanted = False
        self._last_written = -math.inf
        self._has_waited = False
        self._backlog: deque[tuple[SendDatagram, Locator]] = deque()
        self._backlog_waiting = trio.lowlevel.ParkingLot()
        self.dropped_at_send = 0
        self.is_closed = False
        self._running = trio.CancelScope()
        self._nursery: trio.Nursery | None = None
        self._jobs: list[Compute] = []
        self._calls: list[Callable[[], None]] = []
        self._limiter = trio.CapacityLimiter(_COMPUTE_THREADS)
        self._operations = 0
        self._last_yield = -math.inf
        self._buffer = memoryview(bytearray(65536))
        bytes(_KEPT_OCTETS)  # allocated, and freed
        self._lead = Lead(self._settle_late)
        self._is_unsettled = False

    def _configured_trace(self, config: Config, now: float) -> TraceSink | None:
        if not config.trace_file and not config.pcap_file:
            return None
        from .trace_files import open_trace  # the classes of the events cost start-up time that few need to pay

        return open_trace(config, self._files, epoch_offset=time.time() - now)

    def _setup(self, options: PumpOptions) -> ParticipantSetup:
        locators = self.transport.unicast_locators()
        return ParticipantSetup(
            domain_id=options.domain_id,
            guid_prefix=GuidPrefix(options.config.vendor_id + os.urandom(10)),
            config=options.config,
            metatraffic_unicast=locators,
            metatraffic_multicast=self.transport.multicast_locators(),
            default_unicast=locators,
            announce_to=self.transport.announce_to(),
            max_message_octets=self.transport.max_message_octets,
            entity_name=options.entity_name,
            user_data=options.user_data,
            properties=options.properties,
        )

    @staticmethod
    def now() -> float:
        """The engine's clock."""
        return trio.current_time()

    @property
    def _shared_socket(self) -> socket.socket | None:
        """That the application's tasks may read: the one where samples come.  Of several, nobody could wait for all."""
        unicast = self.transport.unicast
        return unicast[0] if len(unicast) == 1 else None

    # --- running -----------------------------------------------------------------------------------------

    def start(self) -> None:
        """Begin to announce; what the network answers is read when :meth:`run` runs."""
        self.engine.start(self.now())
        self.settle()

    async def run(self) -> None:
        """Read, keep time and send until :meth:`close`, which ends this at once."""
        with self._running:
            async with trio.open_nursery() as nursery:
                self._nursery = nursery
                for sock in self.transport.sockets():
                    nursery.start_soon(self._receive, sock, name="ddsi receive")
                nursery.start_soon(self._keep_time, name="ddsi timer")
                nursery.start_soon(self._flush_when_idle, name="ddsi flush")
                nursery.start_soon(self._send_backlog, name="ddsi send")
                nursery.start_soon(watch_interfaces, self.follow_interfaces, name="ddsi interfaces")
                while self._jobs:
                    nursery.start_soon(self._compute, self._jobs.pop(0))
                while self._calls:
                    self.call_soon(self._calls.pop(0))

    def close(self) -> None:
        """Say goodbye and close everything.  Safe twice."""
        if self.is_closed:
            return
        try:
            self.engine.close(self.now())
            self.settle()
            self._send_backlog_now()
        finally:
            self.is_closed = True
            self._lead.disturb(None)
            # In this order: no task may wait for a socket that is closed, or for another one that gets its number.
            self._running.cancel()
            self._files.close()

    def abandon(self) -> None:
        """In the child of a fork: nothing is said, and what the child holds of the sockets is closed."""
        self.is_closed = True
        self._files.close()

    @trio.lowlevel.enable_ki_protection
    async def _receive(self, sock: socket.socket) -> None:
        while not self.is_closed:
            try:
                if sock is self._shared_socket:
                    await self._lead.deputise(sock)
                else:
                    await trio.lowlevel.wait_readable(sock)
            except trio.ClosedResourceError:  # its interface is gone
                return
            self._read(sock, None)

    def _read(self, sock: socket.socket, history: ReaderHistoryCache | None) -> None:
        """Handle what is there, or so much of it that there is news in ``history``."""
        view, engine, locator_of = self._buffer, self.engine, self.transport.locator_of
        now = -math.inf
        for _ in range(_BATCH):
            try:
                octets, address = sock.recvfrom_into(view)
            except BlockingIOError:
                break
            except OSError:
                if sock.fileno() < 0:  # closed since this task was woken
                    return
                continue  # an ICMP error for something sent before; it is not about this socket
            if now == -math.inf:
                now = trio.current_time()
            engine.receive_datagram(view[:octets], locator_of(address), now)
            if history is not None and history.has_news:
                break
        if now == -math.inf:
            return
        if history is not None and history.has_news:
            self._is_unsettled = True
        else:
            self.settle()

    @property
    def can_be_led(self) -> bool:
        """May a task that waits for samples call :meth:`lead`?"""
        return self._lead.is_free and self._shared_socket is not None and self._nursery is not None

    @trio.lowlevel.enable_ki_protection
    async def lead(self, history: ReaderHistoryCache) -> None:
        """Read the unicast socket in the calling task until there is news in ``history``, or may be."""
        sock = self._shared_socket
        assert sock is not None
        lead = self._lead
        lead.take(history)
        try:
            self._read(sock, history)
            while not (history.has_news or lead.is_disturbed or sock.fileno() < 0):
                if await lead.wait(sock):
                    self.has_yielded()
                self._read(sock, history)
        finally:
            lead.leave()

    def woken(self, history: ReaderHistoryCache, waiting: trio.lowlevel.ParkingLot) -> None:
        """There is news in ``history``, or it is closed: wake the tasks ``waiting`` for it, and who leads."""
        if waiting:
            self._lead.offer()
            waiting.unpark_all()
        self._lead.disturb(history)

    @trio.lowlevel.enable_ki_protection
    async def _keep_time(self) -> None:
        """Call the engine when its earliest timer is due; others move that deadline by :meth:`_rearm`."""
        while True:
            with trio.CancelScope(deadline=self.engine.next_deadline()) as self._timer_scope:
                await trio.sleep_forever()
            now = trio.current_time()
            if self.engine.next_deadline() <= now:
                self.engine.handle_timeout(now)
                self.settle()

    @trio.lowlevel.enable_ki_protection
    async def _flush_when_idle(self) -> None:
        """Woken by the first write of a burst; runs when the writing task yields."""
        while True:
            await self._flusher.park()
            if self._flush_wanted:  # not flushed meanwhile by somebody who had to wait
                self.settle()

    @trio.lowlevel.enable_ki_protection
    async def _send_backlog(self) -> None:
        """What the system's buffer did not take at once, in order, when it does."""
        while not self.is_closed:
            if self._backlog:
                with suppress(trio.ClosedResourceError):  # its interface is gone: the next one decides
                    await trio.lowlevel.wait_writable(self.transport.blocked or self.transport.unicast[0])
                self._send_backlog_now()
            else:
                await self._backlog_waiting.park()

    def _send_backlog_now(self) -> None:
        backlog = self._backlog
        while backlog and self._send_one(*backlog[0]):
            backlog.popleft()

    def follow_interfaces(self) -> None:
        """Read from the interfaces that are there now, and announce where we are, if that is news."""
        change = self.transport.refresh()
        if change is None or self._nursery is None:
            return
        for sock in change.abandoned:
            trio.lowlevel.notify_closing(sock)
            sock.close()
        for sock in change.opened:
            self._nursery.start_soon(self._receive, sock, name="ddsi receive")
        self.engine.network_changed(
            unicast=self.transport.unicast_locators(),
            multicast=self.transport.multicast_locators(),
            announce_to=self.transport.announce_to(),
            max_message_octets=self.transport.max_message_octets,
            now=self.now(),
        )
        self.settle()

    # --- effects -----------------------------------------------------------------------------------------

    def settle(self) -> None:
        """Act on everything the engine has asked for, flush what it has queued, and re-arm the timer."""
        if self.is_closed:
            return
        self._flush_wanted = self._is_unsettled = False
        self._act_on(self.engine.drain_effects())
        self._rearm()

    def _settle_late(self) -> None:
        if self._is_unsettled:
            self.settle()

    def written(self, now: float) -> None:
        """After a write at ``now``: a lone one leaves at once; one of a burst waits until the task yields.

        A write begins a burst, for all we know, unless its task waited since the write before, as those do that
        ask and answer.  The flusher runs when the task yields, so the engine's own deadline for what is
        queued need not be armed.
        """
        is_lone = self._has_waited or now - self._last_written > _BURST_S
        self._has_waited = False
        self._last_written = now
        if is_lone and not self._flush_wanted:
            self.settle()
            return
        if self.engine.has_effects:
            self._act_on(self.engine.take_finished())
        if not self._flush_wanted:
            self._flush_wanted = True
            self._flusher.unpark_all()

    def _act_on(self, effects: list[Effect]) -> None:
        for effect in effects:
            if isinstance(effect, Compute):
                self._start_job(effect)
            else:
                self._on_effect(effect)

    def before_waiting(self) -> None:
        """The calling task is about to wait: nothing of its own may lie in a queue meanwhile."""
        self._has_waited = True
        if self._flush_wanted or self._is_unsettled or self.engine.has_effects:
            self.settle()

    def _rearm(self) -> None:
        scope = self._timer_scope
        if scope is not None:
            deadline = self.engine.next_deadline()
            if deadline < scope.deadline:
                scope.deadline = deadline

    def _send(self, effect: SendDatagram) -> None:
        for locator in effect.destinations:
            if self._backlog or not self._send_one(effect, locator):
                if len(self._backlog) >= _MAX_BACKLOG:
                    self.dropped_at_send += 1
                    continue
                self._backlog.append((replace(effect, parts=[b"".join(effect.parts)]), locator))
                self._backlog_waiting.unpark_all()

    def _send_one(self, effect: SendDatagram, locator: Locator) -> bool:
        if effect.priority:
            return self.transport.send_marked(effect.parts, locator, effect.priority)
        return self.transport.send(effect.parts, locator)

    def _start_job(self, effect: Compute) -> None:
        if self._nursery is None:  # before `run` was scheduled for the first time
            self._jobs.append(effect)
        else:
            self._nursery.start_soon(self._compute, effect)

    @trio.lowlevel.enable_ki_protection
    async def _compute(self, effect: Compute) -> None:
        result = await trio.to_thread.run_sync(effect.job, limiter=self._limiter, abandon_on_cancel=True)
        effect.computed(result, self.now())
        self.settle()

    def call_soon(self, action: Callable[[], None]) -> None:
        """Call it from a task of its own, when nobody is in the middle of anything."""
        if self._nursery is None:  # before `run` was scheduled for the first time
            self._calls.append(action)
        else:
            self._nursery.start_soon(self._call, action, name="ddsi call")

    @trio.lowlevel.enable_ki_protection
    async def _call(self, action: Callable[[], None]) -> None:
        action()

    # --- fairness ----------------------------------------------------------------------------------------

    def has_yielded(self) -> None:
        """The calling task has waited, so others had their turn."""
        self._operations = 0
        self._last_yield = trio.current_time()

    async def checkpoint(self, now: float) -> None:
        """A cancellation point for operations that need not wait; yields after 64 of them, or a millisecond."""
        self._operations += 1
        if self._operations >= _OPERATIONS_BEFORE_YIELD or now - self._last_yield > _SECONDS_BEFORE_YIELD:
            self._operations = 0
            await trio.lowlevel.checkpoint()
            self._last_yield = trio.current_time()
        else:
            await trio.lowlevel.checkpoint_if_cancelled()
