"""ContentFilter: what a reader lets pass, as the reader has it, and as its writers do.

DDS 1.4 §2.2.2.3.3 (ContentFilteredTopic); RTPS 2.5 §8.7.3 and §9.6.4.1-2 (content filters on the wire).  How an
expression is evaluated is not known here: a filter is a function of a change.  What it said of a change is kept with
the change, under the filter's signature, which is also how a writer tells its readers what it found.
"""

from __future__ import annotations

import hashlib
from collections.abc import Callable

from ..structure.cache_change import CacheChange, ChangeKind
from ..structure.discovered import ContentFilterProperty

__all__ = ["SQL_FILTER_CLASS", "CompileFilter", "ContentFilter", "Evaluate", "filter_signatures"]

SQL_FILTER_CLASS = "DDSSQL"
"""The only filter class that the specification knows: DDS 1.4 Annex B."""

Evaluate = Callable[[CacheChange], bool]
CompileFilter = Callable[[str, tuple[str, ...]], Evaluate]
"""Takes an expression and its parameters; raises BadParameter where they do not fit the topic's type."""


class ContentFilter:
    """Samples pass or not; the end of an instance always passes, since who has never heard of it ignores it."""

    __slots__ = ("_evaluate", "_other_signature", "signature")

    def __init__(self, announced: ContentFilterProperty, evaluate: Evaluate) -> None:
        """``evaluate`` is asked once for each change that nobody has judged before."""
        self.signature, self._other_signature = filter_signatures(announced)
        self._evaluate = evaluate

    def __repr__(self) -> str:
        return f"<ContentFilter {self.signature.hex()}>"

    def passes(self, change: CacheChange) -> bool:
        if change.kind is not ChangeKind.ALIVE or not change.payload:
            return True
        verdicts = change.verdicts
        if verdicts is None:
            verdicts = change.verdicts = {}
        verdict = verdicts.get(self.signature)
        if verdict is None:
            verdict = verdicts.get(self._other_signature)
            if verdict is None:
                verdict = self._evaluate(change)
            verdicts[self.signature] = verdict
        return verdict


def filter_signatures(announced: ContentFilterProperty) -> tuple[bytes, bytes]:
    """The FilterSignature_t of a filter, and the one that some compute in its place: 16 octets each.

    RTPS 2.5 §9.6.4.2: MD5 over all its strings, each with its NUL.  RTI Connext up to 6.1 leaves out the last NUL.
    """
    strings = (
        announced.content_filtered_topic_name,
        announced.related_topic_name,
        announced.filter_class_name,
        announced.filter_expression,
        *announced.expression_parameters,
    )
    octets = b"".join(string.encode("utf-8", "surrogateescape") + b"\0" for string in strings)
    return _md5(octets), _md5(octets[:-1])


def _md5(octets: bytes) -> bytes:
    return hashlib.md5(octets, usedforsecurity=False).digest()
