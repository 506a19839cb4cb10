"""Every input that is kept gets the answer that it ought to get, at once and in little memory."""

from __future__ import annotations

import re
import subprocess
import sys
import time
import tracemalloc
from pathlib import Path

import pytest

from tests.fuzz.corpus import FOLDER, KeptInput, expectations, kept
from tests.fuzz.targets import TARGETS

DOCUMENTATION = Path(__file__).parents[2] / "docs" / "fuzzing.md"
MOST_SECONDS = 1.0
MOST_OCTETS = 16 << 20
"""Of memory that Python allocates at once, whatever numbers are in the input."""


MOST_OCTETS_OF_A_PROCESS = 1 << 30
"""Address space, most of which is libraries."""


@pytest.mark.parametrize("entry", list(kept()), ids=str)
def test_it_is_answered_as_it_ought_to_be(entry: KeptInput) -> None:
    run = TARGETS[entry.target].run
    verdict = run(entry.octets)
    assert entry.is_answered_by(verdict), f"{verdict} - and not {entry.expected}"
    # Again, now that all is imported, generated and cached that needs to be once.
    begin = time.process_time()
    run(entry.octets)
    assert time.process_time() - begin < MOST_SECONDS
    tracemalloc.start()
    try:
        run(entry.octets)
        _, peak = tracemalloc.get_traced_memory()
    finally:
        tracemalloc.stop()
    assert peak < MOST_OCTETS


@pytest.mark.slow
@pytest.mark.skipif(sys.platform == "win32", reason="memory is limited by the resource module")
def test_all_of_it_fits_in_little_memory() -> None:
    """In a process of its own, as what lies under Python - OpenSSL, libxml2 - allocates without its knowledge."""
    command = [sys.executable, "-c", RUN_ALL.format(octets=MOST_OCTETS_OF_A_PROCESS)]
    subprocess.run(command, cwd=FOLDER.parents[2], check=True, timeout=120)


RUN_ALL = """
import resource
from tests.fuzz.corpus import kept
from tests.fuzz.targets import TARGETS
resource.setrlimit(resource.RLIMIT_AS, ({octets}, {octets}))
for entry in kept():
    assert entry.is_answered_by(TARGETS[entry.target].run(entry.octets)), entry
"""


def test_each_target_has_inputs_and_each_input_an_expectation() -> None:
    assert set(expectations()) == set(TARGETS)
    assert all(expectations().values())
    files = {f"{path.parent.name}/{path.name}" for path in FOLDER.glob("*/*")}
    assert files == {str(entry) for entry in kept()}


def test_each_target_is_explained() -> None:
    text = DOCUMENTATION.read_text(encoding="utf-8")
    rows = [line for line in text.splitlines() if line.startswith("| `")]
    assert [name for row in rows for name in re.findall(r"`([a-z_]+)`", row.split("|")[1])] == list(TARGETS)


@pytest.mark.parametrize("name", TARGETS)
def test_an_enormous_input_is_answered_at_once(name: str) -> None:
    """Mebibytes behind a good beginning, or of nothing but one octet."""
    target = TARGETS[name]
    for octets in (next(iter(target.seeds())) + bytes(target.enormous), b"A" * target.enormous):
        begin = time.process_time()
        target.run(octets)
        assert time.process_time() - begin < MOST_SECONDS


@pytest.mark.parametrize("name", TARGETS)
def test_seeds_are_good_inputs(name: str) -> None:
    """Else nothing is tested but the first check of each parser."""
    target = TARGETS[name]
    verdicts = [target.run(octets) for octets in target.seeds()]
    assert verdicts
    assert verdicts.count(target.good) >= len(verdicts) / 2, verdicts
