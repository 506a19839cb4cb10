"""Vendors: other vendors' stacks as sets of quirks, which ``Domain.node(vendor=...)`` plays.

Each is our own engine with that vendor's id and those of its habits that matter to a peer.  None says how the vendor's
product behaves otherwise.  What was seen where, and how we treat it: ``docs/vendors.md``.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

from ..config import Config
from ..structure import vendor as ids
from ..structure.vendor import VendorId, vendor_name
from .quirks import (
    AckNackCountZero,
    AckNackFromZero,
    BigEndianEnvelopes,
    DisposeByKeyHash,
    DropsCountZero,
    GapWhenAsked,
    HeartbeatForAll,
    KeysForEverybody,
    LengthlessPostfix,
    NeedsParticipantToken,
    NeedsReaderToken,
    NonStandardPayload,
    NoParticipantTokens,
    OpensAfterJoining,
    PlainTopicsInClear,
    ProtectedTimestamp,
    Quirk,
    RefusesAckNackFromZero,
    SealsBeforeCutting,
    VendorSubmessageBehind,
)

__all__ = ["CYCLONE_DDS", "DUST_DDS", "FAST_DDS", "OPENDDS", "RTI_CONNEXT", "RUST_DDS", "VENDORS", "Vendor"]


@dataclass(frozen=True, slots=True)
class Vendor:
    """``fragment_size``: how this vendor cuts large samples, in octets, where it differs from filling a message.

    ``has_origin_authentication``: does it know the kinds ..._WITH_ORIGIN_AUTHENTICATION?
    """

    vendor_id: VendorId
    quirks: tuple[type[Quirk], ...]
    fragment_size: int | None = None
    has_origin_authentication: bool = True

    @property
    def name(self) -> str:
        return vendor_name(self.vendor_id)

    def config(self, config: Config) -> Config:
        """The configuration of a participant that plays this vendor."""
        return replace(config, vendor_id=self.vendor_id, fragment_size=self.fragment_size or config.fragment_size)


CYCLONE_DDS = Vendor(
    ids.CYCLONE,
    (
        AckNackCountZero,
        RefusesAckNackFromZero,
        HeartbeatForAll,
        GapWhenAsked,
        PlainTopicsInClear,
        NeedsParticipantToken,
    ),
)
DUST_DDS = Vendor(ids.DUST_DDS, (DropsCountZero,))
FAST_DDS = Vendor(
    ids.FAST_DDS,
    (AckNackFromZero, DisposeByKeyHash, VendorSubmessageBehind, KeysForEverybody, NeedsReaderToken, ProtectedTimestamp),
)
OPENDDS = Vendor(
    ids.OPENDDS,
    (
        SealsBeforeCutting,
        OpensAfterJoining,
        NonStandardPayload,
        BigEndianEnvelopes,
        LengthlessPostfix,
        NoParticipantTokens,
    ),
    has_origin_authentication=False,
)
RTI_CONNEXT = Vendor(ids.RTI, (AckNackFromZero, DisposeByKeyHash))
RUST_DDS = Vendor(ids.RUST_DDS, (), fragment_size=256)

VENDORS = (CYCLONE_DDS, DUST_DDS, FAST_DDS, OPENDDS, RTI_CONNEXT, RUST_DDS)
