"""Running an async test function from pytest without a plugin."""

from __future__ import annotations

import functools
from collections.abc import Awaitable, Callable
from typing import ParamSpec

import trio

__all__ = ["async_test"]

Params = ParamSpec("Params")


def async_test(test: Callable[Params, Awaitable[None]]) -> Callable[Params, None]:
    """An ordinary test function that runs ``test`` to its end in a trio loop of its own.

    Parameters pass through, so that fixtures and ``pytest.mark.parametrize`` work as with any function.
    """

    @functools.wraps(test)
    def run_to_the_end(*args: Params.args, **kwargs: Params.kwargs) -> None:
        trio.run(functools.partial(test, *args, **kwargs))

    return run_to_the_end
