"""The programs that the suite's cases are played with: ours, and one over another implementation."""

from __future__ import annotations

import importlib.metadata
import os
import shlex
import sys
from collections.abc import Callable
from dataclasses import dataclass

from ..framework import Namespace, Process, Scenario
from ..peers.build import CYCLONE_SHAPE_MAIN, build
from ..peers.catalogue import CYCLONE_C
from ..peers.peer import ROOT, network_environment

__all__ = ["CYCLONE", "OURS", "PROGRAMS", "ShapeMain"]


@dataclass(frozen=True, slots=True)
class ShapeMain:
    """One implementation's ``shape_main``.  ``locate`` returns its command, or raises Unavailable with the reason."""

    name: str
    title: str
    locate: Callable[[], list[str]]
    version: Callable[[], str]

    def __str__(self) -> str:
        return self.name

    async def start(self, stage: Scenario, name: str, options: str, host: Namespace) -> Process:
        """Starts it; the options are words as a shell reads them."""
        command = [*self.locate(), *shlex.split(options)]
        environment = network_environment(host.interface)
        return await stage.start(name, command, namespace=host, environment=environment, folder=ROOT)


OURS = ShapeMain(
    "ddsi",
    "ddsi (this project)",
    lambda: [sys.executable, "-m", "ddsi.cli.shape_main"],
    lambda: importlib.metadata.version("ddsi"),
)

CYCLONE = ShapeMain(
    "cyclone",
    "a program of ours over Eclipse Cyclone DDS, C (Debian)",
    lambda: [os.fspath(build(CYCLONE_SHAPE_MAIN))],
    CYCLONE_C.version,
)

PROGRAMS = (OURS, CYCLONE)
