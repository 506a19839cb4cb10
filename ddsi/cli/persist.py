"""``ddsi persist``: a persistence service, which keeps what durable writers write in a file.  DDS 1.4 §2.2.3.4."""

from __future__ import annotations

import argparse
import json
from pathlib import Path

import trio

from ..config.secure import secure
from ..dcps import DomainParticipant
from ..dcps.persistence_service import PersistenceService
from .arguments import add_domain, add_json, seconds
from .exit_status import ExitStatus
from .runner import run as run_async

__all__ = ["SUMMARY", "add_arguments", "run"]

SUMMARY = "keep what transient and persistent writers write, for readers that come when they are gone"

_LOOK_S = 0.2


def add_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("file", metavar="FILE", type=Path, help="where samples are kept; made if it does not exist")
    add_domain(parser)
    parser.add_argument(
        "-t",
        "--topic",
        action="append",
        metavar="PATTERN",
        help="serve topics of such names alone, as in 'Sensor*'; repeatable (default: all)",
    )
    parser.add_argument("--time", type=seconds, metavar="SECONDS", help="end after so long")
    parser.add_argument(
        "--secure",
        type=Path,
        metavar="DIR",
        help="with the identity and the rights in this folder, such as `ddsi keystore create` makes",
    )
    add_json(parser)


def run(arguments: argparse.Namespace) -> int:
    return run_async(lambda: _serve(arguments))


async def _serve(arguments: argparse.Namespace) -> int:
    qos = secure(arguments.secure) if arguments.secure is not None else None
    topics = tuple(arguments.topic or ("*",))
    async with (
        DomainParticipant(arguments.domain, qos=qos) as participant,
        PersistenceService(participant, arguments.file, topics=topics) as service,
    ):
        with trio.move_on_after(arguments.time) if arguments.time else trio.CancelScope():
            shown: object = None
            while True:
                counts, refusals = service.counts(), {topic.name: why for topic, why in service.refusals.items()}
                if (counts, refusals) != shown:
                    shown = counts, refusals
                    print(_text(counts, refusals, as_json=arguments.json), flush=True)
                await trio.sleep(_LOOK_S)
    return ExitStatus.OK


def _text(counts: dict[str, int], refusals: dict[str, str], *, as_json: bool) -> str:
    if as_json:
        return json.dumps({"samples": counts, "refused": refusals})
    kept = ", ".join(f"{topic}: {count}" for topic, count in sorted(counts.items()))
    refused = "".join(f"\n{topic} is not served: {why}" for topic, why in sorted(refusals.items()))
    return f"samples kept: {kept or 'none'}{refused}"
