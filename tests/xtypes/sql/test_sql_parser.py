"""The grammar of DDS SQL: what is read as what, and where an error points.  DDS 1.4 Annex B.2."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from ddsi.xtypes.sql import InvalidExpression, parse_filter, parse_query, parse_topic_expression
from ddsi.xtypes.sql.parser import MAX_DEPTH
from ddsi.xtypes.sql.syntax import (
    And,
    Between,
    Comparison,
    Condition,
    Field,
    Literal,
    Not,
    Or,
    Parameter,
    Query,
    SelectedField,
    TopicExpression,
)
from ddsi.xtypes.sql.tokens import MAX_CHARACTERS, MAX_TOKENS


def equals(name: str, value: int, *, at: int, value_at: int) -> Comparison:
    return Comparison(Field((name,), at), "=", Literal(value, value_at))


TREES: list[tuple[str, Condition | None]] = [
    ("", None),
    (" \n\t", None),
    ("a=1", equals("a", 1, at=1, value_at=3)),
    ("a=1 or b=2 and c=3", Or((equals("a", 1, at=1, value_at=3),
        And((equals("b", 2, at=8, value_at=10), equals("c", 3, at=16, value_at=18)))))),
    ("(a=1 OR b=2) AND c=3", And((Or((equals("a", 1, at=2, value_at=4), equals("b", 2, at=9, value_at=11))),
        equals("c", 3, at=18, value_at=20)))),
    ("not a=1 and b=2", And((Not(equals("a", 1, at=5, value_at=7)), equals("b", 2, at=13, value_at=15)))),
    ("%0 < a.b[2].c", Comparison(Parameter(0, 1), "<", Field(("a", "b", 2, "c"), 6))),
    ("a BETWEEN %1 AND 2", Between(Field(("a",), 1), Parameter(1, 11), Literal(2, 18))),
    ("a NOT LIKE 'x'", Not(Comparison(Field(("a",), 1), "LIKE", Literal("x", 12)))),
    ("order = 1 AND from < %99", And((equals("order", 1, at=1, value_at=9),
        Comparison(Field(("from",), 15), "<", Parameter(99, 22))))),
]  # fmt: skip


@pytest.mark.parametrize(("text", "tree"), TREES)
def test_a_filter_becomes_its_tree(text: str, tree: Condition | None) -> None:
    assert parse_filter(text) == tree


QUERIES = [
    ("", Query(None)),
    ("ORDER BY a", Query(None, (Field(("a",), 10),))),
    ("a=1 order by b, c.d", Query(equals("a", 1, at=1, value_at=3), (Field(("b",), 14), Field(("c", "d"), 17)))),
]


@pytest.mark.parametrize(("text", "query"), QUERIES)
def test_a_query_may_have_a_condition_and_an_order(text: str, query: Query) -> None:
    assert parse_query(text) == query


def selected(*path: str, name: str, at: int) -> SelectedField:
    return SelectedField(Field(path, at), name)


TOPIC_EXPRESSIONS = [
    ("SELECT * FROM X", TopicExpression((), ("X",), None)),
    ("select * from X;", TopicExpression((), ("X",), None)),
    (
        "SELECT a, b.c AS d, e f FROM X NATURAL JOIN Y WHERE a=1",
        TopicExpression(
            (
                selected("a", name="a", at=8),
                selected("b", "c", name="d", at=11),
                selected("e", name="f", at=21),
            ),
            ("X", "Y"),
            equals("a", 1, at=53, value_at=55),
        ),
    ),
    (
        "SELECT b.c FROM X INNER NATURAL JOIN (Y NATURAL INNER JOIN Z);",
        TopicExpression((selected("b", "c", name="c", at=8),), ("X", "Y", "Z"), None),
    ),
]


@pytest.mark.parametrize(("text", "expression"), TOPIC_EXPRESSIONS)
def test_a_topic_expression_names_members_and_topics(text: str, expression: TopicExpression) -> None:
    assert parse_topic_expression(text) == expression


REFUSED = [
    ("a", 2, "expected = <> < <= > >= LIKE or BETWEEN, found the end"),
    ("a =", 4, "expected a member, a value or a parameter, found the end"),
    ("a = 1 b", 7, "expected AND, OR or the end, found b"),
    ("a == 1", 4, "expected a member, a value or a parameter, found ="),
    ("(a = 1", 7, "expected ')', found the end"),
    ("a = 1 AND", 10, "expected a member, a value or a parameter, found the end"),
    ("1 = 2", 3, "expected a member on one side of the comparison, found ="),
    ("1 LIKE a", 3, "expected = <> < <= > or >=, found LIKE"),
    ("a NOT = 1", 7, "expected BETWEEN or LIKE, found ="),
    ("a BETWEEN 1 OR 2", 13, "expected AND, found OR"),
    ("a MATCH 'x'", 3, "expected LIKE, as vendors disagree on what MATCH means, found MATCH"),
    ("a = 'x", 5, "this text has no closing quote ' on its line"),
    ("a = 'x\ny'", 5, "this text has no closing quote"),
    ('a = "x"', 5, "a text stands between single quotes: 'RED'"),
    ("a = %100", 5, "a parameter is %0 to %99"),
    ("a = %", 5, "a parameter is %0 to %99"),
    ("a[b] = 1", 3, "expected the number of an element, from 0, found b"),
    ("a[-1] = 1", 3, "expected the number of an element, from 0, found -1"),
    ("a.1 = 1", 2, "expected = <>"),
    ("a & 1", 3, "'&' means nothing here"),
    ("a = 1 ORDER BY b", 7, "expected AND, OR or the end, found ORDER"),
]


@pytest.mark.parametrize(("text", "column", "reason"), REFUSED)
def test_an_error_names_the_place_and_what_was_expected(text: str, column: int, reason: str) -> None:
    with pytest.raises(InvalidExpression) as caught:
        parse_filter(text)
    assert caught.value.column == column
    assert reason in str(caught.value)


@pytest.mark.parametrize(
    ("text", "reason"),
    [
        ("SELECT FROM X", "expected a member, found FROM"),
        ("SELECT a X", "expected FROM, found the end"),
        ("SELECT * FROM X JOIN Y", "expected the end, found JOIN"),
        ("SELECT a[0] FROM X", "expected AS and a name for a[0]"),
        ("SELECT * FROM X NATURAL JOIN (Y", "expected ')', found the end"),
        ("SELECT * FROM " + " NATURAL JOIN ".join(["X"] * 17), "expected 16 topics at most"),
    ],
)
def test_an_error_in_a_topic_expression_says_what_was_expected(text: str, reason: str) -> None:
    with pytest.raises(InvalidExpression, match=reason.replace("[", r"\[").replace(")", r"\)")):
        parse_topic_expression(text)


@pytest.mark.parametrize(
    ("text", "reason"),
    [
        ("(" * (MAX_DEPTH + 1) + "a=1" + ")" * (MAX_DEPTH + 1), "nested 32 deep at most"),
        ("NOT " * (MAX_DEPTH + 1) + "a=1", "nested 32 deep at most"),
        ("a=1 or " * MAX_TOKENS, f"more than {MAX_TOKENS} words"),
        ("a" * (MAX_CHARACTERS + 1), f"{MAX_CHARACTERS} at most"),
        ("a=" + "9" * 401, "a number of 401 characters"),
    ],
)
def test_what_a_stranger_may_ask_for_is_bounded(text: str, reason: str) -> None:
    with pytest.raises(InvalidExpression, match=reason):
        parse_filter(text)


def test_as_deep_as_is_allowed_is_read() -> None:
    assert parse_filter("(" * MAX_DEPTH + "a=1" + ")" * MAX_DEPTH) == equals("a", 1, at=33, value_at=35)


_WORDS = st.lists(
    st.sampled_from(["a", "b.c", "=", "<>", "AND", "OR", "NOT", "BETWEEN", "LIKE", "(", ")", "[", "]", "1", "'x'",
                     "%0", "%", "'", ".", ",", "SELECT", "FROM", "ORDER", "BY", "-", "0x", "1e9", "\n", "é"]),
    max_size=30,
).map(" ".join)  # fmt: skip


@given(_WORDS | st.text(max_size=60))
def test_no_text_raises_anything_else(text: str) -> None:
    for parse in (parse_filter, parse_query, parse_topic_expression):
        column = 0
        try:
            parse(text)
        except InvalidExpression as error:
            column = error.column
        assert 0 <= column <= len(text) + 1


@pytest.mark.parametrize("text", ["'" * 8191, "a = '" + "''" * 4000, "1" * 8192, "%" * 8192, "a=1 and " * 200 + "("])
def test_the_worst_of_texts_come_to_an_end(text: str) -> None:
    """Quotes without end, digits without end: each is refused at once, whatever the alternatives of the words are."""
    with pytest.raises(InvalidExpression):
        parse_filter(text)
