"""The suite's cases: for each the options of every program, in the order of their start, and the codes expected."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import count

from . import checks
from .checks import Check
from .codes import Code

__all__ = ["CASES", "SuiteCase", "find_case"]

OK = (Code.OK, Code.OK)
INCOMPATIBLE = (Code.INCOMPATIBLE_QOS, Code.INCOMPATIBLE_QOS)
APART = (Code.READER_NOT_MATCHED, Code.DATA_NOT_RECEIVED)
LATE = (Code.DEADLINE_MISSED, Code.DEADLINE_MISSED)
FROM_ONE = (Code.OK, Code.OK, Code.RECEIVING_FROM_ONE)
BY_INSTANCE_AND_IN_ORDER = (Code.OK, Code.ORDERED_ACCESS_INSTANCE, Code.ORDERED_ACCESS_TOPIC)
FROM_BOTH = (Code.OK, Code.OK, Code.RECEIVING_FROM_BOTH)

_DEFAULT_TOPIC = "-t Square"


@dataclass(frozen=True, slots=True)
class SuiteCase:
    """One case: options of publishers (they come first) and subscribers, the code expected of each, the judgement."""

    name: str
    programs: tuple[str, ...]
    expected: tuple[Code, ...]
    check: Check

    @property
    def group(self) -> str:
        """The part of the name before the number."""
        return self.name.rpartition("_")[0]

    def __str__(self) -> str:
        return self.name


def _case(name: str, *programs: str, expected: tuple[Code, ...] = OK, check: Check = checks.any_sample) -> SuiteCase:
    complete = tuple(words if "-t " in words else f"{words} {_DEFAULT_TOPIC}" for words in programs)
    return SuiteCase(name, complete, expected, check)


_SCOPES = "itg"
# Of the offered and the requested access scope, in the suite's order; a narrower one than requested does not do.
_SCOPE_PAIRS = tuple((offered, requested) for offered in _SCOPES for requested in _SCOPES)
_FITTING_PAIRS = tuple(pair for pair in _SCOPE_PAIRS if _SCOPES.index(pair[0]) >= _SCOPES.index(pair[1]))


def _access(kind: str, offered: str, requested: str, *, history: str = "") -> tuple[str, str]:
    """The options of a publisher and a subscriber that want coherent or ordered access in such scopes."""
    return (
        f"-P -r -k 0{history} --{kind} --access-scope {offered}",
        f"-S -r -k 0{history} --{kind} --access-scope {requested}",
    )


def _ordered_cases() -> Iterator[SuiteCase]:
    numbers = count()
    for pair in _SCOPE_PAIRS:
        expected = OK if pair in _FITTING_PAIRS else INCOMPATIBLE
        yield _case(f"OrderedAccess_{next(numbers)}", *_access("ordered", *pair), expected=expected)
    publisher, subscriber = "-P -r -k 0 --access-scope t", _access("ordered", "t", "t")[1]
    yield _case(f"OrderedAccess_{next(numbers)}", publisher, subscriber, expected=INCOMPATIBLE)
    for history in ("", " -D l"):
        if history:
            for pair in _FITTING_PAIRS:
                yield _case(f"OrderedAccess_{next(numbers)}", *_access("ordered", *pair, history=history))
        publisher, by_instance = _access("ordered", "t", "i", history=history)
        _, in_order = _access("ordered", "t", "t", history=history)
        yield _case(
            f"OrderedAccess_{next(numbers)}",
            f"{publisher} -z 0 --num-instances 4 --write-period 100",
            f"{by_instance} --take-read --read-period 400",
            f"{in_order} --take-read --read-period 400",
            expected=BY_INSTANCE_AND_IN_ORDER,
            check=checks.by_instance_or_in_order,
        )


def _coherent_cases() -> Iterator[SuiteCase]:
    numbers = count()
    for pair in _SCOPE_PAIRS:
        expected = OK if pair in _FITTING_PAIRS else INCOMPATIBLE
        yield _case(f"CoherentSets_{next(numbers)}", *_access("coherent", *pair), expected=expected)
    publisher, subscriber = "-P -r -k 0 --access-scope t", _access("coherent", "t", "t")[1]
    yield _case(f"CoherentSets_{next(numbers)}", publisher, subscriber, expected=INCOMPATIBLE)
    for history in ("", " -D l"):
        if history:
            for pair in _FITTING_PAIRS:
                yield _case(f"CoherentSets_{next(numbers)}", *_access("coherent", *pair, history=history))
        for scope in _SCOPES:
            publisher, subscriber = _access("coherent", scope, scope, history=history)
            yield _case(
                f"CoherentSets_{next(numbers)}",
                f"{publisher} --num-topics 3 --num-instances 4 --coherent-sample-count 3 --write-period 100 -z 0",
                f"{subscriber} --num-topics 3 --take-read --read-period 100",
                check=checks.whole_sets,
            )


CASES = (
    _case("Domain_0", "-P -d 0", "-S -d 0 -b"),
    _case("Domain_1", "-P -d 0", "-S -d 1", expected=APART),
    _case("Domain_2", "-P -d 1", "-S -d 1 -b"),
    _case("DataRepresentation_0", "-P -x 1", "-S -x 1"),
    _case("DataRepresentation_1", "-P -x 1", "-S -x 2", expected=INCOMPATIBLE),
    _case("DataRepresentation_2", "-P -x 2", "-S -x 1", expected=INCOMPATIBLE),
    _case("DataRepresentation_3", "-P -x 2", "-S -x 2 -b"),
    _case("Reliability_0", "-P -b -z 0", "-S -b", check=checks.in_order),
    _case("Reliability_1", "-P -b", "-S -r", expected=INCOMPATIBLE),
    _case("Reliability_2", "-P -r", "-S -b"),
    _case("Reliability_3", "-P -r", "-S -r"),
    _case("Reliability_4", "-P -r -k 0 -z 0", "-S -r -k 0", check=checks.no_losses),
    _case("Reliability_5", "-P -r -k 0 -z 0 --num-instances 4", "-S -r -k 0", check=checks.no_losses),
    _case("History_0", "-P -r -k 5 -z 0 --write-period 50", "-S -r -k 5 --read-period 200", check=checks.no_losses),
    _case(
        "History_1",
        "-P -r -k 5 -z 0 --write-period 50 --num-instances 4",
        "-S -r -k 5 --read-period 200",
        check=checks.no_losses,
    ),
    _case("Ownership_0", "-P -s -1", "-S -s -1"),
    _case("Ownership_1", "-P -s -1", "-S -s 1", expected=INCOMPATIBLE),
    _case("Ownership_2", "-P -s 3", "-S -s -1", expected=INCOMPATIBLE),
    _case(
        "Ownership_3",
        "-P -s 3 -r -k 0 -c BLUE -z 20",
        "-P -s 4 -r -k 0 -c BLUE -z 30",
        "-S -s 1 -r -k 0",
        expected=FROM_ONE,
        check=checks.by_sizes,
    ),
    _case(
        "Ownership_4",
        "-P -s 3 -r -k 0 -c BLUE -z 20",
        "-P -s 4 -r -k 0 -c RED -z 30",
        "-S -s 1 -r -k 0",
        expected=FROM_BOTH,
        check=checks.by_sizes,
    ),
    _case(
        "Ownership_5",
        "-P -s -1 -r -k 0 -c BLUE -z 20",
        "-P -s -1 -r -k 0 -c BLUE -z 30",
        "-S -s -1 -r -k 0",
        expected=FROM_BOTH,
        check=checks.by_sizes,
    ),
    _case(
        "Ownership_6",
        "-P -s -1 -r -k 0 -c BLUE -z 20",
        "-P -s -1 -r -k 0 -c RED -z 30",
        "-S -s -1 -r -k 0",
        expected=FROM_BOTH,
        check=checks.by_sizes,
    ),
    _case("Deadline_0", "-P -f 3000", "-S -f 5000"),
    _case("Deadline_1", "-P -f 5000", "-S -f 5000"),
    _case("Deadline_2", "-P -f 7000", "-S -f 5000", expected=INCOMPATIBLE),
    _case(
        "Deadline_3",
        "-P -f 2000 -w --write-period 3000",
        "-S -f 2000",
        expected=LATE,
        check=checks.deadline_missed,
    ),
    _case("Topic_0", "-P -t Circle", "-S -t Circle"),
    _case("Topic_1", "-P -t Square", "-S -t Circle", expected=APART),
    _case(
        "Cft_0",
        "-P -r -k 0 -c BLUE",
        "-P -r -k 0 -c RED",
        "-S -r -k 0 -c RED",
        expected=FROM_ONE,
        check=checks.by_colors,
    ),
    _case(
        "Cft_1",
        "-P -r -k 0 -z 0 --size-modulo 50",
        '-S -r -k 0 --cft "shapesize <= 20"',
        check=checks.sizes_up_to_20,
    ),
    _case("Partition_0", '-P -p "p1"', '-S -p "p1"'),
    _case("Partition_1", '-P -p "p1"', '-S -p "p2"', expected=APART),
    _case(
        "Partition_2",
        '-P -p "p1" -c BLUE',
        '-P -p "x1" -c RED',
        '-S -p "p*"',
        expected=(Code.OK, Code.READER_NOT_MATCHED, Code.RECEIVING_FROM_ONE),
        check=checks.by_colors,
    ),
    _case("Durability_0", "-P -D v", "-S -D v"),
    _case("Durability_1", "-P -D v", "-S -D l", expected=INCOMPATIBLE),
    _case("Durability_2", "-P -D v", "-S -D t", expected=INCOMPATIBLE),
    _case("Durability_3", "-P -D v", "-S -D p", expected=INCOMPATIBLE),
    _case("Durability_4", "-P -D l", "-S -D v"),
    _case("Durability_5", "-P -D l", "-S -D l"),
    _case("Durability_6", "-P -D l", "-S -D t", expected=INCOMPATIBLE),
    _case("Durability_7", "-P -D l", "-S -D p", expected=INCOMPATIBLE),
    _case("Durability_8", "-P -D t", "-S -D v"),
    _case("Durability_9", "-P -D t", "-S -D l"),
    _case("Durability_10", "-P -D t", "-S -D t"),
    _case("Durability_11", "-P -D t", "-S -D p", expected=INCOMPATIBLE),
    _case("Durability_12", "-P -D p", "-S -D v"),
    _case("Durability_13", "-P -D p", "-S -D l"),
    _case("Durability_14", "-P -D p", "-S -D t"),
    _case("Durability_15", "-P -D p", "-S -D p"),
    _case("Durability_16", "-P -z 0 -r -k 0 -D v -w", "-S -r -k 0 -D v", check=checks.no_history),
    _case("Durability_17", "-P -z 0 -r -k 0 -D l -w", "-S -r -k 0 -D l", check=checks.whole_history),
    _case(
        "TimeBasedFilter_0",
        "-P -r -k 0 -z 0 --write-period 100",
        "-S -r -k 0 --time-filter 1000",
        check=checks.every_tenth,
    ),
    _case(
        "TimeBasedFilter_1",
        "-P -r -k 0 -z 0 --write-period 100 --num-instances 4",
        "-S -r -k 0 --time-filter 1000",
        check=checks.every_tenth,
    ),
    _case(
        "FinalInstanceState_0",
        "-P --num-iterations 200 --num-instances 4 --final-instance-state u",
        "-S",
        check=checks.unregistered,
    ),
    _case(
        "FinalInstanceState_1",
        "-P --num-iterations 200 --num-instances 4 --final-instance-state d",
        "-S",
        check=checks.disposed,
    ),
    _case("FinalInstanceState_2", "-P --num-iterations 200 --num-instances 4", "-S", check=checks.unregistered),
    _case("LargeData_0", "-P -r -k 0 --additional-payload-size 100000", "-S -r -k 0", check=checks.large),
    *(
        _case(
            f"Lifespan_{number}",
            f"-P {kind} -z 0 --write-period {write} --lifespan {lifespan}{instances}",
            f"-S {reader} --read-period {read}",
            check=checks.groups_of_two_or_three,
        )
        for number, (kind, reader, write, lifespan, read, instances) in enumerate(
            (kind, reader, write, lifespan, read, instances)
            for kind, reader in (("-r -k 0", "-r -k 0"), ("-b", "-b -k 0"))
            for write, lifespan, read in ((100, 250, 500), (400, 1000, 2000))
            for instances in ("", " --num-instances 4")
        )
    ),
    *_ordered_cases(),
    *_coherent_cases(),
)


def find_case(name: str) -> SuiteCase:
    """The case of that name.  Raises LookupError, naming those there are."""
    for case in CASES:
        if case.name == name:
            return case
    raise LookupError(f"there is no case {name!r}: {', '.join(case.name for case in CASES)}")
