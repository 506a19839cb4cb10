"""Generate the writing of values that are no structs: items, strings, sequences and arrays.

The collections half of ``write_source.py``, which says how generated writers work.
"""

from __future__ import annotations

import enum
import struct
from array import array
from collections.abc import Callable
from typing import Any

from .buffers import needs_swap
from .defaults import numpy_dtype
from .layout import UNKNOWN, Encoding, after, has_dheader, static_size
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
from .recursion import FunctionPlan
from .source import Source
from .stride import Stride, stride
from .write_emitter import Position, WriteEmitter

__all__ = ["PLAIN_SEQUENCES", "ValueWriter", "enum_values", "pack_numbers", "pack_strings"]

_IN_RUN = 64
"""Arrays of primitives up to so many octets are copied into a run; larger ones go as buffers of their own."""


PLAIN_SEQUENCES = frozenset({list, tuple, array})
"""Their elements go to :mod:`struct` one by one, which checks each."""


def enum_values(values: Any, python_class: type[enum.IntEnum]) -> list[int]:
    """The numbers of enum literals; ValueError for what is none."""
    return [item._value_ if item.__class__ is python_class else python_class(item)._value_ for item in values]


def pack_numbers(order: str, code: str, values: Any) -> bytes:
    if hasattr(values, "tolist"):
        values = values.tolist()
    return struct.pack(f"{order}{len(values)}{code}", *values)


def pack_strings(pack_length: Callable[[int], bytes], values: Any, bound: int | None) -> bytes:
    """Strings one behind the other, each with its length and NUL, and aligned to 4 as the first of them is.

    Raises TypeError or ValueError for what is no string, too long, or holds a NUL.
    """
    encoded = list(map(str.encode, values))
    if 0 in b"".join(encoded) or (bound is not None and any(len(string) > bound for string in encoded)):
        raise ValueError
    pieces = [pack_length(len(string) + 1) + string + _STRING_ENDS[len(string) & 3] for string in encoded]
    if pieces:  # no padding behind the last one
        pieces[-1] = pieces[-1][: 5 + len(encoded[-1])]
    return b"".join(pieces)


_STRING_ENDS = tuple(bytes(4 - length) for length in range(4))
"""The NUL behind a string, and padding up to the next one, by the string's length modulo 4."""


class ValueWriter:
    """Drives a :class:`WriteEmitter` over a type."""

    def __init__(self, source: Source, encoding: Encoding, plan: FunctionPlan) -> None:
        self._source = source
        self._encoding = encoding
        self._plan = plan
        self._emitter = WriteEmitter(source, encoding, Position(), listed=False)
        self._depth = "0"

    # --- one method for each kind of type -------------------------------------------------------------

    def value(self, type_: IdlType, expression: str) -> None:
        match type_:
            case Primitive() | EnumType() | BitmaskType() | BitsetType():
                self._emitter.align(self._encoding.alignment(type_.size))
                self._emitter.item(type_.code, type_.size, self._item_expression(type_, expression))
            case String(wide=True):
                self._wide_string(type_, expression)
            case String():
                self._string(type_, expression)
            case SequenceType(element=Primitive() as element):
                self._primitive_sequence(type_, element, expression)
            case SequenceType():
                self._sequence(type_, expression)
            case ArrayType(element=Primitive() as element):
                self._primitive_array(type_, element, expression)
            case ArrayType():
                self._array(type_, expression)
            case MapType():
                self._map(type_, expression)
            case StructType():
                self._struct(type_, expression)
            case UnionType():
                self._union(type_, expression)

    def _item_expression(self, type_: Primitive | EnumType | BitmaskType | BitsetType, expression: str) -> str:
        if isinstance(type_, EnumType):
            name = self._local("x", expression)
            python_class = self._source.constant("Enum", type_.python_class)
            with self._source.block(f"if {name}.__class__ is not {python_class}:"):
                self._source.line(f"{name} = {python_class}({name})")
            return name
        if type_ == BOOLEAN:
            return f"{self._source.define('BOOLEAN_', '{False: 0, True: 1}')}[{expression}]"
        if type_ in (CHAR, WCHAR):
            return f"ord({expression})"
        return expression

    def _local(self, prefix: str, expression: str) -> str:
        """A variable that may be changed or is used more than once."""
        name = self._source.fresh(prefix)
        self._source.line(f"{name} = {expression}")
        return name

    def _string(self, type_: String, expression: str) -> None:
        emitter = self._emitter
        octets = self._local("s", f"encode({expression})")
        count = self._local("n", f"len({octets})")
        condition = f"0 in {octets}"  # IDL strings hold no NUL: a peer would read up to it
        if type_.bound is not None:
            condition = f"{count} > {type_.bound} or {condition}"
        self._refuse(condition)
        emitter.align(4)
        emitter.item("I", 4, f"{count} + 1")
        emitter.part(octets, count, UNKNOWN)
        emitter.pad(1)

    def _wide_string(self, type_: String, expression: str) -> None:
        """The length counts octets, as Cyclone DDS and OpenDDS have it (Fast CDR counts units of two)."""
        emitter = self._emitter
        text = self._local("s", expression)
        octets = self._local("s", f"wchars({text}, little_endian={self._encoding.little_endian})")
        count = self._local("n", f"len({octets})")
        condition = f"{text}.__class__ is not str or '\\0' in {text}"
        self._refuse(condition if type_.bound is None else f"{count} > {2 * type_.bound} or {condition}")
        emitter.align(4)
        emitter.item("I", 4, count)
        emitter.part(octets, count, emitter.position.residue.advance_multiple(2))

    def _refuse(self, condition: str) -> None:
        with self._source.block(f"if {condition}:"):
            self._source.line("raise ValueError")

    # --- collections -------------------------------------------------------------------------------------

    def _primitive_sequence(self, type_: SequenceType, element: Primitive, expression: str) -> None:
        emitter = self._emitter
        buffer, count = self._sequence_buffer(type_, element, expression)
        if type_.bound is not None:
            self._refuse(f"{count} > {type_.bound}")
        emitter.align(4)
        emitter.item("I", 4, count)
        if self._encoding.alignment(element.size) == 8:
            self._align_elements(count)
        octets = count if element.size == 1 else f"{count} * {element.size}"
        residue = emitter.position.residue
        emitter.part(buffer, octets, residue.advance_multiple(element.size))

    def _align_elements(self, count: str, alignment: int = 8) -> None:
        """In XCDR1 padding to 8 lies between count and elements, unless there are none (measured: s05)."""
        emitter = self._emitter
        residue = emitter.position.residue
        padding = residue.padding(alignment)
        behind = residue.meet(residue.align(alignment))
        if padding == 0:
            return
        if padding is None:
            name = self._local("z", f"-({emitter.position}) & {alignment - 1} if {count} else 0")
            table = self._source.define("ZEROS_", repr(tuple(bytes(pad) for pad in range(alignment))))
            emitter.part(f"{table}[{name}]", name, behind)
        else:
            emitter.part(f"{bytes(padding)!r} if {count} else b''", f"({padding} if {count} else 0)", behind)

    def _sequence_buffer(self, type_: SequenceType, element: Primitive, expression: str) -> tuple[str, str]:
        source = self._source
        if element.is_octet:
            buffer = self._local("b", expression)
            with source.block(f"if {buffer}.__class__ is not bytes:"):
                source.line(f"{buffer} = octets({buffer})")
        elif element.is_number:
            swap = needs_swap(little_endian=self._encoding.little_endian)
            expression = self._local("x", expression)
            buffer, count = source.fresh("b"), source.fresh("n")
            arguments = f"{expression}, '{element.code}', {element.size}, '{self._encoding.order}', swap={swap}"
            found = self._unless_numpy(type_, expression, f"({expression}, len({expression}))", f"numbers({arguments})")
            source.line(f"{buffer}, {count} = {found}")
            return buffer, count
        else:
            buffer = self._local("b", self._characters(element, expression))
        count = self._local("n", f"len({buffer})" if element.size == 1 else f"len({buffer}) // {element.size}")
        return buffer, count

    def _characters(self, element: Primitive, expression: str) -> str:
        if element.name == "wchar":
            return f"wchars({expression}, little_endian={self._encoding.little_endian})"
        return f"{'booleans' if element.name == 'boolean' else 'chars'}({expression})"

    def _primitive_array(self, type_: ArrayType, element: Primitive, expression: str) -> None:
        emitter = self._emitter
        dimensions = type_.dimensions
        octets = type_.count * element.size
        if element.is_octet:
            buffer = f"array_octets({expression}, {dimensions})"
        elif element.is_number:
            expression = self._local("x", expression)
            swap = needs_swap(little_endian=self._encoding.little_endian)
            layout = f"'{element.code}', {element.size}, '{self._encoding.order}', swap={swap}"
            buffer = f"array_numbers({expression}, {dimensions}, {layout})"
            if type_.numpy:
                buffer = self._unless_numpy(type_, expression, expression, buffer)
            elif len(dimensions) == 1 and octets <= _IN_RUN:
                self._numbers_in_run(type_, element, expression, buffer)
                return
            elif len(dimensions) == 1:
                pack = self._source.packer(f"{self._encoding.order}{type_.count}{element.code}")
                buffer = f"{pack}(*{expression}) if {expression}.__class__ is list else {buffer}"
        else:
            buffer = self._characters(element, f"flatten({expression}, {dimensions})")
        emitter.align(self._encoding.alignment(element.size))
        if octets <= _IN_RUN:
            name = self._local("b", f"bytes({buffer})")
            emitter.item(f"{octets}s", octets, name)
        else:
            name = self._local("b", buffer)
            emitter.part(name, str(octets), emitter.position.residue.advance(octets))
        if not element.is_number:
            self._refuse(f"len({name}) != {octets}")

    def _unless_numpy(self, type_: SequenceType | ArrayType, value: str, found: str, otherwise: str) -> str:
        """The expression ``found`` where ``value`` is a numpy array whose memory holds the octets as they go.

        Only asked where the member says that it is numpy's, since asking costs time.
        """
        if not type_.numpy or needs_swap(little_endian=self._encoding.little_endian):
            return otherwise
        import numpy  # here, since the user's annotation named it

        assert isinstance(type_.element, Primitive)
        conditions = (
            f"{value}.__class__ is {self._source.constant('ndarray', numpy.ndarray)}",
            f"{value}.dtype is {self._source.constant('dtype', numpy.dtype(numpy_dtype(type_.element)))}",
            f"{value}.shape == {type_.dimensions}" if isinstance(type_, ArrayType) else f"{value}.ndim == 1",
            f"{value}.flags.c_contiguous",
        )
        return f"{found} if {' and '.join(conditions)} else {otherwise}"

    def _numbers_in_run(self, type_: ArrayType, element: Primitive, value: str, buffer: str) -> None:
        """A few numbers are items as any others; ``buffer`` makes octets of what is no plain sequence of them."""
        codes = f"{type_.count}{element.code}"
        unpack = self._source.define("unpack_", f'Struct("{self._encoding.order}{codes}").unpack')
        with self._source.block(f"if {value}.__class__ not in PLAIN_SEQUENCES:"):
            self._source.line(f"{value} = {unpack}({buffer})")
        self._refuse(f"len({value}) != {type_.count}")
        self._emitter.align(self._encoding.alignment(element.size))
        self._emitter.item(codes, type_.count * element.size, f"*{value}")

    def _sequence(self, type_: SequenceType, expression: str) -> None:
        emitter = self._emitter
        value = self._sequence_local(type_, expression)
        count = self._local("n", f"len({value})")
        if type_.bound is not None:
            self._refuse(f"{count} > {type_.bound}")
        delimiter = self._open_dheader(type_)
        emitter.align(4)
        emitter.item("I", 4, count)
        self._elements(type_, type_.element, value, count)
        self._close_dheader(delimiter)

    def _sequence_local(self, type_: SequenceType | ArrayType, expression: str) -> str:
        """A variable with the elements: whatever the value is, it is a sequence."""
        source = self._source
        value = self._local("v", expression)
        with source.block(f"if {value}.__class__ is not list:"):
            source.line(f"{value} = sequence({value})")
        if isinstance(type_.element, EnumType):
            source.line(f"{value} = enum_values({value}, {source.constant('Enum', type_.element.python_class)})")
        return value

    def _map(self, type_: MapType, expression: str) -> None:
        emitter = self._emitter
        value = self._local("v", expression)
        count = self._local("n", f"len({value})")
        if type_.bound is not None:
            self._refuse(f"{count} > {type_.bound}")
        delimiter = self._open_dheader(type_)
        emitter.align(4)
        emitter.item("I", 4, count)
        key, item = self._source.fresh("v"), self._source.fresh("v")
        with emitter.loop(f"for {key}, {item} in {value}.items():", UNKNOWN), self._plan.inside():
            self.value(type_.key, key)
            self.value(type_.value, item)
        self._close_dheader(delimiter)

    def _array(self, type_: ArrayType, expression: str) -> None:
        value = self._sequence_local(type_, f"flatten({expression}, {type_.dimensions})")
        delimiter = self._open_dheader(type_)
        self._elements(type_, type_.element, value, str(type_.count))
        self._close_dheader(delimiter)

    def _elements(self, type_: IdlType, element: IdlType, value: str, count: str) -> None:
        emitter, encoding = self._emitter, self._encoding
        if isinstance(element, (EnumType, BitmaskType, BitsetType)):
            if isinstance(type_, SequenceType) and encoding.alignment(element.size) == 8:
                self._align_elements(count)
            else:
                emitter.align(encoding.alignment(element.size))
            residue = emitter.position.residue.advance_multiple(element.size)
            octets = f"{count} * {element.size}"
            emitter.part(f"pack_numbers('{encoding.order}', '{element.code}', {value})", octets, residue)
            return
        if isinstance(element, String) and not element.wide:
            emitter.align(4)
            pack_length = self._source.packer(f"{encoding.order}I")
            name = self._local("b", f"pack_strings({pack_length}, {value}, {element.bound})")
            emitter.part(name, f"len({name})", UNKNOWN)
            return
        step = stride(element, emitter.position.residue, encoding)
        if step is not None:
            self._elements_by_stride(element, value, count, step)
            return
        residue = emitter.position.residue
        while (behind := residue.meet(after(element, residue, encoding))) != residue:
            residue = behind
        item = self._source.fresh("v")
        with emitter.loop(f"for {item} in {value}:", residue), self._plan.inside():
            self.value(element, item)

    def _elements_by_stride(self, element: IdlType, value: str, count: str, step: Stride) -> None:
        """Only the first element is aligned: the others follow it as their layout says."""
        if count.isdecimal():
            self._emitter.align(step.alignment)
        else:
            self._align_elements(count, step.alignment)
        item = self._source.fresh("v")
        with self._emitter.repeat(f"for {item} in {value}:", count, step), self._plan.inlining_all():
            self.value(element, item)

    def _open_dheader(self, type_: IdlType) -> tuple[str, Position] | None:
        emitter = self._emitter
        if not has_dheader(type_, self._encoding):
            return None
        emitter.align(4)
        size = static_size(type_, emitter.position.residue, self._encoding)
        length = emitter.defer("h") if size is None else str(size - 4)
        emitter.item("I", 4, length)
        return (length, emitter.position) if size is None else None

    def _close_dheader(self, delimiter: tuple[str, Position] | None) -> None:
        if delimiter is not None:
            length, start = delimiter
            self._emitter.resolve(length, self._emitter.position.minus(start))

    def _struct(self, type_: StructType, expression: str) -> None:
        raise NotImplementedError

    def _union(self, type_: UnionType, expression: str) -> None:
        raise NotImplementedError
