"""``ddsi sim handshake``: the walk says what happens, loses what it is told to lose, and shows how that is repaired."""

from __future__ import annotations

import re
from collections.abc import Iterator
from pathlib import Path

import pytest

from ddsi.cli import main, sim_handshake
from ddsi.cli.sim import VENDORS_BY_NAME
from ddsi.cli.sim_handshake_words import KINDS

pytest.importorskip("cryptography")
pytest.importorskip("lxml")

EXPECTED = Path(__file__).with_name("sim_handshake.txt")
"""What two with an EC keystore say.  How large certificates, documents and signatures are is left to chance."""
CHANCE = re.compile(r"\d+(?= octets: DDS:Auth)|(?<=c\.id )\d+|(?<=c\.perm )\d+|(?<=signature )\d+")


@pytest.fixture(scope="module")
def keystore(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("handshake") / "keystore"
    words = ["keystore", "create", str(folder), "--identity", "alice", "--identity", "bob", "--topic", "Square"]
    assert main(words) == 0
    return folder


@pytest.fixture(autouse=True)
def wide(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("COLUMNS", "250")


def walked(keystore: Path, capsys: pytest.CaptureFixture[str], *words: str, status: int = 0) -> str:
    capsys.readouterr()
    assert main(["sim", "handshake", "--keystore", str(keystore), *words]) == status
    return capsys.readouterr().out


def test_the_whole_walk(keystore: Path, capsys: pytest.CaptureFixture[str]) -> None:
    said = CHANCE.sub("N", walked(keystore, capsys))
    assert said == EXPECTED.read_text(encoding="utf-8"), "what is said has changed; if it is better now, keep it there"


def test_the_same_seed_and_keystore_say_the_same(keystore: Path, capsys: pytest.CaptureFixture[str]) -> None:
    first, second, other = (walked(keystore, capsys, "--drop", "reply", "--seed", seed) for seed in ("5", "5", "6"))
    assert first == second != other


@pytest.mark.parametrize(
    ("message", "noticed", "again"),
    [
        ("announcement", r"alice at .* \(it has seen the other's announcement\)", True),
        ("auth-request", "", False),
        ("request", r"(alice|bob) at .* \(its timer in (AWAIT_REPLY|AWAIT_REQUEST)\)", True),
        ("reply", r"(alice|bob) at .* \(its timer in (AWAIT_REPLY|AWAIT_FINAL)\)", True),
        ("final", r"(alice|bob) at .* \(its timer in (AUTHENTICATED|AWAIT_FINAL)\)", True),
        ("participant-tokens", "bob, which asks by ACKNACK at", True),
        ("writer-tokens", "bob, which asks by ACKNACK at", True),
        ("reader-tokens", "bob, which asks by ACKNACK at", True),
        ("discovery", "alice, which asks by ACKNACK at", True),
        ("data", "bob, which asks by ACKNACK at", True),
    ],
)
def test_whatever_is_lost_is_repaired(
    message: str, noticed: str, again: bool, keystore: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    said = walked(keystore, capsys, "--drop", message)
    kind = KINDS[message]
    (number,) = re.findall(r"✗ lost: (\d+)", said)
    assert re.search(rf"^Lost: {number} {kind.title} of (alice|bob) to ", said, re.M)
    assert f"The rule: {kind.repair}" in said.replace("  ", " ")
    assert "has the sample of Square" in said
    assert (f"{number} again, which was lost" in said) is again
    if again:
        assert re.search(f"^Noticed by {noticed}", said, re.M), said
    else:
        assert "It was never said again" in said


def test_the_test_above_names_every_kind() -> None:
    (cases,) = (mark.args[1] for mark in test_whatever_is_lost_is_repaired.pytestmark)  # type: ignore[attr-defined]
    assert [case[0] for case in cases] == list(KINDS)


def test_every_rule_has_its_clause() -> None:
    for kind in KINDS.values():
        assert re.search(r"§\d", kind.clause)
        assert re.search(r"§\d", kind.repair)


def test_a_message_is_lost_by_its_number_too(keystore: Path, capsys: pytest.CaptureFixture[str]) -> None:
    whole = walked(keystore, capsys)
    (number,) = re.findall(r"^ +(\d+)  keys of a writer for Square  ", whole, re.M)
    said = walked(keystore, capsys, "--drop", number)
    assert f"keys of a writer for Square: {number} again, which was lost" in said


@pytest.mark.parametrize("vendor", VENDORS_BY_NAME)
def test_the_second_may_play_a_vendor(vendor: str, keystore: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """The walk sees what that one says, and what of it is not as we say it."""
    said = walked(keystore, capsys, "--vendor", vendor)
    assert f"bob plays {VENDORS_BY_NAME[vendor].name} by its quirks." in said
    assert "bob       has the sample of Square" in said
    assert ("BigEndianEnvelopes" in said) is (vendor == "opendds")
    assert "Lost: " in walked(keystore, capsys, "--vendor", vendor, "--drop", "final")


def test_what_is_never_sent_is_never_lost(keystore: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert "No message 999 was sent" in walked(keystore, capsys, "--drop", "999", status=1)


def test_a_narrow_encoding_gets_ascii(
    keystore: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(sim_handshake, "can_print", lambda text: False)
    said = walked(keystore, capsys, "--drop", "data")
    assert said.isascii()
    assert "clause 8.3.2.11.4" in said


def test_a_keystore_is_made_where_none_is_given(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["sim", "handshake", "--drop", "auth_request"]) == 0
    said = capsys.readouterr()
    assert said.out.startswith("alice is ")
    assert "keystore" not in said.out
    assert said.err == ""


def test_no_secret_is_shown(keystore: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Of properties there are names and sizes; nothing is printed that could be 16 octets."""
    said = walked(keystore, capsys)
    assert "dds.cryp.keymat 88" in said
    guids = r"\b(?:[0-9a-f]{8}:){3}000001c1\b"
    assert not re.search(r"[0-9a-f]{16}|BEGIN|\\x", re.sub(guids, "", said))


def test_stepping_waits_on_a_terminal_alone(
    keystore: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    assert "Enter" not in walked(keystore, capsys, "--step")
    answers = _answers("", "", "q")
    monkeypatch.setattr("builtins.input", lambda prompt: next(answers))
    monkeypatch.setattr(sim_handshake, "_is_watched", lambda: True)
    assert "nothing lost" in walked(keystore, capsys, "--step")
    assert list(answers) == []


def _answers(*answers: str) -> Iterator[str]:
    yield from answers


@pytest.mark.parametrize(
    ("words", "complaint"),
    [
        (["handshake", "--count", "2"], "takes --seed and --vendor alone"),
        (["handshake", "--json"], "takes --seed and --vendor alone"),
        (["--drop", "reply"], "--drop, --step and --keystore are for ddsi sim handshake"),
        (["handshake", "--keystore", "/nowhere"], "no keystore with two identities"),
    ],
)
def test_what_does_not_fit_is_refused(words: list[str], complaint: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["sim", *words]) == 2
    assert complaint in capsys.readouterr().err


def test_an_unknown_message_is_refused_with_the_known_ones(capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit):
        main(["sim", "handshake", "--drop", "greeting"])
    assert "'greeting' is none of announcement, auth-request" in capsys.readouterr().err
