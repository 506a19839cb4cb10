"""The judgement of the OMG's suite: what each check makes of lines, as a program could print them."""

from __future__ import annotations

import re
from collections.abc import Iterable
from typing import cast

import pytest
import trio

from .framework import ExpectationFailed, Process, async_test
from .omg import CASES, Code, Effort, checks
from .omg.checks import Check
from .omg.output import Output, Sample
from .omg.play import publisher_code, subscriber_code


class _Printed:
    """Stands for a process that has printed these lines and then says nothing."""

    def __init__(self, lines: Iterable[str]) -> None:
        self._lines = iter(lines)

    async def expect(self, pattern: str, *, timeout: float) -> re.Match[str]:
        for line in self._lines:
            if found := re.fullmatch(pattern, line):
                return found
        raise ExpectationFailed("no more")


def _output(*lines: str) -> Output:
    return Output(cast(Process, _Printed(lines)), 0.0)


def _sizes(*sizes: int, color: str = "BLUE", tail: str = "") -> list[str]:
    return [f"Square     {color:<10} 010 020 [{size}]{tail}" for size in sizes]


def _mixed(**sizes: tuple[int, ...]) -> list[str]:
    """Samples of several colours, each in turn."""
    rows = zip(*(_sizes(*row, color=color) for color, row in sizes.items()), strict=True)
    return [line for row in rows for line in row]


def _ordered(*colors: str) -> list[str]:
    """Reads, each as the first letters of the colours that it hands out."""
    return [
        line
        for read in colors
        for line in (
            "Reading with ordered access, iteration 1",
            *(line for color in read for line in _sizes(20, color=color)),
        )
    ][1:]


def _sets(*reads: tuple[int, ...], topics: int = 3) -> list[str]:
    """Reads, each of samples of these sizes from every instance of every topic."""
    names = ["Square", "Square1", "Square2"][:topics]
    return [
        line
        for sizes in reads
        for line in (
            "Reading coherent sets, iteration 1",
            *(f"{topic} {color} 010 020 [{size}]" for topic in names for color in "ABCD" for size in sizes),
        )
    ][1:]


FIVE_SETS = [tuple(range(number, number + 3)) for number in range(1, 16, 3)]

GONE = "Square     {:<10} NOT_ALIVE_NO_WRITERS_INSTANCE_STATE"
DISPOSED = "Square     {:<10} NOT_ALIVE_DISPOSED_INSTANCE_STATE"
LATE = "on_requested_deadline_missed() topic: 'Square'  type: 'ShapeType' : (total = 1, change = 1)"

JUDGED: list[tuple[Check, list[str], Code]] = [
    (checks.any_sample, _sizes(20), Code.OK),
    (checks.any_sample, _sizes(0), Code.DATA_NOT_CORRECT),
    (checks.any_sample, ["Square [20]"], Code.DATA_NOT_RECEIVED),
    (checks.by_sizes, _sizes(*[20] * 20), Code.RECEIVING_FROM_ONE),
    (checks.by_sizes, _sizes(*[20] * 5, *[30] * 15), Code.RECEIVING_FROM_ONE),
    (checks.by_sizes, _sizes(20, 30, 20), Code.RECEIVING_FROM_BOTH),
    (checks.by_sizes, _sizes(20), Code.DATA_NOT_RECEIVED),
    (checks.by_colors, _sizes(1, 2, 3), Code.RECEIVING_FROM_ONE),
    (checks.by_colors, _mixed(BLUE=(1, 2), RED=(1, 2)), Code.RECEIVING_FROM_BOTH),
    (checks.in_order, _sizes(*range(1, 40, 3)), Code.OK),
    (checks.in_order, _sizes(*range(1, 9), 8, *range(9, 20)), Code.DATA_NOT_CORRECT),
    (checks.in_order, _sizes(*range(1, 5)), Code.DATA_NOT_RECEIVED),
    (checks.no_losses, _sizes(*range(7, 20)), Code.OK),
    (checks.no_losses, _mixed(BLUE=tuple(range(7, 20)), RED=tuple(range(9, 22))), Code.OK),
    (checks.no_losses, _sizes(7, 8, 10, *range(11, 30)), Code.DATA_NOT_CORRECT),
    (checks.no_losses, _sizes(7, 8, 8, *range(9, 30)), Code.DATA_NOT_CORRECT),
    (checks.sizes_up_to_20, _sizes(1, 20, 7, 3, 9, 12), Code.OK),
    (checks.sizes_up_to_20, _sizes(1, 20, 21, 3, 9, 12), Code.DATA_NOT_CORRECT),
    (checks.no_history, _sizes(31), Code.OK),
    (checks.no_history, _sizes(4), Code.DATA_NOT_CORRECT),
    (checks.whole_history, _sizes(1), Code.OK),
    (checks.whole_history, _sizes(2), Code.DATA_NOT_CORRECT),
    (checks.deadline_missed, [*_sizes(20), LATE], Code.DEADLINE_MISSED),
    (checks.deadline_missed, _sizes(20, 20), Code.DATA_NOT_RECEIVED),
    (checks.every_tenth, _sizes(5, 7, 17), Code.OK),
    (checks.every_tenth, _sizes(5, 15, 23), Code.DATA_NOT_CORRECT),
    (checks.every_tenth, _sizes(5, 15, 35), Code.DATA_NOT_CORRECT),
    (checks.unregistered, [*_mixed(BLUE=(1, 2), RED=(1, 2)), GONE.format("RED"), GONE.format("BLUE")], Code.OK),
    (checks.unregistered, [*_mixed(BLUE=(1, 2), RED=(1, 2)), GONE.format("RED")], Code.DATA_NOT_CORRECT),
    (checks.unregistered, [*_sizes(1), DISPOSED.format("BLUE")], Code.DATA_NOT_CORRECT),
    (checks.disposed, [*_sizes(1, 2), DISPOSED.format("BLUE")], Code.OK),
    (checks.disposed, [*_sizes(1, 2), GONE.format("BLUE")], Code.DATA_NOT_CORRECT),
    (checks.large, _sizes(*[20] * 12, tail=" {255}"), Code.OK),
    (checks.large, _sizes(*[20] * 12, tail=" {0}"), Code.DATA_NOT_CORRECT),
    (checks.large, _sizes(*[20] * 12), Code.DATA_NOT_CORRECT),
    (checks.groups_of_two_or_three, _sizes(1, 2, 3, 6, 7, 11), Code.OK),
    (checks.groups_of_two_or_three, _sizes(3, 6, 7, 11, 12), Code.OK),
    (checks.groups_of_two_or_three, _sizes(1, 2, 3, 4, 6, 7, 11), Code.DATA_NOT_CORRECT),
    (checks.groups_of_two_or_three, _sizes(1, 2, 6, 11, 12), Code.DATA_NOT_CORRECT),
    (checks.groups_of_two_or_three, _sizes(*range(1, 30)), Code.DATA_NOT_CORRECT),
    (checks.by_instance_or_in_order, _ordered(*["AAABBBCCC"] * 5), Code.ORDERED_ACCESS_INSTANCE),
    (checks.by_instance_or_in_order, _ordered(*["ABCABCABC"] * 5), Code.ORDERED_ACCESS_TOPIC),
    (checks.by_instance_or_in_order, _ordered("ABCABCABC", "AAABBBCCC", *["ABCABCABC"] * 3), Code.ORDERED_ACCESS_TOPIC),
    (checks.by_instance_or_in_order, _ordered(*["ABCABCABC", "AAABBBCCC", "AAABBBCCC"] * 2), Code.DATA_NOT_CORRECT),
    (checks.by_instance_or_in_order, _ordered("ABC" * 12), Code.ORDERED_ACCESS_TOPIC),
    (checks.by_instance_or_in_order, _ordered(*["ABC"] * 11), Code.DATA_NOT_RECEIVED),
    (checks.by_instance_or_in_order, _ordered(*["ABCABCABC"] * 2), Code.DATA_NOT_RECEIVED),
    (checks.whole_sets, _sets(*FIVE_SETS), Code.OK),
    (checks.whole_sets, _sets((1, 2, 3), (4, 5, 6, 7, 8, 9), (10, 11, 12), (13, 14, 15)), Code.OK),
    (checks.whole_sets, _sets((3,), *[tuple(size + 3 for size in sizes) for sizes in FIVE_SETS]), Code.OK),
    (checks.whole_sets, _sets((1, 2, 3), (4, 5), (6,), *FIVE_SETS[2:]), Code.DATA_NOT_CORRECT),
    (checks.whole_sets, _sets(*FIVE_SETS[:2], *FIVE_SETS[1:]), Code.DATA_NOT_CORRECT),
    (checks.whole_sets, _sets(*FIVE_SETS, topics=2), Code.DATA_NOT_RECEIVED),
    (checks.whole_sets, _sets(*FIVE_SETS[:4]), Code.DATA_NOT_RECEIVED),
]
COUNT = 10


@pytest.mark.parametrize(("check", "lines", "code"), JUDGED)
@async_test
async def test_what_a_check_makes_of_lines(check: Check, lines: list[str], code: Code) -> None:
    count = 3 * COUNT if check in (checks.every_tenth, checks.groups_of_two_or_three) else COUNT
    if check is checks.every_tenth:
        count = 2 * COUNT
    output = _output(*lines[1:])
    output.line = lines[0]
    assert await check(output, count) is code


@pytest.mark.parametrize(
    ("lines", "code"),
    [
        ([], Code.TOPIC_NOT_CREATED),
        (["Lifespan = NOT supported"], Code.PUB_UNSUPPORTED_FEATURE),
        (["Create topic: Square"], Code.WRITER_NOT_CREATED),
        (["Create topic: Square", "x = not supported"], Code.PUB_UNSUPPORTED_FEATURE),
        (["Create topic: Square", "Create writer for topic: Square color: BLUE"], Code.READER_NOT_MATCHED),
        (["Create topic: Square", "Create writer for topic: Square", "on_publication_matched() topic"], Code.OK),
        (["Create topic: Square", "Create writer for topic: Square", "on_offered_incompatible_qos() topic"],
         Code.INCOMPATIBLE_QOS),
    ],
)  # fmt: skip
@async_test
async def test_how_far_a_publisher_comes(lines: list[str], code: Code) -> None:
    started = trio.Event()
    started.set()
    assert await publisher_code(_output(*lines), Effort(COUNT, 0.0), trio.Event(), started, prints=False) is code


@pytest.mark.parametrize(
    ("lines", "code"),
    [
        ([], Code.TOPIC_NOT_CREATED),
        (["Create topic: Square"], Code.READER_NOT_CREATED),
        (["Create topic: Square", "failed to create content filtered topic"], Code.FILTER_NOT_CREATED),
        (["Create topic: Square", "Create reader for topic: Square"], Code.DATA_NOT_RECEIVED),
        (["Create topic: Square", "Create reader for topic: Square", *_sizes(20)], Code.OK),
        (["Create topic: Square", "Create reader for topic: Square", LATE], Code.DEADLINE_MISSED),
        (["Create topic: Square", "Create reader for topic: Square", "on_requested_incompatible_qos()"],
         Code.INCOMPATIBLE_QOS),
        (["Create topic: Square", "Ownership = not supported"], Code.SUB_UNSUPPORTED_FEATURE),
    ],
)  # fmt: skip
@async_test
async def test_how_far_a_subscriber_comes(lines: list[str], code: Code) -> None:
    assert await subscriber_code(_output(*lines), checks.any_sample, Effort(COUNT, 0.0), trio.Event()) is code


def test_a_sample_is_told_from_other_lines() -> None:
    assert Sample.from_line("Square     BLUE1      010 020 [30] {255}") == Sample("Square", "BLUE1", 30, 255)
    assert Sample.from_line("on_publication_matched() topic: 'Square' [1]") is None


def test_each_case_begins_with_publishers_and_expects_a_code_of_each_program() -> None:
    for case in CASES:
        roles = "".join(options[1] for options in case.programs)
        assert re.fullmatch("P+S+", roles), case.name
        assert len(case.expected) == len(case.programs), case.name
    assert len({case.name for case in CASES}) == len(CASES) == 105
