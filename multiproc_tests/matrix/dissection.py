"""What tshark must not find in our packets.

Wireshark's dissector is an implementation of RTPS that nobody here wrote, and stricter about form than most peers.
"""

from __future__ import annotations

import re

from ..framework import Capture

__all__ = ["OUR_PACKETS", "complaints"]

OUR_PACKETS = "rtps.vendorId == 0x01dd"

_DOUBTFUL = re.compile(
    r"""
    ^submessageId:.*(Unknown|Vendor-specific)   # a submessage that the specification does not have
    | ^parameterId:.*Unknown                    # a parameter likewise
    | \[Malformed | \[Expert\ Info\ \((Error|Warning)
    | ^encapsulation\ kind:.*Unknown
    """,
    re.VERBOSE,
)

_YOUNGER_THAN_TSHARK = re.compile(r"^parameterId: Unknown \(0x0075\)")
"""PID_TYPE_INFORMATION (DDS-XTypes 1.3 §7.6.3.2.2), which Debian 12's Wireshark 4.0 has no name for."""


def complaints(captured: Capture, packets: str = OUR_PACKETS) -> list[str]:
    """All that is wrong with those packets, one line each; empty if nothing is."""
    filtered = f"rtps && ({packets})"
    doubtful = captured.marks(filtered, _DOUBTFUL.pattern, flags=re.VERBOSE)
    return captured.malformed(filtered) + [line for line in doubtful if not _YOUNGER_THAN_TSHARK.search(line)]
