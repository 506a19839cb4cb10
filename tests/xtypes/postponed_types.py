"""Types whose annotations are strings (PEP 563), with names that are defined further down (``test_postponed.py``)."""

from __future__ import annotations

import enum
from typing import TYPE_CHECKING, Annotated, ClassVar

from ddsi.xtypes import idl

if TYPE_CHECKING:
    from collections.abc import Sequence


@idl.struct
class Tree:
    name: Annotated[str, idl.key, idl.bound(16)]
    kind: Kind
    position: Position
    children: idl.sequence[Tree]
    parent_name: str | None = None
    LIMIT: ClassVar[Sequence[int]] = (1, 2)  # of a name that exists for type checkers only


@idl.struct
class Position:
    x: idl.float64 = 0.0
    y: idl.float64 = 0.0


class Kind(enum.IntEnum):
    LEAF = 0
    BRANCH = 1


@idl.struct(extensibility=idl.MUTABLE)
class Labelled(Position):
    label: str = ""
