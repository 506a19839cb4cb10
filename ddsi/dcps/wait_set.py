"""WaitSet: waits for any of several conditions, of whatever entities of a program.  DDS 1.4 §2.2.2.1.6."""

from __future__ import annotations

import trio

from ..structure.errors import BadParameter, DdsTimeout, PreconditionNotMet
from .conditions import Condition
from .entity import deadline_scope

__all__ = ["WaitSet"]


class WaitSet:
    """``await WaitSet(condition, other).wait()`` returns those that hold, as soon as one does."""

    def __init__(self, *conditions: Condition) -> None:
        # A dict serves as an ordered set.
        self._conditions: dict[Condition, None] = {}
        self._attached = trio.lowlevel.ParkingLot()
        for condition in conditions:
            self.attach(condition)

    def __repr__(self) -> str:
        return f"<WaitSet of {len(self._conditions)} conditions>"

    @property
    def conditions(self) -> tuple[Condition, ...]:
        """What it waits for, in the order in which it was attached."""
        return tuple(self._conditions)

    def attach(self, condition: Condition) -> None:
        """Wait for this one too, at once if somebody waits.  Twice is once.  Raises BadParameter."""
        if not isinstance(condition, Condition):
            raise BadParameter(f"a WaitSet waits for conditions, not for {condition!r}")
        try:
            condition._lot()
        except PreconditionNotMet as error:
            raise BadParameter(str(error)) from error
        self._conditions[condition] = None
        self._attached.unpark_all()

    def detach(self, condition: Condition) -> None:
        """Wait for this one no more.  Raises PreconditionNotMet if it was not attached."""
        if condition not in self._conditions:
            raise PreconditionNotMet(f"{condition!r} is not attached to this WaitSet")
        del self._conditions[condition]

    async def wait(self, timeout: float | None = None) -> list[Condition]:
        """The conditions that hold, in the order in which they were attached; waits until one does.

        Raises DdsTimeout after ``timeout`` seconds, AlreadyDeleted when an entity that it waits for is closed.
        """
        scope = deadline_scope(timeout)
        await trio.lowlevel.checkpoint()
        with scope:
            while not (holding := [condition for condition in self._conditions if condition.trigger_value]):
                await self._until_something_changes()
            return holding
        raise DdsTimeout(f"none of {len(self._conditions)} conditions has come to hold within {timeout} s")

    async def _until_something_changes(self) -> None:
        """One task waits for each entity; the first that is woken ends them all."""
        by_lot: dict[trio.lowlevel.ParkingLot, list[Condition]] = {self._attached: []}
        for condition in self._conditions:
            by_lot.setdefault(condition._lot(), []).append(condition)
        conditions = list(self._conditions)
        async with trio.open_nursery() as nursery:

            async def until_woken(lot: trio.lowlevel.ParkingLot, of_lot: list[Condition]) -> None:
                for condition in of_lot:
                    condition._before_waiting()
                # It may have happened before this task got its turn.
                if not any(_may_hold(condition) for condition in of_lot) and conditions == list(self._conditions):
                    await lot.park()
                nursery.cancel_scope.cancel()

            for lot, of_lot in by_lot.items():
                nursery.start_soon(until_woken, lot, of_lot)


def _may_hold(condition: Condition) -> bool:
    """Is it worth looking?  What an entity that is closed, or a query, raises the one who waits shall hear, and no task
    that would wrap it."""
    if condition._is_void:
        return True
    try:
        return condition.trigger_value
    except Exception:
        return True
