"""Checks: what governance leaves open to all, and what permissions must allow.  DDS-Security 1.1 §9.4.3, tables 64 ff.

    may_join(domain_rule, grant, *, domain_id, domain_tag="") -> Decision
    may_use_topic(domain_rule, grant, *, domain_id, topic, domain_tag="") -> Decision
    may_use_endpoint(domain_rule, grant, *, domain_id, kind, topic, partitions=(), data_tags=(), domain_tag="")

Pure functions on documents, for the plugin and for the keystore's tools alike.  ``grant`` may be :class:`Refused` - why
there is none - which matters only where permissions are asked.  The steps begin with the governance document's.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

from ddsi.spi import Refused

from ..attributes import DataTags
from .decision import Decision, Step, decide, decide_participant, decide_topic
from .document_error import shown, titled
from .governance import DomainRule, TopicRule
from .permissions import ActionKind, Grant

__all__ = ["may_join", "may_use_endpoint", "may_use_topic"]


def may_join(
    domain_rule: DomainRule, grant: Grant | Refused, *, domain_id: int, domain_tag: str = "", is_local: bool = True
) -> Decision:
    """check_create_participant (§8.4.2.9.3) and, with ``is_local`` false, check_remote_participant (§8.4.2.9.9).

    Anybody may create a participant where some topic is open to all; a remote one is asked for its rights
    nevertheless.  Fast DDS always asks the local one as well, for an allow rule of any domain.
    """
    if not domain_rule.enable_join_access_control:
        return _open(domain_rule, "enable_join_access_control is false, so anybody may join")
    if is_local and domain_rule.has_open_topics:
        return _open(domain_rule, "it has topics without access control, so anybody may join")
    first = _domain_step(domain_rule, "enable_join_access_control is true, so permissions decide")
    return _asked(grant, (first,), lambda held: decide_participant(held, domain_id=domain_id, domain_tag=domain_tag))


def may_use_topic(
    domain_rule: DomainRule, grant: Grant | Refused, *, domain_id: int, topic: str, domain_tag: str = ""
) -> Decision:
    """check_create_topic (§8.4.2.9.6) and check_remote_topic (§8.4.2.9.12)."""
    rule = domain_rule.topic_rule(topic)
    if rule is None:
        return _no_topic_rule(domain_rule, topic)
    for switch, is_on in (
        ("enable_read_access_control", rule.enable_read_access_control),
        ("enable_write_access_control", rule.enable_write_access_control),
    ):
        if not is_on:
            return _open(domain_rule, f"{switch} is false, so anybody may use the topic", rule)
    steps = _topic_steps(domain_rule, rule, "access control is on for reading and writing, so permissions decide")
    return _asked(
        grant, steps, lambda held: decide_topic(held, domain_id=domain_id, topic=topic, domain_tag=domain_tag)
    )


def may_use_endpoint(
    domain_rule: DomainRule,
    grant: Grant | Refused,
    *,
    domain_id: int,
    kind: ActionKind,
    topic: str,
    partitions: Sequence[str] = (),
    data_tags: DataTags = (),
    domain_tag: str = "",
) -> Decision:
    """check_create_ and check_remote_datawriter (PUBLISH) and _datareader (SUBSCRIBE, RELAY); §8.4.2.9.4-5, 10-11."""
    rule = domain_rule.topic_rule(topic)
    if rule is None:
        return _no_topic_rule(domain_rule, topic)
    is_write = kind is ActionKind.PUBLISH
    switch = "enable_write_access_control" if is_write else "enable_read_access_control"
    if not (rule.enable_write_access_control if is_write else rule.enable_read_access_control):
        return _open(domain_rule, f"{switch} is false, so anybody may {kind.value}", rule)
    return _asked(
        grant,
        _topic_steps(domain_rule, rule, f"{switch} is true, so permissions decide"),
        lambda held: decide(
            held,
            domain_id=domain_id,
            kind=kind,
            topic=topic,
            partitions=partitions,
            data_tags=data_tags,
            domain_tag=domain_tag,
        ),
    )


def _asked(grant: Grant | Refused, steps: tuple[Step, ...], decide_by: Callable[[Grant], Decision]) -> Decision:
    if isinstance(grant, Refused):
        return Decision(False, grant.reason, (*steps, Step("permissions", 0, "grant", "", True, grant.reason)))
    decision = decide_by(grant)
    return Decision(decision.allowed, decision.reason, steps + decision.steps)


def _open(domain_rule: DomainRule, why: str, topic_rule: TopicRule | None = None) -> Decision:
    rule = topic_rule or domain_rule
    steps = _topic_steps(domain_rule, topic_rule, why) if topic_rule else (_domain_step(domain_rule, why),)
    return Decision(True, f"{titled('governance', rule.document)}, line {rule.line}, {rule.label}: {why}", steps)


def _no_topic_rule(domain_rule: DomainRule, topic: str) -> Decision:
    expressions = ", ".join(shown(rule.expression) for rule in domain_rule.topic_rules[:5])
    why = f"no topic_rule matches topic {shown(topic)}; its topic_expressions are {expressions}"
    where = f"{titled('governance', domain_rule.document)}, line {domain_rule.line}, {domain_rule.label}"
    reason = f"{where}: {why}. Missing: a topic_rule for {shown(topic)}"
    return Decision(False, reason, (_domain_step(domain_rule, why),))


def _domain_step(rule: DomainRule, why: str) -> Step:
    return Step(rule.document, rule.line, rule.label, "", True, why)


def _topic_steps(domain_rule: DomainRule, rule: TopicRule, why: str) -> tuple[Step, ...]:
    return (
        _domain_step(domain_rule, f"is for {domain_rule.domains}"),
        Step(rule.document, rule.line, rule.label, shown(rule.expression), True, why),
    )
