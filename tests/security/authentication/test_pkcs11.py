"""Keys and certificates in a hardware token; SoftHSM stands for one.  RFC 7512, PKCS #11."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
import threading
from collections.abc import Iterator
from pathlib import Path

import pytest
from cryptography.hazmat.primitives import serialization

from ddsi.structure.errors import ConfigurationError
from ddsi_security.authentication.identity_material import read_identity_material
from ddsi_security.authentication.pkcs11_uri import Pkcs11Uri
from ddsi_security.authentication.signatures import verify

from .material import NOW_S, SECOND, Issued, Pair, Side, identity, key_pem, properties

LIBRARIES = (
    "/usr/lib/softhsm/libsofthsm2.so",
    "/usr/lib64/pkcs11/libsofthsm2.so",
    "/opt/homebrew/lib/softhsm/libsofthsm2.so",
)
PIN = "4711"
IDENTITIES = {"ec": identity("alice"), "rsa": identity("bob", "RSA"), "ec384": identity("carol", "EC-384")}


def library() -> str:
    return next((path for path in LIBRARIES if Path(path).exists()), "")


@pytest.fixture(scope="module")
def token(tmp_path_factory: pytest.TempPathFactory) -> Iterator[str]:
    """A token with three keys and their certificates; gives the beginning of URIs.  One for the module: the library
    reads its configuration once, when it is loaded."""
    missing = [tool for tool in ("softhsm2-util", "openssl") if not shutil.which(tool)]
    missing += [] if library() else ["libsofthsm2.so"]
    try:
        import pkcs11
    except ImportError:
        missing.append("python-pkcs11")
    if missing:
        reason = f"SoftHSM tests need {', '.join(missing)}"
        if os.environ.get("DDSI_REQUIRE_PEERS") == "1":
            pytest.fail(reason)
        pytest.skip(reason)
    directory = tmp_path_factory.mktemp("softhsm")
    configuration = directory / "softhsm2.conf"
    (directory / "tokens").mkdir()
    configuration.write_text(f"directories.tokendir = {directory}/tokens\nlog.level = ERROR\n")
    os.environ["SOFTHSM2_CONF"] = str(configuration)
    try:
        _tool("--init-token", "--free", "--label", "robots", "--pin", PIN, "--so-pin", "0815")
        for index, (label, owner) in enumerate(IDENTITIES.items(), 1):
            key = directory / f"{label}.pem"
            key.write_bytes(key_pem(owner.key))
            _tool("--import", str(key), "--token", "robots", "--label", label, "--id", f"0{index}", "--pin", PIN)
        with pkcs11.lib(library()).get_token(token_label="robots").open(rw=True, user_pin=PIN) as session:
            for label, owner in IDENTITIES.items():
                session.create_object(
                    {
                        pkcs11.Attribute.CLASS: pkcs11.ObjectClass.CERTIFICATE,
                        pkcs11.Attribute.CERTIFICATE_TYPE: pkcs11.CertificateType.X_509,
                        pkcs11.Attribute.TOKEN: True,
                        pkcs11.Attribute.LABEL: label,
                        pkcs11.Attribute.SUBJECT: owner.certificate.subject.public_bytes(),
                        pkcs11.Attribute.VALUE: owner.certificate.public_bytes(serialization.Encoding.DER),
                    }
                )
        yield "pkcs11:token=robots"
    finally:
        del os.environ["SOFTHSM2_CONF"]


def _tool(*arguments: str) -> None:
    subprocess.run(["softhsm2-util", *arguments], check=True, capture_output=True, timeout=30)


def settings(owner: Issued, key: str, **more: str) -> dict[str, str]:
    return properties(owner) | {"dds.sec.auth.private_key": key} | more


def query(pin: str = f"&pin-value={PIN}") -> str:
    return f"?module-path={library()}{pin}"


@pytest.mark.peers
@pytest.mark.parametrize("label", IDENTITIES)
def test_the_token_signs_for_the_certificate(token: str, label: str) -> None:
    owner = IDENTITIES[label]
    material = read_identity_material(settings(owner, f"{token};object={label}{query()}"), NOW_S * SECOND)
    verify(material.certificate.public_key, material.key.sign(b"content"), b"content")
    assert PIN not in repr(material) + repr(material.key)
    material.key.close()
    material.key.close()


@pytest.mark.peers
def test_certificate_and_key_from_the_token_and_pin_from_elsewhere(token: str, tmp_path: Path) -> None:
    (tmp_path / "pin").write_text(f"{PIN}\n")
    for number, source in enumerate((f"&pin-source=file:{tmp_path}/pin", f"&pin-source={tmp_path}/pin", "")):
        configured = settings(
            IDENTITIES["ec"],
            f"{token};id=%01;type=private{query(source)}",
            **{"dds.sec.auth.identity_certificate": f"{token};object=ec;type=cert{query('')}"},
        )
        if not source:
            configured["dds.sec.auth.password"] = PIN
        side = Side(IDENTITIES["ec"], seed=number + 1, settings=configured)
        assert side.plugin.get_subject_name(side.identity) == "CN=alice,O=Peers"
        side.plugin.return_identity_handle(side.identity)


@pytest.mark.peers
def test_a_handshake_with_both_keys_in_tokens(token: str) -> None:
    alice = Side(IDENTITIES["ec"], seed=1, settings=settings(IDENTITIES["ec"], f"{token};object=ec{query()}"))
    bob = Side(IDENTITIES["rsa"], seed=2, settings=settings(IDENTITIES["rsa"], f"{token};object=rsa{query()}"))
    finished, ended = Pair(alice, bob).run()
    alice.plugin.return_identity_handle(alice.identity)
    assert finished.message is not None
    assert ended.message is None
    verify(bob.identity.certificate.public_key, bob.identity.key.sign(b"still there"), b"still there")
    bob.plugin.return_identity_handle(bob.identity)


@pytest.mark.peers
def test_threads_may_sign_at_once(token: str) -> None:
    material = read_identity_material(settings(IDENTITIES["ec"], f"{token};object=ec{query()}"), NOW_S * SECOND)
    signed: list[bytes] = []
    threads = [
        threading.Thread(target=lambda: signed.extend(material.key.sign(b"x") for _ in range(20))) for _ in "1234"
    ]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join(30)
    assert len(signed) == 80
    for signature in signed:
        verify(material.certificate.public_key, signature, b"x")
    material.key.close()


@pytest.mark.peers
@pytest.mark.parametrize(
    ("key", "reason"),
    [
        ("object=nobody", "there are 0 objects (private key) with label 'nobody' in token 'robots'"),
        ("object=rsa", "does not belong to the certificate"),
        ("object=ec384", "does not belong to the certificate"),
    ],
)
def test_keys_that_do_not_serve(token: str, key: str, reason: str) -> None:
    with pytest.raises(ConfigurationError) as caught:
        read_identity_material(settings(IDENTITIES["ec"], f"{token};{key}{query()}"), NOW_S * SECOND)
    assert reason in str(caught.value)
    assert PIN not in str(caught.value)


@pytest.mark.peers
def test_what_is_said_of_tokens_pins_and_libraries(token: str, tmp_path: Path) -> None:
    def said(uri: str) -> str:
        with pytest.raises(ConfigurationError) as caught:
            read_identity_material(settings(IDENTITIES["ec"], uri), NOW_S * SECOND)
        return str(caught.value)

    assert "0 hardware tokens fit the pkcs11: URI, one is needed; there are: 'robots'" in said(
        f"pkcs11:token=toasters;object=ec{query()}"
    )
    wrong = said(f"{token};object=ec{query('&pin-value=9999')}")
    assert "the PIN for label 'ec' in token 'robots' is wrong" in wrong
    assert "9999" not in wrong
    assert "without a PIN" in said(f"{token};object=ec{query('')}")
    missing = said(f"{token};object=ec?module-path={tmp_path}/none.so&pin-value={PIN}")
    assert f"cannot load the PKCS #11 library {tmp_path}/none.so" in missing
    assert "?module-path=" in missing


# --- URIs, without a token ------------------------------------------------------------------------------------


def test_a_uri_is_taken_apart() -> None:
    uri = Pkcs11Uri.parse(
        "p",
        "pkcs11:token=my%20token;serial=12;manufacturer=M;model=X;slot-id=3;object=a%3Bb;id=%01%ff;type=private"
        "?module-path=/lib/x.so&pin-value=12%2634",
        password="unused",
    )
    assert uri == Pkcs11Uri("/lib/x.so", "my token", "M", "X", b"12", 3, "a;b", b"\x01\xff", "12&34")
    assert "12&34" not in repr(uri) + str(uri)
    plain = Pkcs11Uri.parse("p", "pkcs11:id=%01", password="secret")
    assert (plain.module, plain.pin, str(plain)) == ("p11-kit-proxy.so", "secret", "id 01")


@pytest.mark.parametrize(
    ("uri", "reason"),
    [
        ("pkcs11:token=x", "it says neither object= (the label) nor id="),
        ("pkcs11:object=a;object=b", "an attribute has no value, or occurs twice"),
        ("pkcs11:object=a;id", "an attribute has no value, or occurs twice"),
        ("pkcs11:objekt=a", "attribute 'objekt' is unknown; known are token"),
        ("pkcs11:object=a?pin=1234", "attribute 'pin' is unknown; known are module-path"),
        ("pkcs11:object=a;slot-id=x", "its slot-id is no number"),
        ("pkcs11:object=a?pin-source=|cat /pin", "is a command, which is not run"),
        ("pkcs11:object=a?pin-source=file:/no/such/pin", "cannot read /no/such/pin"),
    ],
)
def test_uris_that_do_not_serve(uri: str, reason: str) -> None:
    with pytest.raises(ConfigurationError) as caught:
        Pkcs11Uri.parse("dds.sec.auth.private_key", uri, password=None)
    assert reason in str(caught.value)
    assert "dds.sec.auth.private_key" in str(caught.value)
    assert "1234" not in str(caught.value)


def test_what_to_install_is_said_where_the_package_is_missing(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "pkcs11", None)
    with pytest.raises(ConfigurationError, match=r"pip install 'ddsi\[pkcs11\]'"):
        read_identity_material(settings(identity("alice"), "pkcs11:object=x"), NOW_S * SECOND)
