"""Rules on whether the files of an identity belong together: certificate, governance and permissions."""

from __future__ import annotations

import difflib
from collections.abc import Iterator
from typing import Final

from ddsi.structure.errors import MalformedMessage

from ..access_control.governance import DomainRule, Governance
from ..access_control.permissions import Permissions
from ..access_control.permissions import Rule as PermissionsRule
from ..access_control.subject_name import SubjectName
from ..access_control.xml_document import Node
from .certificate_rules import Certified
from .distinguished_name import rfc2253_text
from .document_rules import LoadedDocument
from .expression_sets import domains_overlap, overlaps
from .finding import Finding, Rule, Severity

__all__ = ["RULES", "check_documents", "check_subject", "subject_of"]

SUBJECT_MISMATCH: Final = Rule("subject-mismatch", Severity.ERROR, "no grant is for the subject of the certificate")
SUBJECT_SPELLING: Final = Rule("subject-spelling", Severity.WARNING, "a grant names its subject otherwise than openssl")
DOMAIN_WITHOUT_RULE: Final = Rule("domain-without-rule", Severity.ERROR, "rights in a domain that governance lacks")
TOPIC_WITHOUT_RULE: Final = Rule("topic-without-rule", Severity.ERROR, "rights to a topic that governance lacks")
RULES: Final = (SUBJECT_MISMATCH, SUBJECT_SPELLING, DOMAIN_WITHOUT_RULE, TOPIC_WITHOUT_RULE)

_MOST_TOPICS: Final = 1000
"""Topics of a rule, and topic rules, that are compared with each other."""


def subject_of(identity: Certified) -> SubjectName | None:
    """The subject as access control compares it; None for one that it cannot read."""
    try:
        return SubjectName.parse(rfc2253_text(identity[1].subject))
    except MalformedMessage:
        return None


def check_subject(identity: Certified, permissions: LoadedDocument) -> Iterator[Finding]:
    """Is there a grant for the bearer of the certificate?"""
    assert isinstance(permissions.model, Permissions)
    subject = subject_of(identity)
    if subject is None:
        return
    own = next((grant for grant in permissions.model.grants if grant.is_for(subject)), None)
    if own:
        if own.subject and own.subject.text != subject.text:
            yield SUBJECT_SPELLING.at(
                permissions.path,
                f"the grant is for {own.subject}, the certificate for {subject}: the same, but not to Fast DDS",
                line=own.line,
                remedy=f"write <subject_name>{subject}</subject_name>, as openssl x509 -nameopt RFC2253 prints it",
            )
        return
    grants = {str(grant.subject or grant.subject_expression): grant for grant in reversed(permissions.model.grants)}
    nearest = (difflib.get_close_matches(str(subject), grants, n=1, cutoff=0) or list(grants))[0]
    yield SUBJECT_MISMATCH.at(
        permissions.path,
        f"no grant is for {subject}, whom {identity[0]} certifies; the nearest is for {nearest}",
        line=grants[nearest].line,
        remedy=f"write <subject_name>{subject}</subject_name> and sign it again, or bring the identity's own document",
    )


def check_documents(governance: LoadedDocument, permissions: LoadedDocument) -> Iterator[Finding]:
    """Does governance say how to protect what permissions allow?"""
    assert isinstance(governance.model, Governance)
    assert isinstance(permissions.model, Permissions)
    nodes = permissions.root.get("permissions").all("grant")
    for grant, node in zip(permissions.model.grants, nodes, strict=True):
        rule_nodes = [child for child in node.nodes if child.tag in ("allow_rule", "deny_rule")]
        for rule, rule_node in zip(grant.rules, rule_nodes, strict=True):
            if rule.is_allow:
                yield from _check_rule(governance, permissions, rule, rule_node)


def _check_rule(
    governance: LoadedDocument, permissions: LoadedDocument, rule: PermissionsRule, node: Node
) -> Iterator[Finding]:
    assert isinstance(governance.model, Governance)
    domain_rules = [one for one in governance.model.domain_rules if domains_overlap(one.domains, rule.domains)]
    if not domain_rules:
        yield DOMAIN_WITHOUT_RULE.at(
            permissions.path,
            f"the {rule.label} is for {rule.domains}, for none of which {governance.path} has a domain_rule: nobody "
            "can join there",
            line=node.get("domains").line,
            remedy=f"add a domain_rule to {governance.path}, or correct the domains here",
        )
        return
    topics = [topic for child in node.nodes if child.tag != "domains" for topic in child.get("topics").nodes]
    for topic in topics[:_MOST_TOPICS]:
        if not any(_has_rule(domain_rule, topic.text) for domain_rule in domain_rules):
            yield TOPIC_WITHOUT_RULE.at(
                permissions.path,
                f"{topic.text!r} is allowed, but no topic_rule of {governance.path} is for it: nobody can use it",
                line=topic.line,
                remedy=f"add a topic_rule to {governance.path}, such as one for * at the end, or correct the name here",
            )


def _has_rule(rule: DomainRule, topic: str) -> bool:
    return any(overlaps(one.expression, topic) for one in rule.topic_rules[:_MOST_TOPICS])
