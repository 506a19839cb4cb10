"""The identities that targets and corpus share: an authority, and alice and bob, in ``keystore/``.

They are kept and not made anew, as what is in the corpus was hashed and signed with them.  They protect nothing.
"""

from __future__ import annotations

from functools import cache
from pathlib import Path

from cryptography import x509
from cryptography.hazmat.primitives import serialization
from cryptography.hazmat.primitives.asymmetric import ec

from tests.security.authentication.material import Issued, ec_key, issue, key_pem, properties

__all__ = ["make_keystore", "owner", "settings_of"]

FOLDER = Path(__file__).with_name("keystore")


@cache
def owner(name: str) -> Issued:
    """``identity_ca``, ``permissions_ca``, ``alice`` or ``bob``."""
    certificate = x509.load_pem_x509_certificate((FOLDER / f"{name}.pem").read_bytes())
    key = serialization.load_pem_private_key((FOLDER / f"{name}.key").read_bytes(), None)
    assert isinstance(key, ec.EllipticCurvePrivateKey)
    return Issued(certificate, key)


def settings_of(name: str) -> dict[str, str]:
    """The properties of a participant."""
    return properties(owner(name), owner("identity_ca"))


def make_keystore() -> None:
    """Once for all: whatever is in the corpus fits no other."""
    FOLDER.mkdir(exist_ok=True)
    constraints = [(x509.BasicConstraints(ca=True, path_length=None), True)]
    identity_ca = issue("CN=identity_ca,O=Tests", ec_key("identity_ca of the corpus"), extensions=constraints)
    made = {
        "identity_ca": identity_ca,
        "permissions_ca": issue("CN=permissions_ca,O=Tests", ec_key("permissions_ca of the corpus")),
        "alice": issue("CN=alice,O=Peers", ec_key("alice of the corpus"), identity_ca),
        "bob": issue("CN=bob,O=Peers", ec_key("bob of the corpus"), identity_ca),
    }
    for name, issued in made.items():
        (FOLDER / f"{name}.pem").write_text(issued.pem)
        (FOLDER / f"{name}.key").write_bytes(key_pem(issued.key))
