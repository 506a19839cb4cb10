"""What types are to other programs: TypeIdentifiers, TypeObjects, TypeInformation (DDS-XTypes 1.3 §7.3.4, §7.6.3).

``describe`` gives those of a type of ours; the ``decode`` functions read what peers send.
"""

from .builder import BuiltTypes
from .decoding import decode_type_object
from .description import TypeDescription, describe
from .encoding import encode_type_object, equivalence_hash
from .identifiers import (
    ComponentIdentifier,
    HashedIdentifier,
    HashIdentifier,
    TypeIdentifier,
    decode_identifier,
    encode_identifier,
)
from .information import TypeInformation, decode_type_information
from .objects import TypeObject

__all__ = [
    "BuiltTypes",
    "ComponentIdentifier",
    "HashIdentifier",
    "HashedIdentifier",
    "TypeDescription",
    "TypeIdentifier",
    "TypeInformation",
    "TypeObject",
    "decode_identifier",
    "decode_type_information",
    "decode_type_object",
    "describe",
    "encode_identifier",
    "encode_type_object",
    "equivalence_hash",
]
