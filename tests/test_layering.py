"""Who may import what, read from the sources: the rooms of ``docs/architecture.md``, top to bottom.

A room imports rooms above it in the list, never below, and never the package ``ddsi`` itself.  Every form counts:
``import``, ``from``, relative ones, those inside functions and under ``TYPE_CHECKING``, and ``import_module("...")``.
Some modules and functions of the standard library are confined to a room as well: sockets, clocks, entropy.
"""

from __future__ import annotations

import ast
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]

ROOMS = (
    "structure",
    "serialization",
    "xtypes",
    "config",
    "messages",
    "trace",
    "spi",
    "behavior",
    "discovery",
    "engine",
    "transport",
    "simulation",
    "storage",
    "dcps",
    "portal",
    "blocking",
    "aio",
    "rpc",
    "cli",
)
BLIND = {("transport", "simulation"), ("simulation", "transport"), ("blocking", "aio"), ("aio", "blocking")}
"""Two forms of one thing: neither may come to need the other."""

SECURITY = "security"
SECURITY_SEES = {"structure", "serialization", "xtypes", "messages", "trace", "spi"}
FACE = "face"
"""``ddsi/__init__.py`` and the modules beside it, which show the rooms to applications."""

STANDARD = sys.stdlib_module_names | {"annotationlib"}  # the latter from Python 3.14 on
SHELL = {"transport", "storage", "dcps", "portal", "blocking", "aio", "rpc", "cli", FACE}

_CONFINED: list[tuple[set[str], tuple[str, ...]]] = [
    # the platform
    ({"transport"}, ("socket", "select", "selectors", "fcntl", "platform", "ctypes")),
    ({"transport"}, ("sys.platform", "sys.getwindowsversion", "os.name", "os.uname")),
    # clocks
    ({"transport"}, ("time.time", "time.time_ns", "time.monotonic", "time.monotonic_ns", "trio.current_time")),
    ({"transport"}, ("time.perf_counter", "time.perf_counter_ns", "time.clock_gettime", "time.sleep")),
    ({"transport"}, ("datetime.datetime.now", "datetime.datetime.utcnow", "datetime.date.today")),
    # entropy: it comes through the shell, or from a seed
    ({"transport"}, ("os.urandom", "secrets", "uuid.uuid1", "uuid.uuid4", "random.SystemRandom")),
    ({"transport", "cli"}, ("random.",)),
    # concurrency: none in the engine
    (SHELL, ("trio", "asyncio", "threading", "concurrent", "multiprocessing")),
    # the environment
    ({"config", "cli"}, ("os.environ", "os.getenv")),
    # what only an extra brings, or only few programs need
    ({SECURITY}, ("cryptography", "lxml", "pkcs11")),
    ({"cli"}, ("rich", "cyclonedds")),
    ({"xtypes"}, ("numpy",)),
    ({"storage"}, ("sqlite3",)),
]
SEEDED = ("random.Random",)
"""No entropy: it does what somebody's seed says."""
CONFINED = {name: rooms for rooms, names in _CONFINED for name in names}

# --- reading a module -----------------------------------------------------------------------------------------


def uses(source: str, package: str) -> Iterator[tuple[int, str]]:
    """Line and dotted name of all that a module imports, and of each attribute of an imported module that it names.

    ``package`` is what relative imports start from.
    """
    tree = ast.parse(source)
    bound: dict[str, str] = {}
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            for alias in node.names:
                bound[alias.asname or alias.name.partition(".")[0]] = (
                    alias.name if alias.asname else alias.name.partition(".")[0]
                )
                yield node.lineno, alias.name
        elif isinstance(node, ast.ImportFrom):
            base = _absolute(node.module or "", node.level, package)
            for alias in node.names:
                bound[alias.asname or alias.name] = f"{base}.{alias.name}"
                yield node.lineno, f"{base}.{alias.name}"
        elif isinstance(node, ast.Call) and (name := _imported_by_call(node, package)):
            yield node.lineno, name
    for node in ast.walk(tree):
        if isinstance(node, ast.Attribute) and (name := _dotted(node)):
            first, _, rest = name.partition(".")
            if first in bound:
                yield node.lineno, f"{bound[first]}.{rest}"


def _absolute(module: str, level: int, package: str) -> str:
    if not level:
        return module
    parts = package.split(".")
    return ".".join([*parts[: len(parts) - level + 1], *([module] if module else [])])


def _imported_by_call(node: ast.Call, package: str) -> str:
    """``importlib.import_module("x")``, ``import_module(".x", __package__)``, ``__import__("x")``."""
    called = node.func.attr if isinstance(node.func, ast.Attribute) else getattr(node.func, "id", "")
    if called not in ("import_module", "__import__") or not node.args:
        return ""
    name = node.args[0]
    if not isinstance(name, ast.Constant) or not isinstance(name.value, str):
        return ""
    level = len(name.value) - len(name.value.lstrip("."))
    return _absolute(name.value[level:], level, package)


def _dotted(node: ast.expr) -> str:
    if isinstance(node, ast.Name):
        return node.id
    if isinstance(node, ast.Attribute) and (inner := _dotted(node.value)):
        return f"{inner}.{node.attr}"
    return ""


# --- judging it ------------------------------------------------------------------------------------------------


def objections(source: str, module: str) -> list[str]:
    """What is wrong with the imports of a module; ``module`` is its path from the root."""
    path = Path(module)
    room = _room(path)
    package = ".".join(("ddsi_security" if part == SECURITY else part) for part in path.parent.parts)
    found = (
        f"{module}:{line}: {objection}" for line, name in uses(source, package) if (objection := _objection(room, name))
    )
    return list(dict.fromkeys(found))


def _room(path: Path) -> str:
    if path.parts[0] == SECURITY:
        return SECURITY
    return path.parts[1] if len(path.parts) > 2 else FACE


def _objection(room: str, name: str) -> str:
    top, *rest = name.split(".")
    for confined, allowed in CONFINED.items():
        if room not in allowed and _is_of(name, confined) and not any(_is_of(name, seeded) for seeded in SEEDED):
            return f"{name if confined.endswith('.') else confined} is for {', '.join(sorted(allowed))}, not for {room}"
    if top == "ddsi":
        return _arrow_objection(room, rest[0] if rest else "")
    if top in ("ddsi_security", "security"):
        return "" if room == SECURITY and top == "ddsi_security" else f"{room} imports {top}, which the loader finds"
    if top not in STANDARD and top not in CONFINED:
        return f"{top} is not a dependency"
    return ""


def _is_of(name: str, whole: str) -> bool:
    """Is it ``whole``, or part of it?  With a dot at its end, only what is part of it."""
    return name.startswith(whole) if whole.endswith(".") else f"{name}.".startswith(f"{whole}.")


def _arrow_objection(room: str, target: str) -> str:
    if room == FACE:
        return ""
    if target not in ROOMS:
        return f"{room} imports ddsi itself"
    if room == SECURITY:
        return (
            ""
            if target in SECURITY_SEES
            else f"security imports {target}; it sees only {', '.join(sorted(SECURITY_SEES))}"
        )
    if (room, target) in BLIND:
        return f"{room} and {target} do not see each other"
    if ROOMS.index(target) > ROOMS.index(room):
        return f"{room} imports {target}, which is below it"
    return ""


# --- the tests -------------------------------------------------------------------------------------------------


# Run as a process of its own that imports nothing of ours: another implementation's program, for the demo.
OTHER_PROGRAMS = {ROOT / "ddsi" / "cli" / "cyclone_peer.py"}


def _modules() -> list[Path]:
    return sorted({*(ROOT / "ddsi").rglob("*.py"), *(ROOT / SECURITY).rglob("*.py")} - OTHER_PROGRAMS)


def test_other_programs_import_nothing_of_ours() -> None:
    for program in OTHER_PROGRAMS:
        text = program.read_text(encoding="utf-8")
        assert "import ddsi" not in text
        assert "from ddsi" not in text
        assert "from ." not in text


def test_no_arrow_runs_the_wrong_way() -> None:
    wrong = [
        objection
        for path in _modules()
        for objection in objections(path.read_text(encoding="utf-8"), path.relative_to(ROOT).as_posix())
    ]
    assert not wrong, "\n" + "\n".join(wrong)


def test_every_room_has_its_place() -> None:
    """A new folder is put into the order before anything is put into it."""
    folders = {path.parent.name for path in (ROOT / "ddsi").glob("*/*.py")}
    assert folders <= set(ROOMS)
    assert {"structure", "config", "spi"} <= folders, "the sources are not where this test looks"


@pytest.mark.parametrize(
    ("module", "source"),
    [
        ("ddsi/engine/a.py", "from ddsi.behavior import writer_proxy"),
        ("ddsi/engine/a.py", "from ..behavior.writer_proxy import WriterProxy"),
        ("ddsi/engine/a.py", "from . import timers"),
        ("ddsi/engine/a.py", "from .timers import Timer; import ddsi.engine.timers"),
        ("ddsi/engine/sub/a.py", "from ...structure import guid; from .. import timers"),
        ("ddsi/engine/__init__.py", "from .timers import Timer"),
        ("ddsi/__init__.py", "from .dcps import DomainParticipant; from ddsi.xtypes import idl"),
        ("ddsi/cli/a.py", "import rich; from ddsi.dcps import Topic; from ..transport import pump"),
        ("ddsi/transport/a.py", "import socket, time, sys; time.monotonic(); sys.platform; import trio"),
        ("ddsi/trace/a.py", "import time; time.strftime('%H'); from datetime import datetime; datetime(2020, 1, 1)"),
        ("ddsi/engine/a.py", "from random import Random; import random; random.Random(1).random()"),
        ("ddsi/trace/a.py", "import sys; sys.maxsize; import os; os.path"),
        ("security/a.py", "import cryptography.x509; from lxml import etree; from ddsi.spi import load_hooks"),
        ("security/handshake/a.py", "from ..tokens import x; import ddsi_security.plugins"),
    ],
)
def test_right_arrows_pass(module: str, source: str) -> None:
    assert objections(source, module) == []


@pytest.mark.parametrize(
    ("module", "source", "objection"),
    [
        ("ddsi/behavior/a.py", "from ddsi.engine import x", "behavior imports engine, which is below it"),
        ("ddsi/behavior/a.py", "import ddsi.engine.timers as t", "behavior imports engine"),
        ("ddsi/behavior/a.py", "import ddsi.structure, ddsi.engine", "behavior imports engine"),
        ("ddsi/behavior/a.py", "from ..engine import x", "behavior imports engine"),
        ("ddsi/behavior/sub/a.py", "from ...engine.timers import x", "behavior imports engine"),
        ("ddsi/behavior/__init__.py", "from ..engine import x", "behavior imports engine"),
        ("ddsi/behavior/a.py", "def f():\n from ddsi.engine import x", "a.py:2: behavior imports engine"),
        ("ddsi/behavior/a.py", "from typing import TYPE_CHECKING\nif TYPE_CHECKING:\n import ddsi.engine", "a.py:3:"),
        ("ddsi/behavior/a.py", "import importlib; importlib.import_module('ddsi.engine')", "behavior imports engine"),
        ("ddsi/behavior/a.py", "from importlib import import_module; import_module('..engine', __package__)", "engine"),
        ("ddsi/behavior/a.py", "__import__('ddsi.engine')", "behavior imports engine"),
        ("ddsi/behavior/a.py", "import ddsi", "behavior imports ddsi itself"),
        ("ddsi/behavior/a.py", "from ddsi import Qos", "behavior imports ddsi itself"),
        ("ddsi/behavior/a.py", "from .. import Qos", "behavior imports ddsi itself"),
        ("ddsi/cli/a.py", "from ddsi.version import x", "cli imports ddsi itself"),
        ("ddsi/simulation/a.py", "from ddsi.transport import x", "do not see each other"),
        ("ddsi/transport/a.py", "from ..simulation import x", "do not see each other"),
        ("ddsi/spi/a.py", "import ddsi_security", "spi imports ddsi_security, which the loader finds"),
        ("ddsi/__init__.py", "from security import x", "face imports security"),
        ("security/a.py", "from ddsi.engine import x", "security imports engine; it sees only"),
        ("security/a.py", "import ddsi", "security imports ddsi itself"),
        ("security/a.py", "import security", "security imports security"),
        ("ddsi/engine/a.py", "import socket", "socket is for transport, not for engine"),
        ("ddsi/dcps/a.py", "from select import select", "select is for transport"),
        ("ddsi/config/a.py", "import sys\nsys.platform", "a.py:2: sys.platform is for transport"),
        ("ddsi/config/a.py", "from sys import platform", "sys.platform is for transport"),
        ("ddsi/engine/a.py", "import time as t; t.monotonic()", "time.monotonic is for transport"),
        ("ddsi/engine/a.py", "from time import time", "time.time is for transport"),
        ("ddsi/dcps/a.py", "import trio; trio.current_time()", "trio.current_time is for transport"),
        ("ddsi/trace/a.py", "from datetime import datetime, UTC; datetime.now(UTC)", "datetime.datetime.now is for"),
        ("ddsi/engine/a.py", "import os; os.urandom(4)", "os.urandom is for transport"),
        ("ddsi/discovery/a.py", "import random; random.random()", "random.random is for cli, transport"),
        ("ddsi/engine/a.py", "import trio", "trio is for"),
        ("ddsi/engine/a.py", "import threading", "threading is for"),
        ("ddsi/engine/a.py", "from cryptography import x509", "cryptography is for security"),
        ("ddsi/config/a.py", "import lxml.etree", "lxml is for security"),
        ("ddsi/dcps/a.py", "from rich.table import Table", "rich is for cli"),
        ("ddsi/dcps/a.py", "import os; os.environ['X']", "os.environ is for cli, config"),
        ("ddsi/engine/a.py", "import requests", "requests is not a dependency"),
    ],
)
def test_wrong_arrows_are_caught(module: str, source: str, objection: str) -> None:
    found = objections(source, module)
    assert any(objection in text for text in found), found
