"""What is asked of captures of secured pairs: those of real vendors have it, and those of another governance not."""

from __future__ import annotations

import functools
from dataclasses import replace
from pathlib import Path

import pytest

from .framework import Capture
from .framework.capture import require_capture_tools
from .matrix import ALL_CASES, SECURED_CASES
from .matrix.evidence import messages_of, shortcomings
from .matrix.wire import Message, read_message
from .peers.keystore import GOVERNANCES

CAPTURES = Path(__file__).resolve().parents[1] / "tests" / "captures"
SECRET = b"BLUE"
GOVERNANCE_OF = {
    "sec-all-cyclone-fastdds": "encrypt-all",
    "sec-all-fastdds-cyclone": "encrypt-all",
    "sec-alloa-fastdds-cyclone": "all-origin",
    "sec-allsign-fastdds-cyclone": "sign-all",
    "sec-data-cyclone-fastdds": "data",
    "sec-datasign-cyclone-fastdds": "data-sign",
    "sec-metadata-cyclone-fastdds": "metadata-data",
    "sec-metasign-fastdds-cyclone": "metadata-sign",
    "sec-signenc-cyclone-fastdds": "rtps-sign-else-encrypt",
}


@functools.cache
def messages_in(name: str) -> list[Message]:
    require_capture_tools()
    messages = messages_of(Capture(CAPTURES / f"{name}.pcap"))
    assert len(messages) > 20
    return messages


def judge(name: str, governance: str) -> list[str]:
    """Without the topic's name: the permissions in these captures name it, and cross in clear in every handshake."""
    return shortcomings(messages_in(name), GOVERNANCES[governance], topic="named nowhere", secret=SECRET)


@pytest.mark.parametrize("name", GOVERNANCE_OF)
def test_captures_of_others_show_what_their_governance_asks_for(name: str) -> None:
    """What is demanded of ours is what Cyclone DDS and Fast DDS do between themselves."""
    assert judge(name, GOVERNANCE_OF[name]) == []


@pytest.mark.parametrize(
    ("name", "governance", "shortcoming"),
    [
        ("sec-metasign-fastdds-cyclone", "metadata", "samples can be read"),
        ("sec-metasign-fastdds-cyclone", "metadata", "submessages of user endpoints can be read"),
        ("sec-data-cyclone-fastdds", "metadata-data", "submessages of user endpoints are not protected"),
        ("sec-datasign-cyclone-fastdds", "data", "payloads are transformed by kind 3, which is not ENCRYPT"),
        ("sec-metasign-fastdds-cyclone", "metadata-sign-data", "which is not ENCRYPT"),
        ("sec-metasign-fastdds-cyclone", "none", "submessages of user endpoints are protected, and need not be"),
        ("sec-metadata-cyclone-fastdds", "none", "samples cannot be read, though nothing is encrypted"),
        ("sec-metasign-fastdds-cyclone", "rtps-sign", "not both participants protect their messages"),
        ("sec-signenc-cyclone-fastdds", "encrypt-all", "encrypted messages have something in clear"),
        ("sec-all-cyclone-fastdds", "sign-all", "messages are transformed by kind 4, which is not SIGN"),
        ("sec-all-cyclone-fastdds", "rtps-origin", "messages lack the MACs of their receivers"),
        ("sec-metasign-fastdds-cyclone", "metadata-sign-origin", "at most 0 receivers have a MAC of their own, not 1"),
        ("sec-all-cyclone-fastdds", "all-submessages", "messages are protected as a whole, and need not be"),
    ],
)
def test_a_capture_of_another_governance_falls_short(name: str, governance: str, shortcoming: str) -> None:
    """A check that cannot fail says nothing."""
    assert any(shortcoming in line for line in judge(name, governance))


def test_what_is_no_rtps_is_passed_over() -> None:
    """Cyclone DDS sends itself single octets when it stops."""
    assert read_message(b"\x00") is None


def test_the_names_of_all_cases_differ() -> None:
    """A name is all that a result has of its case."""
    names = [case.name for case in ALL_CASES]
    assert len(names) == len(set(names))


def test_a_quick_run_has_every_governance_and_every_direction_in_both_roles() -> None:
    """Pairwise: each document once at least; with all encrypted, everybody with everybody in both roles."""
    quick = {case.name: case.quick_pairs for case in SECURED_CASES}
    assert [name for name in GOVERNANCES if not quick[name] | quick[f"{name}-reversed"]] == []
    assert len(quick["encrypt-all"]) == len(quick["encrypt-all-reversed"]) == 4
    assert replace(SECURED_CASES[0], is_quick=True).is_quick_for("ddsi", "ddsi")
