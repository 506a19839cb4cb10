"""Subject names: compared by what they mean, however they are written."""

from __future__ import annotations

import pytest
from cryptography import x509
from cryptography.x509.oid import NameOID
from hypothesis import given
from hypothesis import strategies as st

from ddsi.structure.errors import MalformedMessage
from ddsi_security.access_control.subject_name import SubjectName

ALIKE = {
    "order and form": [
        "CN=alice,O=Example Org,C=US",
        "C=US,O=Example Org,CN=alice",
        "C = US, O = Example Org, CN = alice",
        "/C=US/O=Example Org/CN=alice",
        "cn=alice;o=Example Org;c=US",
        "commonName=alice, organizationName=Example Org, countryName=US",
        "2.5.4.3=alice,OID.2.5.4.10=Example Org,2.5.4.6=US",
        "CN=alice + O=Example Org,C=US",
        ' CN="alice" , O="Example Org",C=US ',
        "CN=#0c05616c696365,O=#130b4578616d706c65204f7267,C=US",
        "CN=\\61lice,O=Example\\ Org,C=\\55S",
        "\n  CN=alice,\n  O=Example Org,\n  C=US\n",
    ],
    "e-mail": [
        "emailAddress=a@b.org,CN=x",
        "E=a@b.org,CN=x",
        "1.2.840.113549.1.9.1=a@b.org,CN=x",
        "1.2.840.113549.1.9.1=#16076140622e6f7267,CN=x",
        "/CN=x/emailAddress=a@b.org",
    ],
    "special characters": [
        'CN=a\\,b\\+c\\"d\\\\e\\<f\\>g\\;h\\=i,O=x',
        'CN="a,b+c\\"d\\\\e<f>g;h=i",O=x',
        "CN=a\\2cb\\2Bc\\22d\\5ce\\3cf\\3eg\\3bh\\3di,O=x",
    ],
    "a slash in a value": ["CN=/talker_listener/talker", "/CN=/talker_listener/talker"],
    "not ASCII": [
        "CN=M\u00fcller,O=x",
        "CN=M\\c3\\bcller,O=x",
        "CN=#0c074dc3bc6c6c6572,O=x",
        "CN=#1e0c004d00fc006c006c00650072,O=x",
    ],
    "white space at the ends": ["CN=\\ a\\ ,O=x", 'CN=" a ",O=x', "CN=\\20a\\20 ,O=x"],
    "an unknown type": ["myType=1,CN=a", "CN=a,MYTYPE=1"],
    "a value that is no string": ["CN=#0500", "CN=#0500 "],
}


@pytest.mark.parametrize("texts", ALIKE.values(), ids=ALIKE)
def test_names_that_mean_the_same_are_equal(texts: list[str]) -> None:
    first = SubjectName.parse(texts[0])
    for text in texts:
        assert SubjectName.parse(text) == first, text
        assert hash(SubjectName.parse(text)) == hash(first)


DIFFERENT = [
    ("CN=alice,O=x", "CN=alice"),
    ("CN=alice", "CN=Alice"),
    ("CN=alice", "OU=alice"),
    ("CN=a,CN=b", "CN=a,CN=b,CN=b"),  # repeated attributes count
    ("CN=a,CN=a", "CN=a"),
    ("CN=a\\,O=x", "CN=a,O=x"),
    ("CN=a", "CN=a b"),
    ("CN=a", "CN=a\\ "),
    ("CN=a", "CN=a\u00a0"),
    ("CN=alice,O=mallory", "CN=mallory,O=alice"),
    ("/CN=a/O=x", "/CN=a\\/O=x"),
    ("CN=a  b", "CN=a b"),
    ("1.2.3=a", "1.2.4=a"),
]


@pytest.mark.parametrize(("one", "other"), DIFFERENT)
def test_names_that_differ_are_not_equal(one: str, other: str) -> None:
    assert SubjectName.parse(one) != SubjectName.parse(other)


@pytest.mark.parametrize(
    "text",
    [
        "", "  ", "alice", "/", "/alice", "=a", "CN", "CN=a,", "CN=a,,O=b", "C N=a", "CN=\\", 'CN="a', "CN=#0",
        "CN=#zz",
        "CN=#0c", "CN=#0c05616c", "CN=#0c0161ff", "CN=\\ff", "CN=#0c01ff", "1..2=a", "1=a", "\u212a=a", "-=a",
        "CN=" + "a" * 5000, ",".join(["CN=a"] * 65), "9" * 30 + ".1=a",
    ],
)  # fmt: skip
def test_what_is_no_name_is_malformed(text: str) -> None:
    with pytest.raises(MalformedMessage):
        SubjectName.parse(text)


@given(st.text(max_size=60) | st.text('CN=O,+\\"#/;0c5 ', max_size=30))
def test_hostile_text_is_a_name_or_malformed(text: str) -> None:
    try:
        name = SubjectName.parse(text)
    except MalformedMessage:
        return
    assert name.attributes
    assert name == SubjectName.parse(text)


VALUES = st.text(st.characters(exclude_categories=["Cs", "Cc"]), min_size=1, max_size=20)
TYPES = st.sampled_from([NameOID.COMMON_NAME, NameOID.ORGANIZATION_NAME, NameOID.EMAIL_ADDRESS, NameOID.USER_ID])


@given(st.lists(st.tuples(TYPES, VALUES), min_size=1, max_size=5))
def test_names_of_certificates_are_read_as_they_are_printed(
    attributes: list[tuple[x509.ObjectIdentifier, str]],
) -> None:
    """What the authentication plugin gives: RFC 4514's text of a certificate's subject, whatever is in it."""
    name = x509.Name([x509.NameAttribute(kind, value) for kind, value in attributes])
    expected = sorted((kind.dotted_string, value) for kind, value in attributes)
    assert list(SubjectName.parse(name.rfc4514_string()).attributes) == expected


def test_a_name_is_shown_as_it_was_written() -> None:
    assert str(SubjectName.parse(" CN=alice, O=x ")) == "CN=alice, O=x"
