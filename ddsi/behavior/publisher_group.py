"""PublisherGroup: numbers and groups the changes of all writers of one publisher.

DDS 1.4 §2.2.3.6 (PRESENTATION), §2.2.2.4.1.10-11 (begin_coherent_changes, end_coherent_changes); RTPS 2.5 §8.7.5 (Group
Ordered Access), §8.7.6 (Coherent Sets).

What goes with a change depends on what its writer offers.  With coherent access, a change within a set says where its
writer's part of the set begins, and where a writer that wrote in the set ends its part it says so at once, by a change
without a sample: the set need not wait for the next one to become visible.  With access scope GROUP every change has a
number of the publisher's as well, and every writer ends every set, also those that it had nothing to write in:
only that tells a subscriber that nothing of it is still under way.

It counts; it writes nothing itself, and knows no reader.
"""

from __future__ import annotations

from hashlib import md5

from ..structure.coherence import Coherence
from ..structure.guid import EntityId, Guid
from ..structure.qos_policies import AccessScope, Presentation

__all__ = ["PublisherGroup", "group_digest"]


class PublisherGroup:
    """``group_sn``: the number of the last change that counts in the publisher.  Sets may be nested: only the outermost
    matters."""

    def __init__(self, entity_id: EntityId) -> None:
        self.entity_id = entity_id
        self.group_sn = 0
        self.writer_set = bytes(4)
        self._writers: dict[Guid, Presentation] = {}
        self._depth = 0
        self._group_set_sn = 0
        # The number of the first change of each writer that has written in the open set.
        self._set_sns: dict[Guid, int] = {}
        self._last_group_sns: dict[Guid, int] = {}

    def __repr__(self) -> str:
        is_open = f", set open since {self._group_set_sn}" if self.is_open else ""
        return f"<PublisherGroup {self.entity_id}, {len(self._writers)} writers, at {self.group_sn}{is_open}>"

    # --- who belongs to it -------------------------------------------------------------------------------

    def writer_added(self, writer: Guid, presentation: Presentation) -> None:
        self._writers[writer] = presentation
        self.writer_set = group_digest(self._writers)

    @property
    def writers(self) -> tuple[Guid, ...]:
        return tuple(self._writers)

    def is_numbered(self, writer: Guid) -> bool:
        """Do its changes bear numbers of the publisher's?"""
        return self._counts(self._writers[writer])

    @staticmethod
    def _counts(presentation: Presentation) -> bool:
        is_grouped = presentation.access_scope is AccessScope.GROUP
        return is_grouped and (presentation.coherent_access or presentation.ordered_access)

    def writer_removed(self, writer: Guid) -> None:
        """What it wrote in an open set stays without an end, and is never seen."""
        self._writers.pop(writer, None)
        self._set_sns.pop(writer, None)
        self._last_group_sns.pop(writer, None)
        self.writer_set = group_digest(self._writers)

    def last_of(self, writer: Guid) -> int:
        """The group number of what this writer wrote last; 0: it has written nothing."""
        return self._last_group_sns.get(writer, 0)

    # --- sets --------------------------------------------------------------------------------------------

    @property
    def is_open(self) -> bool:
        """Do changes that are written now belong to a coherent set?"""
        return self._depth > 0

    def begin_coherent_changes(self) -> None:
        self._depth += 1

    def end_coherent_changes(self) -> dict[Guid, Coherence]:
        """The ends to be written: by writer, those that end the outermost set; none while it goes on.

        Ask :attr:`is_open` before.
        """
        assert self._depth
        self._depth -= 1
        if self._depth:
            return {}
        set_sns, self._set_sns = self._set_sns, {}
        group_set_sn, self._group_set_sn = self._group_set_sn, 0
        if group_set_sn:
            self.group_sn += 1  # one number for all ends, as they are one event
        ends: dict[Guid, Coherence] = {}
        for writer, presentation in self._writers.items():
            if not presentation.coherent_access:
                continue
            if group_set_sn and presentation.access_scope is AccessScope.GROUP:
                self._last_group_sns[writer] = self.group_sn
                ends[writer] = Coherence(
                    set_sns.get(writer, 0), self.group_sn, group_set_sn, is_end=True, writer_set=self.writer_set
                )
            elif writer in set_sns:
                ends[writer] = Coherence(set_sns[writer], is_end=True)
        return ends

    def next_place(self, writer: Guid, number: int) -> Coherence | None:
        """What goes with the change that ``writer`` is about to write under this number; it counts as written."""
        presentation = self._writers[writer]
        is_coherent = presentation.coherent_access and self.is_open
        is_of_group = self._counts(presentation)
        if not is_coherent and not is_of_group:
            return None
        if is_of_group:
            self.group_sn += 1
            self._last_group_sns[writer] = self.group_sn
        if is_coherent:
            self._set_sns.setdefault(writer, number)
            if is_of_group and not self._group_set_sn:
                self._group_set_sn = self.group_sn
        return Coherence(
            set_sn=self._set_sns[writer] if is_coherent else 0,
            group_sn=self.group_sn if is_of_group else 0,
            group_set_sn=self._group_set_sn if is_coherent and is_of_group else 0,
        )


def group_digest(writers: dict[Guid, Presentation]) -> bytes:
    """GroupDigest_t: of the entity ids, ascending, as a big-endian CDR sequence, the first four octets of the MD5.

    RTPS 2.5 §9.4.2.10 (GroupDigest).  Four zeros for nobody.
    """
    if not writers:
        return bytes(4)
    ids = sorted(bytes(writer[12:]) for writer in writers)
    return md5(len(ids).to_bytes(4, "big") + b"".join(ids), usedforsecurity=False).digest()[:4]
