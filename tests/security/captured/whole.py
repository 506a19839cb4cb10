"""A secured capture, decoded whole with the straight decoder: every key from the shared secrets, every protected octet.

Counts as the captures' own JSON files do; see the README beside them.
"""

from __future__ import annotations

import struct
import zlib
from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass, field
from functools import cache

from tests.captures.capture import Capture, load
from tests.security.captured.handshakes import handshakes
from tests.security.captured.straight import (
    ACKNACK,
    CRYPTO_HEADER,
    DATA,
    DATA_FRAG,
    INFO_DST,
    INFO_SRC,
    INFO_TS,
    NACK_FRAG,
    SEC_BODY,
    SEC_POSTFIX,
    SEC_PREFIX,
    SRTPS_POSTFIX,
    SRTPS_PREFIX,
    Change,
    Footer,
    Header,
    Material,
    Message,
    Submessage,
    check_receiver_mac,
    kx_material,
    open_block,
    open_payload,
    read_change,
    read_material,
    read_message,
    submessages,
)

STATELESS_WRITER = bytes.fromhex("000201c3")
VOLATILE_WRITER = bytes.fromhex("ff0202c3")
PLAIN_BUILTIN_KEYS = {bytes.fromhex(key) for key in ("000003", "000004", "000200", "000300", "000301")}
"""Of SEDP, ParticipantMessage and TypeLookup: what Cyclone never protects as messages."""
KEYMAT = "dds.cryp.keymat"
"""The binary property of a crypto token (§9.5.2.1.1)."""
PLURAL = {
    "dds.sec.participant_crypto_tokens": "participant",
    "dds.sec.datawriter_crypto_tokens": "datawriter",
    "dds.sec.datareader_crypto_tokens": "datareader",
}


@dataclass(frozen=True, order=True)
class Token:
    """A crypto token, by what it is for."""

    kind: str
    owner_guid: str
    receiver_guid: str
    token_index: int
    keymat: str


@dataclass
class Joined:
    """A sample that comes in fragments, in any order and with repeats."""

    octets: bytearray

    def __post_init__(self) -> None:
        self.holes = bytearray(b"\1" * len(self.octets))

    def add(self, start: int, run: bytes) -> bool:
        """Is it whole now?"""
        self.octets[start : start + len(run)] = run
        self.holes[start : start + len(run)] = bytes(len(run))
        return 1 not in self.holes


@dataclass
class Whole:
    """What is in a capture once nothing is protected any more."""

    capture: Capture
    counts: Counter[str] = field(default_factory=Counter)
    tokens: list[Token] = field(default_factory=list)
    messages: list[Message] = field(default_factory=list)
    """Of the stateless topic, repeats too."""
    announcements: list[tuple[bytes, bytes, bytes]] = field(default_factory=list)
    """Of the other builtin writers: the writer's id, who sent it, and the payload."""
    changes: dict[tuple[bytes, int], bytes] = field(default_factory=dict)
    """Payloads of the user's writers by writer Guid and sequence number, fragments joined; with repeats, the last."""
    key_only: set[tuple[bytes, int]] = field(default_factory=set)
    fragments: dict[tuple[bytes, int], Joined] = field(default_factory=dict)
    materials: dict[tuple[bytes, bytes], Material] = field(default_factory=dict)
    """By the sender's prefix and key id."""
    receivers: dict[tuple[bytes, bytes], Material] = field(default_factory=dict)
    """By the sender's prefix and the receiver's key id."""

    @property
    def all_counts(self) -> dict[str, int]:
        """What the JSON calls ``counts``, as far as it was found; but for datagrams, and for what was not decoded."""
        known = {keymat["hex"] for keymat in self.capture.facts["keymat"]}
        counts = self.counts + Counter(
            tokens_equal=sum(token.keymat in known for token in self.tokens),
            handshakes=len(handshakes(self.messages)),
            key_only_changes=len(self.key_only),
            samples_decoded=len(self.changes),
        )
        return dict(counts)

    # --- one datagram ---------------------------------------------------------------------------------------

    def hear(self, datagram: bytes) -> None:
        source, items = datagram[8:20], list(submessages(datagram[20:]))
        if items[0].kind != SRTPS_PREFIX:
            self.walk(source, items, in_message=False)
            return
        end = next(index for index, item in enumerate(items) if item.kind == SRTPS_POSTFIX)
        self.counts["rtps_messages"] += 1
        self.counts["rtps_messages_with_more_behind"] += end + 1 < len(items)
        assert all(item.kind == 0x80 for item in items[end + 1 :])
        plain = self.open_envelope(source, items[: end + 1])
        info_src, *inner = submessages(plain)
        assert (info_src.kind, info_src.body[4:]) == (INFO_SRC, datagram[4:20]), "it authenticates the header"
        self.walk(source, inner, in_message=True)

    def walk(self, source: bytes, items: list[Submessage], *, in_message: bool) -> None:
        destination = bytes(12)
        remaining = iter(items)
        for item in remaining:
            if item.kind == INFO_DST:
                destination = item.body
            elif item.kind == SEC_PREFIX:
                self.triple(source, destination, [item, next(remaining), next(remaining)])
            else:
                assert item.kind not in (SEC_BODY, SEC_POSTFIX, SRTPS_PREFIX, SRTPS_POSTFIX)
                self.clear(source, item, in_message=in_message)

    def triple(self, source: bytes, destination: bytes, items: list[Submessage]) -> None:
        key_id = Header.read(items[0].body).key_id
        pair = b"".join(sorted((source, destination))) if key_id == bytes(4) else source
        plain = self.open_envelope(pair, items)
        (item,) = submessages(plain)
        if key_id == bytes(4):
            self.counts["volatile_submessages"] += 1
            self.counts["info_ts_submessages_volatile"] += item.kind == INFO_TS
        elif item.kind == INFO_TS:
            self.counts["info_ts_submessages"] += 1
        elif item.kind in (ACKNACK, NACK_FRAG):
            self.counts["datareader_submessages"] += 1
        else:
            self.counts["datawriter_submessages"] += 1
        self.interpret(source, item)

    def open_envelope(self, owner: bytes, items: list[Submessage]) -> bytes:
        """Prefix, body or what is signed, postfix: the plain octets, every MAC checked."""
        header, footer = Header.read(items[0].body), Footer.read(items[-1].body)
        inside = items[1:-1]
        encrypted = inside[0].kind == SEC_BODY
        body = inside[0].body if encrypted else b"".join(item.octets for item in inside)
        plain = open_block(header, body, footer, self.materials[owner, header.key_id])
        for key_id, mac in footer.receivers:
            check_receiver_mac(header, footer, mac, self.receivers[owner, key_id])
        self.counts["receiver_macs"] += len(footer.receivers)
        self.counts["footers_with_2_receiver_macs"] += len(footer.receivers) == 2
        return plain

    def clear(self, source: bytes, item: Submessage, *, in_message: bool) -> None:
        if item.kind in (INFO_TS, 0x80):
            return
        position = 4 if item.kind in (DATA, DATA_FRAG) else 0
        writer_key = item.body[position + 4 : position + 7]
        if not in_message and writer_key in PLAIN_BUILTIN_KEYS and self.capture.facts["governance"]["rtps"] != "NONE":
            self.counts["plain_builtin_submessages_outside_rtps_protection"] += 1
        self.interpret(source, item)

    # --- changes --------------------------------------------------------------------------------------------

    def interpret(self, source: bytes, item: Submessage) -> None:
        if item.kind not in (DATA, DATA_FRAG):
            return
        change = read_change(item)
        number = source + change.writer_id, change.sequence_number
        is_user = change.writer_id[3] < 0xC0
        if change.writer_id not in (STATELESS_WRITER, VOLATILE_WRITER) and not is_user:
            if change.payload and not change.is_key:
                self.announcements.append((change.writer_id, source, change.payload))
            return
        payload = self.open_payload(source, change) if is_user else change.payload
        if change.fragment_start is not None:
            joined = self.fragments.setdefault(number, Joined(bytearray(change.sample_octets)))
            if not joined.add(change.fragment_start, payload[: change.fragment_octets]):
                return
            payload = bytes(self.fragments.pop(number).octets)
        if change.writer_id == STATELESS_WRITER:
            self.messages.append(read_message(payload))
        elif change.writer_id == VOLATILE_WRITER:
            self.key_exchange(source, read_message(payload))
        elif change.is_key or not payload:
            self.key_only.add(number)
        else:
            self.changes[number] = payload

    def open_payload(self, source: bytes, change: Change) -> bytes:
        if not change.payload or self.capture.facts["governance"]["data"] == "NONE":
            return change.payload
        self.counts["payloads"] += 1
        self.counts["fragment_payloads"] += change.fragment_start is not None
        return open_payload(change.payload, self.materials[source, change.payload[4:8]])

    def key_exchange(self, source: bytes, message: Message) -> None:
        """Keys are learned where they pass.  The source is known by its prefix: Fast DDS names another writer."""
        assert message.source_guid[:12] == source
        kind = PLURAL[message.class_id]
        owner, receiver = message.source_endpoint, message.destination_endpoint
        if kind == "participant":
            owner, receiver = source + bytes.fromhex("000001c1"), message.destination_participant
        for index, (token_class, properties) in enumerate(message.tokens):
            assert token_class == "DDS:Crypto:AES_GCM_GMAC"
            keymat = properties[KEYMAT]
            self.tokens.append(Token(kind, owner.hex(), receiver.hex(), index, keymat.hex()))
            material = read_material(keymat)
            self.materials[source, material.key_id] = material
            self.receivers[source, material.receiver_key_id] = material

    @property
    def samples(self) -> list[str]:
        """As the JSON files write them, in the order of the writer."""
        return [sample_line(self.capture.facts["type"], self.changes[number]) for number in sorted(self.changes)]


def decode(capture: Capture) -> Whole:
    """Twice: first the key exchange alone, as what is protected may overtake the tokens that open it."""
    kx = {pair: kx_material(*secrets) for pair, secrets in shared_secrets(capture)}
    learned = Whole(capture, materials={(pair, bytes(4)): material for pair, material in kx.items()})
    for datagram in capture.datagrams:
        if is_volatile(datagram):
            learned.hear(datagram)
    whole = Whole(capture, materials=learned.materials, receivers=learned.receivers)
    for datagram in capture.datagrams:
        whole.hear(datagram)
    return whole


@cache
def decoded(name: str) -> Whole:
    return decode(load(name))


def shared_secrets(capture: Capture) -> Iterator[tuple[bytes, tuple[bytes, bytes, bytes]]]:
    """Challenges and secret by the two prefixes, the lower first."""
    for kx in capture.facts["kx"]:
        pair = b"".join(sorted(bytes.fromhex(kx[side])[:12] for side in ("initiator_guid", "replier_guid")))
        yield (
            pair,
            (
                bytes.fromhex(kx["challenge1"]),
                bytes.fromhex(kx["challenge2"]),
                bytes.fromhex(kx["shared_secret"]),
            ),
        )


def is_volatile(datagram: bytes) -> bool:
    """Does it hold submessages under the agreed key?  They have the key id 0."""
    return any(
        item.kind == SEC_PREFIX and item.body[:CRYPTO_HEADER][4:8] == bytes(4) for item in submessages(datagram[20:])
    )


def sample_line(type_name: str, payload: bytes) -> str:
    order = "<" if payload[1] & 1 else ">"
    length: int = struct.unpack_from(order + "I", payload, 4)[0]
    if type_name == "Blob":
        (octets,) = struct.unpack_from(order + "I", payload, 8)
        return f"{length} {octets} {zlib.crc32(payload[12 : 12 + octets]):08x}"
    color = payload[8 : 8 + length - 1].decode()
    position = 8 + length + -length % 4
    return " ".join([color, *(str(value) for value in struct.unpack_from(order + "iii", payload, position))])
