"""Sockets, the clock, and the trio tasks that drive an engine: the only room that knows the platform."""

from .pump import Pump, PumpOptions

__all__ = ["Pump", "PumpOptions"]
