"""What the suite finds of one program in one case: its codes, under its names."""

from __future__ import annotations

from enum import Enum, auto

__all__ = ["Code"]


class Code(Enum):
    """How far a program came, or how it received."""

    OK = auto()
    TOPIC_NOT_CREATED = auto()
    READER_NOT_CREATED = auto()
    WRITER_NOT_CREATED = auto()
    FILTER_NOT_CREATED = auto()
    INCOMPATIBLE_QOS = auto()
    READER_NOT_MATCHED = auto()
    DATA_NOT_RECEIVED = auto()
    DATA_NOT_SENT = auto()
    DATA_NOT_CORRECT = auto()
    RECEIVING_FROM_ONE = auto()
    RECEIVING_FROM_BOTH = auto()
    DEADLINE_MISSED = auto()
    ORDERED_ACCESS_INSTANCE = auto()
    ORDERED_ACCESS_TOPIC = auto()
    PUB_UNSUPPORTED_FEATURE = auto()
    SUB_UNSUPPORTED_FEATURE = auto()
