"""``ddsi idl``: source to a file or standard output, warnings and errors to standard error."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from ddsi import idl
from ddsi.cli.command_line import main

DOCUMENTATION = (Path(__file__).parents[2] / "docs" / "idl.md").read_text(encoding="utf-8")


def test_the_source_goes_to_standard_output(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "a.idl").write_text("struct A { long x; };")
    assert main(["idl", str(tmp_path / "a.idl")]) == 0
    shown = capsys.readouterr()
    assert "class A:\n    x: idl.int32\n" in shown.out
    assert shown.err == ""


def test_the_source_goes_to_a_file(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "a.idl").write_text("@odd struct A { long x; };")
    assert main(["idl", str(tmp_path / "a.idl"), "-o", str(tmp_path / "a.py")]) == 0
    shown = capsys.readouterr()
    assert shown.out == ""
    assert shown.err == f"{tmp_path / 'a.idl'}:1:1: warning: @odd has no effect here, and is ignored\n"
    assert "class A:" in (tmp_path / "a.py").read_text()


def test_options_reach_the_compiler(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "inner").mkdir()
    (tmp_path / "inner" / "b.idl").write_text("const long B = SIZE + FLAG;")
    (tmp_path / "a.idl").write_text("#include <b.idl>\nstruct A { long x; };")
    words = ["-I", str(tmp_path / "inner"), "-D", "SIZE=4", "--define", "FLAG", "--default-extensibility", "final"]
    assert main(["idl", str(tmp_path / "a.idl"), *words]) == 0
    shown = capsys.readouterr().out
    assert "B: Final = 5" in shown
    assert "extensibility=idl.FINAL" in shown


def test_an_error_is_shown_whole_and_nothing_is_written(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "a.idl").write_text("struct A {\n  long x\n};")
    assert main(["idl", str(tmp_path / "a.idl"), "-o", str(tmp_path / "a.py")]) == 2
    shown = capsys.readouterr()
    assert shown.err == f"{tmp_path / 'a.idl'}:3:1: expected ';' behind the member, found '}}'\n    }};\n    ^\n"
    assert not (tmp_path / "a.py").exists()


def test_a_file_that_is_not_there_is_one_sentence(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["idl", str(tmp_path / "none.idl")]) == 2
    assert capsys.readouterr().err == f"ddsi idl: {tmp_path / 'none.idl'}: No such file or directory\n"


def test_a_definition_has_a_name(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit) as ended:
        main(["idl", str(tmp_path / "a.idl"), "-D", "3=4"])
    assert ended.value.code == 2
    assert "NAME or NAME=VALUE is wanted, not '3=4'" in capsys.readouterr().err


def test_the_example_of_the_documentation_is_true(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """The IDL in docs/idl.md becomes the Python beside it, and its other Python runs."""
    (shapes,) = re.findall(r"```idl\n(.*?)```", DOCUMENTATION, re.S)
    loading, expected, union, _network = re.findall(r"```python\n(.*?)```", DOCUMENTATION, re.S)
    (tmp_path / "shapes.idl").write_text(shapes)
    assert main(["idl", str(tmp_path / "shapes.idl")]) == 0
    assert capsys.readouterr().out.endswith(f"\n\n{expected}")
    exec(loading.replace("shapes.idl", (tmp_path / "shapes.idl").as_posix()), {})
    names = {"idl": idl}
    exec(compile(union.rpartition("\n\n")[0], "docs/idl.md", "exec"), names)
    for line in union.rpartition("\n\n")[2].splitlines()[:2]:
        exec(line, names)
    with pytest.raises(AttributeError):
        exec(union.splitlines()[-1], names)


def test_the_documentation_speaks_of_what_is_there() -> None:
    spoken_of = set(re.findall(r"\bidl\.([a-zA-Z_]\w*)", DOCUMENTATION)) - {"py"}
    assert len(spoken_of) > 15
    assert {name for name in spoken_of if not hasattr(idl, name)} == set()
