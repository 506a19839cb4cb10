"""Qos: one frozen value; what is not set is resolved as the OMG's tables say; nonsense is refused by name."""

from __future__ import annotations

import math
import pickle
from typing import Any

import pytest

from ddsi.structure import qos_policies as p
from ddsi.structure.errors import BadParameter, InconsistentPolicy
from ddsi.structure.qos import Qos, reader_qos, writer_qos
from ddsi.structure.time import Time, duration_from_wire, duration_to_wire, ticks_from_nanoseconds


def test_writers_are_reliable_and_readers_best_effort_by_default() -> None:
    assert writer_qos(Qos()).reliability == p.Reliable(max_blocking_time=0.1)
    assert reader_qos(Qos()).reliability == p.BestEffort()
    assert writer_qos(Qos()).history == p.KeepLast(1)
    assert reader_qos(Qos()).durability == p.Volatile()


def test_the_right_side_wins_a_merge_and_properties_are_merged_one_by_one() -> None:
    left = Qos(history=p.KeepAll(), deadline=p.Deadline(1), properties={"a": "1", "b": "1"})
    right = Qos(history=p.KeepLast(3), properties={"b": "2"})
    merged = left | right
    assert merged.history == p.KeepLast(3)
    assert merged.deadline == p.Deadline(1)
    assert merged.properties == {"a": "1", "b": "2"}
    assert left.history == p.KeepAll()


@pytest.mark.parametrize(
    ("make", "text"),
    [
        (lambda: Qos(reliability=p.KeepAll()), r"reliability.*Reliable\(\.\.\.\) or BestEffort"),  # type: ignore[arg-type]
        (lambda: p.KeepLast(0), "depth.*1 or more"),
        (lambda: p.Deadline(-1), "Deadline.period.*seconds"),
        (lambda: p.Deadline(math.nan), "Deadline.period"),
        (lambda: p.ResourceLimits(max_samples=0), "max_samples"),
        (lambda: p.OwnershipStrength(1 << 31), "int32"),
        (lambda: p.Partition(["a"]), "Partition"),  # type: ignore[arg-type]
        (lambda: p.UserData("text"), "bytes"),  # type: ignore[arg-type]
    ],
)
def test_nonsense_is_refused_by_name(make: Any, text: str) -> None:
    with pytest.raises(BadParameter, match=text):
        make()


def test_contradictions_are_refused_with_both_values() -> None:
    with pytest.raises(InconsistentPolicy, match=r"10.*max_samples_per_instance=5"):
        writer_qos(Qos(history=p.KeepLast(10), resource_limits=p.ResourceLimits(max_samples_per_instance=5)))
    with pytest.raises(InconsistentPolicy, match=r"deadline\.period=1"):
        reader_qos(Qos(deadline=p.Deadline(1), time_based_filter=p.TimeBasedFilter(2)))


def test_property_values_are_never_shown() -> None:
    qos = Qos(
        properties={"dds.sec.auth.password": "secret", "b": p.Property("secret"), "c": p.BinaryProperty(b"secret")}
    )
    assert "secret" not in repr(qos)
    assert "secret" not in repr(p.Property("secret"))


@pytest.mark.parametrize("seconds", [0.0, 0.1, 0.05, 1.5, 100.0, 3600.25, math.inf])
def test_durations_come_back_as_the_numbers_that_people_wrote(seconds: float) -> None:
    assert duration_from_wire(*duration_to_wire(seconds)) == seconds


def test_a_time_is_a_float_that_keeps_its_nanoseconds() -> None:
    time = Time.from_nanoseconds(1_700_000_000_123_456_789)
    assert time.nanoseconds == 1_700_000_000_123_456_789
    assert abs(time - 1_700_000_000.123456789) < 1e-6
    assert time.ticks == ticks_from_nanoseconds(1_700_000_000_123_456_789)
    assert pickle.loads(pickle.dumps(time)).ticks == time.ticks
    with pytest.raises(ValueError, match="1970"):
        Time.from_seconds(-1)
