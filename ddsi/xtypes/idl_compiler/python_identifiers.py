"""Names of IDL as names in Python: what Python keeps for itself gets an underscore behind it, and the other way.

Apart from ``python_names.py``, which names whole files, since every participant that announces types needs this much.
"""

from __future__ import annotations

import keyword
from collections.abc import Iterable

__all__ = ["literal_identifier", "literal_name_in_idl", "python_identifier"]

_USED_BY_GENERATED_SOURCE = frozenset(
    ("Annotated", "Final", "TypeAlias", "annotations", "bool", "enum", "field", "float", "idl", "int", "str")
)

_ENUM_ATTRIBUTES = frozenset(("mro", "name", "value"))


def python_identifier(name: str, taken: Iterable[str] = ()) -> str:
    """The name, with underscores behind it until it is one in Python and not taken."""
    if name.startswith("__"):  # Python would mangle it inside a class
        name = "_" + name.lstrip("_")
    while keyword.iskeyword(name) or name in _USED_BY_GENERATED_SOURCE or name in taken:
        name += "_"
    return name


def literal_identifier(name: str) -> str:
    """The name of an enum's literal, which must not be what every Python enum has."""
    return python_identifier(name, _ENUM_ATTRIBUTES)


def literal_name_in_idl(name: str) -> str:
    """The other way: the name of a literal or flag without the underscores that only Python needs."""
    bare = name.rstrip("_")
    return bare if bare != name and literal_identifier(bare) == name else name
