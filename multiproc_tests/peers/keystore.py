"""A keystore for all secured peers, made on the spot: one folder with what the peer programs' option ``-k`` looks for.

    identity_ca.pem  permissions_ca.pem  NAME.pem  NAME.key  NAME.permissions.p7s  GOVERNANCE.p7s

Every governance document is for all topics of all domains.  The names decide who begins the handshake: the GUID of a
secured participant is made of its certificate's subject (DDS-Security 1.1 §9.3.3), alice is below bob and bob below
dave, and the lower one begins.  The keystore is made with ``ddsi_security.keystore``, as users make theirs; so its form
is tried on the others in passing.
"""

from __future__ import annotations

import atexit
import functools
import shutil
import tempfile
import time
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from types import MappingProxyType
from typing import Final

from ddsi_security.keystore.authority import Authority
from ddsi_security.keystore.certificate import certificate_pem, certificate_validity
from ddsi_security.keystore.distinguished_name import parse_name
from ddsi_security.keystore.documents import GovernanceDraft, GrantDraft, Rights, permissions_xml
from ddsi_security.keystore.domain_ranges import CYCLONE_HIGHEST_DOMAIN, DomainRanges
from ddsi_security.keystore.identity import Identity
from ddsi_security.keystore.key_pair import Algorithm, private_key_pem
from ddsi_security.keystore.validity import Validity

__all__ = ["GOVERNANCES", "PeerKeystore", "shared_keystore"]

ALL_DOMAINS: Final = DomainRanges(((0, CYCLONE_HIGHEST_DOMAIN),))


def _governance(
    discovery: str,
    liveliness: str,
    rtps: str,
    metadata: str,
    data: str,
    *,
    is_open: bool = False,
    is_strict: bool = True,
) -> GovernanceDraft:
    """The five kinds by their initials, ``+`` for origin authentication."""
    kinds = {"-": "NONE", "S": "SIGN", "E": "ENCRYPT"}
    full = [
        kinds[kind[0]] + "_WITH_ORIGIN_AUTHENTICATION" * kind.endswith("+")
        for kind in (discovery, liveliness, rtps, metadata, data)
    ]
    return GovernanceDraft(
        domains=ALL_DOMAINS,
        allow_unauthenticated=is_open,
        join_access_control=is_strict,
        discovery=full[0],
        liveliness=full[1],
        rtps=full[2],
        metadata=full[3],
        data=full[4],
        read_access_control=is_strict,
        write_access_control=is_strict,
    )


GOVERNANCES: Final[Mapping[str, GovernanceDraft]] = MappingProxyType(
    {
        #                           discovery, liveliness, rtps, metadata, data
        "none": _governance("-", "-", "-", "-", "-"),
        "data-sign": _governance("-", "-", "-", "-", "S"),
        "data": _governance("-", "-", "-", "-", "E"),
        "metadata-sign": _governance("-", "-", "-", "S", "-"),
        "metadata": _governance("-", "-", "-", "E", "-"),
        "metadata-sign-data": _governance("-", "-", "-", "S", "E"),
        "metadata-data": _governance("-", "-", "-", "E", "E"),
        "rtps-sign": _governance("-", "-", "S", "-", "-"),
        "rtps": _governance("-", "-", "E", "-", "-"),
        "discovery-liveliness-sign": _governance("S", "S", "-", "-", "-"),
        "discovery": _governance("E", "-", "-", "-", "-"),
        "liveliness": _governance("-", "E", "-", "-", "-"),
        "discovery-liveliness": _governance("E", "E", "-", "-", "-"),
        "all-submessages": _governance("E", "E", "-", "E", "E"),
        "rtps-sign-else-encrypt": _governance("E", "E", "S", "E", "E"),
        "sign-all": _governance("S", "S", "S", "S", "S"),
        "encrypt-all": _governance("E", "E", "E", "E", "E"),
        "metadata-sign-origin": _governance("-", "-", "-", "S+", "-"),
        "metadata-origin": _governance("-", "-", "-", "E+", "-"),
        "rtps-sign-origin": _governance("-", "-", "S+", "-", "-"),
        "rtps-origin": _governance("-", "-", "E+", "-", "-"),
        "discovery-origin": _governance("E+", "-", "-", "-", "-"),
        "liveliness-origin": _governance("-", "E+", "-", "-", "-"),
        "discovery-liveliness-sign-origin": _governance("S+", "S+", "-", "-", "-"),
        "all-origin": _governance("E+", "E+", "E+", "E+", "E"),
        "unauthenticated": _governance("-", "-", "-", "E", "E", is_open=True),
        "no-access-control": _governance("E", "E", "S", "E", "E", is_strict=False),
    }
)  # fmt: skip
"""Every kind at every level alone, the usual sums of them, and everything at once."""


@dataclass(frozen=True, slots=True)
class PeerKeystore:
    """The folder, and the authorities, so that a test can make what is missing or wrong."""

    folder: Path
    identity_ca: Authority
    permissions_ca: Authority
    algorithm: Algorithm

    @classmethod
    def create(
        cls, folder: Path, algorithm: Algorithm = Algorithm.EC, authorities: Algorithm | None = None
    ) -> PeerKeystore:
        """Authorities, alice, bob and dave with all rights, and all governance documents.

        ``algorithm`` is that of the identities, and of the authorities too unless theirs is given.
        """
        identity_ca, permissions_ca = (
            Authority.create(parse_name(f"/O=Peers/CN={name}"), authorities or algorithm, _validity())
            for name in ("identity_ca", "permissions_ca")
        )
        keystore = cls(folder, identity_ca, permissions_ca, algorithm)
        folder.mkdir(parents=True, exist_ok=True)
        keystore.add("identity_ca.pem", certificate_pem(identity_ca.certificate))
        keystore.add("permissions_ca.pem", certificate_pem(permissions_ca.certificate))
        for name in ("alice", "bob", "dave"):
            keystore.add_identity(name)
        for name, draft in GOVERNANCES.items():
            keystore.add_governance(name, draft)
        return keystore

    def add(self, name: str, octets: bytes) -> None:
        (self.folder / name).write_bytes(octets)

    def add_identity(
        self,
        name: str,
        *,
        rights: Rights | None = None,
        authority: Authority | None = None,
        validity: Validity | None = None,
        granted: Validity | None = None,
    ) -> Identity:
        """A certificate, issued by the identity CA or by another, its key, and its permissions.

        The permissions are ``granted`` for as long as the certificate is valid, unless otherwise said.
        """
        subject = parse_name(f"/O=Peers/CN={name}")
        identity = Identity.create(authority or self.identity_ca, subject, self.algorithm, validity or _validity())
        self.add(f"{name}.pem", certificate_pem(identity.certificate))
        self.add(f"{name}.key", private_key_pem(identity.private_key))
        grant = GrantDraft(
            name=name,
            subject_name=identity.subject_name,
            validity=granted or certificate_validity(identity.certificate),
            rights=rights or Rights(domains=ALL_DOMAINS),
        )
        self.add(f"{name}.permissions.p7s", self.permissions_ca.sign_document(permissions_xml([grant])))
        return identity

    def add_governance(self, name: str, draft: GovernanceDraft) -> None:
        self.add(f"{name}.p7s", self.permissions_ca.sign_document(draft.xml()))


@functools.cache
def shared_keystore(algorithm: Algorithm = Algorithm.EC, authorities: Algorithm | None = None) -> PeerKeystore:
    """The one of this run, which nobody may change; made when it is first asked for, removed at the end."""
    folder = Path(tempfile.mkdtemp(prefix="ddsi-keystore-"))
    atexit.register(shutil.rmtree, folder, ignore_errors=True)
    return PeerKeystore.create(folder, algorithm, authorities)


def _validity() -> Validity:
    return Validity.of_days(time.time_ns(), 30)
