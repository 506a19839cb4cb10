"""Floor: what is left of the roles when there is no DDS in them - bare sockets, and bare trio."""

from __future__ import annotations

import socket
import time
from collections.abc import Iterator

import trio

from .memory import resident_mib
from .protocol import play, say_ready, summarise_round_trips

_OCTETS = b"\0" * 128  # about as much as the RTPS message of one ShapeType
_WARM_UP = 100
_PATIENCE_S = 30.0
# What is under way before the receiver has to answer: less than a socket's buffer takes by default.
_WINDOW_OCTETS = 128 * 1024
_WINDOW_DATAGRAMS = 64
_DATAGRAM_OCTETS = 60 * 1024
# Ports follow the domain, as DDS's do, so that two runs at once do not meet; below those of domain 0.
_FIRST_PORT = 7_100


def _socket(port: int) -> socket.socket:
    sock = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    sock.bind(("127.0.0.1", port))
    return sock


# --- round trip ------------------------------------------------------------------------------------------


def echo(domain: int, count: int, through_trio: bool = False) -> None:
    sock = _socket(_FIRST_PORT + domain)
    if through_trio:
        sock.setblocking(False)
        trio.run(_echo_in_trio, sock)
    say_ready()
    while True:
        octets, address = sock.recvfrom(65536)
        sock.sendto(octets, address)


async def _echo_in_trio(sock: socket.socket) -> None:
    say_ready()
    while True:
        await trio.lowlevel.wait_readable(sock)
        octets, address = sock.recvfrom(65536)
        sock.sendto(octets, address)


def ping(domain: int, count: int, through_trio: bool = False) -> dict[str, float]:
    sock = _socket(0)
    to = ("127.0.0.1", _FIRST_PORT + domain)
    if through_trio:
        sock.setblocking(False)
        return trio.run(_ping_in_trio, sock, to, count)
    sock.settimeout(_PATIENCE_S)
    seconds: list[float] = []
    processor = time.process_time()
    for _ in range(_WARM_UP + count):
        start = time.perf_counter()
        sock.sendto(_OCTETS, to)
        sock.recv(65536)
        seconds.append(time.perf_counter() - start)
    return summarise_round_trips(seconds[_WARM_UP:], time.process_time() - processor)


async def _ping_in_trio(sock: socket.socket, to: tuple[str, int], count: int) -> dict[str, float]:
    seconds: list[float] = []
    processor = time.process_time()
    with trio.fail_after(_PATIENCE_S):
        for _ in range(_WARM_UP + count):
            start = time.perf_counter()
            sock.sendto(_OCTETS, to)
            await trio.lowlevel.wait_readable(sock)
            sock.recv(65536)
            seconds.append(time.perf_counter() - start)
    return summarise_round_trips(seconds[_WARM_UP:], time.process_time() - processor)


# --- throughput ------------------------------------------------------------------------------------------


def receive(domain: int, octets: int, count: int) -> dict[str, float]:
    """Answers each window with one octet; a sample that is larger than a datagram comes in several."""
    sock = _socket(_FIRST_PORT + domain)
    sock.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 4 * _WINDOW_OCTETS)
    say_ready()
    sock.settimeout(_PATIENCE_S)
    buffer = bytearray(65536)
    start = processor = 0.0
    for batch in _batches(octets, count):
        for _ in range(batch):
            _, address = sock.recvfrom_into(buffer)
            if not start:
                start, processor = time.perf_counter(), time.process_time()
        sock.sendto(b"\0", address)
    seconds, used = time.perf_counter() - start, time.process_time() - processor
    return {"per_second": (count - 1) / seconds, "processor_us": used / count * 1e6}


def send(domain: int, octets: int, count: int) -> dict[str, float]:
    sock = _socket(0)
    sock.settimeout(_PATIENCE_S)
    to = ("127.0.0.1", _FIRST_PORT + domain)
    datagram = bytes(_datagram_octets(octets))
    processor = time.process_time()
    for batch in _batches(octets, count):
        for _ in range(batch):
            sock.sendto(datagram, to)
        sock.recv(1)
    return {"processor_us": (time.process_time() - processor) / count * 1e6}


def _datagram_octets(octets: int) -> int:
    return min(octets or len(_OCTETS), _DATAGRAM_OCTETS)


def _batches(octets: int, count: int) -> Iterator[int]:
    """So many datagrams at a time as fit into a socket's buffer."""
    datagrams = count * max(-(-octets // _DATAGRAM_OCTETS), 1)
    batch = max(_WINDOW_OCTETS // max(_datagram_octets(octets), _WINDOW_OCTETS // _WINDOW_DATAGRAMS), 1)
    for first in range(0, datagrams, batch):
        yield min(batch, datagrams - first)


# --- one process -----------------------------------------------------------------------------------------


async def _checkpoint(count: int) -> dict[str, float]:
    start = time.perf_counter()
    for _ in range(count):
        await trio.lowlevel.checkpoint()
    return {"us": (time.perf_counter() - start) / count * 1e6}


def checkpoint(count: int) -> dict[str, float]:
    return trio.run(_checkpoint, count)


def datagram(count: int) -> dict[str, float]:
    with _socket(0) as sock:
        sock.settimeout(_PATIENCE_S)
        to = sock.getsockname()
        start = time.perf_counter()
        for _ in range(count):
            sock.sendto(_OCTETS, to)
            sock.recv(65536)
        return {"us": (time.perf_counter() - start) / count * 1e6}


async def _idle() -> dict[str, float]:
    await trio.sleep(0.2)
    return {"mib": resident_mib()}


def idle(domain: int) -> dict[str, float]:
    """A trio loop that does nothing."""
    return trio.run(_idle)


if __name__ == "__main__":
    play(
        {
            "echo": echo,
            "ping": ping,
            "receive": receive,
            "send": send,
            "checkpoint": checkpoint,
            "datagram": datagram,
            "idle": idle,
        }
    )
