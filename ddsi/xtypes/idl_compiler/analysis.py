"""The analysis: syntax tree to declarations, with every name looked up and every rule checked that one file can show.

OMG IDL 4.2 §7.4 and §7.5, DDS-XTypes 1.3 §7.3.  Modules, constants, typedefs and the types of numbers are here; what
concerns members stands in ``composites.py``.
"""

from __future__ import annotations

from collections.abc import Sequence

from .. import model
from ..model import Extensibility, Primitive
from .annotations import Annotations
from .composites import CompositeAnalysis
from .constants import evaluate, fitted, unsigned_bits
from .declarations import (
    Alias,
    ArrayOf,
    BitmaskDeclaration,
    BitsetDeclaration,
    BitsetField,
    Compilation,
    Constant,
    EnumDeclaration,
    Enumerator,
    Module,
    SkippedDeclaration,
    unaliased,
)
from .scopes import declare, look_up
from .source_text import IdlError, IdlWarning, Place
from .syntax import (
    BitfieldNode,
    BitmaskNode,
    BitsetNode,
    ConstNode,
    Definition,
    EnumNode,
    ForwardNode,
    KeylistNode,
    ModuleNode,
    SkippedNode,
    StructNode,
    TypedefNode,
    UnionNode,
)

__all__ = ["analyze"]

MOST_LINKS = 100
"""Typedefs of typedefs.  In Python each remembers the whole chain."""


def analyze(
    definitions: Sequence[Definition], place: Place, *, default_extensibility: Extensibility, warnings: list[IdlWarning]
) -> Compilation:
    """The declarations of a file.  ``place`` is the file's beginning.  IdlError for what cannot be."""
    root = Module((), place)
    analysis = _Analysis(root, default_extensibility, warnings)
    analysis.definitions(definitions)
    analysis.finish()
    return Compilation(root, analysis.declarations, warnings)


class _Analysis(CompositeAnalysis):
    def definitions(self, definitions: Sequence[Definition]) -> None:
        for definition in definitions:
            self._definition(definition)

    def _definition(self, node: Definition) -> None:
        match node:
            case ModuleNode():
                self._module(node)
            case ConstNode():
                self._const(node)
            case TypedefNode():
                self._typedef(node)
            case EnumNode():
                self._enum(node)
            case BitmaskNode():
                self._bitmask(node)
            case BitsetNode():
                self._bitset(node)
            case StructNode():
                self.struct(node)
            case UnionNode():
                self.union(node)
            case ForwardNode():
                self.forward(node)
            case KeylistNode():
                self.keylists.append((self.scope, node))
            case SkippedNode() if node.name not in self.scope.members:
                declare(self.scope, SkippedDeclaration(self.path(node.name), node.place, kind=node.kind))

    def _module(self, node: ModuleNode) -> None:
        found = self.scope.members.get(node.name)
        if isinstance(found, Module):
            module = found
        else:
            module = Module(self.path(node.name), node.place, node.comment, parent=self.scope)
            declare(self.scope, module)
        annotations = Annotations(node.annotations, self.lookup, self.warnings)
        outer = self.scope, self.is_hashed, self.is_nested
        self.is_hashed = annotations.is_hashed(default=self.is_hashed)
        self.is_nested = annotations.flag("default_nested", default=self.is_nested)
        annotations.warn_of_the_rest()
        self.scope = module
        self.definitions(node.definitions)
        self.scope, self.is_hashed, self.is_nested = outer

    # --- constants and typedefs --------------------------------------------------------------------------

    def _const(self, node: ConstNode) -> None:
        type_ = self.type_of(node.type)
        Annotations(node.annotations, self.lookup, self.warnings).warn_of_the_rest()
        value = fitted(evaluate(node.value, self.lookup, bits=unsigned_bits(type_)), type_, node.value.place)
        self.add(Constant(self.path(node.name), node.place, node.comment, type=type_, value=value))

    def _typedef(self, node: TypedefNode) -> None:
        type_ = self.type_of(node.type)
        Annotations(node.annotations, self.lookup, self.warnings).warn_of_the_rest()
        if node.dimensions:
            type_ = ArrayOf(type_, self.dimensions(node.dimensions))
        alias = Alias(self.path(node.name), node.place, node.comment, type=type_)
        known = self.scope.members.get(node.name)
        if isinstance(known, Alias) and known.type == type_:
            return  # the same typedef again says nothing new
        if alias.links > MOST_LINKS:
            raise IdlError(node.place, f"typedefs follow each other through more than {MOST_LINKS}")
        self.add(alias)

    # --- enums, bitmasks, bitsets ------------------------------------------------------------------------

    def _enum(self, node: EnumNode) -> None:
        annotations = Annotations(node.annotations, self.lookup, self.warnings)
        bit_bound = annotations.number("bit_bound", 1, 32) or 32
        enum = EnumDeclaration(self.path(node.name), node.place, node.comment, bit_bound=bit_bound)
        enum.extensibility = annotations.enumerated_extensibility()
        declare(self.scope, enum)
        limit = 1 << (8 if bit_bound <= 8 else 16 if bit_bound <= 16 else 32) - 1
        values: dict[int, str] = {}
        for literal in node.literals:
            own = Annotations(literal.annotations, self.lookup, self.warnings)
            value = enum.literals[-1].value + 1 if enum.literals else 0
            given = own.number("value", -(1 << 31), (1 << 31) - 1)
            if literal.value is not None:
                number = evaluate(literal.value, self.lookup)
                if isinstance(number, bool) or not isinstance(number, int):
                    raise IdlError(literal.value.place, "the value of a literal is an integer")
                given = number
            value = value if given is None else given
            if not -limit <= value < limit:
                raise IdlError(literal.place, f"{literal.name} is {value}, which does not fit @bit_bound({bit_bound})")
            if value in values:
                raise IdlError(literal.place, f"{literal.name} is {value}, and so is {values[value]}")
            values[value] = literal.name
            enumerator = Enumerator(self.path(literal.name), literal.place, literal.comment, value, enum=enum)
            enum.literals.append(enumerator)
            if own.find("default_literal"):
                enum.default = enumerator
            own.warn_of_the_rest()
            declare(self.scope, enumerator)
        annotations.warn_of_the_rest()
        self.declarations.append(enum)

    def _bitmask(self, node: BitmaskNode) -> None:
        annotations = Annotations(node.annotations, self.lookup, self.warnings)
        bit_bound = annotations.number("bit_bound", 1, 64) or 32
        bitmask = BitmaskDeclaration(self.path(node.name), node.place, node.comment, bit_bound=bit_bound)
        bitmask.extensibility = annotations.enumerated_extensibility()
        position = -1
        for flag in node.flags:
            own = Annotations(flag.annotations, self.lookup, self.warnings)
            given = own.number("position", 0, 63)
            position = position + 1 if given is None else given
            own.warn_of_the_rest()
            if position >= bit_bound:
                raise IdlError(
                    flag.place, f"{flag.name} is bit {position}; @bit_bound({bit_bound}) has bits 0 to {bit_bound - 1}"
                )
            for other, taken in bitmask.flags.items():
                if taken == position:
                    raise IdlError(flag.place, f"{flag.name} is bit {position}, and so is {other}")
                if other.lower() == flag.name.lower():
                    raise IdlError(flag.place, f"{flag.name} is there twice")
            bitmask.flags[flag.name] = position
        annotations.warn_of_the_rest()
        self.add(bitmask)

    def _bitset(self, node: BitsetNode) -> None:
        base: BitsetDeclaration | None = None
        if node.base is not None:
            found = look_up(node.base, self.scope)
            bare = unaliased(found) if isinstance(found, Alias) else found
            if not isinstance(bare, BitsetDeclaration):
                raise IdlError(node.base.place, f"expected a bitset as base; {node.base} is none")
            base = bare
        Annotations(node.annotations, self.lookup, self.warnings).warn_of_the_rest()
        bitset = BitsetDeclaration(self.path(node.name), node.place, node.comment, base=base)
        position = base.end if base is not None else 0
        taken = {field.name.lower() for field in base.fields} if base is not None else set[str]()
        for field in node.fields:
            width = self.bound(field.width, "the width of a field", 64)
            if position + width > 64:
                raise IdlError(field.place, f"the field would end at bit {position + width}; a bitset has 64")
            Annotations(field.annotations, self.lookup, self.warnings).warn_of_the_rest()
            if field.name:
                if field.name.lower() in taken:
                    raise IdlError(field.place, f"{field.name} is there twice")
                taken.add(field.name.lower())
                type_ = self._bitfield_type(field, width)
                bitset.fields.append(BitsetField(field.name, position, width, type_, field.comment))
            position += width
        if not bitset.fields and base is None:
            raise IdlError(node.place, f"{node.name} has no field; a bitset has one at least")
        self.add(bitset)

    def _bitfield_type(self, field: BitfieldNode, width: int) -> Primitive:
        if field.type is None:
            smallest = (
                (1, model.BOOLEAN),
                (8, model.UINT8),
                (16, model.UINT16),
                (32, model.UINT32),
                (64, model.UINT64),
            )
            return next(type_ for bits, type_ in smallest if width <= bits)
        type_ = unaliased(self.type_of(field.type))
        if not isinstance(type_, Primitive) or type_.code in "fd" or not (type_.is_number or type_ == model.BOOLEAN):
            raise IdlError(field.type.place, "a field of a bitset is a boolean or an integer")
        if width > (1 if type_ == model.BOOLEAN else 8 * type_.size):
            raise IdlError(field.width.place, f"{width} bits are more than a {type_} has")
        return type_

    # --- the end -----------------------------------------------------------------------------------------

    def finish(self) -> None:
        """What can be said only when all is read: keylists, and types that were announced and never defined."""
        for scope, node in self.keylists:
            self.keylist(scope, node)
        for use, composite in self.incomplete_uses:
            if not composite.is_defined:
                raise IdlError(use, f"{composite.scoped_name} is declared, but never defined")
