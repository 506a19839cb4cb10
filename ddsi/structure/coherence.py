"""Coherence: which coherent set a change belongs to, and its place in the order of its publisher.

DDS 1.4 §2.2.3.6 (PRESENTATION), RTPS 2.5 §8.7.5 (Group Ordered Access), §8.7.6 (Coherent Sets), §9.6.4.
"""

from __future__ import annotations

from .dataclass import dataclass

__all__ = ["SEQUENCE_NUMBER_UNKNOWN", "Coherence"]

SEQUENCE_NUMBER_UNKNOWN = -1 << 32
"""SEQUENCENUMBER_UNKNOWN: high -1, low 0.  RTPS 2.5 §9.3.2."""


@dataclass(frozen=True, slots=True)
class Coherence:
    """What a change's inline QoS says of it; 0 stands for what is not said.

    ``set_sn``: the number of the first change that this writer wrote in the set (PID_COHERENT_SET).
    ``group_sn``: its number among the changes of all writers of its publisher (PID_GROUP_SEQ_NUM).
    ``group_set_sn``: the group number of the first change of the set, whoever wrote it (PID_GROUP_COHERENT_SET).
    ``is_end``: this is no sample; it says that its writer has written all that it had to write in the set.
    ``writer_set``: the digest of the publisher's writers, on an end (PID_WRITER_GROUP_INFO).
    """

    set_sn: int = 0
    group_sn: int = 0
    group_set_sn: int = 0
    is_end: bool = False
    writer_set: bytes = b""
