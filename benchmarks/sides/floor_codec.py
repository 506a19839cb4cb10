"""Floor, codec: what ``struct`` makes of a sample's members, laid out beforehand; of octets and numpy, one copy.

No object is made of them, no alignment is found, and nothing is checked.
"""

from __future__ import annotations

import struct
from collections.abc import Callable
from typing import Any

from .bursts import quickest_burst
from .protocol import PAYLOAD_BYTE, play

_OCTETS = {"1KiB": 1 << 10, "64KiB": 1 << 16, "1MiB": 1 << 20, "float64": 1 << 20}

_NUMBERS = [float(number) for number in range(300)]
_CELLS = [number for cell in range(1000) for number in (cell, cell % 100, -cell % 100, cell / 2)]
_TRACKS = [item for track in range(1000) for item in (track, 10, b"track 100", track / 2, -track / 2)]

# Formats without alignment of their own, encapsulation and padding included, and the values that they pack.
_STRUCTS: dict[str, tuple[str, list[Any]]] = {
    "shape": ("<4xI5s3xiii", [5, b"BLUE", 7, 20, 30]),
    "points": ("<4xiII4sI4x300d", [1, 2, 4, b"map", 100, *_NUMBERS]),
    "mutable": ("<4xIIiII5s3xIdI?3xII8s", [60, 0, 1, 1, 5, b"name", 2, 2.5, 3, True, 4, 8, b"12345678"]),
    "union": ("<4xIii", [1, 1, 3]),
    "structs": ("<4xI" + 1000 * "Ihhf", [1000, *_CELLS]),
    "named-structs": ("<4xI" + 1000 * "II10s2xff", [1000, *_TRACKS]),
}


def serialise(name: str, count: int) -> dict[str, float]:
    if name in _OCTETS:
        payload = PAYLOAD_BYTE * _OCTETS[name]
        return _microseconds(lambda: bytearray(payload), count)
    format_, values = _STRUCTS[name]
    pack = struct.Struct(format_).pack
    return _microseconds(lambda: pack(*values), count)


def deserialise(name: str, count: int) -> dict[str, float]:
    if name in _OCTETS:
        return serialise(name, count)
    format_, values = _STRUCTS[name]
    layout = struct.Struct(format_)
    data = layout.pack(*values)
    return _microseconds(lambda: layout.unpack(data), count)


def _microseconds(operation: Callable[[], object], count: int) -> dict[str, float]:
    def burst(calls: int) -> None:
        for _ in range(calls):
            operation()

    return {"us": quickest_burst(burst, count)}


if __name__ == "__main__":
    play({"serialise": serialise, "deserialise": deserialise})
