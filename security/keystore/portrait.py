"""What a file of a keystore says, as names and values: for people as indented lines, for programs as JSON.

Of private keys only what their public half says is told.
"""

from __future__ import annotations

import stat
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TypeAlias

from cryptography import x509
from cryptography.hazmat.primitives import hashes

from ddsi.structure.errors import ConfigurationError

from ..access_control.document_error import UntrustedDocument
from ..access_control.governance import DomainRule, Governance, TopicRule
from ..access_control.permissions import Criterion, Grant
from ..access_control.smime import SignedXml, verify
from ..access_control.validity import instant_text
from ..authentication.adjusted_guid import subject_octets
from .certificate import certificate_validity, is_authority, is_issued_by
from .distinguished_name import rfc2253_text
from .document import document_kind, is_signed, parse_document, unverified
from .file_set import read_file
from .key_pair import algorithm_text
from .survey import Survey, survey

__all__ = ["Portrait", "portrait_lines", "portray"]

Value: TypeAlias = "str | int | Sequence[Value] | Mapping[str, Value] | None"
Portrait: TypeAlias = dict[str, Value]


def portray(path: Path) -> Portrait:
    """The file's kind and content.  Raises ConfigurationError for what is nothing of a keystore's.

    Files beside it are consulted: does the key fit a certificate, which authority signed the document?
    """
    octets = read_file(path)
    beside = survey(path.parent)
    if path in beside.certificates:
        return {"file": str(path), "kind": "certificate", **_certificate(beside.certificates[path], beside)}
    if path in beside.keys:
        return {"file": str(path), "kind": "private key", **_key(path, beside)}
    if kind := document_kind(octets):
        return {"file": str(path), "kind": str(kind), **_document(path, octets, beside)}
    raise ConfigurationError(f"{path} is no certificate, private key, governance or permissions document")


def portrait_lines(portrait: Portrait) -> list[str]:
    """For people: the file and its kind, then the rest indented."""
    rest = {name: value for name, value in portrait.items() if name not in ("file", "kind")}
    return [f"{portrait['file']}: {portrait['kind']}", *_lines(rest, "  ")]


def _lines(values: Mapping[str, Value], indent: str) -> list[str]:
    lines = []
    width = max((len(name) for name, value in values.items() if not isinstance(value, Mapping)), default=0)
    for name, value in values.items():
        label = f"{indent}{name.replace('_', ' ')}"
        if isinstance(value, Mapping):
            lines += [label, *_lines(value, indent + "  ")]
        elif isinstance(value, str | int | None):
            lines.append(f"{label.ljust(len(indent) + width)}  {_word(value)}")
        elif value and all(isinstance(one, Mapping) for one in value):
            for one in value:
                assert isinstance(one, Mapping)
                lines += [label, *_lines(one, indent + "  ")]
        else:
            words = ", ".join(_word(one) for one in value if isinstance(one, str | int | None))
            lines.append(f"{label.ljust(len(indent) + width)}  {words or '-'}")
    return lines


def _word(value: str | int | None) -> str:
    if isinstance(value, bool):
        return "yes" if value else "no"
    return "-" if value in (None, "") else str(value)


# --- certificates and keys -----------------------------------------------------------------------------------


def _certificate(certificate: x509.Certificate, beside: Survey) -> Portrait:
    validity = certificate_validity(certificate)
    digest = certificate.signature_hash_algorithm
    issuers = [path for path, one in beside.authorities().items() if is_issued_by(certificate, one)]
    return {
        "subject": rfc2253_text(certificate.subject),
        "issuer": rfc2253_text(certificate.issuer),
        "issued_by": issuers[0].name if issuers else None,
        "not_before": f"{validity.not_before:%Y-%m-%dT%H:%M:%SZ}",
        "not_after": f"{validity.not_after:%Y-%m-%dT%H:%M:%SZ}",
        "algorithm": algorithm_text(certificate.public_key()),
        "signed_with": digest.name.upper() if digest else None,
        "authority": is_authority(certificate),
        "serial_number": f"{certificate.serial_number:x}",
        "sha256": certificate.fingerprint(hashes.SHA256()).hex(),
        # Of every participant with this identity; the lower Guid of two starts the handshake.
        "guid_begins": subject_octets(certificate.subject.public_bytes()).hex(),
    }


def _key(path: Path, beside: Survey) -> Portrait:
    key = beside.keys[path]
    mode = f"{stat.S_IMODE(path.stat().st_mode):04o}"
    if key is None:
        return {"algorithm": None, "password": True, "mode": mode}
    fits = [one.name for one, other in beside.certificates.items() if other.public_key() == key.public_key()]
    return {"algorithm": algorithm_text(key.public_key()), "password": False, "fits": fits, "mode": mode}


# --- documents -----------------------------------------------------------------------------------------------


def _document(path: Path, octets: bytes, beside: Survey) -> Portrait:
    kind = document_kind(octets)
    assert kind is not None
    signer = _signer(path, octets, beside)
    signed = signer[1] if signer else unverified(octets)
    if signed is None:
        raise ConfigurationError(
            f"{path} hides its text in its signature, and the authority that made it is not beside it"
        )
    model = parse_document(kind, signed.xml, str(path), signed.first_line)
    signature = f"by {signer[0].name}" if signer else "not by an authority beside it" if is_signed(octets) else "none"
    if isinstance(model, Governance):
        return {"signature": signature, "domain_rules": [_domain_rule(rule) for rule in model.domain_rules]}
    return {"signature": signature, "grants": [_grant(grant) for grant in model.grants]}


def _signer(path: Path, octets: bytes, beside: Survey) -> tuple[Path, SignedXml] | None:
    for authority, certificate in beside.authorities().items():
        try:
            return authority, verify(octets, certificate, name=str(path))
        except UntrustedDocument:
            continue
    return None


def _domain_rule(rule: DomainRule) -> Portrait:
    return {
        "line": rule.line,
        "domains": str(rule.domains).removeprefix("domains "),
        "allow_unauthenticated_participants": rule.allow_unauthenticated_participants,
        "enable_join_access_control": rule.enable_join_access_control,
        "discovery_protection_kind": rule.discovery_protection_kind.value,
        "liveliness_protection_kind": rule.liveliness_protection_kind.value,
        "rtps_protection_kind": rule.rtps_protection_kind.value,
        "topic_rules": [_topic_rule(one) for one in rule.topic_rules],
    }


def _topic_rule(rule: TopicRule) -> Portrait:
    return {
        "line": rule.line,
        "topic_expression": rule.expression,
        "enable_discovery_protection": rule.enable_discovery_protection,
        "enable_liveliness_protection": rule.enable_liveliness_protection,
        "enable_read_access_control": rule.enable_read_access_control,
        "enable_write_access_control": rule.enable_write_access_control,
        "metadata_protection_kind": rule.metadata_protection_kind.value,
        "data_protection_kind": rule.data_protection_kind.value,
    }


def _grant(grant: Grant) -> Portrait:
    rules: list[Portrait] = [
        {
            "line": rule.line,
            "decision": "allow" if rule.is_allow else "deny",
            "domains": str(rule.domains).removeprefix("domains "),
            "criteria": [_criterion(one) for one in rule.criteria],
        }
        for rule in grant.rules
    ]
    return {
        "line": grant.line,
        "name": grant.name,
        "subject": str(grant.subject or grant.subject_expression),
        "not_before": instant_text(grant.validity.not_before),
        "not_after": instant_text(grant.validity.not_after),
        "rules": rules,
        "default": "allow" if grant.default_allow else "deny",
    }


def _criterion(criterion: Criterion) -> Portrait:
    return {
        "line": criterion.line,
        "action": criterion.kind.value,
        "topics": list(criterion.topics),
        "partitions": list(criterion.partitions),
        "data_tags": [f"{name}={value}" for name, value in criterion.data_tags],
    }
