"""From types to IDL text: what ``ddsi.idl.to_idl`` does (OMG IDL 4.2).

The text holds the type and all that it needs, in an order in which each name is known before it is used; read again, it
gives the same types, typedefs included.  In IDL an array inside a sequence or map needs a name, so such a one becomes a
typedef.  What IDL cannot say (numpy as the form of values) is lost, and so are comments.
"""

from __future__ import annotations

import enum
import math
import re
from collections.abc import Iterator, Sequence
from dataclasses import replace
from typing import Any

from ...structure.errors import BadParameter
from ..annotations import autoid_hash
from ..model import (
    ArrayType,
    BitmaskType,
    BitsetType,
    Case,
    Composite,
    EnumType,
    Extensibility,
    IdlType,
    MapType,
    Member,
    Primitive,
    SequenceType,
    String,
    StructType,
    TryConstruct,
    Typedefs,
    UnionType,
)
from .expressions import KEYWORDS
from .python_names import literal_name_in_idl

__all__ = ["idl_text"]

_Named = EnumType | BitmaskType | BitsetType | StructType | UnionType

_Block = tuple[tuple[str, ...], list[str]]
"""Some lines, and the module in which they stand."""

_NAME = re.compile(r"[A-Za-z_][A-Za-z0-9_]*")
_FOLDED_KEYWORDS = frozenset(word.lower() for word in KEYWORDS)
_INDENT = "  "
_PRIMITIVES = {"float32": "float", "float64": "double"}


def idl_text(type_: _Named) -> str:
    """The IDL of a type and of what it needs.  BadParameter where its names are none in IDL, or collide."""
    order = _in_order(type_)
    writer = _Writer(order)
    blocks: list[_Block] = []
    known: set[int] = set()
    for named in order:
        for need, _ in _needs(named):
            if id(need) not in known and isinstance(need, (StructType, UnionType)):  # it comes later, or is this one
                kind = "struct" if isinstance(need, StructType) else "union"
                blocks.append((_module(need), [f"{kind} {_escaped(_path(need)[-1])};"]))
                known.add(id(need))
        blocks += writer.definition(named)
        known.add(id(named))
    return "".join(_modules(blocks))


def _modules(blocks: Sequence[_Block]) -> Iterator[str]:
    """The blocks, each inside the braces of its modules, which stay open as long as they can."""
    opened: tuple[str, ...] = ()
    for number, (module, lines) in enumerate(blocks):
        shared = 0
        while shared < min(len(opened), len(module)) and opened[shared] == module[shared]:
            shared += 1
        yield from _closing(opened, shared)
        yield "\n" if number else ""
        for depth in range(shared, len(module)):
            yield f"{_INDENT * depth}module {_escaped(module[depth])} {{\n"
        opened = module
        inner = _INDENT * len(module)
        yield "".join(f"{inner}{line}\n" for line in lines)
    yield from _closing(opened, 0)


def _closing(opened: tuple[str, ...], shared: int) -> Iterator[str]:
    for depth in reversed(range(shared, len(opened))):
        yield f"{_INDENT * depth}}};\n"


# --- the order ---------------------------------------------------------------------------------------------


def _in_order(root: _Named) -> list[_Named]:
    """All types, each behind those that must be complete before it, and if that can be behind all that it needs."""
    remaining = _needs_first(root)
    order: list[_Named] = []
    done: set[int] = set()
    while remaining:
        ready = next((type_ for type_ in remaining if all(id(need) in done for need, _ in _needs(type_))), None)
        if ready is None:  # some name each other; what may be announced need not be there
            ready = next((type_ for type_ in remaining if _is_ready(type_, done)), remaining[0])
        remaining.remove(ready)
        order.append(ready)
        done.add(id(ready))
    return order


def _is_ready(type_: _Named, done: set[int]) -> bool:
    return all(id(need) in done or not is_by_value for need, is_by_value in _needs(type_))


def _needs_first(root: _Named) -> list[_Named]:
    """All types, each behind what it needs, but for those that name each other."""
    found: list[_Named] = []
    seen = {id(root)}
    pending = [(root, iter(_needs(root)))]
    while pending:
        type_, needs = pending[-1]
        need, _ = next(needs, (None, False))
        if need is None:
            found.append(type_)
            pending.pop()
        elif id(need) not in seen:
            seen.add(id(need))
            pending.append((need, iter(_needs(need))))
    return found


def _needs(type_: _Named) -> list[tuple[_Named, bool]]:
    """The types that a type names, and whether each must be complete before it."""
    found: list[tuple[_Named, bool]] = []
    if isinstance(type_, (BitsetType, StructType)) and type_.base is not None:
        found.append((type_.base, True))
    if isinstance(type_, (StructType, UnionType)):
        for member in type_.declared if isinstance(type_, StructType) else type_.members:
            found += _named(member.type, is_by_value=not member.is_optional)
    return found


def _named(type_: IdlType, *, is_by_value: bool) -> list[tuple[_Named, bool]]:
    while isinstance(type_, (SequenceType, ArrayType)):
        is_by_value = is_by_value and isinstance(type_, ArrayType)
        type_ = type_.element
    if isinstance(type_, MapType):
        return [*_named(type_.key, is_by_value=False), *_named(type_.value, is_by_value=False)]
    if isinstance(type_, (Primitive, String)):
        return []
    return [(type_, is_by_value or not isinstance(type_, (StructType, UnionType)))]


# --- names -------------------------------------------------------------------------------------------------


def _path(named: _Named) -> tuple[str, ...]:
    path = tuple(named.type_name.split("::"))
    for part in path:
        if not _NAME.fullmatch(part):
            raise BadParameter(
                f"{named.type_name}: {part!r} is no name in IDL; give the type a typename such as m::Name"
            )
    return path


def _module(named: _Named) -> tuple[str, ...]:
    return _path(named)[:-1]


def _escaped(name: str) -> str:
    """An underscore before what would be a keyword, or begins with one already."""
    return f"_{name}" if name.lower() in _FOLDED_KEYWORDS or name.startswith("_") else name


def _literal_name(literal: enum.IntEnum | enum.IntFlag) -> str:
    """The name in IDL: without the underscore that only Python needs."""
    return _escaped(literal_name_in_idl(literal.name or ""))


# --- definitions -------------------------------------------------------------------------------------------


class _Writer:
    def __init__(self, order: Sequence[_Named]) -> None:
        self._module: tuple[str, ...] = ()
        self._typedefs: list[str] = []
        self._blocks: list[_Block] = []
        self._aliases: dict[str, tuple[object, ...]] = {}
        self._taken: dict[str, str] = {}
        for module in sorted({_module(named)[:depth] for named in order for depth in range(1, len(_path(named)))}):
            self._take("::".join(module), f"the module {'::'.join(module)}")
        for named in order:
            self._take("::".join(_path(named)), named.type_name)
            if isinstance(named, EnumType):  # IDL puts the literals beside their enum
                for literal in named.python_class:
                    self._take("::".join((*_module(named), literal.name)), f"{named.type_name}.{literal.name}")

    def _take(self, path: str, what: str) -> None:
        """One path, one thing: types of one name, and literals of one name in one module, cannot be told apart."""
        earlier = self._taken.get(path.lower())
        if earlier is not None:
            raise BadParameter(
                f"{what} and {earlier} have one name in IDL, where case does not distinguish, and literals stand beside"
                " their enum; give one a typename in another module"
            )
        self._taken[path.lower()] = what

    def definition(self, named: _Named) -> list[_Block]:
        """The block of a type, behind those of the aliases that come up in it for the first time."""
        self._module = _module(named)
        self._typedefs, self._blocks = [], []
        match named:
            case EnumType():
                lines = self._enum(named)
            case BitmaskType():
                lines = self._bitmask(named)
            case BitsetType():
                lines = self._bitset(named)
            case StructType():
                lines = self._struct(named)
            case UnionType():
                lines = self._union(named)
        return [*self._blocks, (_module(named), [*self._typedefs, *lines])]

    def _enum(self, type_: EnumType) -> list[str]:
        lines = _enumerated_marks(type_)
        lines.append(f"enum {_escaped(_path(type_)[-1])} {{")
        literals = list(type_.python_class)
        due = 0
        for literal in literals:
            marks = "" if literal.value == due else f"@value({literal.value}) "
            if literal is type_.default and literal is not literals[0]:
                marks += "@default_literal "
            lines.append(f"{_INDENT}{marks}{_literal_name(literal)}{',' if literal is not literals[-1] else ''}")
            due = literal.value + 1
        return [*lines, "};"]

    def _bitmask(self, type_: BitmaskType) -> list[str]:
        lines = _enumerated_marks(type_)
        lines.append(f"bitmask {_escaped(_path(type_)[-1])} {{")
        flags = list(type_.python_class)
        if not flags:
            raise BadParameter(f"{type_.type_name}: a bitmask without flags cannot be said in IDL")
        due = 0
        for flag in flags:
            position = flag.value.bit_length() - 1
            mark = "" if position == due else f"@position({position}) "
            lines.append(f"{_INDENT}{mark}{_literal_name(flag)}{',' if flag is not flags[-1] else ''}")
            due = position + 1
        return [*lines, "};"]

    def _bitset(self, type_: BitsetType) -> list[str]:
        base, inherited, position = "", 0, 0
        if type_.base is not None:
            base, inherited, position = f" : {self._reference(type_.base)}", len(type_.base.fields), type_.base.bits
        lines = [f"bitset {_escaped(_path(type_)[-1])}{base} {{"]
        for field in sorted(type_.fields[inherited:], key=lambda field: field.position):
            if field.position < position:
                raise BadParameter(f"{type_.type_name}.{field.name}: its bits lie below those of the base")
            if field.position > position:
                lines.append(f"{_INDENT}bitfield<{field.position - position}>;")
            lines.append(f"{_INDENT}bitfield<{field.width}, {field.type}> {_escaped(field.name)};")
            position = field.position + field.width
        return [*lines, "};"]

    def _struct(self, type_: StructType) -> list[str]:
        name = _path(type_)[-1]
        inherited = type_.base.declared if type_.base is not None else ()
        base = f" : {self._reference(type_.base)}" if type_.base is not None else ""
        lines = [*_type_marks(type_), f"struct {_escaped(name)}{base} {{"]
        due = inherited[-1].id + 1 if inherited else 0
        for member in type_.declared[len(inherited) :]:
            marks = self._member_marks(member, due, is_hashed=type_.has_hashed_ids)
            lines.append(f"{_INDENT}{marks}{self._declarator(member, name)};")
            due = member.id + 1
        return [*lines, "};"]

    def _union(self, type_: UnionType) -> list[str]:
        name = _path(type_)[-1]
        if not type_.cases:
            raise BadParameter(f"{type_.type_name}: a union without cases cannot be said in IDL")
        discriminator, aliases = type_.discriminator.type, type_.discriminator.typedefs
        key = "@key " if type_.discriminator.is_key else ""
        lines = [
            *_type_marks(type_),
            f"union {_escaped(name)} switch ({key}{self._type(discriminator, aliases, name)}) {{",
        ]
        due = 1
        for case in type_.cases:
            lines += [f"{_INDENT}case {self._label(discriminator, label)}:" for label in case.labels]
            lines += [f"{_INDENT}default:"] if case.is_default else []
            marks = self._member_marks(case, due, is_hashed=type_.has_hashed_ids)
            lines.append(f"{_INDENT * 2}{marks}{self._declarator(case, name)};")
            due = case.id + 1
        return [*lines, "};"]

    def _label(self, discriminator: IdlType, label: Any) -> str:
        if isinstance(discriminator, BitmaskType):
            return _literal_name(label)
        return self._constant(discriminator, label)

    def _member_marks(self, member: Member, due: int, *, is_hashed: bool) -> str:
        """``due`` is the id that the member has by its place, unless ids ``is_hashed`` are derived from names."""
        marks = ["@key"] if member.is_key else []
        own_hash = autoid_hash(member.name_in_idl)
        if member.hash_name is not None and member.id == autoid_hash(member.hash_name or member.name_in_idl):
            marks.append(f"@hashid({self._constant(String(), member.hash_name)})" if member.hash_name else "@hashid")
        elif member.id != (own_hash if is_hashed else due):
            by_number = f"@id({member.id})" if member.id < 1 << 16 else f"@id({member.id:#x})"
            marks.append("@hashid" if member.id == own_hash else by_number)
        if member.is_optional:
            marks.append("@optional")
        if member.must_understand:
            marks.append("@must_understand")
        if member.is_external:
            marks.append("@external")
        if not member.is_serialized:
            marks.append("@non_serialized")
        if member.try_construct is not TryConstruct.DISCARD:
            marks.append(f"@try_construct({member.try_construct.name})")
        if member.limits is not None:
            limits = (("min", member.limits.minimum), ("max", member.limits.maximum))
            marks += [f"@{name}({limit!r})" for name, limit in limits if limit is not None]
        if member.unit is not None:
            marks.append(f"@unit({self._constant(String(), member.unit)})")
        if member.default is not None and not isinstance(member, Case):
            value = member.default()
            if value is not None and isinstance(member.type, (Primitive, String, EnumType)) and _is_sayable(value):
                marks.append(f"@default({self._constant(member.type, value)})")
        return "".join(f"{mark} " for mark in marks)

    # --- types -------------------------------------------------------------------------------------------

    def _declarator(self, member: Member, owner: str) -> str:
        name = member.name_in_idl
        if not _NAME.fullmatch(name):
            raise BadParameter(f"{owner}: the member {name!r} has no name in IDL; give it one by idl.name")
        return self._declared(member.type, member.typedefs, _escaped(name), f"{owner}_{name}")

    def _declared(self, type_: IdlType, aliases: Typedefs | None, name: str, where: str) -> str:
        """Type and name; the dimensions of an array stand behind the name.  ``where`` names what needs a name."""
        if not isinstance(type_, ArrayType) or self._alias(type_, aliases) is not None:
            return f"{self._type(type_, aliases, where)} {name}"
        dimensions, element = type_.dimensions, type_.element
        if aliases is not None and aliases.rows:  # the element was an alias of an array
            dimensions, element = dimensions[: aliases.rows], replace(type_, dimensions=dimensions[aliases.rows :])
        size = "".join(f"[{dimension}]" for dimension in dimensions)
        return f"{self._type(element, _part(aliases, 0), where)} {name}{size}"

    def _type(self, type_: IdlType, aliases: Typedefs | None, where: str) -> str:
        alias = self._alias(type_, aliases)
        if alias is not None:
            return alias
        match type_:
            case Primitive(name=name):
                return _PRIMITIVES.get(name, name)
            case String():
                return str(type_)
            case SequenceType(element=element, bound=bound):
                return _template("sequence", [self._type(element, _part(aliases, 0), where)], bound)
            case MapType(key=key, value=value, bound=bound):
                parts = [self._type(key, _part(aliases, 0), where), self._type(value, _part(aliases, 1), where)]
                return _template("map", parts, bound)
            case ArrayType():
                declared = self._declared(type_, aliases, "\0", where)
                alias = self._free_name(f"{where}_array")
                self._typedefs.append(f"typedef {declared.replace(chr(0), alias)};")
                return alias
            case _:
                return self._reference(type_)

    def _alias(self, type_: IdlType, aliases: Typedefs | None) -> str | None:
        """The outermost alias by which a type was said, declared in a block of its own; None where there is none.

        Nor is one used whose name is taken, or no name in IDL: then the type is said without.
        """
        if aliases is None or not aliases.names:
            return None
        bare = replace(aliases, names=())
        for number, name in enumerate(aliases.names):
            key, meaning = name.lower(), (str(type_), aliases.names[:number], bare)
            if self._aliases.get(key) == meaning:
                continue
            *module, own_name = name.split("::")
            if not self._is_free(name) or not all(_NAME.fullmatch(part) for part in (*module, own_name)):
                return None
            self._aliases[key], self._taken[key] = meaning, name
            outer = self._module, self._typedefs
            self._module, self._typedefs = tuple(module), []
            if number:
                declared = f"{self._path_reference(aliases.names[number - 1])} {_escaped(own_name)}"
            else:
                declared = self._declared(type_, bare, _escaped(own_name), own_name)
            self._blocks.append((self._module, [*self._typedefs, f"typedef {declared};"]))
            self._module, self._typedefs = outer
        return self._path_reference(aliases.names[-1])

    def _is_free(self, name: str) -> bool:
        """Whether an alias may have this name, and its modules theirs."""
        parts = name.split("::")
        for depth in range(1, len(parts)):
            module = "::".join(parts[:depth])
            if self._taken.setdefault(module.lower(), f"the module {module}") != f"the module {module}":
                return False
        return name.lower() not in self._taken

    def _free_name(self, name: str) -> str:
        number, candidate = 2, name
        while "::".join((*self._module, candidate)).lower() in self._taken:
            candidate, number = f"{name}{number}", number + 1
        self._taken["::".join((*self._module, candidate)).lower()] = candidate
        return candidate

    def _reference(self, named: _Named) -> str:
        return self._path_reference("::".join(_path(named)))

    def _path_reference(self, name: str) -> str:
        """A name as it is said here: alone in its own module, absolute elsewhere."""
        path = tuple(name.split("::"))
        if path[:-1] == self._module:
            return _escaped(path[-1])
        return "::" + "::".join(map(_escaped, path))

    def _constant(self, type_: IdlType, value: Any) -> str:
        match type_:
            case EnumType():
                return self._literal(type_, type_.python_class(value))
            case String():
                return '"' + _escaped_text(str(value), '"') + '"'
            case Primitive(name="boolean"):
                return "TRUE" if value else "FALSE"
            case Primitive(name="char" | "wchar"):
                return "'" + _escaped_text(value, "'") + "'"
            case Primitive(code="f" | "d"):
                return repr(float(value))
            case _:
                return str(int(value))

    def _literal(self, type_: EnumType, literal: enum.IntEnum) -> str:
        if _module(type_) == self._module:
            return _literal_name(literal)
        return "::" + "::".join((*map(_escaped, _module(type_)), _literal_name(literal)))


def _part(aliases: Typedefs | None, number: int) -> Typedefs | None:
    """Those of an element (0), or of a map's key (0) and value (1)."""
    return aliases.parts[number] if aliases is not None and aliases.parts else None


def _template(name: str, parts: list[str], bound: int | None) -> str:
    """``> >`` where one closes behind another: older compilers take two together for a shift."""
    inside = ", ".join(parts if bound is None else [*parts, str(bound)])
    return f"{name}<{inside}{' ' if inside.endswith('>') else ''}>"


def _type_marks(type_: Composite) -> list[str]:
    marks = [f"@{type_.extensibility.value}"]
    marks += ["@nested"] if type_.is_nested else []
    marks += ["@autoid(HASH)"] if type_.has_hashed_ids else []
    if isinstance(type_, StructType) and type_.representations:
        names = [representation.name for representation in type_.representations]
        marks.append(f"@data_representation({' | '.join(names)})")
    return [" ".join(marks)]


def _enumerated_marks(type_: EnumType | BitmaskType) -> list[str]:
    marks = [f"@{type_.extensibility.value}"] if type_.extensibility is not Extensibility.FINAL else []
    marks += [f"@bit_bound({type_.bit_bound})"] if type_.bit_bound != 32 else []
    return [" ".join(marks)] if marks else []


def _is_sayable(value: Any) -> bool:
    return not isinstance(value, float) or math.isfinite(value)


def _escaped_text(text: str, quote: str) -> str:
    def escaped(character: str) -> str:
        if character in (quote, "\\"):
            return f"\\{character}"
        if " " <= character <= "~":
            return character
        code = ord(character)
        # Octal has three digits at most, so that no digit behind it joins in.
        return f"\\{code:03o}" if code < 0o400 else f"\\u{code:04x}" if code <= 0xFFFF else character

    return "".join(map(escaped, text))
