"""Governance and permissions written as XML.  DDS-Security 1.1 §9.4.1.2 (Governance), §9.4.1.3 (Permissions).

The elements in the order of the schema, all of them present, domain ranges with both ends, partitions named: what every
vendor reads alike.  Reading and judging documents is access control's business (:mod:`ddsi_security.access_control`).
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from datetime import datetime
from types import MappingProxyType
from typing import Final
from xml.sax.saxutils import escape, quoteattr

from ddsi.structure.errors import BadParameter

from .domain_ranges import DomainRanges
from .validity import Validity

__all__ = ["DATA_KINDS", "KINDS", "PRESETS", "GovernanceDraft", "GrantDraft", "Rights", "permissions_xml"]

KINDS: Final = ("NONE", "SIGN", "ENCRYPT", "SIGN_WITH_ORIGIN_AUTHENTICATION", "ENCRYPT_WITH_ORIGIN_AUTHENTICATION")
"""ProtectionKind, for messages, discovery, liveliness and submessages."""
DATA_KINDS: Final = KINDS[:3]
"""BasicProtectionKind, for payloads: whoever may read may also sign, so there is no origin to prove."""

PRESETS: Final = MappingProxyType(
    {
        "encrypt": ("ENCRYPT", "ENCRYPT", "SIGN", "ENCRYPT", "ENCRYPT"),  # as ROS 2's tools have it
        "encrypt-all": ("ENCRYPT",) * 5,
        "submessage": ("ENCRYPT", "ENCRYPT", "NONE", "ENCRYPT", "NONE"),  # one layer, which covers the payload
        "sign": ("SIGN",) * 5,
        "authenticate": ("NONE",) * 5,
    }
)
"""Kinds of discovery, liveliness, RTPS, metadata and data protection that all vendors agree on."""

_HEAD: Final = '<?xml version="1.0" encoding="UTF-8"?>\n<dds xmlns:xsi="http://www.w3.org/2001/XMLSchema-instance">'


@dataclass(frozen=True, slots=True, kw_only=True)
class GovernanceDraft:
    """One domain rule with one rule for all topics; whoever wants more edits the XML and signs that."""

    domains: DomainRanges = DomainRanges(((0, 0),))
    allow_unauthenticated: bool = False
    join_access_control: bool = True
    discovery: str = "ENCRYPT"
    liveliness: str = "ENCRYPT"
    rtps: str = "SIGN"
    metadata: str = "ENCRYPT"
    data: str = "ENCRYPT"
    read_access_control: bool = True
    write_access_control: bool = True

    def __post_init__(self) -> None:
        """Raises BadParameter for what the specification rules out."""
        for name in ("discovery", "liveliness", "rtps", "metadata", "data"):
            kinds = DATA_KINDS if name == "data" else KINDS
            if getattr(self, name) not in kinds:
                raise BadParameter(f"protection of {name} is one of {', '.join(kinds)}, not {getattr(self, name)!r}")
        if self.allow_unauthenticated and self.rtps != "NONE":
            raise BadParameter(
                f"unauthenticated participants have no key for RTPS messages, so rtps protection {self.rtps} would "
                "shut them out: choose rtps protection NONE, or do not allow them (DDS-Security 1.1 §9.4.1.2.4)"
            )

    def xml(self) -> bytes:
        """The document, not yet signed."""
        unauthenticated = _bool(self.allow_unauthenticated)
        return _document(
            "<domain_access_rules>",
            "  <domain_rule>",
            *_indented(_domains(self.domains), 4),
            f"    <allow_unauthenticated_participants>{unauthenticated}</allow_unauthenticated_participants>",
            f"    <enable_join_access_control>{_bool(self.join_access_control)}</enable_join_access_control>",
            f"    <discovery_protection_kind>{self.discovery}</discovery_protection_kind>",
            f"    <liveliness_protection_kind>{self.liveliness}</liveliness_protection_kind>",
            f"    <rtps_protection_kind>{self.rtps}</rtps_protection_kind>",
            "    <topic_access_rules>",
            "      <topic_rule>",
            "        <topic_expression>*</topic_expression>",
            f"        <enable_discovery_protection>{_bool(self.discovery != 'NONE')}</enable_discovery_protection>",
            f"        <enable_liveliness_protection>{_bool(self.liveliness != 'NONE')}</enable_liveliness_protection>",
            f"        <enable_read_access_control>{_bool(self.read_access_control)}</enable_read_access_control>",
            f"        <enable_write_access_control>{_bool(self.write_access_control)}</enable_write_access_control>",
            f"        <metadata_protection_kind>{self.metadata}</metadata_protection_kind>",
            f"        <data_protection_kind>{self.data}</data_protection_kind>",
            "      </topic_rule>",
            "    </topic_access_rules>",
            "  </domain_rule>",
            "</domain_access_rules>",
        )


@dataclass(frozen=True, slots=True, kw_only=True)
class Rights:
    """What somebody may do: topics and partitions are patterns, as in a shell."""

    domains: DomainRanges = DomainRanges(((0, 0),))
    publish: tuple[str, ...] = ("*",)
    subscribe: tuple[str, ...] = ("*",)
    relay: tuple[str, ...] = ()
    partitions: tuple[str, ...] = ("*",)


@dataclass(frozen=True, slots=True, kw_only=True)
class GrantDraft:
    """What one subject may do, as one allow rule; all else is denied."""

    name: str
    subject_name: str
    validity: Validity
    rights: Rights = Rights()

    def lines(self) -> Iterator[str]:
        """The element."""
        rights = self.rights
        yield f"<grant name={quoteattr(self.name)}>"
        yield f"  <subject_name>{escape(self.subject_name)}</subject_name>"
        yield "  <validity>"
        yield f"    <not_before>{_date_time(self.validity.not_before)}</not_before>"
        yield f"    <not_after>{_date_time(self.validity.not_after)}</not_after>"
        yield "  </validity>"
        yield "  <allow_rule>"
        yield from _indented(_domains(rights.domains), 4)
        for kind, topics in (("publish", rights.publish), ("subscribe", rights.subscribe), ("relay", rights.relay)):
            if topics:
                yield from _indented(_criterion(kind, topics, rights.partitions), 4)
        yield "  </allow_rule>"
        yield "  <default>DENY</default>"
        yield "</grant>"


def permissions_xml(grants: Sequence[GrantDraft]) -> bytes:
    """The document, not yet signed."""
    lines = [line for grant in grants for line in _indented(grant.lines(), 2)]
    return _document("<permissions>", *lines, "</permissions>")


def _criterion(kind: str, topics: tuple[str, ...], partitions: tuple[str, ...]) -> list[str]:
    return [
        f"<{kind}>",
        "  <topics>",
        *(f"    <topic>{escape(topic)}</topic>" for topic in topics),
        "  </topics>",
        "  <partitions>",
        *(f"    <partition>{escape(partition)}</partition>" for partition in partitions),
        "  </partitions>",
        f"</{kind}>",
    ]


def _document(*lines: str) -> bytes:
    return "\n".join([_HEAD, *_indented(lines, 2), "</dds>", ""]).encode()


def _indented(lines: Sequence[str] | Iterator[str], width: int) -> list[str]:
    return [" " * width + line for line in lines]


def _domains(domains: DomainRanges) -> list[str]:
    return ["<domains>", *(f"  {_domain_range(first, last)}" for first, last in domains.ranges), "</domains>"]


def _domain_range(first: int, last: int) -> str:
    return f"<id>{first}</id>" if first == last else f"<id_range><min>{first}</min><max>{last}</max></id_range>"


def _bool(value: bool) -> str:
    return "true" if value else "false"


def _date_time(time: datetime) -> str:
    """UTC, in the width that Cyclone DDS insists on."""
    return f"{time:%Y-%m-%dT%H:%M:%S}"
