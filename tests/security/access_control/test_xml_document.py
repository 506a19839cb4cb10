"""XML of documents: nothing that XML can do to its reader works, and what is wrong is said with its line."""

from __future__ import annotations

import contextlib
import time

import pytest
from hypothesis import given
from hypothesis import strategies as st

from ddsi_security.access_control.document_error import DocumentError
from ddsi_security.access_control.governance import Governance
from ddsi_security.access_control.permissions import Permissions
from ddsi_security.access_control.xml_document import Node, parse_document
from tests.security.access_control.documents import governance_xml, permissions_xml


def parse(xml: bytes) -> Node:
    return parse_document(xml, name="g.p7s", first_line=10)


def error(xml: bytes) -> DocumentError:
    with pytest.raises(DocumentError) as caught:
        parse(xml)
    assert caught.value.document == "g.p7s"
    return caught.value


# --- hostile ---------------------------------------------------------------------------------------------------

_LAUGHS = "".join(f'<!ENTITY l{n} "{f"&l{n - 1};" * 10}">' for n in range(1, 10))
_BOMB = f'<!DOCTYPE dds [<!ENTITY l0 "lol">{_LAUGHS}]>'
_ATTRIBUTES = " ".join(f"a{number}=''" for number in range(10_000))
HOSTILE = {
    "a billion laughs": (f"{_BOMB}<dds>&l9;</dds>", "document type declaration"),
    "laughs in an attribute": (f'{_BOMB}<dds a="&l9;"/>', "document type declaration"),
    "a file": ('<!DOCTYPE dds [<!ENTITY f SYSTEM "file:///etc/passwd">]><dds>&f;</dds>', "document type declaration"),
    "a parameter entity": ('<!DOCTYPE dds [<!ENTITY % p SYSTEM "http://127.0.0.1/x">%p;]><dds/>', "document type"),
    "a foreign DTD": ('<!DOCTYPE dds SYSTEM "http://127.0.0.1/x.dtd"><dds/>', "document type declaration"),
    "an undeclared entity": ("<dds>&nobody;</dds>", "not XML"),
    "depth": ("<dds>" * 5000 + "</dds>" * 5000, "not XML: Excessive depth|more than 16 deep"),
    "some depth": ("<dds>" * 20 + "</dds>" * 20, "more than 16 deep"),
    "many elements": (f"<dds>{'<x/>' * 60_000}</dds>", "more than 50000 elements"),
    "size": (f"<dds>{' ' * (1 << 20)}</dds>", "at most"),
    "a huge name": (f"<{'d' * 100_000}/>", "not XML|may not stand here"),
    "many attributes": (f"<dds {_ATTRIBUTES}/>", "attribute"),
    "many words that nobody knows": (f"<dds>{'<x>y</x>' * 40_000}</dds>", "<x> may not stand here"),
    "an include": (
        '<dds xmlns:xi="http://www.w3.org/2001/XInclude"><xi:include href="file:///etc/passwd"/></dds>',
        "stand",
    ),
    "nothing": ("", "not XML"),
    "NUL": ("<dds>\0</dds>", "not XML"),
    "a second root": ("<dds/><dds/>", "not XML"),
    "another root": ("<grant/>", "<grant> is no document; it begins with <dds>"),
    "a namespace": ('<dds xmlns="http://example.org/"><permissions/></dds>', "is no document"),
    "a type of its own": (
        permissions_xml().decode().replace("<default>", '<default xsi:type="xsi:string" xsi:nil="true" x="1">'),
        "attribute 'x' is not allowed|not allowed",
    ),
}


@pytest.mark.parametrize(("xml", "reason"), HOSTILE.values(), ids=HOSTILE)
def test_hostile_documents_are_refused_in_no_time(xml: str, reason: str) -> None:
    begin = time.process_time()
    with pytest.raises(DocumentError, match=reason):
        parse(xml.encode())
    assert time.process_time() - begin < 3


@pytest.mark.parametrize("encoding", ["utf-16", "utf-7", "utf-32-le", "cp037"])
def test_no_encoding_hides_a_declaration(encoding: str) -> None:
    """In none of these is < the octet that it is in ASCII, or not only that."""
    text = f'<?xml version="1.0" encoding="{encoding}"?><!DOCTYPE dds [<!ENTITY a "b">]><dds>&a;</dds>'
    error(text.encode(encoding))
    error(f'<?xml version="1.0" encoding="{encoding}"?>'.encode() + text.encode(encoding))


@pytest.mark.parametrize("encoding", ["UTF-8", "utf-8", "US-ASCII", "ISO-8859-1"])
def test_common_encodings_are_read(encoding: str) -> None:
    text = permissions_xml(subject="CN=M\u00fcller" if encoding != "US-ASCII" else "CN=Mueller").decode()
    octets = text.replace('encoding="UTF-8"', f'encoding="{encoding}"').encode(encoding)
    (grant,) = Permissions.parse(octets, name="p").grants
    assert str(grant.subject).startswith("CN=M")


def test_octets_that_are_not_what_they_say_are_refused() -> None:
    assert "it is not utf-8" in error(permissions_xml().replace(b"alice", b"al\xffice")).reason


def test_comments_and_instructions_are_not_there() -> None:
    """They must not cut a word in two: what is compared is what people see."""
    xml = permissions_xml().replace(b"CN=alice,", b"CN=<!-- not -->al<?x y?>ice<!---->,<![CDATA[]]>")
    assert (
        Permissions.parse(xml, name="p").grants[0].subject
        == Permissions.parse(permissions_xml(), name="p").grants[0].subject
    )


@given(st.data())
def test_damaged_documents_raise_one_error_alone(data: st.DataObject) -> None:
    xml = bytearray(data.draw(st.sampled_from([governance_xml(), permissions_xml()]), label="document"))
    for _ in range(data.draw(st.integers(1, 5), label="changes")):
        position = data.draw(st.integers(0, len(xml) - 1), label="at")
        count = data.draw(st.integers(0, 12), label="less")
        xml[position : position + count] = data.draw(
            st.binary(max_size=4) | st.sampled_from([b"<", b">", b"&", b"]]>", b"<!--", b"<dds>", b"</dds>", b"\0"]),
            label="more",
        )
        xml = xml or bytearray(b" ")
    for read in (Governance.parse, Permissions.parse):
        with contextlib.suppress(DocumentError):
            read(bytes(xml), name="d")


# --- where and what ----------------------------------------------------------------------------------------------


GOVERNANCE_ERRORS = {
    "a misspelt element": (
        (b"enable_join_access_control>", b"enable_join_acces_control>"),
        (
            "g.p7s, line 16, domain_rule 1: <enable_join_acces_control> may not stand here; "
            "did you mean enable_join_access_control?"
        ),
    ),
    "the case of an element": (
        (b"topic_rule>", b"Topic_Rule>"),
        "g.p7s, line 21, domain_rule 1: <Topic_Rule> may not stand here; did you mean topic_rule?",
    ),
    "a misspelt kind": (
        (b">SIGN<", b">SINGED<"),
        "g.p7s, line 27, domain_rule 1, topic_rule 1: <metadata_protection_kind> is 'SINGED'; did you mean SIGN?",
    ),
    "a kind that data cannot have": (
        (b"ENCRYPT</data", b"ENCRYPT_WITH_ORIGIN_AUTHENTICATION</data"),
        (
            "g.p7s, line 28, domain_rule 1, topic_rule 1: <data_protection_kind> is "
            "'ENCRYPT_WITH_ORIGIN_AUTHENTICATION'; expected NONE or SIGN or ENCRYPT"
        ),
    ),
    "a boolean": (
        (b">true</enable_read", b">yes</enable_read"),
        "g.p7s, line 25, domain_rule 1, topic_rule 1: <enable_read_access_control> is 'yes'; expected true or false",
    ),
    "a domain": (
        (b"<max>230</max>", b"<max>-1</max>"),
        "g.p7s, line 14, domain_rule 1: <max> is '-1'; expected a whole number from 0 to 2147483647",
    ),
    "a domain that is too large": (
        (b"<max>230</max>", b"<max>99999999999999999999</max>"),
        "g.p7s, line 14, domain_rule 1: <max> is '99999999999999999999'; expected a whole number from 0 to 2147483647",
    ),
    "an empty range": (
        (b"<min>0</min><max>230</max>", b"<min>5</min><max>3</max>"),
        "g.p7s, line 14, domain_rule 1: the range from 5 to 3 is empty; exchange <min> and <max>",
    ),
    "a range without ends": (
        (b"<min>0</min><max>230</max>", b""),
        "g.p7s, line 14, domain_rule 1: <id_range> has neither <min> nor <max>; add at least one",
    ),
    "a missing element": (
        (b"<rtps_protection_kind>NONE</rtps_protection_kind>", b""),
        "g.p7s, line 13, domain_rule 1: <domain_rule> is not complete; add <rtps_protection_kind>",
    ),
    "no topic rule": (
        (governance_xml(), governance_xml(topics=())),
        "g.p7s, line 20, domain_rule 1: <topic_access_rules> is not complete; add <topic_rule>",
    ),
    "a second element": (
        (b"</rtps_protection_kind>", b"</rtps_protection_kind><rtps_protection_kind>SIGN</rtps_protection_kind>"),
        "g.p7s, line 19, domain_rule 1: <rtps_protection_kind> stands there a second time; keep one",
    ),
    "an empty expression": (
        (b"<topic_expression>*<", b"<topic_expression> <"),
        "g.p7s, line 22, domain_rule 1, topic_rule 1: <topic_expression> is ''; expected an expression such as *",
    ),
    "a hostile expression": (
        (b"<topic_expression>*<", b"<topic_expression>" + b"*a" * 1000 + b"<"),
        "g.p7s, line 22, domain_rule 1, topic_rule 1: <topic_expression>: an expression of 2000 characters",
    ),
    "text beside elements": (
        (b"<topic_rule>", b"<topic_rule>stray"),
        "g.p7s, line 21, domain_rule 1, topic_rule 1: <topic_rule> has text beside its elements",
    ),
    "an attribute": (
        (b"<domain_rule>", b'<domain_rule nam="x">'),
        "g.p7s, line 13, domain_rule 1: The attribute 'nam' is not allowed",
    ),
    "cut off": ((b"</dds>", b""), "g.p7s, line 34: it is not XML: Premature end of data in tag dds line 11"),
    "permissions": (
        (governance_xml(), permissions_xml()),
        "g.p7s, line 11: it is a permissions document, not governance",
    ),
}


@pytest.mark.parametrize(("change", "text"), GOVERNANCE_ERRORS.values(), ids=GOVERNANCE_ERRORS)
def test_what_is_wrong_in_governance_is_said_with_its_line(change: tuple[bytes, bytes], text: str) -> None:
    xml = governance_xml().replace(*change)
    assert xml != governance_xml()
    with pytest.raises(DocumentError) as caught:
        Governance.parse(xml, name="g.p7s", first_line=10)
    assert str(caught.value).startswith(text)


RULES = "<allow_rule>@ALL<publish><topics><topic>*</topic></topics></publish></allow_rule>"
PERMISSIONS_ERRORS = {
    "a misspelt element": (
        (b"publish>", b"publsih>"),
        "p.p7s, line 10, grant 'alice', allow_rule 1: <publsih> may not stand here; did you mean publish?",
    ),
    "a default that is none": (
        (b">DENY<", b">deny<"),
        "p.p7s, line 11, grant 'alice': <default> is 'deny'; did you mean DENY?",
    ),
    "no default": (
        (b"<default>DENY</default>", b""),
        "p.p7s, line 4, grant 'alice': <grant> has no <default>; add <default>...</default>",
    ),
    "two defaults": (
        (b"</default>", b"</default>\n<default>ALLOW</default>"),
        "p.p7s, line 12, grant 'alice': <default> stands there a second time; the first is in line 11",
    ),
    "no subject": (
        (b"<subject_name>CN=alice,O=Tests</subject_name>", b""),
        "p.p7s, line 4, grant 'alice': <grant> has no <subject_name>",
    ),
    "a subject that is none": (
        (b"CN=alice,O=Tests", b"alice"),
        "p.p7s, line 5, grant 'alice': <subject_name> cannot be read: TYPE=value is expected, 'alice' is there; write ",
    ),
    "two kinds of subject": (
        (b"<validity>", b"<subject_name_expression>*</subject_name_expression><validity>"),
        "p.p7s, line 6, grant 'alice': a grant has a <subject_name> or a <subject_name_expression>, not both",
    ),
    "no validity": (
        (b"validity>", b"valdity>"),
        "p.p7s, line 6, grant 'alice': <valdity> may not stand here; did you mean validity?",
    ),
    "half a validity": (
        (b"<not_after>2037-12-31T00:00:00</not_after>", b""),
        "p.p7s, line 6, grant 'alice': <validity> is not complete; add <not_after>",
    ),
    "a date": (
        (b"2037-12-31T00:00:00", b"2037-02-31T00:00:00"),
        "p.p7s, line 8, grant 'alice': <not_after> is no date and time: day ",
    ),
    "a date in words": (
        (b"2037-12-31T00:00:00", b"never"),
        "p.p7s, line 8, grant 'alice': <not_after> is no date and time: 'never'; write it as 2030-12-31T23:59:59Z",
    ),
    "dates exchanged": (
        (b"2037-12-31T00:00:00", b"2019-12-31T00:00:00"),
        "p.p7s, line 6, grant 'alice': it ends at 2019-12-31T00:00:00 before it begins at 2020-01-01T00:00:00",
    ),
    "no domains": (
        (b"<domains><id_range><min>0</min><max>230</max></id_range></domains>", b""),
        "p.p7s, line 10, grant 'alice', allow_rule 1: <allow_rule> has no <domains>",
    ),
    "no topics": (
        (b"<topics><topic>*</topic></topics>", b""),
        "p.p7s, line 10, grant 'alice', allow_rule 1: <publish> is not complete; add <topics>",
    ),
    "no grant": (
        (permissions_xml(RULES), b"<dds>\n<permissions/></dds>"),
        "p.p7s, line 2: <permissions> is not complete; add <grant>",
    ),
    "governance": (
        (permissions_xml(RULES), governance_xml()),
        "p.p7s, line 2: it is a governance document, not permissions",
    ),
}


@pytest.mark.parametrize(("change", "text"), PERMISSIONS_ERRORS.values(), ids=PERMISSIONS_ERRORS)
def test_what_is_wrong_in_permissions_is_said_with_its_line(change: tuple[bytes, bytes], text: str) -> None:
    xml = permissions_xml(RULES).replace(*change)
    assert xml != permissions_xml(RULES)
    with pytest.raises(DocumentError) as caught:
        Permissions.parse(xml, name="p.p7s")
    assert str(caught.value).startswith(text)


# --- what may be ignored -------------------------------------------------------------------------------------------


def test_unknown_elements_may_be_marked_as_such() -> None:
    """1.2: what a newer or another implementation adds, and says itself that it can be done without."""
    added = b'<enforce_it must_interpret="false"><deep><er/></deep></enforce_it><domains>'
    Governance.parse(governance_xml().replace(b"<domains>", added), name="g")
    with pytest.raises(DocumentError, match="<enforce_it> may not stand here"):
        Governance.parse(governance_xml().replace(b"<domains>", added.replace(b"false", b"true")), name="g")


def test_the_mark_switches_off_no_rule_that_is_known() -> None:
    rules = '<deny_rule must_interpret="false">@ALL<publish><topics><topic>X</topic></topics></publish></deny_rule>'
    (grant,) = Permissions.parse(permissions_xml(rules), name="p").grants
    assert [rule.is_allow for rule in grant.rules] == [False]


def test_text_is_not_lost_with_what_is_ignored() -> None:
    xml = permissions_xml().replace(b"<topic>*<", b'<topic>A<x must_interpret="false"/>B<')
    with pytest.raises(DocumentError):
        Permissions.parse(xml, name="p")


def test_elements_of_a_rule_may_stand_in_any_order() -> None:
    lines = governance_xml().splitlines()
    at = next(index for index, line in enumerate(lines) if b"allow_unauthenticated" in line)
    lines[at : at + 5] = lines[at : at + 5][::-1]
    assert Governance.parse(b"\n".join(lines), name="g").domain_rules[0].enable_join_access_control
