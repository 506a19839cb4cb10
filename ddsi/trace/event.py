"""TraceEvent: what every event has, and the JSON form that all of them share.

Not a chapter of the specification.  The fields of an event class are its schema: one table maps the types that a
field may have to JSON and back, so that a new event needs no code here.  ``docs/trace.md`` says the same in words.
"""

from __future__ import annotations

import ipaddress
import math
import types
import typing
from collections.abc import Callable, Mapping
from dataclasses import MISSING, dataclass, fields
from enum import Enum, StrEnum
from typing import Any, ClassVar, Self

from ..structure.guid import EntityId, Guid, GuidPrefix
from ..structure.locator import Locator, LocatorKind

__all__ = ["SCHEMA_NAME", "SCHEMA_VERSION", "Category", "MalformedTrace", "Pairs", "TraceEvent"]

SCHEMA_NAME = "ddsi-trace"
SCHEMA_VERSION = 1
"""Raised when a field goes or changes its meaning, or reasons are added; not for new events, nor for new fields with a
default."""

Pairs = tuple[tuple[str, str], ...]
"""Names with texts, in order; a JSON object."""


class MalformedTrace(ValueError):
    """A trace that was to be read back is not one: the text says which line, event or field."""


class Category(StrEnum):
    """What an event is about: the coarse filter."""

    MESSAGE = "message"
    DROP = "drop"
    DISCOVERY = "discovery"
    MATCHING = "matching"
    DATA = "data"
    TIMER = "timer"
    STATUS = "status"
    SECURITY = "security"
    LINK = "link"
    REMARK = "remark"


@dataclass(frozen=True, slots=True)
class TraceEvent:
    """Something that happened in one engine.

    ``now``: seconds of the clock that the engine was given, which never runs backward.  ``participant``: the prefix
    of the participant whose engine this is (for link events: of the sender).
    """

    NAME: ClassVar[str] = ""
    CATEGORY: ClassVar[Category]

    now: float
    participant: GuidPrefix

    def to_json(self) -> dict[str, object]:
        """The event as a JSON object, "event" first, then the fields in their order."""
        form: dict[str, object] = {"event": self.NAME}
        for field in _codec(type(self)):
            form[field.name] = field.encode(getattr(self, field.name))
        return form

    @classmethod
    def from_fields(cls, form: Mapping[str, object]) -> Self:
        """The reverse of :meth:`to_json`.  A member that this class does not know is left out.

        Raises MalformedTrace where a field is missing or is not of its type.
        """
        values: dict[str, Any] = {}
        for field in _codec(cls):
            name = field.name
            if name not in form:
                if field.is_optional:
                    continue
                raise MalformedTrace(f"event {cls.NAME!r} lacks {name!r}")
            try:
                values[name] = field.decode(form[name])
            except (ValueError, TypeError, KeyError, AttributeError, OverflowError) as error:
                raise MalformedTrace(f"event {cls.NAME!r}: {name!r} cannot be {form[name]!r:.80}") from error
        return cls(**values)


_Encode = Callable[[Any], object]
_Decode = Callable[[Any], object]


@dataclass(frozen=True, slots=True)
class _FieldCodec:
    name: str
    encode: _Encode
    decode: _Decode
    is_optional: bool


_codecs: dict[type[TraceEvent], tuple[_FieldCodec, ...]] = {}


def _codec(event_type: type[TraceEvent]) -> tuple[_FieldCodec, ...]:
    """How each field of the class becomes JSON and back; found out once per class."""
    known = _codecs.get(event_type)
    if known is None:
        hints = typing.get_type_hints(event_type)
        known = _codecs[event_type] = tuple(
            _FieldCodec(field.name, *_field_codec(hints[field.name]), is_optional=field.default is not MISSING)
            for field in fields(event_type)
        )
    return known


def _field_codec(annotation: object) -> tuple[_Encode, _Decode]:
    """How a field of this type becomes JSON, and how it is read back."""
    if annotation == Pairs:
        return dict, lambda form: tuple((_text(name), _text(text)) for name, text in form.items())
    if isinstance(annotation, types.UnionType):
        return _optional_codec(annotation)
    if typing.get_origin(annotation) is tuple:
        encode, decode = _field_codec(typing.get_args(annotation)[0])
        return lambda items: [encode(item) for item in items], lambda form: tuple(decode(item) for item in _list(form))
    if isinstance(annotation, type) and issubclass(annotation, Enum):
        members = {member.name.lower(): member for member in annotation}
        return lambda member: member.name.lower(), lambda form: members[form]
    if isinstance(annotation, type) and annotation in _SCALARS:
        return _SCALARS[annotation]
    raise TypeError(f"no JSON form for a trace field of type {annotation!r}")


def _optional_codec(annotation: types.UnionType) -> tuple[_Encode, _Decode]:
    (inner,) = (option for option in annotation.__args__ if option is not types.NoneType)
    encode, decode = _field_codec(inner)
    return (
        lambda value: None if value is None else encode(value),
        lambda form: None if form is None else decode(form),
    )


def _text(form: object) -> str:
    if not isinstance(form, str):
        raise TypeError("not a text")
    return form


def _list(form: object) -> list[object]:
    if not isinstance(form, list):
        raise TypeError("not a list")
    return form


def _integer(form: object) -> int:
    if not isinstance(form, int) or isinstance(form, bool):
        raise TypeError("not an integer")
    return form


def _boolean(form: object) -> bool:
    if not isinstance(form, bool):
        raise TypeError("not a boolean")
    return form


def _seconds_to_json(seconds: float) -> object:
    # JSON knows no infinity, and most readers of JSON refuse the one that Python would write.
    return seconds if math.isfinite(seconds) else "infinite"


def _seconds_from_json(form: object) -> float:
    if form == "infinite":
        return math.inf
    if not isinstance(form, int | float) or isinstance(form, bool) or not math.isfinite(form):
        raise TypeError("not a number")
    return float(form)


def _octets_from_text(text: str) -> bytes:
    return bytes.fromhex(_text(text).replace(":", ""))


def _locator_to_text(locator: Locator) -> str:
    """``udpv4/127.0.0.1:7400``; in hexadecimal what the usual form of the address would not give back."""
    text = str(locator)
    return text if _locator_from_text(text) == locator else f"kind{locator.kind}/{locator.address.hex()}:{locator.port}"


def _locator_from_text(text: str) -> Locator:
    kind_text, _, rest = _text(text).partition("/")
    host, _, port = rest.rpartition(":")
    if kind_text == "udpv4":
        return Locator.udp_v4(host, int(port))
    if kind_text == "udpv6":
        return Locator(LocatorKind.UDPV6, int(port), ipaddress.IPv6Address(host.strip("[]")).packed)
    names = {kind.name.lower(): int(kind) for kind in LocatorKind}
    kind = names[kind_text] if kind_text in names else int(kind_text.removeprefix("kind"))
    address = bytes.fromhex(host)
    if len(address) != 16:
        raise ValueError("an address has 16 octets")
    return Locator(kind, int(port), address)


_SCALARS: dict[type, tuple[_Encode, _Decode]] = {
    float: (_seconds_to_json, _seconds_from_json),
    int: (int, _integer),
    bool: (bool, _boolean),
    str: (str, _text),
    bytes: (bytes.hex, _octets_from_text),
    Guid: (str, lambda text: Guid(_octets_from_text(text))),
    GuidPrefix: (str, lambda text: GuidPrefix(_octets_from_text(text))),
    EntityId: (str, lambda text: EntityId(_octets_from_text(text))),
    Locator: (_locator_to_text, _locator_from_text),
}
