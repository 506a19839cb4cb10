"""Expressions: POSIX fnmatch, and no expression or name that takes long."""

from __future__ import annotations

import fnmatch
import time

import pytest
from hypothesis import given
from hypothesis import strategies as st

from ddsi.structure.errors import MalformedMessage
from ddsi_security.access_control.wildcard import MOST_CHARACTERS, check_expression, matches

MATCHES = [
    # expression, names that match, names that do not
    ("Square", ["Square"], ["square", "Square2", "", "aSquare"]),
    ("*", ["", "Square", "a/b", ".hidden", "a\nb"], []),
    ("DDSPerf*", ["DDSPerf", "DDSPerfRData"], ["DDSPer", "xDDSPerf"]),
    ("*Perf*", ["Perf", "DDSPerfR"], ["DDS"]),
    ("a*b*c", ["abc", "aXbYc", "abbc", "abcbc"], ["ab", "acb", "abcd"]),
    ("Squar?", ["Square", "Squar?"], ["Squar", "Squares"]),
    ("?*", ["a", "ab"], [""]),
    ("[abc]x", ["ax", "cx"], ["dx", "x", "abx"]),
    ("[a-c]", ["a", "b", "c"], ["d", "-", "A"]),
    ("[!a-c]", ["d", "!"], ["a", "c", ""]),
    ("[^a]", ["^", "a"], ["b"]),  # the ^ of regular expressions means nothing in POSIX's wildcards
    ("[]a]", ["]", "a"], ["[", "b"]),
    ("[!]a]", ["b", "["], ["]", "a"]),
    ("[a-]", ["a", "-"], ["b"]),
    ("[-a]", ["a", "-"], ["b"]),
    ("[z-a]", [], ["z", "a", "-", "b"]),  # a range that runs backwards is empty
    ("[!z-a]", ["z", "-"], ["", "zz"]),
    ("[]-a]", ["]", "^", "a"], ["b"]),
    ("[[]", ["["], ["]"]),
    ("[&&a~~]", ["&", "a", "~"], ["b"]),
    ("[[:digit:]]", ["0", "9"], ["a", ":", "\u0663"]),
    ("[[:alpha:]_]x", ["_x", "Zx"], ["1x"]),
    ("[![:space:]]", ["a"], [" ", "\t"]),
    ("[", ["["], ["", "a"]),  # nothing closes it: it is itself
    ("a[bc", ["a[bc"], ["ab", "ac"]),
    ("[]", ["[]"], ["]"]),
    ("[!]", ["[!]"], ["a"]),
    ("[[:alpha:]", ["[a", "[:"], ["a", "[b"]),
    ("\\*", ["\\", "\\abc"], ["*"]),  # nothing escapes
    ("a.b+c$", ["a.b+c$"], ["axbbc$"]),
]


@pytest.mark.parametrize(("expression", "fitting", "others"), MATCHES, ids=[row[0] for row in MATCHES])
def test_expressions_match_as_posix_says(expression: str, fitting: list[str], others: list[str]) -> None:
    assert [name for name in fitting if not matches(expression, name)] == []
    assert [name for name in others if matches(expression, name)] == []


@given(st.text("ab*?[]!-", max_size=12), st.text("ab!-[]", max_size=12))
def test_expressions_match_as_the_standard_librarys(expression: str, name: str) -> None:
    """Where the two mean the same: a range that runs backwards is cut to pieces there."""
    if "-" not in expression:
        assert matches(expression, name) == fnmatch.fnmatchcase(name, expression)


@given(st.text(max_size=40), st.text(max_size=40))
def test_any_expression_matches_or_does_not(expression: str, name: str) -> None:
    assert matches(expression, name) in (True, False)
    try:
        check_expression(expression)
    except MalformedMessage:
        assert "[" in expression


@given(st.text(st.characters(blacklist_characters="*?["), max_size=40))
def test_without_wildcards_an_expression_is_a_name(name: str) -> None:
    assert matches(name, name)
    assert not matches(name, name + "x")


HOSTILE = [
    ("*a" * 512, "a" * 1023 + "b"),
    ("*" * 1024, "a" * 1024),
    ("*a*a*a*a*a*a*a*a*a*a*a*b", "a" * 1024),
    ("?*" * 512, "a" * 500),
    ("*[a-z]" * 170, "a" * 1024),
    ("[" * 1024, "a" * 1024),
    ("[[:alpha:]" * 102, "a"),
    ("*" + "?" * 1000 + "b", "a" * 1024),
    ("(a+)+" * 100, "a" * 1024),
]


@pytest.mark.parametrize(("expression", "name"), HOSTILE, ids=range(len(HOSTILE)))
def test_hostile_expressions_take_no_time(expression: str, name: str) -> None:
    """A backtracking matcher takes longer than the universe has existed; the bound is a thousand times what is used."""
    begin = time.process_time()
    matches(expression, name)
    check_expression(expression)
    assert time.process_time() - begin < 2


def test_what_is_longer_than_any_name_matches_nothing() -> None:
    assert matches("*", "a" * MOST_CHARACTERS)
    assert not matches("*", "a" * (MOST_CHARACTERS + 1))
    with pytest.raises(MalformedMessage):
        check_expression("a" * (MOST_CHARACTERS + 1))


@pytest.mark.parametrize(
    ("expression", "reason"),
    [("[[:digits:]]", "no class of characters"), ("[[.a.]]", "collating"), ("[[=a=]]", "collat")],
)
def test_brackets_that_are_not_read_are_malformed_and_match_nothing(expression: str, reason: str) -> None:
    with pytest.raises(MalformedMessage, match=reason):
        check_expression(expression)
    assert not matches(expression, "a")
