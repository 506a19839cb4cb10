"""MessageReceiver: walks a message and keeps what its INFO_* submessages say.  RTPS 2.5 §8.3.4.

The general path: it decodes every submessage into its class.  What to do with them is for others.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace

from ..serialization.cursor import Octets
from ..structure.guid import GuidPrefix
from ..structure.locator import Locator
from ..structure.vendor import VendorId
from .header import HEADER_LENGTH, Header
from .interpreter import InfoDestination, InfoReply, InfoReplyIp4, InfoSource, InfoTimestamp
from .raw_submessage import iterate_submessages
from .submessages import Submessage, decode_submessage

__all__ = ["MessageReceiver", "ReceiverState"]


@dataclass(frozen=True, slots=True)
class ReceiverState:
    """What holds for the submessage at hand.  RTPS 2.5 §8.3.4 (table 8.12).  Other name: receiver_state.

    ``dest_guid_prefix`` UNKNOWN: for every participant.  ``timestamp`` in ticks, None without one.
    Reply locators are empty where the peer's announced ones are to be used.
    """

    source_guid_prefix: GuidPrefix
    source_vendor_id: VendorId
    source_version: tuple[int, int]
    dest_guid_prefix: GuidPrefix = GuidPrefix.UNKNOWN
    unicast_reply_locators: tuple[Locator, ...] = ()
    multicast_reply_locators: tuple[Locator, ...] = ()
    timestamp: int | None = None

    def is_addressed_to(self, prefix: GuidPrefix) -> bool:
        """Is this participant meant, alone or among all?"""
        return self.dest_guid_prefix in (prefix, GuidPrefix.UNKNOWN)

    def interpret(self, submessage: Submessage) -> ReceiverState:
        """The state after ``submessage``: changed by INFO_* (RTPS 2.5 §8.3.4.1), itself after all others."""
        match submessage:
            case InfoTimestamp(timestamp):
                return replace(self, timestamp=timestamp)
            case InfoDestination(guid_prefix):
                return replace(self, dest_guid_prefix=guid_prefix)
            case InfoSource(protocol_version, vendor_id, guid_prefix):
                # All that was said of the former source is void.  The destination is not about the source.
                return ReceiverState(guid_prefix, vendor_id, protocol_version, self.dest_guid_prefix)
            case InfoReply(unicast, multicast):
                return replace(self, unicast_reply_locators=unicast, multicast_reply_locators=multicast or ())
            case InfoReplyIp4(unicast_locator, multicast_locator):
                others = () if multicast_locator is None else (multicast_locator,)
                return replace(self, unicast_reply_locators=(unicast_locator,), multicast_reply_locators=others)
            case _:
                return self


class MessageReceiver:
    """One message on its way in: iterate it for (submessage, state) pairs, INFO_* submessages among them.

    ``source`` is where the datagram came from.  Making one raises MalformedMessage if the header is not
    RTPS's.  So does iteration at a submessage that is malformed: the rest of the message is lost (RTPS 2.5
    §8.3.4.1), what came before it holds.

    ``state`` is that of the submessage given out last.
    """

    __slots__ = ("_datagram", "header", "state")

    def __init__(self, datagram: Octets, *, source: Locator | None = None) -> None:
        self.header = Header.decode(datagram)
        self.state = ReceiverState(
            self.header.guid_prefix,
            self.header.vendor_id,
            self.header.protocol_version,
            unicast_reply_locators=() if source is None else (source,),
        )
        self._datagram = datagram

    def __iter__(self) -> Iterator[tuple[Submessage, ReceiverState]]:
        return self.walk(self._datagram, start=HEADER_LENGTH)

    def walk(self, octets: Octets, *, start: int = 0) -> Iterator[tuple[Submessage, ReceiverState]]:
        """The submessages of ``octets[start:]``, under the state as it is: for what came out of an envelope."""
        for raw in iterate_submessages(octets, start=start):
            submessage = decode_submessage(raw)
            self.state = self.state.interpret(submessage)
            yield submessage, self.state
