"""TypeIdentifiers, TypeObjects and TypeInformation are, octet for octet, those of a real peer."""

from __future__ import annotations

from typing import Annotated, Any

import pytest

import ddsi
from ddsi.structure.builtin_entity_ids import SEDP_PUBLICATIONS_WRITER, SEDP_SUBSCRIPTIONS_WRITER
from ddsi.structure.errors import BadParameter
from ddsi.xtypes.definition import struct_type
from ddsi.xtypes.type_object import (
    BuiltTypes,
    ComponentIdentifier,
    decode_type_information,
    decode_type_object,
    describe,
    encode_identifier,
)
from ddsi.xtypes.type_object.objects import StructObject
from tests.discovery.test_captured import endpoints
from tests.xtypes.vector_types import S01, S09, S33, S07Color

from .vectors import VECTORS, compiled

by_name = pytest.mark.parametrize("vector", VECTORS, ids=[vector["name"] for vector in VECTORS])
by_kind = pytest.mark.parametrize("kind", ["minimal", "complete"])


def built(type_: type[Any], kind: str) -> BuiltTypes:
    description = describe(struct_type(type_))
    return description.minimal if kind == "minimal" else description.complete


def test_every_vector_is_driven() -> None:
    assert len(VECTORS) == 37
    assert sum("type_objects_minimal" in vector for vector in VECTORS) == 33
    assert sum("type_mapping" in vector for vector in VECTORS) == 4


@by_kind
@by_name
def test_the_identifier_is_the_peers(vector: dict[str, Any], kind: str) -> None:
    types = built(compiled(vector), kind)
    assert encode_identifier(types.root).hex() == vector[f"type_identifier_{kind}"]
    assert len(types.octets[types.root]) == vector[f"type_object_{kind}_size"]


@by_kind
@by_name
def test_every_type_object_is_the_peers(vector: dict[str, Any], kind: str) -> None:
    octets = {encode_identifier(identifier).hex(): text.hex() for identifier, text in built_octets(vector, kind)}
    if "type_mapping" in vector:  # one sequence of all pairs, each at its own alignment
        assert all(identifier in vector["type_mapping"] for identifier in octets)
        assert all(text in vector["type_mapping"] for text in octets.values())
    else:
        assert octets == vector[f"type_objects_{kind}"]


def built_octets(vector: dict[str, Any], kind: str) -> Any:
    return built(compiled(vector), kind).octets.items()


@by_name
def test_the_type_information_is_what_the_peer_announces(vector: dict[str, Any]) -> None:
    assert ddsi.type_information(compiled(vector)).encode().hex() == vector["type_information"]


def test_types_written_in_python_are_the_same_types() -> None:
    information = ddsi.type_information(S01)
    assert information.minimal.hex() == "a512f395e2bab0b9fc838e086e2c"
    assert information.complete.hex() == "773207fb72386e0ddb0e1a2b4fbe"
    assert repr(information.minimal) == "<minimal a512f395e2bab0b9fc838e086e2c>"


def test_a_type_without_typedefs_is_recursive_by_itself_alone() -> None:
    minimal = ddsi.type_information(S33).minimal
    assert isinstance(minimal, ComponentIdentifier)
    assert (minimal.length, minimal.index) == (1, 1)
    assert ddsi.type_information(S33).minimal_types.dependencies == ()


def test_the_names_of_members_are_those_in_idl() -> None:
    @ddsi.idl.struct(typename="T")
    class One:
        from_: Annotated[ddsi.idl.int32, ddsi.idl.name("from")]

    @ddsi.idl.struct(typename="T")
    class Other:
        origin: Annotated[ddsi.idl.int32, ddsi.idl.name("from")]

    assert ddsi.type_information(One) == ddsi.type_information(Other)


def test_what_is_no_topic_type_is_refused() -> None:
    with pytest.raises(BadParameter, match="int does not say its width"):
        ddsi.type_information(int)
    with pytest.raises(BadParameter, match="S07Color is no topic type"):
        ddsi.type_information(S07Color)


def test_names_that_are_not_defined_are_refused() -> None:
    @ddsi.idl.struct
    class Lost:
        x: Nowhere  # type: ignore[name-defined]  # noqa: F821

    with pytest.raises(BadParameter, match="Lost: an annotation cannot be resolved: name 'Nowhere'"):
        ddsi.type_information(Lost)


def test_each_type_is_listed_once_and_not_among_its_own_dependencies() -> None:
    types = ddsi.type_information(S09).minimal_types
    assert types.dependency_count == len(types.dependencies) == 4
    assert types.type not in types.dependencies


# --- what the generator of an older release makes, of declarations that the vectors lack ---------------------------

IDLC_IDL = """
module m {
  typedef long Num;
  typedef Num Row[4];
  @final @nested struct P { @external @optional Num x; @hashid long y; @hashid("foo") long z; };
  @mutable @autoid(HASH) struct Base { string<300> name; };
  @appendable @autoid(HASH) union V switch (char) {
    case 'a': @id(7) P p; case 'b': @hashid double d; default: octet o;
  };
  @mutable struct D : Base { sequence<sequence<P, 3> > nested; Row rows[3]; char c; V v; double matrix[2][300]; };
};
"""

IDLC_INFORMATION = (
    "5001000001100040a00000009c00000014000000f14c32dc833f638523979628d64bd100c5000000050000007c00000005000000"
    "14000000f11af938ad4ad69c621101b903825a002c00000014000000f1858f990dffdfaae124ea45dc0efe005700000014000000"
    "f18ea97f4529a6c07cb8096e567bd3001300000014000000f137bb645d5c31bf8dfb3894882c3e002c00000014000000f152651e"
    "34af13eb9c50cc1bf0fe8d007000000002100040a00000009c00000014000000f22420bfc903b9b1d178724cbca5fe00fd000000"
    "050000007c0000000500000014000000f2c11a1ffe502cac115262282a663e003f00000014000000f2303e2c1a52273a143848f5"
    "2467fa009100000014000000f211354bb72a1aefc288e559d1a1ab002500000014000000f2c51c931a48cfb170d2a22333c8ed00"
    "3e00000014000000f2344655a63a5d292cb5c2892ca6a800a0000000"
)
"""Of m::D, by idlc of Cyclone DDS 0.10.2 (Debian); it hashes every TypeObject that is needed."""


def test_hashed_ids_nested_collections_and_arrays_of_typedefs_are_the_peers() -> None:
    namespace: Any = ddsi.idl.loads(IDLC_IDL)
    assert ddsi.type_information(namespace.m.D).encode().hex() == IDLC_INFORMATION


def test_what_hashid_was_given_is_told() -> None:
    namespace: Any = ddsi.idl.loads(IDLC_IDL)
    types = describe(struct_type(namespace.m.P)).complete
    written, read = types.objects[types.root].body, decode_type_object(types.octets[types.root]).body
    assert isinstance(written, StructObject)
    assert isinstance(read, StructObject)
    assert [member.hash_name for member in written.members] == [None, "", "foo"]
    assert read.members == written.members


def test_enums_and_bitmasks_may_be_appendable() -> None:
    """The hashes are those of cyclonedds-python 11.0.1.  Where nothing is said both are final to it."""
    namespace: Any = ddsi.idl.loads(
        "@appendable enum E { A, B, @value(9) C };"
        "@appendable @bit_bound(8) bitmask M { F, @position(5) G }; @final struct T { E e; M m; };"
    )
    ours = ddsi.type_information(namespace.T)
    assert (ours.minimal.hex(), ours.complete.hex()) == ("507eaba2dc18a023fa488f2ff29b", "ce554f0c69eff9b7f62292e8c61c")
    again = ddsi.dynamic_type(ddsi.type_objects(namespace.T))
    assert ddsi.type_information(again).complete == ours.complete
    said = ddsi.idl.loads(ddsi.idl.to_idl(again))
    assert ddsi.type_information(said.T).complete == ours.complete
    final: Any = ddsi.idl.loads("enum E { A }; bitmask M { F }; struct T { E e; M m; };")
    marked: Any = ddsi.idl.loads("@final enum E { A }; @final bitmask M { F }; struct T { E e; M m; };")
    assert ddsi.type_information(final.T).complete == ddsi.type_information(marked.T).complete


# --- on the wire -----------------------------------------------------------------------------------------------------

FINAL_SHAPE = "@final struct ShapeType { @key string<128> color; long x; long y; long shapesize; };"


def test_a_recorded_peer_announces_the_identifiers_that_we_make() -> None:
    """cyclonedds-python 11.0.1, which leaves the sizes out."""
    namespace: Any = ddsi.idl.loads(FINAL_SHAPE)
    ours = ddsi.type_information(namespace.ShapeType)
    announced = [
        decode_type_information(data.type_information)
        for name in ("cyclone11-discovery", "cyclone11-late-joiner", "cyclone11-unicast")
        for writer_id in (SEDP_PUBLICATIONS_WRITER, SEDP_SUBSCRIPTIONS_WRITER)
        for data in endpoints(name, writer_id)
        if data.type_information
    ]
    assert len(announced) >= 3
    for theirs in announced:
        assert (theirs.minimal, theirs.complete) == (ours.minimal, ours.complete)
        assert theirs.minimal_types.type.size == 0
