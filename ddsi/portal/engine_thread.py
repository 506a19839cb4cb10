"""EngineThread: the one thread of a process in which trio runs for those who do not run it themselves.

Not part of DDS.  Goals, and how they are met:

- One thread for all participants of ``ddsi.blocking`` and ``ddsi.aio``: it starts with the first and ends with the
  last, so a program that has closed everything has no thread left.
- Nobody waits for anybody in a circle: the engine's thread never waits for another one, and no code of the
  application runs in it but the queries of conditions; a call that would come from there is refused.
- The end of the interpreter: the thread is a daemon, so it holds nobody up, and ``atexit`` has the participants that
  were forgotten say goodbye, as if they had been closed.
- A fork: the child has no such thread.  What the parent made is dead in the child, and says so; its sockets are
  closed there without a word, as they are the parent's.  A child may make participants of its own.
"""

from __future__ import annotations

import asyncio
import atexit
import logging
import os
import threading
from collections.abc import Awaitable, Callable
from contextlib import suppress
from functools import partial
from typing import TYPE_CHECKING, ParamSpec, TypeVar

import trio

from ..structure.errors import AlreadyDeleted, PreconditionNotMet
from .call import Call, Lane

if TYPE_CHECKING:
    from .stay import Stay

__all__ = ["EngineThread", "engine_thread"]

P = ParamSpec("P")
R = TypeVar("R")

_SECONDS_AT_EXIT = 3.0
_SECONDS_TO_END = 1.0
_LOOK_S = 0.05
_log = logging.getLogger("ddsi.portal")


class EngineThread:
    """Made by :func:`engine_thread`.  Methods are for other threads where nothing else is said."""

    def __init__(self) -> None:
        self._token: trio.lowlevel.TrioToken | None = None
        self._nursery: trio.Nursery | None = None
        self._stop = trio.Event()
        self._pending: set[Call[object]] = set()
        self._stays: dict[Stay, None] = {}
        self._places = 0
        self._ready = threading.Event()
        self._has_ended = False
        self._is_of_parent = False
        self._root: object = None
        self._thread = threading.Thread(target=self._run, name="ddsi engine", daemon=True)
        self._thread.start()
        self._ready.wait()

    @property
    def is_of_parent(self) -> bool:
        """Was this process forked off since?  Then there is no such thread in it."""
        return self._is_of_parent

    @property
    def has_ended(self) -> bool:
        return self._has_ended

    # --- calling -----------------------------------------------------------------------------------------

    def run_now(self, function: Callable[P, R], /, *args: P.args, **kwargs: P.kwargs) -> R:
        """Have ``function``, which must not wait, called in the engine's thread; returns or raises as it does."""
        done = threading.Lock()
        done.acquire()
        call = Call[R](partial(function, *args, **kwargs), partial(_release, done))
        self._submit(call, call.run_now)
        done.acquire()
        self._pending.discard(call)
        return call.outcome()

    def within(self, function: Callable[[], R]) -> R:
        """As :meth:`run_now`, also from the engine's thread itself."""
        return function() if threading.current_thread() is self._thread else self.run_now(function)

    def run(self, function: Callable[P, Awaitable[R]], /, *args: P.args, **kwargs: P.kwargs) -> R:
        """Have the async ``function`` run in the engine's thread, and wait for it.

        KeyboardInterrupt cancels it, and leaves when it has ended.
        """
        return self._wait_for(partial(function, *args, **kwargs), None)

    def run_in_lane(self, lane: Lane, function: Callable[[], Awaitable[None]]) -> None:
        """As :meth:`run`, after all that was put into the ``lane`` before."""
        self._wait_for(function, lane)

    def _wait_for(self, function: Callable[[], Awaitable[R]], lane: Lane | None) -> R:
        done = threading.Lock()
        done.acquire()
        call = Call[R](function, partial(_release, done))
        self._submit(call, partial(self._begin, call, lane))
        try:
            done.acquire()
        except BaseException:
            ended = threading.Event()
            self.post(partial(call.cancel, ended.set))
            while not (call.is_done or ended.wait(_LOOK_S)):  # nobody tells of it where the thread has just ended
                pass
            raise
        finally:
            self._pending.discard(call)
        return call.outcome()

    async def run_for_asyncio(self, function: Callable[P, Awaitable[R]], /, *args: P.args, **kwargs: P.kwargs) -> R:
        """As :meth:`run`, for a task of asyncio: its cancellation cancels ``function`` and leaves when that ended."""
        return await self._await(partial(function, *args, **kwargs), None)

    async def run_in_lane_for_asyncio(self, lane: Lane, function: Callable[[], Awaitable[None]]) -> None:
        """As :meth:`run_in_lane`, for a task of asyncio."""
        await self._await(function, lane)

    async def _await(self, function: Callable[[], Awaitable[R]], lane: Lane | None) -> R:
        try:
            loop = asyncio.get_running_loop()
        except RuntimeError:
            raise PreconditionNotMet(
                "entities of ddsi.aio live in asyncio, which does not run here: start the program by "
                "`asyncio.run(main())`, or take those of ddsi for trio, of ddsi.blocking for a plain script or thread"
            ) from None
        done = loop.create_future()
        call = Call[R](function, partial(_tell, loop, done))
        self._submit(call, partial(self._begin, call, lane))
        try:
            await done
        except asyncio.CancelledError:
            ended = loop.create_future()
            self.post(partial(call.cancel, partial(_tell, loop, ended)))
            while not (call.is_done or ended.done()):  # nobody tells of it where the thread has just ended
                with suppress(asyncio.CancelledError):  # once more; the first is raised below
                    await asyncio.wait((ended,), timeout=_LOOK_S)
            raise
        finally:
            self._pending.discard(call)
        return call.outcome()

    def _begin(self, call: Call[R], lane: Lane | None) -> None:
        if self._stop.is_set():
            call.fail(AlreadyDeleted("the participant's engine has ended"))
        elif lane is not None:
            lane.put(call)  # type: ignore[arg-type]  # a write: R is None
        else:
            assert self._nursery is not None
            self._nursery.start_soon(call.run, name="ddsi call")

    def _submit(self, call: Call[R], action: Callable[[], object]) -> None:
        """Have ``action`` called in the engine's thread, in the order of submission; it tells the ``call`` its end."""
        self._check_usable()
        assert self._token is not None
        self._pending.add(call)  # type: ignore[arg-type]  # whatever it returns
        with suppress(trio.RunFinishedError):
            self._token.run_sync_soon(action)
        if self._has_ended:  # it may have missed this call, and then never tells its end
            self._fail_pending()

    def _check_usable(self) -> None:
        if self._is_of_parent:
            raise PreconditionNotMet(
                "the participant was made before a fork, and its engine's thread stayed in the parent process; "
                "make participants after forking, in the process that uses them"
            )
        if threading.current_thread() is self._thread:
            raise PreconditionNotMet(
                "a blocking call from the engine's own thread would wait for itself; queries of conditions run there, "
                "and may look at the sample only"
            )

    # --- the thread --------------------------------------------------------------------------------------

    def _run(self) -> None:
        try:
            trio.run(self._main)
        except BaseException:
            _log.exception("the engine's thread ended by a defect; its participants are closed")
        finally:
            self._has_ended = True
            self._fail_pending()
            self._ready.set()

    async def _main(self) -> None:
        self._token = trio.lowlevel.current_trio_token()
        # Held, so that in the child of a fork the tasks of the parent are never unwound: they would act.
        self._root = trio.lowlevel.current_root_task()
        async with trio.open_nursery() as nursery:
            self._nursery = nursery
            self._ready.set()
            await self._stop.wait()
            nursery.cancel_scope.cancel()
        self._root = None

    def _fail_pending(self) -> None:
        for call in list(self._pending):
            call.fail(AlreadyDeleted("the participant's engine has ended"))

    def begin(self, function: Callable[[], Awaitable[None]]) -> None:
        """In the engine's thread, where a participant is: run ``function`` as a task of its own."""
        assert self._nursery is not None
        self._nursery.start_soon(function)

    # --- who is in it ------------------------------------------------------------------------------------

    def reserve(self) -> None:
        """Under the lock of :func:`engine_thread`: one more will be here."""
        self._places += 1

    def enter(self, stay: Stay) -> None:
        """In the engine's thread: that one is here."""
        self._stays[stay] = None

    def release(self, stay: Stay) -> None:
        """In the engine's thread: one is not here any more.  With the last one the thread ends."""
        self._stays.pop(stay, None)
        with _process.lock:
            self._places -= 1
            if self._places:
                return
            if _process.engine is self:
                _process.engine = None
        self._stop.set()

    def post(self, action: Callable[[], object]) -> None:
        """Have it called in the engine's thread, or not at all; never waits, so that finalizers may call it."""
        if self._token is not None and not self._is_of_parent:
            with suppress(trio.RunFinishedError):
                self._token.run_sync_soon(self._perform, action)

    @staticmethod
    def _perform(action: Callable[[], object]) -> None:
        try:
            action()
        except Exception:  # nobody waits for it, and raised here it would end the thread
            _log.exception("what was posted to the engine's thread failed")

    def join(self) -> None:
        """If all have left, wait for the thread's end, which is near."""
        if self._stop.is_set() and threading.current_thread() is not self._thread:
            self._thread.join(_SECONDS_TO_END)

    def end_at_exit(self) -> None:
        """The interpreter ends: all who are still here say goodbye."""

        def leave_all() -> None:
            for stay in list(self._stays):
                stay.begin_to_leave()

        self.post(leave_all)
        self._thread.join(_SECONDS_AT_EXIT)

    def abandon(self) -> None:
        """In the child of a fork: none of this is ours."""
        self._is_of_parent = True
        for stay in list(self._stays):
            stay.abandon()


def _release(lock: threading.Lock) -> None:
    """Wake the thread that waits for ``lock``.  It may be told twice, when the engine's thread ends meanwhile."""
    with suppress(RuntimeError):
        lock.release()


def _tell(loop: asyncio.AbstractEventLoop, future: asyncio.Future[None]) -> None:
    """From the engine's thread: wake the task of asyncio that waits for ``future``."""
    with suppress(RuntimeError):  # the loop is closed: nobody waits
        loop.call_soon_threadsafe(_wake, future)


def _wake(future: asyncio.Future[None]) -> None:
    if not future.done():
        future.set_result(None)


class _OfProcess:
    """The one engine's thread, if there is one, and what protects it.  Nothing is ever called under the lock."""

    def __init__(self) -> None:
        self.lock = threading.Lock()
        self.engine: EngineThread | None = None
        self.of_parents: list[EngineThread] = []  # kept for good, for the tasks in them: see `EngineThread._main`

    def end_at_exit(self) -> None:
        if self.engine is not None:
            self.engine.end_at_exit()

    def begin_in_child(self) -> None:
        self.lock = threading.Lock()  # another thread of the parent may have held it
        if self.engine is not None:
            self.engine.abandon()
            self.of_parents.append(self.engine)
            self.engine = None


_process = _OfProcess()
atexit.register(_process.end_at_exit)
if hasattr(os, "register_at_fork"):
    os.register_at_fork(after_in_child=_process.begin_in_child)


def engine_thread() -> EngineThread:
    """The thread of this process, started if need be, with a place for one participant, who releases it in the end."""
    with _process.lock:
        if _process.engine is None or _process.engine.has_ended:
            _process.engine = EngineThread()
        _process.engine.reserve()
        return _process.engine
