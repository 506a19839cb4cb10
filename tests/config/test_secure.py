"""Where a participant's security properties come from: a keystore folder, its QoS, or <Security> of DDSI_URI."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

import ddsi
from ddsi.config import Config
from ddsi.config.secure import participant_properties, secure
from ddsi.structure.errors import ConfigurationError
from ddsi.structure.qos_policies import Property

FILES = (
    "identity_ca.cert.pem",
    "cert.pem",
    "key.pem",
    "permissions_ca.cert.pem",
    "governance.p7s",
    "permissions.p7s",
)
XML = """<CycloneDDS><Domain>
  <Security>
    <Authentication>
      <Library path="dds_security_auth" initFunction="init_authentication" finalizeFunction="finalize_authentication"/>
      <IdentityCA>file:${KEYSTORE}/ca.pem</IdentityCA>
      <IdentityCertificate>file:${KEYSTORE}/cert.pem</IdentityCertificate>
      <PrivateKey>file:${KEYSTORE}/key.pem</PrivateKey>
      <Password>secret word</Password>
      <TrustedCADirectory/>
      <IncludeOptionalFields>true</IncludeOptionalFields>
    </Authentication>
    <AccessControl>
      <PermissionsCA>file:pca.pem</PermissionsCA>
      <Governance>file:governance.p7s</Governance>
      <Permissions>data:,one
two</Permissions>
    </AccessControl>
    <Cryptographic><Library path="dds_security_crypto"/></Cryptographic>
  </Security>
</Domain></CycloneDDS>"""
PROPERTIES = {
    "dds.sec.auth.identity_ca": "file:/k/ca.pem",
    "dds.sec.auth.identity_certificate": "file:/k/cert.pem",
    "dds.sec.auth.private_key": "file:/k/key.pem",
    "dds.sec.auth.password": "secret word",
    "dds.sec.access.permissions_ca": "file:pca.pem",
    "dds.sec.access.governance": "file:governance.p7s",
    "dds.sec.access.permissions": "data:,one\ntwo",
}


def configured() -> Config:
    return Config.from_uri(XML, environ={"KEYSTORE": "/k"})


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    for name in FILES:
        (tmp_path / name).write_text("content")
    return tmp_path


def test_a_folder_gives_the_six_properties(folder: Path) -> None:
    properties = ddsi.secure(folder).properties
    assert properties is not None
    assert {name: value.value for name, value in properties.items() if isinstance(value, Property)} == {
        "dds.sec.auth.identity_ca": f"file:{folder}/identity_ca.cert.pem",
        "dds.sec.auth.identity_certificate": f"file:{folder}/cert.pem",
        "dds.sec.auth.private_key": f"file:{folder}/key.pem",
        "dds.sec.access.permissions_ca": f"file:{folder}/permissions_ca.cert.pem",
        "dds.sec.access.governance": f"file:{folder}/governance.p7s",
        "dds.sec.access.permissions": f"file:{folder}/permissions.p7s",
    }
    assert not any(value.propagate for value in properties.values() if isinstance(value, Property))


def test_a_folder_that_lacks_files_is_refused_by_their_names(folder: Path) -> None:
    (folder / "key.pem").unlink()
    (folder / "governance.p7s").unlink()
    with pytest.raises(ConfigurationError, match=r"lacks key\.pem, governance\.p7s; make one with `ddsi keystore"):
        secure(folder)


def test_a_folder_that_is_not_there_is_told_as_that(tmp_path: Path) -> None:
    with pytest.raises(ConfigurationError, match=r"there is no folder .*/nowhere; make a keystore"):
        secure(tmp_path / "nowhere")


@pytest.mark.parametrize("named", [".", "enclaves"])
def test_who_names_the_whole_keystore_is_told_an_identity_in_it(tmp_path: Path, named: str) -> None:
    alice = tmp_path / "enclaves" / "alice"
    alice.mkdir(parents=True)
    (alice / "cert.pem").write_text("content")
    with pytest.raises(ConfigurationError, match=rf"the folder of one identity, such as {re.escape(str(alice))}$"):
        secure(tmp_path / named)


def test_a_password_is_kept_and_not_shown(folder: Path) -> None:
    qos = secure(str(folder), password="secret word")
    assert (qos.properties or {})["dds.sec.auth.password"] == Property("secret word")
    assert "secret word" not in repr(qos)


def test_the_xml_stands_for_the_same_properties() -> None:
    assert dict(configured().security) == PROPERTIES


def test_a_configuration_shows_which_properties_it_has_and_no_value() -> None:
    text = repr(configured())
    assert "dds.sec.auth.password" in text
    assert "secret word" not in text
    assert "/k/" not in text


def with_password(password: str) -> Config:
    xml = f"<Domain><Security><Authentication><Password>{password}</Password></Authentication></Security></Domain>"
    return Config.from_uri(xml, environ={})


@pytest.mark.parametrize("password", ["hun${ter2", "${NO:?hunter2}", "${hun hunter2:}"])
def test_a_password_that_looks_like_a_variable_is_not_shown(password: str) -> None:
    with pytest.raises(
        ConfigurationError, match="give a password that holds these characters by a variable"
    ) as refusal:
        with_password(password)
    assert "hun" not in str(refusal.value)
    assert "ter2" not in str(refusal.value)


def test_what_a_password_names_as_a_variable_is_not_shown_though_it_is_not_set() -> None:
    (warning,) = with_password("x${hunter2}").config_warnings
    assert warning.endswith("an environment variable in it is not set and reads as empty")
    assert "hunter2" not in warning


def test_either_place_serves_and_both_when_they_agree() -> None:
    text = {name: Property(value) for name, value in PROPERTIES.items()}
    assert participant_properties(None, configured()) == text
    assert participant_properties(PROPERTIES, Config()) == PROPERTIES
    assert participant_properties(PROPERTIES | {"app": "x"}, configured())["app"] == "x"


@pytest.mark.parametrize(
    ("changed", "named"),
    [
        ({"dds.sec.access.governance": "file:other"}, "dds.sec.access.governance"),
        ({"dds.sec.auth.crl": "file:crl"}, "dds.sec.auth.crl"),
    ],
)
def test_both_are_refused_when_they_differ(changed: dict[str, str], named: str) -> None:
    with pytest.raises(ConfigurationError, match="configured twice and not alike") as refusal:
        participant_properties(PROPERTIES | changed, configured())
    assert named in str(refusal.value)
    assert "file:" not in str(refusal.value)


def test_one_that_is_only_in_the_configuration_is_a_difference_too() -> None:
    given = {name: value for name, value in PROPERTIES.items() if name != "dds.sec.auth.password"}
    with pytest.raises(ConfigurationError, match=r"dds\.sec\.auth\.password"):
        participant_properties(given, configured())


@pytest.mark.parametrize("name", ["dds.sec.log.log_level", "dds.sec.crypto.keysize", "dds.sec.auth.library.path"])
def test_the_qos_may_add_what_the_configuration_has_no_word_for(name: str) -> None:
    both = participant_properties({name: "x"}, configured())
    assert both[name] == "x"
    assert both["dds.sec.auth.password"] == Property("secret word")


def test_another_stack_s_spelling_is_left_to_who_knows_it() -> None:
    name = "dds.sec.access.builtin.Access-Permissions.governance"
    assert participant_properties({name: "file:other"}, configured()).keys() == {name, *PROPERTIES}
