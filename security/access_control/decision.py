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
from dataclasses import dataclass, field

from ddsi.spi import Refused

from ..attributes import DataTags
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
    what = f"{kind.value} topic {topic!r}{_in_partitions(partitions)}{_with_tags(data_tags)} of domain {domain_id}"
    right = f"{kind.value} {topic!r}{_in_partitions(partitions)}{_with_tags(data_tags)}"

    def fits(rule: Rule, criterion: Criterion) -> _Miss | None:
        if (miss := _misses_topic(rule, criterion, kind, topic)) is not None:
            return miss
        covers = _allow_covers if rule.is_allow else _deny_covers
        return covers(criterion, names, data_tags)

    return _search(grant, domain_id, domain_tag, what, right, fits)


def decide_topic(grant: Grant, *, domain_id: int, topic: str, domain_tag: str = "") -> Decision:
    """May it publish or subscribe ``topic`` in some partition?  A topic has neither partition nor tags (§8.4.2.9.6)."""
    decisions: list[Decision] = []
    for kind in (ActionKind.PUBLISH, ActionKind.SUBSCRIBE):

        def fits(rule: Rule, criterion: Criterion, kind: ActionKind = kind) -> _Miss | None:
            if (miss := _misses_topic(rule, criterion, kind, topic)) is not None:
                return miss
            if not rule.is_allow and (criterion.partitions or criterion.data_tags):
                return _Miss(3, criterion.line, "denies some partitions or data tags, not the topic")
            return None

        what = f"use topic {topic!r} of domain {domain_id}"
        decisions.append(_search(grant, domain_id, domain_tag, what, f"publish or subscribe {topic!r}", fits))
        if decisions[-1].allowed:
            break
    last = decisions[-1]
    return Decision(last.allowed, last.reason, tuple(step for decision in decisions for step in decision.steps))


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


def _search(
    grant: Grant,
    domain_id: int,
    domain_tag: str,
    what: str,
    right: str,
    fits: Callable[[Rule, Criterion], _Miss | None],
) -> Decision:
    steps: list[Step] = []
    misses: list[_Miss] = []
    for rule in grant.rules:
        if not rule.domains.include(domain_id, domain_tag):
            steps.append(_step(grant, rule, f"is for {rule.domains}"))
            misses += [_Miss(0, rule.line, "", f"is for {rule.domains}")] if rule.is_allow else []
            continue
        for criterion in rule.criteria:
            miss = fits(rule, criterion)
            if miss is None:
                steps.append(_step(grant, rule, "applies, and decides", criterion, applies=True))
                does = "lets it" if rule.is_allow else "forbids it to"
                reason = f"{grant}: the {rule.label} in line {rule.line}, by line {criterion.line}, {does} {what}"
                return Decision(rule.is_allow, reason, tuple(steps))
            steps.append(_step(grant, rule, miss.why, criterion))
            misses += [miss] if rule.is_allow else []
        if not rule.criteria:
            steps.append(_step(grant, rule, "names no topics"))
    steps.append(_default_step(grant))
    if grant.default_allow:
        return Decision(True, f"{grant}: no rule is about it, and by default it may {what}", tuple(steps))
    reason = f"{grant}: no allow rule lets it {what}{_nearest(misses, right)}. Missing right: {right}"
    return Decision(False, reason, tuple(steps))


def _misses_topic(rule: Rule, criterion: Criterion, kind: ActionKind, topic: str) -> _Miss | None:
    if criterion.kind is not kind:
        why = f"is about {criterion.kind.value}, not {kind.value}"
        return _Miss(1, rule.line, why, f"lets it {criterion.kind.value}, not {kind.value}")
    if not matching(criterion.topics, topic):
        topics = _listed(criterion.topics)
        return _Miss(
            2, criterion.line, f"topic {topic!r} is none of {topics}", f"allows topics {topics}", criterion.topics
        )
    return None


def _allow_covers(criterion: Criterion, partitions: tuple[str, ...], data_tags: DataTags) -> _Miss | None:
    expressions = criterion.partitions or ("",)
    for partition in partitions:
        if not matching(expressions, partition):
            allowed = f"partitions {_listed(expressions)}" if criterion.partitions else "the default partition alone"
            why = f"covers {allowed}, not partition {partition!r}"
            return _Miss(3, criterion.line, why, f"allows the topic in {allowed}")
    for tag in data_tags:
        if tag not in criterion.data_tags:
            allowed = _tags(criterion.data_tags)
            return _Miss(4, criterion.line, f"covers {allowed}, not {tag[0]}={tag[1]}", f"allows {allowed}")
    return None


def _deny_covers(criterion: Criterion, partitions: tuple[str, ...], data_tags: DataTags) -> _Miss | None:
    if criterion.partitions and not any(matching(criterion.partitions, partition) for partition in partitions):
        return _Miss(3, criterion.line, f"denies partitions {_listed(criterion.partitions)} only")
    if criterion.data_tags and not any(tag in criterion.data_tags for tag in data_tags):
        return _Miss(4, criterion.line, f"denies {_tags(criterion.data_tags)} only")
    return None


# --- words ---------------------------------------------------------------------------------------------------

_MOST_LISTED = 5


def _step(grant: Grant, rule: Rule, why: str, criterion: Criterion | None = None, *, applies: bool = False) -> Step:
    line = criterion.line if criterion else rule.line
    return Step(grant.document, line, rule.label, criterion.kind.value if criterion else "", applies, why)


def _default_step(grant: Grant) -> Step:
    why = f"no rule decided, and the default is {'ALLOW' if grant.default_allow else 'DENY'}"
    return Step(grant.document, grant.line, f"grant {grant.name!r}" if grant.name else "grant", "", True, why)


def _nearest(misses: Sequence[_Miss], right: str) -> str:
    """The allow rule that came nearest to ``right``, as an insertion into the sentence."""
    if not misses:
        return "; it has no allow rule"
    nearest_rank = max(miss.rank for miss in misses)
    candidates = [miss for miss in misses if miss.rank == nearest_rank][:50]
    nearest = candidates[0]
    if len(candidates) > 1:
        # Of several for other topics, the one whose topic is spelt most alike; bounded, as it takes time.
        topics = {topic[:100]: miss for miss in reversed(candidates) for topic in miss.topics[:50]}
        if near := difflib.get_close_matches(right.partition(" ")[2].strip("'")[:100], list(topics), n=1, cutoff=0.3):
            nearest = topics[near[0]]
    return f"; the nearest, at line {nearest.line}, {nearest.instead}"


def _listed(words: Sequence[str]) -> str:
    more = f" and {len(words) - _MOST_LISTED} more" if len(words) > _MOST_LISTED else ""
    return ", ".join(repr(word) for word in words[:_MOST_LISTED]) + more


def _tags(tags: DataTags) -> str:
    return (
        f"data tags {', '.join(f'{name}={value}' for name, value in tags[:_MOST_LISTED])}" if tags else "no data tags"
    )


def _in_partitions(partitions: Sequence[str]) -> str:
    if not partitions:
        return ""
    return f" in partition{'s' if len(partitions) > 1 else ''} {_listed(partitions)}"


def _with_tags(data_tags: DataTags) -> str:
    return f" with {_tags(data_tags)}" if data_tags else ""
