"""VendorId_t and ProtocolVersion_t: who wrote the peer.  RTPS 2.5 §8.3.3.1.3, §9.3.2; the OMG keeps the list."""

from __future__ import annotations

__all__ = ["OUR_VENDOR_ID", "PROTOCOL_VERSION", "VENDOR_NAMES", "VendorId", "vendor_name"]

VendorId = bytes
"""Two octets, never swapped."""

# Not assigned by the OMG to anyone.  Never another vendor's: peers apply that vendor's private rules to it.
OUR_VENDOR_ID: VendorId = b"\x01\xdd"
PROTOCOL_VERSION = (2, 4)

VENDOR_NAMES: dict[VendorId, str] = {
    b"\x00\x00": "unknown",
    b"\x01\x01": "RTI Connext",
    b"\x01\x02": "OpenSplice",
    b"\x01\x03": "OpenDDS",
    b"\x01\x04": "MilSOFT",
    b"\x01\x05": "Kongsberg InterCOM",
    b"\x01\x06": "TwinOaks CoreDX",
    b"\x01\x07": "Lakota",
    b"\x01\x08": "ICOUP",
    b"\x01\x09": "ETRI",
    b"\x01\x0a": "RTI Connext Micro",
    b"\x01\x0b": "ADLINK Vortex",
    b"\x01\x0c": "ADLINK Vortex",
    b"\x01\x0d": "ADLINK Vortex",
    b"\x01\x0e": "Technicolor",
    b"\x01\x0f": "Fast DDS",
    b"\x01\x10": "Cyclone DDS",
    b"\x01\x11": "GurumNetworks",
    b"\x01\x12": "RustDDS",
    b"\x01\x13": "ZRDDS",
    b"\x01\x14": "Dust DDS",
    b"\x01\x15": "Safe DDS",
    b"\x01\x20": "Vortex Cloud",
    OUR_VENDOR_ID: "ddsi",
}

CYCLONE: VendorId = b"\x01\x10"
FAST_DDS: VendorId = b"\x01\x0f"
RTI: VendorId = b"\x01\x01"
RTI_MICRO: VendorId = b"\x01\x0a"
OPENDDS: VendorId = b"\x01\x03"
RUST_DDS: VendorId = b"\x01\x12"
DUST_DDS: VendorId = b"\x01\x14"
TWINOAKS: VendorId = b"\x01\x06"


def vendor_name(vendor_id: VendorId) -> str:
    """The name for people; hexadecimal for a vendor that is not in the table."""
    return VENDOR_NAMES.get(bytes(vendor_id)) or f"vendor {bytes(vendor_id).hex('.')}"
