"""NaturalJoin: the rows of several topics that agree wherever their members have the same name.

DDS 1.4 §2.2.2.3.5 (MultiTopic), Annex B.2.2 (TopicExpression).  Each topic contributes the latest sample of each of its
instances.  A join is asked when one of these changes, and looks for partners by the values that have to agree, so that
the others are not gone through.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Iterator, Sequence
from types import SimpleNamespace
from typing import Any

from ...structure.dataclass import dataclass
from ..model import Extensibility, Member, StructType
from .evaluation import Predicate, compile_condition, fields_of
from .field_path import FieldPath, find_member
from .syntax import Field, InvalidExpression, SelectedField, TopicExpression

__all__ = ["Combination", "JoinPlan", "NaturalJoin"]

Combination = tuple[bytes, ...]
"""The handle of the instance that each topic contributes, in the order of the topics."""


@dataclass(frozen=True, slots=True)
class _Link:
    """How to come to the rows of one topic: those whose members ``names`` are as in the row so far."""

    topic: int
    names: tuple[str, ...]


class JoinPlan:
    """A topic expression, checked against the types of its topics and of its result."""

    def __init__(
        self, expression: TopicExpression, structs: Sequence[StructType], result: StructType, text: str
    ) -> None:
        """``structs``: of the topics, in the order of the expression.  Raises InvalidExpression."""
        self.text = text
        self.result = result
        self.topic_count = len(structs)
        self._condition = expression.condition
        self._members = [{member.name: member for member in struct.members} for struct in structs]
        self._check_shared(expression.topics)
        # What a row of all topics together has: the members of each, those with the same name once.
        merged: dict[str, Member] = {}
        for members in self._members:
            merged = {**members, **merged}
        members_of_all = tuple(merged.values())
        self._joined = StructType(
            SimpleNamespace, " NATURAL JOIN ".join(expression.topics), Extensibility.FINAL, lambda: members_of_all
        )
        if self._condition is not None:
            for field in fields_of(self._condition):
                FieldPath.find(self._joined, field, text)
        self._selected = self._selection(expression.fields)
        self.links = [self._links_from(start, expression.topics) for start in range(len(structs))]

    def bind(self, parameters: Sequence[str]) -> Predicate | None:
        """What a joined row must fulfil; None: nothing.  Raises InvalidExpression."""
        if self._condition is None:
            return None
        return compile_condition(self._condition, self._joined, parameters, self.text)

    def row_of(self, samples: Sequence[Any]) -> SimpleNamespace:
        """The members of all the samples together."""
        return SimpleNamespace(**{
            name: getattr(sample, name)
            for members, sample in zip(self._members, samples, strict=True)
            for name in members
        })  # fmt: skip

    def result_of(self, row: SimpleNamespace) -> Any:
        """What is selected of a row, as an object of the result's type; what the row lacks is as by default."""
        values = ((name, get(row)) for name, get in self._selected)
        return self.result.python_class(**{name: value for name, value in values if value is not None})

    # --- checks ------------------------------------------------------------------------------------------

    def _check_shared(self, topics: Sequence[str]) -> None:
        """Members of the same name must be comparable, and of the same type."""
        known: dict[str, tuple[Member, str]] = {}
        for topic, members in zip(topics, self._members, strict=True):
            for name, member in members.items():
                other, its_topic = known.setdefault(name, (member, topic))
                if other is member:
                    continue
                if other.type != member.type:
                    raise InvalidExpression(
                        f"{name} is {other.type} in {its_topic} and {member.type} in {topic}; a natural join needs one"
                        " type",
                        text=self.text,
                    )
                FieldPath.find(_struct_of(member), _field(member), self.text)

    def _links_from(self, start: int, topics: Sequence[str]) -> tuple[_Link, ...]:
        """In which order the other topics are joined to a row of this one, each by what it has in common with it."""
        seen = set(self._members[start])
        left = [index for index in range(self.topic_count) if index != start]
        links: list[_Link] = []
        while left:
            index = max(left, key=lambda candidate: len(seen & self._members[candidate].keys()))
            shared = tuple(sorted(seen & self._members[index].keys()))
            if not shared:
                raise InvalidExpression(
                    f"{topics[index]} has no member in common with the others; a natural join needs one", text=self.text
                )
            links.append(_Link(index, shared))
            seen |= self._members[index].keys()
            left.remove(index)
        return tuple(links)

    def _selection(self, fields: Sequence[SelectedField]) -> list[tuple[str, Callable[[Any], Any]]]:
        """Member of the result, and how to get it from a row."""
        targets = {member.name_in_idl: member for member in self.result.members}
        if not fields:
            names = [member.name_in_idl for member in self._joined.members if member.name_in_idl in targets]
            fields = [SelectedField(Field((name,)), name) for name in names]
        selected: dict[str, Callable[[Any], Any]] = {}
        for field in fields:
            type_, get = find_member(self._joined, field.field, self.text)
            target_type, _ = find_member(self.result, Field((field.name,), field.field.column), self.text)
            if type_ != target_type:
                raise InvalidExpression(
                    f"{field.field} is {type_}, and {field.name} of {self.result} is {target_type}",
                    text=self.text,
                    column=field.field.column,
                )
            selected[targets[field.name].name] = get
        for name in _needed(self.result.python_class):
            if name not in selected:
                raise InvalidExpression(f"nothing is selected for {name} of {self.result}", text=self.text)
        return list(selected.items())


def _field(member: Member) -> Field:
    return Field((member.name_in_idl,))


def _struct_of(member: Member) -> StructType:
    return StructType(SimpleNamespace, "natural join", Extensibility.FINAL, lambda: (member,))


def _needed(python_class: type[Any]) -> Iterator[str]:
    """The members that an object cannot be made without."""
    for field in dataclasses.fields(python_class):
        if field.default is dataclasses.MISSING and field.default_factory is dataclasses.MISSING:
            yield field.name


class NaturalJoin:
    """The present samples of the topics, by the handles of their instances."""

    def __init__(self, plan: JoinPlan) -> None:
        self._plan = plan
        self._samples: list[dict[bytes, Any]] = [{} for _ in range(plan.topic_count)]
        # For each topic and each set of members by which it is looked up: the handles, by the values of these.
        self._indexes: dict[_Link, dict[tuple[Any, ...], dict[bytes, None]]] = {
            link: {} for links in plan.links for link in links
        }

    def put(self, topic: int, handle: bytes, sample: Any) -> None:
        """This is the latest sample of an instance."""
        self.remove(topic, handle)
        self._samples[topic][handle] = sample
        for link, index in self._indexes.items():
            if link.topic == topic:
                index.setdefault(_values(sample, link.names), {})[handle] = None

    def remove(self, topic: int, handle: bytes) -> None:
        """The instance is gone, if it was there."""
        sample = self._samples[topic].pop(handle, None)
        if sample is None:
            return
        for link, index in self._indexes.items():
            if link.topic == topic:
                values = _values(sample, link.names)
                del index[values][handle]
                if not index[values]:
                    del index[values]

    def handles(self, topic: int) -> list[bytes]:
        """The instances that a topic contributes."""
        return list(self._samples[topic])

    def rows_with(self, topic: int, handle: bytes) -> Iterator[tuple[Combination, SimpleNamespace]]:
        """Every combination of samples that agree and of which this is one, with the members of all."""
        chosen: list[tuple[bytes, Any] | None] = [None] * self._plan.topic_count
        chosen[topic] = (handle, self._samples[topic][handle])
        yield from self._extend(chosen, SimpleNamespace(**_members(chosen[topic])), self._plan.links[topic])

    def _extend(
        self, chosen: list[tuple[bytes, Any] | None], row: SimpleNamespace, links: tuple[_Link, ...]
    ) -> Iterator[tuple[Combination, SimpleNamespace]]:
        if not links:
            parts = [part for part in chosen if part is not None]
            samples = [sample for _, sample in parts]
            yield tuple(handle for handle, _ in parts), self._plan.row_of(samples)
            return
        link, *others = links
        values = _values(row, link.names)
        if None in values:  # what is absent agrees with nothing, as in SQL
            return
        for handle in self._indexes[link].get(values, ()):
            sample = self._samples[link.topic][handle]
            chosen[link.topic] = (handle, sample)
            extended = SimpleNamespace(**{**vars(row), **_members((handle, sample))})
            yield from self._extend(chosen, extended, tuple(others))
        chosen[link.topic] = None


def _values(row: Any, names: Sequence[str]) -> tuple[Any, ...]:
    return tuple(getattr(row, name) for name in names)


def _members(part: tuple[bytes, Any] | None) -> dict[str, Any]:
    assert part is not None
    return {field.name: getattr(part[1], field.name) for field in dataclasses.fields(part[1])}
