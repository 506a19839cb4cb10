"""A writer that outruns its reader ten to one: what is promised arrives, and nobody's memory grows.

The reader takes ten samples a second, the writer would write a hundred.  With KEEP_ALL it has to wait, and everything
arrives; with KEEP_LAST it goes on, and of what it replaced something is missing, but not the last.  An ordinary run
lasts some seconds and plays ours, and some with others; ``--all-peers`` plays a minute with everybody.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import pytest

from .framework import Process, async_test, namespace, scenario
from .matrix.stories import Cast, dismiss, written
from .peers.catalogue import CYCLONE_C, FAST_DDS, FOREIGN, OURS
from .peers.options import Options
from .peers.peer import Peer

READ_PAUSE_MS, WRITE_PAUSE_MS = 100, 10
MAX_GROWTH_OCTETS = 24 << 20
"""Less than half of what is written in the shorter run; limits and buffers on the way hold a few MiB."""

SHORT, LONG = 6, 60  # seconds
KEEP_ALL = Options(
    topic="Blob", blob_octets=1_000_000, keyless=True, volatile=True, gate=True, max_samples=5,
    interval_ms=WRITE_PAUSE_MS, read_pause_ms=READ_PAUSE_MS,
)  # fmt: skip
KEEP_LAST = replace(KEEP_ALL, blob_octets=100_000, max_samples=None, depth=5)
QUICK = {("keep-all", "ddsi", "cyclone"), ("keep-all", "fastdds", "ddsi"), ("keep-last", "cyclone", "ddsi")}
PARTNERS = (OURS, CYCLONE_C, FAST_DDS)


def _pairs(history: str, *, plays_all: bool) -> Iterator[tuple[Peer, Peer]]:
    for publisher in PARTNERS:
        for subscriber in PARTNERS:
            is_quick = (history, publisher.name, subscriber.name) in QUICK or publisher is subscriber is OURS
            if OURS in (publisher, subscriber) and (plays_all or is_quick):
                yield publisher, subscriber


def pytest_generate_tests(metafunc: pytest.Metafunc) -> None:
    if metafunc.fixturenames[:3] != ["publisher", "subscriber", "seconds"]:
        return
    plays_all = bool(metafunc.config.getoption("--all-peers", default=False))
    history = "keep-all" if metafunc.function is test_who_keeps_all_waits_for_its_reader else "keep-last"
    chosen = [
        pytest.param(
            *pair,
            LONG if plays_all else SHORT,
            id=f"{pair[0]}-{pair[1]}",
            marks=[pytest.mark.peers] if set(pair) & set(FOREIGN) else [],
        )
        for pair in _pairs(history, plays_all=plays_all)
    ]
    metafunc.parametrize(("publisher", "subscriber", "seconds"), chosen)


@async_test
async def test_who_keeps_all_waits_for_its_reader(publisher: Peer, subscriber: Peer, seconds: int) -> None:
    """Back-pressure: the writer writes as fast as the reader takes, and every sample arrives."""
    count = seconds * 1000 // READ_PAUSE_MS
    pub, sub = await overrun(publisher, subscriber, replace(KEEP_ALL, count=count), last=count - 1)
    taken = [line for line in sub.lines if line.stream == "out" and line.text.startswith("SAMPLE")]
    assert [line.text.removeprefix("SAMPLE ") for line in taken] == written(pub)
    times = [line.at for line in pub.lines if line.text.startswith("WROTE")]
    assert times[-1] - times[0] > 0.5 * seconds, "the writer was never held up, so this proves nothing"


@async_test
async def test_who_keeps_the_last_goes_on(publisher: Peer, subscriber: Peer, seconds: int) -> None:
    """What is replaced is gone; what is delivered comes once and in order, up to the last."""
    count = seconds * 1000 // WRITE_PAUSE_MS
    pub, sub = await overrun(publisher, subscriber, replace(KEEP_LAST, count=count), last=count - 1)
    everything = iter(written(pub))
    received = [match[1] for match in sub.matches("SAMPLE (.*)")]
    assert all(sample in everything for sample in received)  # `in` moves the iterator on: order and number matter
    assert received[-1] == written(pub)[-1]
    assert len(received) < count / 2, "the reader was never outrun, so this proves nothing"


async def overrun(publisher: Peer, subscriber: Peer, options: Options, *, last: int) -> tuple[Process, Process]:
    """Both, when the reader has taken the sample of that number; their memory was bounded."""
    publisher.locate()
    subscriber.locate()
    with namespace() as host:
        async with scenario(f"overrun {publisher}-{subscriber}", deadline=60 + 4 * LONG) as stage:
            patient = replace(options, wait_s=60 + 2 * LONG)
            cast = Cast(stage, host, host, publisher, subscriber, patient, replace(patient, count=1))
            sub = await cast.start_subscriber()
            pub = await cast.start_publisher()
            await pub.expect("MATCHED 1", timeout=cast.patience)
            await sub.expect("MATCHED 1", timeout=cast.patience)
            before = [resident_octets(process, "VmRSS") for process in (pub, sub)]
            await pub.send("write")
            await sub.expect(f"SAMPLE {last} .*", timeout=cast.patience)
            await pub.expect("ACKED", timeout=cast.patience)
            peak = [resident_octets(process, "VmHWM") for process in (pub, sub)]
            for process, low, high in zip((pub, sub), before, peak, strict=True):
                assert high - low < MAX_GROWTH_OCTETS, f"{process.name} grew from {low >> 20} to {high >> 20} MiB"
            await dismiss(sub)
            await dismiss(pub)
    return pub, sub


def resident_octets(process: Process, field: str) -> int:
    """``VmRSS``: what it has in memory; ``VmHWM``: the most that it ever had.  proc(5)"""
    for line in Path(f"/proc/{process.pid}/status").read_text().splitlines():
        name, _, value = line.partition(":")
        if name == field:
            return int(value.split()[0]) * 1024
    raise LookupError(f"{process.name} has no {field}")
