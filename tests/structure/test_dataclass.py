"""Our decorator makes what the standard library's makes, for all that this project asks of it."""

from __future__ import annotations

import copy
import dataclasses
import inspect
import math
import pickle
import sys
from collections.abc import Callable
from dataclasses import field, fields, replace
from typing import Any

import pytest

from ddsi.structure.dataclass import dataclass

Decorator = Callable[..., Callable[[type], type]]


def make(decorator: Decorator) -> dict[str, type]:
    """The same classes by either decorator."""

    class Point:
        x: int
        y: float = 0.0
        names: list[str] = field(default_factory=list, compare=False)
        secret: bytes = field(default=b"", repr=False)

    class Pair:
        """Documented."""

        left: int
        right: int = 5
        total: int = field(init=False)

        def __post_init__(self) -> None:
            object.__setattr__(self, "total", self.left + self.right)

    class Nothing:
        """Without fields."""

    class Worded:
        word: str

        def __repr__(self) -> str:
            return self.word

        def __eq__(self, other: object) -> bool:
            return True

        def __hash__(self) -> int:
            return 7

    class Named:
        name: str
        size: int = 1

    class Loose:
        values: dict[str, int] = field(default_factory=dict)
        count: int = 0

    frozen = decorator(frozen=True, slots=True)
    point = frozen(Point)

    class Deeper(point):  # type: ignore[misc, valid-type]
        z: int = 9

    return {
        "Point": point,
        "Deeper": frozen(Deeper),
        "Pair": frozen(Pair),
        "Nothing": frozen(Nothing),
        "Worded": frozen(Worded),
        "Named": decorator(frozen=True, slots=True, kw_only=True)(Named),
        "Loose": decorator(slots=True)(Loose),
        "Identical": decorator(slots=True, eq=False)(type("Identical", (), {"__annotations__": {"x": "int"}})),
    }


OURS, THEIRS = make(dataclass), make(dataclasses.dataclass)
USES: list[tuple[str, tuple[Any, ...], dict[str, Any]]] = [
    ("Point", (1,), {}),
    ("Point", (1, 2.0), {"secret": b"hidden"}),
    ("Point", (1, 2.0, ["a"]), {}),
    ("Point", (), {}),
    ("Point", (1, 2, [], b"", 5), {}),
    ("Deeper", (1,), {"z": 3}),
    ("Pair", (3,), {}),
    ("Pair", (3, 4), {}),
    ("Nothing", (), {}),
    ("Worded", ("hello",), {}),
    ("Named", (), {"name": "a"}),
    ("Named", ("a",), {}),
    ("Loose", (), {"count": 4}),
    ("Identical", (1,), {}),
]


def outcome(act: Callable[[], object]) -> object:
    try:
        return act()
    except (TypeError, AttributeError) as error:
        return type(error)


@pytest.mark.parametrize(("name", "given", "named"), USES)
def test_instances_look_and_behave_alike(name: str, given: tuple[Any, ...], named: dict[str, Any]) -> None:
    def story(kind: Any) -> list[object]:
        names = [each.name for each in fields(kind)]
        made: Any = outcome(lambda: kind(*given, **named))
        if not isinstance(made, kind):
            return [made]
        other = kind(*given, **named)
        return [
            repr(made),
            made == other,
            made != other,
            made == 5,
            outcome(lambda: hash(made) == hash(other)),
            [getattr(made, name) for name in names],
            outcome(lambda: repr(replace(made))),
            repr(copy.copy(made)),
            repr(copy.deepcopy(made)),
            hasattr(made, "__dict__"),
            vars(kind)["__match_args__"],
            [outcome(lambda name=name: setattr(made, name, 3)) for name in names],  # type: ignore[misc]
            [outcome(lambda name=name: delattr(made, name)) for name in names],  # type: ignore[misc]
        ]

    assert story(OURS[name]) == story(THEIRS[name])


@pytest.mark.parametrize("name", OURS)
def test_signatures_are_alike(name: str) -> None:
    assert str(inspect.signature(OURS[name])) == str(inspect.signature(THEIRS[name]))
    assert [each.name for each in fields(OURS[name])] == [each.name for each in fields(THEIRS[name])]


def test_what_is_not_compared_does_not_count() -> None:
    point = OURS["Point"]
    assert point(1, names=["a"]) == point(1, names=["b"])
    assert hash(point(1, names=["a"])) == hash(point(1))
    assert point(1) != OURS["Deeper"](1)


def test_what_is_identical_is_equal_even_if_it_is_no_number() -> None:
    """As tuples compare.  The standard library's compare so too, until Python 3.13 let them ask each field."""
    point = OURS["Point"]
    assert point(1, math.nan) == point(1, math.nan)
    assert point(1, math.nan) != point(1, float("nan"))
    if sys.version_info < (3, 13):
        assert THEIRS["Point"](1, math.nan) == THEIRS["Point"](1, math.nan)


def test_values_are_pickled() -> None:
    from ddsi.structure.qos_policies import Reliable

    value = Reliable(max_blocking_time=3)
    assert pickle.loads(pickle.dumps(value)) == value


def test_a_default_factory_makes_a_new_one_each_time() -> None:
    loose = OURS["Loose"]
    assert loose().values is not loose().values
