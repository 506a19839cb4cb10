"""A whole message in words: its submessages grouped by whom they are for, with what only serves others folded away.

RTPS 2.5 §8.3.4 (the message receiver), DDS-Security 1.1 §7.3.6 (envelopes).  INFO_DST becomes the group, INFO_TS goes
unsaid, an envelope of security becomes one phrase with whatever in it can be read.
"""

from __future__ import annotations

from dataclasses import dataclass, field

from ..messages.interpreter import InfoDestination, InfoTimestamp
from ..messages.opaque import Opaque
from ..messages.raw_submessage import SubmessageKind
from ..messages.receiver import MessageReceiver
from ..messages.submessages import Submessage
from ..serialization.cursor import Octets
from ..structure.errors import MalformedMessage
from ..structure.guid import GuidPrefix
from .describe import Describer
from .wording import count_text, printable

__all__ = ["MessageParts", "Part", "message_parts"]

# A datagram of nothing but PADs would hold sixteen thousand.
_MAX_TEXTS = 24
_MAX_ENVELOPES = 2  # one around the message, one around a submessage

_TRANSFORMATIONS = ("in clear", "AES128_GMAC", "AES128_GCM", "AES256_GMAC", "AES256_GCM")
_PREFIXES = {SubmessageKind.SEC_PREFIX: "protected", SubmessageKind.SRTPS_PREFIX: "protected message"}
_POSTFIXES = frozenset({SubmessageKind.SEC_POSTFIX, SubmessageKind.SRTPS_POSTFIX})


@dataclass(slots=True)
class Part:
    """Consecutive submessages for one participant; UNKNOWN: for everybody."""

    destination: GuidPrefix
    texts: list[str] = field(default_factory=list)


@dataclass(slots=True)
class MessageParts:
    """``source``: the prefix in the header, UNKNOWN if there is none.  At least one part."""

    source: GuidPrefix
    parts: list[Part]


def message_parts(octets: Octets, describer: Describer, *, receiver: GuidPrefix = GuidPrefix.UNKNOWN) -> MessageParts:
    """The message in words; ``describer``'s names learn from it on the way.

    ``receiver`` is whom it is for where no INFO_DST says so.  Broken octets are described as far as they can be read.
    """
    try:
        message = MessageReceiver(octets)
    except MalformedMessage as error:
        said = f"{count_text(len(octets), 'octet')}, {printable(error.reason)}"
        return MessageParts(GuidPrefix.UNKNOWN, [Part(GuidPrefix.UNKNOWN, [said])])
    header = message.header
    describer.names.learn_header(header.guid_prefix, header.vendor_id)
    phrases = _Phrases()
    try:
        for submessage, state in message:
            describer.names.learn_submessage(submessage)
            text = describer.submessage(
                submessage,
                source=state.source_guid_prefix,
                destination=receiver if state.dest_guid_prefix == GuidPrefix.UNKNOWN else state.dest_guid_prefix,
            )
            phrases.add(submessage, text, state.dest_guid_prefix)
    except MalformedMessage as error:
        phrases.say(f"malformed {printable(str(error), limit=120)}", message.state.dest_guid_prefix)
    return MessageParts(header.guid_prefix, phrases.finish())


@dataclass(slots=True)
class _Envelope:
    title: str
    texts: list[str] = field(default_factory=list)

    def __str__(self) -> str:
        return f"{self.title}[{', '.join(self.texts)}]" if self.texts else self.title


class _Phrases:
    """Collects what is said, part by part; envelopes that are open hold what is inside them."""

    def __init__(self) -> None:
        self._parts: list[Part] = []
        self._envelopes: list[_Envelope] = []
        self._folded: list[str] = []
        self._text_count = 0

    def add(self, submessage: Submessage, text: str, destination: GuidPrefix) -> None:
        if isinstance(submessage, InfoTimestamp | InfoDestination):
            self._folded = [*self._folded[:_MAX_TEXTS], text]
        elif not isinstance(submessage, Opaque):
            self.say(text, destination)
        elif submessage.kind in _PREFIXES and len(self._envelopes) < _MAX_ENVELOPES:
            self._envelopes.append(_Envelope(_envelope_title(submessage)))
        elif submessage.kind in _POSTFIXES and self._envelopes:
            envelope = self._envelopes.pop()
            self.say(str(envelope), destination)
        elif submessage.kind == SubmessageKind.SEC_BODY and self._envelopes:
            self.say(count_text(len(submessage.body), "octet"), destination)
        else:
            self.say(text, destination)

    def say(self, text: str, destination: GuidPrefix) -> None:
        if self._envelopes:
            inside = self._envelopes[-1].texts
            if len(inside) < _MAX_TEXTS:
                inside.append(text)
            return
        self._text_count += 1
        if self._text_count > _MAX_TEXTS:
            return
        if not self._parts or self._parts[-1].destination != destination:
            self._parts.append(Part(destination))
        self._parts[-1].texts.append(text)

    def finish(self) -> list[Part]:
        """All parts.  A message of INFO_* alone says those; an envelope that was never closed says so."""
        while self._envelopes:
            envelope = self._envelopes.pop()
            self.say(f"{envelope} without its end", GuidPrefix.UNKNOWN)
        if not self._parts:
            self.say(", ".join(self._folded) or "nothing", GuidPrefix.UNKNOWN)
        if self._text_count > _MAX_TEXTS:
            self._parts[-1].texts.append(f"and {self._text_count - _MAX_TEXTS} more")
        return self._parts


def _envelope_title(prefix: Opaque) -> str:
    """``protected AES256_GCM key 1a2b3c4d``, by DDS-Security 1.1 §9.5.2.3 (CryptoHeader; big-endian)."""
    title = _PREFIXES[SubmessageKind(prefix.kind)]
    if len(prefix.body) < 8:
        return title
    kind = int.from_bytes(prefix.body[:4], "big")
    transformation = _TRANSFORMATIONS[kind] if kind < len(_TRANSFORMATIONS) else f"transformation {kind:x}"
    key_id = bytes(prefix.body[4:8])
    # Zero is the key that both sides derive from their handshake; it protects the messages that carry all others.
    return f"{title} {transformation} {f'key {key_id.hex()}' if any(key_id) else 'Kx key'}"
