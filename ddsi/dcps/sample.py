"""Sample: data and info, as a reader hands them out.  DDS 1.4 §2.2.2.5.4 (Sample)."""

from __future__ import annotations

from typing import Generic, TypeVar

from ..structure.sample_info import SampleInfo

__all__ = ["Sample"]

T = TypeVar("T")


class Sample(Generic[T]):
    """``data``: an object of the topic's type; ``info``: where it came from and what state its instance is in.

    When ``info.valid_data`` is False, an instance came to its end: ``data`` then holds its key fields, and the
    type's defaults elsewhere.
    """

    __slots__ = ("data", "info")

    def __init__(self, data: T, info: SampleInfo) -> None:
        self.data = data
        self.info = info

    def __repr__(self) -> str:
        return f"Sample({self.data!r}, {self.info!r})"
