"""Whatever files hold, the commands say something about it, in bounded time, and never what is secret."""

from __future__ import annotations

import base64
from contextlib import suppress
from pathlib import Path

import pytest
from cryptography.hazmat.primitives.serialization import Encoding
from cryptography.x509 import load_pem_x509_certificate
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from ddsi.structure.errors import ConfigurationError
from ddsi_security.keystore.horizon import Horizon
from ddsi_security.keystore.linter import check_keystore
from ddsi_security.keystore.portrait import portrait_lines, portray

from .keystores import NOW, Workshop

SOON = Horizon.of_days(NOW, 30)
many = settings(max_examples=25, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return Workshop(tmp_path_factory.mktemp("hostile") / "alice").write()


def spoilt(octets: bytes, data: st.DataObject) -> bytes:
    """With a run of octets replaced, removed or put in."""
    begin = data.draw(st.integers(0, len(octets)))
    end = data.draw(st.integers(begin, min(len(octets), begin + 8)))
    return octets[:begin] + data.draw(st.binary(max_size=8)) + octets[end:]


def look_at(folder: Path, name: str, octets: bytes) -> None:
    """All that looks at a file; a ConfigurationError is an answer."""
    path = folder / name
    before = path.read_bytes()
    secrets = (folder / "key.pem").read_text().splitlines()[1:-1]
    path.write_bytes(octets)
    try:
        for finding in check_keystore(folder, SOON):
            assert finding.text
            assert finding.remedy
            assert not any(secret in str(finding) for secret in secrets)
        with suppress(ConfigurationError):
            assert portrait_lines(portray(path))
    finally:
        path.write_bytes(before)


@many
@given(data=st.data())
@pytest.mark.parametrize("name", ["cert.pem", "identity_ca.cert.pem"])
def test_certificates(folder: Path, name: str, data: st.DataObject) -> None:
    der = load_pem_x509_certificate((folder / name).read_bytes()).public_bytes(Encoding.DER)
    text = base64.encodebytes(spoilt(der, data)).decode()
    look_at(folder, name, f"-----BEGIN CERTIFICATE-----\n{text}-----END CERTIFICATE-----\n".encode())


@many
@given(data=st.data())
@pytest.mark.parametrize("name", ["key.pem", "governance.p7s", "permissions.p7s"])
def test_keys_and_documents(folder: Path, name: str, data: st.DataObject) -> None:
    look_at(folder, name, spoilt((folder / name).read_bytes(), data))


@pytest.mark.parametrize(
    "content",
    [
        b"",
        b"\0" * 4096,
        b"\xff" * (1 << 20),
        b"<" * (1 << 20) + b">",
        b'<!DOCTYPE dds [<!ENTITY a "b"><!ENTITY c "&a;&a;">]><dds><permissions>&c;</permissions></dds>',
        b"<dds><permissions>" + b"<grant>" * 10000 + b"</dds>",
        b"<dds><domain_access_rules/></dds>",
        b"MIME-Version: 1.0\nContent-Type: multipart/signed; boundary=x\n\n--x\n<permissions> </dds>\n--x\n--x--\n",
        b"-----BEGIN PRIVATE KEY-----\n" * 1000,
        b"-----BEGIN CERTIFICATE-----\n" * 1000,
    ],
    ids=lambda content: f"{content[:20]!r}",
)
@pytest.mark.parametrize(
    "name", ["cert.pem", "key.pem", "permissions_ca.cert.pem", "governance.p7s", "permissions.p7s"]
)
def test_anything_instead_of_a_file(folder: Path, name: str, content: bytes) -> None:
    look_at(folder, name, content)


@pytest.mark.parametrize("name", ["key.pem", "governance.p7s", "identity_ca.cert.pem"])
def test_links_that_lead_nowhere(tmp_path: Path, name: str) -> None:
    folder = Workshop(tmp_path / "alice").write()
    for target in (name, "nothing", str(tmp_path)):
        (folder / name).unlink()
        (folder / name).symlink_to(target)
        assert "file-missing" in {finding.rule.id for finding in check_keystore(folder, SOON)}
