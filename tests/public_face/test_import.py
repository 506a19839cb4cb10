"""``import ddsi`` brings what a publisher needs, and nothing that only some programs do."""

from __future__ import annotations

import subprocess
import sys

import pytest

import ddsi


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
        *("ddsi.config.uri", "ddsi.config.qos_profile_reader", "ddsi.xtypes.idl_compiler.parser"),
        *("asyncio", "ddsi.aio", "ddsi.blocking", "ddsi.portal"),
    ],
)
def test_what_few_programs_need_is_left_for_later(imported: set[str], module: str) -> None:
    assert module not in imported


def test_what_a_publisher_needs_is_there(imported: set[str]) -> None:
    assert {"ddsi.dcps.data_writer", "ddsi.engine.participant", "ddsi.transport.pump", "ddsi.xtypes.idl"} <= imported


@pytest.mark.parametrize("room", ["aio", "blocking", "rpc"])
def test_rooms_that_few_programs_need_are_there_when_they_are_named(room: str) -> None:
    program = f"import ddsi; assert ddsi.{room} is __import__('importlib').import_module('ddsi.{room}')"
    subprocess.run([sys.executable, "-c", program], check=True)
    with pytest.raises(AttributeError, match="has no attribute 'bloking'"):
        _ = ddsi.bloking  # type: ignore[attr-defined]
