"""How RTPS values become octets and octets values (RTPS 2.5 §10, §9.4.2): cursors, encapsulation, parameter lists.

The codecs of users' types are not here but in ``xtypes``.
"""

from .cursor import Octets, Reader, Writer
from .encapsulation import Encapsulation, EncapsulationHeader, decode_encapsulation, encode_encapsulation
from .parameter_id import ParameterId, parameter_name
from .parameter_list import MustUnderstandUnknown, Parameter, ParameterList

__all__ = [
    "Encapsulation",
    "EncapsulationHeader",
    "MustUnderstandUnknown",
    "Octets",
    "Parameter",
    "ParameterId",
    "ParameterList",
    "Reader",
    "Writer",
    "decode_encapsulation",
    "encode_encapsulation",
    "parameter_name",
]
