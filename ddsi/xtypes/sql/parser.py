"""From the text of a DDS SQL expression to its tree.  DDS 1.4 Annex B.2 (the grammar in BNF).

A parser by recursive descent; NOT binds closer than AND, AND closer than OR.  How deep conditions nest is bounded.
What members mean is not known here: :mod:`.field_path` looks them up in a type.
"""

from __future__ import annotations

from typing import NoReturn

from .syntax import (
    And,
    Between,
    Comparison,
    Condition,
    Field,
    InvalidExpression,
    Literal,
    Not,
    Operand,
    Or,
    Parameter,
    Query,
    SelectedField,
    TopicExpression,
)
from .tokens import Token, TokenKind, tokenize

__all__ = ["MAX_DEPTH", "parse_filter", "parse_literal", "parse_query", "parse_topic_expression"]

MAX_DEPTH = 32
"""Of parentheses and NOTs within each other."""
_MAX_TOPICS = 16
_RELATIONS = frozenset({"=", "<>", "<", "<=", ">", ">="})
_RESERVED = frozenset({"AND", "OR", "NOT", "BETWEEN", "LIKE", "MATCH"})
_TRUTH = {"TRUE": True, "FALSE": False}


def parse_filter(text: str) -> Condition | None:
    """A FilterExpression; None for an empty text, which everything passes.  Raises InvalidExpression."""
    parser = _Parser(text)
    condition = None if parser.at_end else parser.condition()
    parser.expect_end("AND, OR or the end")
    return condition


def parse_query(text: str) -> Query:
    """A QueryExpression: a condition, ``ORDER BY`` members, both, or nothing.  Raises InvalidExpression."""
    parser = _Parser(text)
    condition = None if parser.at_end or parser.is_order_by else parser.condition()
    order: tuple[Field, ...] = ()
    if parser.is_order_by:
        parser.take()
        parser.take()
        order = tuple(parser.list_of_fields())
    parser.expect_end("AND, OR, ORDER BY or the end" if not order else "a comma or the end")
    return Query(condition, order)


def parse_topic_expression(text: str) -> TopicExpression:
    """A TopicExpression: ``SELECT a, b AS c FROM X NATURAL JOIN Y WHERE ...``.  Raises InvalidExpression."""
    parser = _Parser(text)
    parser.expect_word("SELECT")
    fields = () if parser.skip_sign("*") else tuple(parser.selected_fields())
    parser.expect_word("FROM")
    topics = tuple(parser.joined_topics())
    condition = parser.condition() if parser.skip_word("WHERE") else None
    parser.skip_sign(";")
    parser.expect_end("the end")
    return TopicExpression(fields, topics, condition)


def parse_literal(text: str) -> Literal:
    """The value of a parameter: a number, TRUE or FALSE, or a text in quotes.  Raises InvalidExpression."""
    parser = _Parser(text)
    token = parser.take()
    value: int | float | str | bool = token.value
    if token.word in _TRUTH:
        value = _TRUTH[token.word]
    elif token.kind not in (TokenKind.NUMBER, TokenKind.TEXT):
        raise InvalidExpression(
            f"a parameter is a number, TRUE or FALSE, or a text in quotes, as \"'RED'\", not {text!r}"
        )
    parser.expect_end("nothing behind it")
    return Literal(value, token.column)


class _Parser:
    def __init__(self, text: str) -> None:
        self._text = text
        self._tokens = tokenize(text)
        self._position = 0
        self._depth = 0

    # --- words -------------------------------------------------------------------------------------------

    @property
    def _next(self) -> Token:
        return self._tokens[self._position]

    @property
    def at_end(self) -> bool:
        return self._next.kind is TokenKind.END

    @property
    def is_order_by(self) -> bool:
        return self._next.word == "ORDER" and self._tokens[self._position + 1].word == "BY"

    def take(self) -> Token:
        token = self._next
        if token.kind is not TokenKind.END:
            self._position += 1
        return token

    def refuse(self, expected: str, token: Token | None = None) -> NoReturn:
        found = token or self._next
        raise InvalidExpression(f"expected {expected}, found {found}", text=self._text, column=found.column)

    def skip_word(self, word: str) -> bool:
        if self._next.word != word:
            return False
        self._position += 1
        return True

    def skip_sign(self, sign: str) -> bool:
        if self._next.kind is not TokenKind.SIGN or self._next.text != sign:
            return False
        self._position += 1
        return True

    def expect_word(self, word: str) -> None:
        if not self.skip_word(word):
            self.refuse(word)

    def expect_sign(self, sign: str) -> None:
        if not self.skip_sign(sign):
            self.refuse(repr(sign))

    def expect_end(self, expected: str) -> None:
        if not self.at_end:
            self.refuse(expected)

    def name(self, what: str) -> Token:
        if self._next.kind is not TokenKind.NAME:
            self.refuse(what)
        return self.take()

    # --- conditions --------------------------------------------------------------------------------------

    def condition(self) -> Condition:
        operands = [self._conjunction()]
        while self.skip_word("OR"):
            operands.append(self._conjunction())
        return operands[0] if len(operands) == 1 else Or(tuple(operands))

    def _conjunction(self) -> Condition:
        operands = [self._negation()]
        while self.skip_word("AND"):
            operands.append(self._negation())
        return operands[0] if len(operands) == 1 else And(tuple(operands))

    def _negation(self) -> Condition:
        token = self._next
        is_negated = self.skip_word("NOT")
        if not is_negated and not self.skip_sign("("):
            return self._predicate()
        if self._depth >= MAX_DEPTH:
            self.refuse(f"conditions nested {MAX_DEPTH} deep at most", token)
        self._depth += 1
        if is_negated:
            inner: Condition = Not(self._negation())
        else:
            inner = self.condition()
            self.expect_sign(")")
        self._depth -= 1
        return inner

    def _predicate(self) -> Condition:
        left = self._operand()
        is_negated = self.skip_word("NOT")
        operator = self.take()
        predicate: Condition
        if operator.word == "BETWEEN" and isinstance(left, Field):
            low = self._operand()
            self.expect_word("AND")
            predicate = Between(left, low, self._operand())
        elif operator.word == "LIKE" and isinstance(left, Field):
            predicate = Comparison(left, "LIKE", self._operand())
        elif operator.word == "MATCH":
            self.refuse("LIKE, as vendors disagree on what MATCH means", operator)
        elif operator.kind is TokenKind.SIGN and operator.text in _RELATIONS and not is_negated:
            right = self._operand()
            if not isinstance(left, Field) and not isinstance(right, Field):
                self.refuse("a member on one side of the comparison", operator)
            return Comparison(left, operator.text, right)
        elif is_negated or isinstance(left, Field):
            self.refuse("BETWEEN or LIKE" if is_negated else "= <> < <= > >= LIKE or BETWEEN", operator)
        else:
            self.refuse("= <> < <= > or >=", operator)
        return Not(predicate) if is_negated else predicate

    def _operand(self) -> Operand:
        token = self._next
        if token.kind is TokenKind.NAME and token.word not in _RESERVED:
            if token.word in _TRUTH:
                self.take()
                return Literal(_TRUTH[token.word], token.column)
            return self.field()
        if token.kind in (TokenKind.NUMBER, TokenKind.TEXT):
            self.take()
            return Literal(token.value, token.column)
        if token.kind is TokenKind.PARAMETER:
            self.take()
            return Parameter(int(token.value), token.column)
        self.refuse("a member, a value or a parameter")

    # --- members and topics ------------------------------------------------------------------------------

    def field(self) -> Field:
        first = self.name("a member")
        path: list[str | int] = [first.text]
        while True:
            if self.skip_sign("."):
                path.append(self.name("the name of a member").text)
            elif self.skip_sign("["):
                index = self.take()
                if index.kind is not TokenKind.NUMBER or not isinstance(index.value, int) or index.value < 0:
                    self.refuse("the number of an element, from 0", index)
                path.append(index.value)
                self.expect_sign("]")
            else:
                return Field(tuple(path), first.column)

    def list_of_fields(self) -> list[Field]:
        fields = [self.field()]
        while self.skip_sign(","):
            fields.append(self.field())
        return fields

    def selected_fields(self) -> list[SelectedField]:
        fields = [self._selected_field()]
        while self.skip_sign(","):
            fields.append(self._selected_field())
        return fields

    def _selected_field(self) -> SelectedField:
        """``x``, ``x AS y``, or ``x y``."""
        if self._next.word == "FROM":
            self.refuse("a member")
        field = self.field()
        if self.skip_word("AS") or (self._next.kind is TokenKind.NAME and self._next.word != "FROM"):
            return SelectedField(field, self.name("the name of a member of the result").text)
        last = field.path[-1]
        if isinstance(last, int):
            self.refuse(f"AS and a name for {field}")
        return SelectedField(field, last)

    def joined_topics(self) -> list[str]:
        """Topics between NATURAL JOINs.  Parentheses on the right change nothing, as a natural join is associative."""
        topics = [self.name("the name of a topic").text]
        opened = 0
        while self._skip_join():
            if self.skip_sign("("):
                opened += 1
            topics.append(self.name("the name of a topic").text)
            if len(topics) > _MAX_TOPICS:
                self.refuse(f"{_MAX_TOPICS} topics at most")
        for _ in range(opened):
            self.expect_sign(")")
        return topics

    def _skip_join(self) -> bool:
        """``NATURAL JOIN``, ``NATURAL INNER JOIN`` or ``INNER NATURAL JOIN``."""
        if self.skip_word("INNER"):
            self.expect_word("NATURAL")
        elif self.skip_word("NATURAL"):
            self.skip_word("INNER")
        else:
            return False
        self.expect_word("JOIN")
        return True
