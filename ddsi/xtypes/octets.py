"""Samples and octets, for applications: what ``ddsi.serialize`` and its siblings do.

The octets are those of the object alone (DDS-XTypes 1.3 §7.4), behind the 4 octets of encapsulation header; padding
at the end, which writers add for transport, is neither made nor missed here.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Any, Literal, TypeVar

from ..structure.errors import BadParameter
from ..structure.qos_policies import DataRepresentationId
from .model import Composite, StructType, UnionType
from .resolution import named_type
from .type_support import SUPPORT_ATTRIBUTE, Octets, TypeSupport, type_support

if TYPE_CHECKING:
    from .type_object import TypeInformation

__all__ = ["composite_of", "deserialize", "key_hash", "serialize", "type_information"]

T = TypeVar("T")


def serialize(
    sample: object,
    *,
    representation: DataRepresentationId | None = None,
    byteorder: Literal["little", "big"] = "little",
) -> bytes:
    """The octets of a sample, encapsulation header first.

    ``representation`` is ``ddsi.XCDR1`` or ``ddsi.XCDR2``; by default what a writer of this type uses by default.
    Raises BadParameter for a sample that is not of an IDL type, or whose values do not fit it (with the member's path).
    """
    try:
        support = sample.__class__.__dict__[SUPPORT_ATTRIBUTE]
        write: Callable[[object], bytes] = support.serializers_asked_for[representation, byteorder]
    except (KeyError, TypeError):
        write = _serializer(sample, representation, byteorder)
    return write(sample)


def _serializer(sample: object, representation: Any, byteorder: Any) -> Callable[[object], bytes]:
    """The serialiser for these arguments, where they come for the first time or are wrong."""
    support = _support_of(sample)
    if byteorder not in ("little", "big"):
        raise BadParameter(f'byteorder is "little" or "big", not {byteorder!r}')
    chosen = support.representations[0] if representation is None else representation
    write = support.serializer(chosen, byteorder == "little", padded=False)
    support.serializers_asked_for[representation, byteorder] = write
    return write


def deserialize(type: type[T], data: Octets) -> T:
    """The sample of ``type`` in ``data``, which begins with the encapsulation header.

    Raises MalformedSample if the octets are not such a sample, BadParameter for a class that is no IDL type.
    """
    if not isinstance(data, (bytes, bytearray, memoryview)):
        raise BadParameter(f"data are octets (bytes, bytearray or memoryview), not {data.__class__.__name__}")
    try:
        support: TypeSupport[T] = type.__dict__[SUPPORT_ATTRIBUTE]  # spares small samples half of their time
    except (AttributeError, KeyError):
        support = type_support(type)
    return support.deserialize(data)


def key_hash(sample: object, representation: DataRepresentationId | None = None) -> bytes:
    """The 16 octets of a sample's key hash (RTPS 2.5 §9.6.4.8), by default in the representation of a writer.

    Zeros for a type without key.  Raises BadParameter as :func:`serialize` does.
    """
    support = _support_of(sample)
    chosen = support.representations[0] if representation is None else representation
    return support.key_hash(support.key(sample), chosen)


def _support_of(sample: object) -> TypeSupport[Any]:
    if isinstance(sample, type):
        raise BadParameter(f"a sample is asked for, not the class {sample.__name__}")
    return type_support(sample.__class__)


def type_information(python_class: type[Any]) -> TypeInformation:
    """The TypeInformation of a class that is a topic type: ``.minimal`` and ``.complete`` are its TypeIdentifiers.

    ``type_information(ShapeType).minimal.hex()`` gives the 14 octets of the hash; two types with the same minimal
    hash can be assigned to each other.  DDS-XTypes 1.3 §7.6.3.2.1.

    Raises BadParameter for a class that is neither struct nor union, or whose annotations cannot be resolved.
    """
    from .type_object import describe

    return describe(composite_of(python_class)).information


def composite_of(python_class: type[Any]) -> Composite:
    """The struct or union that a class is.  BadParameter if it is neither."""
    found = named_type(python_class)
    if not isinstance(found, (StructType, UnionType)):
        raise BadParameter(f"{python_class.__name__} is no topic type; decorate a class with @idl.struct")
    return found
