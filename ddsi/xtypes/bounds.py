"""Values that exceed their bound, cut down to it (DDS-XTypes 1.3 §7.2.4.3, try construct behavior TRIM)."""

from __future__ import annotations

from itertools import islice
from typing import Any

from .model import IdlType, MapType, SequenceType, String

__all__ = ["trimmed", "unbounded"]


def unbounded(type_: IdlType) -> IdlType:
    """The type without its own bound; the bounds of what is inside stay."""
    match type_:
        case String(wide=wide):
            return String(wide=wide)
        case SequenceType(element=element, numpy=numpy):
            return SequenceType(element, numpy=numpy)
        case MapType(key=key, value=value):
            return MapType(key, value)
        case _:
            return type_


def trimmed(type_: IdlType, value: Any) -> Any:
    """As much of the beginning as the bound allows; of a string whole characters only."""
    match type_:
        case String(bound=int(bound), wide=True):
            return value.encode("utf-16-le", "surrogatepass")[: 2 * bound].decode("utf-16-le", "ignore")
        case String(bound=int(bound)):
            return value.encode()[:bound].decode(errors="ignore")
        case SequenceType(bound=int(bound)):
            return value[:bound]
        case MapType(bound=int(bound)):
            return dict(islice(value.items(), bound))
        case _:
            return value
