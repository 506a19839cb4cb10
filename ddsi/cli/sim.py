"""``ddsi sim``: a domain of engines over a simulated network and clock; the same seed does the same, always.

``ddsi sim handshake`` walks through the meeting of two secured participants (:mod:`.sim_handshake`).  In both, every
second participant may play another vendor's (:mod:`ddsi.simulation.vendors`).

Without a scenario's name, the seed makes its own: participants, endpoints, weather, crashes.  Every run checks the
invariants of ``ddsi.simulation``; one that fails tells how to have it again.
"""

from __future__ import annotations

import argparse
import sys
from dataclasses import asdict
from json import dumps

from ..simulation import VENDORS, Domain, SimulationStuck, Vendor, invariants
from ..simulation.scenario import Failure, Scenario
from ..trace.event import TraceEvent
from ..trace.sequence_diagram import DEFAULT_CATEGORIES, sequence_diagram
from ..trace.sink import JsonLinesSink, TraceSink
from . import sim_handshake
from .arguments import add_json, count
from .exit_status import CommandError, ExitStatus
from .sim_scenarios import RANDOM, SCENARIOS, NamedScenario
from .terminal import can_print, terminal_width, uses_colour
from .trace import categories

__all__ = ["SUMMARY", "add_arguments", "run"]

SUMMARY = "run a scenario over a simulated network, from a seed"

VENDORS_BY_NAME = {vendor.name.lower().replace(" ", "-"): vendor for vendor in VENDORS}
_Vendors = tuple[Vendor | None, ...]
_HANDSHAKE = "handshake"
_REST_S = 60.0
_HIGHEST_SEED = (1 << 63) - 1


def add_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("walk", nargs="?", choices=(_HANDSHAKE,), metavar=_HANDSHAKE, help="walk through it; see below")
    parser.add_argument("--seed", type=_seed, default=0, metavar="N", help="what chance does (default: 0)")
    parser.add_argument(
        "--scenario",
        choices=(RANDOM, *SCENARIOS),
        default=RANDOM,
        metavar="NAME",
        help="see --list; default: the seed's own",
    )
    parser.add_argument("--list", action="store_true", help="name the scenarios and end")
    parser.add_argument("--count", type=count, default=1, metavar="N", help="so many seeds, from --seed upwards")
    parser.add_argument("--vendor", choices=tuple(VENDORS_BY_NAME), metavar="NAME",
                        help=f"every second participant plays {', '.join(VENDORS_BY_NAME)}")  # fmt: skip
    parser.add_argument("--plan", action="store_true", help="say what the seed's own scenario will do, and end")
    parser.add_argument("--diagram", action="store_true", help="draw everything that happens")
    parser.add_argument("--only", type=categories, default=DEFAULT_CATEGORIES, metavar="NAMES",
                        help="draw only these categories (ddsi trace --help names them)")  # fmt: skip
    parser.add_argument("--trace", metavar="FILE", help="write the trace as JSON lines, for ddsi trace FILE")
    add_json(parser)
    sim_handshake.add_arguments(parser)


def _seed(text: str) -> int:
    try:
        number = int(text)
    except ValueError:
        number = -1
    if not 0 <= number <= _HIGHEST_SEED:
        raise argparse.ArgumentTypeError(f"a seed is a whole number from 0 up, not {text!r}")
    return number


def run(arguments: argparse.Namespace) -> int:
    if arguments.walk == _HANDSHAKE:
        return _walk(arguments)
    if arguments.drop or arguments.step or arguments.keystore:
        raise CommandError("--drop, --step and --keystore are for ddsi sim handshake")
    if arguments.list:
        return _list()
    if arguments.plan:
        return _plan(arguments)
    if arguments.count > 1 and (arguments.diagram or arguments.trace):
        raise CommandError("--diagram and --trace are for one seed")
    failed = 0
    for seed in range(arguments.seed, arguments.seed + arguments.count):
        failed += not _run_seed(arguments, seed)
    return ExitStatus.NOT_AS_HOPED if failed else ExitStatus.OK


def _walk(arguments: argparse.Namespace) -> int:
    others = (arguments.list, arguments.plan, arguments.diagram, arguments.trace, arguments.json)
    if any(others) or arguments.count > 1 or arguments.scenario != RANDOM:
        raise CommandError("of the options for scenarios, ddsi sim handshake takes --seed and --vendor alone")
    return sim_handshake.run(arguments, VENDORS_BY_NAME.get(arguments.vendor))


def _list() -> int:
    print(f"{RANDOM:<12} whatever the seed makes up: participants, endpoints, weather, crashes (the default)")
    for scenario in SCENARIOS.values():
        print(f"{scenario.name:<12} {scenario.summary}")
    return ExitStatus.OK


def _plan(arguments: argparse.Namespace) -> int:
    if arguments.scenario != RANDOM:
        raise CommandError("only the seed's own scenario has a plan to show")
    print("\n".join(Scenario.from_seed(arguments.seed).describe()))
    return ExitStatus.OK


def _run_seed(arguments: argparse.Namespace, seed: int) -> bool:
    """Run it, draw what is wanted also of a run that fails, and say how it went; True if all held."""
    events: list[TraceEvent] = []
    sink: TraceSink | None = events.append if arguments.diagram or arguments.trace else None
    scenario = None if arguments.scenario == RANDOM else SCENARIOS[arguments.scenario]
    vendors = (None, VENDORS_BY_NAME[arguments.vendor]) if arguments.vendor else (None,)
    flaws: list[str] = []
    outcome: dict[str, object] = {}
    try:
        outcome = _play_random(seed, vendors, sink) if scenario is None else _play(scenario, seed, vendors, sink)
    except Failure as failure:
        flaws = failure.flaws
    except SimulationStuck as stuck:
        flaws = [str(stuck)]
    if arguments.trace:
        _write(arguments.trace, events)
    if arguments.diagram:
        _draw(arguments, events)
    _say(arguments, seed, outcome, flaws)
    return not flaws


def _play_random(seed: int, vendors: _Vendors, sink: TraceSink | None) -> dict[str, object]:
    report = Scenario.from_seed(seed).run(sink, vendors=vendors)
    return {**asdict(report), "text": str(report)}


def _play(scenario: NamedScenario, seed: int, vendors: _Vendors, sink: TraceSink | None) -> dict[str, object]:
    domain = Domain(seed, conditions=scenario.conditions, vendors=vendors, trace=sink)
    flaws = scenario.play(domain)
    if not flaws and not domain.run_until(lambda: invariants.is_at_rest(domain), _REST_S):
        flaws = ["it does not come to rest"]
    flaws += invariants.at_rest(domain) if not flaws else invariants.always(domain)
    if flaws:
        raise Failure(seed, scenario.name, flaws)
    text = f"seed {seed}, {scenario.name}: {domain.now:.1f} s of virtual time; every invariant held"
    return {"seed": seed, "seconds": domain.now, "text": text}


def _say(arguments: argparse.Namespace, seed: int, outcome: dict[str, object], flaws: list[str]) -> None:
    chosen = "" if arguments.scenario == RANDOM else f" --scenario {arguments.scenario}"
    chosen += f" --vendor {arguments.vendor}" if arguments.vendor else ""
    replay = f"ddsi sim --seed {seed}{chosen}"
    if arguments.json:
        details = {name: value for name, value in outcome.items() if name not in ("seed", "text")}
        form = {
            "seed": seed,
            "scenario": arguments.scenario,
            "ok": not flaws,
            "flaws": flaws,
            "replay": replay,
            **details,
        }
        print(dumps(form), flush=True)
    elif not flaws:
        print(outcome["text"], flush=True)
    if flaws:
        print(f"ddsi sim: seed {seed} failed; replay it: {replay} --diagram", file=sys.stderr)
        for flaw in flaws:
            print(f"  {flaw}", file=sys.stderr)


def _write(path: str, events: list[TraceEvent]) -> None:
    with open(path, "w", encoding="ascii", newline="\n") as stream:
        sink = JsonLinesSink(stream)
        for event in events:
            sink(event)


def _draw(arguments: argparse.Namespace, events: list[TraceEvent]) -> None:
    ascii_only = not can_print("├┄●✗▶")
    for line in sequence_diagram(
        events, width=terminal_width(), colour=uses_colour(), ascii_only=ascii_only, categories=arguments.only
    ):
        print(line)
