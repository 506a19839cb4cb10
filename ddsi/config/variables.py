"""``${NAME}`` in configuration values, in the four forms that Cyclone knows.

=================  ======================================================
``${NAME}``        its value; empty if it is not set
``${NAME:-text}``  its value; ``text`` if it is not set, or empty
``${NAME:+text}``  ``text`` if it is set and not empty, else nothing
``${NAME:?text}``  its value; if it is not set, or empty, an error saying ``text``
=================  ======================================================

``text`` may hold variables in turn.  A value is taken as it is: a ``${`` inside it is no variable.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping

__all__ = ["expand_variables"]

# A value is a path, an address or a number; these bounds only stop what is not meant as one.
_MOST_CHARACTERS = 1 << 16
_MOST_LEVELS = 20

_FORMS = "${NAME}, ${NAME:-text}, ${NAME:+text}, ${NAME:?text}"


def expand_variables(text: str, variables: Mapping[str, str], on_unset: Callable[[str], None]) -> str:
    """``text`` with every variable replaced.  ``on_unset`` hears the name of each that is read as empty.

    Raises ValueError, saying what is wrong.
    """
    if "${" not in text:
        return text
    return _Expansion(variables, on_unset).expand(text, level=0)


class _Expansion:
    def __init__(self, variables: Mapping[str, str], on_unset: Callable[[str], None]) -> None:
        self._variables = variables
        self._on_unset = on_unset
        self._characters = 0

    def expand(self, text: str, *, level: int) -> str:
        if level > _MOST_LEVELS:
            raise ValueError(f"variables nested deeper than {_MOST_LEVELS} levels")
        pieces: list[str] = []
        position = 0
        while (start := text.find("${", position)) >= 0:
            end = _closing_brace(text, start + 2)
            pieces += [text[position:start], self._value(text[start + 2 : end], level)]
            position = end + 1
        pieces.append(text[position:])
        expanded = "".join(pieces)
        self._characters += len(expanded)
        if self._characters > _MOST_CHARACTERS:
            raise ValueError(f"longer than {_MOST_CHARACTERS} characters once its variables are replaced")
        return expanded

    def _value(self, inside: str, level: int) -> str:
        name, colon, rest = inside.partition(":")
        operator, alternative = rest[:1], rest[1:]
        if not name or (colon and operator not in ("-", "+", "?")):
            raise ValueError(f"${{{inside}}} is none of {_FORMS}")
        value = self._variables.get(name, "")
        match operator if colon else "":
            case "-":
                return value or self.expand(alternative, level=level + 1)
            case "+":
                return self.expand(alternative, level=level + 1) if value else ""
            case "?":
                if not value:
                    reason = self.expand(alternative, level=level + 1)
                    raise ValueError(f"the environment variable {name} is not set: {reason}")
                return value
            case _:
                if name not in self._variables:
                    self._on_unset(name)
                return value


def _closing_brace(text: str, start: int) -> int:
    """Where the brace closes that was opened before ``start``."""
    depth = 0
    for index in range(start, len(text)):
        if text[index] == "{":
            depth += 1
        elif text[index] == "}":
            if not depth:
                return index
            depth -= 1
    raise ValueError(f"{text[start - 2 :]!r} lacks the closing brace")
