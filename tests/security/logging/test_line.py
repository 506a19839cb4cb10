"""One event is one line, whatever its texts hold."""

from __future__ import annotations

import re
from dataclasses import replace

import pytest
from hypothesis import given
from hypothesis import strategies as st

from ddsi_security.builtin_logging_type import NameValuePair, StructuredDataEntry, Timestamp
from ddsi_security.logging.line import printable, syslog_line
from tests.security.logging.test_builtin_logging_type import EVENT


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("plain", "plain"),
        ("Grüße, 世界", "Grüße, 世界"),
        ("two\nlines\r", r"two\nlines\r"),
        ("\x1b[31mred", r"\x1b[31mred"),
        ("evil\u202egpj", r"evil\u202egpj"),
        ("half \ud800", r"half \ud800"),
        (r"C:\new", r"C:\\new"),
        ("a" * 20, "a" * 20),
        ("a" * 21, "a" * 17 + "..."),
    ],
)
def test_what_does_not_print_is_escaped_and_what_is_long_is_cut(text: str, expected: str) -> None:
    assert printable(text, 20) == expected


@given(st.text(st.characters(), max_size=60))
def test_a_printable_text_prints_and_tells_different_texts_apart(text: str) -> None:
    safe = printable(text, 100)
    assert safe.isprintable()
    assert len(safe.splitlines()) <= 1
    assert safe.encode("latin-1", "backslashreplace").decode("unicode_escape") == text


def test_a_line_is_that_of_syslog() -> None:
    event = replace(EVENT, timestamp=Timestamp(1_800_000_000, 120_034_567))
    assert syslog_line(event) == (
        '<83>1 2027-01-15T08:00:00.120034Z host app 47 auth [DDS domain_id="0" guid="A.B"] refused'
    )


def test_what_is_not_known_is_a_dash() -> None:
    event = replace(EVENT, hostname="", appname="", procid="", msgid="", structured_data=[])
    assert re.fullmatch(r"<83>1 \S+Z - - - - - refused", syslog_line(event))


def test_no_field_can_be_taken_for_two() -> None:
    event = replace(
        EVENT,
        appname="an app] of=mine",
        structured_data=[StructuredDataEntry("D S", [NameValuePair("a b", 'x" y="z"] \\')])],
    )
    assert syslog_line(event).endswith(r' host an_app__of_mine 47 auth [D_S a_b="x\" y=\"z\"\] \\"] refused')
