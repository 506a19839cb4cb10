"""Which types need each other: strongly connected components, by Tarjan's algorithm (SIAM J. Comput. 1, 1972)."""

from __future__ import annotations

from collections.abc import Callable, Hashable, Iterator, Sequence
from typing import TypeVar

__all__ = ["strongly_connected"]

_N = TypeVar("_N", bound=Hashable)


def strongly_connected(root: _N, needed: Callable[[_N], Sequence[_N]]) -> tuple[list[_N], list[list[_N]]]:
    """All nodes in the order in which they are met from ``root``, and the components, each after those it needs."""
    index: dict[_N, int] = {root: 0}  # in the order of meeting
    lowest: dict[_N, int] = {root: 0}  # the lowest index that is reached from the node, inside its component
    open_: list[_N] = [root]  # met, and not yet put into a component
    is_open = {root}
    components: list[list[_N]] = []
    path: list[tuple[_N, Iterator[_N]]] = [(root, iter(needed(root)))]
    while path:  # by hand, as types may nest deeper than Python calls do
        node, rest = path[-1]
        following = next(rest, None)
        if following is None:
            path.pop()
            if path:
                before = path[-1][0]
                lowest[before] = min(lowest[before], lowest[node])
            if lowest[node] == index[node]:
                at = open_.index(node)
                components.append(open_[at:])
                is_open.difference_update(open_[at:])
                del open_[at:]
        elif following not in index:
            index[following] = lowest[following] = len(index)
            open_.append(following)
            is_open.add(following)
            path.append((following, iter(needed(following))))
        elif following in is_open:
            lowest[node] = min(lowest[node], index[following])
    return list(index), components
