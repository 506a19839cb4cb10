"""Which TypeObjects a peer must not be told.

Cyclone DDS 0.10 ends with a segmentation fault when it is told a TypeObject with an int8, a uint8 or a wstring, and
calls a bitset invalid; version 11 reads them.  (Found with 0.10.2.  It says RTPS 2.1, where later ones say 2.5.)  So it
gets no such TypeObject from us, and as it would wait for that for ever, an endpoint that meets one of its endpoints
goes by its type's name.
"""

from __future__ import annotations

from ..structure.discovered import DiscoveredParticipantData
from ..structure.vendor import CYCLONE
from ..xtypes.type_object import TypeObject
from ..xtypes.type_object.identifiers import PrimitiveIdentifier, StringIdentifier
from ..xtypes.type_object.kinds import TypeKind
from ..xtypes.type_object.objects import BitsetObject
from ..xtypes.type_object.references import plain_parts

__all__ = ["has_new_kinds", "knows_old_kinds_alone"]

_NEW_KINDS = (TypeKind.INT8, TypeKind.UINT8)
_FIRST_VERSION = (2, 2)


def knows_old_kinds_alone(peer: DiscoveredParticipantData) -> bool:
    """Is it a Cyclone DDS that some TypeObjects would end?"""
    return peer.vendor_id == CYCLONE and peer.protocol_version < _FIRST_VERSION


def has_new_kinds(type_object: TypeObject) -> bool:
    """Is this one of those TypeObjects?"""
    return isinstance(type_object.body, BitsetObject) or any(
        part.wide if isinstance(part, StringIdentifier) else part.kind in _NEW_KINDS
        for part in plain_parts(type_object)
        if isinstance(part, (StringIdentifier, PrimitiveIdentifier))
    )
