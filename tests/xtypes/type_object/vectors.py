"""What a real peer makes of types: ``type_objects.json``, whose ``origin`` tells of whom."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

from ddsi.xtypes import idl

__all__ = ["VECTORS", "compiled"]

VECTORS: list[dict[str, Any]] = json.loads(Path(__file__).with_name("type_objects.json").read_text())["vectors"]


def compiled(vector: dict[str, Any]) -> type[Any]:
    """The topic type, from the IDL that the peer had."""
    found: Any = idl.loads(vector["idl"])
    for part in vector["topic_type"].split("::"):
        found = getattr(found, part)
    assert isinstance(found, type)
    return found
