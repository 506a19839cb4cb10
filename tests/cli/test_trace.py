"""``ddsi trace FILE``: every kind of recording, as a diagram and as text; broken ones up to where they break."""

from __future__ import annotations

import io
from pathlib import Path

import pytest

from ddsi.cli import main
from ddsi.cli.exit_status import CommandError
from ddsi.cli.trace_source import TraceSource
from ddsi.cli.trace_text import TraceText
from ddsi.trace import events as e
from ddsi.trace.event import Category
from ddsi.trace.sink import JsonLinesSink
from tests.trace.samples import HERE, SAMPLES, A, B

CAPTURES = Path(__file__).parents[1] / "captures"


def _recording(path: Path) -> Path:
    with path.open("w") as stream:
        sink = JsonLinesSink(stream)
        for event in SAMPLES:
            sink(event)
    return path


def test_json_lines_as_a_diagram(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = _recording(tmp_path / "a.jsonl")
    assert main(["trace", str(path), "--ascii"]) == 0
    shown = capsys.readouterr().out
    assert "A = 01dd0000:00000000:0000000a" in shown
    assert "wrote" in shown or "disposed" in shown
    assert "timer" not in shown
    assert shown.isascii()


def test_json_lines_as_text(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = _recording(tmp_path / "a.jsonl")
    assert main(["trace", str(path), "--text", "--only", "timer,remark"]) == 0
    lines = capsys.readouterr().out.splitlines()
    told = [line.split(maxsplit=2)[2] for line in lines if line[0] == " "]
    assert told == ["timer heartbeat (1 ms late)", "B restarts"]
    assert 'A = 01dd0000:00000000:0000000a  ddsi "nominé"' in lines


@pytest.mark.parametrize("name", ["cyclone-best-effort", "fastdds-fragments", "dust-reliable"])
@pytest.mark.parametrize("text", [[], ["--text"]])
def test_captures_of_other_vendors(name: str, text: list[str], capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["trace", str(CAPTURES / f"{name}.pcap"), *text]) == 0
    shown = capsys.readouterr().out
    assert "DATA SPDP" in shown
    assert "Square" in shown or "Blob" in shown


def test_a_limit_reads_no_further(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = _recording(tmp_path / "a.jsonl")
    assert main(["trace", str(path), "--text", "--limit", "2"]) == 0
    assert [line[:12].strip() for line in capsys.readouterr().out.splitlines()] == [
        "A = 01dd0000",
        "0.000000",
        "0.000000",
    ]


def test_standard_input(tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch) -> None:
    octets = _recording(tmp_path / "a.jsonl").read_bytes()
    monkeypatch.setattr("sys.stdin", io.TextIOWrapper(io.BytesIO(octets)))
    assert main(["trace", "-", "--text"]) == 0
    assert "B restarts" in capsys.readouterr().out


def test_what_stands_before_the_break_is_drawn(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = _recording(tmp_path / "a.jsonl")
    path.write_text(path.read_text() + '{"event": "remark", "now"')
    assert main(["trace", str(path), "--text"]) == 2
    said = capsys.readouterr()
    assert "B restarts" in said.out
    assert said.err == f"ddsi trace: {path} is broken: line {len(SAMPLES) + 2} is not JSON\n"


def test_a_capture_that_is_cut_off(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = tmp_path / "cut.pcap"
    path.write_bytes((CAPTURES / "cyclone-discovery.pcap").read_bytes()[:2000])
    assert main(["trace", str(path)]) == 2
    said = capsys.readouterr()
    assert "DATA SPDP" in said.out
    assert "cut.pcap is broken: " in said.err
    assert said.err.count("\n") == 1


@pytest.mark.parametrize(
    ("words", "sentence"),
    [
        (["nowhere.jsonl"], "nowhere.jsonl: No such file or directory"),
        (["--follow"], "--follow and --limit are for a FILE"),
        (["x", "--record", "y"], "--record is for a domain"),
    ],
)
def test_mistakes(
    words: list[str], sentence: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    assert main(["trace", *words]) == 2
    assert sentence in capsys.readouterr().err


def test_a_file_that_grows() -> None:
    """At its end the source waits, also in the middle of a line, and goes on with what came."""
    stream = io.BytesIO()
    text = io.StringIO()
    sink = JsonLinesSink(text)
    for number in range(3):
        sink(e.Remark(float(number), A, f"remark {number}"))
    whole = text.getvalue().encode()
    arrived = 0

    def wait() -> None:
        nonlocal arrived
        if arrived >= len(whole):
            raise EOFError
        at = stream.tell()
        stream.write(whole[arrived : arrived + 7])
        stream.seek(at)
        arrived += 7

    found = []
    with pytest.raises(EOFError):
        for event in TraceSource(stream, "x", wait).events():
            found.append(event)
    assert [event.text for event in found if isinstance(event, e.Remark)] == ["remark 0", "remark 1", "remark 2"]


def test_a_line_without_end_does_not_fill_the_memory() -> None:
    stream = io.BytesIO(b'{"x": "' + b"a" * (3 << 20))
    with pytest.raises(CommandError, match="longer than"):
        list(TraceSource(stream, "x").events())


def test_an_empty_file_has_no_events() -> None:
    assert list(TraceSource(io.BytesIO(), "x").events()) == []
    assert list(TraceSource(io.BytesIO(b"\n"), "x").events()) == []


def test_lines_of_text() -> None:
    """Who tells it, what happened, and for messages whom they are from and for."""
    text = TraceText(frozenset(Category))
    header = b"RTPS\x02\x04\x01\xdd" + A
    info_dst = b"\x0e\x01\x0c\x00" + B
    heartbeat = b"\x07\x01\x1c\x00" + bytes(4) + b"\x00\x00\x01\x02" + b"\0\0\0\0\x01\0\0\0" * 2 + b"\x01\0\0\0"
    assert text.lines(e.MessageSent(5.0, A, (HERE,), header + info_dst + heartbeat)) == [
        "A = 01dd0000:00000000:0000000a  ddsi",
        "B = 01dd0000:00000000:0000000b",
        "    0.000000  A sent to udpv4/127.0.0.1:7410: to B HEARTBEAT writer 1 1..1 count 1",
    ]
    assert text.lines(e.MessageReceived(5.5, B, HERE, header + heartbeat)) == [
        "    0.500000  B received from udpv4/127.0.0.1:7410: A HEARTBEAT writer 1 1..1 count 1"
    ]
    assert text.lines(e.Remark(6.0, B, "late")) == ["    1.000000  B late"]
    assert text.lines(e.LinkDropped(7.0, A, HERE, header + heartbeat, "loss", B))[0].startswith("    2.000000  A lost")
