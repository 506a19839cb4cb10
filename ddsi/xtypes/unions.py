"""What ``@idl.union`` does: a class whose objects hold a discriminator and the one member that it selects.

OMG IDL 4.2 §7.4.1.4.4.4.4, DDS-XTypes 1.3 §7.2.2.4.4.5.  An object has two slots, ``_idl_discriminator`` and
``_idl_value``, which the codecs use; the members are properties over them.  As with structs, annotations that name
what is not defined yet are looked at again at first use.
"""

from __future__ import annotations

import contextlib
import sys
from collections.abc import Mapping
from typing import Any

from ..structure.errors import BadParameter
from .annotations import CaseLabels, HashId, MemberId, autoid_hash
from .defaults import default_value, union_zero
from .definition import own_annotations
from .enumerations import bitmask_from
from .equality import same
from .model import (
    BOOLEAN,
    CHAR,
    WCHAR,
    BitmaskType,
    Case,
    EnumType,
    Extensibility,
    IdlType,
    Member,
    Primitive,
    UnionType,
)
from .resolution import STRUCT_ATTRIBUTE, Resolved, Resolver, Scope
from .topic_type import refuse_impossible

__all__ = ["define_union", "selected_member", "union_type"]


def union_type(python_class: Any) -> UnionType:
    """The IDL union that a class is.  BadParameter if it was not decorated with ``idl.union``."""
    found = python_class.__dict__.get(STRUCT_ATTRIBUTE) if isinstance(python_class, type) else None
    if not isinstance(found, UnionType):
        raise BadParameter(f"{python_class!r} is no union; it is a class decorated with @idl.union")
    return found


def selected_member(union: Any) -> str | None:
    """The name of the member that a union holds; None where its discriminator selects none."""
    case = union_type(type(union)).case_of(union._idl_discriminator)
    return None if case is None else case.name


def define_union(
    python_class: type[Any],
    *,
    type_name: str | None,
    extensibility: Extensibility,
    autoid: str,
    is_nested: bool,
    frame: Scope,
) -> type[Any]:
    """The decorated class; see :func:`ddsi.idl.union`."""
    if not isinstance(python_class, type):
        raise BadParameter(f"idl.union decorates a class, not {python_class!r}; its options are keywords")
    name = python_class.__name__
    if not isinstance(extensibility, Extensibility):
        raise BadParameter(f"{name}: extensibility is idl.FINAL, idl.APPENDABLE or idl.MUTABLE, not {extensibility!r}")
    labels = {key: value for key, value in python_class.__dict__.items() if isinstance(value, CaseLabels)}
    hashed = autoid == "hash"
    search = _CaseSearch(python_class, labels, hashed=hashed, frame=frame)
    decorated = _with_properties(python_class, search.switch, [key for key in labels if key != search.switch])
    union = UnionType(
        decorated, type_name or name, extensibility, search.found, is_nested=is_nested, has_hashed_ids=hashed
    )
    search.decorated = decorated
    setattr(decorated, STRUCT_ATTRIBUTE, union)
    with contextlib.suppress(NameError):  # a name not defined yet: found, or refused, at first use
        refuse_impossible(union)
    return decorated


# --- the members ---------------------------------------------------------------------------------------------


class _CaseSearch:
    """Finds the discriminator and the cases, once all names in the annotations are defined."""

    def __init__(self, python_class: type[Any], labels: dict[str, CaseLabels], *, hashed: bool, frame: Scope) -> None:
        self._name = python_class.__name__
        self._labels = labels
        self._hashed = hashed
        self._frame: Scope | None = frame
        self.decorated = python_class
        annotations = own_annotations(python_class)
        for member in annotations:
            if member not in labels:
                raise self._refusal(member, "it says neither idl.case(...) nor idl.switch")
        switches = [member for member, case in labels.items() if not case.labels and not case.is_default]
        if len(switches) != 1:
            raise BadParameter(f"{self._name}: a union has one member that is idl.switch, its discriminator")
        for member in labels:
            if member not in annotations:
                raise self._refusal(member, "it has no type")
        if sum(case.is_default for case in labels.values()) > 1:
            raise BadParameter(f"{self._name}: a union has one default case at most")
        self.switch = switches[0]

    def found(self) -> tuple[Member, tuple[Case, ...]]:
        annotations = own_annotations(self.decorated)
        resolver = self._resolver()
        resolved = self._resolve(self.switch, annotations[self.switch], resolver)
        if not _is_discriminator(resolved.type):
            raise self._refusal(
                self.switch, f"{resolved.type} cannot be a discriminator; integers, characters, booleans and enums can"
            )
        discriminator = Member(
            self.switch,
            0,
            resolved.type,
            is_key="key" in resolved.flags,
            must_understand="must_understand" in resolved.flags,
            typedefs=resolved.typedefs,
        )
        cases: list[Case] = []
        for name, labels in self._labels.items():
            if name != self.switch:
                cases.append(
                    self._case(name, labels, discriminator, self._resolve(name, annotations[name], resolver), cases)
                )
        self._frame = None
        return discriminator, tuple(cases)

    def _resolver(self) -> Resolver:
        module = sys.modules.get(self.decorated.__module__)
        names: Mapping[str, Any] = self._frame.f_locals if self._frame is not None else {}
        return Resolver(dict(vars(module)) if module is not None else {}, {**names, self._name: self.decorated})

    def _resolve(self, member: str, annotation: Any, resolver: Resolver) -> Resolved:
        try:
            return resolver.resolve(annotation)
        except NameError:
            raise
        except BadParameter as error:
            raise self._refusal(member, str(error)) from None
        except Exception as error:
            raise self._refusal(member, f"its annotation cannot be read: {error}") from error

    def _case(self, name: str, labels: CaseLabels, switch: Member, resolved: Resolved, before: list[Case]) -> Case:
        unfit = resolved.flags & {"key", "optional", "non_serialized"}
        if unfit:
            raise self._refusal(name, f"idl.{min(unfit)} does not fit a case; the discriminator may be a key")
        idl_name = resolved.idl_name
        case = Case(
            name,
            self._member_id(idl_name or name, resolved, before),
            resolved.type,
            must_understand="must_understand" in resolved.flags,
            idl_name=idl_name,
            is_external="external" in resolved.flags,
            typedefs=resolved.typedefs,
            hash_name=resolved.hash_name,
            try_construct=resolved.try_construct,
            limits=resolved.limits,
            unit=resolved.unit,
            labels=tuple(self._label(name, switch.type, label) for label in labels.labels),
            is_default=labels.is_default,
        )
        for other in before:
            shared = set(other.labels) & set(case.labels)
            if shared:
                raise self._refusal(name, f"the label {min(shared)!r} is also that of {other.name}")
            if other.id == case.id:
                raise self._refusal(name, f"its member id {case.id:#x} is that of {other.name}")
        return case

    def _member_id(self, name: str, resolved: Resolved, before: list[Case]) -> int:
        match resolved.member_id:
            case MemberId(number=number):
                return number
            case HashId(name=hashed_name):
                return autoid_hash(hashed_name or name)
            case None:  # from 1, as Cyclone DDS numbers them: 0 is the discriminator's
                return autoid_hash(name) if self._hashed else (before[-1].id + 1 if before else 1)

    def _label(self, name: str, type_: IdlType, label: Any) -> Any:
        try:
            return _discriminator_value(type_, label)
        except BadParameter as error:
            raise self._refusal(name, f"the label {error}") from None

    def _refusal(self, member: str, reason: str) -> BadParameter:
        return BadParameter(f"{self._name}.{member}: {reason}")


def _is_discriminator(type_: IdlType) -> bool:
    """A bitmask is none in IDL, but Fast DDS has such unions among its types."""
    return isinstance(type_, (EnumType, BitmaskType)) or (isinstance(type_, Primitive) and type_.code not in "fd")


def _discriminator_value(type_: IdlType, value: Any) -> Any:
    """The value as one of the discriminator's type.  BadParameter, beginning with the value, if it is none."""
    if isinstance(type_, EnumType):
        try:
            return type_.python_class(value)
        except ValueError:
            raise BadParameter(f"{value!r} is no literal of {type_.type_name}") from None
    if isinstance(type_, BitmaskType):
        if isinstance(value, bool) or not isinstance(value, int) or not 0 <= value < 1 << type_.bit_bound:
            raise BadParameter(f"{value!r} is no {type_.type_name}")
        return bitmask_from(type_.python_class, value)
    assert isinstance(type_, Primitive)
    if type_ == BOOLEAN:
        fits = isinstance(value, bool)
    elif type_ in (CHAR, WCHAR):
        fits = isinstance(value, str) and len(value) == 1 and ord(value) < 256**type_.size
    else:
        bits = 8 * type_.size
        lowest, end = (-(1 << bits - 1), 1 << bits - 1) if type_.code.islower() else (0, 1 << bits)
        fits = isinstance(value, int) and not isinstance(value, bool) and lowest <= value < end
    if not fits:
        raise BadParameter(f"{value!r} is no {type_}")
    return value


def unlabelled(union: UnionType) -> Any:
    """The discriminator of the default case: the lowest value, or first literal, that is no label.

    BadParameter where every value is one.
    """
    type_ = union.discriminator.type
    taken = union.selection
    candidates: Any
    if isinstance(type_, EnumType):
        candidates = list(type_.python_class)
    elif type_ == BOOLEAN:
        candidates = (False, True)
    elif type_ in (CHAR, WCHAR):
        candidates = map(chr, range(256))
    else:
        candidates = range(len(taken) + 1)
    for candidate in candidates:
        if candidate not in taken:
            return _discriminator_value(type_, candidate)
    raise BadParameter(f"{union.type_name}: every discriminator has a case of its own; the default one is never chosen")


# --- the class -----------------------------------------------------------------------------------------------


def _with_properties(python_class: type[Any], switch: str, members: list[str]) -> type[Any]:
    """The class anew, with two slots, and a property in place of each member."""
    namespace = {key: value for key, value in vars(python_class).items() if key not in ("__dict__", "__weakref__")}
    namespace |= {
        "__slots__": ("_idl_discriminator", "_idl_value"),
        "__match_args__": (),
        "__init__": _init,
        "__repr__": namespace.get("__repr__", _repr),
        "__eq__": namespace.get("__eq__", _equal),
        "__hash__": None,
        switch: property(_discriminator, _set_discriminator, doc="The discriminator."),
    }
    for member in members:
        namespace[member] = _member_property(member)
    decorated: type[Any] = type(python_class.__name__, python_class.__bases__, namespace)
    return decorated


def _member_property(name: str) -> property:
    def get(self: Any) -> Any:
        case = union_type(type(self)).case_of(self._idl_discriminator)
        if case is None or case.name != name:
            held = "no member" if case is None else case.name
            raise AttributeError(f"{type(self).__name__}.{name}: the discriminator selects {held}: {self!r}")
        return self._idl_value

    def set_(self: Any, value: Any) -> None:
        union = union_type(type(self))
        case = next(case for case in union.cases if case.name == name)
        if union.case_of(self._idl_discriminator) is not case:
            self._idl_discriminator = case.labels[0] if case.labels else unlabelled(union)
        self._idl_value = value

    return property(get, set_, doc=f"The member {name}; AttributeError while the union holds another.")


def _discriminator(self: Any) -> Any:
    return self._idl_discriminator


def _set_discriminator(self: Any, value: Any) -> None:
    union = union_type(type(self))
    value = _discriminator_value(union.discriminator.type, value)
    if union.case_of(value) is not union.case_of(self._idl_discriminator):
        raise BadParameter(
            f"{union.type_name}: the discriminator {value!r} would select another member; set that member instead"
        )
    self._idl_discriminator = value


def _init(self: Any, /, *positional: Any, **given: Any) -> None:
    union = union_type(type(self))
    name = type(self).__name__
    if positional:
        raise TypeError(f"{name} takes its one member by name, as {name}({union.cases[0].name}=...)")
    switch = union.discriminator.name
    members = {case.name: case for case in union.cases}
    chosen = [key for key in given if key != switch]
    unknown = [key for key in chosen if key not in members]
    if unknown:
        raise TypeError(f"{name} has no member {unknown[0]}; it has {', '.join(members)}")
    if len(chosen) > 1:
        raise TypeError(f"{name} holds one member at a time, not {' and '.join(chosen)}")
    case = members[chosen[0]] if chosen else None
    if switch in given:
        try:
            discriminator = _discriminator_value(union.discriminator.type, given[switch])
        except BadParameter as error:
            raise BadParameter(f"{name}.{switch}: {error}") from None
        selected = union.case_of(discriminator)
        if case is not None and selected is not case:
            raise BadParameter(f"{name}: the discriminator {discriminator!r} does not select {case.name}")
    elif case is not None:
        discriminator, selected = case.labels[0] if case.labels else unlabelled(union), case
    else:
        zero = union_zero(union)
        discriminator, selected = zero._idl_discriminator, union.case_of(zero._idl_discriminator)
    self._idl_discriminator = discriminator
    if case is not None:
        self._idl_value = given[case.name]
    else:
        self._idl_value = None if selected is None else default_value(selected)


def _repr(self: Any) -> str:
    case = union_type(type(self)).case_of(self._idl_discriminator)
    parts = []
    if case is None or len(case.labels) != 1 or case.is_default:  # else the member says it
        parts.append(f"{union_type(type(self)).discriminator.name}={self._idl_discriminator!r}")
    if case is not None:
        parts.append(f"{case.name}={self._idl_value!r}")
    return f"{type(self).__qualname__}({', '.join(parts)})"


def _equal(self: Any, other: Any) -> bool:
    if other.__class__ is not self.__class__:
        return NotImplemented  # type: ignore[no-any-return]
    return bool(self._idl_discriminator == other._idl_discriminator) and same(self._idl_value, other._idl_value)
