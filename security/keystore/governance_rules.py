"""Rules on governance documents: what vendors read differently, and what cannot be meant.

DDS-Security 1.1 §9.4.1.2.  Of the vendors' differences each text says who is concerned.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Final

from ..access_control.governance import DomainRule, Governance, TopicRule
from ..access_control.protection import ProtectionKind
from ..access_control.xml_document import Node
from .document_rules import LoadedDocument
from .domain_ranges import CYCLONE_HIGHEST_DOMAIN
from .expression_sets import covers, domains_cover
from .finding import Finding, Rule, Severity

__all__ = ["RULES", "check_brackets", "check_domains", "check_governance"]

DOMAIN_TOO_HIGH: Final = Rule("domain-too-high", Severity.WARNING, "a domain above 230, which Cyclone DDS refuses")
RANGE_WITHOUT_MAX: Final = Rule("range-without-max", Severity.WARNING, "an id_range that vendors read differently")
BRACKET: Final = Rule("bracket-expression", Severity.WARNING, "[ in an expression, which vendors read differently")
ORIGIN_AUTHENTICATION: Final = Rule("origin-authentication", Severity.WARNING, "a kind that OpenDDS does not have")
DATA_WITHOUT_METADATA: Final = Rule("data-without-metadata", Severity.WARNING, "only payloads are protected")
RTPS_WITHOUT_DISCOVERY: Final = Rule("rtps-without-discovery", Severity.WARNING, "messages are, discovery is not")
FLAG_WITHOUT_KIND: Final = Rule("flag-without-kind", Severity.WARNING, "a topic asks for protection of kind NONE")
UNPROTECTED_CONTROL: Final = Rule("control-without-protection", Severity.NOTE, "rights are checked, data goes in clear")
OPEN_TO_STRANGERS: Final = Rule("open-to-strangers", Severity.WARNING, "who has no identity may use a topic")
TOPIC_RULE_SHADOWED: Final = Rule("topic-rule-shadowed", Severity.WARNING, "an earlier topic_rule takes all its topics")
DOMAIN_RULE_SHADOWED: Final = Rule(
    "domain-rule-shadowed", Severity.WARNING, "an earlier domain_rule takes all its domains"
)
UNSUPPORTED: Final = Rule("unsupported-element", Severity.ERROR, "the document asks for what is not implemented here")
RULES: Final = (
    *(DOMAIN_TOO_HIGH, RANGE_WITHOUT_MAX, BRACKET, ORIGIN_AUTHENTICATION, DATA_WITHOUT_METADATA),
    *(RTPS_WITHOUT_DISCOVERY, FLAG_WITHOUT_KIND, UNPROTECTED_CONTROL, OPEN_TO_STRANGERS, TOPIC_RULE_SHADOWED),
    *(DOMAIN_RULE_SHADOWED, UNSUPPORTED),
)

_MOST_COMPARED: Final = 300
"""Rules that are compared with each other, as the time goes with the square."""
_ORIGIN_KINDS: Final = ("discovery_protection_kind", "liveliness_protection_kind", "rtps_protection_kind")


def check_governance(document: LoadedDocument) -> Iterator[Finding]:
    """All that can be said of it alone."""
    assert isinstance(document.model, Governance)
    nodes = document.root.get("domain_access_rules").all("domain_rule")
    rules = document.model.domain_rules
    for index, (rule, node) in enumerate(zip(rules, nodes, strict=True)):
        yield from check_domains(document, node.get("domains"))
        yield from _check_domain_rule(document, rule, node)
        first = next(
            (
                earlier
                for earlier in rules[: min(index, _MOST_COMPARED)]
                if domains_cover(earlier.domains, rule.domains)
            ),
            None,
        )
        if first:
            text = (
                f"{rule.label} is never used: {first.label} in line {first.line} is for {first.domains}, and goes first"
            )
            yield DOMAIN_RULE_SHADOWED.at(document.path, text, line=rule.line, remedy="put it before, or remove it")
        for topic_rule, topic_node in zip(rule.topic_rules, _topic_nodes(node), strict=True):
            yield from _check_topic_rule(document, rule, topic_rule, topic_node)
        yield from _check_topic_order(document, rule, _topic_nodes(node))


def check_domains(document: LoadedDocument, node: Node) -> Iterator[Finding]:
    """A ``<domains>``, of either document."""
    for child in node.nodes:
        highest = child.find("max") if child.tag == "id_range" else child if child.tag == "id" else None
        if child.tag == "id_range" and highest is None:
            yield RANGE_WITHOUT_MAX.at(
                document.path,
                "the id_range has no max: Cyclone DDS refuses the document, and Fast DDS takes it for one domain",
                line=child.line,
                remedy=f"write both ends, such as <max>{CYCLONE_HIGHEST_DOMAIN}</max>",
            )
        elif highest is not None and int(highest.text) > CYCLONE_HIGHEST_DOMAIN:
            yield DOMAIN_TOO_HIGH.at(
                document.path,
                f"domain {highest.text}: Cyclone DDS refuses the whole document, as it knows domains 0 to "
                f"{CYCLONE_HIGHEST_DOMAIN}",
                line=highest.line,
                remedy=f"end at {CYCLONE_HIGHEST_DOMAIN}",
            )


def check_brackets(document: LoadedDocument, node: Node) -> Iterator[Finding]:
    """An expression for topics or partitions."""
    if "[" in node.text:
        yield BRACKET.at(
            document.path,
            f"{node.text!r}: where a [ is not closed, or a range is not complete, Cyclone, Fast DDS and OpenDDS differ",
            line=node.line,
            remedy="list the names, or use * and ?",
        )


def _topic_nodes(node: Node) -> list[Node]:
    return node.get("topic_access_rules").all("topic_rule")


def _check_domain_rule(document: LoadedDocument, rule: DomainRule, node: Node) -> Iterator[Finding]:
    for tag in _ORIGIN_KINDS:
        yield from _check_origin(document, node.get(tag))
    if rule.rtps_protection_kind.is_protected and not rule.discovery_protection_kind.is_protected:
        yield RTPS_WITHOUT_DISCOVERY.at(
            document.path,
            f"rtps_protection_kind is {rule.rtps_protection_kind.value}, discovery_protection_kind NONE: Cyclone DDS "
            "then sends its discovery in clear, and OpenDDS drops it",
            line=node.get("rtps_protection_kind").line,
            remedy="protect discovery too: SIGN or ENCRYPT, and enable_discovery_protection for the topics",
        )
    for error in rule.unsupported:
        yield UNSUPPORTED.at(document.path, error.reason, line=error.line, remedy=error.remedy)


def _check_topic_rule(
    document: LoadedDocument, rule: DomainRule, topic_rule: TopicRule, node: Node
) -> Iterator[Finding]:
    yield from check_brackets(document, node.get("topic_expression"))
    yield from _check_origin(document, node.get("metadata_protection_kind"))
    metadata, data = topic_rule.metadata_protection_kind, topic_rule.data_protection_kind
    if data.is_protected and not metadata.is_protected:
        yield DATA_WITHOUT_METADATA.at(
            document.path,
            f"data_protection_kind is {data.value}, metadata_protection_kind NONE: writers of Fast DDS then wait for "
            "keys that readers of Cyclone DDS do not send, and the two never match",
            line=node.get("data_protection_kind").line,
            remedy="set metadata_protection_kind to SIGN or ENCRYPT where both take part",
        )
    for flag, kind, is_on in (
        ("enable_discovery_protection", rule.discovery_protection_kind, topic_rule.enable_discovery_protection),
        ("enable_liveliness_protection", rule.liveliness_protection_kind, topic_rule.enable_liveliness_protection),
    ):
        if is_on and not kind.is_protected:
            name = flag.removeprefix("enable_") + "_kind"
            yield FLAG_WITHOUT_KIND.at(
                document.path,
                f"{flag} is true, but the {name} of its domain_rule is NONE, so that nothing is protected",
                line=node.get(flag).line,
                remedy=f"set {name} to SIGN or ENCRYPT, or {flag} to false",
            )
    yield from _check_control(document, rule, topic_rule, node)


def _check_control(document: LoadedDocument, rule: DomainRule, topic_rule: TopicRule, node: Node) -> Iterator[Finding]:
    controls = topic_rule.enable_read_access_control, topic_rule.enable_write_access_control
    kinds = rule.rtps_protection_kind, topic_rule.metadata_protection_kind, topic_rule.data_protection_kind
    protected = any(kind.is_protected for kind in kinds)
    if rule.allow_unauthenticated_participants and not all(controls) and not protected:
        yield OPEN_TO_STRANGERS.at(
            document.path,
            f"topics {topic_rule.expression!r} have neither protection nor access control both ways, and "
            "allow_unauthenticated_participants is true: anybody may use them",
            line=node.line,
            remedy="if that is not meant, set enable_read_access_control and enable_write_access_control to true",
        )
    elif any(controls) and not protected:
        yield UNPROTECTED_CONTROL.at(
            document.path,
            f"rights to topics {topic_rule.expression!r} are checked, but data goes in clear, and anybody may forge it",
            line=node.line,
            remedy="set metadata_protection_kind to SIGN at least, if the network is not trusted",
        )


def _check_origin(document: LoadedDocument, node: Node) -> Iterator[Finding]:
    if ProtectionKind(node.text).is_origin_authenticated:
        yield ORIGIN_AUTHENTICATION.at(
            document.path,
            f"{node.tag} {node.text}: OpenDDS does not have it, and does not match",
            line=node.line,
            remedy=f"use {node.text.partition('_')[0]} where OpenDDS takes part",
        )


def _check_topic_order(document: LoadedDocument, rule: DomainRule, nodes: list[Node]) -> Iterator[Finding]:
    for index, topic_rule in enumerate(rule.topic_rules[:_MOST_COMPARED]):
        for earlier in rule.topic_rules[:index]:
            if covers(earlier.expression, topic_rule.expression):
                yield TOPIC_RULE_SHADOWED.at(
                    document.path,
                    f"the topic_rule for {topic_rule.expression!r} is never used: that for {earlier.expression!r} in "
                    f"line {earlier.line} goes first, and takes all its topics",
                    line=nodes[index].line,
                    remedy="put it before, or remove it",
                )
                break
