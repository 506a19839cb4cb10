"""Types and their octets (DDS-XTypes 1.3): the ``idl`` annotations, codecs generated per type, keys and key hashes."""

from . import idl
from .dynamic import dynamic_type, type_objects
from .model import Extensibility
from .octets import deserialize, key_hash, serialize, type_information
from .type_support import Octets, TypeSupport, type_support

__all__ = [
    "Extensibility",
    "Octets",
    "TypeSupport",
    "deserialize",
    "dynamic_type",
    "idl",
    "key_hash",
    "serialize",
    "type_information",
    "type_objects",
    "type_support",
]
