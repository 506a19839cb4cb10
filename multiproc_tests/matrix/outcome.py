"""Running one case with two peers in a namespace of its own, and how that ended."""

from __future__ import annotations

import tempfile
import time
from collections.abc import AsyncIterator, Iterator, Sequence
from contextlib import asynccontextmanager, contextmanager
from dataclasses import dataclass
from enum import Enum
from pathlib import Path

from ..framework import (
    Capture,
    DeadlineExceeded,
    ExpectationFailed,
    Namespace,
    Unavailable,
    capture,
    namespace,
    relayed_namespaces,
    scenario,
)
from ..peers.catalogue import OURS
from ..peers.peer import Peer
from .cases import Case
from .limits import known_limit
from .stories import Cast

__all__ = ["Outcome", "Verdict", "missing_ability", "play", "run_case"]

CASE_DEADLINE = 60.0
WEATHER_SEED = 20


class Verdict(Enum):
    """How a case ended; KNOWN is a failure that others have and that is explained (``limits.py``)."""

    PASSED = "passed"
    FAILED = "failed"
    KNOWN = "known limit"
    NOT_APPLICABLE = "not applicable"
    UNAVAILABLE = "unavailable"


@dataclass(frozen=True, slots=True)
class Outcome:
    """``reason`` is one line for everything but PASSED; ``transcript`` all that both processes said, of a failure."""

    case: str
    publisher: str
    subscriber: str
    verdict: Verdict
    seconds: float = 0.0
    reason: str = ""
    transcript: str = ""


def missing_ability(case: Case, *peers: Peer) -> str | None:
    """Why these peers cannot play the case, or None if they can."""
    if case.is_ours and not any(peer is OURS for peer in peers):
        return "it is about ours"
    for peer in peers:
        missing = sorted(need.value for need in case.needs - peer.abilities)
        if missing:
            return f"{peer.name} has no {', '.join(missing)}"
    return None


async def play(case: Case, publisher: Peer, subscriber: Peer, *, captures: Path | None = None) -> None:
    """Plays the case; raises what went wrong, with the transcript as a note, or Unavailable.

    With a folder for captures, what passed the wire is kept there.
    """
    publisher.locate()  # compiled before the clock runs
    subscriber.locate()
    title = f"{case.name}-{publisher}-{subscriber}"
    options = case.publisher_options(), case.subscriber_options()
    with _hosts(case) as (here, there), tempfile.TemporaryDirectory() as scratch:
        folder = captures if captures or case.evidence is None else Path(scratch)
        async with _capturing(here, folder, title) as captured, scenario(title, deadline=CASE_DEADLINE) as stage:
            await case.story(Cast(stage, here, there, publisher, subscriber, *options))
        if case.evidence is not None:
            assert captured is not None
            _check_evidence(case.evidence(captured))


@contextmanager
def _hosts(case: Case) -> Iterator[tuple[Namespace, Namespace]]:
    """One host for both, or two with bad weather between them; its record is a note of what then fails."""
    if case.weather is None:
        with namespace() as host:
            yield host, host
        return
    with relayed_namespaces("pub", "sub", weather=case.weather, seed=WEATHER_SEED) as (hosts, relay):
        try:
            yield hosts["pub"], hosts["sub"]
        except AssertionError as error:
            error.add_note(relay.report())
            raise


def _check_evidence(shortcomings: Sequence[str]) -> None:
    if shortcomings:
        raise ExpectationFailed(f"in the capture: {'; '.join(shortcomings)}")


@asynccontextmanager
async def _capturing(host: Namespace, folder: Path | None, title: str) -> AsyncIterator[Capture | None]:
    if folder is None:
        yield None
    else:
        folder.mkdir(parents=True, exist_ok=True)
        async with capture(host, folder / f"{title}.pcapng") as captured:
            yield captured


async def run_case(case: Case, publisher: Peer, subscriber: Peer, *, captures: Path | None = None) -> Outcome:
    """Plays the case and judges; never raises for what the peers do."""
    who = (case.name, publisher.name, subscriber.name)
    if reason := missing_ability(case, publisher, subscriber):
        return Outcome(*who, Verdict.NOT_APPLICABLE, reason=reason)
    began = time.monotonic()
    try:
        await play(case, publisher, subscriber, captures=captures)
    except Unavailable as error:
        return Outcome(*who, Verdict.UNAVAILABLE, reason=str(error))
    except (ExpectationFailed, DeadlineExceeded) as error:
        seconds = time.monotonic() - began
        transcript = "\n".join(getattr(error, "__notes__", []))
        if known := known_limit(case, publisher.name, subscriber.name):
            return Outcome(*who, Verdict.KNOWN, seconds, known, transcript)
        return Outcome(*who, Verdict.FAILED, seconds, str(error), transcript)
    return Outcome(*who, Verdict.PASSED, time.monotonic() - began)
