"""SampleInfo: what comes with every sample that a reader hands out.  DDS 1.4 §2.2.2.5.5 (SampleInfo class)."""

from __future__ import annotations

from enum import IntFlag
from typing import TYPE_CHECKING

from .errors import BadParameter
from .guid import Guid
from .time import TICKS_PER_SECOND, Time

if TYPE_CHECKING:
    from .cache_change import CacheChange

__all__ = [
    "ANY_INSTANCE_STATE",
    "ANY_SAMPLE_STATE",
    "ANY_VIEW_STATE",
    "InstanceState",
    "SampleInfo",
    "SampleState",
    "ViewState",
    "check_states",
]


class _State(IntFlag):
    """A mask that is printed by its names, as ``ALIVE``; as a number it would tell nobody anything."""

    def __str__(self) -> str:
        return self.name or "none"

    def __format__(self, specification: str) -> str:
        return format(str(self), specification)


class SampleState(_State):
    """Was this sample read before?"""

    READ = 1
    NOT_READ = 2


class ViewState(_State):
    """Is this the first access to the instance since it became alive?"""

    NEW = 1
    NOT_NEW = 2


class InstanceState(_State):
    ALIVE = 1
    NOT_ALIVE_DISPOSED = 2
    NOT_ALIVE_NO_WRITERS = 4
    NOT_ALIVE = 6


ANY_SAMPLE_STATE = SampleState.READ | SampleState.NOT_READ
ANY_VIEW_STATE = ViewState.NEW | ViewState.NOT_NEW
ANY_INSTANCE_STATE = InstanceState.ALIVE | InstanceState.NOT_ALIVE


class SampleInfo:
    """All of it is read-only to applications; a fresh object for each sample that is handed out.

    ``instance_handle``: the instance's key in canonical form (octets; empty for a keyless topic).
    ``publication_handle``: the Guid of the writer.  ``valid_data`` is False for a dispose or unregister: then only
    the key fields of the data mean anything.
    """

    __slots__ = (
        "_change",
        "_reception_seconds",
        "absolute_generation_rank",
        "arrival",
        "disposed_generation_count",
        "generation_rank",
        "instance_handle",
        "instance_state",
        "no_writers_generation_count",
        "publication_handle",
        "sample_rank",
        "sample_state",
        "source_ticks",
        "valid_data",
        "view_state",
    )

    def __init__(self, change: CacheChange, reception_seconds: float, *, valid_data: bool) -> None:
        self._change: CacheChange | None = change
        self._reception_seconds = reception_seconds
        self.source_ticks = change.source_timestamp
        self.publication_handle: Guid = change.writer_guid
        self.instance_handle: bytes = change.key
        self.valid_data = valid_data
        self.sample_state = SampleState.NOT_READ
        self.view_state = ViewState.NEW
        self.instance_state = InstanceState.ALIVE
        self.disposed_generation_count = 0
        self.no_writers_generation_count = 0
        self.sample_rank = 0
        self.arrival = 0  # its place among the samples of all readers of a subscriber with group order
        self.generation_rank = 0
        self.absolute_generation_rank = 0

    @property
    def change(self) -> CacheChange | None:
        """For readers: the octets, while they are in the cache."""
        return self._change

    @property
    def source_timestamp(self) -> Time:
        """When the writer wrote it, by the writer's clock; the time of reception where the writer did not say."""
        return Time(self.source_ticks)

    @property
    def reception_timestamp(self) -> Time:
        """When it was received, by the local wall clock."""
        return Time(int(self._reception_seconds * TICKS_PER_SECOND))

    def __repr__(self) -> str:
        valid = "" if self.valid_data else ", no data"
        return (
            f"<SampleInfo {self.sample_state.name} {self.view_state.name} {self.instance_state.name}{valid} "
            f"from {self.publication_handle}>"
        )


def check_states(sample_states: object, view_states: object, instance_states: object) -> None:
    """Are these masks?  Raises BadParameter."""
    for kind, states in ((SampleState, sample_states), (ViewState, view_states), (InstanceState, instance_states)):
        if not isinstance(states, int):
            names = ", ".join(f"ddsi.{kind.__name__}.{state.name}" for state in kind)
            raise BadParameter(f"states are {names}, or several of them with | between, not {states!r}")
