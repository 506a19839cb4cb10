"""Whole domains of engines over a virtual network and clock, from a seed.

Not a chapter of the specification: the place of the transport, for tests, teaching and the search for what goes
wrong once in a thousand runs.  The engine is the very one that real programs run; nothing in it knows the difference.
"""

from .dice import Dice
from .domain import Domain
from .endpoints import NodeReader, NodeWriter, ReadingSession
from .link import GOOD_WEATHER, LinkConditions
from .network import Network, SimulationStuck
from .node import Node, NodeSetup
from .vendors import VENDORS, Vendor

__all__ = [
    "GOOD_WEATHER",
    "VENDORS",
    "Dice",
    "Domain",
    "LinkConditions",
    "Network",
    "Node",
    "NodeReader",
    "NodeSetup",
    "NodeWriter",
    "ReadingSession",
    "SimulationStuck",
    "Vendor",
]
