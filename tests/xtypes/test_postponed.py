"""Annotations that are evaluated late: as strings (PEP 563), quoted, in functions, or on demand (PEP 649)."""

from __future__ import annotations

import subprocess
import sys
import textwrap
from pathlib import Path

import pytest

from ddsi.xtypes import deserialize, idl, serialize, type_support

from .postponed_types import Kind, Labelled, Position, Tree

ROOT = Path(__file__).parent.parent.parent

UNPOSTPONED = textwrap.dedent("""
    from typing import Annotated
    from ddsi.xtypes import deserialize, idl, serialize

    def define():
        @idl.struct
        class Node:
            position: "Position"
            kids: idl.sequence["Node"]
            next: "Node | None" = None

        @idl.struct
        class Position:
            x: idl.int32
        return Node, Position

    Node, Position = define()
    node = Node(Position(1), [Node(Position(2), [])])
    assert deserialize(Node, serialize(node)) == node
""")

ALIASES = textwrap.dedent("""
    from typing import Annotated
    from ddsi.xtypes import deserialize, idl, serialize

    type Name = Annotated[str, idl.bound(8)]
    type Titled = Name
    type Few[T] = Annotated[idl.sequence[T], idl.bound(2)]

    @idl.struct
    class Book:
        title: Titled
        authors: Few[Name]
        years: Annotated[Few[idl.int16], idl.key]

    assert [str(m.type) for m in Book.__idl_struct__.members] == [
        "string<8>", "sequence<string<8>, 2>", "sequence<int16, 2>"
    ]
    book = Book("a", ["b"], [3])
    assert deserialize(Book, serialize(book)) == book
""")

DEFERRED = textwrap.dedent("""
    from ddsi.xtypes import deserialize, idl, serialize

    @idl.struct
    class Node:
        position: Position
        kids: idl.sequence[Node]

    @idl.struct
    class Position:
        x: idl.int32

    node = Node(Position(1), [Node(Position(2), [])])
    assert deserialize(Node, serialize(node)) == node
""")


def test_a_module_with_postponed_annotations() -> None:
    tree = Tree("root", Kind.BRANCH, Position(1, 2), [Tree("leaf", Kind.LEAF, Position(), [], "root")])
    assert deserialize(Tree, serialize(tree)) == tree
    assert type_support(Tree).is_keyed
    assert [member.name for member in type_support(Tree).struct.members][-1] == "parent_name"
    labelled = Labelled(1, 2, "here")
    assert deserialize(Labelled, serialize(labelled)) == labelled


def test_quoted_names_in_a_function() -> None:
    subprocess.run([sys.executable, "-c", UNPOSTPONED], cwd=ROOT, check=True, timeout=60)


@pytest.mark.skipif(sys.version_info < (3, 12), reason="PEP 695 came with Python 3.12")
def test_type_aliases() -> None:
    subprocess.run([sys.executable, "-c", ALIASES], cwd=ROOT, check=True, timeout=60)


@pytest.mark.skipif(sys.version_info < (3, 14), reason="PEP 649 came with Python 3.14")
def test_annotations_evaluated_on_demand() -> None:
    subprocess.run([sys.executable, "-c", DEFERRED], cwd=ROOT, check=True, timeout=60)


def test_what_a_function_holds_is_released_once_names_are_found() -> None:
    """The search for names keeps the frame of a function; not longer than needed."""
    import gc
    import weakref

    class Large:
        pass

    def define() -> tuple[type, weakref.ref[Large]]:
        large = Large()

        @idl.struct
        class Local:
            x: idl.int32

        return Local, weakref.ref(large)

    local, large = define()
    gc.collect()
    assert local(1).x == 1
    assert large() is None
