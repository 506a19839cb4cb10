"""Benchmark: what is measured, in which unit, and which programs measure it.  It measures nothing itself."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from enum import Enum
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from .session import Session

__all__ = ["FLOOR", "OURS", "PEER", "PEER_VERSION", "SECURED", "SECURED_PEER", "Benchmark", "Better", "Figure", "Side"]

PEER_VERSION = "11.0.1"


class Better(Enum):
    """Which way is good; a ratio is turned so that above 1 means that we are better."""

    HIGHER = "higher"
    LOWER = "lower"


@dataclass(frozen=True, slots=True)
class Side:
    """One of those that are compared.

    ``column``: where its figures stand: "ours", "peer" or "floor".  ``module``: the program that plays its roles.
    ``imports``: what an application of it imports.  ``distribution``: whose version is reported; a side whose
    distribution is not installed is left out with a note.  ``programs``: what must be there to run it.
    """

    column: str
    module: str
    imports: tuple[str, ...]
    distribution: str = ""
    wanted_version: str = ""
    programs: tuple[str, ...] = ()


OURS = Side("ours", "benchmarks.sides.ours", ("ddsi",), "ddsi")
PEER = Side(
    "peer",
    "benchmarks.sides.cyclone",
    ("cyclonedds.core", "cyclonedds.domain", "cyclonedds.topic", "cyclonedds.pub", "cyclonedds.sub", "cyclonedds.idl"),
    "cyclonedds",
    PEER_VERSION,
)
SECURED = Side("ours", "benchmarks.sides.ours", ("ddsi",), "cryptography")
SECURED_PEER = Side("peer", "benchmarks.sides.cyclone_secured", (), programs=("gcc", "idlc"))
"""The peer's wheel leaves security out: this is Debian's Cyclone DDS 0.10 in C, through a program of ours."""
FLOOR = Side("floor", "benchmarks.sides.floor", ("trio",), "trio")


@dataclass(frozen=True, slots=True)
class Figure:
    """One line of the table."""

    name: str
    unit: str
    better: Better


@dataclass(frozen=True, slots=True)
class Benchmark:
    """One measurement, which may give several figures.

    ``measure(side, session)`` measures one side once and returns a value for each figure's name; what else
    it returns (processor time, counts) is kept as a detail.  It raises WorkerFailed.  ``sides``: in turn, in
    this order.  ``is_long``: it takes minutes, and comes out much the same each time, so it is measured once.
    """

    name: str
    summary: str
    figures: tuple[Figure, ...]
    measure: Callable[[Side, Session], Mapping[str, float]]
    sides: tuple[Side, ...] = (OURS, PEER)
    is_long: bool = False
