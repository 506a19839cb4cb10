"""The preprocessor, by the constants that come through it."""

from __future__ import annotations

from pathlib import Path

import pytest

from ddsi import idl

CONSTANTS: dict[str, tuple[str, int]] = {
    "object-like": ("#define A 3\nconst long N = A;", 3),
    "in another": ("#define A B + 1\n#define B 3\nconst long N = A;", 4),
    "of itself": ("const long A = 3;\n#define A (A + 1)\nconst long N = A;", 4),
    "redefined": ("#define A 3\n#undef A\n#define A 4\nconst long N = A;", 4),
    "with a parameter": ("#define TWICE(x) (2 * (x))\nconst long N = TWICE(3 + 1);", 8),
    "with two": ("#define MAX(a, b) a + b\nconst long N = MAX((1, 2), 3);".replace("(1, 2)", "(1)"), 4),
    "called in a call": ("#define F(x) (x + 1)\nconst long N = F(F(F(1)));", 4),
    "without a call": ("const long F = 5;\n#define F(x) x\nconst long N = F;", 5),
    "over lines": ("#define F(a, b) (a \\\n  - b)\nconst long N = F(\n  5,\n  2);", 3),
    "without parameters": ("#define F() 7\nconst long N = F();", 7),
    "joined": ("#define F(a, b) a ## b\nconst long N = F(1, 2);", 12),
    "joined names": ("const long CD = 3;\n#define F(x) C ## x\nconst long N = F(D);", 3),
    "joined to a macro": ("#define AB 4\n#define F(a, b) a ## b\nconst long N = F(A, B);", 4),
    "joined unexpanded": ("#define A 9\nconst long AB = 5;\n#define F(a) a ## B\nconst long N = F(A);", 5),
    "joined expanded": (
        "#define A 1\n#define J(a, b) a ## b\n#define F(a, b) J(a, b)\nconst long N = F(A, 2);",
        12,
    ),
    "joined three": ("#define F(a, b, c) a##b##c\nconst long N = F(0, x, 1F);", 31),
    "joined operator": ("#define S < ## <\nconst long N = 1 S 3;", 8),
    "joined more than one": ("#define F(a, b) a ## b\nconst long N = F(1 + 1, 2 + 3);", 16),
    "joined nothing": ("#define F(a, b) 7 a ## b\nconst long N = F(,);", 7),
    "joined to nothing": ("#define F(a, b) 1 + a ## b ## 2\nconst long N = F(3,);", 33),
    "joined result is no operator": ("#define H # ## #\n#define F(x) x\n#define G H\nconst long N = F(1);", 1),
    "ifdef": ("#define A\n#ifdef A\nconst long N = 1;\n#else\nconst long N = 2;\n#endif", 1),
    "ifndef": ("#ifndef A\nconst long N = 1;\n#else\nconst long N = 2;\n#endif", 1),
    "elif": ("#if 0\n#elif 1\nconst long N = 2;\n#elif 1\nconst long N = 3;\n#else\nconst long N = 4;\n#endif", 2),
    "nested": ("#if 0\n#if 1\nconst long N = 1;\n#endif\n#else\nconst long N = 2;\n#endif", 2),
    "not evaluated": ("#if 0\n#if 1 / 0 $$ \n#endif\n#endif\nconst long N = 1;".replace("$$", "+"), 1),
    "other languages left out": ("#if 0\n don't 5abc \" \\ ` $ \u00e9 #foo\n#foo\n#endif\nconst long N = 1;", 1),
    "C left out": ("#if defined(__cplusplus) && __cplusplus >= 201103L\n'\n#else\nconst long N = 1;\n#endif", 1),
    "suffixes": ("#define V 0x10uL\n#if V == 16 && 010u == 8\nconst long N = 1;\n#elif 5X\n#endif", 1),
    "defined": ("#define A\n#if defined(A) && !defined B\nconst long N = 1;\n#endif", 1),
    "arithmetic": ("#if (1 << 4) / 3 == 5 && -7 / 2 == -3 && (5 >= 5 ? 1 : 0)\nconst long N = 1;\n#endif", 1),
    "precedence": ("#if 1 + 2 * 3 == 7 && (1 | 6 ^ 2 & 3) == 5\nconst long N = 1;\n#endif", 1),
    "names are zero": ("#if UNKNOWN == 0 && TRUE\nconst long N = 1;\n#endif", 1),
    "other directives": ('#line 3 "x"\n#pragma pack(4)\n#ident "me"\n# 1 "a.idl"\n#\nconst long N = 1;', 1),
    "comments": ("const /* not 2 */ long // = 3;\nN = /**/ 1;", 1),
    "joined lines": ("const long N\\\n = 1;", 1),
    "joined comment": ("// comment \\\n const long N = 2;\nconst long N = 1;", 1),
    "carriage returns": ("#define A 1\r\nconst long N = A;\r\n", 1),
}


@pytest.mark.parametrize("name", CONSTANTS)
def test_macros_and_conditions(name: str) -> None:
    text, expected = CONSTANTS[name]
    assert expected == idl.loads(text).N


STRINGS = {
    "its own words": ("F(a  +\n b)", "a + b"),
    "not what macros make of them": ("F(A)", "A"),
    "expanded before": ("G(A)", "5"),
    "quotes": (r'F("a\n" \'"\')', r""" "a\n" '"' """.strip()),
    "commas in parentheses": ("F((a, b))", "(a, b)"),
    "nothing": ("F( )", ""),
}


@pytest.mark.parametrize("name", STRINGS)
def test_an_argument_becomes_a_string(name: str) -> None:
    text, expected = STRINGS[name]
    macros = "#define A 5\n#define F(x) # x\n#define G(x) F(x)\n"
    assert expected == idl.loads(f"{macros}const string S = {text};").S


def test_an_argument_names_a_type_and_its_members() -> None:
    types = idl.loads(
        """
        #define POINT(name, type) struct name ## Point { @unit(#type) type name ## _x; type name ## _y; };
        POINT(grid, long)
        """
    )
    assert types.gridPoint(grid_x=1, grid_y=2).grid_y == 2


def test_definitions_may_be_given() -> None:
    assert idl.loads("#if SIZE > 2\nconst long N = SIZE;\n#endif", defines={"SIZE": "1 + 2"}).N == 3
    assert idl.loads("const long N = SIZE;", defines={"SIZE": "(1 ## 2)"}).N == 12


def test_quoted_includes_look_beside_the_file_first(tmp_path: Path) -> None:
    other = tmp_path / "other"
    other.mkdir()
    (tmp_path / "a.idl").write_text("const long N = 1;")
    (other / "a.idl").write_text("const long N = 2;")
    (tmp_path / "quoted.idl").write_text('#include "a.idl"')
    (tmp_path / "angled.idl").write_text("#include <a.idl>")
    assert idl.load(tmp_path / "quoted.idl", include=[other]).N == 1
    assert idl.load(tmp_path / "angled.idl", include=[other]).N == 2
    assert idl.loads('#include "a.idl"', include=[other]).N == 2


def test_includes_are_relative_to_the_file_that_includes(tmp_path: Path) -> None:
    (tmp_path / "inner").mkdir()
    (tmp_path / "inner" / "a.idl").write_text('#include "b.idl"\n#include "../c.idl"')
    (tmp_path / "inner" / "b.idl").write_text("const long B = 1;")
    (tmp_path / "c.idl").write_text("const long C = 2;")
    (tmp_path / "top.idl").write_text('#define FILE "inner/a.idl"\n#include FILE')
    types = idl.load(str(tmp_path / "top.idl"))
    assert (types.B, types.C) == (1, 2)


@pytest.mark.parametrize("guard", ["#pragma once\n{}", "#ifndef A_IDL\n#define A_IDL\n{}\n#endif"])
def test_a_guarded_file_may_be_included_twice(tmp_path: Path, guard: str) -> None:
    (tmp_path / "a.idl").write_text(guard.format("struct A { long x; };"))
    (tmp_path / "b.idl").write_text('#include "a.idl"\n#include "./a.idl"\n#include <a.idl>\n')
    assert list(idl.load(tmp_path / "b.idl")) == ["A"]


def test_annotations_that_the_text_declares_are_no_surprise() -> None:
    declared = "@annotation mine { long value default 3; }; @annotation key { boolean value default TRUE; };"
    types = idl.loads(f"{declared} @mine(5) struct A {{ @mine @key long x; long y; }};")
    assert types.idl_warnings == ()
    assert "@key int32 x;" in idl.to_idl(types.A)


def test_warnings_are_told() -> None:
    types = idl.loads('#warning old\nconst long N = 1;\n@mine struct A { @unit("m") @odd(3) long x; };')
    assert [str(warning) for warning in types.idl_warnings] == [
        "<text>:1:1: #warning old",
        "<text>:3:1: @mine has no effect here, and is ignored",
        "<text>:3:29: @odd has no effect here, and is ignored",
    ]
