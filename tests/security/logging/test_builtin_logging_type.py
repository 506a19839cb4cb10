"""The octets of a security event, and what becomes of octets that are none."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from ddsi.structure.errors import MalformedSample
from ddsi.structure.qos_policies import DataRepresentationId
from ddsi.xtypes import deserialize, serialize, type_support
from ddsi_security.builtin_logging_type import (
    BuiltinLoggingTypeV2,
    LogLevel,
    NameValuePair,
    StructuredDataEntry,
    Timestamp,
)

EVENT = BuiltinLoggingTypeV2(
    facility=10,
    severity=LogLevel.ERROR_LEVEL,
    timestamp=Timestamp(0x0102030405, 6),
    hostname="host",
    hostip="",
    appname="app",
    procid="47",
    msgid="auth",
    message="refused",
    structured_data=[StructuredDataEntry("DDS", [NameValuePair("domain_id", "0"), NameValuePair("guid", "A.B")])],
)
# Written down by hand from the OMG's IDL and the rules of XCDR1: 64-bit numbers at multiples of 8, lengths at multiples
# of 4, and a map as the count of its pairs, then each key and value.  Fast CDR writes the same for a std::map.
OCTETS = bytes.fromhex(
    "00010000"  # CDR, little endian
    "0a000000"  # facility, padding
    "03000000"  # severity
    "0504030201000000"  # seconds
    "06000000"  # nanoseconds
    "05000000 686f737400 000000"  # hostname
    "01000000 00 000000"  # hostip
    "04000000 61707000"  # appname
    "03000000 343700 00"  # procid
    "05000000 6175746800 000000"  # msgid
    "08000000 7265667573656400"  # message
    "01000000"  # structured_data: one pair
    "04000000 44445300"  # its key
    "02000000"  # its value: two elements
    "0a000000 646f6d61696e5f696400 0000"  # name
    "02000000 3000 0000"  # value
    "05000000 6775696400 000000"  # name
    "04000000 412e4200"  # value
)


def test_an_event_is_written_and_read_as_the_omg_s_idl_says() -> None:
    assert serialize(EVENT) == OCTETS
    assert deserialize(BuiltinLoggingTypeV2, OCTETS) == EVENT


def test_the_topic_is_written_in_xcdr1_unless_asked_otherwise() -> None:
    assert type_support(BuiltinLoggingTypeV2).representations[0] is DataRepresentationId.XCDR1


def test_what_is_cut_short_is_malformed() -> None:
    """Within a member, that is: a type that can be appended to may also end sooner, with whole members."""
    last_member = OCTETS.index(bytes.fromhex("01000000 04000000 44445300"))
    for length in (*range(4), *range(last_member + 1, len(OCTETS))):
        with pytest.raises(MalformedSample):
            deserialize(BuiltinLoggingTypeV2, OCTETS[:length])


@given(position=st.integers(4, len(OCTETS) - 1), octet=st.integers(0, 255))
def test_an_altered_octet_is_read_or_malformed_and_nothing_else(position: int, octet: int) -> None:
    altered = bytearray(OCTETS)
    altered[position] = octet
    try:
        event = deserialize(BuiltinLoggingTypeV2, altered)
    except MalformedSample:
        return
    assert isinstance(event, BuiltinLoggingTypeV2)
