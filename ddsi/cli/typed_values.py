"""What somebody types for a sample: ``field=value``, with paths into what is nested, or JSON, or both.

    color=RED pose.position.x=1.5 points[2].y=3 tags[home]=1
    '{"color": "RED", "pose": {"position": {"x": 1.5}}}' x=7

Later words add to earlier ones.  What the values mean, the type says: see ``value_forms.py``.
"""

from __future__ import annotations

import json
import re
from collections.abc import Sequence
from typing import Any

from ..structure.errors import BadParameter
from .value_forms import Elements, Form, Text

__all__ = ["typed_form"]

_STEP = re.compile(r"(?P<name>[^.\[\]=]+)|\.(?P<member>[^.\[\]=]+)|\[(?P<index>[0-9]+)\]|\[(?P<key>[^\]]*)\]")

HIGHEST_INDEX = 65_535
"""Elements before it get their defaults, so there are that many."""


def typed_form(words: Sequence[str]) -> Form:
    """The form of a whole sample.  Raises BadParameter, naming the word, for what cannot be read."""
    form: dict[str, Form] = {}
    for word in words:
        if word.lstrip().startswith("{"):
            _merge(form, _json(word))
        else:
            path, equals, text = word.partition("=")
            if not equals:
                raise BadParameter(f"{word!r} is neither field=value nor a JSON object")
            _set(form, path, _steps(path), Text(text))
    return form


def _json(word: str) -> dict[str, Form]:
    try:
        found: dict[str, Form] = json.loads(word)
    except ValueError as error:
        raise BadParameter(f"this is no JSON: {error}") from None
    return found


def _merge(form: dict[str, Form], more: dict[str, Form]) -> None:
    for name, value in more.items():
        if name in form:
            raise BadParameter(f"{name}: it is given twice")
        form[name] = value


def _steps(path: str) -> list[str | int]:
    """``points[2].y`` as "points", 2, "y"."""
    steps: list[str | int] = []
    at = 0
    while at < len(path):
        match = _STEP.match(path, at)
        if match is None or (match["name"] is not None and steps) or (match["name"] is None and not steps):
            raise BadParameter(f"{path!r} is no path of members, as in pose.points[2].x")
        if match["index"] is not None:
            if int(match["index"]) > HIGHEST_INDEX:
                raise BadParameter(f"{path}: an index is at most {HIGHEST_INDEX}")
            steps.append(int(match["index"]))
        else:
            steps.append(next(text for text in (match["name"], match["member"], match["key"]) if text is not None))
        at = match.end()
    if not steps:
        raise BadParameter("a member's name is wanted before the =")
    return steps


def _set(form: Any, path: str, steps: list[str | int], value: Form) -> None:
    """Put a value at the end of the path, making what lies on the way."""
    for step, following in zip(steps, [*steps[1:], None], strict=True):
        if isinstance(form, list) and isinstance(step, int) and step < len(form):
            form = _entered(form, path, step, following, value, is_there=True)
        elif isinstance(form, dict):
            form = _entered(form, path, step, following, value, is_there=step in form)
        else:
            raise BadParameter(f"{path}: a part of it is given as a whole already")


def _entered(form: Any, path: str, step: str | int, following: str | int | None, value: Form, *, is_there: bool) -> Any:
    if following is None:
        if is_there:
            raise BadParameter(f"{path}: it is given twice")
        form[step] = value
    elif not is_there:
        form[step] = Elements() if isinstance(following, int) else {}
    return form[step]
