"""InstanceOrder: the instances of a reader in the order of their handles.  DDS 1.4 §2.2.2.5.3.16 (read_next_instance).

The specification asks for some order that every instance has a place in, known or not, so that "the next one" can be
told of an instance that is gone by now.  Handles are keys, so theirs serves.
"""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Container, Iterable, Iterator

__all__ = ["InstanceOrder"]


class InstanceOrder:
    """Of the keys that ``known`` contains.  Those that it has lost are left out, and dropped when they are met."""

    __slots__ = ("_keys", "_known")

    def __init__(self, known: Container[bytes], keys: Iterable[bytes]) -> None:
        self._known = known
        self._keys = sorted(keys)

    def add(self, key: bytes) -> None:
        """``known`` contains it from now on; it may have done so before."""
        place = bisect_right(self._keys, key)
        if not place or self._keys[place - 1] != key:
            self._keys.insert(place, key)

    def after(self, previous: bytes | None) -> Iterator[bytes]:
        """Those behind ``previous``; None: all."""
        place = bisect_right(self._keys, previous) if previous is not None else 0
        while place < len(self._keys):
            key = self._keys[place]
            if key in self._known:
                yield key
                place += 1
            else:
                del self._keys[place]
