"""May an identity do something, how will it be protected, and by which lines of which files?  DDS-Security 1.1 §9.4.

The answer is access control's own (:mod:`ddsi_security.access_control.checks`), with everything that led there.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path
from typing import Final

from cryptography import x509

from ddsi.structure.errors import ConfigurationError

from ..access_control.checks import may_join, may_use_endpoint
from ..access_control.decision import Decision, Step
from ..access_control.governance import DomainRule, Governance
from ..access_control.permissions import ActionKind, Permissions
from ..access_control.protection import ProtectionKind
from ..access_control.smime import SignedXml, verify
from ..access_control.xml_document import Node, parse_document
from ..attributes import DataTags
from .agreement_rules import subject_of
from .certificate import certificate_validity, is_issued_by, parse_certificate
from .distinguished_name import rfc2253_text
from .file_set import read_file
from .survey import Enclave
from .validity import utc

__all__ = ["Explanation", "Protection", "Question", "explain"]

_JOIN: Final = "join"


@dataclass(frozen=True, slots=True, kw_only=True)
class Question:
    """``verb``: publish, subscribe, relay or join; a join has neither topic nor partitions nor tags."""

    verb: str
    domain_id: int
    topic: str = ""
    partitions: tuple[str, ...] = ()
    data_tags: DataTags = ()

    def __str__(self) -> str:
        if self.verb == _JOIN:
            return f"join domain {self.domain_id}"
        partitions = f" in partition {', '.join(map(repr, self.partitions))}" if self.partitions else ""
        return f"{self.verb} {self.topic!r}{partitions} in domain {self.domain_id}"


@dataclass(frozen=True, slots=True)
class Protection:
    """One layer: where the document says so, and what it comes to."""

    path: Path
    line: int
    element: str
    value: str
    effect: str


@dataclass(frozen=True, slots=True)
class Explanation:
    """The answer.  ``stages``: what was asked one after the other, each with the steps to its decision."""

    subject: str
    question: Question
    allowed: bool
    reason: str
    stages: tuple[tuple[str, Decision], ...]
    protection: tuple[Protection, ...] = field(default=())


@dataclass(frozen=True, slots=True)
class _Documents:
    """What a participant would have loaded."""

    certificate: x509.Certificate
    governance: Governance
    governance_root: Node
    permissions: Permissions


def explain(enclave: Enclave, question: Question, *, now: int) -> Explanation:
    """``now``: ns since 1970.

    Raises ConfigurationError for files that no participant would take; it says which and what to do.
    """
    documents = _load(enclave)
    subject = rfc2253_text(documents.certificate.subject)
    stages = [("identity", _identity(enclave, documents.certificate, now))]
    rule = documents.governance.domain_rule(question.domain_id)
    if rule is None:
        stages.append(("join", _no_domain_rule(enclave, documents.governance, question)))
        return _answer(subject, question, stages)
    if rule.unsupported:
        raise rule.unsupported[0]
    stages += _ask(enclave, documents, rule, question, now)
    return _answer(subject, question, stages, _protection(enclave.governance, documents, rule, question))


def _answer(
    subject: str, question: Question, stages: list[tuple[str, Decision]], protection: tuple[Protection, ...] = ()
) -> Explanation:
    """The first refusal decides; where there is none, the last stage says why."""
    deciding = next((decision for _, decision in stages if not decision.allowed), stages[-1][1])
    return Explanation(
        subject=subject,
        question=question,
        allowed=deciding.allowed,
        reason=deciding.reason,
        stages=tuple(stages),
        protection=protection if deciding.allowed else (),
    )


# --- loading, as a participant would -------------------------------------------------------------------------


def _load(enclave: Enclave) -> _Documents:
    certificate = parse_certificate(read_file(enclave.certificate), str(enclave.certificate))
    identity_ca = parse_certificate(read_file(enclave.identity_ca), str(enclave.identity_ca))
    if not is_issued_by(certificate, identity_ca):
        raise ConfigurationError(
            f"{enclave.certificate} was not issued by the identity CA in {enclave.identity_ca}: no participant would "
            "take it; ddsi keystore check says more"
        )
    permissions_ca = parse_certificate(read_file(enclave.permissions_ca), str(enclave.permissions_ca))
    governance = _verified(enclave.governance, permissions_ca)
    permissions = _verified(enclave.permissions, permissions_ca)
    name = str(enclave.governance)
    return _Documents(
        certificate,
        Governance.parse(governance.xml, name=name, first_line=governance.first_line),
        parse_document(governance.xml, name=name, first_line=governance.first_line),
        Permissions.parse(permissions.xml, name=str(enclave.permissions), first_line=permissions.first_line),
    )


def _verified(path: Path, permissions_ca: x509.Certificate) -> SignedXml:
    return verify(read_file(path), permissions_ca, name=str(path))


# --- the stages ----------------------------------------------------------------------------------------------


def _identity(enclave: Enclave, certificate: x509.Certificate, now: int) -> Decision:
    validity = certificate_validity(certificate)
    subject, issuer = rfc2253_text(certificate.subject), rfc2253_text(certificate.issuer)
    why = f"{subject}, issued by {issuer}, valid from {validity.not_before:%Y-%m-%d} to {validity.not_after:%Y-%m-%d}"
    allowed = validity.not_before <= utc(now) <= validity.not_after
    reason = why if allowed else f"the certificate of {subject} is not valid at {utc(now):%Y-%m-%d %H:%M:%SZ}"
    return Decision(allowed, reason, (Step(str(enclave.certificate), 1, "certificate", "", True, why),))


def _no_domain_rule(enclave: Enclave, governance: Governance, question: Question) -> Decision:
    domains = ", ".join(str(rule.domains) for rule in governance.domain_rules)
    reason = f"no domain_rule is for domain {question.domain_id}; there are rules for {domains}"
    line = governance.domain_rules[0].line
    return Decision(False, reason, (Step(str(enclave.governance), line, "domain_access_rules", "", True, reason),))


def _ask(
    enclave: Enclave, documents: _Documents, rule: DomainRule, question: Question, now: int
) -> list[tuple[str, Decision]]:
    """To join is needed for all else; whoever may have an endpoint of a topic may create the topic."""
    subject = subject_of((enclave.certificate, documents.certificate))
    if subject is None:
        raise ConfigurationError(f"{enclave.certificate}: access control cannot read its subject; issue it anew")
    grant = documents.permissions.grant_for(subject, now)
    domain_id = question.domain_id
    stages = [("join", may_join(rule, grant, domain_id=domain_id))]
    by_others = may_join(rule, grant, domain_id=domain_id, is_local=False)
    if by_others.allowed != stages[0][1].allowed:
        stages.append(("be let in by others", by_others))
    if question.verb == _JOIN:
        return stages
    endpoint = may_use_endpoint(
        rule,
        grant,
        domain_id=domain_id,
        kind=ActionKind(question.verb),
        topic=question.topic,
        partitions=question.partitions,
        data_tags=question.data_tags,
    )
    return [*stages, (question.verb, endpoint)]


# --- protection ----------------------------------------------------------------------------------------------

_EFFECTS: Final = {
    ProtectionKind.NONE: "not protected by it",
    ProtectionKind.SIGN: "signed, and readable by anybody",
    ProtectionKind.ENCRYPT: "encrypted and signed",
    ProtectionKind.SIGN_WITH_ORIGIN_AUTHENTICATION: "signed for each receiver apart, and readable by anybody",
    ProtectionKind.ENCRYPT_WITH_ORIGIN_AUTHENTICATION: "encrypted, and signed for each receiver apart",
}


def _protection(path: Path, documents: _Documents, rule: DomainRule, question: Question) -> tuple[Protection, ...]:
    index = documents.governance.domain_rules.index(rule)
    node = documents.governance_root.get("domain_access_rules").all("domain_rule")[index]
    layers = [_layer(path, node, "rtps_protection_kind", "RTPS messages")]
    topic_rule = rule.topic_rule(question.topic) if question.verb != _JOIN else None
    if topic_rule is None:
        layers.append(_layer(path, node, "discovery_protection_kind", "messages of secure discovery"))
        layers.append(_layer(path, node, "liveliness_protection_kind", "messages of secure liveliness"))
    elif topic_rule in rule.topic_rules:  # the rule of the log topic stands in no document
        topic_node = node.get("topic_access_rules").all("topic_rule")[rule.topic_rules.index(topic_rule)]
        layers.append(_layer(path, topic_node, "metadata_protection_kind", "submessages of the topic"))
        layers.append(_layer(path, topic_node, "data_protection_kind", "payloads of samples"))
        layers.append(_switched_layer(path, node, topic_node, "discovery", "its announcements"))
        layers.append(_switched_layer(path, node, topic_node, "liveliness", "assertions of its liveliness"))
    return tuple(layers)


def _layer(path: Path, node: Node, tag: str, what: str) -> Protection:
    element = node.get(tag)
    return Protection(path, element.line, tag, element.text, f"{what} are {_EFFECTS[ProtectionKind(element.text)]}")


def _switched_layer(path: Path, node: Node, topic_node: Node, about: str, what: str) -> Protection:
    """One that the topic rule switches on, and whose kind is the domain's."""
    switch = topic_node.get(f"enable_{about}_protection")
    if switch.text.lower() in ("true", "1"):
        return _layer(path, node, f"{about}_protection_kind", what)
    return Protection(path, switch.line, switch.tag, switch.text, f"{what} are in clear")
