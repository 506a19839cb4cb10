"""An identity: the certificate and private key by which a participant proves who it is.  DDS-Security 1.1 §9.3.1.2."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Self

from cryptography import x509

from .authority import Authority
from .distinguished_name import rfc2253_text
from .key_pair import Algorithm, PrivateKey, generate_key
from .validity import Validity

__all__ = ["Identity"]


@dataclass(frozen=True, slots=True)
class Identity:
    """What ``cert.pem`` and ``key.pem`` of an enclave hold."""

    certificate: x509.Certificate
    private_key: PrivateKey = field(repr=False)

    @classmethod
    def create(cls, authority: Authority, subject: x509.Name, algorithm: Algorithm, validity: Validity) -> Self:
        """A new key, and the certificate that the identity CA issues for it."""
        key = generate_key(algorithm)
        return cls(authority.issue(subject, key.public_key(), validity), key)

    @property
    def subject_name(self) -> str:
        """As ``<subject_name>`` of its grant has it."""
        return rfc2253_text(self.certificate.subject)

    def __repr__(self) -> str:
        return f"<Identity {self.subject_name}>"
