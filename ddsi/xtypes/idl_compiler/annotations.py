"""Builtin annotations as the compiler reads them (DDS-XTypes 1.3 §7.3.1.2, OMG IDL 4.2 §8.3).

:class:`Annotations` is what one construct carries.  Each question marks its annotation as answered; what nobody asked
for becomes a warning, as does an annotation that nobody knows.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

from ...structure.qos_policies import DataRepresentationId
from ..annotations import LARGEST_MEMBER_ID
from ..model import Extensibility, Limits, TryConstruct
from .constants import Lookup, evaluate
from .declarations import ConstantValue
from .source_text import IdlError, IdlWarning
from .syntax import Annotation, Binary, Expression, Literal, Name

__all__ = ["BUILTIN", "Annotations"]

_WITHOUT_EFFECT = frozenset(
    [
        "unit",
        "min",
        "max",
        "range",
        "verbatim",
        "topic",
        "ami",
        "service",
        "oneway",
        "nested",
        "default_nested",
        "autoid",
        "bit_bound",
        "extensibility",
        "final",
        "appendable",
        "mutable",
        "Key",
    ]
)
"""Known, and rightly without effect where nobody asks for them: they concern people, or other programs."""

BUILTIN = frozenset(
    {
        *("key", "Key", "id", "hashid", "optional", "external", "must_understand", "non_serialized", "default"),
        *("value", "default_literal", "position", "try_construct", "data_representation", *_WITHOUT_EFFECT),
    }
)
"""Every annotation that has a meaning of its own here."""


class Annotations:
    """The annotations of one construct."""

    def __init__(self, annotations: Sequence[Annotation], lookup: Lookup, warnings: list[IdlWarning]) -> None:
        self._by_name: dict[str, Annotation] = {}
        self._lookup = lookup
        self._warnings = warnings
        for annotation in annotations:
            self._by_name[annotation.name] = annotation
        self._unasked = dict(self._by_name)

    def find(self, name: str) -> Annotation | None:
        self._unasked.pop(name, None)
        return self._by_name.get(name)

    def warn_of_the_rest(self) -> None:
        """Say which annotations have no effect.  To be called when all questions have been asked."""
        for name, annotation in self._unasked.items():
            if name not in _WITHOUT_EFFECT:
                self._warnings.append(IdlWarning(annotation.place, f"@{name} has no effect here, and is ignored"))

    # --- questions ---------------------------------------------------------------------------------------

    def flag(self, name: str, *, default: bool = False) -> bool:
        """``@name``, ``@name(TRUE)`` or ``@name(FALSE)``."""
        annotation = self.find(name)
        if annotation is None:
            return default
        given = annotation.arguments.get("value")
        if given is None:
            return True
        value = evaluate(given, self._lookup)
        if not isinstance(value, bool):
            raise IdlError(given.place, f"@{name} takes TRUE or FALSE")
        return value

    def number(self, name: str, lowest: int, highest: int) -> int | None:
        """``@name(number)``."""
        given = self.argument(name, "a number")
        if given is None:
            return None
        value = evaluate(given, self._lookup)
        if isinstance(value, bool) or not isinstance(value, int) or not lowest <= value <= highest:
            raise IdlError(given.place, f"@{name} takes a number from {lowest} to {highest}")
        return value

    def member_id(self) -> int | None:
        return self.number("id", 0, LARGEST_MEMBER_ID)

    def hash_name(self) -> str | None:
        """The name in ``@hashid("name")``, empty for ``@hashid``."""
        annotation = self.find("hashid")
        if annotation is None:
            return None
        given = annotation.arguments.get("value")
        if given is None:
            return ""
        if not isinstance(given, Literal) or not isinstance(given.value, str):
            raise IdlError(given.place, "@hashid takes a string")
        return given.value

    def value(self, name: str) -> tuple[ConstantValue, Expression] | None:
        """The constant in ``@name(value)``, and where it stands."""
        given = self.argument(name, "a value")
        return None if given is None else (evaluate(given, self._lookup), given)

    def extensibility(self, default: Extensibility) -> Extensibility:
        found = default
        for extensibility in Extensibility:
            if self.flag(extensibility.value):
                found = extensibility
        word = self._word("extensibility", [extensibility.name for extensibility in Extensibility])
        return Extensibility[word] if word is not None else found

    def enumerated_extensibility(self) -> Extensibility:
        """That of an enum or a bitmask: final where nothing is said, and mutable ones are appendable, as in idlc."""
        found = self.extensibility(Extensibility.FINAL)
        return found if found is Extensibility.FINAL else Extensibility.APPENDABLE

    def is_hashed(self, *, default: bool) -> bool:
        """``@autoid``, ``@autoid(HASH)`` or ``@autoid(SEQUENTIAL)``."""
        annotation = self._by_name.get("autoid")
        if annotation is not None and not annotation.arguments:
            self.find("autoid")
            return True
        word = self._word("autoid", ["SEQUENTIAL", "HASH"])
        return default if word is None else word == "HASH"

    def try_construct(self) -> TryConstruct:
        word = self._word("try_construct", [behavior.name for behavior in TryConstruct])
        return TryConstruct.DISCARD if word is None else TryConstruct[word]

    def unit(self) -> str | None:
        given = self.argument("unit", "a text")
        if given is None:
            return None
        if not isinstance(given, Literal) or not isinstance(given.value, str):
            raise IdlError(given.place, "@unit takes a string")
        return given.value

    def limits(self) -> Limits | None:
        """``@range(min=0, max=10)``, ``@min(0)`` and ``@max(10)``."""
        limits: dict[str, float] = {}
        for name in ("range", "min", "max"):
            annotation = self.find(name)
            for parameter, given in annotation.arguments.items() if annotation is not None else ():
                number = evaluate(given, self._lookup)
                if isinstance(number, bool) or not isinstance(number, int | float) or not math.isfinite(number):
                    raise IdlError(given.place, f"@{name} takes numbers")
                limits[parameter if name == "range" else name] = number
                if limits.keys() >= {"min", "max"} and limits["min"] > limits["max"]:
                    raise IdlError(given.place, f"nothing lies between {limits['min']} and {limits['max']}")
        return Limits(limits.get("min"), limits.get("max")) if limits else None

    def representations(self) -> tuple[DataRepresentationId, ...]:
        """``@data_representation(XCDR2)``, or several joined by ``|``; none where it is not there."""
        given = self.argument("data_representation", "XCDR1 or XCDR2", parameter="allowed_kinds")
        found: list[DataRepresentationId] = []
        pending = [] if given is None else [given]
        while pending:
            match pending.pop():
                case Binary(sign="|", left=left, right=right):
                    pending += [right, left]
                case Name(parts=(*_, ("XCDR1" | "XCDR2") as word)):
                    found.append(DataRepresentationId[word])
                case Name(parts=(*_, "XML")):
                    pass  # nobody sends it
                case other:
                    raise IdlError(other.place, "@data_representation takes XCDR1, XCDR2 or XML, joined by |")
        return tuple(found)

    def argument(self, name: str, expected: str, *, parameter: str = "value") -> Expression | None:
        """The one argument, be it named or not."""
        annotation = self.find(name)
        if annotation is None:
            return None
        given = annotation.arguments.get(parameter) or annotation.arguments.get("value")
        if given is None:
            raise IdlError(annotation.place, f"@{name} takes {expected}, as in @{name}(...)")
        return given

    def _word(self, name: str, words: Sequence[str]) -> str | None:
        given = self.argument(name, " or ".join(words))
        if given is None:
            return None
        word = given.parts[-1] if isinstance(given, Name) else None
        if word not in words:
            raise IdlError(given.place, f"@{name} takes {' or '.join(words)}")
        return word
