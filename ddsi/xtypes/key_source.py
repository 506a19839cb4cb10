"""Generate the function that finds the key in a whole sample's payload.

It runs for every sample received, since most peers send no key hash, while the rest of the sample is only read when
an application takes it.  So it reads up to the last key member and no further, jumps over what lies between, makes no
Python values of what it reads, and writes the canonical key from the raw items.  Where it cannot know how to
jump (optional members, parameters, XCDR1 sequences of structs before or among the key), there is none and the
caller reads the whole sample.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from ..structure.qos_policies import DataRepresentationId
from .layout import ALIGNED, UNKNOWN, Encoding, Residue, has_dheader, static_size
from .model import (
    ArrayType,
    BitmaskType,
    BitsetType,
    EnumType,
    Extensibility,
    IdlType,
    Primitive,
    SequenceType,
    String,
    StructType,
)
from .read_emitter import ReadEmitter
from .source import Source
from .write_emitter import Position, WriteEmitter

__all__ = ["generate_key_extractor"]

_Path = tuple[str, ...]

_MOST_SKIPPED = 256
"""Parts of variable size before the key; a type with more of them is read whole."""


class _NoExtractorError(Exception):
    """The type has a part over which generated code cannot jump."""


def generate_key_extractor(
    struct: StructType, canonical: StructType, encoding: Encoding
) -> tuple[Callable[[Any], bytes], str] | None:
    """(function of a payload that returns the canonical key, its source); None where that needs the whole sample.

    The function raises anything for payloads that it does not expect; it looks at no encapsulation header.
    """
    source = Source(f"key of {struct.type_name}, {encoding.name}")
    try:
        with source.block("def key(d):"):
            finder = _KeyFinder(source, encoding)
            finder.top(struct)
            writer = _CanonicalWriter(source, finder.found)
            writer.struct(canonical, ())
            source.line(f"return {writer.emitter.joined()}")
    except _NoExtractorError:
        return None
    return source.compile("key"), source.text


class _KeyFinder:
    """Reads key members into names; ``found`` maps their paths to expressions of raw items."""

    def __init__(self, source: Source, encoding: Encoding) -> None:
        self._source = source
        self._encoding = encoding
        self._emitter = ReadEmitter(source, encoding, base="", offset=4, residue=ALIGNED)
        self._skipped = 0
        self.found: dict[_Path, tuple[str, ...]] = {}

    def top(self, struct: StructType) -> None:
        self._key_members(struct, ())
        self._emitter.flush()

    def _key_members(self, struct: StructType, path: _Path) -> None:
        """Read up to the last key member.  The delimiter only guards against a sample without these members."""
        if struct.extensibility is Extensibility.MUTABLE:
            raise _NoExtractorError
        emitter = self._emitter
        length = start = ""
        if has_dheader(struct, self._encoding):
            emitter.align(4)
            length = emitter.item("I", 4, "h")
            start = emitter.position
        keys = [member for member in struct.members if member.is_key] or list(struct.members)
        if not keys:
            raise _NoExtractorError
        for member in struct.members[: struct.members.index(keys[-1]) + 1]:
            if member.is_optional:
                raise _NoExtractorError
            if member in keys:
                self._key(member.type, (*path, member.name), is_last=member is keys[-1] and not path)
            else:
                self._skip(member.type)
        if length:
            emitter.flush()
            emitter.refuse(f"{emitter.position} > {start} + {length}")

    def _key(self, type_: IdlType, path: _Path, *, is_last: bool) -> None:
        emitter = self._emitter
        match type_:
            case BitsetType() if sum(field.width for field in type_.fields) < 8 * type_.size:
                raise _NoExtractorError  # bits of no field may be anything, and are no part of the key
            case Primitive() | EnumType() | BitmaskType() | BitsetType():
                emitter.align(self._encoding.alignment(type_.size))
                self.found[path] = (emitter.item(type_.code, type_.size),)
            case String(wide=False):
                self._string(type_, path)
            case ArrayType(element=Primitive(size=1)):
                self.found[path] = (emitter.item(f"{type_.count}s", type_.count),)
            case StructType():
                self._key_struct(type_, path, is_last=is_last)
            case _:
                raise _NoExtractorError

    def _string(self, type_: String, path: _Path) -> None:
        emitter = self._emitter
        emitter.align(4)
        count = emitter.item("I", 4, "n")
        emitter.flush()
        start, end = emitter.position, self._source.fresh("e")
        emitter.then(f"{end} = {start} + {count}")
        # Of length 0, which only old writers send, the canonical form is another: left to the whole sample.
        bound = f" or {count} > {type_.bound + 1}" if type_.bound is not None else ""
        emitter.refuse(f"d[{end} - 1] or not {count}{bound}")
        self.found[path] = (count, f"d[{start}:{end}]")
        emitter.move(end, UNKNOWN)

    def _key_struct(self, type_: StructType, path: _Path, *, is_last: bool) -> None:
        emitter = self._emitter
        if is_last:
            self._key_members(type_, path)
        elif not has_dheader(type_, self._encoding):
            self._key_members(type_, path)
            self._skip_members_after_keys(type_)
        else:
            emitter.align(4)
            emitter.flush()
            start, length, end = emitter.position, self._source.fresh("j"), self._source.fresh("p")
            emitter.then(f"{length}, = {self._source.unpacker(self._encoding.order + 'I')}(d, {start})")
            self._key_members(type_, path)
            emitter.flush()
            emitter.then(f"{end} = {start} + 4 + {length}")
            emitter.move(end, UNKNOWN)

    def _skip_members_after_keys(self, type_: StructType) -> None:
        last = max((index for index, member in enumerate(type_.members) if member.is_key), default=len(type_.members))
        for member in type_.members[last + 1 :]:
            if member.is_optional:
                raise _NoExtractorError
            self._skip(member.type)

    # --- what lies between -------------------------------------------------------------------------------

    def _skip(self, type_: IdlType) -> None:
        emitter = self._emitter
        size = static_size(type_, emitter.residue, self._encoding)
        if size is not None and _is_rigid(type_, self._encoding):
            emitter.pass_over(size)
            return
        self._skipped += 1
        if self._skipped > _MOST_SKIPPED:
            raise _NoExtractorError
        if has_dheader(type_, self._encoding):
            emitter.align(4)
            self._jump(emitter.item("I", 4, "h"), 1, UNKNOWN)
            return
        match type_:
            case Primitive() | EnumType() | BitmaskType() | BitsetType():
                emitter.align(self._encoding.alignment(type_.size))
                emitter.pass_over(type_.size)
            case String():
                emitter.align(4)
                self._jump(emitter.item("I", 4, "n"), 1, UNKNOWN)
            case SequenceType(element=Primitive(size=size)) if self._encoding.alignment(size) < 8:
                emitter.align(4)
                residue = emitter.residue.advance(4).advance_multiple(size)
                self._jump(emitter.item("I", 4, "n"), size, residue)
            case ArrayType(element=Primitive(size=size)):
                emitter.align(self._encoding.alignment(size))
                emitter.pass_over(type_.count * size)
            case ArrayType(count=count) if count <= _MOST_SKIPPED:
                for _ in range(count):
                    self._skip(type_.element)
            case StructType(extensibility=Extensibility.FINAL | Extensibility.APPENDABLE):
                for member in type_.members:
                    if member.is_optional:
                        raise _NoExtractorError
                    self._skip(member.type)
            case _:
                raise _NoExtractorError

    def _jump(self, count: str, size: int, residue: Residue) -> None:
        emitter = self._emitter
        emitter.flush()
        end = self._source.fresh("e")
        emitter.then(f"{end} = {emitter.position} + {count}" + (f" * {size}" if size > 1 else ""))
        emitter.move(end, residue)


def _is_rigid(type_: IdlType, encoding: Encoding) -> bool:
    """Whether no other version of the type has another size.

    A mutable part may have members more or less, and so may an appendable one in XCDR2.
    """
    match type_:
        case Primitive() | EnumType() | BitmaskType() | BitsetType():
            return True
        case ArrayType():
            return _is_rigid(type_.element, encoding)
        case StructType():
            is_closed = type_.extensibility is Extensibility.FINAL
            is_closed |= type_.extensibility is Extensibility.APPENDABLE and not encoding.is_xcdr2
            return is_closed and all(_is_rigid(member.type, encoding) for member in type_.members)
        case _:
            return False


class _CanonicalWriter:
    """Writes the canonical key from what the finder found."""

    def __init__(self, source: Source, found: dict[_Path, tuple[str, ...]]) -> None:
        self._encoding = Encoding(DataRepresentationId.XCDR2, little_endian=False)
        self._found = found
        self.emitter = WriteEmitter(source, self._encoding, Position(), listed=False)

    def struct(self, type_: StructType, path: _Path) -> None:
        for member in type_.members:
            self._value(member.type, (*path, member.name))

    def _value(self, type_: IdlType, path: _Path) -> None:
        emitter = self.emitter
        match type_:
            case Primitive() | EnumType() | BitmaskType() | BitsetType():
                emitter.align(self._encoding.alignment(type_.size))
                emitter.item(type_.code, type_.size, self._found[path][0])
            case String():
                count, octets = self._found[path]
                emitter.align(4)
                emitter.item("I", 4, count)
                emitter.part(octets, count, UNKNOWN)
            case ArrayType():
                emitter.item(f"{type_.count}s", type_.count, self._found[path][0])
            case StructType():
                self.struct(type_, path)
            case _:
                raise _NoExtractorError
