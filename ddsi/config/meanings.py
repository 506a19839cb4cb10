"""What the elements of ``DDSI_URI`` mean, as tables: which field each sets, which are refused, and how they are read.

Elements that say something only together (interfaces, peers, tracing) are in ``settings.py``.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping

from .config import TraceLevel
from .units import parse_boolean, parse_duration, parse_integer, parse_memory

__all__ = [
    "FIELDS",
    "LARGEST_WINS",
    "MULTICAST",
    "REFUSED",
    "SECURITY",
    "VERBOSITIES",
    "Reader",
    "has_effect",
    "parse_text",
]

Reader = Callable[[str], object]
"""From the text of an element to a value.  Raises ValueError with what the text should have been."""


def parse_text(text: str) -> str:
    return text


def parse_participant_index(text: str) -> int | str:
    if text in ("auto", "none"):
        return text
    try:
        return parse_integer(text)
    except ValueError:
        raise ValueError("auto, none, default or a whole number") from None


# By path (an attribute follows @): the field of Config, or of its PortMapping, and who reads the text.  Where it says
# `default`, the field is left alone, unless it takes any text.
FIELDS: Mapping[str, tuple[str, Reader]] = {
    "General/MaxMessageSize": ("max_message_size", parse_memory),
    "General/FragmentSize": ("fragment_size", parse_memory),
    "General/MulticastTimeToLive": ("multicast_ttl", parse_integer),
    "Discovery/AnnounceTypes": ("announce_types", parse_boolean),
    "Discovery/Tag": ("domain_tag", parse_text),
    "Discovery/LeaseDuration": ("lease_duration", parse_duration),
    "Discovery/SPDPInterval": ("spdp_interval", parse_duration),
    "Discovery/SPDPMulticastAddress": ("multicast_address", parse_text),
    "Discovery/ParticipantIndex": ("participant_index", parse_participant_index),
    "Discovery/MaxAutoParticipantIndex": ("max_auto_participant_index", parse_integer),
    "Discovery/Ports/Base": ("ports.base", parse_integer),
    "Discovery/Ports/DomainGain": ("ports.domain_gain", parse_integer),
    "Discovery/Ports/ParticipantGain": ("ports.participant_gain", parse_integer),
    "Discovery/Ports/MulticastMetaOffset": ("ports.multicast_metatraffic_offset", parse_integer),
    "Discovery/Ports/UnicastMetaOffset": ("ports.unicast_metatraffic_offset", parse_integer),
    "Discovery/Ports/MulticastDataOffset": ("ports.multicast_user_offset", parse_integer),
    "Discovery/Ports/UnicastDataOffset": ("ports.unicast_user_offset", parse_integer),
    "Bounds/MaxParticipants": ("max_participants", parse_integer),
    "Bounds/MaxEndpoints": ("max_endpoints", parse_integer),
    "Bounds/MaxInstances": ("max_instances", parse_integer),
    "Bounds/MaxSampleSize": ("max_sample_size", parse_memory),
    "Bounds/MaxDefragOctets": ("max_defrag_octets", parse_memory),
    "Bounds/MaxReorderSamples": ("max_reorder_samples", parse_integer),
    "Bounds/ReaderOctets": ("reader_octets", parse_memory),
    "Bounds/UnacknowledgedOctets": ("unacknowledged_octets", parse_memory),
    "Internal/MaxSampleSize": ("max_sample_size", parse_memory),
    "Internal/PrimaryReorderMaxSamples": ("max_reorder_samples", parse_integer),
    "Internal/Watermarks/WhcHigh": ("unacknowledged_octets", parse_memory),
    # Where older releases of Cyclone had them:
    "Internal/MaxMessageSize": ("max_message_size", parse_memory),
    "Internal/FragmentSize": ("fragment_size", parse_memory),
    "Internal/LeaseDuration": ("lease_duration", parse_duration),
    "Internal/SocketReceiveBufferSize@min": ("receive_buffer_size", parse_memory),
    "Internal/SocketReceiveBufferSize@max": ("receive_buffer_size", parse_memory),
    "Internal/MinimumSocketReceiveBufferSize": ("receive_buffer_size", parse_memory),
    "Internal/SocketSendBufferSize@min": ("send_buffer_size", parse_memory),
    "Internal/SocketSendBufferSize@max": ("send_buffer_size", parse_memory),
    "Internal/MinimumSocketSendBufferSize": ("send_buffer_size", parse_memory),
    "Tracing/OutputFile": ("trace_file", parse_text),
    "Tracing/AppendToFile": ("trace_append", parse_boolean),
    "Tracing/PacketCaptureFile": ("pcap_file", parse_text),
}

# Cyclone has a wish and a least for a socket's buffer; we ask the system for the larger, and take what it gives.
LARGEST_WINS = frozenset({"receive_buffer_size", "send_buffer_size"})

# What would change who can be talked to, and is not done here: the values that ask for nothing, else the objection.
REFUSED: Mapping[str, tuple[tuple[str, ...], str]] = {
    "General/Transport": (("default", "udp"), "only udp is supported"),
    "General/UseIPv6": (("default", "false"), "only IPv4 is supported"),
    "General/ExternalNetworkAddress": (("auto",), "announcing an address other than the interface's is not supported"),
    "TCP/Enable": (("default", "false"), "TCP is not supported"),
    "SSL/Enable": (("false",), "SSL, which protects TCP, is not supported"),
}

# The property that each element stands for.  What is empty here is accepted and decided by us: where the plugins are,
# and that optional fields are always sent.
SECURITY: Mapping[str, str] = {
    "Security/Authentication/IdentityCA": "dds.sec.auth.identity_ca",
    "Security/Authentication/IdentityCertificate": "dds.sec.auth.identity_certificate",
    "Security/Authentication/PrivateKey": "dds.sec.auth.private_key",
    "Security/Authentication/Password": "dds.sec.auth.password",
    "Security/Authentication/CRL": "dds.sec.auth.crl",
    "Security/Authentication/TrustedCADirectory": "dds.sec.auth.trusted_ca_dir",
    "Security/Authentication/IncludeOptionalFields": "",
    "Security/Authentication/Library": "",
    "Security/AccessControl/PermissionsCA": "dds.sec.access.permissions_ca",
    "Security/AccessControl/Governance": "dds.sec.access.governance",
    "Security/AccessControl/Permissions": "dds.sec.access.permissions",
    "Security/AccessControl/Library": "",
    "Security/Cryptographic/Library": "",
}

# `spdp` keeps announcements on multicast and moves data to unicast.
MULTICAST: Mapping[str, bool | None] = {
    "default": None,
    "false": False,
    "true": True,
    "asm": True,
    "ssm": True,
    "spdp": True,
}

VERBOSITIES: Mapping[str, TraceLevel | None] = {
    "none": None,
    "severe": "severe",
    "warning": "warning",
    "info": "info",
    "config": "config",
    "fine": "fine",
    "finer": "finer",
    "finest": "finest",
}

# Read by a function of their own in settings.py, with their attributes.
_TOGETHER = (
    "Id",
    "General/AllowMulticast",
    "General/NetworkInterfaceAddress",
    "General/Interfaces/NetworkInterface",
    "Discovery/Peers@AddLocalhost",
    "Discovery/Peers/Peer",
    "Discovery/Peers/Group/Peer",
    "Tracing/Verbosity",
)


def has_effect(path: str) -> bool:
    """Does the element mean something here, itself or by what may stand in it?"""
    return path in _EFFECTIVE


def _with_all_above(paths: list[str]) -> frozenset[str]:
    effective = set(paths)
    for path in paths:
        element = path.partition("@")[0]
        while element:
            effective.add(element)
            element = element.rpartition("/")[0]
    return frozenset(effective)


_EFFECTIVE = _with_all_above([*FIELDS, *REFUSED, *SECURITY, *_TOGETHER])
