"""What the tables of a whole run say below them: is all that others manage managed with ours, too?"""

from __future__ import annotations

from pathlib import Path

from .matrix import Outcome, Verdict
from .matrix.report import write_report
from .peers.catalogue import CYCLONE_C, FAST_DDS, OURS

CYCLONE, FASTDDS, DDSI = CYCLONE_C.name, FAST_DDS.name, OURS.name


def secured_table(folder: Path, *outcomes: tuple[str, str, Verdict]) -> str:
    """Of one case, played by these publishers and subscribers."""
    played = [Outcome("none", publisher, subscriber, verdict) for publisher, subscriber, verdict in outcomes]
    write_report(played, (OURS, CYCLONE_C, FAST_DDS), folder)
    return (folder / "secured.md").read_text()


def test_what_two_others_manage_is_looked_for_with_ours_in_the_place_of_either(tmp_path: Path) -> None:
    text = secured_table(
        tmp_path,
        (CYCLONE, FASTDDS, Verdict.PASSED),
        (CYCLONE, CYCLONE, Verdict.PASSED),
        (FASTDDS, CYCLONE, Verdict.KNOWN),
        (CYCLONE, DDSI, Verdict.PASSED),
        (DDSI, FASTDDS, Verdict.PASSED),
        (DDSI, CYCLONE, Verdict.PASSED),
        (FASTDDS, DDSI, Verdict.FAILED),
    )
    assert "The others manage 2 of these." in text
    assert "3 different plays, of which 3 pass." in text
    assert "not with ours" not in text


def test_what_only_others_manage_is_named(tmp_path: Path) -> None:
    text = secured_table(
        tmp_path,
        (FASTDDS, FASTDDS, Verdict.PASSED),
        (FASTDDS, DDSI, Verdict.PASSED),
        (DDSI, FASTDDS, Verdict.FAILED),
    )
    assert "2 different plays, of which 1 pass." in text
    assert f"- none, {DDSI} to {FASTDDS}: not with ours." in text


def test_without_the_others_among_themselves_nothing_is_said_of_it(tmp_path: Path) -> None:
    assert "manage" not in secured_table(tmp_path, (DDSI, DDSI, Verdict.PASSED), (DDSI, CYCLONE, Verdict.PASSED))


def test_a_reason_is_told_once_for_each_pair(tmp_path: Path) -> None:
    outcomes = [
        Outcome(case, FASTDDS, CYCLONE, Verdict.KNOWN, reason="it does not answer")
        for case in ("none", "data", "metadata")
    ]
    write_report(outcomes, (OURS, CYCLONE_C, FAST_DDS), tmp_path)
    limits = (tmp_path / "secured.md").read_text().partition("## Known limits of the others")[2]
    assert limits.strip() == f"- {FASTDDS} to {CYCLONE}: it does not answer. In none, data, metadata"
