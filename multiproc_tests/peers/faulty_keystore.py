"""Keystores in which something is wrong: variants of one good keystore, each in a folder of its own within it.

What is wrong must look right to the participant that has it, where a refusal by its peer is to be seen: somebody with
another authority of his own finds nothing amiss in his own folder.
"""

from __future__ import annotations

import atexit
import functools
import shutil
import tempfile
from dataclasses import replace
from datetime import UTC, datetime, timedelta
from pathlib import Path
from typing import Final

from cryptography import x509
from cryptography.hazmat.primitives import hashes
from cryptography.hazmat.primitives.serialization import Encoding

from ddsi_security.keystore.authority import Authority
from ddsi_security.keystore.certificate import certificate_pem, parse_certificate
from ddsi_security.keystore.distinguished_name import parse_name
from ddsi_security.keystore.documents import Rights
from ddsi_security.keystore.domain_ranges import DomainRanges
from ddsi_security.keystore.key_pair import Algorithm
from ddsi_security.keystore.validity import Validity

from .keystore import ALL_DOMAINS, GOVERNANCES, PeerKeystore

__all__ = ["FORBIDDEN_TOPIC", "faulty_keystore"]

FORBIDDEN_TOPIC: Final = "Forbidden"
REVOCATION_LIST: Final = "identity_ca.crl.pem"


@functools.cache
def faulty_keystore() -> Path:
    """The one of this run; ``.`` in it is good, and holds identities that may do less than others."""
    folder = Path(tempfile.mkdtemp(prefix="ddsi-faulty-"))
    atexit.register(shutil.rmtree, folder, ignore_errors=True)
    good = PeerKeystore.create(folder, Algorithm.EC)
    good.add_governance("open", OPEN)
    good.add_governance("lax", LAX)
    good.add_identity("narrow", rights=Rights(domains=ALL_DOMAINS, publish=("Allowed*",), subscribe=("Allowed*",)))
    good.add_identity("elsewhere", rights=Rights(domains=DomainRanges(((77, 77),))))
    good.add_identity("expired", validity=_past())
    _make_stranger(good)
    _make_other_permissions(good)
    _make_revoked(good)
    _make_altered(good)
    return folder


OPEN: Final = replace(
    GOVERNANCES["none"], allow_unauthenticated=True, read_access_control=False, write_access_control=False
)
"""Lets anybody in, to topics that nothing protects."""

LAX: Final = replace(GOVERNANCES["encrypt-all"], read_access_control=False, write_access_control=False)


def _variant(good: PeerKeystore, name: str) -> PeerKeystore:
    """A copy of the good one, to be spoilt."""
    folder = good.folder / name
    shutil.copytree(good.folder, folder, ignore=lambda parent, names: [n for n in names if Path(parent, n).is_dir()])
    return replace(good, folder=folder)


def _make_stranger(good: PeerKeystore) -> None:
    """``stranger``: bob, issued by an identity CA that the others do not know."""
    other = Authority.create(parse_name("/O=Strangers/CN=identity_ca"), Algorithm.EC, _now())
    variant = replace(_variant(good, "stranger"), identity_ca=other)
    variant.add("identity_ca.pem", certificate_pem(other.certificate))
    for name in ("alice", "bob"):
        variant.add_identity(name)


def _make_other_permissions(good: PeerKeystore) -> None:
    """``other-permissions``: the same identities, with permissions that somebody else signed."""
    other = Authority.create(parse_name("/O=Strangers/CN=permissions_ca"), Algorithm.EC, _now())
    variant = replace(_variant(good, "other-permissions"), permissions_ca=other)
    variant.add("permissions_ca.pem", certificate_pem(other.certificate))
    for name in ("alice", "bob"):
        variant.add_identity(name)
    variant.add_governance("encrypt-all", GOVERNANCES["encrypt-all"])


def _make_revoked(good: PeerKeystore) -> None:
    """``revoking``: as the good one, with a list by which bob's certificate is taken back."""
    variant = _variant(good, "revoking")
    bob = parse_certificate((good.folder / "bob.pem").read_bytes(), "bob.pem")
    now = datetime.now(UTC)
    entry = x509.RevokedCertificateBuilder().serial_number(bob.serial_number).revocation_date(now - timedelta(hours=1))
    crl = (
        x509.CertificateRevocationListBuilder()
        .issuer_name(good.identity_ca.certificate.subject)
        .last_update(now - timedelta(hours=1))
        .next_update(now + timedelta(days=1))
        .add_revoked_certificate(entry.build())
        .sign(good.identity_ca.private_key, hashes.SHA256())
    )
    variant.add(REVOCATION_LIST, crl.public_bytes(Encoding.PEM))


def _make_altered(good: PeerKeystore) -> None:
    """``altered``: permissions of which somebody changed a word after they were signed."""
    variant = _variant(good, "altered")
    for name in ("alice", "bob"):
        signed = (good.folder / f"{name}.permissions.p7s").read_bytes()
        altered = signed.replace(b"<default>DENY", b"<default>ALLOW", 1)
        assert altered != signed
        variant.add(f"{name}.permissions.p7s", altered)


def _now() -> Validity:
    now = datetime.now(UTC).replace(microsecond=0)
    return Validity(now - timedelta(days=1), now + timedelta(days=30))


def _past() -> Validity:
    now = datetime.now(UTC).replace(microsecond=0)
    return Validity(now - timedelta(hours=2), now - timedelta(hours=1))
