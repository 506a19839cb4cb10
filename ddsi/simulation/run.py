"""Running scenarios by their seeds and saying what happened: what ``ddsi sim`` does, without the command line.

Nothing is printed here; lines are given to a function, and events to a trace sink.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable

from ..trace.sink import TraceSink
from .network import SimulationStuck
from .scenario import Failure, Scenario

__all__ = ["run_seed", "run_seeds"]

Say = Callable[[str], object]


def run_seed(seed: int, say: Say, *, trace: TraceSink | None = None, explain: bool = True) -> bool:
    """Live through the scenario that the seed stands for; returns whether every invariant held.

    ``say`` is given a line of text at a time: with ``explain`` the plan first, and always how it ended.  A seed that
    fails is told with the command that replays it.
    """
    scenario = Scenario.from_seed(seed)
    if explain:
        for line in scenario.describe():
            say(line)
    try:
        report = scenario.run(trace)
    except (Failure, SimulationStuck) as failure:
        say(f"FAILED {failure}")
        return False
    say(str(report))
    return True


def run_seeds(seeds: Iterable[int], say: Say) -> list[int]:
    """Live through many, saying only how those ended that failed, and the count; returns the seeds that failed."""
    failed: list[int] = []
    count = 0
    for seed in seeds:
        count += 1
        if not run_seed(seed, lambda line: say(line) if line.startswith("FAILED") else None, explain=False):
            failed.append(seed)
    say(f"{count} seeds, {len(failed)} failed{': ' + ', '.join(map(str, failed)) if failed else ''}")
    return failed
