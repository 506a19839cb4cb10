"""Security properties in everybody's spelling, and what they point to."""

from __future__ import annotations

from pathlib import Path

import pytest

from ddsi.structure.errors import ConfigurationError
from ddsi.structure.qos_policies import BinaryProperty, Property
from ddsi_security.properties import security_properties
from ddsi_security.resources import MAX_RESOURCE_OCTETS, read_resource


@pytest.mark.parametrize(
    ("given", "omg"),
    [
        ("dds.sec.auth.identity_ca", "dds.sec.auth.identity_ca"),
        ("dds.sec.auth.builtin.PKI-DH.identity_ca", "dds.sec.auth.identity_ca"),
        ("dds.sec.auth.builtin.PKI-DH.identity_crl", "dds.sec.auth.crl"),
        ("org.eclipse.cyclonedds.sec.auth.crl", "dds.sec.auth.crl"),
        ("dds.sec.access.builtin.Access-Permissions.governance", "dds.sec.access.governance"),
        ("dds.sec.log.builtin.DDS_LogTopic.logging_level", "dds.sec.log.log_level"),
    ],
)
def test_spellings_of_other_stacks_mean_the_same(given: str, omg: str) -> None:
    assert security_properties({given: Property("file:x")}) == {omg: "file:x"}


def test_what_only_others_understand_is_left_out() -> None:
    assert security_properties({"dds.sec.auth.library.path": "dds_security_auth", "app.name": "x"}) == {}


def test_the_same_twice_is_accepted_and_two_values_are_not() -> None:
    both = {"dds.sec.auth.private_key": "file:a", "dds.sec.auth.builtin.PKI-DH.private_key": "file:a"}
    assert security_properties(both) == {"dds.sec.auth.private_key": "file:a"}
    with pytest.raises(ConfigurationError, match=r"dds\.sec\.auth\.private_key is given twice"):
        security_properties(both | {"dds.sec.auth.private_key": "file:b"})


def test_one_file_in_the_form_of_each_stack_is_the_same() -> None:
    theirs, ours = "dds.sec.auth.builtin.PKI-DH.private_key", "dds.sec.auth.private_key"
    for one, other in (("file:/k/a", "file:///k/a"), ("file:///k/a", "file:/k/a")):
        assert security_properties({theirs: one, ours: other}) == {ours: one}
    with pytest.raises(ConfigurationError, match="given twice"):
        security_properties({theirs: "file:/k/a", ours: "file:///k/b"})


def test_an_unknown_name_is_refused_with_the_nearest_known_one() -> None:
    with pytest.raises(
        ConfigurationError, match=r"identity_certificat: did you mean dds\.sec\.auth\.identity_certificate"
    ):
        security_properties({"dds.sec.auth.identity_certificat": "file:x"})


def test_a_plugin_of_somebody_else_may_have_properties_of_its_own() -> None:
    given = {"dds.sec.auth.plugin": "acme.auth:make", "dds.sec.auth.acme_slot": "3"}
    assert security_properties(given) == given
    with pytest.raises(ConfigurationError, match="acme_slot"):
        security_properties(given | {"dds.sec.auth.plugin": "builtin.PKI-DH"})
    with pytest.raises(ConfigurationError, match="acme_slot"):
        security_properties(given | {"dds.sec.access.acme_slot": "3"})


def test_octets_are_no_text() -> None:
    with pytest.raises(ConfigurationError, match="give it as a string"):
        security_properties({"dds.sec.auth.password": BinaryProperty(b"hidden")})


@pytest.mark.parametrize("form", ["file:{}", "file://{}"])
def test_a_file_is_read_with_and_without_slashes(form: str, tmp_path: Path) -> None:
    (tmp_path / "ca.pem").write_bytes(b"content")
    assert read_resource("p", form.format(tmp_path / "ca.pem")) == b"content"


def test_a_path_may_be_written_as_a_uri_has_it_unless_there_is_such_a_file(tmp_path: Path) -> None:
    spaced, literal = tmp_path / "my ca.pem", tmp_path / "my%20ca.pem"
    spaced.write_bytes(b"spaced")
    assert read_resource("p", spaced.as_uri()) == b"spaced"
    literal.write_bytes(b"literal")
    assert read_resource("p", f"file:{literal}") == b"literal"


def test_data_is_its_own_content() -> None:
    assert read_resource("p", "data:,one\ntwo, three") == b"one\ntwo, three"


@pytest.mark.parametrize(
    ("uri", "text"),
    [
        ("file:/nowhere/ca.pem", r"property p: cannot read /nowhere/ca\.pem: No such file"),
        ("/etc/ca.pem", "has no known scheme: write file:/path"),
        ("http://host/ca.pem", "begins with http:"),
        ("data:,", "the data: URI is empty"),
        ("data:," + "x" * (MAX_RESOURCE_OCTETS + 1), "larger than 1048576 octets"),
        ("file:a\0b", "is not a path"),
    ],
)
def test_what_cannot_be_read_is_refused_with_its_remedy(uri: str, text: str) -> None:
    with pytest.raises(ConfigurationError, match=text):
        read_resource("p", uri)


def test_the_content_of_a_uri_is_never_shown() -> None:
    for uri in ("secret-in-a-wrong-place", "data;secret", "secret:secret" * 9):
        with pytest.raises(ConfigurationError) as refusal:
            read_resource("p", uri)
        assert "secret" not in str(refusal.value)
