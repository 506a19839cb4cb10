"""Names of subjects as people type them, and as documents have them."""

from __future__ import annotations

import pytest
from cryptography import x509
from hypothesis import given
from hypothesis import strategies as st

from ddsi.structure.errors import BadParameter
from ddsi_security.access_control.subject_name import SubjectName
from ddsi_security.keystore.distinguished_name import common_name, parse_name, rfc2253_text


@pytest.mark.parametrize(
    ("typed", "printed", "called"),
    [
        ("/CN=alice", "CN=alice", "alice"),
        ("/C=DE/O=Example Org/CN=alice", "CN=alice,O=Example Org,C=DE", "alice"),
        ("CN=alice,O=Example Org,C=DE", "CN=alice,O=Example Org,C=DE", "alice"),
        ("/CN=/robot/arm", "CN=/robot/arm", "/robot/arm"),
        ("/O=Example, Inc./CN=a", r"CN=a,O=Example\, Inc.", "a"),
        (r"CN=a,O=Example\, Inc.", r"CN=a,O=Example\, Inc.", "a"),
        ("/O=a/emailAddress=a@b.c", "emailAddress=a@b.c,O=a", "emailAddress=a@b.c,O=a"),
        ("emailAddress=a@b.c", "emailAddress=a@b.c", "emailAddress=a@b.c"),
        ("/O=#1+2=3", r"O=\#1\+2=3", r"O=\#1\+2=3"),
        ("/CN=Jürgen", "CN=Jürgen", "Jürgen"),
    ],
)
def test_both_forms_are_read_and_one_is_written(typed: str, printed: str, called: str) -> None:
    name = parse_name(typed)
    assert rfc2253_text(name) == printed
    assert common_name(name) == called
    assert parse_name(printed) == name


@pytest.mark.parametrize(
    "typed", ["", "alice", "/", "/alice", "/CN=", "CN", "CN=a,", "/XX=a", "/C=Germany", "CN=a\\", "=a"]
)
def test_what_is_no_name_is_refused_with_what_to_write(typed: str) -> None:
    with pytest.raises(BadParameter, match=r"/O=Example/CN=alice"):
        parse_name(typed)


@given(st.text(max_size=40))
def test_any_text_is_a_name_or_refused(text: str) -> None:
    try:
        name = parse_name(text)
    except BadParameter:
        return
    assert len(list(name)) > 0


VALUES = st.text(st.characters(codec="utf-8", exclude_categories=["C"]), min_size=1, max_size=20).filter(str.strip)


@given(st.lists(VALUES, min_size=1, max_size=4))
def test_access_control_reads_what_is_written(values: list[str]) -> None:
    """It compares grants with certificates by it."""
    name = x509.Name([x509.NameAttribute(x509.NameOID.ORGANIZATIONAL_UNIT_NAME, value) for value in values])
    read = SubjectName.parse(rfc2253_text(name))
    assert sorted(value for _, value in read.attributes) == sorted(values)
