"""The handshakes in the captures of real vendors, read with our parsers: the stateless topic is in clear."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

from ddsi.messages.data import Data
from ddsi.messages.data_frag import DataFrag
from ddsi.messages.raw_submessage import SubmessageKind, iterate_submessages
from ddsi.messages.submessages import decode_submessage
from ddsi.structure.guid import Guid
from ddsi.structure.vendor import VendorId
from ddsi_security.generic_message import AUTH_REQUEST, GenericMessage, read_generic_message
from ddsi_security.tokens import NIL, DataHolder
from tests.captures.capture import SECURED, load

STATELESS_WRITER = b"\x00\x02\x01\xc3"


@dataclass(frozen=True)
class CapturedHandshake:
    """``names`` are those of the keystore; ``facts`` what the JSON file tells of the handshake: secrets and all."""

    capture: str
    keystore: str
    facts: dict[str, Any]
    names: dict[Guid, str]
    vendors: dict[Guid, VendorId]
    initiator: Guid
    replier: Guid
    request: DataHolder
    reply: DataHolder
    final: DataHolder
    auth_requests: dict[Guid, DataHolder]
    """What each of the two sent; NIL if nothing."""

    def __str__(self) -> str:
        return f"{self.capture}-{self.names[self.initiator]}-{self.names[self.replier]}"


def captured_handshakes() -> Iterator[CapturedHandshake]:
    for capture in SECURED:
        yield from _handshakes_of(capture)


def _handshakes_of(name: str) -> Iterator[CapturedHandshake]:
    facts = load(name).facts
    names = {Guid(bytes.fromhex(peer["guid"])): peer["identity"] for peer in facts["peers"]}
    vendors = {Guid(bytes.fromhex(peer["guid"])): bytes.fromhex(peer["vendor_id"]) for peer in facts["guids"]}
    sent: dict[tuple[Guid, Guid, str], DataHolder] = {}
    for message in _stateless_messages(name):
        token = message.message_data[0]
        kind = "AuthReq" if message.message_class_id == AUTH_REQUEST else token.class_id.rpartition("+")[2]
        route = message.message_identity.source_guid.participant, message.destination_participant_guid, kind
        assert sent.setdefault(route, token) == token, "a repeated message is the same"
    for kx in facts["kx"]:
        initiator, replier = (Guid(bytes.fromhex(kx[f"{role}_guid"])) for role in ("initiator", "replier"))
        yield CapturedHandshake(
            capture=name,
            keystore=facts["keystore"],
            facts=kx,
            names=names,
            vendors=vendors,
            initiator=initiator,
            replier=replier,
            request=sent[initiator, replier, "Req"],
            reply=sent[replier, initiator, "Reply"],
            final=sent[initiator, replier, "Final"],
            auth_requests={
                initiator: sent.get((initiator, replier, "AuthReq"), NIL),
                replier: sent.get((replier, initiator, "AuthReq"), NIL),
            },
        )


def _stateless_messages(name: str) -> Iterator[GenericMessage]:
    """Those with a permissions document come in fragments, which are joined here."""
    joined: dict[tuple[bytes, int], bytearray] = {}
    missing: dict[tuple[bytes, int], set[int]] = {}
    for datagram in load(name).datagrams:
        for raw in iterate_submessages(datagram):
            if raw.kind not in (SubmessageKind.DATA, SubmessageKind.DATA_FRAG):
                continue
            change = decode_submessage(raw)
            if isinstance(change, Data) and change.writer_id == STATELESS_WRITER:
                yield read_generic_message(change.serialized_payload)
            elif isinstance(change, DataFrag) and change.writer_id == STATELESS_WRITER:
                which = datagram[8:20], change.writer_sn
                octets = joined.setdefault(which, bytearray(change.sample_size))
                count = -(-change.sample_size // change.fragment_size)
                wanted = missing.setdefault(which, set(range(1, count + 1)))
                start = (change.fragment_starting_num - 1) * change.fragment_size
                run = change.serialized_payload[: change.sample_size - start]
                octets[start : start + len(run)] = run
                number = change.fragment_starting_num
                wanted -= set(range(number, number + change.fragments_in_submessage))
                if not wanted:
                    yield read_generic_message(bytes(joined.pop(which)))
                    del missing[which]
