"""``ddsi echo``, ``pub`` and ``typeof``: options, lines, words; processes are ``multiproc_tests``' business."""

from __future__ import annotations

import argparse
import json
from pathlib import Path
from typing import Any

import pytest

import ddsi
from ddsi import idl
from ddsi.cli import main
from ddsi.cli.census import Census, SeenEndpoint, SeenParticipant
from ddsi.cli.echo import _Echo, add_arguments
from ddsi.cli.sample_text import sample_lines
from ddsi.cli.topic_session import load_type
from ddsi.cli.typeof import announced_types
from ddsi.structure.discovered import DiscoveredParticipantData, DiscoveredWriterData
from ddsi.structure.guid import Guid
from ddsi.structure.qos import EndpointQos
from ddsi.structure.sample_info import InstanceState
from ddsi.xtypes import Extensibility, type_support

SHAPE = "@final struct ShapeType { @key string<128> color; int32 x; };"


@pytest.fixture
def shape_file(tmp_path: Path) -> Path:
    path = tmp_path / "shape.idl"
    path.write_text(SHAPE)
    return path


# --- samples for people --------------------------------------------------------------------------------------


def test_a_small_sample_is_one_line() -> None:
    form = {"color": "BLUE", "x": 1, "at": [1.5, None], "deep": {"a": True}}
    assert sample_lines(form, 80) == ['color: "BLUE", x: 1, at: [1.5, null], deep: {a: true}']


def test_a_large_sample_has_a_line_for_each_member() -> None:
    form = {"name": "n", "points": [{"x": 1, "y": "long enough"}, {"x": 2, "y": []}], "pose": {"a": {"b": 1}, "c": 2}}
    assert sample_lines(form, 20) == [
        'name: "n"',
        "points:",
        "  -",
        "    x: 1",
        '    y: "long enough"',
        "  - {x: 2, y: []}",
        "pose:",
        "  a: {b: 1}",
        "  c: 2",
    ]


def test_long_lists_and_texts_are_cut_unless_all_is_wanted() -> None:
    form = {"numbers": list(range(30)), "text": "x" * 300}
    (line,) = sample_lines(form, 1000)
    assert "23, ... 6 more]" in line
    assert 'x"... 60 characters more' in line
    (whole,) = sample_lines(form, 1000, whole=True)
    assert "29]" in whole
    assert "x" * 300 in whole


def test_nothing_moves_the_cursor() -> None:
    form = {"text": "\x1b[2J\x7f\u202e", "map": {"\x1b]0;": 1}}
    (line,) = sample_lines(form, 1000)
    assert line.isprintable()
    assert line == 'text: "\\u001b[2J\\u007f\\u202e", map: {"\\u001b]0;": 1}'


# --- echo ----------------------------------------------------------------------------------------------------


class Info:
    publication_handle = Guid(bytes(15) + b"\2")
    source_timestamp = 1.5

    def __init__(self, state: InstanceState, *, valid: bool) -> None:
        self.instance_state, self.valid_data = state, valid


def echoed(shape: Any, info: Info, *words: str) -> None:
    parser = argparse.ArgumentParser()
    add_arguments(parser)
    echo = _Echo(parser.parse_args(["Square", *words]))
    echo._print(type_support(type(shape)).struct, ddsi.Sample(shape, info))  # type: ignore[arg-type]


def test_lines_of_echo(capsys: pytest.CaptureFixture[str]) -> None:
    shape = idl.loads(SHAPE).ShapeType("BLUE", 3)
    echoed(shape, Info(InstanceState.ALIVE, valid=True))
    echoed(shape, Info(InstanceState.NOT_ALIVE_DISPOSED, valid=True))
    echoed(shape, Info(InstanceState.NOT_ALIVE_DISPOSED, valid=False))
    echoed(shape, Info(InstanceState.NOT_ALIVE_NO_WRITERS, valid=False))
    assert capsys.readouterr().out.splitlines() == [
        'color: "BLUE", x: 3',
        'color: "BLUE", x: 3',
        'disposed: color: "BLUE"',
        'no writers: color: "BLUE"',
    ]


def test_json_of_echo(capsys: pytest.CaptureFixture[str]) -> None:
    shape = idl.loads(SHAPE).ShapeType("BLUE", 3)
    echoed(shape, Info(InstanceState.ALIVE, valid=True), "--json")
    echoed(shape, Info(InstanceState.NOT_ALIVE_NO_WRITERS, valid=False), "--json")
    alive, gone = map(json.loads, capsys.readouterr().out.splitlines())
    writer = str(Info.publication_handle)
    assert alive == {"data": {"color": "BLUE", "x": 3}, "state": "alive", "writer": writer, "source_timestamp": 1.5}
    assert gone == {"key": {"color": "BLUE"}, "state": "no writers", "writer": writer, "source_timestamp": 1.5}


# --- pub -----------------------------------------------------------------------------------------------------


def test_a_mistake_is_told_before_anybody_is_waited_for(shape_file: Path, capsys: pytest.CaptureFixture[str]) -> None:
    for words, reason in {
        "x=9999999999": "x: 9999999999 does not fit int32 (-2147483648 to 2147483647)",
        "colour=RED": "there is no member 'colour' (is color meant?); there are color, x",
        "x": "'x' is neither field=value nor a JSON object",
    }.items():
        assert main(["pub", "Square", "--type", str(shape_file), words]) == 2
        assert capsys.readouterr().err == f"ddsi pub: {reason}\n"


def test_options_may_stand_between_topic_and_values(shape_file: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["pub", "Square", "--type", str(shape_file), "x=1", "--wait", "0", "y=2"]) == 2
    assert "there is no member 'y'" in capsys.readouterr().err


@pytest.mark.parametrize("words", [["--rate", "20000"], ["--rate", "0"], ["--wait", "-1"], ["--property", "name"]])
def test_options_that_are_refused(words: list[str]) -> None:
    with pytest.raises(SystemExit):
        main(["pub", "Square", *words])


# --- types from files ----------------------------------------------------------------------------------------


def test_a_type_of_a_file(tmp_path: Path) -> None:
    path = tmp_path / "two.idl"
    path.write_text("module a { module b { enum E { X }; struct S { E e; }; }; }; struct T { long x; };")
    assert load_type(f"{path}::a::b::S", Extensibility.FINAL).__name__ == "S"
    assert type_support(load_type(f"{path}::T", Extensibility.FINAL)).extensibility is Extensibility.FINAL
    for name in ("", "::S", "::a::b::E", "::a"):
        with pytest.raises(Exception, match=r"has no struct '.*'; there are a::b::S, T: say --type .*two.idl::NAME"):
            load_type(f"{path}{name}", Extensibility.FINAL)


def test_the_only_struct_of_a_file_needs_no_name(shape_file: Path) -> None:
    assert load_type(str(shape_file), Extensibility.APPENDABLE).__name__ == "ShapeType"


def test_a_file_with_a_mistake_is_one_sentence(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = tmp_path / "bad.idl"
    path.write_text("struct S { long };")
    assert main(["echo", "Square", "--type", str(path)]) == 2
    assert "bad.idl:1:17: expected" in capsys.readouterr().err
    assert main(["echo", "Square", "--type", str(tmp_path / "none.idl")]) == 2
    assert "No such file" in capsys.readouterr().err


# --- typeof --------------------------------------------------------------------------------------------------


def census(*announced: tuple[str, str, bytes]) -> Census:
    endpoints = tuple(
        SeenEndpoint(
            DiscoveredWriterData(
                guid=Guid(bytes(14) + bytes([number, 2])),
                topic_name=topic,
                type_name=type_name,
                qos=EndpointQos(),
                type_information=information,
            ),
            (),
        )
        for number, (topic, type_name, information) in enumerate(announced)
    )
    return Census(0, (SeenParticipant(DiscoveredParticipantData(guid=Guid(bytes(16))), endpoints),))


INFORMATION = ddsi.type_information(idl.loads(SHAPE).ShapeType)


def test_types_of_one_topic_are_apart() -> None:
    seen = census(("T", "A", b""), ("T", "A", b"1"), ("T", "B", b""), ("T", "A", b"1"), ("U", "C", b""))
    assert [(one.type_name, one.information, len(one.endpoints)) for one in announced_types(seen, "T")] == [
        ("A", b"1", 2),
        ("A", b"", 1),
        ("B", b"", 1),
    ]
    assert len(announced_types(seen, "*")) == 4
    assert announced_types(seen, "V") == []


def test_a_name_is_no_pattern_where_a_topic_is_called_so() -> None:
    seen = census(("a[b]", "A", b""), ("ab", "B", b""))
    assert [one.type_name for one in announced_types(seen, "a[b]")] == ["A"]


def test_what_is_said_of_a_type_without_idl_is_idl_all_the_same() -> None:
    (one,) = announced_types(census(("T", "A\x1b", INFORMATION.encode())), "T")
    one.reason = "no answer"
    lines = list(one.lines())
    assert all(line.startswith("//") for line in lines if line)
    assert lines[0] == "// Topic T, type A?"
    assert lines[1] == f"//   minimal {INFORMATION.minimal.hex()}, complete {INFORMATION.complete.hex()}"
    assert "// Its IDL is not to be had: no answer." in lines
    assert one.json()["identifiers"]["complete"] == "f2" + INFORMATION.complete.hex()


def test_a_type_without_names_is_said_to_be_one() -> None:
    half = ddsi.type_information(idl.loads(SHAPE).ShapeType).encode()[4:52]  # the minimal half alone
    (one,) = announced_types(census(("T", "A", bytes([48, 0, 0, 0]) + half)), "T")
    one.idl = "struct Type_1 { int32 member_0; };"
    assert list(one.identifiers()) == ["minimal"]
    assert "//   which tell no names: types are called by their hashes here, members by their ids" in one.lines()


def test_what_is_no_type_information_has_no_identifiers() -> None:
    (one,) = announced_types(census(("T", "A", b"nonsense")), "T")
    assert one.identifiers() == {}
    assert "no type information" in "\n".join(one.lines())
