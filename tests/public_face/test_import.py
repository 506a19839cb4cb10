"""``import ddsi`` brings what a publisher needs, and nothing that only some programs do."""

from __future__ import annotations

import subprocess
import sys

import pytest


@pytest.fixture(scope="module")
def imported() -> set[str]:
    """What a fresh interpreter holds after it, and did not hold before."""
    program = (
        "import sys, trio; before = {*sys.modules}; import ddsi; print(*sorted({*sys.modules} - before), sep='\\n')"
    )
    result = subprocess.run([sys.executable, "-c", program], check=True, capture_output=True, text=True)
    return set(result.stdout.split())


@pytest.mark.parametrize(
    "module",
    [
        *("argparse", "email.message", "importlib.metadata", "sqlite3", "tomllib", "xml.parsers.expat", "zipfile"),
        *("cryptography", "lxml", "numpy"),
        *("ddsi.cli", "ddsi.rpc", "ddsi.simulation", "ddsi.storage", "ddsi.trace.events", "ddsi_security"),
        *("ddsi.config.uri", "ddsi.xtypes.idl_compiler.parser"),
    ],
)
def test_what_few_programs_need_is_left_for_later(imported: set[str], module: str) -> None:
    assert module not in imported


def test_what_a_publisher_needs_is_there(imported: set[str]) -> None:
    assert {"ddsi.dcps.data_writer", "ddsi.engine.participant", "ddsi.transport.pump", "ddsi.xtypes.idl"} <= imported
