"""Qos: what is asked for, how two are merged, what is resolved, and what contradicts itself."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import pytest

from ddsi.structure.errors import BadParameter, DdsError, DdsTimeout, InconsistentPolicy, MalformedMessage
from ddsi.structure.qos import EndpointQos, Qos, reader_qos, writer_qos
from ddsi.structure.qos_policies import (
    Automatic,
    BestEffort,
    BinaryProperty,
    DataRepresentation,
    DataTags,
    Deadline,
    KeepAll,
    KeepLast,
    LatencyBudget,
    Lifespan,
    ManualByTopic,
    OwnershipStrength,
    Partition,
    Persistent,
    Property,
    Reliable,
    ResourceLimits,
    TimeBasedFilter,
    Transient,
    TransientLocal,
    UserData,
    Volatile,
)


def test_what_is_not_set_has_the_omgs_default_for_its_entity() -> None:
    """DDS 1.4 §2.2.3: writers are reliable, readers best effort; all else is alike."""
    writer, reader = writer_qos(Qos()), reader_qos(Qos())
    assert (writer.reliability, reader.reliability) == (Reliable(0.1), BestEffort())
    for qos in (writer, reader):
        assert (qos.durability, qos.history, qos.deadline) == (Volatile(), KeepLast(1), Deadline(math.inf))
        assert (qos.liveliness, qos.lifespan, qos.partition.names) == (Automatic(math.inf), Lifespan(math.inf), ())
    assert writer.is_reliable
    assert not reader.is_reliable


def test_the_right_side_wins_and_properties_are_merged() -> None:
    left = Qos(history=KeepAll(), deadline=Deadline(1), properties={"a": "1", "b": "1"})
    right = Qos(history=KeepLast(3), properties={"b": "2"})
    merged = left | right
    assert (merged.history, merged.deadline) == (KeepLast(3), Deadline(1))
    assert merged.properties == {"a": "1", "b": "2"}
    assert (left.history, dict(left.properties)) == (KeepAll(), {"a": "1", "b": "1"}), "both stay as they were"
    assert Qos() | left == left
    with pytest.raises(TypeError):
        left | 3  # type: ignore[operator]


@pytest.mark.parametrize(
    ("durability", "keeps"), [(Volatile(), False), (TransientLocal(), True), (Transient(), True), (Persistent(), True)]
)
def test_the_kinds_beyond_transient_local_keep_history_too(
    durability: Volatile | TransientLocal | Transient | Persistent, keeps: bool
) -> None:
    assert writer_qos(Qos(durability=durability)).is_transient_local is keeps


@pytest.mark.parametrize(
    ("qos", "text"),
    [
        (
            Qos(history=KeepLast(5), resource_limits=ResourceLimits(max_samples_per_instance=4)),
            "raise the limit or lower the depth",
        ),
        (Qos(resource_limits=ResourceLimits(max_samples=2, max_samples_per_instance=3)), "max_samples=2 is below"),
        (Qos(deadline=Deadline(1), time_based_filter=TimeBasedFilter(2)), "it could never be met"),
    ],
)
def test_policies_that_contradict_each_other_are_refused(qos: Qos, text: str) -> None:
    for resolve in (writer_qos, reader_qos):
        with pytest.raises(InconsistentPolicy, match=text):
            resolve(qos)


@pytest.mark.parametrize(
    ("policy", "arguments"),
    [
        (KeepLast, (0,)),
        (KeepLast, (1.5,)),
        (Reliable, (-1,)),
        (Reliable, (math.nan,)),
        (Deadline, ("1",)),
        (Lifespan, (-0.1,)),
        (LatencyBudget, (None,)),
        (ManualByTopic, (-1,)),
        (Partition, (["a"],)),
        (OwnershipStrength, (1 << 31,)),
        (UserData, ("text",)),
        (DataTags, ("classification",)),
        (DataTags, (("classification", 3),)),
        (DataTags, (("", "secret"),)),
        (DataTags, (("a", "b", "c"),)),
        (DataRepresentation, (7,)),
        (ResourceLimits, (0,)),
        (ResourceLimits, (1, -2)),
    ],
)
def test_values_that_cannot_be_meant_are_refused_at_once(
    policy: Callable[..., object], arguments: tuple[object, ...]
) -> None:
    with pytest.raises(BadParameter):
        policy(*arguments)


def test_a_policy_in_the_wrong_place_is_named_with_what_belongs_there() -> None:
    with pytest.raises(BadParameter, match=r"Qos\(durability=\.\.\.\) takes Volatile\(\.\.\.\) or TransientLocal"):
        Qos(durability=Reliable())  # type: ignore[arg-type]
    with pytest.raises(BadParameter, match="property 'x'"):
        Qos(properties={"x": 3})  # type: ignore[dict-item]


def test_a_policy_that_is_not_known_is_refused_with_the_nearest() -> None:
    make: Any = Qos
    with pytest.raises(BadParameter, match=r"Qos\(reliabilty=\.\.\.\) is not known: did you mean reliability\?"):
        make(reliabilty=Reliable())
    with pytest.raises(BadParameter, match="did you mean properties"):
        make(property={"a": "b"})
    with pytest.raises(BadParameter, match="there are reliability, durability, "):
        make(xyzzy=1)
    with pytest.raises(BadParameter, match=r"by name, as Qos\(reliability=\.\.\.\)"):
        make(Reliable())
    with pytest.raises(BadParameter, match="takes a dict, not a str"):
        make(properties="hush")


def test_a_repr_shows_what_was_set_and_no_secret() -> None:
    assert repr(Qos(history=KeepAll())) == "Qos(history=KeepAll())"
    secret = Qos(properties={"b": Property("hush"), "a": BinaryProperty(b"hush"), "c": "hush"})
    assert repr(secret) == "Qos(properties=<a, b, c>)"
    assert "hush" not in repr(secret.properties["a"])
    assert "hush" not in repr(secret.properties["b"])


def test_qos_is_a_value() -> None:
    assert Qos(partition=Partition("a", "b")) == Qos(partition=Partition("a", "b"))
    assert hash(Partition("a")) == hash(Partition("a"))
    assert EndpointQos() == EndpointQos()
    with pytest.raises(AttributeError):
        Qos().history = KeepAll()  # type: ignore[misc]


def test_whose_fault_an_error_is_stands_in_its_type() -> None:
    assert issubclass(DdsTimeout, TimeoutError)
    assert issubclass(BadParameter, ValueError)
    assert not issubclass(MalformedMessage, DdsError), "a peer's fault never reaches the application"
    error = MalformedMessage("too short", element="HEARTBEAT", offset=24)
    assert str(error) == "HEARTBEAT at octet 24: too short"
    assert (str(MalformedMessage("why")), str(MalformedMessage("why", offset=3))) == ("why", "why at octet 3")
