"""A sample for people: on one line where it fits, else a line for each member, and what is inside it further in."""

from __future__ import annotations

import json
from collections.abc import Iterator

from .value_forms import Form

__all__ = ["flow", "sample_lines"]

_INDENT = 2
_MOST_ELEMENTS = 24
_MOST_CHARACTERS = 240


def sample_lines(form: dict[str, Form], width: int, *, whole: bool = False) -> list[str]:
    """The lines of a struct's form.  Long lists and texts are cut, unless ``whole``."""
    flat = flow(form, whole=whole)[1:-1]
    return [flat] if len(flat) <= width else list(_members(form, width, whole, 0))


def flow(form: Form, *, whole: bool = False) -> str:
    """On one line, near to what JSON has."""
    if isinstance(form, dict):
        items = [f"{_name(name)}: {flow(value, whole=whole)}" for name, value in _cut(list(form.items()), whole)]
        return f"{{{', '.join(items + _rest(len(form), whole))}}}"
    if isinstance(form, list):
        items = [flow(value, whole=whole) for value in _cut(form, whole)]
        return f"[{', '.join(items + _rest(len(form), whole))}]"
    if isinstance(form, str):
        return _text(form, whole)
    return json.dumps(form)


def _members(form: dict[str, Form], width: int, whole: bool, indent: int) -> Iterator[str]:
    for name, value in _cut(list(form.items()), whole):
        yield from _item(f"{_name(name)}:", value, width, whole, indent)
    yield from (" " * indent + more for more in _rest(len(form), whole))


def _item(head: str, value: Form, width: int, whole: bool, indent: int) -> Iterator[str]:
    """A member or an element, behind its name or a dash."""
    line = f"{' ' * indent}{head} {flow(value, whole=whole)}"
    if len(line) <= width or not value or not isinstance(value, (dict, list)):
        yield line
        return
    yield f"{' ' * indent}{head}"
    if isinstance(value, dict):
        yield from _members(value, width, whole, indent + _INDENT)
        return
    for element in _cut(value, whole):
        yield from _item("-", element, width, whole, indent + _INDENT)
    yield from (" " * (indent + _INDENT) + more for more in _rest(len(value), whole))


def _cut(items: list[Form], whole: bool) -> list[Form]:
    return items if whole else items[:_MOST_ELEMENTS]


def _rest(count: int, whole: bool) -> list[str]:
    return [] if whole or count <= _MOST_ELEMENTS else [f"... {count - _MOST_ELEMENTS} more"]


def _text(text: str, whole: bool) -> str:
    if whole or len(text) <= _MOST_CHARACTERS:
        return _quoted(text)
    return f"{_quoted(text[:_MOST_CHARACTERS])}... {len(text) - _MOST_CHARACTERS} characters more"


def _quoted(text: str) -> str:
    """In quotes, with what does not print escaped: it may come from anybody, and this may be a terminal."""
    quoted = json.dumps(text, ensure_ascii=False)
    return quoted if quoted.isprintable() else json.dumps(text).replace("\x7f", "\\u007f")


def _name(name: str) -> str:
    """Names of members; the keys of a map may be any text."""
    return name if name.isprintable() and name and " " not in name else _quoted(name)
