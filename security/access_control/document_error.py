"""What is wrong with a governance or permissions document, and where.

DDS-Security 1.1 §9.4.1.  Everything that this package raises about a document is one of these, whoever sent it: for
the documents of our own participant it is the configuration's fault, and so it is a ConfigurationError; for a remote
one the plugin turns it into :class:`Refused`.
"""

from __future__ import annotations

import difflib
from collections.abc import Iterable

from ddsi.structure.errors import ConfigurationError

__all__ = ["DocumentError", "UntrustedDocument", "did_you_mean", "shown", "titled"]


class DocumentError(ConfigurationError):
    """A document that cannot be used.

    ``document``: its name as the caller gave it.  ``line``: of the file, from 1; 0 where no line is to blame.
    ``rule``: the grant or rule in which it stands, or "".  ``reason``: what is wrong, in one
    line that prints, whatever of the document it quotes.  ``remedy``: what to do, or "".
    """

    def __init__(self, document: str, reason: str, *, line: int = 0, rule: str = "", remedy: str = "") -> None:
        reason = _printable(reason)
        where = document + (f", line {line}" if line else "") + (f", {rule}" if rule else "")
        super().__init__(f"{where}: {reason}" + (f"; {remedy}" if remedy else ""))
        self.document = document
        self.line = line
        self.rule = rule
        self.reason = reason
        self.remedy = remedy


class UntrustedDocument(DocumentError):
    """It is not signed as it must be by the permissions CA; nothing of what it says was looked at (§9.4.1.1)."""


_LONGEST_SHOWN = 80
_LONGEST_REASON = 1000


def _printable(text: str) -> str:
    """White space as single spaces, what else does not print escaped; cut where it gets too long to read."""
    cut = " ".join(text[:_LONGEST_REASON].split()) + ("..." if len(text) > _LONGEST_REASON else "")
    return "".join(character if character.isprintable() else ascii(character)[1:-1] for character in cut)


def shown(text: str) -> str:
    """Text of a document or a peer in quotes, cut where it gets too long to read."""
    return repr(text if len(text) <= _LONGEST_SHOWN else f"{text[:_LONGEST_SHOWN]}...")


def titled(kind: str, name: str) -> str:
    """``permissions alice.p7s``; a name that says what it is needs no title."""
    return name if name.startswith(f"{kind} ") else f"{kind} {name}"


def did_you_mean(word: str, valid: Iterable[str]) -> str:
    """The valid word that is nearest to ``word``, as a question; else all that there are.  "" where there is none."""
    words = list(valid)
    # The length is bounded, as the comparison takes time with its square.
    near = difflib.get_close_matches(word[:100].lower(), [candidate.lower() for candidate in words], n=1)
    if near:
        return f"did you mean {next(candidate for candidate in words if candidate.lower() == near[0])}?"
    return f"expected {' or '.join(words)}" if words else ""
