"""Types that differ: they are asked for, the match waits, and then what they are made of decides.  DDS-XTypes 7.6.3."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import pytest

from ddsi import idl
from ddsi.discovery.matching import RefusalKind
from ddsi.discovery.type_lookup import GetTypes, TypeLookupReply, TypeLookupRequest, decode_request, encode_request
from ddsi.engine.type_answers import MOST_UNACKNOWLEDGED
from ddsi.engine.type_quirks import has_new_kinds
from ddsi.engine.type_registry import TypeRegistry
from ddsi.simulation import Domain, LinkConditions, Node
from ddsi.structure import builtin_entity_ids as ids
from ddsi.structure.cache_change import CacheChange, ChangeKind
from ddsi.structure.errors import MalformedMessage
from ddsi.structure.guid import EntityId, Guid
from ddsi.structure.qos import Qos
from ddsi.structure.qos_policies import DataRepresentation, DataRepresentationId, Reliable, TypeConsistency
from ddsi.structure.status import InconsistentTopic
from ddsi.structure.vendor import CYCLONE
from ddsi.trace.events import TypesCompared
from ddsi.trace.reasons import DropReason, TypeStep
from ddsi.trace.sink import MemorySink
from ddsi.xtypes.type_object import HashIdentifier, TypeDescription, TypeInformation
from ddsi.xtypes.type_support import type_support

RELIABLE = Qos(reliability=Reliable())
XCDR1, XCDR2 = DataRepresentation(DataRepresentationId.XCDR1), DataRepresentation(DataRepresentationId.XCDR2)


@idl.struct
class Inner:
    x: idl.int32


@idl.struct
class Outer:
    inner: Inner


@idl.struct(typename="T")
class Old:
    outer: Outer


@idl.struct(typename="T")
class New:
    outer: Outer
    extra: str = ""


@idl.struct(typename="T")
class Other:
    outer: idl.sequence[Outer]


@idl.struct(typename="T", extensibility=idl.FINAL)
class Final:
    a: idl.int32
    b: str


@idl.struct(typename="T")
class Appendable:
    a: idl.int32
    b: str


def struct_of(name: str, members: dict[str, Any]) -> type[Any]:
    return idl.struct(typename=name)(type(name, (), {"__annotations__": members}))


def of(class_: type[Any]) -> TypeDescription:
    return type_support(class_).type_description


def unlisted(types: TypeDescription) -> TypeDescription:
    """As OpenDDS announces them: without saying what the type needs."""
    information = types.information
    return replace(
        types,
        information=TypeInformation(
            replace(information.minimal_types, dependency_count=-1, dependencies=()),
            replace(information.complete_types, dependency_count=-1, dependencies=()),
        ),
    )


class Two:
    """A writer here and a reader there."""

    def __init__(
        self,
        written: TypeDescription | None,
        read: TypeDescription | None,
        *,
        seed: int = 0,
        loss: float = 0.0,
        writer_qos: Qos = RELIABLE,
        reader_qos: Qos = RELIABLE,
        names: tuple[str, str] = ("T", "T"),
        prepare: Callable[[Node, Node], None] = lambda here, there: None,
    ) -> None:
        self.domain = Domain(seed, conditions=LinkConditions(loss=loss))
        self.here, self.there = self.domain.node(), self.domain.node()
        prepare(self.here, self.there)
        self.writer = self.here.writer("Square", writer_qos, types=written, type_name=names[0])
        self.reader = self.there.reader("Square", reader_qos, types=read, type_name=names[1])

    @property
    def is_matched(self) -> bool:
        """Both sides."""
        return bool(self.writer.local.behavior.readers) and bool(self.reader.local.behavior.writers)

    def questions(self, of: Node) -> int:
        writer = of.engine.builtin.writer(ids.TYPE_LOOKUP_REQUEST_WRITER)
        assert writer is not None
        return writer.behavior.cache.last_sn


def test_equal_types_match_without_a_question() -> None:
    two = Two(of(Old), of(Old))
    assert two.domain.run_until(lambda: two.is_matched, 2)
    assert two.questions(two.here) == two.questions(two.there) == 0


@pytest.mark.parametrize(("written", "read"), [(New, Old), (Old, New)])
def test_a_type_that_grew_matches_when_it_is_known(written: type[Any], read: type[Any]) -> None:
    """What both need is known already, so each side asks for one TypeObject."""
    two = Two(of(written), of(read))
    assert two.domain.run_until(lambda: two.is_matched, 2)
    assert (two.questions(two.here), two.questions(two.there)) == (1, 1)


def test_names_mean_nothing_where_types_are_known() -> None:
    two = Two(of(New), of(Old), names=("a::T", "b::T"))
    assert two.domain.run_until(lambda: two.is_matched, 2)


@pytest.mark.parametrize("seed", range(25))
def test_it_matches_over_a_bad_network(seed: int) -> None:
    two = Two(of(New), of(Old), seed=seed, loss=0.3)
    assert two.domain.run_until(lambda: two.is_matched, 60)


def test_a_mismatch_names_the_member_on_both_sides() -> None:
    two = Two(of(New), of(Other))
    two.domain.run(2)
    assert not two.is_matched
    for node, local, remote in (
        (two.here, two.writer.local, two.reader.local),
        (two.there, two.reader.local, two.writer.local),
    ):
        refusal = node.engine.matchmaker.refusals[local.guid, remote.guid]
        assert refusal.kind is RefusalKind.TYPE
        assert refusal.detail == "outer: a sequence in the reader's type, a struct Outer in the writer's"
        (status,) = [status for _, _, status in node.statuses if isinstance(status, InconsistentTopic)]
        assert status.reason == refusal.detail


@pytest.mark.parametrize(
    ("consistency", "fits"),
    [
        (TypeConsistency(), True),
        (TypeConsistency(prevent_type_widening=True), False),
        (TypeConsistency(kind=TypeConsistency.DISALLOW_TYPE_COERCION), False),
        (TypeConsistency(force_type_validation=True), True),
    ],
)
def test_the_readers_policy_decides(consistency: TypeConsistency, *, fits: bool) -> None:
    """The reader's type has a member that the writer's lacks."""
    two = Two(of(Old), of(New), reader_qos=RELIABLE | Qos(type_consistency=consistency))
    two.domain.run(2)
    assert two.is_matched == fits


# --- without type information -------------------------------------------------------------------------------------


@pytest.mark.parametrize(("written", "read"), [(Old, None), (None, Other)])
def test_names_decide_where_one_side_announces_no_types(written: type[Any] | None, read: type[Any] | None) -> None:
    described = [of(one) if one is not None else None for one in (written, read)]
    two = Two(*described)
    assert two.domain.run_until(lambda: two.is_matched, 2)
    other = Two(*described, names=("T", "U"))
    other.domain.run(2)
    assert not other.is_matched


@pytest.mark.parametrize("written", [Old, None])
def test_a_reader_may_insist_on_types(written: type[Any] | None) -> None:
    insisting = RELIABLE | Qos(type_consistency=TypeConsistency(force_type_validation=True))
    two = Two(of(written) if written else None, None, reader_qos=insisting)
    two.domain.run(2)
    assert not two.is_matched
    refusal = two.there.engine.matchmaker.refusals[two.reader.local.guid, two.writer.local.guid]
    assert "insists on validation" in refusal.detail


def _silent(here: Node, there: Node) -> None:
    """Nobody answers questions about types."""
    for node in (here, there):
        node.engine.builtin._takers[ids.TYPE_LOOKUP_REQUEST_READER] = lambda change, now: None


def _forgetful(here: Node, there: Node) -> None:
    """Everybody answers that there is no such type."""
    for node in (here, there):
        node.engine.types.registry.own_octets = lambda identifier: None  # type: ignore[method-assign]


@pytest.mark.parametrize(("prepare", "seconds"), [(_silent, 4.0), (_forgetful, 1.0)])
def test_names_decide_where_types_cannot_be_had(prepare: Callable[[Node, Node], None], seconds: float) -> None:
    two = Two(of(New), of(Other), prepare=prepare)
    assert two.domain.run_until(lambda: two.is_matched, seconds)
    two.domain.run(20)
    assert two.questions(two.here) <= 3, "nobody is asked for ever"
    insisting = RELIABLE | Qos(type_consistency=TypeConsistency(force_type_validation=True))
    other = Two(of(New), of(Old), prepare=prepare, reader_qos=insisting)
    other.domain.run(10)
    assert not other.is_matched


def test_one_that_comes_late_waits_anew_and_one_that_leaves_is_forgotten() -> None:
    two = Two(of(New), of(Old), prepare=_silent)
    two.domain.run(1)
    assert not two.is_matched
    two.here.kill()
    assert two.domain.run_until(lambda: not two.there.engine.participants, 60)
    assert not two.there.engine.type_matching.waiting_for(two.here.engine.guid.prefix)


# --- what a type needs ----------------------------------------------------------------------------------------------


def fetched(two: Two, types: TypeDescription) -> tuple[str, ...]:
    """Have the reader's side fetch all of the writer's complete types; returns their names in order."""
    engine, found = two.there.engine, []

    def ask() -> bool:
        answer = engine.types.fetch_all(two.writer.local.guid, types.complete.root, types.information, two.there.now)
        two.there.pump()
        assert not isinstance(answer, str), answer
        found.append(answer)
        return answer is not None

    assert two.domain.run_until(ask, 5)
    answer = found[-1]
    assert answer is not None
    return tuple(type_object.body.type_name for type_object in answer.objects.values())  # type: ignore[union-attr]


def test_all_that_a_type_needs_is_asked_for_at_once_where_it_is_listed() -> None:
    two = Two(of(New), None)
    two.domain.run(1)
    assert fetched(two, of(New)) == ("T", "Outer", "Inner")
    assert two.questions(two.there) == 1


def test_what_is_not_listed_is_asked_for_first() -> None:
    two = Two(unlisted(of(New)), None)
    two.domain.run(1)
    assert fetched(two, unlisted(of(New))) == ("T", "Outer", "Inner")
    assert two.questions(two.there) == 2, "what it needs, and all of that"


def test_a_server_that_lists_nothing_is_asked_level_by_level() -> None:
    def silent_about_lists(here: Node, there: Node) -> None:
        answer = here.engine.types.receive_request

        def only_types(change: CacheChange, now: float) -> None:
            if isinstance(decode_request(change.payload).call, GetTypes):
                answer(change, now, is_secure=False)

        here.engine.builtin._takers[ids.TYPE_LOOKUP_REQUEST_READER] = only_types

    two = Two(unlisted(of(New)), None, prepare=silent_about_lists)
    two.domain.run(1)
    assert fetched(two, unlisted(of(New))) == ("T", "Outer", "Inner")


def test_a_long_list_comes_in_parts() -> None:
    wide = struct_of("Wide", {f"m{number}": struct_of(f"P{number}", {"x": idl.int32}) for number in range(600)})
    two = Two(unlisted(of(wide)), None)
    two.domain.run(1)
    assert len(fetched(two, unlisted(of(wide)))) == 601
    # Three pages of 256, and questions for 64 types each.
    assert two.questions(two.there) == 3 + 10


# --- final and appendable -------------------------------------------------------------------------------------------


@pytest.mark.parametrize(("written", "read"), [(Final, Appendable), (Appendable, Final)])
def test_final_and_appendable_of_one_name_match_in_xcdr1_and_say_so(written: type[Any], read: type[Any]) -> None:
    """The compilers of vendors differ in what IDL without annotations is; by name such pairs always matched."""
    two = Two(of(written), of(read), writer_qos=RELIABLE | Qos(data_representation=XCDR1))
    assert two.domain.run_until(lambda: two.is_matched, 3)
    two.domain.run(3)
    assert two.is_matched
    # Each says no more what its type is made of, so that a peer that is strict goes by the name too.
    assert two.writer.local.data.type_information == two.reader.local.data.type_information == b""
    assert [data.type_information for data in two.there.engine.known_writers.all()] == [b""]
    two.writer.write()
    assert two.domain.run_until(lambda: len(two.reader.taken) == 1, 5)


def test_final_and_appendable_do_not_match_in_xcdr2_or_under_other_names() -> None:
    """In XCDR2 they are written differently."""
    offering = RELIABLE | Qos(data_representation=XCDR2)
    for other in (
        Two(of(Final), of(Appendable), writer_qos=offering, reader_qos=offering),
        Two(of(Final), of(Appendable), names=("T", "U"), writer_qos=RELIABLE | Qos(data_representation=XCDR1)),
    ):
        other.domain.run(3)
        refusal = other.there.engine.matchmaker.refusals[other.reader.local.guid, other.writer.local.guid]
        assert refusal.detail == "appendable for the reader, final for the writer"


# --- peers that cannot read all -------------------------------------------------------------------------------------


@idl.struct(typename="T")
class Modern:
    outer: Outer
    small: idl.sequence[idl.uint8]


def test_a_peer_that_new_kinds_of_types_would_end_is_not_told_them_and_matches_by_name() -> None:
    """Cyclone DDS 0.10 takes no TypeObject with an int8, a uint8 or a wstring."""
    two = Two(None, None)
    two.domain.run(1)
    proxy = two.here.engine.participants[two.there.engine.guid.prefix]
    proxy.data = replace(proxy.data, vendor_id=CYCLONE, protocol_version=(2, 1))
    writer = two.here.writer("Triangle", RELIABLE, types=of(Modern))
    reader = two.there.reader("Triangle", RELIABLE, types=of(Other))
    assert two.domain.run_until(lambda: bool(reader.local.behavior.writers), 5)
    assert writer.local.data.type_information == b""
    prefix = two.here.engine.guid.prefix
    known = two.there.engine.types.registry.known_to(prefix)
    assert not [one for one in known.values() if has_new_kinds(one)]
    # Types without these go by what they are made of.
    two.here.writer("Circle", RELIABLE, types=of(New))
    circle = two.there.reader("Circle", RELIABLE, types=of(Old))
    assert two.domain.run_until(lambda: bool(circle.local.behavior.writers), 5)
    assert known[of(New).minimal.root] is not None


# --- strangers ------------------------------------------------------------------------------------------------------


def change_of(node: Node, payload: bytes) -> CacheChange:
    writer = Guid.of(node.engine.guid.prefix, ids.TYPE_LOOKUP_REQUEST_WRITER)
    return CacheChange(ChangeKind.ALIVE, writer, 1, payload)


def test_who_acknowledges_nothing_gets_few_answers() -> None:
    two = Two(of(New), None)
    two.domain.run(1)
    engine = two.here.engine
    asker = Guid.of(two.there.engine.guid.prefix, ids.TYPE_LOOKUP_REQUEST_WRITER)
    payload = encode_request(TypeLookupRequest((asker, 1), "", GetTypes((of(New).complete.root,))))
    two.domain.network.unplug(two.there.host)
    for _ in range(100):
        engine.types.receive_request(change_of(two.there, payload), two.here.now, is_secure=False)
    writer = engine.builtin.writer(ids.TYPE_LOOKUP_REPLY_WRITER)
    assert writer is not None
    assert writer.behavior.cache.last_sn == MOST_UNACKNOWLEDGED
    assert engine.drops[DropReason.RATE_LIMITED] == 100 - MOST_UNACKNOWLEDGED


def test_no_questions_and_no_answers_are_counted() -> None:
    two = Two(of(New), None)
    two.domain.run(1)
    engine = two.here.engine
    for octets in (b"", REQUEST_OF_CYCLONE_0_10[:40]):
        engine.types.receive_request(change_of(two.there, octets), two.here.now, is_secure=False)
    for octets in (b"", REQUEST_OF_CYCLONE_0_10[:20]):
        engine.types.receive_reply(change_of(two.there, octets), two.here.now)
    assert engine.drops[DropReason.MALFORMED_DISCOVERY_DATA] == 4


# Recorded: Cyclone DDS 0.10.2 swaps the octets of its Guid in questions, and in answers it names its own writer.
REQUEST_OF_CYCLONE_0_10 = bytes.fromhex(
    "00070001fb551001d09850e5a10f7f55c30003000000000001000000310000006464732e6275696c74696e2e544f532e30316464333161346338"
    "356337393433656430303137643230303030303163310000000023000000d35282011b0000006560535c1300000001000000f15512241c763cae"
    "693231c394612900"
)


def test_a_guid_with_swapped_octets_gets_its_answer_and_its_answer_is_taken() -> None:
    """Who asks is known from the message, and types are known by their hashes."""

    def swap(here: Node, there: Node) -> None:
        answer = here.engine.types._answers._answer

        def swapped(writer_id: EntityId, prefix: bytes, reply: TypeLookupReply, now: float) -> None:
            own = Guid.of(here.engine.guid.prefix[::-1], ids.TYPE_LOOKUP_REPLY_WRITER)
            answer(writer_id, prefix, replace(reply, request_id=(own, 7)), now)

        here.engine.types._answers._answer = swapped  # type: ignore[method-assign]

    two = Two(of(New), of(Old), prepare=swap)
    assert two.domain.run_until(lambda: two.is_matched, 2)
    two.here.engine.types.receive_request(change_of(two.there, REQUEST_OF_CYCLONE_0_10), two.here.now, is_secure=False)
    writer = two.here.engine.builtin.writer(ids.TYPE_LOOKUP_REPLY_WRITER)
    assert writer is not None
    assert writer.behavior.cache.last_sn == 2


def test_a_type_is_taken_under_its_own_hash_alone() -> None:
    registry, types = TypeRegistry(), of(Old)
    root, octets = types.complete.root, types.complete.octets[types.complete.root]
    assert isinstance(root, HashIdentifier)
    for wrong in (HashIdentifier(root.kind, bytes(14)), HashIdentifier(0xF1, root.hash)):
        with pytest.raises(MalformedMessage):
            registry.add(bytes(12), wrong, octets)
    registry.add(bytes(12), root, octets)
    assert registry.known_to(b"anybody") == {root: types.complete.objects[root]}
    assert registry.own_octets(root) is None, "what others say is passed on to nobody"


def test_the_types_of_peers_have_a_bound() -> None:
    registry = TypeRegistry()
    for number in range(9000):
        types = of(struct_of(f"N{number}", {"x": idl.int32})).complete
        registry.add(bytes(12), types.root, types.octets[types.root])
        if number > 8300:
            break
    assert len(registry.known_to(b"")) == 8192


def test_a_trace_tells_what_became_of_types() -> None:
    trace = MemorySink()
    domain = Domain(trace=trace)
    writer = domain.node().writer("Square", RELIABLE, types=of(New))
    domain.node().reader("Square", RELIABLE, types=of(Old))
    domain.run(2)
    told = [event for event in trace.events if isinstance(event, TypesCompared) and event.local == writer.guid]
    assert [event.step for event in told] == [TypeStep.AWAITED, TypeStep.ASSIGNABLE]
