"""Declarations to Python source as a person would write it, with the words of ``ddsi.idl``.

One file for all modules: the types one after the other, in the order of the IDL text, and behind them a class for each
module with its types as attributes, so that ``a::b::Point`` is ``a.b.Point``.  The text is formatted as ``ruff
format`` does, and clean to mypy in strict mode.
"""

from __future__ import annotations

from collections.abc import Iterator

from ..model import BOOLEAN, Extensibility, Primitive, String, TryConstruct
from .declarations import (
    Alias,
    ArrayOf,
    Bitflag,
    BitmaskDeclaration,
    BitsetDeclaration,
    Compilation,
    Constant,
    ConstantValue,
    Declaration,
    EnumDeclaration,
    Enumerator,
    MapOf,
    MemberDeclaration,
    Module,
    SequenceOf,
    StructDeclaration,
    TypeReference,
    UnionDeclaration,
    unaliased,
)
from .python_layout import Expression, Group, call, docstring, laid_out, quoted, subscript
from .python_names import literal_identifier, python_identifier, python_names

__all__ = ["PythonSource"]

_INDENT = "    "
_EXTENSIBILITIES = {extensibility: f"idl.{extensibility.name}" for extensibility in Extensibility}


class PythonSource:
    """The source for one compilation: ``text()``, and ``names``, the global name of each declaration."""

    def __init__(self, compilation: Compilation, title: str) -> None:
        self._compilation = compilation
        self._title = title
        self.names = python_names(compilation.root, compilation.declarations)
        self._written: set[Declaration] = set()
        self._lazy: set[Declaration] = set()
        self._bases = {
            declaration.base
            for declaration in compilation.declarations
            if isinstance(declaration, StructDeclaration) and declaration.base is not None
        }

    def text(self) -> str:
        blocks = [self._block(declaration) for declaration in self._compilation.declarations]
        blocks += self._namespaces()
        lines: list[str] = []
        for index, block in enumerate(blocks):
            if index:
                lines += [] if _is_line(block) and _is_line(blocks[index - 1]) else ["", ""]
            lines += block
        body = "\n".join(lines)
        return f"{self._head(body)}\n{body}\n" if body else self._head(body).rstrip() + "\n"

    def _head(self, body: str) -> str:
        typing = [name for name in ("Annotated", "Final", "TypeAlias") if f"{name}[" in body or f": {name} = " in body]
        lines = [*docstring(f"The types of {self._title}, made from it by ``ddsi idl``.", ""), ""]
        lines += ["from __future__ import annotations", ""]
        standard = ["import enum"] if "(enum.Int" in body else []
        standard += ["from dataclasses import field"] if " = field(" in body else []
        standard += [f"from typing import {', '.join(typing)}"] if typing else []
        lines += [*standard, ""] if standard else []
        lines += ["from ddsi import idl", "", ""] if "idl." in body else [""]
        return "\n".join(lines)[: None if "class " in body else -1]

    def _block(self, declaration: Declaration) -> list[str]:
        name = self.names[declaration]
        match declaration:
            case Constant():
                lines = [
                    *_comment(declaration.comment, ""),
                    laid_out(self._literal(declaration.value), f"{name}: Final = "),
                ]
            case Alias():
                lines = [*_comment(declaration.comment, ""), *self._alias(declaration, name)]
            case EnumDeclaration():
                lines = self._enum(declaration, name)
            case BitmaskDeclaration():
                lines = self._bitmask(declaration, name)
            case BitsetDeclaration():
                lines = self._bitset(declaration, name)
            case StructDeclaration():
                lines = self._struct(declaration, name)
            case UnionDeclaration():
                lines = self._union(declaration, name)
            case _:
                lines = []
        self._written.add(declaration)
        return lines

    # --- types -------------------------------------------------------------------------------------------

    def type(self, type_: TypeReference) -> Expression:
        """The annotation that says a type."""
        match type_:
            case Primitive(name=name):
                return f"idl.{name}"
            case String(bound=bound, wide=wide):
                plain = "idl.wstring" if wide else "str"
                return plain if bound is None else _annotated(plain, f"idl.bound({bound})")
            case SequenceOf(element=element, bound=bound):
                sequence = subscript("idl.sequence", self.type(element))
                return sequence if bound is None else _annotated(sequence, f"idl.bound({bound})")
            case MapOf(key=key, value=value, bound=bound):
                mapping = subscript("idl.map", self.type(key), self.type(value))
                return mapping if bound is None else _annotated(mapping, f"idl.bound({bound})")
            case ArrayOf(element=element, dimensions=dimensions):
                rows = self.type(element)
                for _ in dimensions:
                    rows = subscript("idl.sequence", rows)
                return _annotated(rows, call("idl.array", [str(dimension) for dimension in dimensions]))
            case Alias() if _is_class(type_):  # the name is that of the class, which remains one
                return _annotated(self.type(type_.type), _typedef(type_))
            case Declaration():
                return self.names[type_]

    def _alias(self, alias: Alias, name: str) -> list[str]:
        type_ = self.type(unaliased(alias)) if _is_class(alias) else _annotated(self.type(alias.type), _typedef(alias))
        if self._is_lazy(alias.type):  # in quotes, since it names what comes further down
            self._lazy.add(alias)
            return [laid_out(quoted(str(type_)), f"{name}: TypeAlias = ")]
        return [laid_out(type_, f"{name}: TypeAlias = ")]

    def _is_lazy(self, type_: TypeReference) -> bool:
        match type_:
            case SequenceOf(element=element) | ArrayOf(element=element):
                return self._is_lazy(element)
            case MapOf(key=key, value=value):
                return self._is_lazy(key) or self._is_lazy(value)
            case Alias():
                return type_ in self._lazy
            case StructDeclaration() | UnionDeclaration():
                return type_ not in self._written
            case _:
                return False

    def _optional(self, type_: TypeReference) -> Expression:
        """``T | None``.  A name for quoted text cannot stand there, so what it says does."""
        markers: list[Expression] = []
        while isinstance(type_, Alias) and type_ in self._lazy:
            markers.insert(0, _typedef(type_))
            type_ = type_.type
        found = _annotated(self.type(type_), *markers) if markers else self.type(type_)
        return (
            f"{found} | None" if isinstance(found, str) else Group(found.head, found.brackets, found.parts, " | None")
        )

    def _literal(self, value: ConstantValue) -> str:
        match value:
            case Enumerator():
                return f"{self.names[value.enum]}.{literal_identifier(value.name)}"
            case Bitflag():
                return f"{self.names[value.bitmask]}.{literal_identifier(value.name)}"
            case str():
                return quoted(value)
            case _:
                return repr(value)

    # --- enums, bitmasks, bitsets ------------------------------------------------------------------------

    def _enum(self, enum: EnumDeclaration, name: str) -> list[str]:
        options = _typename(enum, name)
        options += [f"bit_bound={enum.bit_bound}"] if enum.bit_bound != 32 else []
        if enum.default is not None:
            options.append(f"default={quoted(literal_identifier(enum.default.name))}")
        options += _extensibility_unless_final(enum)
        lines = [laid_out(call("@idl.enum", options), "")] if options else []
        lines += [f"class {name}(enum.IntEnum):", *self._documentation(enum)]
        for literal in enum.literals:
            lines += [*_comment(literal.comment), f"{_INDENT}{literal_identifier(literal.name)} = {literal.value}"]
        return lines

    def _bitmask(self, bitmask: BitmaskDeclaration, name: str) -> list[str]:
        options = _typename(bitmask, name)
        options += [f"bit_bound={bitmask.bit_bound}"] if bitmask.bit_bound != 32 else []
        options += _extensibility_unless_final(bitmask)
        lines = [laid_out(call("@idl.bitmask", options), "")] if options else []
        lines += [f"class {name}(enum.IntFlag):", *self._documentation(bitmask)]
        return [*lines, *(f"{_INDENT}{literal_identifier(flag)} = 1 << {at}" for flag, at in bitmask.flags.items())]

    def _bitset(self, bitset: BitsetDeclaration, name: str) -> list[str]:
        base = f"({self.names[bitset.base]})" if bitset.base is not None else ""
        lines = [laid_out(call("@idl.bitset", _typename(bitset, name)), ""), f"class {name}{base}:"]
        lines += self._documentation(bitset, is_empty=not bitset.fields)
        behind = bitset.base.end if bitset.base is not None else 0
        for field in bitset.fields:
            at = "" if field.position == behind else f", at={field.position}"
            zero = "False" if field.type == BOOLEAN else "0"
            lines += _comment(field.comment)
            annotation = _annotated(f"idl.{field.type.name}", f"idl.bits({field.width}{at})")
            lines.append(laid_out(annotation, f"{_INDENT}{python_identifier(field.name)}: ", f" = {zero}"))
            behind = field.position + field.width
        return lines

    # --- structs and unions ------------------------------------------------------------------------------

    def _struct(self, struct: StructDeclaration, name: str) -> list[str]:
        base = f"({self.names[struct.base]})" if struct.base is not None else ""
        lines = [laid_out(call("@idl.struct", _composite_options(struct, name)), ""), f"class {name}{base}:"]
        lines += self._documentation(struct, is_empty=not struct.members)
        required = [index for index, member in enumerate(struct.members) if not _may_be_left_out(member)]
        trailing = len(struct.members) if struct in self._bases else required[-1] + 1 if required else 0
        taken = {python_identifier(member.name) for member in struct.base.all_members()} if struct.base else set[str]()
        for index, member in enumerate(struct.members):
            attribute = python_identifier(member.name, taken)
            taken.add(attribute)
            value = self._default(member, is_trailing=index >= trailing)
            lines += _comment(member.comment)
            lines.append(laid_out(self._member(member, attribute), f"{_INDENT}{attribute}: ", value))
        return lines

    def _default(self, member: MemberDeclaration, *, is_trailing: bool) -> str:
        """What stands behind the annotation.  Before members without a default, one is a matter of keywords."""
        if member.default is not None:
            literal = self._literal(member.default)
            return f" = {literal}" if is_trailing else f" = field(default={literal}, kw_only=True)"
        return " = None" if member.is_optional and is_trailing else ""

    def _member(self, member: MemberDeclaration, attribute: str) -> Expression:
        type_ = self._optional(member.type) if member.is_optional else self.type(member.type)
        markers = []
        if member.is_key:
            markers.append("idl.key")
        if member.is_id_explicit:
            markers.append(f"idl.id({member.id})")
        elif member.hash_name is not None:
            markers.append(f"idl.hashid({quoted(member.hash_name)})" if member.hash_name else "idl.hashid")
        if member.must_understand:
            markers.append("idl.must_understand")
        if member.is_external:
            markers.append("idl.external")
        if not member.is_serialized:
            markers.append("idl.non_serialized")
        if member.try_construct is not TryConstruct.DISCARD:
            markers.append(f"idl.try_construct({quoted(member.try_construct.value)})")
        if member.limits is not None:
            limits = {"min": member.limits.minimum, "max": member.limits.maximum}
            said = [f"{name}={limit!r}" for name, limit in limits.items() if limit is not None]
            markers.append(f"idl.range({', '.join(said)})")
        if member.unit is not None:
            markers.append(f"idl.unit({quoted(member.unit)})")
        if attribute != member.name:
            markers.append(f"idl.name({quoted(member.name)})")
        return _annotated(type_, *markers) if markers else type_

    def _union(self, union: UnionDeclaration, name: str) -> list[str]:
        assert union.discriminator is not None
        lines = [laid_out(call("@idl.union", _composite_options(union, name)), ""), f"class {name}:"]
        lines += self._documentation(union)
        switch = "discriminator"
        type_ = self.type(union.discriminator)
        type_ = _annotated(type_, "idl.key") if union.is_discriminator_key else type_
        lines.append(laid_out(type_, f"{_INDENT}{switch}: ", " = idl.switch"))
        taken = {switch}
        for member in union.members:
            attribute = python_identifier(member.name, taken)
            taken.add(attribute)
            labels: list[Expression] = [self._literal(label) for label in member.labels]
            labels += ["default=True"] if member.is_default_case else []
            lines += _comment(member.comment)
            annotation, case = self._member(member, attribute), call("idl.case", labels)
            if isinstance(annotation, str):
                lines.append(laid_out(case, f"{_INDENT}{attribute}: {annotation} = "))
            else:
                lines.append(laid_out(annotation, f"{_INDENT}{attribute}: ", f" = {case}"))
        return lines

    def _documentation(self, declaration: Declaration, *, is_empty: bool = False) -> list[str]:
        if declaration.comment:
            return [*docstring(declaration.comment, _INDENT), *([] if is_empty else [""])]
        return (
            docstring(f"The IDL type {declaration.scoped_name}, which has no members of its own.", _INDENT)
            if is_empty
            else []
        )

    # --- modules -----------------------------------------------------------------------------------------

    def _namespaces(self) -> Iterator[list[str]]:
        for member in self._compilation.root.members.values():
            if isinstance(member, Module):
                yield self._namespace(member, "")

    def _namespace(self, module: Module, indent: str) -> list[str]:
        inner = indent + _INDENT
        lines = [f"{indent}class {python_identifier(module.name)}:"]
        lines += docstring(module.comment or f"The IDL module {module.scoped_name}.", inner)
        attributes = []
        for member in module.members.values():
            if member in self.names:
                kind = "Final" if isinstance(member, Constant) else "TypeAlias"
                attributes.append(laid_out(self.names[member], f"{inner}{python_identifier(member.name)}: {kind} = "))
        lines += ["", *attributes] if attributes else []
        for member in module.members.values():
            if isinstance(member, Module):
                lines += ["", *self._namespace(member, inner)]
        return lines


def _annotated(type_: Expression, *markers: Expression) -> Group:
    """``Annotated[type, markers]``; markers join those that the type has already."""
    if isinstance(type_, Group) and type_.head == "Annotated" and not type_.tail:
        return subscript("Annotated", *type_.parts, *markers)
    return subscript("Annotated", type_, *markers)


def _is_class(alias: Alias) -> bool:
    """Whether it is one of a struct, union, enum, bitmask or bitset, to be called or used like that itself."""
    return isinstance(unaliased(alias), Declaration)


def _typedef(alias: Alias) -> Expression:
    return f"idl.typedef({quoted(alias.scoped_name)})"


def _extensibility_unless_final(declaration: EnumDeclaration | BitmaskDeclaration) -> list[str]:
    if declaration.extensibility is Extensibility.FINAL:
        return []
    return [f"extensibility={_EXTENSIBILITIES[declaration.extensibility]}"]


def _typename(declaration: Declaration, name: str) -> list[Expression]:
    return [f"typename={quoted(declaration.scoped_name)}"] if declaration.scoped_name != name else []


def _composite_options(composite: StructDeclaration | UnionDeclaration, name: str) -> list[Expression]:
    options = _typename(composite, name)
    options.append(f"extensibility={_EXTENSIBILITIES[composite.extensibility]}")
    options += ['autoid="hash"'] if composite.is_hashed else []
    options += ["nested=True"] if composite.is_nested else []
    if composite.representations and isinstance(composite, StructDeclaration):
        names = [f"idl.{representation.name}" for representation in composite.representations]
        options.append(f"representations=({', '.join(names)}{',' if len(names) == 1 else ''})")
    return options


def _may_be_left_out(member: MemberDeclaration) -> bool:
    return member.default is not None or member.is_optional


def _comment(text: str, indent: str = _INDENT) -> list[str]:
    return [f"{indent}# {line}".rstrip() for line in text.splitlines()]


def _is_line(block: list[str]) -> bool:
    """A constant or typedef, which needs no empty lines around it."""
    return not any(line.startswith(("class ", "@")) for line in block)
