"""Domain: a network with participants on it, and the questions that scenarios and tests ask about all of them."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence

from ..config import Config
from ..discovery.matching import judge
from ..spi import SecurityHooks
from ..structure.qos_policies import Properties
from ..trace.sink import TraceSink
from .dice import Dice
from .endpoints import NodeReader, NodeWriter
from .link import GOOD_WEATHER, LinkConditions
from .network import Network
from .node import Node, NodeSetup
from .vendors import Vendor

__all__ = ["Domain"]


class Domain:
    """Everything that happens in it follows from ``seed`` and from what is called::

    domain = Domain(seed=7, conditions=LinkConditions(loss=0.2))
    writer = domain.node().writer("Square", Qos(history=KeepAll()))
    reader = domain.node().reader("Square", Qos(reliability=Reliable(), history=KeepAll()))
    domain.run(3)
    writer.write()
    domain.run_until(lambda: len(reader.taken) == 1, 5)

    Participants play the ``vendors`` by turns, None for ours, unless they are told otherwise.
    """

    def __init__(
        self,
        seed: int = 0,
        *,
        conditions: LinkConditions = GOOD_WEATHER,
        vendors: Sequence[Vendor | None] = (None,),
        trace: TraceSink | None = None,
    ) -> None:
        self.seed = seed
        self.dice = Dice(seed)
        self.network = Network(self.dice.fork(), conditions, trace=trace)
        self.nodes: list[Node] = []
        self._trace = trace
        self._vendors = tuple(vendors)
        self._indices: dict[str, int] = {}

    def __repr__(self) -> str:
        return f"<Domain seed {self.seed}, {len(self.nodes)} nodes, {self.now:.3f} s>"

    @property
    def now(self) -> float:
        return self.network.now

    def node(
        self,
        *,
        name: str = "",
        address: str = "",
        domain_id: int = 0,
        config: Config | None = None,
        multicast: bool = True,
        peers: tuple[str, ...] = (),
        max_message_octets: int = 1452,
        clock_error: float = 0.0,
        properties: Properties | None = None,
        make_hooks: Callable[[], SecurityHooks] | None = None,
        vendor: Vendor | None = None,
    ) -> Node:
        """A participant, on a host of its own unless it is given the ``address`` of another's; ours, or one that plays
        a ``vendor``'s."""
        number = len(self.nodes)
        address = address or f"10.0.{number // 250}.{number % 250 + 1}"
        index = self._indices.get(address, 0)
        self._indices[address] = index + 1
        setup = NodeSetup(
            name=name or _letters(number),
            address=address,
            domain_id=domain_id,
            participant_index=index,
            config=config or Config(),
            multicast=multicast,
            peers=peers,
            max_message_octets=max_message_octets,
            clock_error=clock_error,
            properties=properties or {},
            make_hooks=make_hooks,
            vendor=vendor or self._vendors[number % len(self._vendors)],
        )
        node = Node(setup, self.network, self.dice.fork(), self._trace)
        self.nodes.append(node)
        return node

    # --- time --------------------------------------------------------------------------------------------

    def run(self, seconds: float) -> None:
        """Let so much time pass."""
        self.network.run_until(self.now + seconds)

    def run_until(self, condition: Callable[[], bool], timeout: float) -> bool:
        """Let time pass until the condition holds, ``timeout`` seconds at most; returns whether it does."""
        return self.network.run_until(self.now + timeout, condition)

    # --- what there is -----------------------------------------------------------------------------------

    def live_nodes(self) -> list[Node]:
        return [node for node in self.nodes if node.is_up]

    def writers(self) -> list[NodeWriter]:
        return [writer for node in self.live_nodes() for writer in node.live_writers()]

    def readers(self) -> list[NodeReader]:
        return [reader for node in self.live_nodes() for reader in node.live_readers()]

    def fitting_pairs(self) -> Iterator[tuple[NodeWriter, NodeReader]]:
        """Every writer with every reader that it ought to be matched with."""
        for writer in self.writers():
            for reader in self.readers():
                if (
                    writer.topic == reader.topic
                    and writer.node.setup.meets(reader.node.setup)
                    and judge(writer.local.data, reader.local.data) is None
                ):
                    yield writer, reader

    def are_introduced(self) -> bool:
        """Does every participant know exactly the others of its domain that are up?"""
        live = self.live_nodes()
        return all(
            sorted(node.engine.participants)
            == sorted(other.guid.prefix for other in live if other is not node and other.setup.meets(node.setup))
            for node in live
        )

    def all_matched(self) -> bool:
        """Is every pair that fits matched on both sides, and nothing else matched with anything?"""
        writers = {writer.guid: 0 for writer in self.writers()}
        readers = {reader.guid: 0 for reader in self.readers()}
        for writer, reader in self.fitting_pairs():
            behavior = writer.local.behavior
            if reader.guid not in behavior.readers and reader.guid not in behavior.local_readers:
                return False
            if writer.guid not in reader.local.behavior.writers:
                return False
            writers[writer.guid] += 1
            readers[reader.guid] += 1
        return all(writer.matched_count == writers[writer.guid] for writer in self.writers()) and all(
            reader.matched_count == readers[reader.guid] for reader in self.readers()
        )


def _letters(number: int) -> str:
    """a, b, ... z, aa, ab, ..."""
    name = ""
    number += 1
    while number:
        number, letter = divmod(number - 1, 26)
        name = chr(ord("a") + letter) + name
    return name
