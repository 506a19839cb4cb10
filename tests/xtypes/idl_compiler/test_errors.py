"""What is wrong with IDL text is said with place and reason; the table is the specification of the words."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from ddsi import BadParameter, DdsError, idl

ERRORS: dict[str, tuple[str, int, int, str]] = {
    # --- lexer
    "odd character": ("struct A { long x; $ };", 1, 20, "the character '$' has no meaning here"),
    "open comment": ("struct A {\n /* long x; };", 2, 2, "the comment has no end; expected '*/'"),
    "open string": ('const string S = "abc;\n', 1, 18, 'the string has no end on this line; expected "'),
    "odd macro": ("#define N 5L\n#if N > 4\nconst long M = N;\n#endif", 3, 16, "'5L' is no number"),
    "odd number": ("const long N = 12abc;", 1, 16, "'12abc' is no number"),
    "odd octal": ("const long N = 089;", 1, 16, "'089' is octal, as it begins with 0, but has other digits"),
    "two characters": ("const char C = 'ab';", 1, 16, "''ab'' is not one character"),
    # --- parser
    "no definition": (
        "long x;",
        1,
        1,
        "expected a definition (module, struct, union, enum, typedef, const, ...), found 'long'",
    ),
    "no semicolon": ("struct A {\n  long x\n};", 3, 1, "expected ';' behind the member, found '}'"),
    "no end": ("struct A { long x;", 1, 19, "expected a type, found end of the text"),
    "no semicolon behind": (
        "struct A { long x; }\nstruct B { long y; };",
        2,
        1,
        "expected ';' behind the struct, found 'struct'",
    ),
    "no name": ("struct { long x; };", 1, 8, "expected the name of the struct, found '{'"),
    "keyword": (
        "struct A { long module; };",
        1,
        17,
        "expected the name of the member, found the keyword 'module'; escape it: _module",
    ),
    "keyword in other case": (
        "struct Struct { long x; };",
        1,
        8,
        "'Struct' differs from the keyword 'struct' only in case",
    ),
    "unsigned": ("struct A { unsigned x; };", 1, 21, "expected 'short' or 'long' behind 'unsigned', found 'x'"),
    "long double": (
        "struct A { long double x; };",
        1,
        12,
        "long double is not supported; use double, or octet[16] to pass it on",
    ),
    "fixed": (
        "struct A { fixed<3, 1> x; };",
        1,
        12,
        "fixed-point numbers are not supported; use double, or an integer and a scale",
    ),
    "any": ("struct A { any x; };", 1, 12, "any holds values of every type, which DDS cannot send; use a union"),
    "nested struct": (
        "struct A { struct B { long x; } b; };",
        1,
        12,
        "expected a member; define the struct before, and name it here",
    ),
    "two bases": ("struct A { long x; }; struct B : A, A { long y; };", 1, 35, "a type has one base at most"),
    "open sequence": ("struct A { sequence<long x; };", 1, 26, "expected '>' behind the sequence's element, found 'x'"),
    "no case": ("union U switch (long) { long x; };", 1, 25, "expected 'case', 'default' or '}', found 'long'"),
    "empty enum": ("enum E { };", 1, 10, "expected the name of the literal, found '}'"),
    "no dimension": ("struct A { long x[]; };", 1, 19, "expected a constant, a number or '(', found ']'"),
    "open interface": ("interface I { void f();", 1, 1, "the interface has no end; expected '}' and ';'"),
    # --- names
    "unknown type": ("struct A { Point p; };", 1, 12, "Point is not defined"),
    "near type": (
        "struct Point { long x; };\nstruct A { Pointt p; };",
        2,
        12,
        "Pointt is not defined; is Point meant?",
    ),
    "case of a type": (
        "struct Point { long x; };\nstruct A { point p; };",
        2,
        12,
        "point is not defined; Point differs from it in case",
    ),
    "twice": ("struct A { long x; };\nenum A { B };", 2, 6, "A is defined already, at <text>:1:8"),
    "twice but for case": (
        "struct A { long x; };\nenum a { B };",
        2,
        6,
        "a differs from A, defined at <text>:1:8, only in case",
    ),
    "no such inner name": (
        "module m { struct A { long x; }; };\nstruct B { m::C c; };",
        2,
        12,
        "m::C is not defined: m has no C",
    ),
    "module as type": ("module m { const long N = 1; };\nstruct B { m c; };", 2, 12, "expected a type; m is a module"),
    "interface as type": (
        "interface I { };\nstruct B { I c; };",
        2,
        12,
        "I is of the kind interface, which is no data type",
    ),
    "never defined": ("struct N;\nstruct B { sequence<N> c; };", 2, 21, "N is declared, but never defined"),
    "incomplete": (
        "struct A { A a; };",
        1,
        14,
        "A is not complete here; put it in a sequence, make it optional, or define it before",
    ),
    "base not complete": ("struct N;\nstruct B : N { long x; };", 2, 12, "the base N is not defined yet"),
    "base is no struct": ("enum E { X };\nstruct B : E { long x; };", 2, 12, "expected a struct as base; E is none"),
    # --- constants
    "division": ("const long N = 1 / (2 - 2);", 1, 18, "division by zero"),
    "too large": ("const octet N = 256;", 1, 17, "256 does not fit octet (0 to 255)"),
    "negative": ("const unsigned long N = -1;", 1, 25, "-1 is negative; uint32 has no sign"),
    "beyond 64 bits": ("const long N = 1 << 63 << 63;", 1, 24, "the result exceeds 64 bits"),
    "no integer": ("const long N = 1.5;", 1, 16, "expected an integer, found 1.5"),
    "sign of a string": ('const long N = -"a";', 1, 16, "'-' takes a number, not \"a\""),
    "string for number": ('const long N = "a";', 1, 16, 'expected a number, found "a"'),
    "long string": ('const string<2> S = "abc";', 1, 21, "a string of 3 exceeds its bound of 2"),
    "other enum": ("enum E { X }; enum F { Y }; const E C = Y;", 1, 41, "expected a literal of E, found the literal Y"),
    "no constant": ("struct A { long x; }; const long N = A;", 1, 38, "expected a constant; A is none"),
    "zero bound": (
        "struct A { string<0> x; };",
        1,
        19,
        "the bound of a string is a number from 1 to 4294967295, not 0",
    ),
    "huge array": (
        "struct A { octet x[65536][65537]; };",
        1,
        27,
        "the array has 4295032832 elements; 4294967295 are possible",
    ),
    # --- types
    "member twice": (
        "struct A { long x; long y; short X; };",
        1,
        34,
        "X is there twice; x, which differs only in case, stands at <text>:1:17",
    ),
    "member of the base": (
        "struct A { long x; };\nstruct B : A { long x; };",
        2,
        21,
        "x is there twice; x stands at <text>:1:17",
    ),
    "id twice": ("struct A { @id(3) long x; @id(3) long y; };", 1, 39, "y has the member id 0x3, and so has x"),
    "id too large": ("struct A { @id(0x10000000) long x; };", 1, 16, "@id takes a number from 0 to 268435455"),
    "id without number": ("struct A { @id long x; };", 1, 12, "@id takes a number, as in @id(...)"),
    "id behind the largest": (
        "struct A { @id(0xFFFFFFF) long x; long y; };",
        1,
        40,
        "y has the member id 0x10000000, and 0xfffffff is the largest",
    ),
    "optional key": ("struct A { @key @optional long x; };", 1, 32, "x is key, and so cannot be optional"),
    "key beside the base's": (
        "struct A { @key long x; };\nstruct B : A { @key long y; };",
        2,
        26,
        "the base A has the key; nothing adds to it",
    ),
    "default does not fit": ("struct A { @default(300) octet x; };", 1, 21, "300 does not fit octet (0 to 255)"),
    "extensibility": (
        "@extensibility(GROWING) struct A { long x; };",
        1,
        16,
        "@extensibility takes FINAL or APPENDABLE or MUTABLE",
    ),
    "discriminator": (
        "union U switch (float) { case 1: long x; };",
        1,
        17,
        "a discriminator is an integer, character, boolean or enum",
    ),
    "label does not fit": ("union U switch (octet) { case 300: long x; };", 1, 31, "300 does not fit octet (0 to 255)"),
    "label twice": ("union U switch (long) { case 1: long x; case 1: long y; };", 1, 46, "the label is also that of x"),
    "default of all booleans": (
        "union U switch (boolean) { case TRUE: case FALSE: long x; default: long y; };",
        1,
        73,
        "y is never chosen, as each value of the discriminator has a case of its own",
    ),
    "default of a whole enum": (
        "enum E { A };\nunion U switch (E) { default: long y; case A: long x; };",
        2,
        36,
        "y is never chosen, as each value of the discriminator has a case of its own",
    ),
    "NUL in a string": (
        'struct A { @default("a\\0") string x; };',
        1,
        21,
        "a string contains no NUL, which ends it on the wire",
    ),
    "default twice": (
        "union U switch (long) { default: long x; default: long y; };",
        1,
        56,
        "the default case is x already",
    ),
    "optional case": (
        "union U switch (long) { case 1: @optional long x; };",
        1,
        48,
        "x is a case of a union, and cannot be @optional",
    ),
    "two in a case": ("union U switch (long) { case 1: long x, y; };", 1, 41, "a case has one member; expected ';'"),
    "literal twice": ("enum E { A, B, A };", 1, 16, "A is defined already, at <text>:1:10"),
    "value twice": ("enum E { A, @value(0) B };", 1, 23, "B is 0, and so is A"),
    "value too large": ("@bit_bound(8) enum E { @value(200) A };", 1, 36, "A is 200, which does not fit @bit_bound(8)"),
    "bit outside": ("@bit_bound(8) bitmask M { @position(8) A };", 1, 40, "A is bit 8; @bit_bound(8) has bits 0 to 7"),
    "bits too many": (
        "bitset S { bitfield<60> a; bitfield<5> b; };",
        1,
        40,
        "the field would end at bit 65; a bitset has 64",
    ),
    "bits of a type": ("bitset S { bitfield<9, octet> a; };", 1, 21, "9 bits are more than a octet has"),
    "map by struct": (
        "struct A { long x; }; struct B { map<A, long> m; };",
        1,
        38,
        "a map's key is a number, string, character, boolean or enum",
    ),
    "annotated forward": ("@final struct A;", 1, 1, "an annotation stands before the definition, not before this"),
    "keylist of nothing": ("struct A { long x; };\n#pragma keylist A y", 2, 1, "#pragma keylist: A has no member y"),
    # --- preprocessor
    "no file": ('#include "none.idl"', 1, 1, "the file 'none.idl' is not found; looked in no folder; give include="),
    "no include": ("#include none", 1, 10, 'expected "file" or <file> behind #include'),
    "open condition": ("#ifdef A\nstruct A { long x; };", 1, 1, "this condition has no #endif"),
    "endif alone": ("\n#endif", 2, 1, "#endif without an #if before it"),
    "else twice": ("#if 1\n#else\n#else\n#endif", 3, 1, "#else behind the #else of the same condition"),
    "odd condition": ("#if 1 +\n#endif", 1, 1, "expected a number, a name or '(' in the condition, found its end"),
    "condition divides": ("#if 1 / 0\n#endif", 1, 7, "the condition divides by zero"),
    "unknown directive": ("#import <a>", 1, 2, "the directive #import is unknown"),
    "error directive": ("#if 1\n#error Not for you\n#endif", 2, 1, "#error Not for you"),
    "macro arguments": ("#define F(a, b) a\nconst long N = F(1);", 2, 16, "F takes 2 arguments, not 1"),
    "open macro": ("#define F(a) a\nconst long N = F(1;", 2, 16, "the arguments of F have no end; expected ')'"),
    "joining nothing": ("#define F(a) a ##", 1, 16, "'##' joins two tokens, and stands at an end of F"),
    "joining to nothing": ("#define F ## a", 1, 11, "'##' joins two tokens, and stands at an end of F"),
    "joined": ("#define F(a) a ## -\nconst long N = F(1);", 2, 16, "'1' and '-', joined by '##', are no token"),
    "joined comment": ("#define F(a) / ## a\nconst long N = F(/);", 2, 16, "'/' and '/', joined by '##', are no token"),
    "string of no parameter": ("#define F(a) #b", 1, 14, "expected a parameter of F behind '#'"),
    "string of nothing": ("#define F(a) a #", 1, 16, "expected a parameter of F behind '#'"),
}


@pytest.mark.parametrize("name", ERRORS)
def test_an_error_has_place_and_reason(name: str) -> None:
    text, line, column, reason = ERRORS[name]
    with pytest.raises(idl.IdlError) as caught:
        idl.loads(text)
    assert (caught.value.line, caught.value.column, caught.value.reason) == (line, column, reason)


def test_an_error_shows_the_line_with_a_caret() -> None:
    with pytest.raises(idl.IdlError) as caught:
        idl.loads("struct A {\n\tlong x y;\n};")
    assert str(caught.value) == "<text>:2:9: expected ';' behind the member, found 'y'\n    \tlong x y;\n    \t       ^"
    assert isinstance(caught.value, DdsError)
    assert isinstance(caught.value, ValueError)


def test_a_line_without_end_is_shown_around_the_place() -> None:
    with pytest.raises(idl.IdlError) as caught:
        idl.loads("const long A = 1;" * 1_000 + "$")
    assert len(str(caught.value)) < 500


def test_an_error_in_an_included_file_names_that_file(tmp_path: Path) -> None:
    (tmp_path / "inner.idl").write_text("struct Inner {\n  long\n};")
    (tmp_path / "outer.idl").write_text('#include "inner.idl"\nstruct Outer { Inner i; };')
    with pytest.raises(idl.IdlError) as caught:
        idl.load(tmp_path / "outer.idl")
    assert (caught.value.file, caught.value.line) == (str(tmp_path / "inner.idl"), 3)


def test_an_error_in_a_macro_is_where_the_macro_is_used() -> None:
    with pytest.raises(idl.IdlError) as caught:
        idl.loads("#define KIND Unknown\nstruct A {\n  KIND x;\n};")
    assert (caught.value.line, caught.value.column) == (3, 3)


def test_a_file_that_is_not_there_is_an_os_error(tmp_path: Path) -> None:
    with pytest.raises(FileNotFoundError):
        idl.load(tmp_path / "none.idl")


@pytest.mark.parametrize(
    ("options", "said"),
    [
        ({"include": "folder"}, r"include is a list of folders, as \['folder'\]"),
        ({"default_extensibility": "final"}, "idl.FINAL, idl.APPENDABLE or idl.MUTABLE, not 'final'"),
    ],
)
def test_options_that_cannot_be_meant_are_refused(options: dict[str, Any], said: str) -> None:
    with pytest.raises(BadParameter, match=said):
        idl.loads("struct A { long x; };", **options)


def test_what_is_no_text_is_refused() -> None:
    anything: Any = Path("shapes.idl")
    with pytest.raises(BadParameter, match="IDL text is a str, not "):
        idl.loads(anything)
