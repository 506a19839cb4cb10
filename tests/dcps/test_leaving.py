"""What leaves ``async with DomainParticipant()``: the body's own errors as themselves, and nothing behind."""

from __future__ import annotations

import os
import signal
import threading
from pathlib import Path
from typing import Any

import pytest
import trio

import ddsi
from tests.dcps.running import RELIABLE, Shape, eventually, in_trio, pair

OPEN_FILES = Path("/proc/self/fd")


class Mistake(Exception):
    """What a test's body raises."""


def open_files() -> int:
    return len(os.listdir(OPEN_FILES)) if OPEN_FILES.exists() else 0


@in_trio
async def test_what_the_body_raises_leaves_as_itself(domain: int) -> None:
    mistake = Mistake("mine")
    with pytest.raises(Mistake) as caught:
        async with ddsi.DomainParticipant(domain):
            raise mistake
    assert caught.value is mistake
    assert not hasattr(mistake, "__notes__")


@in_trio
async def test_an_exception_group_of_the_body_leaves_as_the_same_group(domain: int) -> None:
    group = ExceptionGroup("both", [Mistake("one"), ValueError("two")])
    with pytest.raises(ExceptionGroup) as caught:
        async with ddsi.DomainParticipant(domain):
            raise group
    assert caught.value is group


@in_trio
async def test_a_nursery_inside_the_body_raises_its_own_group(domain: int) -> None:
    async def fail() -> None:
        raise Mistake("in a task of the user's")

    with pytest.raises(ExceptionGroup) as caught:
        async with ddsi.DomainParticipant(domain), trio.open_nursery(strict_exception_groups=True) as nursery:
            nursery.start_soon(fail)
            nursery.start_soon(trio.sleep_forever)
    assert [type(error) for error in caught.value.exceptions] == [Mistake]


@in_trio
async def test_return_and_break_leave_quietly(domain: int) -> None:
    async def returns() -> str:
        async with ddsi.DomainParticipant(domain):
            return "value"

    assert await returns() == "value"
    for _ in range(2):
        async with ddsi.DomainParticipant(domain):
            break


@in_trio
async def test_fail_after_around_a_participant_raises_too_slow(domain: int) -> None:
    with pytest.raises(trio.TooSlowError):
        with trio.fail_after(0.05):
            async with ddsi.DomainParticipant(domain):
                await trio.sleep_forever()


@in_trio
async def test_fail_after_inside_the_body_raises_too_slow(domain: int) -> None:
    with pytest.raises(trio.TooSlowError):
        async with ddsi.DomainParticipant(domain):
            with trio.fail_after(0.01):
                await trio.sleep_forever()


@in_trio
async def test_an_outer_cancellation_is_caught_by_the_scope_it_came_from(domain: int) -> None:
    with trio.move_on_after(0.05) as scope:
        async with ddsi.DomainParticipant(domain) as participant:
            async for _ in ddsi.DataReader(participant, ddsi.Topic(participant, "Square", Shape)):
                pass
    assert scope.cancelled_caught


@in_trio
async def test_a_cancelled_body_may_raise_something_else(domain: int) -> None:
    mistake = Mistake("while cleaning up")
    with pytest.raises(Mistake) as caught:
        with trio.move_on_after(0.02):
            async with ddsi.DomainParticipant(domain):
                try:
                    await trio.sleep_forever()
                finally:
                    raise mistake
    assert caught.value is mistake


@in_trio
async def test_system_exit_leaves_as_itself(domain: int) -> None:
    with pytest.raises(SystemExit, match="3"):
        async with ddsi.DomainParticipant(domain):
            raise SystemExit(3)


def test_a_keyboard_interrupt_leaves_as_itself(domain: int) -> None:
    """Control-C while the body waits."""

    async def main() -> None:
        async with ddsi.DomainParticipant(domain) as participant:
            reader = ddsi.DataReader(participant, ddsi.Topic(participant, "Square", Shape))
            control_c = threading.Timer(0.05, signal.pthread_kill, (threading.get_ident(), signal.SIGINT))
            control_c.start()
            await reader.wait()

    with pytest.raises(KeyboardInterrupt):
        trio.run(main)


def test_a_keyboard_interrupt_that_comes_while_computing_leaves_as_itself(domain: int) -> None:
    async def main() -> None:
        async with ddsi.DomainParticipant(domain):
            signal.raise_signal(signal.SIGINT)

    with pytest.raises(KeyboardInterrupt):
        trio.run(main)


def break_the_engine(participant: ddsi.DomainParticipant, failure: BaseException) -> None:
    """The engine's timer is due, and it fails at that, as if it had a defect."""

    def fail(now: float) -> None:
        raise failure

    pump: Any = participant._pump
    pump.engine.handle_timeout = fail
    pump.engine.next_deadline = lambda: 0.0
    pump.settle()


@in_trio
async def test_a_failure_in_the_background_ends_the_body_and_leaves_as_itself(domain: int) -> None:
    failure = RuntimeError("a defect")
    with pytest.raises(RuntimeError) as caught:
        async with ddsi.DomainParticipant(domain) as participant:
            break_the_engine(participant, failure)
            await trio.sleep_forever()
    assert caught.value is failure


@in_trio
async def test_a_failure_in_the_background_does_not_hide_what_the_body_raised(domain: int) -> None:
    mistake = Mistake("mine")
    with pytest.raises(Mistake) as caught:
        async with ddsi.DomainParticipant(domain) as participant:
            break_the_engine(participant, RuntimeError("a defect"))
            with trio.CancelScope(shield=True):
                await trio.sleep(0.05)
            raise mistake
    assert caught.value is mistake
    assert "RuntimeError('a defect')" in mistake.__notes__[0]


@in_trio
async def test_of_two_nested_participants_only_the_one_that_failed_raises(domain: int) -> None:
    failure = RuntimeError("a defect")
    async with ddsi.DomainParticipant(domain) as outer:
        with pytest.raises(RuntimeError) as caught:
            async with ddsi.DomainParticipant(domain) as inner:
                break_the_engine(inner, failure)
                await trio.sleep_forever()
        assert caught.value is failure
        await trio.sleep(0.01)
        assert not outer.is_closed


@in_trio
async def test_close_inside_the_body_ends_the_participant_and_not_the_body(domain: int) -> None:
    steps = []
    async with ddsi.DomainParticipant(domain) as participant:
        participant.close()
        participant.close()
        await trio.sleep(0.01)
        steps.append("still here")
        with pytest.raises(ddsi.AlreadyDeleted):
            ddsi.Topic(participant, "Square", Shape)
    assert steps == ["still here"]


@in_trio
async def test_no_task_and_no_socket_stays(domain: int) -> None:
    async with ddsi.DomainParticipant(domain):
        pass  # what is opened once for the process is open now
    tasks, files = trio.lowlevel.current_statistics().tasks_living, open_files()
    for body in (None, Mistake("mine")):
        try:
            async with pair(domain) as p:
                await p.writer.write(Shape("RED"))
                if body is not None:
                    raise body
        except Mistake:
            pass
        assert trio.lowlevel.current_statistics().tasks_living == tasks
        assert open_files() == files


@in_trio
async def test_peers_see_a_participant_leave_at_once(domain: int) -> None:
    """By its goodbye, not by its lease of twenty seconds; whichever way it left."""
    async with ddsi.DomainParticipant(domain) as peer:
        writer = ddsi.DataWriter(peer, ddsi.Topic(peer, "Square", Shape))
        for mistake in (None, Mistake("mine")):
            try:
                async with ddsi.DomainParticipant(domain) as participant:
                    ddsi.DataReader(participant, ddsi.Topic(participant, "Square", Shape), RELIABLE)
                    await writer.wait_for_matched(timeout=5)
                    if mistake is not None:
                        raise mistake
            except Mistake:
                pass
            await eventually(lambda: not peer.discovered_participants(), seconds=1)
            assert writer.matched_subscriptions() == []
            assert writer.status(ddsi.PublicationMatched).current_count == 0
            assert peer.discovered_subscriptions() == []


@in_trio
async def test_leaving_lets_reliable_samples_arrive(domain: int) -> None:
    """What was written right before the end is not cut off by it."""
    async with ddsi.DomainParticipant(domain) as there:
        reader = ddsi.DataReader(there, ddsi.Topic(there, "Square", Shape), RELIABLE)
        async with ddsi.DomainParticipant(domain) as here:
            writer = ddsi.DataWriter(here, ddsi.Topic(here, "Square", Shape), RELIABLE)
            await writer.wait_for_matched(timeout=5)
            for number in range(500):
                await writer.write(Shape("RED", number))
        samples = [sample.data.x for sample in reader.take() if sample.info.valid_data]
        assert samples == list(range(500))


@in_trio
async def test_leaving_does_not_wait_long_for_a_reader_that_is_full(domain: int) -> None:
    limits = ddsi.Qos(resource_limits=ddsi.ResourceLimits(max_samples=1))
    async with ddsi.DomainParticipant(domain) as there:
        ddsi.DataReader(there, ddsi.Topic(there, "Square", Shape), RELIABLE | limits)
        async with ddsi.DomainParticipant(domain) as here:
            writer = ddsi.DataWriter(here, ddsi.Topic(here, "Square", Shape), RELIABLE)
            await writer.wait_for_matched(timeout=5)
            for number in range(3):
                await writer.write(Shape("RED", number))
            before = trio.current_time()
        assert trio.current_time() - before < 3
