"""Every input that is kept gets the answer that it ought to get, at once and in little memory."""

from __future__ import annotations

import gc
import time
import tracemalloc

import pytest

from tests.fuzz.corpus import FOLDER, KeptInput, expectations, kept
from tests.fuzz.targets import TARGETS

MOST_SECONDS = 1.0
MOST_OCTETS = 16 << 20
"""Of memory that Python allocates at once, whatever numbers are in the input."""


@pytest.mark.parametrize("entry", list(kept()), ids=str)
def test_it_is_answered_as_it_ought_to_be(entry: KeptInput) -> None:
    run = TARGETS[entry.target].run
    assert run(entry.octets) == entry.expected
    # Again, now that all is imported, generated and cached that needs to be once.
    begin = time.process_time()
    run(entry.octets)
    assert time.process_time() - begin < MOST_SECONDS
    gc.collect()
    tracemalloc.start()
    try:
        run(entry.octets)
        _, peak = tracemalloc.get_traced_memory()
    finally:
        tracemalloc.stop()
    assert peak < MOST_OCTETS


def test_each_target_has_inputs_and_each_input_an_expectation() -> None:
    assert set(expectations()) == set(TARGETS)
    assert all(expectations().values())
    files = {f"{path.parent.name}/{path.name}" for path in FOLDER.glob("*/*")}
    assert files == {str(entry) for entry in kept()}


@pytest.mark.parametrize("name", TARGETS)
def test_seeds_are_good_inputs(name: str) -> None:
    """Else nothing is tested but the first check of each parser."""
    target = TARGETS[name]
    verdicts = [target.run(octets) for octets in target.seeds()]
    assert verdicts
    assert sum(verdict == target.good for verdict in verdicts) >= len(verdicts) / 2
