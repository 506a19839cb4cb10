"""``ddsi explain``: the answer, and every line that led to it."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from .keystores import ALICE, DAY, NOW, Shell, Workshop
from .spoils import add_rule, section


def ask(shell: Shell, workshop: Workshop, *words: str) -> dict[str, object]:
    """The answer as JSON; the status says the same."""
    if not workshop.folder.exists():
        workshop.write()
    status = shell.run("explain", workshop.folder, *words, "--json")
    assert status in (0, 1), shell.err
    answer: dict[str, object] = json.loads(shell.out)
    assert answer["allowed"] == (status == 0)
    return answer


def lines_of(workshop: Workshop, answer: dict[str, object]) -> list[str]:
    """The lines of the files that the steps and the protection name."""
    stages = answer["stages"]
    protection = answer["protection"]
    assert isinstance(stages, list)
    assert isinstance(protection, list)
    places = [step for stage in stages for step in stage["steps"]] + protection
    return [Path(one["file"]).read_text().splitlines()[one["line"] - 1].strip() for one in places if one["line"]]


@pytest.fixture
def workshop(tmp_path: Path) -> Workshop:
    return Workshop(tmp_path / "alice")


def test_what_is_allowed_comes_with_the_lines_that_say_so(shell: Shell, workshop: Workshop) -> None:
    answer = ask(shell, workshop, "publish", "Square", "--partition", "A", "--domain", "7")
    assert (answer["allowed"], answer["subject"], answer["domain_id"], answer["partitions"]) == (True, ALICE, 7, ["A"])
    assert lines_of(workshop, answer) == [
        "-----BEGIN CERTIFICATE-----",
        "<domain_rule>",
        "<allow_rule>",
        "<domain_rule>",
        "<topic_rule>",
        "<publish>",
        "<rtps_protection_kind>SIGN</rtps_protection_kind>",
        "<metadata_protection_kind>ENCRYPT</metadata_protection_kind>",
        "<data_protection_kind>ENCRYPT</data_protection_kind>",
        "<discovery_protection_kind>ENCRYPT</discovery_protection_kind>",
        "<liveliness_protection_kind>ENCRYPT</liveliness_protection_kind>",
    ]


@pytest.mark.parametrize(
    ("words", "reason"),
    [
        (["publish", "Triangle"], "Missing right: publish 'Triangle'"),
        (["relay", "Square"], "Missing right: relay 'Square'"),
        (["publish", "Square", "--tag", "a=b"], "allows no data tags"),
        (["publish", "Square", "-d", "231"], "no domain_rule is for domain 231; there are rules for domains 0 to 230"),
        (["join", "-d", "232"], "no domain_rule is for domain 232"),
    ],
)
def test_what_is_not_allowed_says_what_is_missing(
    shell: Shell, workshop: Workshop, words: list[str], reason: str
) -> None:
    answer = ask(shell, workshop, *words)
    assert answer["allowed"] is False
    assert reason in str(answer["reason"])
    assert answer["protection"] == [], "what may not be is not protected either"


def test_partitions_count(shell: Shell, workshop: Workshop) -> None:
    workshop.replace("permissions", ("<partition>*", "<partition>A"))
    assert ask(shell, workshop, "publish", "Square", "-p", "A")["allowed"] is True
    assert ask(shell, workshop, "publish", "Square", "-p", "A", "-p", "B")["allowed"] is False
    assert ask(shell, workshop, "publish", "Square")["allowed"] is False


def test_relay_is_a_right_of_its_own(shell: Shell, workshop: Workshop) -> None:
    workshop.replace("permissions", (section(workshop.permissions, "allow_rule"), ""))
    add_rule(workshop, "allow", "relay", "Square")
    assert ask(shell, workshop, "relay", "Square")["allowed"] is True
    assert ask(shell, workshop, "subscribe", "Square")["allowed"] is False


def test_who_may_create_a_participant_is_not_yet_let_in_by_others(shell: Shell, workshop: Workshop) -> None:
    """A topic without access control opens the one (§8.4.2.9.3) and not the other (§8.4.2.9.9)."""
    workshop.replace("governance", ("<enable_read_access_control>true", "<enable_read_access_control>false"))
    workshop.replace("permissions", ("<max>230", "<max>3"))
    answer = ask(shell, workshop, "subscribe", "T", "-d", "9")
    stages = answer["stages"]
    assert isinstance(stages, list)
    assert [(stage["stage"], stage["allowed"]) for stage in stages] == [
        ("identity", True),
        ("join", True),
        ("be let in by others", False),
        ("subscribe", True),
    ]
    assert answer["allowed"] is False


def test_what_governance_leaves_open_needs_no_right(shell: Shell, workshop: Workshop) -> None:
    workshop.replace("governance", ("<enable_write_access_control>true", "<enable_write_access_control>false"))
    assert ask(shell, workshop, "publish", "Triangle")["allowed"] is True


def test_time_counts(shell: Shell, workshop: Workshop) -> None:
    workshop.replace("permissions", ("<not_after>2029-03-27", "<not_after>2027-01-01"))
    assert ask(shell, workshop, "publish", "Square")["allowed"] is True
    shell.now = NOW + 300 * DAY
    assert "expired at 2027-01-01T12:00:00Z" in str(ask(shell, workshop, "publish", "Square")["reason"])
    shell.now = NOW + 1001 * DAY
    assert f"the certificate of {ALICE} is not valid at 2029-03-28" in str(ask(shell, workshop, "join")["reason"])


def test_protection_says_what_each_layer_comes_to(shell: Shell, workshop: Workshop) -> None:
    workshop.replace(
        "governance",
        ("<metadata_protection_kind>ENCRYPT", "<metadata_protection_kind>SIGN_WITH_ORIGIN_AUTHENTICATION"),
        ("<data_protection_kind>ENCRYPT", "<data_protection_kind>NONE"),
        ("<enable_discovery_protection>true", "<enable_discovery_protection>false"),
    )
    protection = ask(shell, workshop, "publish", "Square")["protection"]
    assert isinstance(protection, list)
    assert {one["element"]: one["effect"] for one in protection} == {
        "rtps_protection_kind": "RTPS messages are signed, and readable by anybody",
        "metadata_protection_kind": (
            "submessages of the topic are signed for each receiver apart, and readable by anybody"
        ),
        "data_protection_kind": "payloads of samples are not protected by it",
        "enable_discovery_protection": "its announcements are in clear",
        "liveliness_protection_kind": "assertions of its liveliness are encrypted and signed",
    }


def test_the_text_for_people(shell: Shell, workshop: Workshop) -> None:
    folder = workshop.write()
    assert shell.run("keystore", "explain", folder, "publish", "Square") == 0
    first, *rest = shell.out.splitlines()
    assert first == f"Yes: {ALICE} may publish 'Square' in domain 0."
    assert "publish: yes" in rest
    assert any(line.startswith(f"  {folder}/permissions.p7s:") and "applies, and decides" in line for line in rest)
    assert "protection:" in rest
    keystore, shell.out = shell.out, ""
    assert shell.run("explain", folder, "publish", "Square") == 0
    assert shell.out == keystore, "both are the same command"
    assert shell.run("explain", folder, "publish", "Triangle", "-p", "x") == 1
    assert shell.out.startswith(f"No: {ALICE} may not publish 'Triangle' in partition 'x' in domain 0.\n  permissions ")


def test_in_a_keystore_an_identity_is_named(shell: Shell, tmp_path: Path) -> None:
    shell.make("create", tmp_path, "--identity", "alice", "--identity", "/robot/arm")
    assert shell.run("explain", tmp_path, "join", "--identity", "/robot/arm") == 0
    assert shell.out.startswith("Yes: CN=/robot/arm may join domain 0.\n")
    assert "whose rights? Say --identity NAME;" in shell.refused("explain", tmp_path, "join")
    assert "holds no identity 'eve'; there are alice, robot/arm" in shell.refused(
        "explain", tmp_path, "join", "--identity", "eve"
    )


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["join", "Square"], "to join is a matter of the domain alone"),
        (["publish"], "publish which topic? Name it after the verb"),
        (["publish", "Square", "--tag", "x"], "a data tag is NAME=VALUE, not 'x'"),
        (["publish", "Square", "-d", "x"], "a domain is a number from 0 to 232, not 'x'"),
        (["write", "Square"], "invalid choice: 'write'"),
    ],
)
def test_what_cannot_be_asked_is_a_sentence(shell: Shell, workshop: Workshop, words: list[str], said: str) -> None:
    assert said in shell.refused("explain", workshop.write(), *words)


def test_what_is_not_implemented_is_not_explained_away(shell: Shell, workshop: Workshop) -> None:
    psk = "<rtps_psk_protection_kind>SIGN</rtps_psk_protection_kind>"
    workshop.replace("governance", ("<topic_access_rules>", f"{psk}<topic_access_rules>"))
    said = shell.refused("explain", workshop.write(), "join")
    assert "<rtps_psk_protection_kind> of DDS Security 1.2 is not implemented" in said


def test_files_that_no_participant_would_take_are_named(shell: Shell, workshop: Workshop) -> None:
    folder = workshop.write()
    genuine = (folder / "permissions.p7s").read_bytes()
    workshop.file("permissions.p7s", genuine.replace(b"Square", b"Squire"))
    assert f"{folder}/permissions.p7s: it was altered" in shell.refused("explain", folder, "publish", "Squire")
    workshop.file("permissions.p7s", workshop.permissions.encode())
    assert f"{folder}/permissions.p7s: it is no signed document" in shell.refused("explain", folder, "join")
    (folder / "permissions.p7s").unlink()
    assert f"{folder}/permissions.p7s cannot be read" in shell.refused("explain", folder, "join")
    workshop.identity = Workshop(folder).identity
    workshop.write()
    assert "was not issued by the identity CA" in shell.refused("explain", folder, "join")
