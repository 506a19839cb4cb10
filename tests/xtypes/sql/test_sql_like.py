"""LIKE against the regular expression that it abbreviates, and the time that a hostile pattern takes."""

from __future__ import annotations

import re

import pytest
from hypothesis import given
from hypothesis import strategies as st

from ddsi.xtypes.sql.like import like


@pytest.mark.parametrize(
    ("pattern", "text", "fits"),
    [
        ("", "", True),
        ("", "a", False),
        ("%", "", True),
        ("a%", "a", True),
        ("%a", "ba", True),
        ("a%a", "a", False),
        ("a%a", "aa", True),
        ("_", "", False),
        ("%_%", "a", True),
        ("a.c", "abc", False),
        ("%b%b%", "abcb", True),
        ("%ab%ab", "abab", True),
        ("%ab%ab", "ab", False),
        ("a%b_d%", "axxbcd\n", True),
        ("%[x]%", "a[x]b", True),
        ("BL*", "BLUE", False),
    ],
)
def test_like(pattern: str, text: str, fits: bool) -> None:
    assert like(pattern)(text) is fits


_LETTERS = st.text(alphabet="ab_%.\n", max_size=9)


@given(_LETTERS, st.text(alphabet="ab.\n", max_size=12))
def test_like_means_what_the_regular_expression_means(pattern: str, text: str) -> None:
    words = {"%": ".*", "_": "."}
    expression = "".join(words.get(character, re.escape(character)) for character in pattern)
    assert like(pattern)(text) is (re.fullmatch(expression, text, re.DOTALL) is not None)


def test_a_hostile_pattern_comes_to_an_end() -> None:
    """As a regular expression it would try every way to divide the text: for longer than anybody waits."""
    assert not like("%a" * 500 + "%b")("a" * 20_000)
