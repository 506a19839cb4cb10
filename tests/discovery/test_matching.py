"""Who fits whom: every policy that is requested and offered, with the reason of each refusal as a value."""

from __future__ import annotations

import fnmatch
import math
import time

import pytest
from hypothesis import given
from hypothesis import strategies as st

from ddsi.discovery.matching import MatchRefusal, RefusalKind, incompatibilities, judge, partitions_match
from ddsi.structure.discovered import DiscoveredReaderData, DiscoveredWriterData
from ddsi.structure.guid import EntityId, EntityKind, Guid
from ddsi.structure.qos import Qos, reader_qos, writer_qos
from ddsi.structure.qos_policies import (
    AccessScope,
    Automatic,
    BestEffort,
    ByReceptionTimestamp,
    BySourceTimestamp,
    DataRepresentation,
    DataRepresentationId,
    Deadline,
    Durability,
    Exclusive,
    KeepAll,
    KeepLast,
    LatencyBudget,
    Lifespan,
    Liveliness,
    ManualByParticipant,
    ManualByTopic,
    OwnershipStrength,
    Partition,
    Persistent,
    Presentation,
    Reliable,
    ResourceLimits,
    Shared,
    TimeBasedFilter,
    Transient,
    TransientLocal,
    TransportPriority,
    UserData,
    Volatile,
)

XCDR1, XCDR2, XML = DataRepresentationId.XCDR1, DataRepresentationId.XCDR2, DataRepresentationId.XML


def writer(qos: Qos = Qos(), *, type_name: str = "T", keyed: bool = False) -> DiscoveredWriterData:
    kind = EntityKind.WRITER_WITH_KEY if keyed else EntityKind.WRITER_NO_KEY
    guid = Guid.of(b"w" * 12, EntityId.user(1, kind))
    return DiscoveredWriterData(guid=guid, topic_name="t", type_name=type_name, qos=writer_qos(qos))


def reader(qos: Qos = Qos(), *, type_name: str = "T", keyed: bool = False) -> DiscoveredReaderData:
    kind = EntityKind.READER_WITH_KEY if keyed else EntityKind.READER_NO_KEY
    guid = Guid.of(b"r" * 12, EntityId.user(1, kind))
    return DiscoveredReaderData(guid=guid, topic_name="t", type_name=type_name, qos=reader_qos(qos))


def fits(offered: Qos, requested: Qos) -> bool:
    return judge(writer(offered), reader(requested)) is None


def scope(access_scope: AccessScope, *, coherent: bool = False, ordered: bool = False) -> Presentation:
    return Presentation(access_scope, coherent, ordered)


INSTANCE, TOPIC, GROUP = AccessScope.INSTANCE, AccessScope.TOPIC, AccessScope.GROUP

# Policy: what can be offered, what can be requested, and for which of these pairs (by index) they do not fit.
_DURABILITIES: list[Durability] = [Volatile(), TransientLocal(), Transient(), Persistent()]
_PRESENTATIONS = [
    scope(INSTANCE),
    scope(TOPIC),
    scope(GROUP),
    scope(INSTANCE, coherent=True),
    scope(INSTANCE, ordered=True),
    scope(TOPIC, coherent=True, ordered=True),
]
_LIVELINESSES: list[Liveliness] = [Automatic(), ManualByParticipant(), ManualByTopic()]
TABLE: list[tuple[str, int, list[Qos], list[tuple[int, int]]]] = [
    ("reliability", 11, [Qos(reliability=kind) for kind in (BestEffort(), Reliable())], [(0, 1)]),
    (
        "durability",
        2,
        [Qos(durability=kind) for kind in _DURABILITIES],
        [(0, 1), (0, 2), (0, 3), (1, 2), (1, 3), (2, 3)],
    ),
    (
        "presentation",
        3,
        [Qos(presentation=value) for value in _PRESENTATIONS],
        [
            *[(0, 1), (0, 2), (0, 3), (0, 4), (0, 5)],  # a scope, coherent or ordered where nothing is offered
            *[(1, 2), (1, 3), (1, 4), (1, 5)],  # the wider scope does not make it coherent or ordered
            *[(2, 3), (2, 4), (2, 5)],
            *[(3, 1), (3, 2), (3, 4), (3, 5)],
            *[(4, 1), (4, 2), (4, 3), (4, 5)],
            *[(5, 2)],
        ],
    ),
    (
        "deadline",
        4,
        [Qos(deadline=Deadline(period)) for period in (0.1, 1, math.inf)],
        [(1, 0), (2, 0), (2, 1)],  # offered must not be longer
    ),
    (
        "latency_budget",
        5,
        [Qos(latency_budget=LatencyBudget(duration)) for duration in (0.0, 0.5, math.inf)],
        [(1, 0), (2, 0), (2, 1)],
    ),
    ("ownership", 6, [Qos(ownership=kind) for kind in (Shared(), Exclusive())], [(0, 1), (1, 0)]),
    ("liveliness", 8, [Qos(liveliness=kind) for kind in _LIVELINESSES], [(0, 1), (0, 2), (1, 2)]),
    (
        "liveliness",
        8,
        [Qos(liveliness=Automatic(lease)) for lease in (1, 2, math.inf)],
        [(1, 0), (2, 0), (2, 1)],
    ),
    (
        "destination_order",
        12,
        [Qos(destination_order=kind) for kind in (ByReceptionTimestamp(), BySourceTimestamp())],
        [(0, 1)],
    ),
    (
        "data_representation",
        23,
        [
            Qos(data_representation=DataRepresentation(*ids))
            for ids in ((), (XCDR1,), (XCDR2,), (XCDR1, XCDR2), (XCDR2, XCDR1))
        ],
        # Nothing said is XCDR1 alone; the writer uses the first that it offers.
        [(0, 2), (1, 2), (3, 2), (2, 0), (2, 1), (4, 0), (4, 1)],
    ),
]


@pytest.mark.parametrize(("policy", "policy_id", "values", "refused"), TABLE, ids=[row[0] for row in TABLE])
def test_every_policy_with_every_pair_of_values(
    policy: str, policy_id: int, values: list[Qos], refused: list[tuple[int, int]]
) -> None:
    for i, offered in enumerate(values):
        for j, requested in enumerate(values):
            refusal = judge(writer(offered), reader(requested))
            if (i, j) not in refused:
                assert refusal is None, f"{offered} for {requested}: {refusal}"
                continue
            assert refusal is not None, f"{offered} for {requested}"
            assert refusal.kind is RefusalKind.QOS
            (reason,) = refusal.incompatibilities
            assert (reason.policy, reason.policy_id) == (policy, policy_id)
            assert reason.offered
            assert reason.offered != reason.requested
            assert str(refusal) == f"{policy}: offered {reason.offered}, requested {reason.requested}"


def test_reasons_name_both_values() -> None:
    (kinds,) = incompatibilities(writer(Qos(durability=Volatile())), reader(Qos(durability=Persistent())))
    assert (kinds.offered, kinds.requested) == ("Volatile", "Persistent")
    (values,) = incompatibilities(writer(Qos(deadline=Deadline(2.0))), reader(Qos(deadline=Deadline(0.5))))
    assert (values.offered, values.requested) == ("Deadline(period=2.0)", "Deadline(period=0.5)")
    (lists,) = incompatibilities(
        writer(Qos(data_representation=DataRepresentation(XML))),
        reader(Qos(data_representation=DataRepresentation(XCDR2, XCDR1))),
    )
    assert (lists.offered, lists.requested) == ("XML", "XCDR2 or XCDR1")


def test_all_reasons_are_named_the_first_as_others_report_it() -> None:
    """In the order in which Cyclone DDS compares, so that last_policy_id agrees with the peer's."""
    refusal = judge(
        writer(Qos(reliability=BestEffort(), ownership=Exclusive())),
        reader(Qos(reliability=Reliable(), ownership=Shared(), durability=TransientLocal(), deadline=Deadline(1))),
    )
    assert refusal is not None
    assert [reason.policy for reason in refusal.incompatibilities] == [
        "reliability", "durability", "deadline", "ownership",
    ]  # fmt: skip
    assert str(refusal).count(";") == 3


def test_what_is_never_compared_never_keeps_two_apart() -> None:
    """DDS 1.4 §2.2.3: the policies without RxO."""
    offered = Qos(
        history=KeepLast(1), lifespan=Lifespan(1), ownership_strength=OwnershipStrength(5), user_data=UserData(b"a"),
        transport_priority=TransportPriority(3), resource_limits=ResourceLimits(max_samples=4),
    )  # fmt: skip
    requested = Qos(
        history=KeepAll(), time_based_filter=TimeBasedFilter(0.5), user_data=UserData(b"b"),
        resource_limits=ResourceLimits(max_instances=9),
    )  # fmt: skip
    assert fits(offered, requested)


@pytest.mark.parametrize(
    ("type_name", "keyed", "texts"),
    [
        ("U", False, ("T (without key)", "U (without key)")),
        ("T", True, ("T (without key)", "T (with key)")),
    ],
)
def test_types_and_keys_have_to_agree(type_name: str, keyed: bool, texts: tuple[str, str]) -> None:
    refusal = judge(writer(), reader(type_name=type_name, keyed=keyed))
    assert refusal == MatchRefusal(RefusalKind.TYPE, *texts)
    assert str(refusal) == f"type: offered {texts[0]}, requested {texts[1]}"


def test_a_partition_apart_is_no_question_of_qos() -> None:
    """RTPS peers report no incompatible QoS for it; the reason is kept all the same."""
    refusal = judge(writer(Qos(partition=Partition("a"))), reader(Qos(reliability=Reliable())))
    assert refusal == MatchRefusal(RefusalKind.PARTITION, "('a',)", "('',)")


# --- partitions -----------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("offered", "requested", "expected"),
    [
        ((), (), True),
        ((), ("",), True),
        ((), ("a",), False),
        (("a",), ("a",), True),
        (("a",), ("A",), False),
        (("a", "b"), ("c", "b"), True),
        (("a*",), ("abc",), True),
        (("abc",), ("a*",), True),  # on either side
        (("a*",), ("a*",), False),  # a pattern never fits a pattern, not even itself
        (("a*",), ("ab*",), False),
        (("*",), (), True),  # nothing is the partition with the empty name
        (("?",), (), False),
        (("a?c",), ("abc",), True),
        (("a?c",), ("ac",), False),
        (("a?c",), ("abbc",), False),
        (("*b*",), ("abc",), True),
        (("*b*d",), ("abcd",), True),
        (("*b*d",), ("abc",), False),
        (("a**c",), ("abc",), True),
        (("a*",), ("a\nb",), True),
        (("a.c",), ("abc",), False),  # nothing but * and ? is special
        (("[ab]",), ("a",), False),
        (("[ab]",), ("[ab]",), True),
        (("a*a",), ("a",), False),
        (("*aab",), ("aaaab",), True),
        (("*a?*b",), ("aaab",), True),
        (("*ab*ab",), ("abab",), True),
        (("*ab*ab",), ("ab",), False),
    ],
)
def test_partitions(offered: tuple[str, ...], requested: tuple[str, ...], expected: bool) -> None:
    assert partitions_match(offered, requested) is expected
    assert partitions_match(requested, offered) is expected, "it works both ways"


@given(st.text("ab*?", max_size=8).filter(lambda name: "*" in name or "?" in name), st.text("ab", max_size=10))
def test_patterns_fit_what_the_shells_would(pattern: str, name: str) -> None:
    assert partitions_match((pattern,), (name,)) is fnmatch.fnmatchcase(name, pattern)


def test_a_strangers_pattern_costs_no_more_than_its_length() -> None:
    """Stars that multiply: a naive expression would take this one for ever."""
    begin = time.process_time()
    assert not partitions_match(("*a" * 500 + "*b",), ("a" * 5000,))
    assert not partitions_match(("a" * 5000,), ("*a?" * 500 + "b",))
    assert time.process_time() - begin < 2
