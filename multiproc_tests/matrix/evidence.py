"""What a capture must show of two secured participants under a governance, and what it must not.

That samples arrive says nothing of how: two that protect nothing at all agree as well.  So the octets are looked at
without any key: which are in clear, which kinds of transformation are named, how many receivers have a MAC of their
own, and whether what is secret can be read.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from ddsi_security.keystore.documents import GovernanceDraft

from ..framework import Capture
from .wire import DATA, DATA_FRAG, SEC_BODY, CryptoHeader, Message, Submessage, read_message

__all__ = ["messages_of", "shortcomings"]

OUR_VENDOR_ID = bytes.fromhex("01dd")
PARTICIPANT_MESSAGE_WRITER = bytes.fromhex("000200c2")
SEDP_WRITERS = (bytes.fromhex("000003c2"), bytes.fromhex("000004c2"))


def messages_of(captured: Capture) -> list[Message]:
    """All RTPS messages of a capture, in order."""
    rows = captured.fields("udp", "udp.payload")
    read = (read_message(bytes.fromhex(row["udp.payload"][0])) for row in rows if row["udp.payload"])
    return [message for message in read if message is not None]


def shortcomings(
    messages: Sequence[Message], governance: GovernanceDraft, *, topic: str, secret: bytes, receivers: int = 1
) -> list[str]:
    """A line for each thing that the governance asks for and the capture does not show; empty if all is well.

    ``secret`` is part of every sample, ``receivers`` the number of readers that each sample has.
    """
    return [
        *_of_messages(messages, governance),
        *_of_submessages(messages, governance, receivers),
        *_of_payloads(messages, governance),
        *_of_builtin_topics(messages, governance, topic),
        *_of_secrets(messages, governance, topic, secret),
    ]


def _of_messages(messages: Sequence[Message], governance: GovernanceDraft) -> Iterator[str]:
    """RTPS protection: all that user endpoints say is in protected messages, and of the kind that is asked for."""
    protected = [message for message in messages if message.header is not None]
    if governance.rtps == "NONE":
        if protected:
            yield f"{len(protected)} messages are protected as a whole, and need not be"
        return
    if len({message.prefix for message in protected}) < 2:
        yield "not both participants protect their messages"
    yield from _wrong_kinds([message.header for message in protected], governance.rtps, "messages")
    bare = [message for message in messages if message.header is None and any(map(_is_users, message.submessages))]
    if bare:
        yield f"{len(bare)} messages of user endpoints are not protected"
    if governance.rtps.startswith("ENCRYPT"):
        open_ = [m for m in protected if any(sub.kind not in (SEC_BODY, 0x80) for sub in m.submessages)]
        if open_:  # Fast DDS ends all messages with a submessage 0x80 of its own, in clear
            yield f"{len(open_)} encrypted messages have something in clear"
    if governance.rtps.endswith("ORIGIN_AUTHENTICATION") and not all(message.receiver_macs for message in protected):
        yield "messages lack the MACs of their receivers"


def _of_submessages(messages: Sequence[Message], governance: GovernanceDraft, receivers: int) -> Iterator[str]:
    """Metadata protection: of what user endpoints say, nothing in clear is unprotected."""
    wrapped = [
        sub
        for message in messages
        for sub in message.submessages
        if sub.header is not None and not sub.header.is_volatile
    ]
    users = [sub for message in messages for sub in message.submessages if _is_users(sub)]
    kind = governance.metadata
    if kind == "NONE":
        if any(sub.header is not None for sub in users):
            yield "submessages of user endpoints are protected, and need not be"
        return
    bare = [sub for sub in users if sub.header is None]
    if bare:
        yield f"{len(bare)} submessages of user endpoints are not protected"
    if governance.rtps.startswith("ENCRYPT"):
        return  # what is inside cannot be seen
    if kind.startswith("SIGN"):
        if not users:
            yield "no submessage of a user endpoint is seen, though they are only signed"
        yield from _wrong_kinds([sub.header for sub in users], kind, "submessages")
    else:
        if users:
            yield f"{len(users)} submessages of user endpoints can be read"
        if not any(sub.header is not None and sub.header.is_encrypted for sub in wrapped):
            yield "no submessage is encrypted"
    if kind.endswith("ORIGIN_AUTHENTICATION"):
        most = max((sub.receiver_macs for sub in wrapped), default=0)
        if most < receivers:
            yield f"at most {most} receivers have a MAC of their own, not {receivers}"


def _of_payloads(messages: Sequence[Message], governance: GovernanceDraft) -> Iterator[str]:
    """Data protection, where the submessages around the payloads can be read."""
    if governance.rtps.startswith("ENCRYPT") or governance.metadata.startswith("ENCRYPT"):
        return
    payloads = [
        sub.payload
        for message in messages
        for sub in message.submessages
        if sub.kind in (DATA, DATA_FRAG) and _is_users(sub) and sub.payload
    ]
    if not payloads:
        yield "no payload of a user's writer is seen"
    if governance.data == "NONE":
        return  # nothing in an encapsulation could not be part of a payload
    headers = [CryptoHeader(int.from_bytes(payload[:4], "big"), payload[4:8]) for payload in payloads]
    yield from _wrong_kinds(headers, governance.data, "payloads")


def _of_builtin_topics(messages: Sequence[Message], governance: GovernanceDraft, topic: str) -> Iterator[str]:
    """Discovery and liveliness protection: neither endpoints nor assertions of liveliness are announced in clear."""
    bare = [
        (message, sub) for message in messages for sub in message.submessages if sub.kind == DATA and sub.header is None
    ]
    # Cyclone DDS says there that endpoints are gone, by their Guids alone: only what names the topic counts.
    named = [sub for _, sub in bare if sub.writer_id in SEDP_WRITERS and topic.encode() in sub.body]
    if governance.discovery != "NONE" and named:
        yield "endpoints are announced in clear"
    if governance.liveliness != "NONE":
        # Cyclone DDS asserts the liveliness of a participant in clear besides.
        ours = [sub for message, sub in bare if message.octets[6:8] == OUR_VENDOR_ID]
        if any(sub.writer_id == PARTICIPANT_MESSAGE_WRITER for sub in ours):
            yield "liveliness is asserted in clear"


def _of_secrets(messages: Sequence[Message], governance: GovernanceDraft, topic: str, secret: bytes) -> Iterator[str]:
    kinds = (governance.rtps, governance.metadata, governance.data)
    is_seen = any(secret in message.octets for message in messages)
    is_secret = any(kind.startswith("ENCRYPT") for kind in kinds)
    if is_seen and is_secret:
        yield "samples can be read"
    if not is_seen and not is_secret:
        yield "samples cannot be read, though nothing is encrypted: the search is no good"
    if governance.discovery.startswith("ENCRYPT") and any(topic.encode() in message.octets for message in messages):
        yield "the topic's name can be read"


def _wrong_kinds(headers: Sequence[CryptoHeader | None], kind: str, what: str) -> Iterator[str]:
    """``kind`` is a ProtectionKind: is every transformation of that sort?"""
    is_encrypting = kind.startswith("ENCRYPT")
    wrong = [
        header
        for header in headers
        if header is not None and not (header.is_encrypted if is_encrypting else header.is_signed)
    ]
    if wrong:
        yield f"{len(wrong)} {what} are transformed by kind {wrong[0].kind}, which is not {kind}"


def _is_users(submessage: Submessage) -> bool:
    """Does it name a writer that an application made?  The two highest bits of an entity id's kind are then 0."""
    writer_id = submessage.writer_id
    return writer_id is not None and writer_id[3] & 0xC0 == 0
