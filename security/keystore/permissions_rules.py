"""Rules on permissions documents: what vendors read differently, what has expired, what can never match.

DDS-Security 1.1 §9.4.1.3.  Of the vendors' differences each text says who is concerned.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Final, NamedTuple

from ..access_control.permissions import Criterion, Grant, Permissions
from ..access_control.permissions import Rule as PermissionsRule
from ..access_control.validity import instant_text
from ..access_control.xml_document import Node
from .document_rules import LoadedDocument
from .expression_sets import covers, domains_cover, domains_overlap, overlaps
from .finding import Finding, Rule, Severity
from .governance_rules import check_brackets, check_domains
from .horizon import Horizon

__all__ = ["RULES", "check_permissions"]

GRANT_EXPIRED: Final = Rule("grant-expired", Severity.ERROR, "a grant is not valid any more")
GRANT_NOT_YET_VALID: Final = Rule("grant-not-yet-valid", Severity.ERROR, "a grant is not valid yet")
GRANT_EXPIRES_SOON: Final = Rule("grant-expires-soon", Severity.WARNING, "a grant ends within --soon days")
GRANT_SHADOWED: Final = Rule("grant-shadowed", Severity.WARNING, "a second grant for one subject")
DEFAULT_ALLOW: Final = Rule("default-allow", Severity.WARNING, "<default>ALLOW, which Fast DDS does not heed")
DENY_RULE: Final = Rule("deny-rule", Severity.WARNING, "a deny_rule, which vendors read differently")
DATA_TAGS: Final = Rule("data-tags", Severity.WARNING, "data tags, which others do not check")
RELAY: Final = Rule("relay-right", Severity.NOTE, "a right to relay, which others do not know")
NEVER_MATCHES: Final = Rule("rule-never-matches", Severity.WARNING, "an earlier rule decides all that a topic's would")
PARTITION_ORDER: Final = Rule("partition-order", Severity.WARNING, "a topic in several rules that differ by partition")
NO_RIGHTS: Final = Rule("grant-without-rights", Severity.WARNING, "a grant that allows nothing")
RULES: Final = (
    *(GRANT_EXPIRED, GRANT_NOT_YET_VALID, GRANT_EXPIRES_SOON, GRANT_SHADOWED, DEFAULT_ALLOW, DENY_RULE, DATA_TAGS),
    *(RELAY, NEVER_MATCHES, PARTITION_ORDER, NO_RIGHTS),
)


_MOST_COMPARED: Final = 300
"""Clauses of a grant, and topics of a clause, that are compared with each other, as the time goes with the square."""


class _Clause(NamedTuple):
    """A criterion with the rule it stands in, and its element."""

    rule: PermissionsRule
    criterion: Criterion
    node: Node


def check_permissions(document: LoadedDocument, horizon: Horizon) -> Iterator[Finding]:
    """All that can be said of it alone."""
    assert isinstance(document.model, Permissions)
    grants = document.model.grants
    for index, (grant, node) in enumerate(zip(grants, document.root.get("permissions").all("grant"), strict=True)):
        yield from _check_validity(document, grant, node, horizon)
        yield from _check_vendors(document, grant, node)
        clauses = list(_clauses(grant, node))
        for position, clause in enumerate(clauses[:_MOST_COMPARED]):
            yield from _check_clause(document, clause, clauses[:position])
        first = next(
            (earlier for earlier in grants[:index] if grant.subject and earlier.subject == grant.subject), None
        )
        if first:
            yield GRANT_SHADOWED.at(
                document.path,
                f"grant {grant.name!r} is for {grant.subject}, as that in line {first.line} is, and Cyclone DDS and we "
                "look at the first alone",
                line=grant.line,
                remedy="put its rules into the first, and remove it",
            )


def _clauses(grant: Grant, node: Node) -> Iterator[_Clause]:
    rule_nodes = [child for child in node.nodes if child.tag in ("allow_rule", "deny_rule")]
    for rule, rule_node in zip(grant.rules, rule_nodes, strict=True):
        criterion_nodes = [child for child in rule_node.nodes if child.tag != "domains"]
        for criterion, criterion_node in zip(rule.criteria, criterion_nodes, strict=True):
            yield _Clause(rule, criterion, criterion_node)


def _check_validity(document: LoadedDocument, grant: Grant, node: Node, horizon: Horizon) -> Iterator[Finding]:
    not_before, not_after = node.get("validity").get("not_before"), node.get("validity").get("not_after")
    remedy = "write new dates and sign it again: ddsi keystore permissions"
    end = instant_text(grant.validity.not_after)
    if horizon.now >= grant.validity.not_after:
        yield GRANT_EXPIRED.at(
            document.path, f"grant {grant.name!r} expired at {end}", line=not_after.line, remedy=remedy
        )
    elif horizon.soon > grant.validity.not_after:
        text = f"grant {grant.name!r} expires at {end}, in {horizon.days_until(grant.validity.not_after)} days"
        yield GRANT_EXPIRES_SOON.at(document.path, text, line=not_after.line, remedy=remedy)
    if horizon.now < grant.validity.not_before:
        text = f"grant {grant.name!r} is not valid before {instant_text(grant.validity.not_before)}"
        yield GRANT_NOT_YET_VALID.at(document.path, text, line=not_before.line, remedy=remedy)


def _check_vendors(document: LoadedDocument, grant: Grant, node: Node) -> Iterator[Finding]:
    if grant.default_allow:
        yield DEFAULT_ALLOW.at(
            document.path,
            "by default all is allowed, but Fast DDS denies what no rule allows",
            line=node.get("default").line,
            remedy="write an allow_rule, such as one for topic * and partition *, and <default>DENY</default>",
        )
    if not grant.default_allow and not any(rule.is_allow for rule in grant.rules):
        text = f"grant {grant.name!r} has no allow_rule, and its default is DENY: its subject may do nothing"
        yield NO_RIGHTS.at(document.path, text, line=grant.line, remedy="add an allow_rule, or remove the grant")
    for child in node.nodes:
        if child.tag not in ("allow_rule", "deny_rule"):
            continue
        yield from check_domains(document, child.get("domains"))
        if child.tag == "deny_rule" and len(child.nodes) > 1:
            yield DENY_RULE.at(
                document.path,
                "a deny_rule without partitions denies all of them, with Cyclone DDS only the empty one; with some, "
                "Fast DDS denies the topic in all others too; and Cyclone DDS refuses the topic as such",
                line=child.line,
                remedy="name what is allowed instead, and leave the rest to <default>DENY</default>",
            )


def _check_clause(document: LoadedDocument, clause: _Clause, earlier: list[_Clause]) -> Iterator[Finding]:
    _, criterion, node = clause
    partitions = node.find("partitions")
    for expression in (*node.get("topics").nodes, *(partitions.nodes if partitions else ())):
        yield from check_brackets(document, expression)
    if criterion.data_tags:
        yield DATA_TAGS.at(
            document.path,
            "Cyclone DDS, Fast DDS and OpenDDS do not check data tags, so they allow or deny whatever the tags are",
            line=node.get("data_tags").line,
            remedy="use topics or partitions to tell data apart, if they take part",
        )
    if node.tag == "relay":
        text = "Cyclone DDS and OpenDDS do not know the right to relay, and refuse whoever has no other"
        yield RELAY.at(document.path, text, line=node.line, remedy="allow it to subscribe as well, if they take part")
    comparable = [other for other in earlier if other.criterion.kind is criterion.kind]
    for topic in node.get("topics").nodes[:_MOST_COMPARED]:
        yield from _check_order(document, clause, topic, comparable)


def _check_order(document: LoadedDocument, clause: _Clause, topic: Node, earlier: list[_Clause]) -> Iterator[Finding]:
    """Does an earlier clause take the topic away from this one, or would it with Fast DDS?"""
    what = f"{topic.text!r} in this {clause.criterion.kind.value} of the {clause.rule.label}"
    for other in earlier:
        where = f"the {other.rule.label} in line {other.rule.line}, by line {other.criterion.line},"
        if _decides_before(other, clause, topic.text):
            yield NEVER_MATCHES.at(
                document.path,
                f"{what} can never match: {where} goes first and decides for all that it means",
                line=topic.line,
                remedy="put it before, or remove it",
            )
            return
    for other in earlier:
        if other.rule.is_allow and clause.rule.is_allow and _ends_the_search(other, clause, topic.text):
            yield PARTITION_ORDER.at(
                document.path,
                f"{what} is not reached by Fast DDS: it ends its search at line {other.criterion.line}, which has the "
                "topic in other partitions",
                line=topic.line,
                remedy="put all partitions of a topic into one criterion",
            )
            return


def _decides_before(first: _Clause, second: _Clause, topic: str) -> bool:
    """Whenever the second would apply to the topic, does the first?  Data tags are those that the second names."""
    if not domains_cover(first.rule.domains, second.rule.domains):
        return False
    if not any(covers(expression, topic) for expression in first.criterion.topics):
        return False
    # An allow rule must cover all partitions of an endpoint and all its tags; a deny rule needs one, or none named.
    if first.rule.is_allow:
        tags_fit = set(second.criterion.data_tags) <= set(first.criterion.data_tags)
        needed = _partitions(second) if second.rule.is_allow else ("*",)
    else:
        tags_fit = not first.criterion.data_tags
        needed = _partitions(second)
    had = _partitions(first)
    return tags_fit and all(any(covers(one, partition) for one in had) for partition in needed)


def _ends_the_search(first: _Clause, second: _Clause, topic: str) -> bool:
    """Fast DDS looks for the first rule with the topic, and then at its partitions."""
    return (
        domains_overlap(first.rule.domains, second.rule.domains)
        and any(overlaps(expression, topic) for expression in first.criterion.topics)
        and not all(any(covers(one, other) for one in _partitions(first)) for other in _partitions(second))
    )


def _partitions(clause: _Clause) -> tuple[str, ...]:
    """What it is about where it names none: an allow rule the empty partition, a deny rule all."""
    return clause.criterion.partitions or (("",) if clause.rule.is_allow else ("*",))
