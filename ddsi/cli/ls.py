"""``ddsi ls``: who is there.  Joins the domain, listens, and lists participants, topics and endpoints."""

from __future__ import annotations

import argparse
import json
import sys
import time
from typing import get_args

import trio

from ..dcps import DomainParticipant
from ..dcps.explaining import pairs_seen
from ..structure.qos import Qos
from .arguments import add_domain, add_json, add_listening
from .census import Census, Selection, take_census
from .census_changes import changes
from .census_json import census_json
from .census_tables import View, census_lines
from .exit_status import ExitStatus
from .listening import listen, observer, with_types
from .runner import run as run_async
from .terminal import Screen, is_terminal

__all__ = ["SUMMARY", "add_arguments", "run"]

SUMMARY = "list participants, topics and endpoints of a domain"

_SETTLING_S = 0.2
"""A participant's endpoints come in a burst: they are shown together."""
_REFRESH_S = 1.0
"""Counters change without discovery; a window may be resized."""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("what", nargs="?", choices=get_args(View), help="list only these (default: all three)")
    add_domain(parser)
    add_listening(parser)
    add_json(parser)
    parser.add_argument("--watch", action="store_true", help="go on and show what changes, until Ctrl+C or --time")
    parser.add_argument("--stats", action="store_true", help="also show what was received and dropped, by reason")
    chosen = parser.add_argument_group("choose", "Patterns as in a shell: * ? [abc].")
    chosen.add_argument("--topic", default="", metavar="PATTERN", help="endpoints of these topics")
    chosen.add_argument("--type", default="", dest="type_name", metavar="PATTERN", help="endpoints of these types")
    chosen.add_argument(
        "--participant", default="", metavar="TEXT", help="these participants: name, host, or how the prefix begins"
    )
    chosen.add_argument("--vendor", default="", metavar="TEXT", help="participants of vendors with this in their name")


def run(arguments: argparse.Namespace) -> int:
    return run_async(_Listing(arguments).run)


class _Listing:
    """One run of the command."""

    def __init__(self, arguments: argparse.Namespace) -> None:
        self._arguments = arguments
        self._views: tuple[View, ...] = (arguments.what,) if arguments.what else get_args(View)
        self._selection = Selection(
            topic=arguments.topic,
            type_name=arguments.type_name,
            participant=arguments.participant,
            vendor=arguments.vendor,
        )

    async def run(self) -> int:
        arguments = self._arguments
        async with observer(arguments.domain, Qos(entity_name="ddsi ls")) as participant:
            if not arguments.watch:
                await listen(participant, arguments.time)
                census = await with_types(participant, lambda: self._census(participant))
                print("\n".join(self._lines(census, participant)))
                if not participant.discovered_participants():
                    print("ddsi ls: nobody answered; `ddsi doctor` looks at this host's network", file=sys.stderr)
                return ExitStatus.OK
            with trio.move_on_after(arguments.time) if arguments.time else trio.CancelScope():
                await self._watch(participant)
            return ExitStatus.OK

    async def _watch(self, participant: DomainParticipant) -> None:
        if self._arguments.json:
            await self._watch_as_json(participant)
        elif is_terminal():
            with Screen() as screen:
                while True:
                    screen.paint(self._lines(self._census(participant), participant))
                    await _change(participant)
        else:
            await self._watch_as_lines(participant)

    async def _watch_as_json(self, participant: DomainParticipant) -> None:
        """The whole structure on one line, at first and whenever it has changed."""
        said = None
        while True:
            line = json.dumps(census_json(self._census(participant), self._drop_counts(participant)))
            if line != said:
                print(line, flush=True)
                said = line
            await _change(participant)

    async def _watch_as_lines(self, participant: DomainParticipant) -> None:
        known = Census(participant.domain_id, ())
        while True:
            census = self._census(participant)
            for change in changes(known, census):
                print(time.strftime("%H:%M:%S"), change, flush=True)
            known = census
            await _change(participant)

    def _lines(self, census: Census, participant: DomainParticipant) -> list[str]:
        drop_counts = self._drop_counts(participant)
        if self._arguments.json:
            return [json.dumps(census_json(census, drop_counts), indent=2)]
        return census_lines(census, self._views, drop_counts)

    def _census(self, participant: DomainParticipant) -> Census:
        if self._views == ("participants",) and not self._arguments.json:  # nobody is compared with anybody
            return take_census(participant).select(self._selection)
        return take_census(participant, *pairs_seen(participant, self._selection.topic)).select(self._selection)

    def _drop_counts(self, participant: DomainParticipant) -> dict[str, int] | None:
        return dict(participant.drop_counts()) if self._arguments.stats else None


async def _change(participant: DomainParticipant) -> None:
    """Until discovery has brought something and the burst is over, or the time to look again has come."""
    with trio.move_on_after(_REFRESH_S):
        await participant.wait_for_discovery()
        await trio.sleep(_SETTLING_S)
