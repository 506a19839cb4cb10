"""The tokens of the handshake, what hashes and signatures cover, and reading them.  DDS-Security 1.1 §9.3.2.5.

    Request   c.id c.perm c.pdata c.dsign_algo c.kagree_algo  hash_c1 dh1 challenge1
    Reply     the same five of the replier                    hash_c2 dh2 hash_c1 dh1 challenge1 challenge2 signature
    Final                                                     hash_c1 hash_c2 dh1 dh2 challenge1 challenge2 signature

All optional properties are sent, since Fast DDS as the initiator requires them, and none is required, since Cyclone DDS
and OpenDDS leave them out; the signature covers their values in either case.  What is present must be right.

Everything read from a token is untrusted; NotTrusted is all that is raised.
"""

from __future__ import annotations

import re
from dataclasses import field, fields
from enum import Enum
from hashlib import sha256
from typing import Final

from ddsi.structure.dataclass import dataclass

from ..tokens import AuthRequestMessageToken, DataHolder, HandshakeMessageToken, serialize_binary_properties
from .not_trusted import NotTrusted

__all__ = [
    "CHALLENGE_OCTETS",
    "CLASS_ID",
    "AgreedValues",
    "Credentials",
    "MessageKind",
    "auth_request_token",
    "challenge",
    "class_id_suffix",
    "final_token",
    "future_challenge",
    "message_kind",
    "reply_token",
    "request_token",
    "require_if_present",
    "required",
]

CLASS_ID: Final = "DDS:Auth:PKI-DH:1.0"
"""What is sent: Cyclone DDS and RustDDS refuse the class ids of 1.2.  Read is any minor version of 1."""

CHALLENGE_OCTETS: Final = 32
_CLASS_ID: Final = re.compile(r"DDS:Auth:PKI-DH:1\.[0-9]{1,9}((?:\+.*)?)", re.DOTALL)
_AUTH_REQUEST: Final = "+AuthReq"
_FUTURE_CHALLENGE: Final = "future_challenge"


class MessageKind(Enum):
    """The three messages, by the suffix of their class id."""

    REQUEST = "+Req"
    REPLY = "+Reply"
    FINAL = "+Final"


@dataclass(frozen=True, slots=True)
class Credentials:
    """The five ``c.`` values by which a side introduces itself, as they are on the wire."""

    c_id: bytes = field(repr=False)
    c_perm: bytes = field(repr=False)
    c_pdata: bytes = field(repr=False)
    c_dsign_algo: bytes
    c_kagree_algo: bytes

    @classmethod
    def of(cls, token: HandshakeMessageToken) -> Credentials:
        """Of a Request or Reply.  Without access control there is no ``c.perm``: then it is empty (§9.3.2.5.1)."""
        return cls(
            c_id=required(token, "c.id"),
            c_perm=token.binary_property("c.perm") or b"",
            c_pdata=required(token, "c.pdata"),
            c_dsign_algo=required(token, "c.dsign_algo"),
            c_kagree_algo=required(token, "c.kagree_algo"),
        )

    @property
    def properties(self) -> tuple[tuple[str, bytes], ...]:
        return (
            ("c.id", self.c_id),
            ("c.perm", self.c_perm),
            ("c.pdata", self.c_pdata),
            ("c.dsign_algo", self.c_dsign_algo),
            ("c.kagree_algo", self.c_kagree_algo),
        )

    def hash(self) -> bytes:
        """``hash_c1`` of the initiator's, ``hash_c2`` of the replier's."""
        return sha256(serialize_binary_properties(self.properties)).digest()


@dataclass(frozen=True, slots=True)
class AgreedValues:
    """The six values that both signatures cover: three of each side.  All of them were sent in clear."""

    hash_c1: bytes
    challenge1: bytes
    dh1: bytes
    hash_c2: bytes
    challenge2: bytes
    dh2: bytes

    def reply_content(self) -> bytes:
        """What the replier signs (§9.3.2.5.2)."""
        names = ("hash_c2", "challenge2", "dh2", "challenge1", "dh1", "hash_c1")
        return serialize_binary_properties(self.named(*names))

    def final_content(self) -> bytes:
        """What the initiator signs (§9.3.2.5.3)."""
        names = ("hash_c1", "challenge1", "dh1", "challenge2", "dh2", "hash_c2")
        return serialize_binary_properties(self.named(*names))

    def named(self, *names: str) -> tuple[tuple[str, bytes], ...]:
        return tuple((name, getattr(self, name)) for name in names)

    def require_in(self, token: HandshakeMessageToken) -> None:
        """Raises NotTrusted when the token holds another value: a message of another handshake, or altered."""
        for value in fields(self):
            require_if_present(token, value.name, getattr(self, value.name))


# --- writing --------------------------------------------------------------------------------------------------


def request_token(credentials: Credentials, *, dh1: bytes, challenge1: bytes) -> HandshakeMessageToken:
    more = (("hash_c1", credentials.hash()), ("dh1", dh1), ("challenge1", challenge1))
    return DataHolder(CLASS_ID + MessageKind.REQUEST.value, (), credentials.properties + more)


def reply_token(credentials: Credentials, values: AgreedValues, signature: bytes) -> HandshakeMessageToken:
    agreed = values.named("hash_c2", "dh2", "hash_c1", "dh1", "challenge1", "challenge2")
    properties = (*credentials.properties, *agreed, ("signature", signature))
    return DataHolder(CLASS_ID + MessageKind.REPLY.value, (), properties)


def final_token(values: AgreedValues, signature: bytes) -> HandshakeMessageToken:
    agreed = values.named("hash_c1", "hash_c2", "dh1", "dh2", "challenge1", "challenge2")
    return DataHolder(CLASS_ID + MessageKind.FINAL.value, (), (*agreed, ("signature", signature)))


def auth_request_token(challenge: bytes) -> AuthRequestMessageToken:
    return DataHolder(CLASS_ID + _AUTH_REQUEST, (), ((_FUTURE_CHALLENGE, challenge),))


# --- reading --------------------------------------------------------------------------------------------------


def class_id_suffix(class_id: str) -> str:
    """What stands behind the version, ``+Req`` for instance.  Untrusted; raises NotTrusted for another protocol."""
    match = _CLASS_ID.fullmatch(class_id)
    if match is None:
        raise NotTrusted(f"it speaks {class_id[:64]!r}, we speak {CLASS_ID}")
    return match[1]


def message_kind(token: HandshakeMessageToken) -> MessageKind:
    suffix = class_id_suffix(token.class_id)
    try:
        return MessageKind(suffix)
    except ValueError:
        raise NotTrusted(f"{suffix[:32]!r} is no message of a handshake") from None


def required(token: HandshakeMessageToken, name: str) -> bytes:
    value = token.binary_property(name)
    if value is None:
        raise NotTrusted(f"its {name} is missing")
    return value


def require_if_present(token: HandshakeMessageToken, name: str, expected: bytes) -> None:
    value = token.binary_property(name)
    if value is not None and value != expected:
        raise NotTrusted(f"its {name} is not that of this handshake")


def challenge(token: DataHolder, name: str, expected: bytes | None) -> bytes:
    """A challenge, which must be the one that the peer promised in its AuthRequest, if we have that."""
    octets = required(token, name)
    if len(octets) != CHALLENGE_OCTETS:
        raise NotTrusted(f"its {name} has {len(octets)} octets, not {CHALLENGE_OCTETS}")
    if expected is not None and octets != expected:
        raise NotTrusted(f"its {name} is not the one expected: another participant sent it, or the peer began anew")
    return octets


def future_challenge(token: AuthRequestMessageToken) -> bytes:
    if class_id_suffix(token.class_id) != _AUTH_REQUEST:
        raise NotTrusted("its authentication request is something else")
    return challenge(token, _FUTURE_CHALLENGE, None)
