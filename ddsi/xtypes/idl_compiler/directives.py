"""Directives: comments in which IDL written for older releases of RTI Connext says what annotations say now.

    struct Track {
        long id;  //@key
        double speed;  //@Optional
                       //@ID 20
    };  //@Extensibility MUTABLE_EXTENSIBILITY

They stand behind what they are about, and their words are case-sensitive (RTI Connext DDS 5.2 User's Manual, "Using
Custom Directives").  In a file with annotations they are comments like any other: there an annotation may have been
left out by ``//`` on purpose, and who writes both for two compilers has said it already.  What copies text into
generated code (``//@copy``) or is unknown means nothing here.
"""

from __future__ import annotations

from collections.abc import Sequence

from .source_text import IdlWarning, Place, SourceText
from .syntax import Annotation, Expression, Literal
from .tokens import Token

__all__ = ["Directives"]

_FLAGS = {"key": "key", "Optional": "optional"}
_EXTENSIBILITIES = {
    "FINAL_EXTENSIBILITY": "final",
    "EXTENSIBLE_EXTENSIBILITY": "appendable",
    "MUTABLE_EXTENSIBILITY": "mutable",
}


class Directives:
    """Those of all files that are read together.  ``warnings`` grow meanwhile."""

    def __init__(self, tokens: Sequence[Token], warnings: list[IdlWarning]) -> None:
        self._warnings = warnings
        self._annotated: set[SourceText] = set()
        if any(token.directives for token in tokens):
            self._annotated = {token.place.source for token in tokens if token.text == "@"}

    def behind(self, token: Token, said: Sequence[Annotation]) -> list[Annotation]:
        """What the comments behind ``token`` say of what it ends, and annotations have not ``said``."""
        names = {annotation.name for annotation in said}
        found: list[Annotation] = []
        for text, place in token.directives:
            name, arguments = _meaning(text, place)
            if not name or name in names:
                continue
            if place.source in self._annotated:
                reason = f"//@{text} is a comment in a file with annotations; write @{name} before what it is about"
                self._warnings.append(IdlWarning(place, reason))
            else:
                found.append(Annotation(name, arguments, place))
        return found


def _meaning(text: str, place: Place) -> tuple[str, dict[str, Expression]]:
    """The annotation that says the same, and its arguments; no name: there is none."""
    word, value = [*text.split(None, 2), "", ""][:2]
    if word in _FLAGS:
        return _FLAGS[word], {}
    if word == "ID" and value.isdecimal() and len(value) < 20:
        return "id", {"value": Literal(int(value), place)}
    if word == "Extensibility" and value in _EXTENSIBILITIES:
        return _EXTENSIBILITIES[value], {}
    if word == "top-level" and value == "false":
        return "nested", {}
    return "", {}
