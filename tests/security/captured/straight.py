"""The transformations of DDS:Crypto:AES-GCM-GMAC, straight from the specification and with no code of ours.

DDS-Security 1.1 §9.5.  It decodes only, knows nothing of handles or rights, and trusts its input: what it finds in
captures of real vendors is what the plugins must find, so that no mistake of ours is its own judge.
"""

from __future__ import annotations

import hashlib
import hmac
import struct
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

from cryptography.hazmat.primitives.ciphers.aead import AESGCM

SEC_BODY, SEC_PREFIX, SEC_POSTFIX, SRTPS_PREFIX, SRTPS_POSTFIX = range(0x30, 0x35)
INFO_TS, INFO_SRC, INFO_DST = 0x09, 0x0C, 0x0E
ACKNACK, HEARTBEAT, GAP, NACK_FRAG, HEARTBEAT_FRAG, DATA, DATA_FRAG = 0x06, 0x07, 0x08, 0x12, 0x13, 0x15, 0x16
NONE, AES128_GMAC, AES128_GCM, AES256_GMAC, AES256_GCM = range(5)
KIND_NAMES = "NONE", "AES128_GMAC", "AES128_GCM", "AES256_GMAC", "AES256_GCM"
ENCRYPTING = AES128_GCM, AES256_GCM
CRYPTO_HEADER, TAG = 20, 16


class Tampered(Exception):
    """What arrived is not what was sent."""


# --- keys (§9.5.2.1.2, §9.5.3.3.3) --------------------------------------------------------------------------------


@dataclass(frozen=True)
class Material:
    """KeyMaterial_AES_GCM_GMAC."""

    kind: int
    salt: bytes
    key_id: bytes
    key: bytes
    receiver_key_id: bytes = bytes(4)
    receiver_key: bytes = b""


def read_material(octets: bytes) -> Material:
    """kind, salt, key id, key, receiver's key id, receiver's key; numbers and lengths big endian."""
    fields: list[bytes] = []
    position = 4
    for is_sequence in (True, False, True, False, True):
        length = 4
        if is_sequence:
            (length,) = struct.unpack_from(">I", octets, position)
            position += 4
        fields.append(octets[position : position + length])
        position += length
    assert position == len(octets)
    return Material(int.from_bytes(octets[:4], "big"), *fields)


def kx_material(challenge1: bytes, challenge2: bytes, shared_secret: bytes) -> Material:
    """The key of the volatile topic between two participants: the same for both ways (§9.5.2.1.2)."""
    salt = _hmac(hashlib.sha256(challenge1 + b"keyexchange salt" + challenge2).digest(), shared_secret)
    key = _hmac(hashlib.sha256(challenge2 + b"key exchange key" + challenge1).digest(), shared_secret)
    return Material(AES256_GCM, salt, bytes(4), key)


def session_key(material: Material, session_id: bytes) -> bytes:
    return _hmac(material.key, b"SessionKey" + material.salt + session_id)[: key_length(material.kind)]


def session_receiver_key(material: Material, session_id: bytes) -> bytes:
    octets = _hmac(material.receiver_key, b"SessionReceiverKey" + material.salt + session_id)
    return octets[: key_length(material.kind)]


def key_length(kind: int) -> int:
    return 16 if kind in (AES128_GMAC, AES128_GCM) else 32


def _hmac(key: bytes, data: bytes) -> bytes:
    return hmac.digest(key, data, "sha256")


# --- envelopes (§9.5.3.3.1, §9.5.3.3.4) ---------------------------------------------------------------------------


@dataclass(frozen=True)
class Header:
    """CryptoHeader."""

    kind: int
    key_id: bytes
    session_id: bytes
    iv: bytes

    @classmethod
    def read(cls, octets: bytes) -> Header:
        return cls(int.from_bytes(octets[:4], "big"), octets[4:8], octets[8:12], octets[8:20])


@dataclass(frozen=True)
class Footer:
    """CryptoFooter, with the receivers' key ids and codes."""

    common_mac: bytes
    receivers: tuple[tuple[bytes, bytes], ...]

    @classmethod
    def read(cls, octets: bytes) -> Footer:
        (count,) = struct.unpack_from(">I", octets, TAG)
        entries = [octets[20 + 20 * index : 40 + 20 * index] for index in range(count)]
        assert len(octets) == 20 + 20 * count
        return cls(octets[:TAG], tuple((entry[:4], entry[4:]) for entry in entries))


def open_block(header: Header, body: bytes, footer: Footer, material: Material) -> bytes:
    """The octets that the footer's common MAC covers, in plain."""
    assert header.kind == material.kind
    aead = AESGCM(session_key(material, header.session_id))
    try:
        if header.kind not in ENCRYPTING:
            aead.decrypt(header.iv, footer.common_mac, body)
            return body
        (length,) = struct.unpack_from(">I", body)
        assert len(body) in range(4 + length, 8 + length)
        return aead.decrypt(header.iv, body[4 : 4 + length] + footer.common_mac, None)
    except Exception as error:
        raise Tampered from error


def check_receiver_mac(header: Header, footer: Footer, mac: bytes, material: Material) -> None:
    """A receiver's MAC covers the common one, under the receiver's key and the same IV."""
    key = session_receiver_key(material, header.session_id)
    if AESGCM(key).encrypt(header.iv, b"", footer.common_mac) != mac:
        raise Tampered


def open_payload(encoded: bytes, material: Material) -> bytes:
    """A protected payload: header, body and footer without marks between them; no receivers' MACs (§9.5.3.3.4.1).

    ``encoded`` may be followed by up to three octets that pad its submessage.
    """
    header = Header.read(encoded)
    if header.kind in ENCRYPTING:
        (length,) = struct.unpack_from(">I", encoded, CRYPTO_HEADER)
        end = CRYPTO_HEADER + 4 + length
    else:
        end = len(encoded) - 20
    footer = Footer.read(encoded[end : end + 20])
    assert footer.receivers == ()
    return open_block(header, encoded[CRYPTO_HEADER:end], footer, material)


# --- messages (RTPS 2.5 §9.4) -------------------------------------------------------------------------------------


@dataclass(frozen=True)
class Submessage:
    """``octets`` with the header; ``body`` without."""

    kind: int
    flags: int
    octets: bytes

    @property
    def body(self) -> bytes:
        return self.octets[4:]

    @property
    def order(self) -> str:
        return "<" if self.flags & 1 else ">"


def submessages(octets: bytes) -> Iterator[Submessage]:
    position = 0
    while position < len(octets):
        kind, flags = octets[position : position + 2]
        (length,) = struct.unpack_from("<H" if flags & 1 else ">H", octets, position + 2)
        if length == 0 and kind not in (INFO_TS, 0x01):
            length = len(octets) - position - 4
        end = position + 4 + length
        assert end <= len(octets)
        yield Submessage(kind, flags, octets[position:end])
        position = end


@dataclass(frozen=True)
class Change:
    """What a DATA or DATA_FRAG holds."""

    reader_id: bytes
    writer_id: bytes
    sequence_number: int
    payload: bytes
    is_key: bool
    fragment_start: int | None
    """Where in the sample the run begins; None for a sample that came whole."""
    fragment_octets: int
    sample_octets: int


def read_change(submessage: Submessage) -> Change:
    body, order, is_fragment = submessage.body, submessage.order, submessage.kind == DATA_FRAG
    to_qos, reader_id, writer_id, high, low = struct.unpack_from(order + "2xH4s4siI", body)
    position, start, octets, sample = 4 + to_qos, None, 0, 0
    if is_fragment:
        first, count, size, sample = struct.unpack_from(order + "IHHI", body, 20)
        start = (first - 1) * size
        octets = min(start + count * size, sample) - start
    if submessage.flags & 2:
        pid = 0
        while pid != 1:
            pid, length = struct.unpack_from(order + "HH", body, position)
            position += 4 + (length if pid != 1 else 0)
    is_key = bool(submessage.flags & (4 if is_fragment else 8))
    return Change(reader_id, writer_id, high << 32 | low, body[position:], is_key, start, octets, sample)


# --- generic messages (§7.2.3, §7.4.3) ----------------------------------------------------------------------------


@dataclass(frozen=True)
class Message:
    """ParticipantGenericMessage, with the binary properties of each token; no token here has others that matter."""

    source_guid: bytes
    sequence_number: int
    related_guid: bytes
    related_sequence_number: int
    destination_participant: bytes
    destination_endpoint: bytes
    source_endpoint: bytes
    class_id: str
    tokens: tuple[tuple[str, dict[str, bytes]], ...]


def read_message(payload: bytes) -> Message:
    order = "<" if payload[1] == 1 else ">"
    body = payload[4:]
    source, number_of_it, related, related_number, participant, endpoint, source_endpoint = struct.unpack_from(
        order + "16sq16sq16s16s16s", body
    )
    position = 96

    def number() -> int:
        nonlocal position
        position += -position % 4 + 4
        value: int = struct.unpack_from(order + "I", body, position - 4)[0]
        return value

    def octets() -> bytes:
        nonlocal position
        length = number()
        position += length
        return body[position - length : position]

    def text() -> str:
        return octets().rstrip(b"\0").decode()

    class_id = text()
    tokens = []
    for _ in range(number()):
        token_class = text()
        for _ in range(number()):
            octets()
            octets()
        names = {text(): octets() for _ in range(number())}
        tokens.append((token_class, names))
    return Message(
        source,
        number_of_it,
        related,
        related_number,
        participant,
        endpoint,
        source_endpoint,
        class_id,
        tuple(tokens),
    )


def binary_properties(items: Sequence[tuple[str, bytes]]) -> bytes:
    """A BinaryPropertySeq in big-endian CDR, which hashes and signatures of a handshake cover (§9.3.2.5.1)."""
    octets = struct.pack(">I", len(items))
    for name, value in items:
        for field in (name.encode() + b"\0", value):
            octets += bytes(-len(octets) % 4) + struct.pack(">I", len(field)) + field
    return octets
