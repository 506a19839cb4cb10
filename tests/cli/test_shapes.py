"""``ddsi shapes``: its options as QoS and type, its lines, its field; processes are ``multiproc_tests``' business."""

from __future__ import annotations

import argparse
from pathlib import Path

import pytest

from ddsi.cli import main, shapes
from ddsi.cli.shape_display import FieldDisplay, LineDisplay
from ddsi.cli.shape_field import DrawnShape
from ddsi.cli.shape_types import EXTENSIBILITIES, shape_form
from ddsi.structure import qos_policies as p
from ddsi.structure.guid import Guid
from ddsi.structure.qos import Qos
from ddsi.structure.status import (
    Incompatibility,
    InconsistentTopic,
    PublicationMatched,
    RequestedIncompatibleQos,
    SecurityRefused,
)
from ddsi.xtypes import deserialize, serialize


def _role(*words: str) -> shapes._Role:
    parser = argparse.ArgumentParser()
    shapes.add_arguments(parser)
    return shapes._Role(parser.parse_args(["pub", *words]), ("Square",), LineDisplay())


@pytest.mark.parametrize(
    ("words", "qos"),
    [
        ([], Qos(reliability=p.Reliable(10.0), durability=p.Volatile(), history=p.KeepLast(1))),
        (["-b"], Qos(reliability=p.BestEffort(), durability=p.Volatile(), history=p.KeepLast(1))),
        (["-r", "--transient-local", "--keep-all"],
         Qos(reliability=p.Reliable(10.0), durability=p.TransientLocal(), history=p.KeepAll())),
        (["--keep-last", "7", "-x", "2"],
         Qos(reliability=p.Reliable(10.0), durability=p.Volatile(), history=p.KeepLast(7),
             data_representation=p.DataRepresentation(2))),
    ],
)  # fmt: skip
def test_options_are_policies(words: list[str], qos: Qos) -> None:
    assert _role(*words).qos(reliable_by_default=True) == qos


def test_a_subscriber_matches_anybody_unless_told_otherwise() -> None:
    assert isinstance(_role().qos(reliable_by_default=False).reliability, p.BestEffort)
    assert isinstance(_role("-r").qos(reliable_by_default=False).reliability, p.Reliable)


def test_partitions() -> None:
    assert _role("-p", "a,b").group_qos == Qos(partition=p.Partition("a", "b"))
    assert _role().group_qos == Qos(partition=p.Partition())


@pytest.mark.parametrize(
    "words", [["-b", "-r"], ["--keep-last", "1", "--keep-all"], ["-x", "3"], ["--property", "name"]]
)
def test_options_that_are_refused(words: list[str]) -> None:
    with pytest.raises(SystemExit):
        main(["shapes", "pub", *words])


def test_a_topic_named_twice(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["shapes", "sub", "-t", "Square,Square"]) == 2
    assert capsys.readouterr().err == "ddsi shapes: a topic is named twice\n"


def test_a_folder_without_an_identity_is_refused_before_anything_is_sent(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["shapes", "sub", "--secure", str(tmp_path)]) == 2
    said = capsys.readouterr().err
    assert said.startswith(f"ddsi shapes: {tmp_path} is no keystore for a participant: it lacks identity_ca.cert.pem, ")


def test_the_final_form_is_that_of_the_vendors_demos() -> None:
    """CDR_LE: header, length of BLUE with its NUL, the text, padding, x, y, shapesize."""
    sample = shape_form("final", None).sample("BLUE", 1, 2, 30)
    expected = b"\0\1\0\0" + b"\5\0\0\0BLUE\0\0\0\0" + b"\1\0\0\0" + b"\2\0\0\0" + b"\x1e\0\0\0"
    assert serialize(sample) == expected


@pytest.mark.parametrize("extensibility", EXTENSIBILITIES)
def test_every_form_comes_back(extensibility: str) -> None:
    form = shape_form(extensibility, None)
    sample = form.sample("RED", -1, 2, 3)
    assert deserialize(form.type, serialize(sample)) == sample


def test_the_form_of_the_omgs_suite_has_a_payload() -> None:
    form = shape_form("final", 3)
    assert serialize(form.sample("RED", 1, 2, 3)).endswith(b"\3\0\0\0\xff\xff\xff")


def test_lines(capsys: pytest.CaptureFixture[str]) -> None:
    display = LineDisplay()
    display.show(DrawnShape("Square", "BLUE", 7, 123, 30))
    display.show(DrawnShape("Square", "\x1b[2J", -7, 0, 30))
    display.remove("Square", "BLUE", "disposed")
    display.match("Square", "writer", 2)
    said = capsys.readouterr()
    assert said.out.splitlines() == [
        "Square     BLUE       007 123 [30]",
        "Square     ?[2J       -07 000 [30]",
        "Square     BLUE       disposed",
    ]
    assert said.err == "ddsi shapes: Square: 2 writers matched\n"


def test_statuses_are_told(capsys: pytest.CaptureFixture[str]) -> None:
    role = _role()
    remote = Guid(bytes(15) + b"\1")
    reason = Incompatibility(policy="reliability", policy_id=11, offered="BestEffort", requested="Reliable")
    role._tell("Square", PublicationMatched(current_count=1))
    role._tell("Square", RequestedIncompatibleQos(incompatibilities=(reason,), last_publication_handle=remote))
    role._tell("Square", InconsistentTopic(remote_type_name="Image"))
    role._tell("Square", SecurityRefused(remote=remote, reason="no rule allows it"))
    assert capsys.readouterr().err.splitlines() == [
        "ddsi shapes: Square: 1 reader matched",
        f"ddsi shapes: Square: writer {remote} does not match: reliability: offered BestEffort, requested Reliable",
        "ddsi shapes: Square: somebody uses it for another type, Image",
        f"ddsi shapes: Square: refused {remote}: no rule allows it",
    ]


def test_the_field_with_what_is_said_below() -> None:
    display = FieldDisplay("title", ("Square", "Circle"))
    display.show(DrawnShape("Square", "BLUE", 120, 135, 60))
    display.show(DrawnShape("Square", "BLUE", 20, 35, 60))
    display.match("Square", "writer", 1)
    for number in range(5):
        display.notice(f"notice {number}")
    lines = display.lines()
    texts = lines[lines.index(next(line for line in lines if line.startswith("title"))) :]
    assert texts == [
        "title; Ctrl+C ends",
        "Square     2 samples, 1 writer matched",
        "Circle     0 samples, nobody matched",
        "notice 3",
        "notice 4",
    ]
    assert any("B" in line or "█" in line for line in lines)
    display.remove("Square", "BLUE", "disposed")
    assert not any("B" in line or "█" in line for line in display.lines()[:-5])


def test_strangers_instances_are_bounded() -> None:
    display = FieldDisplay("title", ("Square",))
    for number in range(3000):
        display.show(DrawnShape("Square", f"C{number}", 120, 135, 60))
    assert len(display._shapes) == 1000
    assert "3000 samples" in display.lines()[-1]
