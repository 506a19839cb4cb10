"""Decision: may a grant's subject do this?  With the derivation, step by step.  DDS-Security 1.1 §9.4.1.3.2.3, §9.4.3.

    decide(grant, *, domain_id, kind, topic, partitions=(), data_tags=(), domain_tag="") -> Decision
    decide_topic(grant, *, domain_id, topic, domain_tag="") -> Decision
    decide_participant(grant, *, domain_id, domain_tag="") -> Decision

Pure functions on documents.  Rules are looked at in the document's order, the first that applies decides, else the
grant's default.  Vendors deviate, so that the same document allows different things:

===================  =============================================================================================
Cyclone DDS 0.10     no data tags, no relay; a deny rule without partitions denies the default partition alone
Fast DDS 2.9         no data tags; the default is not used (DENY); the first rule with the topic ends the search, even
                     if its partitions do not fit; rules of the local grant hold in every domain
OpenDDS              no data tags, no relay
RustDDS              a deny rule applies only if it covers all partitions and tags
===================  =============================================================================================

What the governance document says comes before, in ``checks.py``.
"""

from __future__ import annotations

import difflib
from collections.abc import Callable, Sequence
from dataclasses import field

from ddsi.spi import Refused
from ddsi.structure.dataclass import dataclass

from ..attributes import DataTags
from .document_error import shown
from .permissions import ActionKind, Criterion, Grant, Rule
from .wildcard import matching

__all__ = ["Decision", "Step", "decide", "decide_participant", "decide_topic"]


@dataclass(frozen=True, slots=True)
class Step:
    """One rule or criterion that was looked at: where it stands, and why it did or did not decide."""

    document: str
    line: int
    rule: str
    criterion: str
    applies: bool
    why: str

    def __str__(self) -> str:
        where = f"{self.document}:{self.line}" if self.line else self.document
        return f"{where}: {self.rule}{f', {self.criterion}' if self.criterion else ''}: {self.why}"


@dataclass(frozen=True, slots=True)
class Decision:
    """The answer, one sentence that says why, and the steps that led there; the last one decided."""

    allowed: bool
    reason: str
    steps: tuple[Step, ...] = field(default=(), repr=False)

    @property
    def refusal(self) -> Refused | None:
        return None if self.allowed else Refused(self.reason)


def decide(
    grant: Grant,
    *,
    domain_id: int,
    kind: ActionKind,
    topic: str,
    partitions: Sequence[str] = (),
    data_tags: DataTags = (),
    domain_tag: str = "",
) -> Decision:
    """May it publish, subscribe or relay ``topic`` in all of ``partitions``, with an endpoint that has ``data_tags``?

    No partitions are the one called "".  An allow rule must cover all of them, and all tags; for a deny rule one is
    enough, and it covers all that it does not name.
    """
    names = tuple(partitions) or ("",)

    def covers(rule: Rule, criterion: Criterion) -> _Miss | None:
        return (_allow_covers if rule.is_allow else _deny_covers)(criterion, names, data_tags)

    found = _search(grant, domain_id, domain_tag, kind, topic, covers)
    details = f"{_in_partitions(partitions)}{_with_tags(data_tags)}"
    what = f"{kind.value} topic {shown(topic)}{details} of domain {domain_id}"
    if found.allowed or found.by_rule:
        return Decision(found.allowed, f"{grant}: {found.by_rule or 'by default it may'} {what}", found.steps)
    right = f"{kind.value} {shown(topic)}{details}"
    return Decision(False, _refusal(grant, what, right, topic, found.misses), found.steps)


def decide_topic(grant: Grant, *, domain_id: int, topic: str, domain_tag: str = "") -> Decision:
    """May it publish, subscribe or relay ``topic`` in some partition?  A topic has none, and no tags (§8.4.2.9.6)."""

    def covers(rule: Rule, criterion: Criterion) -> _Miss | None:
        if not rule.is_allow and (criterion.partitions or criterion.data_tags):
            return _Miss(3, criterion.line, "denies some partitions or data tags, not the topic")
        return None

    steps: tuple[Step, ...] = ()
    misses: tuple[_Miss, ...] = ()
    for kind in ActionKind:
        found = _search(grant, domain_id, domain_tag, kind, topic, covers)
        if found.allowed:
            what = f"{kind.value} topic {shown(topic)} of domain {domain_id}"
            return Decision(True, f"{grant}: {found.by_rule or 'by default it may'} {what}", found.steps)
        steps += found.steps
        misses += found.misses
    what = f"publish, subscribe or relay topic {shown(topic)} of domain {domain_id}"
    return Decision(False, _refusal(grant, what, f"publish or subscribe {shown(topic)}", topic, misses), steps)


def decide_participant(grant: Grant, *, domain_id: int, domain_tag: str = "") -> Decision:
    """May it join the domain at all?  As 1.2 orders it, which cleared up what 1.1 left open.

    The first rule for the domain decides: an allow rule lets it in, and so does no deny rule but one without criteria,
    which shuts it out; a deny rule about some topics says nothing about joining.  (OpenDDS, after 1.1 to the letter,
    looks at governance alone; RTI's releases before 6.1.1 let the last rule decide.)
    """
    steps: list[Step] = []
    for rule in grant.rules:
        if not rule.domains.include(domain_id, domain_tag):
            steps.append(_step(grant, rule, f"is for {rule.domains}"))
        elif rule.is_allow:
            steps.append(_step(grant, rule, f"allows something in domain {domain_id}, and so to join it", applies=True))
            return Decision(
                True, f"{grant}: the rule in line {rule.line} lets it join domain {domain_id}", tuple(steps)
            )
        elif not rule.criteria:
            steps.append(_step(grant, rule, f"denies domain {domain_id} as a whole", applies=True))
            reason = f"{grant}: the {rule.label} in line {rule.line} forbids it to join domain {domain_id}"
            return Decision(False, reason, tuple(steps))
        else:
            steps.append(_step(grant, rule, "denies topics, and not to join the domain"))
    steps.append(_default_step(grant))
    if grant.default_allow:
        return Decision(True, f"{grant}: by default it may join domain {domain_id}", tuple(steps))
    others = sorted({str(rule.domains) for rule in grant.rules if rule.is_allow})[:3]
    nearest = f"; its allow rules are for {', '.join(others)}" if others else "; it has no allow rule"
    reason = f"{grant}: no allow rule lets it join domain {domain_id}{nearest}. Missing right: join domain {domain_id}"
    return Decision(False, reason, tuple(steps))


# --- the search ----------------------------------------------------------------------------------------------


@dataclass(frozen=True, slots=True)
class _Miss:
    """Why a criterion did not apply, for its step, and what its rule does instead, for the sentence of a refusal.

    Of several the one with the highest ``rank`` came nearest.
    """

    rank: int
    line: int
    why: str
    instead: str = ""
    topics: tuple[str, ...] = ()


@dataclass(frozen=True, slots=True)
class _Found:
    """``by_rule``: which rule decided, up to the verb; "" where the default did.  ``misses``: of allow rules alone."""

    allowed: bool
    by_rule: str
    steps: tuple[Step, ...]
    misses: tuple[_Miss, ...]


def _search(
    grant: Grant,
    domain_id: int,
    domain_tag: str,
    kind: ActionKind,
    topic: str,
    covers: Callable[[Rule, Criterion], _Miss | None],
) -> _Found:
    """The first criterion of this kind and for this topic that ``covers`` has nothing against, in document order."""
    steps: list[Step] = []
    misses: list[_Miss] = []
    for rule in grant.rules:
        if not rule.domains.include(domain_id, domain_tag):
            steps.append(_step(grant, rule, f"is for {rule.domains}"))
            misses += [_Miss(0, rule.line, "", f"is for {rule.domains}")] if rule.is_allow else []
            continue
        for criterion in rule.criteria:
            miss = _misses_topic(rule, criterion, kind, topic) or covers(rule, criterion)
            if miss is None:
                steps.append(_step(grant, rule, "applies, and decides", criterion, applies=True))
                verb = "lets it" if rule.is_allow else "forbids it to"
                by_rule = f"the {rule.label} in line {rule.line}, by line {criterion.line}, {verb}"
                return _Found(rule.is_allow, by_rule, tuple(steps), tuple(misses))
            steps.append(_step(grant, rule, miss.why, criterion))
            misses += [miss] if rule.is_allow else []
        if not rule.criteria:
            steps.append(_step(grant, rule, "names no topics"))
    steps.append(_default_step(grant))
    return _Found(grant.default_allow, "", tuple(steps), tuple(misses))


def _misses_topic(rule: Rule, criterion: Criterion, kind: ActionKind, topic: str) -> _Miss | None:
    if criterion.kind is not kind:
        why = f"is about {criterion.kind.value}, not {kind.value}"
        return _Miss(1, rule.line, why, f"lets it {criterion.kind.value}, not {kind.value}")
    if matching(criterion.topics, topic):
        return None
    topics = _listed(criterion.topics)
    why = f"topic {shown(topic)} is none of {topics}"
    return _Miss(2, criterion.line, why, f"allows topics {topics}", criterion.topics)


def _allow_covers(criterion: Criterion, partitions: tuple[str, ...], data_tags: DataTags) -> _Miss | None:
    expressions = criterion.partitions or ("",)
    for partition in partitions:
        if not matching(expressions, partition):
            allowed = f"partitions {_listed(expressions)}" if criterion.partitions else "the default partition alone"
            why = f"covers {allowed}, not partition {shown(partition)}"
            return _Miss(3, criterion.line, why, f"allows the topic in {allowed}")
    for tag in data_tags:
        if tag not in criterion.data_tags:
            allowed = _tags(criterion.data_tags)
            return _Miss(4, criterion.line, f"covers {allowed}, not {shown(f'{tag[0]}={tag[1]}')}", f"allows {allowed}")
    return None


def _deny_covers(criterion: Criterion, partitions: tuple[str, ...], data_tags: DataTags) -> _Miss | None:
    if criterion.partitions and not any(matching(criterion.partitions, partition) for partition in partitions):
        return _Miss(3, criterion.line, f"denies partitions {_listed(criterion.partitions)} only")
    if criterion.data_tags and not any(tag in criterion.data_tags for tag in data_tags):
        return _Miss(4, criterion.line, f"denies {_tags(criterion.data_tags)} only")
    return None


# --- words ---------------------------------------------------------------------------------------------------

_MOST_LISTED = 5
_MOST_COMPARED = 200


def _step(grant: Grant, rule: Rule, why: str, criterion: Criterion | None = None, *, applies: bool = False) -> Step:
    line = criterion.line if criterion else rule.line
    return Step(grant.document, line, rule.label, criterion.kind.value if criterion else "", applies, why)


def _default_step(grant: Grant) -> Step:
    why = f"no rule decided, and the default is {'ALLOW' if grant.default_allow else 'DENY'}"
    return Step(grant.document, grant.line, f"grant {grant.name!r}" if grant.name else "grant", "", True, why)


def _refusal(grant: Grant, what: str, right: str, topic: str, misses: Sequence[_Miss]) -> str:
    return f"{grant}: no allow rule lets it {what}; {_nearest(misses, topic)}. Missing right: {right}"


def _nearest(misses: Sequence[_Miss], topic: str) -> str:
    """What the allow rule says that came nearest."""
    if not misses:
        return "it has no allow rule"
    highest = max(miss.rank for miss in misses)
    candidates = [miss for miss in misses if miss.rank == highest][:_MOST_COMPARED]
    nearest = candidates[0]
    # Of several for other topics, the one whose topic is spelt most alike; bounded, as comparing takes time.
    topics = {name[:100]: miss for miss in reversed(candidates) for name in miss.topics[:_MOST_LISTED]}
    names = list(topics)[-_MOST_COMPARED:]
    if len(candidates) > 1 and (near := difflib.get_close_matches(topic[:100], names, n=1, cutoff=0.3)):
        nearest = topics[near[0]]
    return f"the nearest, at line {nearest.line}, {nearest.instead}"


def _listed(words: Sequence[str]) -> str:
    more = f" and {len(words) - _MOST_LISTED} more" if len(words) > _MOST_LISTED else ""
    return ", ".join(map(shown, words[:_MOST_LISTED])) + more


def _tags(tags: DataTags) -> str:
    return f"data tags {_listed([f'{name}={value}' for name, value in tags])}" if tags else "no data tags"


def _in_partitions(partitions: Sequence[str]) -> str:
    return f" in partition{'s' if len(partitions) > 1 else ''} {_listed(partitions)}" if partitions else ""


def _with_tags(data_tags: DataTags) -> str:
    return f" with {_tags(data_tags)}" if data_tags else ""
