"""The implementations that are there to be talked to, and whether each is on this machine."""

from __future__ import annotations

import importlib
import importlib.metadata
import importlib.util
import os
import subprocess
import sys

from ..framework.errors import Unavailable
from .build import CYCLONE, FASTDDS, build
from .peer import Ability, Peer

__all__ = ["CYCLONE_C", "CYCLONE_PYTHON", "DUST", "FAST_DDS", "FOREIGN", "OURS", "PEERS"]

_PYTHON_PROGRAMS = "multiproc_tests.peers.programs"


def _python_program(module: str, *, needs: str, package: str) -> list[str]:
    if importlib.util.find_spec(needs) is None:
        raise Unavailable(f"the Python package {package} is missing: pip install {package}")
    return [sys.executable, "-m", f"{_PYTHON_PROGRAMS}.{module}"]


def _our_program() -> list[str]:
    ddsi = importlib.import_module("ddsi")
    if not hasattr(ddsi, "DomainParticipant"):
        raise Unavailable("ddsi has no DomainParticipant yet")
    return [sys.executable, "-m", f"{_PYTHON_PROGRAMS}.ddsi_shapes"]


def _debian_version(package: str) -> str:
    query = ["dpkg-query", "--show", "--showformat=${Version}", package]
    try:
        return subprocess.run(query, check=True, capture_output=True, text=True).stdout
    except (OSError, subprocess.CalledProcessError):
        return "unknown"


def _python_version(package: str) -> str:
    try:
        return importlib.metadata.version(package)
    except importlib.metadata.PackageNotFoundError:
        return "unknown"


OURS = Peer(
    name="ddsi",
    title="ddsi (this project)",
    abilities=frozenset(Ability),
    locate=_our_program,
    version=lambda: _python_version("ddsi"),
)

CYCLONE_C = Peer(
    name="cyclone",
    title="Eclipse Cyclone DDS, C (Debian)",
    # Its own writers and readers of appendable types refuse XCDR1 ("Bad Parameter").
    abilities=frozenset(Ability) - {Ability.APPENDABLE_XCDR1},
    locate=lambda: [os.fspath(build(CYCLONE))],
    version=lambda: _debian_version("libddsc0debian"),
)

CYCLONE_PYTHON = Peer(
    name="cyclone11",
    title="Eclipse Cyclone DDS, Python (PyPI)",
    abilities=frozenset(Ability) - {Ability.SECURITY},
    locate=lambda: _python_program("cyclonedds_shapes", needs="cyclonedds", package="cyclonedds==11.0.1"),
    version=lambda: _python_version("cyclonedds"),
)

FAST_DDS = Peer(
    name="fastdds",
    title="eProsima Fast DDS, C++ (Debian)",
    abilities=frozenset(Ability) - {Ability.XCDR2, Ability.APPENDABLE_XCDR2},
    locate=lambda: [os.fspath(build(FASTDDS))],
    version=lambda: _debian_version("libfastrtps2.9"),
)

DUST = Peer(
    name="dust",
    title="Dust DDS, Python (PyPI)",
    abilities=frozenset({Ability.LARGE, Ability.PARTITIONS}),
    locate=lambda: _python_program("dust_shapes", needs="dust_dds", package="dust_dds==0.15.0"),
    version=lambda: _python_version("dust_dds"),
)

FOREIGN = (CYCLONE_C, CYCLONE_PYTHON, FAST_DDS, DUST)
PEERS = (OURS, *FOREIGN)
