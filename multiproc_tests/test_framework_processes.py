"""The framework on its own: processes, what they print, deadlines, and that nothing outlives a scenario."""

from __future__ import annotations

import os
import signal
import sys

import pytest
import trio

from .framework import DeadlineExceeded, ExpectationFailed, Process, Scenario, async_test, scenario

GREETER = """
import sys
print("READY", flush=True)
for line in sys.stdin:
    print("GOT", line.strip(), flush=True)
print("BYE")
"""

STUBBORN = """
import signal, time
signal.signal(signal.SIGTERM, signal.SIG_IGN)
print("READY", flush=True)
time.sleep(60)
"""


async def start_python(stage: Scenario, name: str, program: str, *, deadline: float | None = None) -> Process:
    return await stage.start(name, [sys.executable, "-c", program], deadline=deadline)


def is_alive(pid: int) -> bool:
    try:
        os.kill(pid, 0)
    except ProcessLookupError:
        return False
    return True


@async_test
async def test_two_processes_are_led_through_steps_in_turn() -> None:
    """Lines go in, events come out, each in its order, and the status is seen."""
    async with scenario("steps", deadline=20) as stage:
        left = await start_python(stage, "left", GREETER)
        right = await start_python(stage, "right", GREETER)
        await left.expect("READY")
        await right.expect("READY")
        await left.send("one")
        word = (await left.expect(r"GOT (\w+)"))[1]
        await right.send(word + word)
        await right.expect("GOT oneone")
        for process in (left, right):
            await process.close_input()
            await process.expect("BYE")
        await stage.all_exit(0)
        assert stage.outcome == {"left": 0, "right": 0}


@async_test
async def test_expect_reads_on_from_the_line_it_found() -> None:
    """A line is found once; ``matches`` sees all of them all the same."""
    async with scenario("cursor", deadline=20) as stage:
        counter = await start_python(stage, "counter", "print('N 1'); print('x'); print('N 2')")
        assert (await counter.expect(r"N (\d)"))[1] == "1"
        assert (await counter.expect(r"N (\d)"))[1] == "2"
        with pytest.raises(ExpectationFailed, match="never printed"):
            await counter.expect(r"N (\d)")
        assert [match[1] for match in counter.matches(r"N (\d)")] == ["1", "2"]


@async_test
async def test_a_pattern_must_match_the_whole_line() -> None:
    """``MATCHED 1`` is not found in ``MATCHED 12``."""
    async with scenario("whole line", deadline=20) as stage:
        process = await start_python(stage, "p", "print('MATCHED 12'); print('MATCHED 1')")
        await process.expect("MATCHED 1")
        await process.wait()
        assert len(process.matches("MATCHED 1")) == 1


@async_test
async def test_expectation_fails_after_its_timeout_while_the_process_lives() -> None:
    """The failure names the process, the pattern and the time; the transcript hangs on the exception."""
    with pytest.raises(ExpectationFailed, match=r"greeter did not print 'NEVER' within 0.3 s") as caught:
        async with scenario("timeout", deadline=20) as stage:
            greeter = await start_python(stage, "greeter", GREETER)
            await greeter.expect("READY")
            await greeter.expect("NEVER", timeout=0.3)
    (note,) = caught.value.__notes__
    assert "greeter out READY" in note


@async_test
async def test_standard_error_is_shown_but_never_matched() -> None:
    """Diagnostics belong to the transcript, not to the dialogue."""
    async with scenario("stderr", deadline=20) as stage:
        process = await start_python(stage, "p", "import sys; print('EVENT', file=sys.stderr)")
        with pytest.raises(ExpectationFailed):
            await process.expect("EVENT")
        assert "p err EVENT" in stage.transcript()


@async_test
async def test_a_wrong_exit_status_fails() -> None:
    """The status of a process is part of what it says."""
    async with scenario("status", deadline=20) as stage:
        process = await start_python(stage, "p", "raise SystemExit(3)")
        with pytest.raises(ExpectationFailed, match="ended with status 3, not 0"):
            await process.expect_exit(0)


@async_test
async def test_everything_is_stopped_when_the_block_raises() -> None:
    """The exception leaves the block as itself, and no process outlives it, not even one that ignores SIGTERM."""
    started: list[Process] = []
    with pytest.raises(KeyError, match="mine"):
        async with scenario("raise", deadline=20) as stage:
            for name, program in (("polite", GREETER), ("stubborn", STUBBORN)):
                started.append(await start_python(stage, name, program))
                await started[-1].expect("READY")
            raise KeyError("mine")
    assert not any(is_alive(process.pid) for process in started)
    assert [process.returncode for process in started] == [-signal.SIGTERM, -signal.SIGKILL]


@async_test
async def test_everything_is_stopped_when_the_scenario_is_cancelled_from_outside() -> None:
    """A cancellation passes through, and takes the processes along."""
    started: list[Process] = []
    with trio.move_on_after(5) as outside:
        async with scenario("cancelled", deadline=20) as stage:
            started.append(await start_python(stage, "p", GREETER))
            await started[0].expect("READY")
            outside.cancel()
            await trio.sleep_forever()
    assert outside.cancelled_caught
    assert not is_alive(started[0].pid)


@async_test
async def test_the_scenario_has_a_deadline() -> None:
    """A scenario that hangs fails where it hangs, and says so."""
    started: list[Process] = []
    with pytest.raises(DeadlineExceeded, match=r"the scenario took longer than 0.5 s"):
        async with scenario("hang", deadline=0.5) as stage:
            started.append(await start_python(stage, "p", GREETER))
            await started[0].wait(timeout=30)
    assert not is_alive(started[0].pid)


@async_test
async def test_each_process_may_have_a_deadline_of_its_own() -> None:
    """A process that hangs fails the scenario even while the test looks elsewhere."""
    with pytest.raises(DeadlineExceeded, match=r"slow ran longer than 0.4 s"):
        async with scenario("slow", deadline=20) as stage:
            await start_python(stage, "quick", "print('done')", deadline=10)
            await start_python(stage, "slow", GREETER, deadline=0.4)
            await trio.sleep(10)


@async_test
async def test_a_suspended_process_stands_still_and_goes_on() -> None:
    """SIGSTOP and SIGCONT; and a process that is left suspended is stopped like any other."""
    async with scenario("suspend", deadline=20) as stage:
        process = await start_python(stage, "p", GREETER)
        await process.expect("READY")
        process.suspend()
        await process.send("hello")
        with pytest.raises(ExpectationFailed):
            await process.expect("GOT hello", timeout=0.2)
        process.resume()
        await process.expect("GOT hello")
        process.suspend()
    assert process.returncode == -signal.SIGTERM


@async_test
async def test_output_without_a_line_end_and_in_long_lines_is_kept() -> None:
    """The last line needs no end; a line that never ends is cut, not collected without bound."""
    async with scenario("lines", deadline=20) as stage:
        process = await start_python(stage, "p", "import sys; sys.stdout.write('x' * 200_000 + '\\nlast')")
        await process.expect("last")
        assert sum(len(line.text) for line in process.lines if line.stream == "out") == 200_004
        assert max(len(line.text) for line in process.lines) <= 1 << 16


@async_test
async def test_transcript_tells_the_stories_by_time() -> None:
    """Lines of all processes stand in the order in which they were seen."""
    async with scenario("order", deadline=20) as stage:
        first = await start_python(stage, "first", GREETER)
        second = await start_python(stage, "second", GREETER)
        for process, word in ((first, "a"), (second, "b"), (first, "c")):
            await process.send(word)
            await process.expect(f"GOT {word}")
        shown = [line.split()[-1] for line in stage.transcript().splitlines() if " GOT " in line]
    assert shown == ["a", "b", "c"]
