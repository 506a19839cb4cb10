"""IpReassembler: joins the fragments of IP packets in a capture, with a bound on what it keeps.

RFC 791 §3.2, RFC 8200 §4.5.  DDS messages of up to 64 KiB cross an Ethernet as some forty fragments, so a capture
from there shows no large sample without this.  (These are IP's fragments; those of RTPS are ``behavior``'s.)
"""

from __future__ import annotations

from dataclasses import dataclass, field

__all__ = ["IpFragment", "IpReassembler"]

_MAX_PACKET_OCTETS = 65535
# Beyond this many packets under way the oldest is given up: its fragments were lost, or are a flood.
_MAX_PACKETS = 64


@dataclass(frozen=True, slots=True)
class IpFragment:
    """``octets`` of a packet's body from ``offset`` on; ``more``: it is not the last."""

    offset: int
    octets: bytes
    more: bool


@dataclass(slots=True)
class _Partial:
    """``pieces`` by their offset, ``length`` of the whole body once the last fragment is known."""

    pieces: dict[int, bytes] = field(default_factory=dict)
    length: int | None = None
    octet_count: int = 0


class IpReassembler:
    """Fragments in any order, by key (addresses and identification); at most 64 packets of 64 KiB under way."""

    def __init__(self) -> None:
        self._partials: dict[bytes, _Partial] = {}

    def add(self, key: bytes, fragment: IpFragment) -> bytes | None:
        """The packet's whole body if this fragment completes it, else None.

        A packet whose fragments overlap, or reach beyond 65,535 octets, is given up (RFC 5722 demands the first for
        IPv6; nobody's IPv4 needs it).
        """
        partial = self._partials.setdefault(key, _Partial())
        if len(self._partials) > _MAX_PACKETS:
            del self._partials[next(iter(self._partials))]
        end = fragment.offset + len(fragment.octets)
        if partial.pieces.get(fragment.offset) == fragment.octets:
            return None
        partial.octet_count += len(fragment.octets)
        if fragment.offset in partial.pieces or max(end, partial.octet_count) > _MAX_PACKET_OCTETS:
            del self._partials[key]
            return None
        partial.pieces[fragment.offset] = fragment.octets
        if not fragment.more:
            partial.length = end
        if partial.length is None or partial.octet_count < partial.length:
            return None
        del self._partials[key]
        return _joined(partial)


def _joined(partial: _Partial) -> bytes | None:
    """All pieces, if each begins where the one before it ends."""
    whole = bytearray()
    for offset, octets in sorted(partial.pieces.items()):
        if offset != len(whole):
            return None
        whole += octets
    return bytes(whole)
