"""``//@key`` and its like behind members and types, as older IDL for RTI Connext has them."""

from __future__ import annotations

from pathlib import Path

import pytest

from ddsi import idl

OLD = """
struct Position {
  double x;
  double y;
}; //@top-level false

#define SPEED double
struct Track {
  long id; //@key
  string<8> site;   //@key  and of the site
#ifdef MORE
  long more; //@key
#endif
  SPEED speed; //@Optional
               //@ID 20
  Position at; //@copy nothing
}; //@Extensibility MUTABLE_EXTENSIBILITY
"""
NEW = """
@nested
struct Position {
  double x;
  double y;
};

@mutable
struct Track {
  @key long id;
  @key string<8> site;
  @optional @id(20) double speed;
  Position at;
};
"""


def test_old_and_new_words_make_the_same_type() -> None:
    old, new = idl.loads(OLD), idl.loads(NEW)
    assert old.idl_warnings == new.idl_warnings == ()
    assert idl.to_idl(old.Track) == idl.to_idl(new.Track)
    assert "@key long id" in idl.to_idl(old.Track).replace("int32", "long")


def test_all_that_a_line_declares_is_key() -> None:
    assert idl.to_idl(idl.loads("struct A { long x, y; //@key\n long z; };").A).count("@key") == 2


@pytest.mark.parametrize(
    "text",
    [
        "struct A { long x; // @key\n };",
        "struct A { long x; //@Key\n };",
        "struct A { long x; /*@key*/ };",
        "struct A { long x //@key\n; };",
        "struct A { //@key\n long x; };",
        "//@key\nstruct A { long x; };",
        "struct A { long x; //@ID many\n };",
    ],
)
def test_what_is_said_otherwise_is_a_comment(text: str) -> None:
    types = idl.loads(text)
    assert idl.to_idl(types.A) == idl.to_idl(idl.loads("struct A { long x; };").A)
    assert types.idl_warnings == ()


def test_in_a_file_with_annotations_it_is_a_comment_and_warned_of() -> None:
    types = idl.loads("@final struct A {\n  long x; //@key\n};")
    assert "@key" not in idl.to_idl(types.A)
    (warning,) = types.idl_warnings
    assert str(warning) == (
        "<text>:2:11: //@key is a comment in a file with annotations; write @key before what it is about"
    )


def test_who_says_it_twice_for_two_compilers_is_not_warned() -> None:
    types = idl.loads("struct A { @key long x; //@key\n };")
    assert idl.to_idl(types.A).count("@key") == 1
    assert types.idl_warnings == ()


def test_each_file_has_its_own_words(tmp_path: Path) -> None:
    (tmp_path / "old.idl").write_text("struct Old { long x; //@key\n };")
    (tmp_path / "new.idl").write_text('#include "old.idl"\n@final struct New { @key Old x; };')
    types = idl.load(tmp_path / "new.idl")
    assert types.idl_warnings == ()
    assert "@key" in idl.to_idl(types.Old)
