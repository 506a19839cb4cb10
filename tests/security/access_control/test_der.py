"""DER: read strictly, by the shortest form alone, and never beyond the end."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from ddsi.structure.errors import MalformedMessage
from ddsi_security.access_control.der import DerReader, Tag, object_identifier

ELEMENTS = [
    (b"\x05\x00", 0x05, b""),
    (b"\x02\x01\x7f", Tag.INTEGER, b"\x7f"),
    (b"\x04\x7f" + bytes(127), Tag.OCTET_STRING, bytes(127)),
    (b"\x04\x81\x80" + bytes(128), Tag.OCTET_STRING, bytes(128)),
    (b"\x30\x82\x01\x00" + bytes(256), Tag.SEQUENCE, bytes(256)),
]


@pytest.mark.parametrize(("octets", "tag", "content"), ELEMENTS)
def test_an_element_is_its_tag_and_its_content(octets: bytes, tag: int, content: bytes) -> None:
    reader = DerReader(octets + b"\x05\x00", "test")
    found = reader.next(tag)
    assert (found.tag, bytes(found.content), bytes(found.encoding)) == (tag, content, octets)
    reader.next(Tag.NULL)
    reader.end()


@pytest.mark.parametrize(("octets", "tag", "content"), ELEMENTS)
def test_every_prefix_is_malformed(octets: bytes, tag: int, content: bytes) -> None:
    for end in range(len(octets)):
        with pytest.raises(MalformedMessage):
            DerReader(octets[:end], "test").next()


@pytest.mark.parametrize(
    "octets",
    [
        b"\x04\x81\x7f" + bytes(127),  # a length that fits one octet in two
        b"\x04\x82\x00\x80" + bytes(128),  # a leading zero
        b"\x30\x80\x05\x00\x00\x00",  # BER's indefinite length
        b"\x04\x85\x00\x00\x00\x00\x01\x00",  # five octets of length
        b"\x04\x84\xff\xff\xff\xff\x00",  # four gigabytes announced
        b"\x04\xff" + bytes(127),  # the reserved length of lengths
        b"\x1f\x81\x01\x00",  # a tag of several octets
    ],
)
def test_what_der_does_not_allow_is_malformed(octets: bytes) -> None:
    with pytest.raises(MalformedMessage):
        DerReader(octets, "test").next()


def test_an_unexpected_tag_and_trailing_octets_are_malformed() -> None:
    with pytest.raises(MalformedMessage, match="tag 0x30 is expected, 0x04 is there"):
        DerReader(b"\x04\x00", "test").next(Tag.SEQUENCE)
    reader = DerReader(b"\x05\x00\x00", "test")
    reader.next()
    with pytest.raises(MalformedMessage, match="1 octets too many"):
        reader.end()


def test_optional_reads_nothing_of_another_tag() -> None:
    reader = DerReader(b"\x05\x00", "test")
    assert reader.optional(Tag.SET) is None
    assert reader.optional(Tag.NULL) is not None
    assert reader.optional(Tag.NULL) is None


IDENTIFIERS = {
    "2a864886f70d010702": "1.2.840.113549.1.7.2",
    "608648016503040201": "2.16.840.1.101.3.4.2.1",
    "8837": "2.999",
    "2a8648ce3d040302": "1.2.840.10045.4.3.2",
    "00": "0.0",
}


@pytest.mark.parametrize(("digits", "dotted"), IDENTIFIERS.items())
def test_object_identifiers_are_read_in_dots(digits: str, dotted: str) -> None:
    assert object_identifier(memoryview(bytes.fromhex(digits))) == dotted


@pytest.mark.parametrize("digits", ["", "2a86", "2a8001", "2a8fffffffffff7f"])
def test_object_identifiers_that_are_none_are_malformed(digits: str) -> None:
    with pytest.raises(MalformedMessage):
        object_identifier(memoryview(bytes.fromhex(digits)))


@given(st.binary(max_size=60))
def test_any_octets_are_elements_or_malformed(octets: bytes) -> None:
    reader, read = DerReader(octets, "test"), b""
    try:
        while not reader.at_end:
            read += reader.next().encoding
    except MalformedMessage:
        assert octets.startswith(read)
    else:
        assert read == octets
