"""ParticipantProxy: what we know of one remote participant.  Other name: proxy_participant.

RTPS 2.5 §8.5.3.2, and §8.5.3.3 for its lease.  It also remembers which hosts it really spoke from: nothing is sent to
an address that a participant merely claims, or a stranger could point our traffic at somebody else (see
``reachable``).
"""

from __future__ import annotations

from ..structure.discovered import DiscoveredParticipantData
from ..structure.guid import Guid, GuidPrefix
from ..structure.locator import Locator, LocatorKind
from ..structure.vendor import VendorId

__all__ = ["ParticipantProxy"]

_MAX_HOSTS = 8
_LONGEST_LEASE_WITHOUT_ENDPOINTS = 100.0  # what a participant that names no lease has (RTPS 2.5 §8.5.3.2.1)


class ParticipantProxy:
    """``last_heard``: engine time of the last datagram from it, which is all that a lease needs.

    ``last_manual_assertion``: when it last said that its manual writers live; ``last_protected_assertion``: on the
    secure topic.  ``last_proof``: when it last said anything there, where nobody else can.

    ``announcement``: vendor, version and octets that ``data`` was read from, if they say all of it; the same again need
    not be read.
    """

    __slots__ = (
        "_endpoint_hosts",
        "_hosts",
        "announcement",
        "data",
        "endpoint_count",
        "guid",
        "has_lost_liveliness",
        "is_admitted",
        "last_heard",
        "last_manual_assertion",
        "last_proof",
        "last_protected_assertion",
        "prefix",
        "refusal",
    )

    def __init__(self, data: DiscoveredParticipantData, now: float) -> None:
        self.data = data
        self.announcement: tuple[bytes, tuple[int, int], bytes] | None = None
        self.guid: Guid = data.guid
        self.prefix: GuidPrefix = data.guid.prefix
        self.last_heard = now
        self.last_manual_assertion = now
        self.last_protected_assertion = now
        self.last_proof = now
        self.is_admitted = False
        self.refusal = ""  # why security refuses it, if it does
        self.has_lost_liveliness = False
        self.endpoint_count = 0
        self._hosts: dict[bytes, None] = {}  # that it spoke from
        self._endpoint_hosts: dict[bytes, None] = {}  # that its endpoints announced

    def __repr__(self) -> str:
        return f"<ParticipantProxy {self.prefix}>"

    @property
    def hosts(self) -> list[str]:
        """The addresses that it spoke from, as text."""
        return [Locator(LocatorKind.UDPV4, 0, address).host for address in self._hosts]

    @property
    def vendor_id(self) -> VendorId:
        return self.data.vendor_id

    @property
    def lease_due(self) -> float:
        """When it counts as gone unless something is heard of it.

        Who has announced no endpoint may be a forged announcement, that makes us send to a victim; so it is not
        believed for ever, whatever its lease.
        """
        lease = self.data.lease_duration
        if not self.endpoint_count:
            lease = min(lease, _LONGEST_LEASE_WITHOUT_ENDPOINTS)
        return self.last_heard + lease

    def heard_from(self, source: Locator) -> bool:
        """A datagram came from there; returns whether that is news: a host that it can now be reached at.

        Anybody can put this participant's prefix into a datagram.  So hosts that nobody announced give way to each
        other, and never does one that was announced: that must not make us forget where it lives.
        """
        if source.address in self._hosts:
            return False
        announced = {locator.address for locator in (*self.data.metatraffic_unicast, *self.data.default_unicast)}
        announced.update(self._endpoint_hosts)
        if len(self._hosts) >= _MAX_HOSTS:
            unannounced = next((host for host in self._hosts if host not in announced), None)
            if unannounced is None:
                return False
            del self._hosts[unannounced]
        self._hosts[source.address] = None
        return source.address in announced

    def endpoint_announced(self, unicast: tuple[Locator, ...]) -> None:
        """One of its endpoints is to be reached there, which may be where the participant itself is not."""
        for locator in unicast:
            if len(self._endpoint_hosts) < _MAX_HOSTS:
                self._endpoint_hosts[locator.address] = None

    def reachable(self, locators: tuple[Locator, ...]) -> tuple[Locator, ...]:
        """The first of the unicast locators that lies on a host which this participant spoke from, or none."""
        for locator in locators:
            if locator.address in self._hosts and locator.kind in (LocatorKind.UDPV4, LocatorKind.UDPV6):
                return (locator,)
        return ()

    @property
    def metatraffic(self) -> tuple[Locator, ...]:
        """Where builtin topics go."""
        return self.reachable(self.data.metatraffic_unicast or self.data.default_unicast)

    def user_traffic(self, endpoint_unicast: tuple[Locator, ...]) -> tuple[Locator, ...]:
        """Where an endpoint's data goes: its own locators, else the participant's default ones."""
        return self.reachable(endpoint_unicast or self.data.default_unicast or self.data.metatraffic_unicast)
