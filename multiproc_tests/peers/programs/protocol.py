"""What the Python peers share: the command line, the events they print, the octets of a Blob, and the hold at the end.

Standard library only: a peer shall run with its own stack and nothing else.
"""

from __future__ import annotations

import argparse
import os
import select
import sys
import time
import zlib
from typing import Any

__all__ = [
    "Arguments",
    "blob_octets",
    "describe",
    "is_released",
    "leave_slowly",
    "open_fields",
    "parse_arguments",
    "say",
    "wait_at_gate",
]


class Arguments(argparse.Namespace):
    """The options, with the meaning that docs/multiproc.md gives them."""

    role: str
    domain: int
    topic: str
    colors: list[str]
    count: int
    interval_ms: int
    wait_s: float
    linger_ms: int
    size: int
    depth: int
    representation: int
    partitions: list[str]
    blob_octets: int
    readers: int
    best_effort: bool
    volatile: bool
    dispose: bool
    unregister: bool
    keyless: bool
    appendable: bool
    gate: bool
    hold: bool
    unicast: bool
    address: str
    store: str
    name: str
    governance: str
    lease_s: int
    read_pause_ms: int
    max_samples: int

    @property
    def is_publisher(self) -> bool:
        return self.role == "pub"


def parse_arguments() -> Arguments:
    """The command line of every peer.  What a stack cannot do, its program refuses or ignores."""
    parser = argparse.ArgumentParser(add_help=False)
    parser.add_argument("--help", action="help")
    parser.add_argument("role", choices=["pub", "sub"])
    parser.add_argument("-d", dest="domain", type=int, default=0)
    parser.add_argument("-t", dest="topic", default="Square")
    parser.add_argument("-c", dest="colors", type=_names, default=["BLUE"])
    parser.add_argument("-n", dest="count", type=int, default=10)
    parser.add_argument("-i", dest="interval_ms", type=int, default=100)
    parser.add_argument("-w", dest="wait_s", type=float, default=20)
    parser.add_argument("-l", dest="linger_ms", type=int, default=500)
    parser.add_argument("-s", dest="size", type=int, default=30)
    parser.add_argument("-h", dest="depth", type=int, default=0)
    parser.add_argument("-x", dest="representation", type=int, choices=[0, 1, 2], default=1)
    parser.add_argument("-P", dest="partitions", type=_names, default=[])
    parser.add_argument("-B", dest="blob_octets", type=int, default=-1)
    parser.add_argument("-M", dest="readers", type=int, default=1)
    parser.add_argument("-a", dest="address", default="127.0.0.1")
    parser.add_argument("-k", dest="store", default="")
    parser.add_argument("-p", dest="name", default="alice")
    parser.add_argument("-g", dest="governance", default="governance.p7s")
    parser.add_argument("-L", dest="lease_s", type=int, default=0)
    parser.add_argument("-z", dest="read_pause_ms", type=int, default=0)
    parser.add_argument("-r", dest="max_samples", type=int, default=0)
    flags = {
        "-b": "best_effort",
        "-v": "volatile",
        "-D": "dispose",
        "-U": "unregister",
        "-K": "keyless",
        "-A": "appendable",
        "-G": "gate",
        "-H": "hold",
        "-u": "unicast",
    }
    for flag, name in flags.items():
        parser.add_argument(flag, dest=name, action="store_true")
    return parser.parse_args(namespace=Arguments())


def say(*words: object) -> None:
    """One event, one line, at once."""
    print(*words, flush=True)


def blob_octets(length: int, number: int) -> bytes:
    """The octets of Blob ``number``: octet j is 31 j + 7 (j >> 8) + number, modulo 256."""
    block = [bytes((31 * j + 7 * high + number) & 255 for j in range(256)) for high in range(256)]
    whole = b"".join(block[high & 255] for high in range(length // 256 + 1))
    return whole[:length]


def open_fields(number: int) -> tuple[int, float, int]:
    """``tint``, ``angle`` and ``stamp`` of OpenShape ``number``; a subscriber checks them."""
    return number & 255, number * 0.5, (number << 32) + 1


def describe(sample: Any) -> str:
    """The sample as the events show it: ``color x y shapesize``, or ``id length crc32`` of a blob."""
    fields: dict[str, Any] = vars(sample) if hasattr(sample, "__dict__") else _slots(sample)
    if "data" in fields:
        octets = bytes(fields["data"])
        return f"{fields['id']} {len(octets)} {zlib.crc32(octets):08x}"
    if "stamp" in fields and (fields["tint"], fields["angle"], fields["stamp"]) != open_fields(fields["x"]):
        say("ERROR tint", fields["tint"], "angle", fields["angle"], "stamp", fields["stamp"])
        sys.exit(2)
    return f"{fields['color']} {fields['x']} {fields['y']} {fields['shapesize']}"


def _slots(sample: Any) -> dict[str, Any]:
    return {name: getattr(sample, name) for name in getattr(type(sample), "__slots__", ())}


def read_line() -> None:
    """Waits for a line, or the end, on standard input; reads not an octet beyond it: ``is_released`` shall see it."""
    while os.read(sys.stdin.fileno(), 1) not in (b"\n", b""):
        pass


def is_released() -> bool:
    """Has something, or the end, come on standard input?"""
    return bool(select.select([sys.stdin], [], [], 0)[0])


def wait_at_gate(arguments: Arguments) -> None:
    """With -G: does not begin to write before it is told to."""
    if arguments.gate:
        read_line()


def leave_slowly(arguments: Arguments) -> None:
    """Waits to be told to leave (-H), or a little."""
    if arguments.hold:
        say("HOLDING")
        read_line()
    else:
        time.sleep(arguments.linger_ms / 1000)


def _names(text: str) -> list[str]:
    return text.split(",")
