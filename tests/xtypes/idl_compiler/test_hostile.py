"""Text that wants too much is refused: no RecursionError, no exponential growth, no endless time."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from ddsi import XCDR1, XCDR2, deserialize, idl, serialize
from ddsi.xtypes.idl_compiler.expressions import KEYWORDS

DEEP = 1_000

HOSTILE: dict[str, tuple[str, str]] = {
    "parentheses": ("const long N = " + "(" * DEEP, "nests deeper than 64"),
    "signs": ("const long N = " + "-" * DEEP + "1;", "nests deeper than 64"),
    "operators inside": ("const long N = " + "1 | (1 ^ (1 & (1 << (1 + (1 * (" * DEEP, "nests deeper than 64"),
    "sequences": ("struct A { " + "sequence<" * DEEP, "nests deeper than 64"),
    "modules": ("module a { " * DEEP, "nests deeper than 64"),
    "conditions": ("#if 1\n" * DEEP, "conditions nest deeper than 256"),
    "condition's parentheses": ("#if " + "(" * DEEP, "the condition nests deeper"),
    "condition's signs": ("#if " + "!" * DEEP, "the condition nests deeper"),
    "condition's operators": ("#if " + "1 || (1 && (1 | (1 ^ (1 & (" * DEEP, "the condition nests deeper"),
    "condition's choices": ("#if " + "1 ? 1 : " * DEEP + "1\n#endif", "the condition nests deeper"),
    "condition's size": ("#if " + "4294967295 * 4294967295 * 4294967295\n#endif", "exceeds 64 bits"),
    "growing macros": (
        "#define A0 x x\n" + "".join(f"#define A{n + 1} A{n} A{n}\n" for n in range(60)) + "A60",
        "the macros expand to more than 100000 tokens",
    ),
    "growing arguments": (
        "#define F(x) x x\n" + "F(" * 40 + "1" + ")" * 40,
        "the macros expand to more than 100000 tokens",
    ),
    "growing names": ("#define F(x) x" + " ## x" * 200 + "\nlong F(" + "a" * 100 + ")", "joined by '##', are no token"),
    "growing strings": ("#define F(x) #x\nF(" + "a " * 1000 + ")", "the string that F makes has more than 1000"),
    "work for nothing": (
        "#define F(x) x" + " ## x" * 10_000 + "\n" + "F() " * 10_000,
        "the macros expand to more than 100000 tokens",
    ),
    "nested calls": (
        "#define F(x) x\nconst long N = " + "F(" * 200 + "1" + ")" * 200 + ";",
        "calls of macros nest deeper",
    ),
    "a call without end": (
        "#define F(x) x\nF(\n" + "1\n" * 11_000,
        "the arguments of a macro have more than 10000 tokens",
    ),
    "dimensions": ("struct A { long x" + "[1]" * DEEP + "; };", "an array has 16 dimensions at most"),
    "collections by typedef": (
        "typedef long T0;\n"
        + "".join(f"typedef sequence<T{n}> T{n + 1};\n" for n in range(13))
        + "struct A { T13 x; };",
        "sequences, arrays and maps nest deeper than 12",
    ),
    "typedefs of typedefs": (
        "typedef long T0;\n" + "".join(f"typedef T{n} T{n + 1};\n" for n in range(DEEP)),
        "typedefs follow each other through more than 100",
    ),
    "structs in structs": (
        "struct S0 { long x; };\n" + "".join(f"struct S{n + 1} {{ S{n} x; }};\n" for n in range(DEEP)),
        "types nest deeper than 100",
    ),
    "unions in sequences": (
        "struct S0 { long x; };\n"
        + "".join(f"union S{n + 1} switch (long) {{ case 1: sequence<S{n}> x; }};\n" for n in range(DEEP)),
        "types nest deeper than 100",
    ),
    "inherited members": (
        "struct A { "
        + "".join(f"long m{n}; " for n in range(1_000))
        + "};"
        + "".join(f"struct B{n} : A {{ long x; }};\n" for n in range(300)),
        "all structs together inherit more than 200000 members",
    ),
    "keylists": (
        "struct A { " + "".join(f"long m{n}; " for n in range(1_000)) + "};" + "\n#pragma keylist A m1" * 300,
        "all structs together inherit more than 200000 members",
    ),
    "a long number": ("const long N = " + "9" * 5_000 + ";", "is no number"),
    "a large shift": ("const long N = 1 << 1000000000000;", "shifts by 0 to 63 bits"),
    "many bases": (
        "struct S0 { long m0; };\n" + "".join(f"struct S{n + 1} : S{n} {{ long m{n + 1}; }};\n" for n in range(200)),
        "structs inherit through more than 100 others",
    ),
}


@pytest.mark.parametrize("name", HOSTILE)
def test_hostile_text_is_refused(name: str) -> None:
    text, reason = HOSTILE[name]
    with pytest.raises(idl.IdlError, match=reason):
        idl.loads(text)


def test_a_file_that_includes_itself_is_refused(tmp_path: Path) -> None:
    (tmp_path / "a.idl").write_text('#include "a.idl"')
    with pytest.raises(idl.IdlError, match="includes nest deeper than 32; does a file include itself"):
        idl.load(tmp_path / "a.idl")


def test_files_that_include_each_other_twice_are_refused(tmp_path: Path) -> None:
    """Sixteen levels, each including the next twice, would be 65,536 files."""
    for level in range(16):
        (tmp_path / f"{level}.idl").write_text(f'#include "{level + 1}.idl"\n' * 2)
    (tmp_path / "16.idl").write_text("")
    with pytest.raises(idl.IdlError, match="there are more than 2000 includes"):
        idl.load(tmp_path / "0.idl")


def test_included_files_are_bounded_in_octets(tmp_path: Path) -> None:
    (tmp_path / "blank.idl").write_text(" " * (1 << 21))
    (tmp_path / "a.idl").write_text('#include "blank.idl"\n' * 9)
    with pytest.raises(idl.IdlError, match="all included files together have more than 16777216 octets"):
        idl.load(tmp_path / "a.idl")


def test_what_nests_as_deep_as_it_may_works() -> None:
    """The bounds are such that codecs can be made, and values written and read."""
    text = "typedef long T0;\n" + "".join(f"typedef sequence<T{n}> T{n + 1};\n" for n in range(12))
    text += "struct S0 { T12 x; };\n" + "".join(f"struct S{n + 1} {{ S{n} x; }};\n" for n in range(99))
    types = idl.loads(text)
    deep: Any = [1]
    for _ in range(11):
        deep = [deep]
    value = types.S0(deep)
    for level in range(1, 100):
        value = getattr(types, f"S{level}")(value)
    assert deserialize(types.S99, serialize(value)) == value


@pytest.mark.parametrize("collections", [1, 3, 12])
def test_loops_are_bounded_in_generated_code(collections: int) -> None:
    """Python nests 20 of them: a struct that would add more becomes a function."""
    opening, closing = "sequence<" * collections, "> " * collections
    text = f"struct S0 {{ {opening}string{closing} x; }};"
    text += "".join(f"struct S{n + 1} {{ {opening}S{n}{closing} x; map<long, S{n}> y; }};" for n in range(6))
    types = idl.loads(text)

    def nested(value: Any) -> Any:
        for _ in range(collections):
            value = [value]
        return value

    sample = types.S0(nested("a"))
    for level in range(1, 7):
        sample = getattr(types, f"S{level}")(nested(sample), {1: sample})
    for representation in XCDR1, XCDR2:
        assert deserialize(types.S6, serialize(sample, representation=representation)) == sample


def test_long_flat_text_is_fine() -> None:
    """What is merely long goes through: sums, typedef chains, many types."""
    assert idl.loads("const long N = " + "1 + " * 20_000 + "1;").N == 20_001
    chain = "typedef long T0;\n" + "".join(f"typedef T{n} T{n + 1};\n" for n in range(99))
    types = idl.loads(chain + "// go on \\\n" * 2_000 + "\nstruct A { T99 x; };")
    assert "typedef int32 T0;" in idl.to_idl(types.A)
    many = idl.loads("".join(f"enum E{n} {{ L{n} }};\n" for n in range(300)))
    assert len(list(many)) == 300


_WORDS = st.sampled_from(
    [
        *KEYWORDS,
        *"<>{}()[];:,=@+-#",
        "::",
        "<<",
        "key",
        "id",
        "A",
        "B",
        "x",
        "1",
        "2.5",
        '"s"',
        "'c'",
        "\n",
        "#if",
        "#endif",
    ]
)


@settings(max_examples=300, deadline=None)
@given(st.lists(_WORDS, max_size=60).map(" ".join) | st.text(max_size=60))
def test_any_text_is_understood_or_refused(text: str) -> None:
    try:
        idl.loads(text)
    except idl.IdlError as error:
        refused = error
    else:
        return
    assert refused.line >= 1
    assert refused.column >= 1
