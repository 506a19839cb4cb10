"""The tree of a DDS SQL expression, and what is wrong with a text that is none.  DDS 1.4 Annex B.2.

Values only.  ``column`` is where something begins in the text, counted from 1.
"""

from __future__ import annotations

from ...structure.dataclass import dataclass
from ...structure.errors import BadParameter

__all__ = [
    "And",
    "Between",
    "Comparison",
    "Condition",
    "Field",
    "InvalidExpression",
    "Literal",
    "Not",
    "Operand",
    "Or",
    "Parameter",
    "Query",
    "SelectedField",
    "TopicExpression",
]


class InvalidExpression(BadParameter):
    """An expression that cannot be meant, or that its type or parameters do not fit.

    ``column`` is where, counted from 1; 0 where no place in the text is to blame.
    """

    def __init__(self, reason: str, *, text: str = "", column: int = 0) -> None:
        where = f"column {column}" if column else "a DDS SQL expression"
        shown = f" of {_shortened(text)!r}" if text else ""
        super().__init__(f"{where}{shown}: {reason}")
        self.reason = reason
        self.column = column


def _shortened(text: str) -> str:
    return text if len(text) <= 80 else f"{text[:77]}..."


@dataclass(frozen=True, slots=True)
class Field:
    """A member, by its path: names, and numbers where an element of an array or sequence is meant."""

    path: tuple[str | int, ...]
    column: int = 0

    def __str__(self) -> str:
        words = (f"[{step}]" if isinstance(step, int) else f".{step}" for step in self.path)
        return "".join(words).removeprefix(".")


@dataclass(frozen=True, slots=True)
class Literal:
    """A number, a text (which an enumerator is said by, too), TRUE or FALSE."""

    value: int | float | str | bool
    column: int = 0


@dataclass(frozen=True, slots=True)
class Parameter:
    """``%0`` to ``%99``."""

    index: int
    column: int = 0


Operand = Field | Literal | Parameter


@dataclass(frozen=True, slots=True)
class Comparison:
    """``operator`` is one of ``= <> < <= > >= LIKE``; one side at least is a member."""

    left: Operand
    operator: str
    right: Operand


@dataclass(frozen=True, slots=True)
class Between:
    """Both ends belong to the range."""

    field: Field
    low: Operand
    high: Operand


@dataclass(frozen=True, slots=True)
class Not:
    operand: Condition


@dataclass(frozen=True, slots=True)
class And:
    operands: tuple[Condition, ...]


@dataclass(frozen=True, slots=True)
class Or:
    operands: tuple[Condition, ...]


Condition = Comparison | Between | Not | And | Or


@dataclass(frozen=True, slots=True)
class Query:
    """A QueryExpression: ``condition`` is None where everything is wanted."""

    condition: Condition | None
    order: tuple[Field, ...] = ()


@dataclass(frozen=True, slots=True)
class SelectedField:
    """``field AS name``; without ``AS`` the name is the member's own."""

    field: Field
    name: str


@dataclass(frozen=True, slots=True)
class TopicExpression:
    """``SELECT fields FROM topics WHERE condition``: ``fields`` is empty for ``*``; topics are joined naturally."""

    fields: tuple[SelectedField, ...]
    topics: tuple[str, ...]
    condition: Condition | None
