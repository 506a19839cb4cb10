"""What ``@idl.struct`` does: a dataclass with slots, and a :class:`StructType` whose members are found when needed.

Members are looked for when the class is decorated, so that what cannot be a type is refused there.  Where an
annotation names what is not defined yet (the class itself under PEP 649, a class further down), the search is
repeated at first use.
"""

from __future__ import annotations

import contextlib
import dataclasses
import inspect
import sys
from collections.abc import Callable, Mapping
from typing import Any

from ..structure.errors import BadParameter
from ..structure.qos_policies import DataRepresentationId
from .annotations import HashId, MemberId, autoid_hash
from .equality import same_members
from .model import Extensibility, Member, StructType
from .resolution import STRUCT_ATTRIBUTE, Resolved, Resolver, Scope
from .topic_type import refuse_impossible
from .value_check import check_value

__all__ = ["define_struct", "own_annotations", "struct_type"]


def struct_type(python_class: Any) -> StructType:
    """The IDL struct that a class is.  BadParameter if it was not decorated itself (its base does not count)."""
    found = python_class.__dict__.get(STRUCT_ATTRIBUTE) if isinstance(python_class, type) else None
    if not isinstance(found, StructType):
        raise BadParameter(f"{_shown(python_class)} is no topic type; it is a class decorated with @idl.struct")
    return found


def define_struct(
    python_class: type[Any],
    *,
    type_name: str | None,
    extensibility: Extensibility,
    autoid: str,
    is_nested: bool,
    frame: Scope,
    representations: tuple[DataRepresentationId, ...] = (),
) -> type[Any]:
    """The decorated class; see :func:`ddsi.idl.struct`."""
    if not isinstance(python_class, type):
        raise BadParameter(f"idl.struct decorates a class, not {_shown(python_class)}; its options are keywords")
    name = python_class.__name__
    if not isinstance(extensibility, Extensibility):
        raise BadParameter(f"{name}: extensibility is idl.FINAL, idl.APPENDABLE or idl.MUTABLE, not {extensibility!r}")
    if autoid not in ("sequential", "hash"):
        raise BadParameter(f'{name}: autoid is "sequential" or "hash", not {autoid!r}')
    if type_name is not None and (not isinstance(type_name, str) or not type_name):
        raise BadParameter(f"{name}: typename is a name such as 'module::Name', not {type_name!r}")
    base = _base_of(python_class)
    decorated = _slotted(python_class)
    hashed = autoid == "hash"
    struct = StructType(
        decorated,
        type_name or name,
        extensibility,
        _MemberSearch(decorated, base, hashed=hashed, frame=frame).members,
        base=base,
        is_nested=is_nested,
        has_hashed_ids=hashed,
        representations=_checked_representations(name, representations),
    )
    setattr(decorated, STRUCT_ATTRIBUTE, struct)
    with contextlib.suppress(NameError):  # a name not defined yet: found, or refused, at first use
        refuse_impossible(struct)
    return decorated


def _checked_representations(name: str, representations: Any) -> tuple[DataRepresentationId, ...]:
    possible = (DataRepresentationId.XCDR1, DataRepresentationId.XCDR2)
    if not isinstance(representations, tuple) or not all(chosen in possible for chosen in representations):
        raise BadParameter(f"{name}: representations are a tuple of idl.XCDR1 and idl.XCDR2, not {representations!r}")
    return representations


def _base_of(python_class: type[Any]) -> StructType | None:
    structs = []
    for base in python_class.__bases__:
        if STRUCT_ATTRIBUTE in base.__dict__:
            structs.append(struct_type(base))
        elif hasattr(base, STRUCT_ATTRIBUTE) or dataclasses.is_dataclass(base):
            raise BadParameter(f"{python_class.__name__}: its base {base.__name__} is not decorated with @idl.struct")
    if len(structs) > 1:
        raise BadParameter(f"{python_class.__name__}: an IDL struct has one base at most")
    return structs[0] if structs else None


def _slotted(python_class: type[Any]) -> type[Any]:
    own_equality = "__eq__" in python_class.__dict__
    try:
        decorated: type[Any] = dataclasses.dataclass(slots=True, eq=False)(python_class)
    except Exception as error:  # most often TypeError, but a metaclass, such as that of enums, may fail as it likes
        raise BadParameter(f"{python_class.__name__}: {error}") from error
    if not own_equality:
        # Not the dataclass's own: it compares an array.array with a list as different, and fails on numpy arrays.
        decorated.__eq__ = same_members  # type: ignore[assignment]
        decorated.__hash__ = None  # type: ignore[assignment]
    return decorated


class _MemberSearch:
    """Finds the members of one class, once all names in its annotations are defined."""

    def __init__(self, python_class: type[Any], base: StructType | None, *, hashed: bool, frame: Scope) -> None:
        self._class = python_class
        self._base = base
        self._hashed = hashed
        self._frame: Scope | None = frame

    def members(self) -> tuple[Member, ...]:
        inherited = self._base.declared if self._base is not None else ()
        annotations = own_annotations(self._class)
        _refuse_init_variables(self._class, annotations)
        resolver = self._resolver()
        members = list(inherited)
        for field in dataclasses.fields(self._class):
            if field.name not in annotations:
                continue  # the base's
            if any(field.name == member.name for member in inherited):
                raise self._refusal(field.name, "its base has a member of that name")
            members.append(self._member(field, annotations[field.name], resolver, members))
        self._frame = None  # not needed any more, and it would keep the function's locals alive
        return tuple(members)

    def _resolver(self) -> Resolver:
        module = sys.modules.get(self._class.__module__)
        names: Mapping[str, Any] = self._frame.f_locals if self._frame is not None else {}
        return Resolver(dict(vars(module)) if module is not None else {}, {**names, self._class.__name__: self._class})

    def _member(
        self, field: dataclasses.Field[Any], annotation: Any, resolver: Resolver, before: list[Member]
    ) -> Member:
        try:
            resolved = resolver.resolve(annotation)
        except NameError:
            raise
        except BadParameter as error:
            raise self._refusal(field.name, str(error)) from None
        except Exception as error:
            raise self._refusal(field.name, f"its annotation cannot be read: {error}") from error
        member = Member(
            field.name,
            self._member_id(resolved.idl_name or field.name, resolved, before),
            resolved.type,
            is_key="key" in resolved.flags,
            is_optional="optional" in resolved.flags,
            must_understand="must_understand" in resolved.flags,
            default=_default_of(field),
            idl_name=resolved.idl_name,
            is_external="external" in resolved.flags,
            is_serialized="non_serialized" not in resolved.flags,
            typedefs=resolved.typedefs,
            hash_name=resolved.hash_name,
            try_construct=resolved.try_construct,
            limits=resolved.limits,
            unit=resolved.unit,
        )
        self._check(member, before)
        return member

    def _member_id(self, name: str, resolved: Resolved, before: list[Member]) -> int:
        match resolved.member_id:
            case MemberId(number=number):
                return number
            case HashId(name=hashed_name):
                return autoid_hash(hashed_name or name)
            case None:
                return autoid_hash(name) if self._hashed else (before[-1].id + 1 if before else 0)

    def _check(self, member: Member, before: list[Member]) -> None:
        if member.is_key and member.is_optional:
            raise self._refusal(member.name, "a key member cannot be optional")
        if member.is_key and not member.is_serialized:
            raise self._refusal(member.name, "a key member must travel")
        if member.is_key and self._base is not None and any(inherited.is_key for inherited in self._base.members):
            raise self._refusal(
                member.name, f"the key is that of the base {self._base.type_name}; no member adds to it"
            )
        for other in before:
            if other.id == member.id:
                raise self._refusal(member.name, f"its member id {member.id:#x} is that of {other.name}")
        if member.default is not None:
            try:
                check_value(member, member.default(), member.name)
            except NameError:
                pass  # the default of a type that is not complete yet; writing checks it
            except BadParameter as error:
                raise BadParameter(f"{self._class.__name__}: the default of {error}") from None

    def _refusal(self, member: str, reason: str) -> BadParameter:
        return BadParameter(f"{self._class.__name__}.{member}: {reason}")


def own_annotations(python_class: type[Any]) -> Mapping[str, Any]:
    if sys.version_info >= (3, 14):
        import annotationlib

        return annotationlib.get_annotations(python_class, format=annotationlib.Format.FORWARDREF)
    found: Mapping[str, Any] = inspect.get_annotations(python_class)
    return found


def _refuse_init_variables(python_class: type[Any], annotations: Mapping[str, Any]) -> None:
    for name, annotation in annotations.items():
        if isinstance(annotation, dataclasses.InitVar) or "InitVar[" in str(annotation):
            raise BadParameter(f"{python_class.__name__}.{name}: an InitVar does not travel; a sample has members only")


def _default_of(field: dataclasses.Field[Any]) -> Callable[[], Any] | None:
    if field.default is not dataclasses.MISSING:
        default = field.default
        return lambda: default
    return None if field.default_factory is dataclasses.MISSING else field.default_factory


def _shown(value: Any) -> str:
    return value.__name__ if isinstance(value, type) else repr(value)
