"""The engine's thread: it ends with the last participant, and no call is left without an answer."""

from __future__ import annotations

import asyncio
import threading
from functools import partial

import pytest
import trio
import trio.testing

from ddsi.dcps import DomainParticipant
from ddsi.portal.call import Call, Lane
from ddsi.portal.engine_thread import EngineThread, engine_thread
from ddsi.portal.stay import Stay
from ddsi.structure.errors import AlreadyDeleted


class Staying:
    """The thread, with a participant in it so that it does not end."""

    def __init__(self, domain: int) -> None:
        self.engine: EngineThread = engine_thread()
        self.stay = Stay(self.engine, DomainParticipant(domain))
        self.engine.run(self.stay.enter)

    def __enter__(self) -> EngineThread:
        return self.engine

    def __exit__(self, *_: object) -> None:
        self.engine.run(partial(self.stay.leave, at_once=True))
        self.engine.join()


async def _fails() -> None:
    raise ZeroDivisionError("by mistake")


def test_what_is_raised_comes_through_as_the_very_object_and_the_thread_lives_on(domain: int) -> None:
    error = BaseException("the one")

    def fails() -> None:
        raise error

    with Staying(domain) as engine:
        with pytest.raises(BaseException, match="the one") as caught:
            engine.run_now(fails)
        assert caught.value is error
        with pytest.raises(ZeroDivisionError):
            engine.run(_fails)
        with pytest.raises(ZeroDivisionError):
            asyncio.run(engine.run_for_asyncio(_fails))
        assert engine.run_now(threading.current_thread).name == "ddsi engine"


def test_a_posted_action_that_fails_is_logged_and_the_thread_lives_on(
    domain: int, caplog: pytest.LogCaptureFixture
) -> None:
    def fails() -> None:
        raise RuntimeError("nobody waits")

    with Staying(domain) as engine:
        engine.post(fails)
        assert engine.run_now(lambda: 7) == 7
    assert "nobody waits" in caplog.text


def test_calls_that_come_when_the_thread_ends_or_has_ended_are_answered(domain: int) -> None:
    with Staying(domain) as engine:
        waiting = threading.Thread(target=pytest.raises, args=(AlreadyDeleted, engine.run, trio.sleep_forever))
        waiting.start()
        asked = [0]

        def ask() -> None:
            with pytest.raises(AlreadyDeleted):
                while True:
                    engine.run(trio.lowlevel.checkpoint)
                    asked[0] += 1

        asking = [threading.Thread(target=ask) for _ in range(3)]
        for thread in asking:
            thread.start()
        while asked[0] < 20:
            engine.run_now(lambda: None)
    for thread in [waiting, *asking]:
        thread.join(10)
        assert not thread.is_alive()
    assert engine.has_ended
    with pytest.raises(AlreadyDeleted):
        engine.run_now(lambda: None)
    with pytest.raises(AlreadyDeleted):
        asyncio.run(engine.run_for_asyncio(trio.sleep, 0))
    engine.post(lambda: None)


def test_a_thread_that_begins_anew_is_another_one(domain: int) -> None:
    with Staying(domain) as first:
        pass
    with Staying(domain) as second:
        assert second is not first


def test_a_lane_does_one_call_after_the_other_in_order_and_skips_those_that_are_cancelled() -> None:
    done: list[object] = []

    async def step(number: int) -> None:
        await trio.lowlevel.checkpoint()
        done.append(number)

    async def main() -> None:
        lane = Lane()
        calls = [Call[None](partial(step, number), partial(done.append, f"end {number}")) for number in range(4)]
        for call in calls:
            lane.put(call)
        calls[2].cancel(partial(done.append, "cancelled"))
        async with trio.open_nursery() as nursery:
            nursery.start_soon(lane.run)
            while len(done) < 7:
                await trio.lowlevel.checkpoint()
            lane.close()
        late = Call[None](partial(step, 9), partial(done.append, "late"))
        lane.put(late)
        with pytest.raises(AlreadyDeleted):
            late.outcome()

    trio.run(main)
    assert done == ["cancelled", 0, "end 0", 1, "end 1", 3, "end 3", "late"]


def test_calls_that_wait_in_a_lane_fail_when_it_closes() -> None:
    told: list[str] = []

    async def main() -> None:
        lane = Lane()
        waiting = Call[None](trio.sleep_forever, partial(told.append, "first"))
        behind = Call[None](trio.sleep_forever, partial(told.append, "second"))
        lane.put(waiting)
        lane.put(behind)
        async with trio.open_nursery() as nursery:
            nursery.start_soon(lane.run)
            await trio.testing.wait_all_tasks_blocked()
            nursery.cancel_scope.cancel()
        for call in (waiting, behind):
            with pytest.raises(AlreadyDeleted):
                call.outcome()

    trio.run(main)
    assert told == ["first", "second"]
