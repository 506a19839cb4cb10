"""Governance: how a domain is protected, the same for all of its participants.  DDS-Security 1.1 §9.4.1.2.

    Governance.parse(xml: bytes, *, name: str, first_line: int = 1) -> Governance      raises DocumentError
    governance.domain_rule(domain_id: int, domain_tag: str = "") -> DomainRule | None
    domain_rule.topic_rule(topic: str) -> TopicRule | None

In both the first rule that applies decides, in the document's order.  (OpenDDS looks at all of them when it asks
whether access control is off, and Fast DDS matches expressions in both directions: keep rules disjoint, ``*`` last.)

Values only: they hold no plugin and no signature, so that the keystore's tools and the plugin reason from one code.
"""

from __future__ import annotations

from dataclasses import field
from typing import Final

from ddsi.structure.dataclass import dataclass

from .document_error import DocumentError
from .domains import Domains, expression_of
from .protection import ProtectionKind
from .wildcard import matches
from .xml_document import Node, parse_document

__all__ = ["LOG_TOPICS", "DomainRule", "Governance", "TopicRule"]

LOG_TOPICS: Final = ("DDS:Security:LogTopic", "DDS:Security:LogTopicV2")


@dataclass(frozen=True, slots=True, kw_only=True)
class TopicRule:
    """How the endpoints of the topics that ``expression`` matches are protected (§9.4.1.2.6)."""

    document: str
    line: int
    label: str
    expression: str
    enable_discovery_protection: bool
    enable_liveliness_protection: bool
    enable_read_access_control: bool
    enable_write_access_control: bool
    metadata_protection_kind: ProtectionKind
    data_protection_kind: ProtectionKind


# The rule of the log topic stands in no document, and none can replace it (DDS-Security 1.1 §9.6).
_LOG_TOPIC_RULE = TopicRule(
    document="DDS Security",
    line=0,
    label="the builtin rule of the log topic",
    expression="DDS:Security:LogTopic*",
    enable_discovery_protection=False,
    enable_liveliness_protection=False,
    enable_read_access_control=True,
    enable_write_access_control=False,
    metadata_protection_kind=ProtectionKind.SIGN,
    data_protection_kind=ProtectionKind.ENCRYPT,
)


@dataclass(frozen=True, slots=True, kw_only=True)
class DomainRule:
    """How participants of ``domains`` are protected, and their topics (§9.4.1.2.4)."""

    document: str
    line: int
    label: str
    domains: Domains
    allow_unauthenticated_participants: bool
    enable_join_access_control: bool
    discovery_protection_kind: ProtectionKind
    liveliness_protection_kind: ProtectionKind
    rtps_protection_kind: ProtectionKind
    topic_rules: tuple[TopicRule, ...] = field(repr=False)
    unsupported: tuple[DocumentError, ...] = field(default=(), repr=False)
    """What the rule asks for beyond 1.1 that this implementation does not do; a participant must not go without it."""

    def topic_rule(self, topic: str) -> TopicRule | None:
        """The first rule whose expression matches; None: no endpoint of this topic may be created (§9.4.1.2.5)."""
        if topic in LOG_TOPICS:
            return _LOG_TOPIC_RULE
        return next((rule for rule in self.topic_rules if matches(rule.expression, topic)), None)

    @property
    def has_open_topics(self) -> bool:
        """Is there a topic that anybody may read or write?  Then anybody may join (§8.4.2.9.3, table)."""
        return any(
            not (rule.enable_read_access_control and rule.enable_write_access_control) for rule in self.topic_rules
        )


@dataclass(frozen=True, slots=True)
class Governance:
    """A governance document."""

    name: str
    domain_rules: tuple[DomainRule, ...] = field(repr=False)

    @classmethod
    def parse(cls, xml: bytes, *, name: str, first_line: int = 1) -> Governance:
        """From its XML, which somebody has verified; ``first_line``: of the file, where the XML begins."""
        root = parse_document(xml, name=name, first_line=first_line)
        rules = root.find("domain_access_rules")
        if rules is None:
            remedy = "a governance document has <domain_access_rules> inside <dds>"
            raise root.error("it is a permissions document, not governance", remedy=remedy)
        return cls(name, tuple(_domain_rule(node) for node in rules.all("domain_rule")))

    def domain_rule(self, domain_id: int, domain_tag: str = "") -> DomainRule | None:
        """The first rule for the domain; None: no participant may be created in it (§9.4.1.2.3)."""
        return next((rule for rule in self.domain_rules if rule.domains.include(domain_id, domain_tag)), None)


def _domain_rule(node: Node) -> DomainRule:
    rule = DomainRule(
        document=node.document,
        line=node.line,
        label=node.rule,
        domains=Domains.from_node(node.get("domains")),
        allow_unauthenticated_participants=_boolean(node.get("allow_unauthenticated_participants")),
        enable_join_access_control=_boolean(node.get("enable_join_access_control")),
        discovery_protection_kind=_kind(node.get("discovery_protection_kind")),
        liveliness_protection_kind=_kind(node.get("liveliness_protection_kind")),
        rtps_protection_kind=_kind(node.get("rtps_protection_kind")),
        topic_rules=tuple(_topic_rule(rule) for rule in node.get("topic_access_rules").all("topic_rule")),
        unsupported=_unsupported(node),
    )
    # Fast DDS refuses it likewise; Cyclone DDS lets it pass.
    if rule.allow_unauthenticated_participants and rule.rtps_protection_kind.is_protected:
        raise node.get("rtps_protection_kind").error(
            f"rtps_protection_kind {rule.rtps_protection_kind.value} shuts out those whom "
            "allow_unauthenticated_participants lets in",
            remedy="set one to NONE, or the other to false",
        )
    return rule


def _topic_rule(node: Node) -> TopicRule:
    return TopicRule(
        document=node.document,
        line=node.line,
        label=node.rule,
        expression=expression_of(node.get("topic_expression")),
        enable_discovery_protection=_boolean(node.get("enable_discovery_protection")),
        enable_liveliness_protection=_boolean(node.get("enable_liveliness_protection")),
        enable_read_access_control=_boolean(node.get("enable_read_access_control")),
        enable_write_access_control=_boolean(node.get("enable_write_access_control")),
        metadata_protection_kind=_kind(node.get("metadata_protection_kind")),
        data_protection_kind=_kind(node.get("data_protection_kind")),
    )


def _unsupported(node: Node) -> tuple[DocumentError, ...]:
    remedy = 'leave it out, set it to false or NONE, or give it the attribute must_interpret="false"'
    return tuple(
        found.error(f"<{found.tag}> of DDS Security 1.2 is not implemented", remedy=remedy)
        for name in ("enable_key_revision", "rtps_psk_protection_kind", "allowed_crypto_algorithms")
        if (found := node.find(name)) is not None
        and not found.may_be_ignored
        and found.text.lower() not in ("false", "0", "none")
    )


def _boolean(node: Node) -> bool:
    return node.text.lower() in ("true", "1")


def _kind(node: Node) -> ProtectionKind:
    return ProtectionKind(node.text)
