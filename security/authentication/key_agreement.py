"""Diffie-Hellman: an ephemeral key for each handshake, and the secret that both derive.  DDS-Security 1.1 §9.3.2.3.

Shared secret = SHA-256 of Z; Z is the x-coordinate of the shared point with its leading zeros, or the shared number of
MODP without them.  Public keys are hostile: a point off its curve, or a number that generates a small subgroup, would
let a peer learn our private key piece by piece, were it not drawn anew each time; both are refused all the same.

The private key comes from the entropy that is given, by rejection, so that a seed replays.  MODP is computed with
``pow``, which does not hide how long it takes: tolerable for a key that is used once.
"""

from __future__ import annotations

from collections.abc import Callable
from hashlib import sha256
from typing import Final

from cryptography.hazmat.primitives.asymmetric import ec

from .algorithms import DH_MODP_2048_256, ECDH_P256, ECDH_P384, KeyAgreement
from .der import integer_octets, read_integer
from .not_trusted import NotTrusted

__all__ = ["EphemeralKey", "draw_private_key", "is_der"]

# RFC 5114 §2.3: the group of 2048 bits whose generator G has an order Q of 256 bits.
_P: Final = int(
    "87A8E61DB4B6663CFFBBD19C651959998CEEF608660DD0F25D2CEED4435E3B00E00DF8F1D61957D4FAF7DF4561B2AA3016C3D91134096FAA"
    "3BF4296D830E9A7C209E0C6497517ABD5A8A9D306BCF67ED91F9E6725B4758C022E0B1EF4275BF7B6C5BFC11D45F9088B941F54EB1E59BB8"
    "BC39A0BF12307F5C4FDB70C581B23F76B63ACAE1CAA6B7902D52526735488A0EF13C6D9A51BFA4AB3AD8347796524D8EF6A167B5A41825D9"
    "67E144E5140564251CCACB83E6B486F6B3CA3F7971506026C0B857F689962856DED4010ABD0BE621C3A3960A54E710C375F26375D7014103"
    "A4B54330C198AF126116D2276E11715F693877FAD7EF09CADB094AE91E1A1597",
    16,
)
_G: Final = int(
    "3FB32C9B73134D0B2E77506660EDBD484CA7B18F21EF205407F4793A1A0BA12510DBC15077BE463FFF4FED4AAC0BB555BE3A6C1B0C6B47B1"
    "BC3773BF7E8C6F62901228F8C28CBB18A55AE31341000A650196F931C77A57F2DDF463E5E9EC144B777DE62AAAB8A8628AC376D282D6ED38"
    "64E67982428EBC831D14348F6F2F9193B5045AF2767164E1DFC967C1FB3F2E55A4BD1BFFE83B9C80D052B985D182EA0ADB2A3B7313D3FE14"
    "C8484B1E052588B9B7D2BBD2DF016199ECD06E1557CD0915B3353BBB64E0EC377FD028370DF92B52C7891428CDC67EB6184B523D1DB246C3"
    "2F63078490F00EF8D647D148D47954515E2327CFEF98C582664B4C0F6CC41659",
    16,
)
_Q: Final = 0x8CF83642A709A097B447997640129DA299B1A47D1EB3750BA308B0FE64F5FBD3
_MODP_OCTETS: Final = 256

_ORDERS: Final = {
    ECDH_P256: 0xFFFFFFFF00000000FFFFFFFFFFFFFFFFBCE6FAADA7179E84F3B9CAC2FC632551,
    ECDH_P384: int(
        "FFFFFFFFFFFFFFFFFFFFFFFFFFFFFFFFFFFFFFFFFFFFFFFFC7634D81F4372DDF581A0DB248B0A77AECEC196ACCC52973", 16
    ),
    DH_MODP_2048_256: _Q,
}
_CURVES: Final = {ECDH_P256: ec.SECP256R1, ECDH_P384: ec.SECP384R1}

_MAX_DRAWS: Final = 256
"""MODP rejects nearly every second draw.  Entropy that fails this often is none."""


def draw_private_key(agreement: KeyAgreement, entropy: Callable[[int], bytes]) -> int:
    """A private key, from 1 up to the order of the group (exclusive), each as likely as any other."""
    order = _ORDERS[agreement]
    for _ in range(_MAX_DRAWS):
        drawn = int.from_bytes(entropy((order.bit_length() + 7) // 8), "big")
        if 1 <= drawn < order:
            return drawn
    raise RuntimeError("the entropy is none: it does not give a number that is in range")


def is_der(public: bytes) -> bool:
    """Is this MODP public key written as Cyclone DDS does, as a DER INTEGER, rather than raw?

    A raw key of this group has 256 octets, but for the few that are shorter by leading zeros.
    """
    return len(public) != _MODP_OCTETS and read_integer(public) is not None


class EphemeralKey:
    """Our half of one key agreement.  ``public`` is what the peer gets as ``dh1`` or ``dh2``.

    ``der``: a MODP public key is written as a DER INTEGER (Cyclone DDS) and not raw (all others).
    """

    __slots__ = ("_private_key", "agreement", "public")

    def __init__(self, agreement: KeyAgreement, private_key: int, *, der: bool = False) -> None:
        self.agreement: Final = agreement
        self._private_key = private_key
        self.public: Final = (
            _modp_public(private_key, der=der)
            if agreement is DH_MODP_2048_256
            else _encoded(_curve_key(agreement, private_key).public_key())
        )

    def shared_secret(self, peer_public: bytes) -> bytes:
        """32 octets.  ``peer_public`` is untrusted; raises NotTrusted when it is no public key of this agreement."""
        if not self._private_key:
            raise NotTrusted("the handshake was returned meanwhile")
        if self.agreement is DH_MODP_2048_256:
            number = pow(_modp_number(peer_public), self._private_key, _P)
            return sha256(_shortest(number)).digest()
        shared = _curve_key(self.agreement, self._private_key).exchange(ec.ECDH(), _point(self.agreement, peer_public))
        return sha256(shared).digest()

    def wipe(self) -> None:
        """Forget the private key, as far as Python lets us: the number itself lies where it lies until it is reused."""
        self._private_key = 0

    def __repr__(self) -> str:
        return f"<EphemeralKey {self.agreement.name}>"


# --- curves ---------------------------------------------------------------------------------------------------


def _curve_key(agreement: KeyAgreement, private_key: int) -> ec.EllipticCurvePrivateKey:
    return ec.derive_private_key(private_key, _CURVES[agreement]())


def _encoded(key: ec.EllipticCurvePublicKey) -> bytes:
    numbers = key.public_numbers()
    octets = (key.curve.key_size + 7) // 8
    return b"\x04" + numbers.x.to_bytes(octets, "big") + numbers.y.to_bytes(octets, "big")


def _point(agreement: KeyAgreement, public: bytes) -> ec.EllipticCurvePublicKey:
    if len(public) != agreement.public_octets:
        raise NotTrusted(f"its public key is no uncompressed point of {agreement.public_octets} octets")
    try:
        return ec.EllipticCurvePublicKey.from_encoded_point(_CURVES[agreement](), public)
    except ValueError as error:
        raise NotTrusted("its public key is no point of the curve") from error


# --- numbers --------------------------------------------------------------------------------------------------


def _modp_public(private_key: int, *, der: bool) -> bytes:
    number = pow(_G, private_key, _P)
    return integer_octets(number) if der else _shortest(number)


def _modp_number(public: bytes) -> int:
    number = read_integer(public) if is_der(public) else None
    if number is None:
        number = int.from_bytes(public[: _MODP_OCTETS + 1], "big") if len(public) <= _MODP_OCTETS + 1 else 0
    if not 2 <= number <= _P - 2 or pow(number, _Q, _P) != 1:
        raise NotTrusted("its public key is no element of the group MODP-2048-256")
    return number


def _shortest(number: int) -> bytes:
    """Big-endian without leading zeros, as OpenSSL writes both the public keys and Z."""
    return number.to_bytes((number.bit_length() + 7) // 8, "big")
