"""Topic and partition expressions: the wildcards of POSIX fnmatch, without flags but for FNM_NOESCAPE.

DDS-Security 1.1 §9.4.1.2.3.1 and §9.4.1.3.2.3 name fnmatch (POSIX 1003.2-1992 B.6) and no flags; 1.2 adds that nothing
escapes, so a backslash is a backslash.  ``*`` is any run of characters, ``?`` is one, ``[abc]``, ``[a-f]``,
``[!abc]`` and ``[[:digit:]]`` are one of or none of those.

Where vendors part: a ``[`` that nothing closes is itself here, as POSIX says, and matches nothing with Cyclone DDS; a
``-`` before ``]`` is itself (Cyclone: nothing).  Documents do well to leave ``[`` out.  Wildcards in the *name* are
plain characters: ``?`` matches a partition called ``*``, which is a known flaw of the specification.

Time is bounded for any expression and any name: both have at most :data:`MOST_CHARACTERS`, and what is between two
stars is sought once and never given back, so that a match takes at most the product of the two lengths.
"""

from __future__ import annotations

import re
from collections.abc import Iterable
from functools import lru_cache

from ddsi.structure.errors import MalformedMessage

__all__ = ["MOST_CHARACTERS", "check_expression", "matches", "matching"]

MOST_CHARACTERS = 1024
"""DDS names have at most 255 characters; longer ones than this match no expression at all."""

_WILDCARDS = frozenset("*?[")
# POSIX's character classes in its own locale: ASCII.
_CLASSES = {
    "alnum": "0-9A-Za-z",
    "alpha": "A-Za-z",
    "blank": r" \t",
    "cntrl": r"\x00-\x1f\x7f",
    "digit": "0-9",
    "graph": "!-~",
    "lower": "a-z",
    "print": " -~",
    "punct": r"!-/:-@\[-`{-~",
    "space": r" \t\n\r\f\v",
    "upper": "A-Z",
    "xdigit": "0-9A-Fa-f",
}


def matches(expression: str, name: str) -> bool:
    """Is ``name`` one of those that ``expression`` means?  Never raises; an expression that is none matches nothing."""
    if len(name) > MOST_CHARACTERS or len(expression) > MOST_CHARACTERS:
        return False
    if _WILDCARDS.isdisjoint(expression):
        return expression == name
    try:
        return _compiled(expression).fullmatch(name) is not None
    except MalformedMessage:
        return False


def matching(expressions: Iterable[str], name: str) -> bool:
    """Does at least one of the expressions match ``name``?"""
    return any(matches(expression, name) for expression in expressions)


def check_expression(expression: str) -> None:
    """Raise MalformedMessage for what is not an expression."""
    if len(expression) > MOST_CHARACTERS:
        raise MalformedMessage(f"an expression of {len(expression)} characters; there may be {MOST_CHARACTERS}")
    if "[" in expression:  # nothing else can be wrong
        _translate(expression)


@lru_cache(maxsize=1024)
def _compiled(expression: str) -> re.Pattern[str]:
    return re.compile(_translate(expression), re.DOTALL)


def _translate(expression: str) -> str:
    """A regular expression that cannot go back beyond a star.

    After a star, the first place where the following run (up to the next star) fits is as good as any later one: what
    may follow it there includes all that may follow later.  So each run but the last is atomic.
    """
    runs = [""]
    position = 0
    while position < len(expression):
        character = expression[position]
        position += 1
        if character == "*":
            runs.append("")
        elif character == "?":
            runs[-1] += "."
        elif character == "[" and (bracket := _bracket(expression, position)) is not None:
            runs[-1] += bracket[0]
            position = bracket[1]
        else:
            runs[-1] += re.escape(character)
    first, *between = runs
    if not between:
        return first
    last = between.pop()
    return first + "".join(f"(?>.*?{run})" for run in between if run) + ".*" + last


def _bracket(expression: str, begin: int) -> tuple[str, int] | None:
    """The bracket expression whose inside begins at ``begin``, and the index after it; None if nothing closes it."""
    if expression.find("]", begin + 1) < 0:
        return None  # so that many open ones take no time with their square
    position = begin
    negated = expression.startswith("!", position)
    position += negated
    inside: list[str] = []
    first = position
    while position < len(expression):
        if expression[position] == "]" and position > first:
            # An empty set - all its ranges run backwards - matches nothing, and its opposite everything.
            if not inside:
                return ("." if negated else "(?!)"), position + 1
            return f"[{'^' if negated else ''}{''.join(inside)}]", position + 1
        if expression.startswith("[:", position):
            end = expression.find(":]", position + 2)
            if end >= 0:
                inside.append(_class(expression[position + 2 : end]))
                position = end + 2
                continue
        if expression.startswith(("[.", "[="), position):
            raise MalformedMessage(f"collating symbols such as {expression[position : position + 4]!r} are not read")
        low = expression[position]
        if expression.startswith("-", position + 1) and expression[position + 2 : position + 3] not in ("", "]"):
            high = expression[position + 2]
            inside += [f"{re.escape(low)}-{re.escape(high)}"] if low <= high else []
            position += 3
        else:
            inside.append(re.escape(low))
            position += 1
    return None


def _class(name: str) -> str:
    if name not in _CLASSES:
        raise MalformedMessage(f"there is no class of characters called {name[:20]!r}; there are {', '.join(_CLASSES)}")
    return _CLASSES[name]
