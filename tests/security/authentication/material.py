"""Builders: identities made on the spot, and two participants of ours that authenticate each other without a network.

RSA keys are borrowed from the captures, since making one takes longer than a test may; EC keys come from their names.
"""

from __future__ import annotations

import datetime
import random
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cache
from hashlib import sha256
from pathlib import Path
from typing import TypeVar, cast

from cryptography import x509
from cryptography.hazmat.primitives import hashes, serialization
from cryptography.hazmat.primitives.asymmetric import ec, rsa

from ddsi.spi import Refused
from ddsi.structure.guid import Guid
from ddsi.structure.vendor import VendorId
from ddsi_security.authentication import PkiDhAuthentication
from ddsi_security.authentication.algorithms import KeyAgreement, NameForm
from ddsi_security.authentication.handshake import RequestSent
from ddsi_security.authentication.handshake_tokens import Credentials, request_token
from ddsi_security.authentication.identities import LocalIdentityHandle, RemoteIdentityHandle
from ddsi_security.authentication.key_agreement import EphemeralKey, draw_private_key
from ddsi_security.plugins import HandshakeStep, Pending, ValidationResult
from ddsi_security.tokens import NIL, DataHolder

SECOND = 1_000_000_000
NOW_S = 1_800_000_000
DAY_S = 86_400
KEYSTORE_RSA = Path(__file__).parents[2] / "captures" / "keystore_rsa"

Key = rsa.RSAPrivateKey | ec.EllipticCurvePrivateKey
T = TypeVar("T")


# --- keys and certificates ------------------------------------------------------------------------------------


def ec_key(name: str, curve: ec.EllipticCurve | None = None) -> ec.EllipticCurvePrivateKey:
    scalar = int.from_bytes(sha256(name.encode()).digest(), "big") >> 1
    return ec.derive_private_key(scalar, curve or ec.SECP256R1())


@cache
def rsa_key(name: str) -> rsa.RSAPrivateKey:
    """``alice``, ``bob`` or ``carol``."""
    key = serialization.load_pem_private_key((KEYSTORE_RSA / f"{name}.key").read_bytes(), None)
    assert isinstance(key, rsa.RSAPrivateKey)
    return key


def name_of(text: str) -> x509.Name:
    return x509.Name.from_rfc4514_string(text)


def at(seconds: int) -> datetime.datetime:
    return datetime.datetime.fromtimestamp(seconds, datetime.UTC)


@dataclass(frozen=True)
class Issued:
    """A certificate with its key."""

    certificate: x509.Certificate
    key: Key

    @property
    def pem(self) -> str:
        return self.certificate.public_bytes(serialization.Encoding.PEM).decode()

    @property
    def key_pem(self) -> str:
        return key_pem(self.key).decode()


def key_pem(key: Key, passphrase: bytes | None = None) -> bytes:
    encryption = serialization.BestAvailableEncryption(passphrase) if passphrase else serialization.NoEncryption()
    return key.private_bytes(serialization.Encoding.PEM, serialization.PrivateFormat.PKCS8, encryption)


def issue(
    subject: str,
    key: Key,
    issuer: Issued | None = None,
    *,
    not_before: int = NOW_S - DAY_S,
    not_after: int = NOW_S + DAY_S,
    extensions: Sequence[tuple[x509.ExtensionType, bool]] = (),
    algorithm: hashes.HashAlgorithm | None = None,
    serial: int | None = None,
) -> Issued:
    """``issuer`` None: self-signed.  Seconds since 1970."""
    builder = (
        x509.CertificateBuilder()
        .subject_name(name_of(subject))
        .issuer_name(issuer.certificate.subject if issuer else name_of(subject))
        .public_key(key.public_key())
        .serial_number(serial or 1 + int.from_bytes(sha256(subject.encode()).digest()[:8], "big"))
        .not_valid_before(at(not_before))
        .not_valid_after(at(not_after))
    )
    for extension, critical in extensions:
        builder = builder.add_extension(extension, critical)
    return Issued(builder.sign(issuer.key if issuer else key, algorithm or hashes.SHA256()), key)  # type: ignore[arg-type]


@cache
def authority(kind: str = "EC", name: str = "CN=identity_ca,O=Tests") -> Issued:
    key: Key = rsa_key("carol") if kind == "RSA" else ec_key(name)
    return issue(
        name, key, extensions=[(x509.BasicConstraints(ca=True, path_length=None), True)], not_after=NOW_S + 9 * DAY_S
    )


@cache
def identity(name: str, kind: str = "EC", ca: Issued | None = None) -> Issued:
    """``alice`` is the lower of ``alice`` and ``bob``, by the hashes of their subjects."""
    keys: dict[str, Callable[[], Key]] = {
        "EC": lambda: ec_key(name),
        "EC-384": lambda: ec_key(name, ec.SECP384R1()),
        "RSA": lambda: rsa_key(name),
    }
    return issue(f"CN={name},O=Peers", keys[kind](), ca or authority())


def properties(owner: Issued, ca: Issued | None = None, **more: str) -> dict[str, str]:
    """Everything as ``data:`` URIs; ``more`` under ``dds.sec.auth.``."""
    return {
        "dds.sec.auth.identity_ca": f"data:,{(ca or authority()).pem}",
        "dds.sec.auth.identity_certificate": f"data:,{owner.pem}",
        "dds.sec.auth.private_key": f"data:,{owner.key_pem}",
        **{f"dds.sec.auth.{name}": value for name, value in more.items()},
    }


# --- participants ---------------------------------------------------------------------------------------------


def participant_data(guid: Guid) -> bytes:
    """The least that serves: PARTICIPANT_GUID, an unknown parameter, the sentinel; big endian."""
    return b"\x00\x50\x00\x10" + guid + b"\x80\x01\x00\x04abcd" + b"\x00\x01\x00\x00"


def candidate(number: int) -> Guid:
    return Guid(b"\x01\xdd" + number.to_bytes(10, "big") + b"\x00\x00\x01\xc1")


class Clock:
    """Wall time that a test sets."""

    def __init__(self, seconds: float = NOW_S) -> None:
        self.seconds = seconds

    def __call__(self) -> int:
        return round(self.seconds * SECOND)


class Side:
    """One participant with its plugin."""

    def __init__(self, owner: Issued, *, seed: int = 1, clock: Clock | None = None, **options: dict[str, str]) -> None:
        self.clock = clock or Clock()
        settings = options.get("settings") or properties(owner)
        self.plugin = PkiDhAuthentication({}, entropy=random.Random(seed).randbytes, wall_clock=self.clock)
        local = self.plugin.validate_local_identity(0, settings, candidate(seed))
        assert isinstance(local.handle, LocalIdentityHandle)
        self.identity = local.handle
        self.guid = local.adjusted_participant_guid
        self.data = participant_data(self.guid)
        document = DataHolder("DDS:Access:PermissionsCredential", (("dds.perm.cert", f"permissions of {seed}"),))
        self.plugin.set_permissions_credential_and_token(self.identity, document, NIL)

    def meet(self, other: Side, auth_request: DataHolder = NIL, vendor: VendorId | None = None) -> RemoteIdentityHandle:
        token = other.plugin.get_identity_token(other.identity)
        found = self.plugin.validate_remote_identity(
            auth_request, self.identity, token, other.guid, remote_vendor_id=vendor
        )
        assert not isinstance(found, Refused), found
        begins = found.result is ValidationResult.PENDING_HANDSHAKE_REQUEST
        assert begins == (self.guid < other.guid)
        assert isinstance(found.handle, RemoteIdentityHandle)
        return found.handle


def settle(result: T | Pending[T]) -> T:
    """Run the slow half inline."""
    return cast("T", result.job()) if isinstance(result, Pending) else result


def done(result: HandshakeStep | Refused | Pending[HandshakeStep | Refused]) -> HandshakeStep:
    step = settle(result)
    assert isinstance(step, HandshakeStep), step
    return step


def refusal(result: HandshakeStep | Refused | Pending[HandshakeStep | Refused]) -> str:
    step = settle(result)
    assert isinstance(step, Refused), step
    return step.reason


def message(step: HandshakeStep) -> DataHolder:
    assert step.message is not None
    return step.message


class Pair:
    """An initiator and a replier that have met; every message by name, so that a test can do with it what it likes."""

    def __init__(self, initiator: Side, replier: Side, **vendors: VendorId) -> None:
        self.initiator, self.replier = sorted((initiator, replier), key=lambda side: side.guid)
        self.replier_seen = self.initiator.meet(self.replier, vendor=vendors.get("replier_vendor"))
        self.initiator_seen = self.replier.meet(self.initiator)

    def request(self) -> HandshakeStep:
        plugin, side = self.initiator.plugin, self.initiator
        return done(plugin.begin_handshake_request(side.identity, self.replier_seen, side.data))

    def reply(self, request: DataHolder) -> HandshakeStep | Refused | Pending[HandshakeStep | Refused]:
        side = self.replier
        return side.plugin.begin_handshake_reply(request, self.initiator_seen, side.identity, side.data)

    def run(self) -> tuple[HandshakeStep, HandshakeStep]:
        """The whole handshake: the last steps of initiator and replier."""
        requested = self.request()
        replied = done(self.reply(message(requested)))
        finished = done(self.initiator.plugin.process_handshake(message(replied), requested.handle))
        ended = done(self.replier.plugin.process_handshake(message(finished), replied.handle))
        return finished, ended


def pair(initiator_kind: str = "EC", replier_kind: str = "EC", **vendors: VendorId) -> Pair:
    names = ("alice", "bob")
    sides = [
        Side(identity(name, kind), seed=seed)
        for seed, (name, kind) in enumerate(zip(names, (initiator_kind, replier_kind), strict=True), 1)
    ]
    return Pair(sides[0], sides[1], **vendors)


def foreign_request(both: Pair, agreement: KeyAgreement, *, der: bool = False, revised: bool = False) -> RequestSent:
    """A Request as others write it: with another key agreement than ours, or in the words of 1.2."""
    side = both.initiator
    form = NameForm(nul=False, revised=revised)
    credentials = Credentials(
        c_id=side.identity.pem,
        c_perm=side.identity.credential,
        c_pdata=side.data,
        c_dsign_algo=form.write(side.identity.certificate.algorithm),
        c_kagree_algo=(agreement.spellings[-1] if revised and agreement.spellings else agreement.name).encode(),
    )
    key = EphemeralKey(agreement, draw_private_key(agreement, random.Random(7).randbytes), der=der)
    challenge1 = both.replier_seen.our_challenge or bytes(32)
    token = request_token(credentials, dh1=key.public, challenge1=challenge1)
    return RequestSent(both.replier_seen, token, credentials.hash(), key)
