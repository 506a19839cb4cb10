"""Keystores to order, the command in this process at a time of the test's choosing, and openssl as the judge."""

from __future__ import annotations

import subprocess
from datetime import UTC, datetime
from pathlib import Path

import pytest

from ddsi.cli import command_line
from ddsi.cli.command_line import main
from ddsi_security.keystore.authority import Authority
from ddsi_security.keystore.certificate import certificate_pem
from ddsi_security.keystore.distinguished_name import parse_name
from ddsi_security.keystore.documents import GovernanceDraft, GrantDraft, Rights, permissions_xml
from ddsi_security.keystore.domain_ranges import DomainRanges
from ddsi_security.keystore.identity import Identity
from ddsi_security.keystore.key_pair import Algorithm, private_key_pem
from ddsi_security.keystore.validity import Validity, utc

__all__ = ["ALICE", "DAY", "NOW", "Shell", "Workshop", "openssl"]

NOW = int(datetime(2026, 7, 1, 12, tzinfo=UTC).timestamp()) * 1_000_000_000
DAY = 86_400 * 1_000_000_000


class Shell:
    """``ddsi`` at a fixed time; ``out`` and ``err`` are what the last command said."""

    def __init__(self, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
        self.now = NOW
        self.out = self.err = ""
        self._capsys = capsys
        monkeypatch.setattr(command_line, "wall_clock", lambda: self.now)

    def run(self, *words: object) -> int:
        """The status; that of argparse for what it refuses."""
        self._capsys.readouterr()
        try:
            status = main([str(word) for word in words])
        except SystemExit as ended:
            status = ended.code if isinstance(ended.code, int) else 1
        self.out, self.err = self._capsys.readouterr()
        return status

    def make(self, *words: object) -> str:
        """``ddsi keystore ...``, which must succeed; what it said."""
        assert self.run("keystore", *words) == 0, self.err
        return self.out

    def refused(self, *words: object) -> str:
        """``ddsi keystore ...``, which must be refused in one sentence."""
        assert self.run("keystore", *words) == 2, self.out
        assert self.err.count("\n") == 1
        assert self.out == ""
        return self.err

    def create(self, folder: Path, *words: object) -> Path:
        """A keystore with alice, and with what the words add; her folder."""
        self.make("create", folder, "--identity", "alice", *words)
        return folder / "enclaves" / "alice"


def openssl(*words: object) -> str:
    """What it prints; it must succeed."""
    command = ["openssl", *map(str, words)]
    done = subprocess.run(command, capture_output=True, text=True, timeout=60, check=False)
    assert done.returncode == 0, f"{' '.join(command)}: {done.stderr}"
    return done.stdout


ALICE = "CN=alice,O=Example"


class Workshop:
    """An identity's folder, all of it in order; tests spoil what they are about, and :meth:`write` it then.

    ``governance`` and ``permissions`` are the XML, to be changed by :meth:`replace` before it is signed.
    """

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self.validity = Validity.of_days(NOW, 1000)
        self.identity_ca = self.authority("Identity CA")
        self.permissions_ca = self.authority("Permissions CA")
        self.document_signer = self.permissions_ca
        self.identity = self.make_identity(ALICE)
        domains = DomainRanges(((0, 230),))
        self.governance = GovernanceDraft(domains=domains).xml().decode()
        rights = Rights(domains=domains, publish=("Square", "Circle"), subscribe=("*",))
        grant = GrantDraft(name="alice", subject_name=ALICE, validity=self.validity, rights=rights)
        self.permissions = permissions_xml([grant]).decode()

    def authority(self, name: str, algorithm: Algorithm = Algorithm.EC) -> Authority:
        return Authority.create(parse_name(f"CN={name},O=Example"), algorithm, self.validity)

    def make_identity(self, subject: str, validity: Validity | None = None) -> Identity:
        return Identity.create(self.identity_ca, parse_name(subject), Algorithm.EC, validity or self.validity)

    def days(self, first: int, last: int) -> Validity:
        """From so many days after now until so many."""
        return Validity(utc(NOW + first * DAY), utc(NOW + last * DAY))

    def replace(self, document: str, *changes: tuple[str, str]) -> None:
        """In ``governance`` or ``permissions``; what is to be replaced must be there."""
        text = getattr(self, document)
        for old, new in changes:
            assert old in text, old
            text = text.replace(old, new)
        setattr(self, document, text)

    def write(self) -> Path:
        """Sign the documents and write everything; returns the folder."""
        self.file("identity_ca.cert.pem", certificate_pem(self.identity_ca.certificate))
        self.file("permissions_ca.cert.pem", certificate_pem(self.permissions_ca.certificate))
        self.file("cert.pem", certificate_pem(self.identity.certificate))
        self.file("key.pem", private_key_pem(self.identity.private_key)).chmod(0o600)
        self.file("governance.p7s", self.document_signer.sign_document(self.governance.encode()))
        self.file("permissions.p7s", self.document_signer.sign_document(self.permissions.encode()))
        return self.folder

    def file(self, name: str, octets: bytes) -> Path:
        self.folder.mkdir(exist_ok=True)
        path = self.folder / name
        path.write_bytes(octets)
        return path
