"""Turns what is missing on this machine into a skip that names it, or into a failure where peers are required."""

from __future__ import annotations

import os
import signal
from collections.abc import Generator

import pytest

from .framework import Unavailable

# A shell ignores SIGINT for what it starts in the background, and its children inherit that: tests of Ctrl-C would wait
# for ever.
if signal.getsignal(signal.SIGINT) is signal.SIG_IGN:
    signal.signal(signal.SIGINT, signal.default_int_handler)


def pytest_addoption(parser: pytest.Parser) -> None:
    parser.addoption(
        "--all-peers",
        action="store_true",
        help="play every case with every pair of peers, not the quick ones with ours",
    )


@pytest.hookimpl(wrapper=True)
def pytest_runtest_setup(item: pytest.Item) -> Generator[None, None, None]:
    yield from _judge_what_is_missing()


@pytest.hookimpl(wrapper=True)
def pytest_runtest_call(item: pytest.Item) -> Generator[None, None, None]:
    yield from _judge_what_is_missing()


def _judge_what_is_missing() -> Generator[None, None, None]:
    try:
        yield
    except Unavailable as error:
        if os.environ.get("DDSI_REQUIRE_PEERS") == "1":
            pytest.fail(f"required, but unavailable: {error}", pytrace=False)
        pytest.skip(str(error))
