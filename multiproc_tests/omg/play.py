"""Playing one case: programs are started one after the other, told apart by what they print, and ended by SIGINT.

The steps that are waited for, and the code of each that does not come, are the suite's.  Unlike in the suite, the
second before the next start begins when the program has said that it creates its topic.
"""

from __future__ import annotations

import signal
import time
from collections.abc import Awaitable, Callable, Sequence
from dataclasses import dataclass

import trio

from ..framework import DeadlineExceeded, ExpectationFailed, Namespace, Scenario, Unavailable, namespace, scenario
from ..matrix.outcome import Outcome, Verdict
from .cases import SuiteCase
from .checks import Check
from .codes import Code
from .limits import known_limit
from .output import SAMPLE, Output
from .programs import ShapeMain

__all__ = ["FULL", "QUICK", "Effort", "Unsupported", "play", "run_case"]

UNSUPPORTED = "not supported"
_UNSUPPORTED_CODES = {Code.PUB_UNSUPPORTED_FEATURE: "publisher", Code.SUB_UNSUPPORTED_FEATURE: "subscriber"}
_CASE_DEADLINE = 240.0
_HEAD_START = 1.0
_START = 30.0  # a loaded machine takes its time to start an interpreter, and that is not what is judged
_LEAVING = 30.0


@dataclass(frozen=True, slots=True)
class Effort:
    """How many samples are judged, and how many seconds each step may take."""

    samples: int
    patience: float


FULL = Effort(samples=500, patience=15.0)
"""As the suite does."""

QUICK = Effort(samples=60, patience=8.0)
"""For every test run: the same steps, fewer samples."""


class Unsupported(Exception):
    """One of the programs says that it cannot do what the case asks for."""


async def run_case(case: SuiteCase, publisher: ShapeMain, subscriber: ShapeMain, effort: Effort = FULL) -> Outcome:
    """Plays the case and judges; never raises for what the programs do."""
    who = (case.name, publisher.name, subscriber.name)
    began = time.monotonic()
    try:
        await play(case, publisher, subscriber, effort)
    except Unavailable as error:
        return Outcome(*who, Verdict.UNAVAILABLE, reason=str(error))
    except Unsupported as error:
        return Outcome(*who, Verdict.NOT_APPLICABLE, time.monotonic() - began, str(error))
    except (ExpectationFailed, DeadlineExceeded) as error:
        seconds = time.monotonic() - began
        transcript = "\n".join(getattr(error, "__notes__", []))
        if known := known_limit(case, publisher.name, subscriber.name):
            return Outcome(*who, Verdict.KNOWN, seconds, known, transcript)
        return Outcome(*who, Verdict.FAILED, seconds, str(error), transcript)
    return Outcome(*who, Verdict.PASSED, time.monotonic() - began)


async def play(case: SuiteCase, publisher: ShapeMain, subscriber: ShapeMain, effort: Effort) -> None:
    """Plays the case; raises ExpectationFailed if the codes are not those expected, Unsupported or Unavailable."""
    publisher.locate()  # compiled before the clock runs
    subscriber.locate()
    title = f"omg-{case}-{publisher}-{subscriber}"
    with namespace() as host:
        async with scenario(title, deadline=_CASE_DEADLINE) as stage:
            codes = await _Play(case, publisher, subscriber, effort).codes(stage, host)
            _check_codes(case, codes)


def _check_codes(case: SuiteCase, codes: Sequence[Code]) -> None:
    for code, who in _UNSUPPORTED_CODES.items():
        if code in codes:
            raise Unsupported(f"the {who} does not support it")
    if tuple(codes) != case.expected:
        wanted, found = (", ".join(code.name for code in row) for row in (case.expected, codes))
        raise ExpectationFailed(f"expected {wanted}; found {found}")


class _Play:
    """One case on its way."""

    def __init__(self, case: SuiteCase, publisher: ShapeMain, subscriber: ShapeMain, effort: Effort) -> None:
        self.case = case
        self.publisher = publisher
        self.subscriber = subscriber
        self.effort = effort
        self._codes: list[Code | None] = [None] * len(case.programs)
        self._all_started = trio.Event()

    async def codes(self, stage: Scenario, host: Namespace) -> list[Code]:
        """The code of each program, in their order.  All have left, in good order, when this returns."""
        async with trio.open_nursery() as nursery:
            for number, options in enumerate(self.case.programs):
                # The suite's scripts ask for XCDR2 where the case does not say.
                words = options if "-x " in options else f"{options} -x 2"
                is_subscriber = _subscribes(options)
                program = self.subscriber if is_subscriber else self.publisher
                name = f"{'sub' if is_subscriber else 'pub'}{number} {program}"
                process = await program.start(stage, name, words, host)
                output = Output(process, self.effort.patience)
                ready = trio.Event()
                judge = self._judge_subscriber if is_subscriber else self._judge_publisher
                nursery.start_soon(self._judge, judge, number, output, ready, nursery.cancel_scope)
                await ready.wait()
                if number + 1 < len(self.case.programs):
                    await trio.sleep(_HEAD_START)
            self._all_started.set()
        codes = [code for code in self._codes if code is not None]
        if not any(code in _UNSUPPORTED_CODES for code in codes):
            for process in stage.processes:
                process.signal(signal.SIGINT)
            for process in stage.processes:
                await process.expect_exit(0, timeout=_LEAVING)
        return codes

    async def _judge(
        self,
        judge: Callable[[int, Output, trio.Event], Awaitable[Code]],
        number: int,
        output: Output,
        ready: trio.Event,
        scope: trio.CancelScope,
    ) -> None:
        code = self._codes[number] = await judge(number, output, ready)
        if code in _UNSUPPORTED_CODES:  # the others could only wait in vain
            scope.cancel()

    async def _judge_subscriber(self, number: int, output: Output, ready: trio.Event) -> Code:
        return await subscriber_code(output, self.case.check, self.effort, ready)

    async def _judge_publisher(self, number: int, output: Output, ready: trio.Event) -> Code:
        prints = " -w" in self.case.programs[number]
        return await publisher_code(output, self.effort, ready, self._all_started, prints=prints)


def _subscribes(options: str) -> bool:
    return options.startswith("-S")


async def publisher_code(
    output: Output, effort: Effort, ready: trio.Event, all_started: trio.Event, *, prints: bool
) -> Code:
    """How far the publisher comes: topic, writer, match; with ``-w`` the samples that it says it writes.

    The patience for a match begins when there may be somebody to match with.
    """
    found = await output.find("Create topic:", UNSUPPORTED, timeout=_START)
    ready.set()
    if found == "Create topic:":
        found = await output.find("Create writer for topic", UNSUPPORTED)
        if found is None:
            return Code.WRITER_NOT_CREATED
    elif found is None:
        return Code.TOPIC_NOT_CREATED
    if found == UNSUPPORTED:
        return Code.PUB_UNSUPPORTED_FEATURE
    await all_started.wait()
    found = await output.find("on_publication_matched", "on_offered_incompatible_qos", UNSUPPORTED)
    match found:
        case "on_publication_matched":
            return await _written(output, effort) if prints else Code.OK
        case "on_offered_incompatible_qos":
            return Code.INCOMPATIBLE_QOS
        case None:
            return Code.READER_NOT_MATCHED
        case _:
            return Code.PUB_UNSUPPORTED_FEATURE


async def _written(output: Output, effort: Effort) -> Code:
    """What the publisher says it writes, until it misses its deadline or has written as much as is judged."""
    for _ in range(effort.samples):
        match await output.find("on_offered_deadline_missed", SAMPLE):
            case "on_offered_deadline_missed":
                return Code.DEADLINE_MISSED
            case None:
                return Code.DATA_NOT_SENT
    return Code.OK


async def subscriber_code(output: Output, check: Check, effort: Effort, ready: trio.Event) -> Code:
    """How far the subscriber comes: topic, reader, a first sample, and then what ``check`` makes of it."""
    found = await output.find("Create topic:", UNSUPPORTED, timeout=_START)
    ready.set()
    filter_failed = "failed to create content filtered topic"
    if found == "Create topic:":
        found = await output.find("Create reader for topic:", filter_failed, UNSUPPORTED)
        if found is None:
            return Code.READER_NOT_CREATED
    elif found is None:
        return Code.TOPIC_NOT_CREATED
    if found == filter_failed:
        return Code.FILTER_NOT_CREATED
    if found == UNSUPPORTED:
        return Code.SUB_UNSUPPORTED_FEATURE
    refused, late = "on_requested_incompatible_qos", "on_requested_deadline_missed"
    found = await output.find(SAMPLE, refused, late, UNSUPPORTED)
    if found == SAMPLE:
        return await check(output, effort.samples)
    codes = {None: Code.DATA_NOT_RECEIVED, refused: Code.INCOMPATIBLE_QOS, late: Code.DEADLINE_MISSED}
    return codes.get(found, Code.SUB_UNSUPPORTED_FEATURE)
