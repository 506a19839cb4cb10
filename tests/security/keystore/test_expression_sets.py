"""Sets of expressions compared with what the expressions match, one name after the other."""

from __future__ import annotations

from itertools import product

import pytest
from hypothesis import given
from hypothesis import strategies as st

from ddsi_security.access_control.domains import DomainRange, Domains
from ddsi_security.access_control.wildcard import matches
from ddsi_security.keystore.expression_sets import covers, domains_cover, domains_overlap, overlaps

EXPRESSIONS = st.text(alphabet="ab*?", max_size=5) | st.sampled_from(["[ab]", "[!a]b", "a[b", "*[a]"])
NAMES = ["".join(letters) for length in range(5) for letters in product("abc", repeat=length)]


@given(EXPRESSIONS, EXPRESSIONS)
def test_what_covers_matches_all_that_the_other_matches(wide: str, narrow: str) -> None:
    if covers(wide, narrow):
        assert [name for name in NAMES if matches(narrow, name) and not matches(wide, name)] == []


@given(EXPRESSIONS, EXPRESSIONS)
def test_what_does_not_overlap_has_no_name_in_common(first: str, second: str) -> None:
    assert overlaps(first, second) == overlaps(second, first)
    if not overlaps(first, second):
        assert [name for name in NAMES if matches(first, name) and matches(second, name)] == []


@given(st.text(alphabet="ab*?", max_size=4), st.text(alphabet="ab*?", max_size=4))
def test_without_brackets_the_answers_are_exact(first: str, second: str) -> None:
    """Names of up to four characters tell apart any two of these, but for "?" and a letter more than there are."""
    both = [name for name in NAMES if matches(first, name) and matches(second, name)]
    if len(first.replace("*", "")) + len(second.replace("*", "")) <= 4:
        assert overlaps(first, second) == bool(both)


@pytest.mark.parametrize(
    ("wide", "narrow", "covered", "overlapping"),
    [
        ("*", "Square", True, True),
        ("Square", "Square", True, True),
        ("Square", "*", False, True),
        ("S*", "Sq*", True, True),
        ("Sq*", "S*", False, True),
        ("S*", "T*", False, False),
        ("*a*", "xax", True, True),
        ("?*", "*", False, True),
        ("?*", "a*", True, True),
        ("rt/*", "rt/chatter", True, True),
        ("*", "[ab]", True, True),
        ("?", "[ab]", True, True),
        ("[ab]", "a", True, True),
        ("[ab]", "[ab]", True, True),
        ("[ab]", "c?", False, False),
        ("", "*", False, True),
        ("*", "", True, True),
    ],
)
def test_examples(wide: str, narrow: str, covered: bool, overlapping: bool) -> None:
    assert covers(wide, narrow) is covered
    assert overlaps(wide, narrow) is overlapping


def test_long_expressions_take_no_time() -> None:
    """The square of the length at most."""
    assert not covers("*a" * 500 + "b", "*a" * 500)
    assert overlaps("*a" * 500, "*b" * 500 + "*")


RANGES = st.builds(
    lambda first, more: DomainRange(first, None if more is None else first + more),
    st.integers(0, 9),
    st.none() | st.integers(0, 9),
)
DOMAINS = st.lists(RANGES, max_size=3).map(lambda ranges: Domains(tuple(ranges)))


@given(DOMAINS, DOMAINS)
def test_domains_are_compared_by_their_ids(first: Domains, second: Domains) -> None:
    ids = [{number for number in range(20) if domains.include(number)} for domains in (first, second)]
    assert domains_overlap(first, second) == bool(ids[0] & ids[1])
    if domains_cover(first, second):
        assert ids[1] <= ids[0]


def test_tags_make_domains_narrower() -> None:
    everywhere, tagged = Domains(), Domains(tags=("a",))
    assert domains_cover(everywhere, tagged)
    assert not domains_cover(tagged, everywhere)
    assert domains_overlap(tagged, everywhere)
