"""``ddsi-shape-main``: the program that the OMG's interoperability suite for DDS-RTPS runs, over this stack.

Its options, its lines and its exit statuses are those of every vendor's ``shape_main``
(https://github.com/omg-dds/dds-rtps), so that the suite's scripts drive it against any of them.  The network comes from
``DDSI_URI``; there is no option for it.
"""

from __future__ import annotations

import io
import signal
import sys
from collections.abc import AsyncIterator, Sequence
from dataclasses import fields
from enum import IntEnum

import trio

from ..config.environment import load_config
from ..dcps import DomainParticipant, Topic
from ..structure.errors import DdsError
from .runner import abandon_output
from .shape_main_options import OptionError, ShapeMainOptions, option_parser, parse_options, warnings
from .shape_main_qos import participant_config
from .shape_main_roles import PublishingRole, Role, SubscribingRole
from .shape_types import Shape

__all__ = ["ShapeMainStatus", "main"]


class ShapeMainStatus(IntEnum):
    """What the shell gets, in the suite's numbers."""

    OK = 0
    ARGUMENTS = 1
    INITIALIZING = 2
    RUNNING = 3


def main(words: Sequence[str] | None = None) -> int:
    """Run the command line ``words`` (default: the process's own) and return the exit status."""
    if words is None:
        # What the suite asks for at the end may come once more while the interpreter is being cleared up: it was done.
        signal.signal(signal.SIGINT, signal.SIG_IGN)
    if isinstance(sys.stdout, io.TextIOWrapper):  # whoever reads a pipe waits for each line
        sys.stdout.reconfigure(line_buffering=True, errors="replace")
    try:
        options = parse_options(sys.argv[1:] if words is None else words)
    except OptionError as error:
        print(f"{error}\n{option_parser().format_help()}")
        return ShapeMainStatus.ARGUMENTS
    for warning in warnings(options):
        print(warning)
    if options.is_verbose:
        for item in fields(options):
            print(f"    {item.name} = {getattr(options, item.name)!r}")
    try:
        return trio.run(_play, options)
    except* BrokenPipeError:
        abandon_output()
    return ShapeMainStatus.RUNNING


async def _play(options: ShapeMainOptions) -> int:
    """Until all rounds are played, or a signal asks for the end: then what is under way is finished and said."""
    end = trio.Event()
    with trio.open_signal_receiver(signal.SIGINT, signal.SIGTERM) as signals:
        async with trio.open_nursery() as nursery:
            nursery.start_soon(_end_on_signal, signals, end)
            status = await _join(options, end)
            nursery.cancel_scope.cancel()
    if status == ShapeMainStatus.OK:
        print("Done.")
    return status


async def _end_on_signal(signals: AsyncIterator[int], end: trio.Event) -> None:
    async for _ in signals:
        end.set()


async def _join(options: ShapeMainOptions, end: trio.Event) -> ShapeMainStatus:
    try:
        config = participant_config(options, load_config(options.domain))
        async with DomainParticipant(options.domain, config=config) as participant:
            return await _play_role(options, end, participant)
    except (DdsError, OSError) as error:
        print(f"failed to create participant: {error}")
        return ShapeMainStatus.INITIALIZING


async def _play_role(options: ShapeMainOptions, end: trio.Event, participant: DomainParticipant) -> ShapeMainStatus:
    role = (PublishingRole if options.publishes else SubscribingRole)(options, end)
    async with trio.open_nursery() as nursery:
        status = _create(role, participant, nursery)
        if status == ShapeMainStatus.OK:
            try:
                await role.run()
            except DdsError as error:
                print(f"failed: {error}")
                status = ShapeMainStatus.RUNNING
        nursery.cancel_scope.cancel()
    return status


def _create(role: Role, participant: DomainParticipant, nursery: trio.Nursery) -> ShapeMainStatus:
    """Topics and endpoints, each said before it is made, as the suite waits for the words."""
    topics: list[Topic[Shape]] = []
    try:
        for name in role.options.topics():
            print(f"Create topic: {name}")
            topics.append(Topic(participant, name, role.form.type))
        role.create(topics, participant, nursery)
    except DdsError as error:
        print(f"failed to create: {error}")
        return ShapeMainStatus.INITIALIZING
    return ShapeMainStatus.OK


if __name__ == "__main__":
    sys.exit(main())
