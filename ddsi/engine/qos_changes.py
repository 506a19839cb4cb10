"""QosChanges: policies of entities that live already.  DDS 1.4 §2.2.2.1.1.3 (set_qos), §2.2.3 (changeable).

A change is checked as a whole before anything of it is done: what is fixed stays, and security is asked whether the
endpoint may be what it is to become (a partition may be forbidden).  Then peers are told by SEDP or SPDP, each pair is
judged again as if one of the two had just appeared, and timers follow.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace
from typing import TYPE_CHECKING

from ..structure.qos import EndpointQos
from ..structure.qos_changes import check_changeable
from .local_endpoints import LocalReader, LocalWriter

if TYPE_CHECKING:
    from .participant import Participant

__all__ = ["QosChanges"]


class QosChanges:
    """For the application's endpoints, and for the participant itself."""

    def __init__(self, engine: Participant) -> None:
        self._engine = engine

    def check(self, endpoint: LocalWriter | LocalReader, qos: EndpointQos) -> None:
        """May the endpoint have these policies from now on?  Raises ImmutablePolicy, NotAllowedBySecurity."""
        data = endpoint.data
        check_changeable(data.qos, qos, f"{endpoint.KIND} of {data.topic_name!r}")
        self._engine.hooks.local_endpoint_changed(replace(data, qos=qos))

    def change_writer(self, writer: LocalWriter, qos: EndpointQos, now: float, instances: Iterable[bytes] = ()) -> None:
        """``instances``: those that it has registered, of which a DEADLINE may now be expected.

        Raises ImmutablePolicy, NotAllowedBySecurity; then nothing has changed.
        """
        if qos == writer.data.qos:
            return
        self.check(writer, qos)
        engine = self._engine
        engine.now = now
        writer.data = replace(writer.data, qos=qos)
        writer.behavior.qos_changed(qos, instances, now)
        engine.discovery.announce_writer(writer, now)
        engine.matchmaker.writer_appeared(writer, now)
        engine.writer_answers(writer, ())

    def change_reader(self, reader: LocalReader, qos: EndpointQos, now: float) -> None:
        """Raises ImmutablePolicy, NotAllowedBySecurity; then nothing has changed."""
        if qos == reader.data.qos:
            return
        self.check(reader, qos)
        engine = self._engine
        engine.now = now
        reader.data = replace(reader.data, qos=qos)
        reader.behavior.qos = qos
        if reader.history is not None:
            reader.history.qos_changed(qos, now)
        engine.discovery.announce_reader(reader, now)
        engine.matchmaker.reader_appeared(reader, now)

    def change_user_data(self, user_data: bytes, now: float) -> None:
        """What the participant itself has to say to others."""
        engine = self._engine
        engine.now = now
        if user_data != engine.discovery.data.user_data:
            engine.discovery.announce_change(replace(engine.discovery.data, user_data=user_data), now)
