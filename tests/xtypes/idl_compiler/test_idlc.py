"""Cyclone DDS's own compiler takes the IDL that we write, and refuses what we refuse."""

from __future__ import annotations

import shutil
import subprocess
from pathlib import Path
from typing import Any

import pytest
from hypothesis import HealthCheck, assume, given, settings
from hypothesis import strategies as st

from ddsi import idl
from ddsi.xtypes.definition import struct_type
from ddsi.xtypes.model import reachable_structs
from tests.xtypes.random_types import structs
from tests.xtypes.vectors import ALL

IDLC = shutil.which("idlc")
pytestmark = [
    pytest.mark.peers,
    pytest.mark.skipif(IDLC is None, reason="idlc, of Debian's cyclonedds-tools, is not installed"),
]

UNKNOWN_TO_IDLC = ("wchar", "wstring", "map<", "bitset", "@value(-")
"""What version 0.10 does not know."""
ENDLESS = {"s33_recursive"}
"""What it does not get to the end of."""

VECTORS = [entry for entry in ALL if entry["name"] not in ENDLESS]


def idlc(folder: Path, text: str) -> subprocess.CompletedProcess[str]:
    """Its run, without the generation of code for the type as a whole."""
    (folder / "text.idl").write_text(text)
    command = [IDLC or "", "-W", "no-implicit-extensibility", "-o", str(folder), str(folder / "text.idl")]
    return subprocess.run(command, capture_output=True, text=True, timeout=60, check=False, cwd=folder)


@settings(
    max_examples=25,
    deadline=None,
    suppress_health_check=[HealthCheck.too_slow, HealthCheck.filter_too_much, HealthCheck.function_scoped_fixture],
)
@given(structs(1), st.data())
def test_idlc_takes_random_types(tmp_path: Path, kind: Any, data: st.DataObject) -> None:
    for number, composite in enumerate(reachable_structs(struct_type(kind.annotation))):
        if composite.type_name.startswith("Random"):
            composite.type_name = f"{data.draw(st.sampled_from(['', 'm::', 'm::n::']))}Type{number}"
    text = idl.to_idl(kind.annotation)
    assume(not any(word in text for word in UNKNOWN_TO_IDLC))
    run = idlc(tmp_path, text)
    assert run.returncode == 0, f"{run.stderr}\n{text}"


@pytest.mark.parametrize("entry", VECTORS, ids=[entry["name"] for entry in VECTORS])
def test_idlc_takes_the_types_of_the_vectors_as_we_say_them(tmp_path: Path, entry: dict[str, Any]) -> None:
    type_: Any = idl.loads(entry["idl"])
    for part in entry["topic_type"].split("::"):
        type_ = getattr(type_, part)
    run = idlc(tmp_path, idl.to_idl(type_))
    assert run.returncode == 0, run.stderr
