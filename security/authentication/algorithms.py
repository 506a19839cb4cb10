"""The algorithms of DDS:Auth:PKI-DH and all their names.  DDS-Security 1.1 §9.3.2.1, §9.3.2.5; 1.2 renames them.

Names only; what the algorithms do, ``signatures`` and ``key_agreement`` know.

A name is octets in the binary properties ``c.dsign_algo`` and ``c.kagree_algo``, and vendors do not agree whether a
NUL ends it.  OpenDDS takes a key agreement only with the NUL; Fast DDS as the initiator takes a Reply only without,
and so does RustDDS.  Hence :class:`NameForm`: the initiator chooses it by the vendor it talks to, and the replier
writes its names as the initiator wrote its own.  Either form is read; hashes cover what was written.
"""

from __future__ import annotations

from typing import Final

from ddsi.structure.dataclass import dataclass
from ddsi.structure.vendor import FAST_DDS, VendorId

__all__ = [
    "DH_MODP_2048_256",
    "ECDH_P256",
    "ECDH_P384",
    "EC_P256",
    "EC_P384",
    "RSA_2048",
    "KeyAgreement",
    "NameForm",
    "SignatureAlgorithm",
    "key_agreement_named",
    "signature_algorithm_named",
]

_RUST_DDS: VendorId = b"\x01\x12"


@dataclass(frozen=True, slots=True)
class SignatureAlgorithm:
    """How an identity signs.  ``token_name`` stands in identity tokens, ``name`` in handshakes, both as of 1.1."""

    token_name: str
    name: str
    revised_name: str
    key: str


# Longer RSA keys go by these names too, as they do in Fast DDS.
RSA_2048: Final = SignatureAlgorithm("RSA-2048", "RSASSA-PSS-SHA256", "RSASSA-PSS-MGF1SHA256+2048+SHA256", "RSA")
EC_P256: Final = SignatureAlgorithm("EC-prime256v1", "ECDSA-SHA256", "ECDSA+P256+SHA256", "EC P-256")
# Only 1.2 has it, so it has no other name.
EC_P384: Final = SignatureAlgorithm("ECDSA+P384+SHA384", "ECDSA+P384+SHA384", "ECDSA+P384+SHA384", "EC P-384")


@dataclass(frozen=True, slots=True)
class KeyAgreement:
    """How two participants agree on a secret.  ``public_octets``: the length of an uncompressed point; 0 for MODP."""

    name: str
    spellings: tuple[str, ...]
    public_octets: int


ECDH_P256: Final = KeyAgreement("ECDH+prime256v1-CEUM", ("ECDH+prime256v1", "ECDHE-CEUM+P256"), 65)
ECDH_P384: Final = KeyAgreement("ECDHE-CEUM+P384", (), 97)
DH_MODP_2048_256: Final = KeyAgreement("DH+MODP-2048-256", ("DHE+MODP-2048-256",), 0)

_SIGNATURE_ALGORITHMS: Final = {
    name: algorithm
    for algorithm in (RSA_2048, EC_P256, EC_P384)
    for name in (algorithm.token_name, algorithm.name, algorithm.revised_name)
}
_KEY_AGREEMENTS: Final = {
    name: agreement
    for agreement in (ECDH_P256, ECDH_P384, DH_MODP_2048_256)
    for name in (agreement.name, *agreement.spellings)
}


def signature_algorithm_named(name: bytes) -> SignatureAlgorithm | None:
    """By any of its names, with a NUL at the end or without; untrusted.  None for one that is not known."""
    return _SIGNATURE_ALGORITHMS.get(_text(name))


def key_agreement_named(name: bytes) -> KeyAgreement | None:
    """By any of its names, with a NUL at the end or without; untrusted.  None for one that is not known."""
    return _KEY_AGREEMENTS.get(_text(name))


def _text(name: bytes) -> str:
    # Latin-1 decodes anything, and no name that we know holds more than ASCII.
    return name.removesuffix(b"\0").decode("latin-1")


@dataclass(frozen=True, slots=True)
class NameForm:
    """How names are written: with a NUL at their end, and as 1.2 calls them."""

    nul: bool
    revised: bool = False

    @classmethod
    def for_vendor(cls, vendor_id: VendorId | None) -> NameForm:
        """What a peer of this vendor understands in a Request: the NUL for all but those that refuse it."""
        return cls(nul=vendor_id not in (FAST_DDS, _RUST_DDS))

    @classmethod
    def of(cls, name: bytes) -> NameForm:
        """The form that a peer used for the name of its signature algorithm, to be answered in kind."""
        algorithm = signature_algorithm_named(name)
        revised = algorithm is not None and _text(name) == algorithm.revised_name != algorithm.name
        return cls(nul=name.endswith(b"\0"), revised=revised)

    def write(self, algorithm: SignatureAlgorithm | KeyAgreement) -> bytes:
        """A key agreement always under its first name: the replier does not write it but repeats what it was sent."""
        match algorithm:
            case SignatureAlgorithm() if self.revised:
                name = algorithm.revised_name
            case _:
                name = algorithm.name
        return name.encode() + (b"\0" if self.nul else b"")
