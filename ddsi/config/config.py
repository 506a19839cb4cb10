"""``Config``: everything about a participant that is not QoS, as one value.  RTPS leaves it to the implementation.

The same settings as ``DDSI_URI`` holds, typed.  A Config is checked when it is made and never changes; whether an
interface of that name exists, or a peer's name resolves, is found out by the transport.
"""

from __future__ import annotations

import ipaddress
import math
from collections.abc import Mapping
from dataclasses import field, fields
from typing import TYPE_CHECKING, Literal, NoReturn, get_args

from ddsi.structure.vendor import OUR_VENDOR_ID, VendorId

from ..structure.dataclass import dataclass
from ..structure.keywords import refuse_unknown_keywords
from .ports import HIGHEST_PORT, PortMapping
from .refusal import RefusedSetting

__all__ = ["HIGHEST_PARTICIPANT_INDEX", "Config", "TraceLevel"]

TraceLevel = Literal["severe", "warning", "info", "config", "fine", "finer", "finest"]
"""How much to record, least first; the words are Cyclone's."""

HIGHEST_PARTICIPANT_INDEX = 119
"""Beyond it the unicast ports run into those of the next domain (RTPS 2.5 §9.6.2.3, with its default gains)."""

_MIB = 1 << 20
# The largest payload of an IPv4 UDP datagram: 65535 less 20 octets of IP header and 8 of UDP.
_LARGEST_DATAGRAM = 65507
# An RTPS header, a DATA_FRAG with its INFO_DST, INFO_TS and HEARTBEAT, protected: a message holds that and some data.
_SMALLEST_MESSAGE = 512
# RTPS 2.5 §9.6.3, domainTag is a string<256>, and one octet of it ends the string.
_LONGEST_TAG = 255


@dataclass(frozen=True, slots=True, kw_only=True, repr=False)
class Config:
    """The settings of a participant.  Sizes are octets, durations seconds; None leaves the choice to the transport.

    Raises ConfigurationError, naming the field, its value and what to do, when a value cannot be meant.
    """

    # --- where to send and listen ---
    interfaces: tuple[str, ...] = ()
    """Network interfaces by name (``lo``, ``eth0``) or address (``127.0.0.1``).  Empty: every interface that is up, as
    people expect to be found wherever they are connected."""
    multicast: bool | None = None
    """Announce, and listen for announcements, by multicast?  None: wherever the interface can, but loopback is also
    tried by unicast, as it has no multicast in most containers."""
    multicast_address: str = "239.255.0.1"
    """The IPv4 group of announcements.  RTPS 2.5 §9.6.2.4.1 fixes the default; all vendors listen there."""
    multicast_ttl: int = 1
    """How many routers multicast may pass, 0 to 255.  Default 1: nothing leaves the subnet unless asked."""
    peers: tuple[str, ...] = ()
    """Who else to announce to, by unicast: ``host``, ``host:port`` or ``[IPv6]:port``.  A host without a port is tried
    at participant indices 0 to ``max_auto_participant_index``."""
    participant_index: int | Literal["auto", "none"] = "auto"
    """Which well-known unicast ports to listen on.  ``auto``: the first free index from 0; ``none``: any free ports,
    only for those who hear our announcements; a number: that one, or fail."""
    max_auto_participant_index: int = 9
    """The highest index that ``auto`` tries and that hosts in ``peers`` are probed at.  Each index costs a datagram
    more per such host and announcement; 9 is enough for ten participants on a host, raise it for more."""
    ports: PortMapping = PortMapping()
    """The constants of the port expressions, RTPS 2.5 §9.6.2.3."""

    # --- who is met ---
    domain_tag: str = ""
    """Participants meet only those with the same tag (RTPS 2.5 §8.5.3.2, domainTag); at most 255 octets of UTF-8."""
    lease_duration: float = 20.0
    """After how many seconds of silence others shall forget us.  20 s, as Fast DDS: a few announcements may be lost."""
    spdp_interval: float | None = None
    """Seconds between announcements, once the first quick ones are out.  None: see :attr:`announcement_period`."""

    announce_types: bool = True
    """Announce what types are made of (XTypes TypeInformation) with writers and readers?  Then peers that do so too
    match by what the types are made of, evolved ones included, and whoever asks is told it.  Off, our endpoints match
    by type names alone, and nobody learns their types from us."""

    # --- sizes ---
    max_message_size: int | None = None
    """The longest UDP payload that we send, 512 to 65507.  None: what fits a frame of the interface (up to 65,000
    on loopback), so that the loss of a frame costs no more than it held."""
    fragment_size: int | None = None
    """How much of a large sample goes into one DATA_FRAG.  None: what fills a message."""
    receive_buffer_size: int | None = None
    """The socket's SO_RCVBUF.  None: as large as the system allows; a full buffer is the usual cause of loss."""
    send_buffer_size: int | None = None
    """The socket's SO_SNDBUF.  None: as the system has it, enlarged to hold a few messages."""

    # --- bounds: what others can make us hold ---
    max_participants: int = 1000
    """Remote participants known at once.  Five hundred on a host are seen in practice; each costs some kilobytes."""
    max_endpoints: int = 20_000
    """Remote writers and readers known at once, of all participants together."""
    max_instances: int = 100_000
    """Instances that one reader keeps state of, where its resource limits say nothing."""
    max_sample_size: int = 256 * _MIB
    """The largest serialised sample accepted, in octets; a longer one is dropped before memory is taken for it."""
    max_defrag_octets: int = 512 * _MIB
    """Memory for samples whose fragments have not all come, of all writers together; at least ``max_sample_size``."""
    max_reorder_samples: int = 1024
    """Samples that a reader holds back per writer while earlier ones are missing: four bitmaps of an ACKNACK."""
    unacknowledged_octets: int = 8 * _MIB
    """How much a reliable writer may have sent without acknowledgment before ``write`` waits."""

    reader_octets: int = 64 * _MIB
    """How much one reader holds that the application has not taken, where KEEP_ALL has no limits of its own; a
    reliable writer then waits."""

    # --- tracing ---
    trace_file: str = ""
    """Where events go, one JSON object a line: a path, ``stdout`` or ``stderr``.  Empty: tracing is off, at no cost."""
    trace_level: TraceLevel = "finest"
    trace_append: bool = False
    """Keep what the file already holds?"""
    pcap_file: str = ""
    """A pcapng file to which every message sent and received is written.  Empty: none."""

    # --- identity ---
    vendor_id: VendorId = OUR_VENDOR_ID
    """The two octets in every message that say whose implementation this is; for tests that play another one."""

    security: tuple[tuple[str, str], ...] = ()
    """The ``dds.sec.*`` properties that ``<Security>`` stands for, name and value.  Where the participant's QoS has
    such properties too, they must be the same."""

    config_warnings: tuple[str, ...] = field(default=(), compare=False)
    """What was accepted from ``DDSI_URI`` but means nothing here, a sentence with its line for each."""

    if not TYPE_CHECKING:  # type checkers know the names

        def __new__(cls, *positional, **given):
            if positional or not given.keys() <= cls.__dataclass_fields__.keys():
                refuse_unknown_keywords("Config", cls.__dataclass_fields__, given, len(positional))
            return object.__new__(cls)

    def __post_init__(self) -> None:
        _check_where(self)
        _check_durations(self)
        _check_sizes(self)
        _check_bounds(self)
        if get_args(TraceLevel).count(self.trace_level) != 1:
            _refuse("trace_level", self.trace_level, f"one of {', '.join(get_args(TraceLevel))}")
        for name in ("trace_file", "pcap_file"):
            _check_text(name, getattr(self, name))
        if not isinstance(self.vendor_id, bytes) or len(self.vendor_id) != 2:
            _refuse("vendor_id", self.vendor_id, "two octets (bytes)")

    def __repr__(self) -> str:
        """Only what differs from the defaults; of security the names, as a value may be a key or a password."""
        default = Config()
        changed = {
            item.name: getattr(self, item.name)
            for item in fields(self)
            if getattr(self, item.name) != getattr(default, item.name)
        }
        if self.security:
            changed["security"] = tuple(name for name, _ in self.security)
        return f"Config({', '.join(f'{name}={value!r}' for name, value in changed.items())})"

    @property
    def announcement_period(self) -> float:
        """Seconds between announcements: ``spdp_interval``, else a fifth of the lease, at least 0.1 and at most 4 s.

        A fifth, because a lease must outlive the loss of several announcements in a row.
        """
        if self.spdp_interval is not None:
            return self.spdp_interval
        return min(max(self.lease_duration / 5, 0.1), 4.0, self.lease_duration / 2)

    @classmethod
    def from_uri(cls, text: str, *, domain_id: int = 0, environ: Mapping[str, str] | None = None) -> Config:
        """The settings that ``text`` holds for the domain: ``file:`` and a path, a path, or the XML itself.

        ``environ`` serves ``${NAME}`` in values; None: nothing is defined.  Raises ConfigurationError.
        """
        from .uri import config_from_uri  # reading XML costs start-up time that few programs need to pay

        return config_from_uri(text, domain_id=domain_id, environ=environ or {})


def _refuse(name: str, value: object, expected: str) -> NoReturn:
    raise RefusedSetting(name, value, expected)


def _check_text(name: str, value: object) -> None:
    if not isinstance(value, str) or "\0" in value:
        _refuse(name, value, "a str without NUL")


def _check_texts(name: str, values: object, example: str) -> None:
    if not isinstance(values, tuple) or not all(
        isinstance(text, str) and text.strip() == text != "" for text in values
    ):
        _refuse(name, values, f"a tuple of str, such as {example}")


def _check_number(name: str, value: object, lowest: int, highest: int) -> None:
    if not isinstance(value, int) or isinstance(value, bool) or not lowest <= value <= highest:
        _refuse(name, value, f"a whole number from {lowest} to {highest}")


def _check_where(config: Config) -> None:
    _check_texts("interfaces", config.interfaces, '("lo",) or ("192.168.1.5",)')
    _check_texts("peers", config.peers, '("192.168.1.7", "robot.local:7410")')
    for peer in config.peers:
        _check_peer(peer)
    if not isinstance(config.announce_types, bool):
        _refuse("announce_types", config.announce_types, "True or False")
    if not (config.multicast is None or isinstance(config.multicast, bool)):
        _refuse("multicast", config.multicast, "True, False or None")
    if not _is_multicast_group(config.multicast_address):
        _refuse("multicast_address", config.multicast_address, "an IPv4 multicast address, such as '239.255.0.1'")
    _check_number("multicast_ttl", config.multicast_ttl, 0, 255)
    _check_number("max_auto_participant_index", config.max_auto_participant_index, 0, HIGHEST_PARTICIPANT_INDEX)
    if config.participant_index not in ("auto", "none"):
        _check_index(config.participant_index)
    if not isinstance(config.ports, PortMapping):
        _refuse("ports", config.ports, "a PortMapping")
    _check_text("domain_tag", config.domain_tag)
    if len(config.domain_tag.encode("utf-8", "surrogatepass")) > _LONGEST_TAG:
        _refuse("domain_tag", config.domain_tag, f"at most {_LONGEST_TAG} octets of UTF-8")


def _check_index(index: object) -> None:
    if not isinstance(index, int) or isinstance(index, bool) or not 0 <= index <= HIGHEST_PARTICIPANT_INDEX:
        _refuse("participant_index", index, f"'auto', 'none' or a whole number from 0 to {HIGHEST_PARTICIPANT_INDEX}")


def _check_peer(peer: str) -> None:
    host, colon, port = peer.rpartition(":")
    if not colon or (":" in host and not host.endswith("]")):
        return  # a name or an address without a port; an IPv6 address with a port stands in brackets
    if not host or not port.isascii() or not port.isdigit() or not 1 <= int(port[:6]) <= HIGHEST_PORT:
        _refuse("peers", peer, f"a host, or host:port with a port from 1 to {HIGHEST_PORT}")


def _is_multicast_group(address: object) -> bool:
    try:
        return isinstance(address, str) and ipaddress.IPv4Address(address).is_multicast
    except ValueError:
        return False


def _check_durations(config: Config) -> None:
    lease = config.lease_duration
    if not isinstance(lease, (int, float)) or isinstance(lease, bool) or math.isnan(lease) or lease <= 0:
        _refuse("lease_duration", lease, "a number of seconds above 0 (math.inf: others never forget us)")
    period = config.spdp_interval
    if period is None:
        return
    if not isinstance(period, (int, float)) or isinstance(period, bool) or not 0 < period < math.inf:
        _refuse("spdp_interval", period, "a finite number of seconds above 0, or None")
    if period >= lease:
        _refuse("spdp_interval", period, f"shorter than lease_duration ({lease} s), or others forget us in between")


def _check_sizes(config: Config) -> None:
    if config.max_message_size is not None:
        _check_number("max_message_size", config.max_message_size, _SMALLEST_MESSAGE, _LARGEST_DATAGRAM)
    if config.fragment_size is not None:
        _check_number("fragment_size", config.fragment_size, 1, config.max_message_size or _LARGEST_DATAGRAM)
    for name in ("receive_buffer_size", "send_buffer_size"):
        if (size := getattr(config, name)) is not None:
            _check_number(name, size, 1, 0x7FFFFFFF)  # setsockopt takes an int


def _check_bounds(config: Config) -> None:
    for name in (
        "max_participants",
        "max_endpoints",
        "max_instances",
        "max_reorder_samples",
        "unacknowledged_octets",
        "reader_octets",
    ):
        _check_number(name, getattr(config, name), 1, 0x7FFFFFFF_FFFFFFFF)
    # A DATA_FRAG's sampleSize is an unsigned long (RTPS 2.5 §9.4.5.5).
    _check_number("max_sample_size", config.max_sample_size, 1, 0xFFFFFFFF)
    _check_number("max_defrag_octets", config.max_defrag_octets, 1, 0x7FFFFFFF_FFFFFFFF)
    if config.max_defrag_octets < config.max_sample_size:
        _refuse(
            "max_defrag_octets",
            config.max_defrag_octets,
            f"at least max_sample_size ({config.max_sample_size}), or the largest samples could never be completed",
        )
