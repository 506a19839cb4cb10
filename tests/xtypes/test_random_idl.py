"""Random IDL beside cyclonedds-python: of each type we write the same octets, and each reads what the other wrote.

The binding has no part in reading the text: its classes are made after what we read there (what ``idlc`` reads is
compared by ``type_object/test_idlc.py`` and ``idl_compiler/test_idlc.py``).  Left out is where 11.0.1 is known to be
no reference: maps, wide strings, mutable unions, booleans of which both have a case, characters beyond ASCII, and in
XCDR1 enums with a bit bound, for which its own C code writes as we do.
"""

from __future__ import annotations

import random
from typing import Any

import pytest

import ddsi
from ddsi.structure.qos_policies import DataRepresentationId
from ddsi.xtypes import deserialize, serialize, type_support
from ddsi.xtypes.definition import struct_type
from ddsi.xtypes.model import ArrayType, EnumType, SequenceType, StructType, reachable_structs

from ..peers import peer_module
from .random_idl import RandomIdl, random_sample

peers = peer_module("tests.xtypes.peer_types", "cyclonedds-python is not installed")

pytestmark = pytest.mark.peers

FORMS = [(xcdr2, little_endian) for xcdr2 in (False, True) for little_endian in (True, False)]


def has_bound_enum(struct: StructType) -> bool:
    for composite in reachable_structs(struct):
        for member in composite.members:
            type_ = member.type
            while isinstance(type_, (SequenceType, ArrayType)):
                type_ = type_.element
            if isinstance(type_, EnumType) and type_.bit_bound != 32:
                return True
    return False


@pytest.mark.parametrize("seed", range(60))
def test_random_types_have_the_same_octets(seed: int) -> None:
    text = RandomIdl(seed, keys=True, enums=True).text()
    module: Any = ddsi.idl.loads(text).m
    types = peers.PeerTypes()
    dice = random.Random(seed)
    for name in module:
        if not name.startswith(("S", "Top")):
            continue
        struct = struct_type(getattr(module, name))
        for xcdr2, little_endian in FORMS:
            if not xcdr2 and has_bound_enum(struct):
                continue
            sample = random_sample(struct, dice)
            agree(types, struct, sample, xcdr2=xcdr2, little_endian=little_endian, text=text)


def agree(types: Any, struct: StructType, sample: Any, *, xcdr2: bool, little_endian: bool, text: str) -> None:
    representation = DataRepresentationId.XCDR2 if xcdr2 else DataRepresentationId.XCDR1
    peer = types.value(struct, sample)
    theirs = peers.peer_octets(peer, xcdr2=xcdr2, little_endian=little_endian)
    ours = serialize(sample, representation=representation, byteorder="little" if little_endian else "big")
    assert ours.hex() == theirs.hex(), f"{struct.type_name} in\n{text}"
    assert deserialize(type(sample), theirs) == sample
    assert peer.__idl__.deserialize(ours) == peer
    support = type_support(type(sample))
    if support.is_keyed:
        key = peers.peer_octets(peer, xcdr2=xcdr2, little_endian=little_endian, key_only=True)
        assert support.key_serializer(representation, little_endian, padded=False)(sample).hex() == key.hex(), text
        assert support.key_from_key_payload(key) == support.key(sample)


def test_no_padding_stands_before_elements_that_are_not_there() -> None:
    """XCDR1 aligns bitmasks of 64 bits to 8, as it does doubles, but only where there are some."""
    module: Any = ddsi.idl.loads("""
        module m {
            @bit_bound(64) bitmask Bits { a, @position(5) b };
            @final struct Masks { sequence<Bits> none; long after; sequence<Bits> some; };
        };
    """).m
    struct = struct_type(module.Masks)
    for xcdr2, little_endian in FORMS:
        sample = module.Masks([], 1, [module.Bits.a, module.Bits.b])
        agree(peers.PeerTypes(), struct, sample, xcdr2=xcdr2, little_endian=little_endian, text="")
    octets = serialize(module.Masks([], 1, []), representation=DataRepresentationId.XCDR1)
    assert octets == bytes.fromhex("00010000 00000000 01000000 00000000")
