"""Values in configuration files: units, and variables of the environment."""

from __future__ import annotations

import math
import time

import pytest

from ddsi.config.units import parse_boolean, parse_duration, parse_integer, parse_memory
from ddsi.config.variables import expand_variables


@pytest.mark.parametrize(
    ("text", "seconds"),
    [
        ("10 s", 10.0),
        ("250ms", 0.25),
        ("0.1s", 0.1),
        ("100 us", 1e-4),
        ("5ns", 5e-9),
        ("2 min", 120.0),
        ("1 hr", 3600.0),
        ("1day", 86400.0),
        (".5 s", 0.5),
        ("1e-3 s", 0.001),
        ("0", 0.0),
        ("inf", math.inf),
    ],
)
def test_durations(text: str, seconds: float) -> None:
    assert parse_duration(text) == seconds


@pytest.mark.parametrize("text", ["", "10", "10 S", "10 kB", "s", "-1 s", "1,5 s", "1 s s", "nan s", "infinite", "٣ s"])
def test_a_duration_needs_its_unit(text: str) -> None:
    with pytest.raises(ValueError, match="such as '10 s'"):
        parse_duration(text)


@pytest.mark.parametrize(
    ("text", "octets"),
    [
        ("14720 B", 14720),
        ("64 kB", 65536),  # as in Cyclone, where kB is KiB
        ("64KiB", 65536),
        ("1MB", 1 << 20),
        ("1.5 MiB", 3 << 19),
        ("2GiB", 2 << 30),
        ("0", 0),
    ],
)
def test_amounts_of_memory(text: str, octets: int) -> None:
    assert parse_memory(text) == octets


@pytest.mark.parametrize("text", ["64", "64 KB", "64 k", "1 s", "", "-1 B"])
def test_an_amount_of_memory_needs_its_unit(text: str) -> None:
    with pytest.raises(ValueError, match="such as '64 kB'"):
        parse_memory(text)


def test_numbers_and_truth() -> None:
    assert [parse_integer(text) for text in ("0", "-1", "+7")] == [0, -1, 7]
    assert (parse_boolean("true"), parse_boolean("False")) == (True, False)
    for text in ("", "1.0", "1 000", "0x10", "9" * 5000):
        with pytest.raises(ValueError, match="a whole number"):
            parse_integer(text)
    with pytest.raises(ValueError, match="true or false"):
        parse_boolean("yes")


VARIABLES = {"HOME": "/home/ann", "EMPTY": "", "TRICK": "${HOME}"}


@pytest.mark.parametrize(
    ("text", "expanded"),
    [
        ("no variable: $HOME {HOME}", "no variable: $HOME {HOME}"),
        ("file:${HOME}/x", "file:/home/ann/x"),
        ("${HOME:-y}${NONE:-y}${EMPTY:-y}", "/home/annyy"),
        ("${HOME:+y}|${NONE:+y}|${EMPTY:+y}", "y||"),
        ("${HOME:?needed}", "/home/ann"),
        ("${NONE:-${EMPTY:-{deep}}}!", "{deep}!"),
        ("${TRICK}", "${HOME}"),  # a value is not read for variables again
        ("${EMPTY}", ""),
    ],
)
def test_variables(text: str, expanded: str) -> None:
    unset: list[str] = []
    assert expand_variables(text, VARIABLES, unset.append) == expanded
    assert unset == []


def test_a_variable_that_is_not_set_is_empty_and_told() -> None:
    unset: list[str] = []
    assert expand_variables("a${NONE}b", VARIABLES, unset.append) == "ab"
    assert unset == ["NONE"]


@pytest.mark.parametrize(
    ("text", "reason"),
    [
        ("${HOME", "lacks the closing brace"),
        ("${}", "is none of"),
        ("${HOME:=x}", "is none of"),
        ("${NONE:?set it to ${HOME}}", "NONE is not set: set it to /home/ann"),
        ("${X:-" * 30 + "}" * 30, "nested deeper"),
        ("${HOME}" * 10_000, "longer than"),
    ],
)
def test_refused(text: str, reason: str) -> None:
    with pytest.raises(ValueError, match=reason):
        expand_variables(text, VARIABLES, lambda _name: None)


def test_hostile_nesting_takes_no_time() -> None:
    """Each level is read once for each level above it, of which there are at most twenty."""
    began = time.perf_counter()
    with pytest.raises(ValueError, match="nested deeper"):
        expand_variables("${X:-" * 15_000 + "}" * 15_000, {}, lambda _name: None)
    assert time.perf_counter() - began < 2
