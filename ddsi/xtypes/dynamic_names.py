"""Names that a stranger chose, as names in Python: what is no identifier there, or means something else, is changed.

In a TypeObject a name may be any printable text (DDS-XTypes 1.3 §7.3.4.5).  In this program it becomes an attribute and
a part of generated source, so nothing but ASCII letters, digits and underscores passes.  Struct and union members
remember how they are called in IDL (``idl.name``).
"""

from __future__ import annotations

import re
from collections.abc import Container

from .idl_compiler.python_identifiers import literal_identifier, python_identifier

__all__ = ["class_name", "literal_name", "member_name"]

_FOREIGN = re.compile(r"[^A-Za-z0-9_]")

_UNION_SLOTS = frozenset(("_idl_discriminator", "_idl_value"))


def class_name(type_name: str, otherwise: str) -> str:
    """That of a Python class: the last part of ``module::Name``; ``otherwise`` where there is no name."""
    return python_identifier(_ascii(type_name.rpartition("::")[2]) or otherwise)


def member_name(name: str, otherwise: str, taken: Container[str]) -> str:
    """The attribute of a member, none of those taken."""
    return _free(python_identifier(_ascii(name) or otherwise, _UNION_SLOTS), otherwise, taken)


def literal_name(name: str, otherwise: str, taken: Container[str]) -> str:
    """The attribute of a literal or flag, none of those taken.  Python's enums keep ``_names_`` for themselves."""
    safe = _ascii(name) or otherwise
    return _free(literal_identifier(f"v{safe}" if safe.startswith("_") else safe), otherwise, taken)


def _ascii(name: str) -> str:
    safe = _FOREIGN.sub("_", name)
    return f"_{safe}" if safe[:1].isdigit() else safe


def _free(name: str, otherwise: str, taken: Container[str]) -> str:
    """``otherwise`` is what no other has, so that few tries are enough."""
    candidate = name if name not in taken else f"{name.rstrip('_')}_{otherwise}"
    while candidate in taken:
        candidate += "_"
    return candidate
