"""The options of ``ddsi-shape-main``: those of every vendor's ``shape_main`` in the OMG's interoperability suite.

The letters, words, defaults and bounds are the suite's, so that its scripts can start this program as any other.
"""

from __future__ import annotations

import argparse
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Literal, NoReturn

from ..structure.qos_policies import DataRepresentationId

__all__ = ["FinalInstanceState", "OptionError", "ShapeMainOptions", "option_parser", "parse_options", "warnings"]

FinalInstanceState = Literal["u", "d"]

DEFAULT_COLOR = "BLUE"
_LARGEST_FRAGMENT = 65535
_HIGHEST_INT = (1 << 31) - 1


class OptionError(Exception):
    """The command line cannot be meant; the text is one sentence."""


@dataclass(frozen=True, slots=True, kw_only=True)
class ShapeMainOptions:
    """What the command line asks for.  Periods, intervals and durations are milliseconds; 0 is off unless said."""

    publishes: bool
    topic: str
    is_verbose: bool = False
    domain: int = 0
    is_reliable: bool = True
    history_depth: int = -1
    """-1: the OMG's default, KEEP_LAST 1; 0: KEEP_ALL."""
    deadline_ms: int = 0
    ownership_strength: int = -1
    """-1: shared; else exclusive, and with this strength when publishing."""
    color: str | None = None
    """The colour to write; what a subscriber filters by."""
    partition: str | None = None
    durability: str = "v"
    representation: DataRepresentationId = DataRepresentationId.XCDR1
    prints_written: bool = False
    size: int = 20
    """0: begins at 1 and grows by one a round."""
    reads: bool = False
    """Read samples instead of taking them."""
    write_period_ms: int = 33
    read_period_ms: int = 100
    time_filter_ms: int = 0
    lifespan_ms: int = 0
    num_iterations: int = 0
    """0: until SIGINT."""
    num_instances: int = 1
    num_topics: int = 1
    final_instance_state: FinalInstanceState | None = None
    access_scope: str | None = None
    is_coherent: bool = False
    is_ordered: bool = False
    coherent_sample_count: int = 0
    payload_octets: int = 0
    by_instance: bool = True
    """Read instance after instance, not in the order of arrival."""
    announcement_ms: int = 0
    fragment_octets: int = 0
    """0: what fills a message."""
    filter_expression: str | None = None
    size_modulo: int = 0
    """Above 0: a growing size runs from 1 to this and begins again."""

    def topics(self) -> tuple[str, ...]:
        """``Square``, ``Square1``, ..."""
        return _numbered(self.topic, self.num_topics)

    def colors(self) -> tuple[str, ...]:
        """The instances of a publisher: ``BLUE``, ``BLUE1``, ..."""
        return _numbered(self.color or DEFAULT_COLOR, self.num_instances)


def _numbered(name: str, count: int) -> tuple[str, ...]:
    return tuple(f"{name}{number or ''}" for number in range(count))


def parse_options(words: Sequence[str]) -> ShapeMainOptions:
    """Read the command line.  Raises OptionError; ``-h`` prints the help and raises SystemExit(0)."""
    given = option_parser().parse_args(words)
    chosen = {name: value for name, value in vars(given).items() if name not in ("publish", "subscribe")}
    if given.topic is None:
        raise OptionError("please specify topic name [-t]")
    if given.publish == given.subscribe:
        raise OptionError("please specify either publish [-P] or subscribe [-S]")
    if given.subscribe and given.color is not None and given.filter_expression is not None:
        raise OptionError("a subscriber is given either [-c] or [--cft]")
    return ShapeMainOptions(publishes=given.publish, **chosen)


def warnings(options: ShapeMainOptions) -> list[str]:
    """What was asked for and means nothing in this role, a sentence for each."""
    ignored: list[tuple[bool, str]] = [
        (options.publishes and options.time_filter_ms > 0, "--time-filter"),
        (options.publishes and options.reads, "-R"),
        (options.publishes and not options.by_instance, "--take-read"),
        (options.publishes and options.filter_expression is not None, "--cft"),
        (not options.publishes and options.size != 20, "-z"),
        (not options.publishes and options.lifespan_ms > 0, "--lifespan"),
        (not options.publishes and options.num_instances > 1, "--num-instances"),
        (not options.publishes and options.final_instance_state is not None, "--final-instance-state"),
        (not options.publishes and options.coherent_sample_count > 0, "--coherent-sample-count"),
        (not options.publishes and options.payload_octets > 0, "--additional-payload-size"),
    ]
    role = "publishers" if options.publishes else "subscribers"
    found = [f"warning: {option} means nothing to {role}" for is_given, option in ignored if is_given]
    if options.publishes and options.color is None:
        found.insert(0, f'warning: color was not specified, defaulting to "{DEFAULT_COLOR}"')
    if options.size_modulo and options.size:
        found.append("warning: --size-modulo needs -z 0")
    return found


class _Parser(argparse.ArgumentParser):
    def error(self, message: str) -> NoReturn:
        raise OptionError(message)


def option_parser() -> argparse.ArgumentParser:
    """Reads the words as getopt_long does, long options by any unambiguous beginning."""
    parser = _Parser(
        prog="ddsi-shape-main",
        description="Publish or subscribe shapes as the OMG's interoperability suite for DDS-RTPS asks for it.",
    )
    add = parser.add_argument
    add("-v", dest="is_verbose", type=_verbosity, default=False, metavar="e|d", help="say errors (e), or more (d)")
    add("-P", dest="publish", action="store_true", help="publish samples")
    add("-S", dest="subscribe", action="store_true", help="subscribe samples")
    add("-d", dest="domain", type=_from(0), default=0, metavar="N", help="domain id (0)")
    add("-b", dest="is_reliable", action="store_false", default=True, help="best effort")
    add("-r", dest="is_reliable", action="store_true", help="reliable (default)")
    add("-k", dest="history_depth", type=_from(0), default=-1, metavar="N", help="KEEP_LAST N; 0: KEEP_ALL")
    add("-f", dest="deadline_ms", type=_from(0), default=0, metavar="MS", help="deadline; 0: none")
    add("-s", dest="ownership_strength", type=_from(-1), default=-1, metavar="N", help="strength; -1: shared")
    add("-t", dest="topic", metavar="NAME", help="topic")
    add("-c", dest="color", metavar="COLOR", help=f"color to write ({DEFAULT_COLOR}), or to filter by")
    add("-p", dest="partition", metavar="NAME", help="partition")
    add(
        "-D",
        dest="durability",
        choices=("v", "l", "t", "p"),
        default="v",
        help="volatile (default), transient-local, transient, persistent",
    )
    add(
        "-x",
        dest="representation",
        type=_representation,
        default=DataRepresentationId.XCDR1,
        metavar="1|2",
        help="XCDR1 (default) or XCDR2, this one only",
    )
    add("-w", dest="prints_written", action="store_true", help="print what is written")
    add("-z", dest="size", type=_from(0), default=20, metavar="N", help="shapesize (20); 0: grows from 1")
    add("-R", dest="reads", action="store_true", help="read instead of take")
    add("--write-period", dest="write_period_ms", type=_from(0), default=33, metavar="MS", help="between writes (33)")
    add("--read-period", dest="read_period_ms", type=_from(0), default=100, metavar="MS", help="between reads (100)")
    add("--time-filter", dest="time_filter_ms", type=_from(0), default=0, metavar="MS", help="time based filter")
    add("--lifespan", dest="lifespan_ms", type=_from(0), default=0, metavar="MS", help="lifespan of what is written")
    add("--num-iterations", type=_from(1), default=0, metavar="N", help="end after N rounds")
    add("--num-instances", type=_from(1), default=1, metavar="N", help="write BLUE, BLUE1, ...")
    add("--num-topics", type=_from(1), default=1, metavar="N", help="Square, Square1, ..., an endpoint for each")
    add("--final-instance-state", choices=("u", "d"), help="at the end unregister or dispose what was written")
    add("--access-scope", choices=("i", "t", "g"), help="PRESENTATION: instance (default), topic or group")
    add("--coherent", dest="is_coherent", action="store_true", help="PRESENTATION: coherent access")
    add("--ordered", dest="is_ordered", action="store_true", help="PRESENTATION: ordered access")
    add("--coherent-sample-count", type=_from(2), default=0, metavar="N", help="samples of an instance in a set")
    add(
        "--additional-payload-size",
        dest="payload_octets",
        type=_from(1),
        default=0,
        metavar="OCTETS",
        help="octets of payload",
    )
    add("--take-read", dest="by_instance", action="store_false", help="in order of arrival, not by instance")
    add(
        "--periodic-announcement",
        dest="announcement_ms",
        type=_from(0),
        default=0,
        metavar="MS",
        help="between announcements of the participant; 0: as usual",
    )
    add(
        "--datafrag-size",
        dest="fragment_octets",
        type=_from(0, _LARGEST_FRAGMENT),
        default=0,
        metavar="OCTETS",
        help="of one fragment; 0: as usual",
    )
    add("--cft", dest="filter_expression", metavar="EXPRESSION", help="filter of the subscriber")
    add("--size-modulo", type=_from(1), default=0, metavar="N", help="a growing size begins again after N")
    return parser


def _from(lowest: int, highest: int = _HIGHEST_INT) -> Callable[[str], int]:
    """The reader of a whole number in this range."""

    def read(text: str) -> int:
        try:
            number = int(text)
        except ValueError:
            number = lowest - 1
        if not lowest <= number <= highest:
            raise argparse.ArgumentTypeError(f"a whole number from {lowest} to {highest} is wanted, not {text!r}")
        return number

    return read


def _verbosity(text: str) -> bool:
    if text not in ("e", "d"):
        raise argparse.ArgumentTypeError(f"e or d is wanted, not {text!r}")
    return text == "d"


def _representation(text: str) -> DataRepresentationId:
    ids = {"1": DataRepresentationId.XCDR1, "2": DataRepresentationId.XCDR2}
    if text not in ids:
        raise argparse.ArgumentTypeError(f"1 or 2 is wanted, not {text!r}")
    return ids[text]
