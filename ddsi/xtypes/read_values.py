"""Generate the reading of values that are no structs: items, strings, sequences and arrays.

The collections half of ``read_source.py``, which says how generated readers work.
"""

from __future__ import annotations

import struct
from collections.abc import Callable
from typing import Any

from .buffers import needs_swap
from .defaults import numpy_dtype
from .layout import ALIGNED, UNKNOWN, Encoding, after, has_dheader
from .model import (
    BOOLEAN,
    CHAR,
    WCHAR,
    ArrayType,
    BitmaskType,
    BitsetType,
    EnumType,
    IdlType,
    MapType,
    Primitive,
    SequenceType,
    String,
    StructType,
    UnionType,
)
from .read_emitter import ReadEmitter
from .recursion import FunctionPlan
from .source import Source
from .stride import Stride, stride

__all__ = ["ValueReader", "enumerations", "numpy_reader"]

_IN_RUN = 256
"""Arrays of primitives up to so many octets are part of a run; larger ones are copied only once."""


def numpy_reader(type_: SequenceType | ArrayType, order: str) -> Callable[[Any, int, int], Any]:
    """The function of octets, start and end that returns the numbers there as a numpy array, in this machine's byte
    order and memory of its own.  It raises ValueError where they are not there, or are no booleans."""
    import numpy  # here, since the user's annotation named it

    assert isinstance(type_.element, Primitive)
    size = type_.element.size
    own = numpy.dtype(numpy_dtype(type_.element))
    sent = numpy.dtype("u1" if type_.element == BOOLEAN else numpy_dtype(type_.element, order))
    frombuffer, nothing = numpy.frombuffer, numpy.empty(0, own)

    def numbers(octets: Any, start: int, end: int) -> Any:
        if start == end:
            return nothing.copy()
        return frombuffer(octets, sent, (end - start) // size, start).astype(own)

    def booleans(octets: Any, start: int, end: int) -> Any:
        if start == end:
            return nothing.copy()
        found = frombuffer(octets, sent, end - start, start)
        if found.max() > 1:
            raise ValueError
        return found.astype(own)

    read = booleans if type_.element == BOOLEAN else numbers
    if not isinstance(type_, ArrayType) or len(type_.dimensions) == 1:
        return read
    dimensions = type_.dimensions
    return lambda octets, start, end: read(octets, start, end).reshape(dimensions)


def enumerations(d: Any, start: int, count: int, item_format: str, size: int, make: Callable[[int], Any]) -> list[Any]:
    """``count`` enum literals or bitmasks; raises for what is none, or not there."""
    if start + count * size > len(d):
        raise IndexError("elements beyond the end")
    return [make(number) for number in struct.unpack_from(f"{item_format[0]}{count}{item_format[1]}", d, start)]


class ValueReader:
    """Drives a :class:`ReadEmitter` over a type.  Methods return the expression of the value read."""

    def __init__(self, source: Source, encoding: Encoding, plan: FunctionPlan, *, view: bool) -> None:
        self._source = source
        self._encoding = encoding
        self._plan = plan
        self._view = view
        self._emitter = ReadEmitter(source, encoding, base="", offset=4, residue=ALIGNED)
        self._depth = "0"

    # --- one method for each kind of type -------------------------------------------------------------

    def value(self, type_: IdlType) -> str:
        match type_:
            case Primitive() | EnumType() | BitmaskType() | BitsetType():
                self._emitter.align(self._encoding.alignment(type_.size))
                return self._item(type_, self._emitter.item(type_.code, type_.size))
            case String(wide=True):
                return self._wide_string(type_)
            case String():
                return self._string(type_)
            case SequenceType(element=Primitive() as element):
                return self._primitive_sequence(type_, element)
            case SequenceType():
                return self._sequence(type_)
            case ArrayType(element=Primitive() as element):
                return self._primitive_array(type_, element)
            case ArrayType():
                return self._array(type_)
            case MapType():
                return self._map(type_)
            case StructType():
                return self._struct(type_)
            case UnionType():
                return self._union(type_)

    def _item(self, type_: Primitive | EnumType | BitmaskType | BitsetType, raw: str) -> str:
        match type_:
            case EnumType():
                return f"{self._enum_table(type_)}[{raw}]"
            case BitmaskType():
                return f"bitmask_from({self._source.constant('Flags', type_.python_class)}, {raw})"
            case BitsetType():
                return f"bitset_from({self._source.constant('bitset', type_)}, {raw})"
        if type_ == BOOLEAN:
            return f"(False, True)[{raw}]"
        return f"chr({raw})" if type_ in (CHAR, WCHAR) else raw

    def _enum_table(self, type_: EnumType) -> str:
        """A dict from number to literal (a number without literal: KeyError)."""
        name = f"literals_{self._source.constant('Enum', type_.python_class)}"
        self._source.names[name] = {literal.value: literal for literal in type_.python_class}
        return name

    def _string(self, type_: String) -> str:
        emitter = self._emitter
        emitter.align(4)
        count = emitter.item("I", 4, "n")
        emitter.flush()
        start = emitter.position
        end, text = self._source.fresh("e"), self._source.fresh("s")
        emitter.then(f"{end} = {start} + {count}")
        emitter.then(
            f"{text} = " + (f"str(d[{start}:{end} - 1], 'utf-8')" if self._view else f"d[{start}:{end} - 1].decode()")
        )
        # The octet before the end must be the NUL.  With a length of 0, which old writers use for the empty
        # string, it is the length's own last octet, or its first in big endian: 0 as well.
        condition = f"d[{end} - 1]"
        emitter.refuse(condition if type_.bound is None else f"{condition} or {count} > {type_.bound + 1}")
        emitter.move(end, UNKNOWN)
        return text

    def _wide_string(self, type_: String) -> str:
        emitter = self._emitter
        emitter.align(4)
        count = emitter.item("I", 4, "n")
        emitter.refuse(f"{count} & 1" if type_.bound is None else f"{count} & 1 or {count} > {2 * type_.bound}")
        emitter.flush()
        start, residue = emitter.position, emitter.residue.advance_multiple(2)
        end, text = self._source.fresh("e"), self._source.fresh("s")
        emitter.then(f"{end} = {start} + {count}")
        emitter.refuse(f"{end} > len(d)")
        emitter.then(f"{text} = {self._characters(WCHAR, f'd[{start}:{end}]')}")
        emitter.move(end, residue)
        return text

    # --- collections -------------------------------------------------------------------------------------

    def _primitive_sequence(self, type_: SequenceType, element: Primitive) -> str:
        emitter = self._emitter
        emitter.align(4)
        count = emitter.item("I", 4, "n")
        if type_.bound is not None:
            emitter.refuse(f"{count} > {type_.bound}")
        emitter.flush()
        self._align_elements(element.size, count)
        start = emitter.position
        residue = emitter.residue.advance_multiple(element.size)
        end = self._source.fresh("e")
        emitter.then(f"{end} = {start} + {count}" + (f" * {element.size}" if element.size > 1 else ""))
        value = self._primitives(type_, element, start, end)
        emitter.move(end, residue)
        return value

    def _align_elements(self, size: int, count: str) -> None:
        """In XCDR1 padding to 8 lies between count and elements, unless there are none (measured: s05)."""
        emitter = self._emitter
        residue = emitter.residue
        padding = residue.padding(8)
        if self._encoding.alignment(size) != 8 or padding == 0:
            return
        name = self._source.fresh("p")
        expression = f"(-({emitter.position} - {emitter.origin}) & 7)" if padding is None else str(padding)
        emitter.then(f"{name} = {emitter.position} + ({expression} if {count} else 0)")
        emitter.move(name, residue.meet(ALIGNED))

    def _primitives(self, type_: SequenceType | ArrayType, element: Primitive, start: str, end: str) -> str:
        """The elements between two indices.  Where a slice comes out short, the position tells in the end."""
        piece = f"d[{start}:{end}]"
        name = self._source.fresh("a")
        if type_.numpy:
            read = self._source.constant("numpy_", numpy_reader(type_, self._encoding.order))
            expression = f"{read}(d, {start}, {end})"
        elif element.is_octet:
            expression = f"bytes({piece})" if self._view else piece
        elif element.is_number:
            swap = needs_swap(little_endian=self._encoding.little_endian)
            expression = f"number_array('{element.code}', d, {start}, {end}, swap={swap})"
        else:
            expression = self._characters(element, piece)
        self._emitter.then(f"{name} = {expression}")
        return name

    def _characters(self, element: Primitive, piece: str) -> str:
        if element == BOOLEAN:
            return f"booleans_from({piece})"
        if element == WCHAR:
            return f"wchars_from({piece}, little_endian={self._encoding.little_endian})"
        return f"str({piece}, 'latin-1')"

    def _primitive_array(self, type_: ArrayType, element: Primitive) -> str:
        emitter = self._emitter
        octets = type_.count * element.size
        emitter.align(self._encoding.alignment(element.size))
        if octets > _IN_RUN or type_.numpy:
            emitter.flush()
            flat = self._primitives(type_, element, emitter.position, emitter.position_after(octets))
            emitter.refuse(f"{emitter.position_after(octets)} > len(d)")
            emitter.skip(octets)
        else:
            piece = emitter.item(f"{octets}s", octets)
            flat = self._source.fresh("a")
            emitter.then(f"{flat} = {self._array_piece(element, piece, octets)}")
        if len(type_.dimensions) == 1 or type_.numpy:
            return flat
        return f"nest({flat}, {type_.dimensions})"

    def _array_piece(self, element: Primitive, piece: str, octets: int) -> str:
        if element.is_octet:
            return piece
        if element.is_number:
            if needs_swap(little_endian=self._encoding.little_endian):
                return f"number_array('{element.code}', {piece}, 0, {octets}, swap=True)"
            return f"array('{element.code}', {piece})"
        return self._characters(element, piece)

    def _sequence(self, type_: SequenceType) -> str:
        emitter = self._emitter
        delimiter = self._open_dheader(type_)
        emitter.align(4)
        count = emitter.item("I", 4, "n")
        if type_.bound is not None:
            emitter.refuse(f"{count} > {type_.bound}")
        value = self._elements(type_.element, count)
        self._close_dheader(delimiter)
        return value

    def _array(self, type_: ArrayType) -> str:
        delimiter = self._open_dheader(type_)
        value = self._elements(type_.element, str(type_.count))
        self._close_dheader(delimiter)
        return value if len(type_.dimensions) == 1 else f"nest({value}, {type_.dimensions})"

    def _elements(self, element: IdlType, count: str) -> str:
        emitter, encoding = self._emitter, self._encoding
        emitter.flush()
        value = self._source.fresh("l")
        if isinstance(element, (EnumType, BitmaskType, BitsetType)):
            self._enumeration_elements(element, count, value)
            return value
        emitter.then(f"{value} = []")
        step = stride(element, emitter.residue, encoding)
        if step is not None and not (count.isdecimal() and step.gap > 4):
            self._elements_by_iter_unpack(element, count, value, step)
            return value
        residue = emitter.residue
        while (behind := residue.meet(after(element, residue, encoding))) != residue:
            residue = behind
        with emitter.loop(f"for _ in range({count}):", residue), self._plan.inside():
            expression = self.value(element)
            emitter.flush()
            emitter.then(f"{value}.append({expression})")
        return value

    def _map(self, type_: MapType) -> str:
        emitter = self._emitter
        delimiter = self._open_dheader(type_)
        emitter.align(4)
        count = emitter.item("I", 4, "n")
        # An entry has two octets at least: a count that promises more than there is ends with an IndexError early.
        emitter.refuse(f"2 * {count} > len(d)" + (f" or {count} > {type_.bound}" if type_.bound is not None else ""))
        value = self._source.fresh("m")
        emitter.flush()
        emitter.then(f"{value} = {{}}")
        with emitter.loop(f"for _ in range({count}):", UNKNOWN), self._plan.inside():
            key = self._source.fresh("x")
            expression = self.value(type_.key)
            emitter.flush()
            emitter.then(f"{key} = {expression}")
            expression = self.value(type_.value)
            emitter.flush()
            emitter.then(f"{value}[{key}] = {expression}")
        emitter.refuse(f"len({value}) != {count}")
        self._close_dheader(delimiter)
        return value

    def _enumeration_elements(self, element: EnumType | BitmaskType | BitsetType, count: str, value: str) -> None:
        emitter = self._emitter
        if self._encoding.alignment(element.size) == 8:
            self._align_elements(element.size, count)
        else:
            emitter.align(self._encoding.alignment(element.size))
        if isinstance(element, EnumType):
            make = f"{self._enum_table(element)}.__getitem__"
        else:
            make = f"lambda number: {self._item(element, 'number')}"
        item_format = self._encoding.order + element.code
        residue = emitter.residue.advance_multiple(element.size)
        emitter.then(f"{value} = enumerations(d, {emitter.position}, {count}, '{item_format}', {element.size}, {make})")
        end = self._source.fresh("e")
        emitter.then(f"{end} = {emitter.position} + {count} * {element.size}")
        emitter.move(end, residue)

    def _elements_by_iter_unpack(self, element: IdlType, count: str, value: str, step: Stride) -> None:
        """All elements by one iterator in C: their layout is the same for each.

        The gap between elements is read as if it came before each.  In front of the first there are octets enough:
        those of a count, or before an array at least the four of the encapsulation header.
        """
        emitter, source = self._emitter, self._source
        before, end = emitter.residue, source.fresh("e")
        emitter.then(f"{end} = {emitter.position} + {self._octets_of_elements(count, step)}")
        emitter.move(end, step.residue)
        with self._plan.inlining_all():  # at most as many structs as octets
            expression = self.value(element)
        codes, names = emitter.take_run()
        behind = step.size - struct.calcsize(self._encoding.order + codes)  # octets that nobody wants
        pieces = (f"{step.gap}x" if step.gap else "", codes, f"{behind}x" if behind else "")
        iterator = source.define("iter_unpack_", f'Struct("{self._encoding.order}{"".join(pieces)}").iter_unpack')
        octets = f"d[{end} - {count} * {step.octets}:{end}]"
        with source.block(f"for {', '.join(names)}, in {iterator}({octets}):"):
            emitter.emit_held()
            source.line(f"{value}.append({expression})")
        emitter.move(end, step.behind(before, count))

    def _octets_of_elements(self, count: str, step: Stride) -> str:
        """The expression of what the elements take, padding before the first of them included."""
        emitter = self._emitter
        octets = f"{count} * {step.octets}" + (f" - {step.gap}" if step.gap else "")
        padding = emitter.residue.padding(step.alignment)
        if padding is None:
            octets = f"(-({emitter.position} - {emitter.origin}) & {step.alignment - 1}) + {octets}"
        elif padding:
            octets = f"{padding} + {octets}"
        elif not step.gap:
            return octets
        return octets if count.isdecimal() else f"({octets} if {count} else 0)"

    def _open_dheader(self, type_: IdlType) -> tuple[str, str] | None:
        if not has_dheader(type_, self._encoding):
            return None
        emitter = self._emitter
        emitter.align(4)
        return emitter.item("I", 4, "h"), emitter.position

    def _close_dheader(self, delimiter: tuple[str, str] | None) -> None:
        if delimiter is not None:
            length, start = delimiter
            self._emitter.flush()
            self._emitter.refuse(f"{self._emitter.position} != {start} + {length}")

    def _struct(self, type_: StructType) -> str:
        raise NotImplementedError

    def _union(self, type_: UnionType) -> str:
        raise NotImplementedError
