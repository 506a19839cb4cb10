"""Workers: real processes that are listened to, and ended by their deadline."""

from __future__ import annotations

import time

import pytest

from benchmarks.worker import Worker, WorkerFailed


def floor(role: str, *, seconds: float, **options: object) -> Worker:
    return Worker("benchmarks.sides.floor", role, options, tag="test", deadline=time.monotonic() + seconds)


@pytest.mark.slow
def test_a_role_gives_its_result() -> None:
    with floor("datagram", seconds=30, count=10) as worker:
        assert worker.result()["us"] > 0


@pytest.mark.slow
def test_a_role_that_fails_says_why() -> None:
    with floor("no_such_role", seconds=30) as worker, pytest.raises(WorkerFailed, match=r"status 1(.|\n)*no_such_role"):
        worker.result()


@pytest.mark.slow
def test_a_silent_role_is_ended_at_the_deadline() -> None:
    """An echo never has a result; it is ready, and then it waits."""
    start = time.monotonic()
    with floor("echo", seconds=1.5, domain=99, count=1) as worker, pytest.raises(WorkerFailed, match="deadline"):
        worker.result()
    assert time.monotonic() - start < 10
