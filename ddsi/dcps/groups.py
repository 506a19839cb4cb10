"""Publisher and Subscriber: groups of writers and of readers that share a partition, presentation and group data.

DDS 1.4 §2.2.2.4.1 (Publisher), §2.2.2.5.2 (Subscriber).  A participant may stand in their place.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from ..structure.qos import Qos
from .entity import Entity

if TYPE_CHECKING:
    from .participant import DomainParticipant

__all__ = ["Publisher", "Subscriber"]


class _Group(Entity):
    def __init__(self, participant: DomainParticipant, qos: Qos | None = None) -> None:
        super().__init__(qos)
        participant._check_open()
        self._participant = participant
        self._members: list[Entity] = []
        participant._adopt(self)

    @property
    def participant(self) -> DomainParticipant:
        return self._participant

    def _adopt(self, entity: Entity) -> None:
        self._members.append(entity)

    def _on_close(self) -> None:
        for entity in self._members:
            entity.close()


class Publisher(_Group):
    """The writers created with it have its policies wherever they do not set their own."""


class Subscriber(_Group):
    """The readers created with it have its policies wherever they do not set their own."""
