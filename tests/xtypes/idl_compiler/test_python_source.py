"""The source that ``ddsi idl`` writes: as a person would, formatted, typed, and meaning what ``load`` gives."""

from __future__ import annotations

import importlib.util
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest

from ddsi import idl
from ddsi.xtypes import type_support
from ddsi.xtypes.defaults import zero_value
from ddsi.xtypes.idl_compiler.loading import compile_idl
from ddsi.xtypes.idl_compiler.python_source import PythonSource
from ddsi.xtypes.idl_compiler.source_text import SourceText
from ddsi.xtypes.model import StructType
from ddsi.xtypes.resolution import STRUCT_ATTRIBUTE, named_type
from tests.xtypes.vectors import ALL

from .same_types import difference

EVERYTHING = Path(__file__).with_name("everything.idl").read_text()

SHAPES = """
/* What the demo sends. */
module shapes {
  const long LARGEST = 100;

  enum Color { RED, GREEN };

  // A shape on the canvas.
  @final
  struct Shape {
    @key string<128> color;
    long x;  // from the left
    // From the top.
    long y;
    @default(LARGEST) long size;
    @optional Color fill;
  };
};
"""

SHAPES_SOURCE = '''"""The types of shapes.idl, made from it by ``ddsi idl``."""

from __future__ import annotations

import enum
from typing import Annotated, Final, TypeAlias

from ddsi import idl


LARGEST: Final = 100


@idl.enum(typename="shapes::Color")
class Color(enum.IntEnum):
    RED = 0
    GREEN = 1


@idl.struct(typename="shapes::Shape", extensibility=idl.FINAL)
class Shape:
    """A shape on the canvas."""

    color: Annotated[str, idl.bound(128), idl.key]
    x: idl.int32
    # From the top.
    y: idl.int32
    size: idl.int32 = 100
    fill: Color | None = None


class shapes:
    """What the demo sends."""

    LARGEST: Final = LARGEST
    Color: TypeAlias = Color
    Shape: TypeAlias = Shape
'''


def source_of(text: str, title: str = "types.idl") -> str:
    compilation = compile_idl(
        SourceText(title, text), None, include=(), defines={}, default_extensibility=idl.APPENDABLE
    )
    return PythonSource(compilation, title).text()


def test_the_source_is_what_a_person_would_have_written() -> None:
    assert source_of(SHAPES, "shapes.idl") == SHAPES_SOURCE


SOURCES = {
    "everything": EVERYTHING,
    "shapes": SHAPES,
    "nothing": "",
    "a constant": "const long N = 1;",
    "a constant in a module": "module m { const long N = 1; };",
    "a typedef": "typedef long N;",
    "only an enum": "enum E { A };",
    "a long name": f"module m {{ struct {'Long' * 18} {{ long {'long_' * 20}; string {'text_' * 18}; }}; }};",
    "a long constant": f'const string S = "{"text " * 20}"; const string T = "{"text " * 15}";',
    "empty": "struct A { }; @mutable struct B : A { }; bitset C { bitfield<3> x; }; bitset D : C { };",
    "recursive": "struct A; typedef sequence<A> As; typedef As Bs;"
    "struct A { @optional Bs x; @optional A y; Bs z[2]; };"
    "typedef sequence<As> Cs; struct B : A { @optional Cs c; map<long, Bs> d; };",
    "reserved": "struct str { long int; }; struct field { @default(1) long idl; str enum_; }; enum E { mro, value };",
    "long labels": "union U switch (long) { case " + ": case ".join(map(str, range(1000, 1030))) + ": long x; };",
    "comments": """
        // say "hi"
        struct A {
          /* three \""" and \\\\ one

           * two */
          long x;
        };
        /** a "b" */ const long N = 1;
    """,
    **{entry["name"]: entry["idl"] for entry in ALL},
}


@pytest.fixture(scope="module")
def written(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Path]:
    folder = tmp_path_factory.mktemp("written")
    files = {name: folder / f"types_{number}.py" for number, name in enumerate(SOURCES)}
    for name, path in files.items():
        path.write_text(source_of(SOURCES[name]), encoding="utf-8")
    return files


def test_the_source_is_formatted(written: dict[str, Path]) -> None:
    """As ``ruff format`` with its own line length would."""
    pytest.importorskip("ruff", reason="ruff is not installed")
    command = [sys.executable, "-m", "ruff", "format", "--isolated", "--diff", *map(str, written.values())]
    run = subprocess.run(command, capture_output=True, text=True, timeout=120, check=False)
    assert (run.returncode, run.stdout) == (0, "")


@pytest.mark.slow
def test_the_source_is_clean_to_a_strict_type_checker(written: dict[str, Path], tmp_path: Path) -> None:
    pytest.importorskip("mypy", reason="mypy is not installed")
    command = [sys.executable, "-m", "mypy", "--strict", "--cache-dir", str(tmp_path), *map(str, written.values())]
    run = subprocess.run(command, capture_output=True, text=True, timeout=300, check=False)
    assert run.stdout.startswith("Success"), run.stdout


def imported(path: Path) -> Any:
    spec = importlib.util.spec_from_file_location(path.stem, path)
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    sys.modules[path.stem] = module
    spec.loader.exec_module(module)
    return module


@pytest.mark.parametrize("name", SOURCES)
def test_the_source_runs_and_its_types_can_be_sent(written: dict[str, Path], name: str) -> None:
    for class_ in vars(imported(written[name])).values():
        if isinstance(getattr(class_, "__dict__", {}).get(STRUCT_ATTRIBUTE), StructType):
            support = type_support(class_)
            assert support.representations
            assert isinstance(support.serializer(support.representations[0])(zero_value(support.struct)), bytes)


def test_the_source_has_the_types_that_load_gives(written: dict[str, Path]) -> None:
    module, loaded = imported(written["everything"]), idl.loads(EVERYTHING)
    for name in ("Derived", "Again", "Color", "Words", "Flags", "More"):
        assert difference(named_type(getattr(module.a, name)), named_type(getattr(loaded.a, name))) == ""
    for name in ("Again", "V"):
        assert difference(named_type(getattr(module.c, name)), named_type(getattr(loaded.c, name))) == ""
    assert module.a.MAX == loaded.a.MAX == 17
    assert module.a.BEST == loaded.a.BEST == 7
    assert module.a.b.Point(1, 2) == module.Point(1, 2)
    assert module.c.Again is module.c_Again  # two modules have one of that name


def test_the_classes_of_load_bear_the_files_name() -> None:
    loaded = idl.loads(SHAPES)
    assert (loaded.shapes.Shape.__module__, loaded.shapes.Shape.__qualname__) == ("idl_text", "Shape")
    assert loaded.shapes.Shape.__doc__ == "A shape on the canvas."
