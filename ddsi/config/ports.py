"""Which UDP ports belong to which domain and participant.  RTPS 2.5 §9.6.2 (Port number expressions).

The expressions say where to *look* for a participant that has not been heard yet.  Where a participant then
really listens, it announces; a peer may have taken any port.
"""

from __future__ import annotations

from dataclasses import fields

from ddsi.structure.errors import ConfigurationError

from ..structure.dataclass import dataclass
from .refusal import RefusedSetting

__all__ = ["HIGHEST_PORT", "PortMapping"]

HIGHEST_PORT = 65535


@dataclass(frozen=True, slots=True, kw_only=True)
class PortMapping:
    """The numbers in the port expressions; the defaults are the specification's, which all vendors share.

    Whoever changes one must change it for every participant that is to be met.  Letters: RTPS 2.5 §9.6.2.3.
    """

    base: int = 7400  # PB
    domain_gain: int = 250  # DG
    participant_gain: int = 2  # PG
    multicast_metatraffic_offset: int = 0  # d0
    unicast_metatraffic_offset: int = 10  # d1
    multicast_user_offset: int = 1  # d2
    unicast_user_offset: int = 11  # d3

    def __post_init__(self) -> None:
        for item in fields(self):
            value = getattr(self, item.name)
            if not isinstance(value, int) or isinstance(value, bool) or not 0 <= value <= HIGHEST_PORT:
                raise RefusedSetting(f"ports.{item.name}", value, f"a whole number from 0 to {HIGHEST_PORT}")
        if self.base < 1:
            raise RefusedSetting("ports.base", self.base, "at least 1, as port 0 means any port")

    def metatraffic_multicast(self, domain_id: int) -> int:
        """The port on which everybody in the domain hears SPDP."""
        return self._port(domain_id, self.multicast_metatraffic_offset, "multicast_metatraffic_offset")

    def user_multicast(self, domain_id: int) -> int:
        return self._port(domain_id, self.multicast_user_offset, "multicast_user_offset")

    def metatraffic_unicast(self, domain_id: int, participant_index: int) -> int:
        """The port on which the participant of this index on a host hears discovery."""
        return self._port(domain_id, self.unicast_metatraffic_offset, "unicast_metatraffic_offset", participant_index)

    def user_unicast(self, domain_id: int, participant_index: int) -> int:
        return self._port(domain_id, self.unicast_user_offset, "unicast_user_offset", participant_index)

    def _port(self, domain_id: int, offset: int, offset_name: str, participant_index: int = 0) -> int:
        port = self.base + self.domain_gain * domain_id + offset + self.participant_gain * participant_index
        if not 1 <= port <= HIGHEST_PORT:
            raise ConfigurationError(
                f"domain {domain_id} with participant index {participant_index} needs port {port}, "
                f"beyond {HIGHEST_PORT} "
                f"(ports.base {self.base}, domain_gain {self.domain_gain}, {offset_name} {offset}); "
                "choose a lower domain id or participant index, or other port numbers on every participant"
            )
        return port
