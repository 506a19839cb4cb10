# mypy: ignore-errors
# pyright: basic, reportArgumentType=false
"""The types and samples of ours as cyclonedds-python has them, for comparisons.  Importing this needs that package."""

from typing import Any, Optional

from cyclonedds.idl import IdlStruct, make_idl_bitmask, make_idl_enum, make_idl_struct, make_idl_union
from cyclonedds.idl import types as peer
from cyclonedds.idl._support import Endianness, SerializeKind
from cyclonedds.idl.annotations import bit_bound, extensibility

from ddsi.xtypes.model import (
    ArrayType,
    BitmaskType,
    EnumType,
    IdlType,
    Primitive,
    SequenceType,
    String,
    StructType,
    UnionType,
)

__all__ = ["PeerTypes", "peer_octets"]

_PRIMITIVES = {
    "boolean": bool,
    "octet": peer.byte,
    **{f"{sign}int{bits}": getattr(peer, f"{sign}int{bits}") for sign in ("", "u") for bits in (8, 16, 32, 64)},
    **{name: getattr(peer, name) for name in ("char", "float32", "float64")},
}


def peer_octets(sample: Any, *, xcdr2: bool, little_endian: bool, key_only: bool = False) -> bytes:
    """What the peer writes, its encapsulation header included."""
    return bytes(
        sample.__idl__.serialize(
            sample,
            use_version_2=xcdr2,
            endianness=Endianness.Little if little_endian else Endianness.Big,
            serialize_kind=SerializeKind.KeyDefinitionOrder if key_only else SerializeKind.DataSample,
        )
    )


class PeerTypes:
    """The peer's class for each of our types, made when first asked for, and our values as its objects."""

    def __init__(self) -> None:
        self._classes: dict[int, Any] = {}

    def class_of(self, type_: StructType | UnionType | EnumType | BitmaskType) -> Any:
        key = id(type_.python_class)
        if key not in self._classes:
            self._classes[key] = self._made(type_, type_.type_name.replace("::", "."))
        return self._classes[key]

    def _made(self, type_: Any, typename: str) -> Any:
        name = type_.python_class.__name__
        match type_:
            case EnumType():
                made = make_idl_enum(name, typename, {literal.name: literal.value for literal in type_.python_class})
                return made if type_.bit_bound == 32 else bit_bound(type_.bit_bound)(made)
            case BitmaskType():
                positions = {flag.name: {"position": flag.value.bit_length() - 1} for flag in type_.python_class}
                made = make_idl_bitmask(name, typename, list(positions), field_annotations=positions)
                return bit_bound(type_.bit_bound)(made)
            case UnionType():
                fields = {case.name: self._case(type_, case) for case in type_.cases}
                made = make_idl_union(name, typename, fields, self.annotation(type_.discriminator.type))
                return extensibility(type_.extensibility.value)(made)
        fields, annotations = {}, {}
        for member in type_.members:
            annotation = self.annotation(member.type)
            fields[member.name] = Optional[annotation] if member.is_optional else annotation  # noqa: UP045
            annotations[member.name] = {"id": member.id}
            annotations[member.name] |= {"key": True} if member.is_key else {}
            annotations[member.name] |= {"must_understand": True} if member.must_understand else {}
        made = make_idl_struct(name, typename, fields, field_annotations=annotations)
        return extensibility(type_.extensibility.value)(made)

    def _case(self, union: UnionType, case: Any) -> Any:
        annotation = self.annotation(case.type)
        if case.is_default:
            return peer.default[annotation]
        return peer.case[[self.value(union.discriminator.type, label) for label in case.labels], annotation]

    def annotation(self, type_: IdlType) -> Any:
        match type_:
            case Primitive():
                return _PRIMITIVES[type_.name]
            case String(bound=bound):
                return str if bound is None else peer.bounded_str[bound]
            case SequenceType(element=element, bound=bound):
                inner = self.annotation(element)
                return peer.sequence[inner] if bound is None else peer.sequence[inner, bound]
            case ArrayType(element=element, dimensions=dimensions):
                inner = self.annotation(element)
                for dimension in reversed(dimensions):
                    inner = peer.array[inner, dimension]
                return inner
            case _:
                return self.class_of(type_)

    def value(self, type_: IdlType, value: Any) -> Any:
        """A value of ours as the peer has it."""
        match type_:
            case EnumType():
                return self.class_of(type_)(int(value))
            case BitmaskType():
                return self.class_of(type_).from_mask(int(value))
            case SequenceType(element=element):
                return [self.value(element, item) for item in value]
            case ArrayType(element=element, dimensions=dimensions):
                return self._rows(element, dimensions, value)
            case UnionType():
                case = type_.case_of(value._idl_discriminator)
                held = None if case is None else self.value(case.type, value._idl_value)
                discriminator = self.value(type_.discriminator.type, value._idl_discriminator)
                return self.class_of(type_)(discriminator=discriminator, value=held)
            case StructType():
                return self._struct(type_, value)
        return value

    def _rows(self, element: IdlType, dimensions: tuple[int, ...], value: Any) -> Any:
        if len(dimensions) > 1:
            return [self._rows(element, dimensions[1:], row) for row in value]
        if isinstance(element, Primitive) and element.is_octet:
            return bytes(value)
        return [self.value(element, item) for item in value]

    def _struct(self, type_: StructType, value: Any) -> IdlStruct:
        members = {member.name: (member, getattr(value, member.name)) for member in type_.members}
        return self.class_of(type_)(
            **{
                name: None if held is None else self.value(member.type, held)
                for name, (member, held) in members.items()
            }
        )
