"""Hooks: what a participant without security pays for being able to have it.

The roles of throughput, with every call of the plaintext hooks counted; afterwards each of these calls is timed alone,
with what it was given last.
"""

from __future__ import annotations

import timeit
from collections import Counter
from collections.abc import Awaitable, Callable
from functools import partial, wraps
from typing import Any

import trio

from ddsi.spi.plaintext import PLAINTEXT, Plaintext

from . import ours
from .protocol import play

_REPEATS = 200
_CALLS_A_REPEAT = 1_000

_calls: Counter[str] = Counter()
_given: dict[str, tuple[tuple[Any, ...], dict[str, Any]]] = {}


def _count(name: str) -> None:
    hook = getattr(Plaintext, name)

    @wraps(hook)
    def counted(self: Plaintext, *given: Any, **named: Any) -> Any:
        _calls[name] += 1
        _given[name] = given, named
        return hook(self, *given, **named)

    setattr(Plaintext, name, counted)


def _counted(role: Callable[..., Awaitable[dict[str, float]]]) -> Callable[..., dict[str, float]]:
    """The role, which returns ``calls`` of hooks for a sample and the microseconds ``hooks_us`` that these take."""

    def run(count: int, **options: object) -> dict[str, float]:
        hooks = {name: getattr(PLAINTEXT, name) for name in vars(Plaintext) if not name.startswith("_")}
        for name in hooks:
            _count(name)
        trio.run(partial(role, count=count, **options))
        calls = {name: number for name, number in _calls.items() if number > count / 100}  # the others come with time
        seconds = sum(number * _seconds(hooks[name], *_given[name]) for name, number in calls.items())
        return {
            "calls": sum(calls.values()) / count,
            "hooks_us": seconds / count * 1e6,
        }

    return run


def _seconds(hook: Callable[..., object], given: tuple[Any, ...], named: dict[str, Any]) -> float:
    """Of one call, the loop around it included."""
    values = {f"given_{place}": value for place, value in enumerate(given)} | named
    arguments = [*list(values)[: len(given)], *(f"{name}={name}" for name in named)]
    timer = timeit.Timer(f"hook({', '.join(arguments)})", globals={"hook": hook, **values})
    return min(timer.repeat(_REPEATS, _CALLS_A_REPEAT)) / _CALLS_A_REPEAT


if __name__ == "__main__":
    play({"receive": _counted(ours.receive), "send": _counted(ours.send)})
