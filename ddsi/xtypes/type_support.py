"""Everything a participant needs of one topic type: its codecs, its key, its name.

:func:`type_support` makes it once per class.  Codecs are generated when they are first asked for, one per
representation and byte order.  DDS 1.4 §2.2.2.3.6 (TypeSupport), DDS-XTypes 1.3 §7.6.
"""

from __future__ import annotations

import hashlib
from collections.abc import Callable
from contextlib import suppress
from functools import cached_property
from typing import Any, Generic, Literal, TypeVar

from ..structure.errors import BadParameter, MalformedSample
from ..structure.qos_policies import DataRepresentationId
from .careful_reader import read_carefully
from .definition import struct_type
from .key_source import generate_key_extractor
from .keys import KEY_HASH_OCTETS, alignments_differ, canonical_key_type, hash_is_digest, key_type, undelimited_key_type
from .layout import Encoding, encapsulations
from .model import Extensibility, StructType
from .read_source import generate_reader
from .topic_type import complete, default_representations
from .type_object import TypeDescription, describe
from .value_check import check_sample
from .write_source import generate_writer

__all__ = ["SUPPORT_ATTRIBUTE", "Octets", "TypeSupport", "type_support"]

T = TypeVar("T")

Octets = bytes | bytearray | memoryview

XCDR1, XCDR2 = DataRepresentationId.XCDR1, DataRepresentationId.XCDR2

_CANONICAL = Encoding(XCDR2, little_endian=False)
_CANONICAL_HEADER = _CANONICAL.encapsulation_id(Extensibility.FINAL) + bytes(2)

_DELIMITED = (b"\x00\x08", b"\x00\x09")  # D_CDR2, big and little endian
_FILLED_UP_OCTETS = 20
_VIEW_FROM = 4096
"""A memoryview of fewer octets is copied first: bytes are read faster."""


def type_support(python_class: type[T]) -> TypeSupport[T]:
    """The :class:`TypeSupport` of a class decorated with ``idl.struct``; the same object every time.

    Raises BadParameter if the class is not one, or cannot be a topic type (with member and reason).
    """
    struct = struct_type(python_class)
    found: TypeSupport[T] | None = python_class.__dict__.get(SUPPORT_ATTRIBUTE)
    if found is None:
        found = TypeSupport(python_class, struct)
        setattr(python_class, SUPPORT_ATTRIBUTE, found)
    return found


SUPPORT_ATTRIBUTE = "__idl_support__"
"""Where a class keeps its TypeSupport; looked for in the class itself, never in its bases."""


class TypeSupport(Generic[T]):
    """The codecs and the key of one type.

    ``key``: in this program an instance is identified by the *canonical key*, the key members in the order of
    their ids as a final type in XCDR2, big endian; ``b""`` for a type without key.
    """

    deserialize: Callable[[Octets], T]
    """The sample in a payload that begins with its encapsulation header; any encapsulation that fits the type.
    Values are copies.  Raises MalformedSample, nothing else."""

    key: Callable[[T], bytes]
    """The canonical key of a sample.  Raises BadParameter if a key member does not fit its type."""

    key_from_payload: Callable[[Octets], bytes]
    """The canonical key in a whole sample's payload, read no further than needed.  Raises MalformedSample."""

    serializers_asked_for: dict[tuple[DataRepresentationId | None, str], Callable[[T], bytes]]
    """What ``ddsi.serialize`` found here before, by its arguments: looking for it takes longer than its work."""

    def __init__(self, python_class: type[T], struct: StructType) -> None:
        self.python_class = python_class
        self.struct = struct
        self.type_name: str = struct.type_name
        self.extensibility: Extensibility = struct.extensibility
        self.representations: tuple[DataRepresentationId, ...] = default_representations(complete(struct))
        self._sources: dict[tuple[Any, ...], str] = {}
        self._writers: dict[tuple[Any, ...], Callable[[Any], bytes]] = {}
        self.serializers_asked_for = {}
        self._key_hash_forms: dict[DataRepresentationId, tuple[bool, Callable[[Any], bytes] | None]] = {}
        key, canonical = key_type(struct), canonical_key_type(struct)
        self.is_keyed: bool = canonical is not None
        self.deserialize = self._reader(struct)
        if key is None or canonical is None:
            self._key_struct = self._canonical = None
            self.key = self.key_from_payload = _no_key
            return
        self._key_struct, self._canonical = key, canonical
        self._read_key_payload = self._reader(key)
        self._read_undelimited_key = self._reader(undelimited_key_type(struct) or key)
        self._read_canonical = self._reader(canonical)
        self.key = self._writer(canonical, _CANONICAL, header=False)
        self.key_from_payload = self._key_extractor(struct, canonical)

    def __repr__(self) -> str:
        keyed = "keyed" if self.is_keyed else "keyless"
        return f"<TypeSupport {self.type_name} {self.extensibility.value}, {keyed}>"

    @property
    def source(self) -> str:
        """The Python source generated so far, for readers and debuggers."""
        return "\n\n".join(self._sources.values())

    @cached_property
    def type_description(self) -> TypeDescription:
        """What to announce of the type (DDS-XTypes 1.3 §7.6.3.2.1), and to answer who asks (§7.6.3.3)."""
        return describe(self.struct)

    # --- samples -----------------------------------------------------------------------------------------

    def serializer(
        self, representation: DataRepresentationId, little_endian: bool = True, *, padded: bool = True
    ) -> Callable[[T], bytes]:
        """The function from a sample to its payload, which begins with the 4 octets of encapsulation header.

        In XCDR2 the payload is filled up with zeros to a multiple of 4, and the header's options count them
        (unless not ``padded``).  The function raises BadParameter, naming the member, for an unfit value.
        """
        encoding = Encoding(_checked_representation(representation), little_endian)
        return self._writer(self.struct, encoding, padded=padded and encoding.is_xcdr2)

    # --- keys --------------------------------------------------------------------------------------------

    def key_serializer(
        self, representation: DataRepresentationId, little_endian: bool = True, *, padded: bool = True
    ) -> Callable[[T], bytes]:
        """The function from a sample to a key-only payload (RTPS 2.5 §9.4.5.4, K flag), with its header.

        For a type without key the payload is the header alone.
        """
        encoding = Encoding(_checked_representation(representation), little_endian)
        if self._key_struct is None:
            header = encoding.encapsulation_id(self.extensibility) + bytes(2)
            return lambda sample: header
        return self._writer(self._key_struct, encoding, padded=padded and encoding.is_xcdr2)

    def deserialize_key(self, octets: Octets) -> T:
        """A sample with the key of a key-only payload, and the type's defaults elsewhere.  MalformedSample."""
        if self._key_struct is None:
            raise MalformedSample(f"{self.type_name}: a key, for a type that has none")
        sample: T = self._read_key(octets)
        return sample

    def sample_from_key(self, key: bytes) -> T:
        """A sample with this canonical key, and the type's defaults elsewhere.  MalformedSample if it is none."""
        if self._canonical is None:
            raise MalformedSample(f"{self.type_name}: a key, for a type that has none")
        sample: T = self._read_canonical(_CANONICAL_HEADER + key)
        return sample

    def key_from_key_payload(self, octets: Octets) -> bytes:
        """The canonical key in a key-only payload.  Raises MalformedSample."""
        if self._key_struct is None:
            return b""
        return self._key_of(self._read_key(octets))

    def _read_key(self, octets: Octets) -> Any:
        """The key of an appendable type in XCDR2 comes with its DHEADER, but Cyclone DDS 0.10 leaves that out.

        So one that does not announce what follows it is no DHEADER, nor is one behind which nothing fits the type.
        And a short key payload is filled up with zeros to 20 octets (by ourselves, for the sake of Fast DDS).
        """
        if bytes(octets[:2]) not in _DELIMITED or len(octets) < 8:
            return self._read_filled_up_key(octets)
        byteorder: Literal["little", "big"] = "little" if octets[1] & 1 else "big"
        beyond = len(octets) - 8 - int.from_bytes(octets[4:8], byteorder)
        if 0 <= beyond <= 3 or (beyond > 0 and _is_filled_up(octets, beyond)):  # what is beyond it can be padding
            with suppress(MalformedSample):
                return self._read_key_payload(octets[: len(octets) - max(beyond - 3, 0)])
        return self._read_undelimited_key(bytes((0, octets[1] - 2)) + bytes(octets[2:]))

    def _read_filled_up_key(self, octets: Octets) -> Any:
        try:
            return self._read_key_payload(octets)
        except MalformedSample:
            for beyond in (4, 8, 12):
                if _is_filled_up(octets, beyond):
                    with suppress(MalformedSample):
                        return self._read_key_payload(octets[:-beyond])
            raise

    def key_hash(self, key: bytes, representation: DataRepresentationId, *, is_secret: bool = False) -> bytes:
        """The 16 octets of the key hash that a writer with this representation gives (RTPS 2.5 §9.6.4.8).

        ``key`` is canonical; for a type without key the hash is zeros.  ``is_secret``: a digest, however short the key
        is, so that the hash does not show it (DDS-Security 1.1 §8.4.2.7, is_key_protected).
        """
        if self._canonical is None:
            return bytes(KEY_HASH_OCTETS)
        is_digest, write = self._key_hash_form(_checked_representation(representation))
        octets = key if write is None else write(self._read_canonical(_CANONICAL_HEADER + key))
        if is_secret or is_digest:
            return hashlib.md5(octets, usedforsecurity=False).digest()
        return octets.ljust(KEY_HASH_OCTETS, b"\0")

    def _key_hash_form(self, representation: DataRepresentationId) -> tuple[bool, Callable[[Any], bytes] | None]:
        """(whether hashes are digests, what writes the octets to be hashed where they are not the canonical key)."""
        form = self._key_hash_forms.get(representation)
        if form is None:
            assert self._canonical is not None
            encoding = Encoding(representation, little_endian=False)
            is_digest = hash_is_digest(self.struct, self._canonical, encoding)
            differs = not encoding.is_xcdr2 and alignments_differ(self._canonical)
            form = is_digest, self._writer(self._canonical, encoding, header=False) if differs else None
            self._key_hash_forms[representation] = form
        return form

    def key_from_key_hash(self, key_hash: bytes, representation: DataRepresentationId | None = None) -> bytes | None:
        """The canonical key, where a key hash holds the key itself; None where it is a digest or no such key.

        ``representation`` is that of the writer (default: what a writer of this type uses by default); it matters
        for keys with members of 8 octets only.
        """
        if self._canonical is None or len(key_hash) != KEY_HASH_OCTETS:
            return None
        representation = _checked_representation(self.representations[0] if representation is None else representation)
        if self._key_hash_form(representation)[0]:
            return None
        encoding = Encoding(representation, little_endian=False)
        header = encoding.encapsulation_id(Extensibility.FINAL) + bytes(2)
        for length in range(1, KEY_HASH_OCTETS + 1):
            if any(key_hash[length:]):
                continue  # what follows the key is zeros
            try:
                key = self._key_of(self._read_canonical(header + key_hash[:length]))
            except MalformedSample:
                continue
            if self.key_hash(key, representation) == key_hash:
                return key
        return None

    # --- making codecs -----------------------------------------------------------------------------------

    def _writer(
        self, struct: StructType, encoding: Encoding, *, header: bool = True, padded: bool = False
    ) -> Callable[[Any], bytes]:
        """The checked writer of the type or of a projection of it; generated once."""
        choice = (struct, encoding, header, padded)
        cached = self._writers.get(choice)
        if cached is None:
            write, text = generate_writer(struct, encoding, header=header, padded=padded)
            self._sources[choice] = text
            cached = self._writers[choice] = self._checked(write)
        return cached

    def _checked(self, write: Callable[[Any], bytes]) -> Callable[[T], bytes]:
        """Let ``write`` fail, and then find out why."""
        struct, python_class, name = self.struct, self.python_class, self.type_name

        def serialize(sample: T) -> bytes:
            try:
                if sample.__class__ is not python_class and not isinstance(sample, python_class):
                    raise TypeError
                return write(sample)
            except Exception as error:
                failure = error
            check_sample(struct, sample)
            raise BadParameter(f"{name}: the sample cannot be written: {failure}") from failure

        return serialize

    def _reader(self, struct: StructType) -> Callable[[Octets], Any]:
        """The straight reader of each encapsulation, generated when such a payload first comes."""
        readers: dict[bytes, Callable[[Any], Any]] = {}
        view_readers: dict[bytes, Callable[[Any], Any]] = {}
        for identifier, encoding in encapsulations(struct.extensibility).items():
            self._install_lazily(readers, identifier, struct, encoding, view=False)
            self._install_lazily(view_readers, identifier, struct, encoding, view=True)

        def deserialize(octets: Octets) -> Any:
            try:
                if isinstance(octets, bytes):
                    return readers[octets[:2]](octets)
                if len(octets) < _VIEW_FROM:
                    octets = bytes(octets)
                    return readers[octets[:2]](octets)
                octets = memoryview(octets)
                return view_readers[bytes(octets[:2])](octets)
            except Exception:
                # Whatever the straight reader did not expect: another valid form, or octets that mean nothing.
                return read_carefully(struct, octets)

        return deserialize

    def _install_lazily(
        self,
        readers: dict[bytes, Callable[[Any], Any]],
        identifier: bytes,
        struct: StructType,
        encoding: Encoding,
        *,
        view: bool,
    ) -> None:
        def generate_first(octets: Any) -> Any:
            read, text = generate_reader(struct, encoding, view=view)
            self._sources[struct, encoding, "read", view] = text
            readers[identifier] = read
            return read(octets)

        readers[identifier] = generate_first

    def _key_of(self, sample: Any) -> bytes:
        try:
            return self.key(sample)
        except BadParameter as error:
            raise MalformedSample(f"{error}") from None

    def _key_extractor(self, struct: StructType, canonical: StructType) -> Callable[[Octets], bytes]:
        extractors: dict[bytes, Callable[[Any], bytes]] = {}
        for identifier, encoding in encapsulations(struct.extensibility).items():
            self._install_extractor_lazily(extractors, identifier, struct, canonical, encoding)
        deserialize, key_of = self.deserialize, self._key_of

        def key_from_payload(octets: Octets) -> bytes:
            try:
                return extractors[bytes(octets[:2])](octets)
            except Exception:
                return key_of(deserialize(octets))

        return key_from_payload

    def _install_extractor_lazily(
        self,
        extractors: dict[bytes, Callable[[Any], bytes]],
        identifier: bytes,
        struct: StructType,
        canonical: StructType,
        encoding: Encoding,
    ) -> None:
        def generate_first(octets: Any) -> bytes:
            generated = generate_key_extractor(struct, canonical, encoding)
            if generated is None:
                extractors[identifier] = lambda octets: self._key_of(self.deserialize(octets))
            else:
                extractors[identifier], self._sources[struct, encoding, "key"] = generated
            return extractors[identifier](octets)

        extractors[identifier] = generate_first


def _is_filled_up(octets: Octets, beyond: int) -> bool:
    """Is this a key payload of which so many octets at the end are nothing but filling?"""
    return len(octets) == _FILLED_UP_OCTETS and not any(octets[-beyond:])


def _no_key(_: Any) -> bytes:
    return b""


def _checked_representation(representation: Any) -> DataRepresentationId:
    if representation is XCDR1 or representation is XCDR2:
        return representation
    if representation in (XCDR1, XCDR2):
        return DataRepresentationId(representation)
    raise BadParameter(f"the representation is XCDR1 or XCDR2, not {representation!r}")
