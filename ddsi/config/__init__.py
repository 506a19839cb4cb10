"""How a participant is set up: the typed :class:`Config`, and ``DDSI_URI``, its form in XML.

What QoS says stands in ``structure``; this room says where, with whom and within which bounds.
"""

from __future__ import annotations

from .config import Config, TraceLevel
from .environment import load_config
from .ports import PortMapping

__all__ = ["Config", "PortMapping", "TraceLevel", "load_config"]
