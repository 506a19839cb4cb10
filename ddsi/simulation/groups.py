"""NodePublisher and NodeSubscriber: the groups that simulated endpoints may belong to, for sets and group order.

What ``ddsi.Publisher`` and ``ddsi.Subscriber`` do with the engine, without the application's checks.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from .node import Node

__all__ = ["NodePublisher", "NodeSubscriber"]


class NodePublisher:
    """Given to ``Node.writer``."""

    def __init__(self, node: Node) -> None:
        self.node = node
        self.group = node.engine.presentation.new_publisher()

    @contextmanager
    def coherent_changes(self, *, is_complete: bool = True) -> Iterator[None]:
        """What is written in the body is one set; withdrawn if it is not to be complete."""
        self.group.begin_coherent_changes()
        yield
        self.node.engine.presentation.end_coherent_changes(self.group, self.node.now, is_complete=is_complete)
        self.node.pump()


class NodeSubscriber:
    """Given to ``Node.reader``."""

    def __init__(self, node: Node) -> None:
        self.node = node
        self.group = node.engine.presentation.new_subscriber()

    @contextmanager
    def access(self) -> Iterator[None]:
        """Nothing becomes visible while the body runs."""
        self.group.begin_access()
        yield
        self.group.end_access()
        self.node.engine.presentation.release(self.group, self.node.now)
        self.node.pump()
