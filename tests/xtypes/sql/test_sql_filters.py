"""Which samples pass a filter: each kind of member, each operator, what a sample lacks, and what is refused and how.

DDS 1.4 Annex B.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from ddsi.xtypes import deserialize, serialize
from ddsi.xtypes.sql import FilterExpression, InvalidExpression, QueryExpression
from ddsi.xtypes.sql.evaluation import compile_condition
from ddsi.xtypes.sql.syntax import And, Comparison, Condition, Field, Literal, Not, Or
from tests.xtypes.sql.sql_types import STRUCT, Bits, Color, Everything, Flags, Point, Shade, everything


def passes(text: str, sample: Everything, *parameters: str) -> bool:
    return FilterExpression(text, STRUCT).bind(parameters)(sample)


PASSING = [
    ("", {}),
    ("size = 3", {"size": 3}),
    ("size <> 3", {"size": 4}),
    ("size != 3", {"size": 4}),
    ("size > 2 and size >= 3 AND size < 4 And size <= 3", {"size": 3}),
    ("3 > size", {"size": 2}),
    ("size = 0x1F", {"size": 31}),
    ("size = -0x1f", {"size": -31}),
    ("size = +5", {"size": 5}),
    ("size BETWEEN 1 AND 3", {"size": 1}),
    ("size between 1 and 3", {"size": 3}),
    ("size NOT BETWEEN 1 AND 3", {"size": 4}),
    ("size BETWEEN 1 AND 3 AND name = 'BLUE'", {"size": 2}),
    ("NOT size = 3", {"size": 4}),
    ("NOT (size = 3 OR size = 4)", {"size": 5}),
    ("NOT NOT size = 3", {"size": 3}),
    ("size = 1 OR size = 2 AND name = 'RED'", {"size": 1}),
    ("big = 18446744073709551615", {"big": 2**64 - 1}),
    ("ratio = 0.5", {"ratio": 0.5}),
    ("ratio < 1e99", {"ratio": 0.5}),
    ("exact >= .5", {"exact": 0.5}),
    ("exact = 2", {"exact": 2.0}),
    ("size < 2.5", {"size": 2}),
    ("is_on = TRUE", {"is_on": True}),
    ("is_on = false", {}),
    ("is_on = 1", {"is_on": True}),
    ("letter = 'q'", {"letter": "q"}),
    ("name > letter", {"name": "b"}),
    ("color = 'GREEN'", {"color": Color.GREEN}),
    ("color > 'GREEN'", {"color": Color.BLUE}),
    ("color = 2", {"color": Color.BLUE}),
    ("flags = 3", {"flags": Flags.HOT | Flags.WET}),
    ("bits.high = 9", {"bits": Bits(low=0, high=9)}),
    ("name = 'it''s'", {"name": "it's"}),
    ("name = `left'", {"name": "left"}),
    ("name LIKE 'BL%'", {}),
    ("name LIKE '_L_E'", {}),
    ("name NOT LIKE 'R%'", {}),
    ("NOT name LIKE 'R%'", {}),
    ("place.x = place.y", {"place": Point(4, 4)}),
    ("numbers[1] = 8", {"numbers": [7, 8]}),
    ("grid[1][2] = 6", {"grid": [[1, 2, 3], [4, 5, 6]]}),
    ("points[0].y > 1", {"points": [Point(0, 2)]}),
    ("samples[1] < 99999999999999999999999999", {"samples": np.array([1, 2], np.int16)}),
    ("shade.grey = 7", {}),
    ("shade.place.x = 3", {"shade": Shade(place=Point(3, 4))}),
    ("shade.color = 'RED'", {}),
    ("maybe = 5", {"maybe": 5}),
    ("far.x = 1 OR size = 0", {}),
]


@pytest.mark.parametrize(("text", "changes"), PASSING)
def test_a_sample_passes_before_and_after_the_wire_and_not_the_negation(text: str, changes: dict[str, Any]) -> None:
    sample = everything(**changes)
    assert passes(text, sample)
    assert passes(text, deserialize(Everything, serialize(sample)))
    if text:
        assert not passes(f"NOT ({text})", sample)


FAILING = [
    ("size = 3", {"size": 4}),
    ("size BETWEEN 1 AND 3", {"size": 4}),
    ("size NOT BETWEEN 1 AND 3", {"size": 3}),
    ("name LIKE 'BL'", {}),
    ("name LIKE 'BLUE_'", {}),
    ("name = 'blue'", {}),
    ("size = 1 AND size = 2", {"size": 1}),
    ("exact < 1", {"exact": float("nan")}),
]


@pytest.mark.parametrize(("text", "changes"), FAILING)
def test_a_sample_does_not_pass_but_passes_the_negation(text: str, changes: dict[str, Any]) -> None:
    assert not passes(text, everything(**changes))
    assert passes(f"NOT ({text})", everything(**changes))


@pytest.mark.parametrize(
    "predicate",
    ["maybe = 5", "maybe <> 5", "maybe BETWEEN 1 AND 9", "maybe = size", "far.x < 1", "numbers[0] = 0",
     "shade.place.x = 0", "points[3].x < 1", "samples[0] = 0"],
)  # fmt: skip
def test_what_a_sample_lacks_fulfils_neither_a_predicate_nor_its_negation(predicate: str) -> None:
    sample = everything()
    assert not passes(predicate, sample)
    assert not passes(f"NOT {predicate}", sample)
    assert passes(f"{predicate} OR size = 0", sample)


def test_a_float32_equals_the_number_that_it_was_written_with() -> None:
    """As octets 0.1 becomes the float32 next to it, which is another number; so does the one in the expression."""
    received = deserialize(Everything, serialize(everything(ratio=0.1)))
    assert received.ratio != 0.1
    assert passes("ratio = 0.1", received)
    assert passes("ratio BETWEEN 0.1 AND 0.1", received)


def test_parameters_are_bound_again_and_again() -> None:
    expression = FilterExpression("size > %0 AND name = %1", STRUCT)
    assert expression.parameter_count == 2
    assert expression.bind(["3", "'BLUE'"])(everything(size=4))
    assert not expression.bind(["4", "'BLUE'"])(everything(size=4))
    assert not expression.bind(["3", "'RED'"])(everything(size=4))


def test_a_filter_of_key_members_alone_is_one_of_instances() -> None:
    assert FilterExpression("name = 'RED' OR name LIKE 'B%'", STRUCT).is_about_key
    assert not FilterExpression("name = 'RED' OR size = 3", STRUCT).is_about_key
    assert not FilterExpression("", STRUCT).is_about_key


REFUSED = [
    ("sise = 3", (), 1, "Everything has no member 'sise'; did you mean 'size'?"),
    ("name = 'a' AND SIZE = 3", (), 16, "did you mean 'size'?"),
    ("place.z = 3", (), 1, "Point has no member 'z'; there are x, y"),
    ("place = 3", (), 1, "place is a struct, Point; name a member of it, as place.x"),
    ("numbers = 3", (), 1, "name an element of it, as numbers[0]"),
    ("size.x = 3", (), 1, "size is of type int32, which has no member 'x'"),
    ("size[0] = 3", (), 1, "which has no elements"),
    ("grid[2][0] = 3", (), 1, "grid has 2 elements, [0] to [1]"),
    ("points[4].x = 3", (), 1, "points has 4 elements at most"),
    ("size = 'three'", (), 8, "size is a number; 'three' is a text"),
    ("size = TRUE", (), 8, "size is no boolean, but int32"),
    ("name = 3", (), 8, "name is a text; 3 has no quotes: '3'"),
    ("color = 'GREN'", (), 9, "Color has no enumerator 'GREN'; did you mean 'GREEN'?"),
    ("color = RED", (), 9, "Everything has no member 'RED'"),
    ("color = size", (), 1, "color is an enumerator, size is a number"),
    ("size LIKE '3%'", (), 1, "LIKE is for texts; size is a number"),
    ("name LIKE letter", (), 11, "the pattern of LIKE is a text or a parameter"),
    ("size = %0", (), 8, "parameter %0 has no value; given were none"),
    ("size = %2", ("1", "2"), 8, "parameter %2 has no value; given were %0 to %1"),
    ("name = %0", ("RED",), 8, "the value of parameter %0: a parameter is a number, TRUE or FALSE, or a text in quo"),
    ("size = %0", ("'3'",), 8, "parameter %0, '3' is a text"),
    ("size = %0", ("",), 8, "the value of parameter %0: a parameter is a number"),
    ("size BETWEEN color AND 3", (), 14, "the ends of BETWEEN are values or parameters"),
    ("name LIKE '" + "%" * 1025 + "'", (), 11, "a pattern of 1025 characters; 1024 at most"),
]  # fmt: skip


@pytest.mark.parametrize(("text", "parameters", "column", "reason"), REFUSED)
def test_what_does_not_fit_the_type_is_refused_with_place_and_remedy(
    text: str, parameters: tuple[str, ...], column: int, reason: str
) -> None:
    with pytest.raises(InvalidExpression) as caught:
        FilterExpression(text, STRUCT).bind(parameters)
    assert caught.value.column == column
    assert reason in str(caught.value)


def test_a_query_sorts_by_members_and_may_want_everything() -> None:
    query = QueryExpression("ORDER BY color, place.x", STRUCT)
    assert query.is_ordered
    assert query.bind() is None
    samples = [everything(color=Color(n % 2), place=Point(-n, 0), size=n) for n in range(4)]
    assert [sample.size for sample in sorted(samples, key=query.sort_key)] == [2, 0, 3, 1]
    lacking = [everything(maybe=2, size=1), everything(size=2), everything(maybe=1, size=3)]
    assert [s.size for s in sorted(lacking, key=QueryExpression("ORDER BY maybe", STRUCT).sort_key)] == [2, 3, 1]


# --- any condition ---------------------------------------------------------------------------------------------

_COMPARISONS = st.builds(
    Comparison, st.sampled_from([Field(("size",)), Field(("place", "x")), Field(("maybe",))]),
    st.sampled_from(["=", "<>", "<", "<=", ">", ">="]), st.integers(-2, 2).map(Literal),
)  # fmt: skip
_CONDITIONS: st.SearchStrategy[Condition] = st.recursive(
    _COMPARISONS,
    lambda inner: st.one_of(
        inner.map(Not),
        st.lists(inner, min_size=2, max_size=3).map(lambda parts: And(tuple(parts))),
        st.lists(inner, min_size=2, max_size=3).map(lambda parts: Or(tuple(parts))),
    ),
    max_leaves=8,
)


def _text(condition: Condition) -> str:
    match condition:
        case Comparison(left, sign, Literal(value)):
            return f"{left} {sign} {value}"
        case Not(inner):
            return f"NOT ({_text(inner)})"
        case And(operands):
            return " AND ".join(f"({_text(part)})" for part in operands)
        case Or(operands):
            return " OR ".join(f"({_text(part)})" for part in operands)
    raise AssertionError(condition)


def _three_valued(condition: Condition, sample: Everything) -> bool | None:
    """SQL's own definition: None is "unknown"."""
    match condition:
        case Comparison(Field(path), sign, Literal(value)):
            found: Any = sample
            for step in path:
                found = getattr(found, str(step))
            if found is None:
                return None
            assert isinstance(value, int)
            order: int = (found > value) - (found < value)
            return {"=": order == 0, "<>": order != 0, "<": order < 0, "<=": order <= 0, ">": order > 0}.get(
                sign, order >= 0
            )
        case Not(inner):
            truth = _three_valued(inner, sample)
            return None if truth is None else not truth
        case And(operands):
            truths = [_three_valued(part, sample) for part in operands]
            return False if False in truths else None if None in truths else True
        case Or(operands):
            truths = [_three_valued(part, sample) for part in operands]
            return True if True in truths else None if None in truths else False
    raise AssertionError(condition)


@given(_CONDITIONS, st.integers(-2, 2), st.integers(-2, 2), st.none() | st.integers(-2, 2))
def test_any_condition_means_what_sql_says(condition: Condition, size: int, x: int, maybe: int | None) -> None:
    """Of a sample that lacks something, too: exactly what is true passes, neither what is false nor the unknown."""
    sample = everything(size=size, place=Point(x), maybe=maybe)
    expected = _three_valued(condition, sample) is True
    assert compile_condition(condition, STRUCT)(sample) is expected
    assert passes(_text(condition), sample) is expected
