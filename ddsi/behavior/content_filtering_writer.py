"""ContentFilteringWriter: a writer that spares its readers what their content filters would drop.

RTPS 2.5 §8.4.7.5 (DDS_FILTER), §8.7.3 (Content-filtered topics); the mechanism is that of :mod:`.filtered`.  A sample
that some readers do not want goes to each of the others alone, behind the GAP that explains the numbers between.

What a reader is not sent costs it nothing, not even a question: it counts as acknowledged as soon as the reader has
acknowledged all that it was sent.  So for a reader with a filter

- all between ``lst_seq`` and ``next_unsent_sn`` is not for it;
- HEARTBEATs are directed and speak of its numbers, up to ``lst_seq``;
- once ``acked_sn`` has reached ``lst_seq`` it follows ``next_unsent_sn``.

Readers without a filter are served as by a StatefulWriter, and so is everybody while nobody has one.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from typing import Unpack

from ..structure.cache_change import CacheChange
from ..structure.discovered import DiscoveredReaderData
from ..structure.guid import Guid
from ..structure.locator import Locator
from ..structure.qos import EndpointQos
from .content_filter import ContentFilter
from .filtered import directed_heartbeat_range, gap_before
from .reader_proxy import ReaderProxy
from .stateful_writer import StatefulWriter, WriterSettings
from .transmissions import SendData, SendFragments, SendHeartbeat, SendHeartbeatFrag, WriterTransmission

__all__ = ["ContentFilteringWriter"]


class ContentFilteringWriter(StatefulWriter):
    """Other name: a writer that filters (writer-side filtering)."""

    def __init__(self, guid: Guid, qos: EndpointQos, **settings: Unpack[WriterSettings]) -> None:
        super().__init__(guid, qos, **settings)
        # The readers of other participants whose filter this writer evaluates.
        self._filtering: dict[Guid, ReaderProxy] = {}

    @property
    def filtering_readers(self) -> list[ReaderProxy]:
        """The readers whose filter is evaluated here."""
        return list(self._filtering.values())

    # --- matching ----------------------------------------------------------------------------------------

    def matched_reader_add(
        self,
        data: DiscoveredReaderData,
        locators: tuple[Locator, ...],
        now: float,
        content_filter: ContentFilter | None = None,
    ) -> list[WriterTransmission]:
        out = super().matched_reader_add(data, locators, now, content_filter)
        if content_filter is not None:
            self._filtering[data.guid] = self.readers[data.guid]
        return out

    def content_filter_changed(self, guid: Guid, content_filter: ContentFilter | None) -> None:
        """A reader lets something else pass from now on.  What it was not sent until now it will not be sent."""
        proxy = self.readers[guid]
        if proxy.content_filter is None:
            proxy.lst_seq = self.next_unsent_sn - 1
        proxy.content_filter = content_filter
        if content_filter is None:
            self._filtering.pop(guid, None)
        else:
            self._filtering[guid] = proxy

    def _proxy_added(self, proxy: ReaderProxy) -> None:
        """A late joiner that is to have history is told of all of it, and what it does not want, when it asks."""
        if proxy.content_filter is not None:
            proxy.lst_seq = self.next_unsent_sn - 1

    def _forget_reader(self, guid: Guid) -> ReaderProxy | None:
        self._filtering.pop(guid, None)
        return super()._forget_reader(guid)

    # --- what is new -------------------------------------------------------------------------------------

    def sends_directly(self, change: CacheChange) -> bool:
        return not self._filtering and super().sends_directly(change)

    def _transmit(self, change: CacheChange, now: float) -> list[WriterTransmission]:
        if not self._filtering:
            return super()._transmit(change, now)
        wanting = [proxy for proxy in self.readers.values() if proxy.is_relevant(change)]
        if not wanting:
            self._advance_unsent()
            return []
        if self._window_is_full() or self._pace_due != math.inf:
            return []
        gaps = self._gaps_before(change, wanting)
        in_flight_octets = self._in_flight_octets
        transmissions = super()._transmit(change, now)
        if len(wanting) < len(self.readers):
            transmissions = _to_each(wanting, transmissions)
        return [*gaps, *transmissions, *self._asking_heartbeats(in_flight_octets)]

    def _gaps_before(self, change: CacheChange, wanting: Sequence[ReaderProxy]) -> list[WriterTransmission]:
        """What the readers that get this change were not sent before it; it counts as sent to them from now on."""
        gaps: list[WriterTransmission] = []
        for proxy in wanting:
            if proxy.content_filter is not None:
                gap = gap_before(proxy, change) if self.is_reliable and proxy.is_reliable else None
                if gap is not None:
                    gaps.append(gap)
                proxy.lst_seq = max(proxy.lst_seq, change.sequence_number)
        return gaps

    def _asking_heartbeats(self, in_flight_before: int) -> list[WriterTransmission]:
        """When half the window has got under way, and when all of it has: nothing rides behind the samples here."""
        octets, half = self._in_flight_octets, self.window.octets / 2
        if in_flight_before < half <= octets or (octets > in_flight_before and self._window_is_full()):
            return self._heartbeats_for(self._lagging_readers())
        return []

    def _advance_unsent(self) -> None:
        super()._advance_unsent()
        if self._filtering:
            self._pass_over()

    def _pass_over(self) -> None:
        """Whoever has all that he was sent has no use for what he was not sent."""
        passed_sn = self.next_unsent_sn - 1
        for proxy in self._filtering.values():
            if proxy.is_reliable and proxy.lst_seq <= proxy.acked_sn < passed_sn:
                self._discount(proxy)
                proxy.acked_changes_set(passed_sn)
                self._count(proxy)
        self.cache.acknowledged_up_to(self.min_acked_sn())
        self._drain_in_flight()

    # --- heartbeats, acknowledgments ---------------------------------------------------------------------

    def piggyback_heartbeat(self) -> SendHeartbeat | None:
        return super().piggyback_heartbeat() if not self._filtering else None

    def assert_liveliness(self) -> list[SendHeartbeat]:
        if not self._filtering:
            return super().assert_liveliness()
        reliable = [proxy for proxy in self.readers.values() if self.is_reliable and proxy.is_reliable]
        return [replace(self.directed_heartbeat(proxy), liveliness=True) for proxy in reliable]

    def directed_heartbeat(self, proxy: ReaderProxy) -> SendHeartbeat:
        if proxy.content_filter is None:
            return super().directed_heartbeat(proxy)
        first, last = directed_heartbeat_range(self.cache, proxy, proxy.lst_seq)
        self._heartbeat_count += 1
        return SendHeartbeat(first, last, self._heartbeat_count, proxy.acked_sn >= last, (proxy,))

    def _heartbeats_for(self, lagging: list[ReaderProxy]) -> list[WriterTransmission]:
        if not self._filtering:
            return super()._heartbeats_for(lagging)
        return [self.directed_heartbeat(proxy) for proxy in lagging]

    def _committed_sn(self, proxy: ReaderProxy, acknowledged_sn: int) -> int:
        if proxy.content_filter is not None and acknowledged_sn >= proxy.lst_seq:
            return max(acknowledged_sn, self.next_unsent_sn - 1)
        return super()._committed_sn(proxy, acknowledged_sn)

    def _gap_end(self, proxy: ReaderProxy) -> int:
        return proxy.lst_seq + 1 if proxy.content_filter is not None else super()._gap_end(proxy)


def _to_each(readers: Sequence[ReaderProxy], transmissions: Sequence[WriterTransmission]) -> list[WriterTransmission]:
    """What was meant for everybody, to these alone.  A HEARTBEAT_FRAG can be spared: it only makes repair earlier."""
    out: list[WriterTransmission] = []
    for item in transmissions:
        match item:
            case SendData(change, None):
                out.extend(SendData(change, reader) for reader in readers)
            case SendFragments(change, first, last, None):
                out.extend(SendFragments(change, first, last, reader) for reader in readers)
            case SendHeartbeatFrag():
                pass
            case _:
                out.append(item)
    return out
