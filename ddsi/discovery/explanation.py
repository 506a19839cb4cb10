"""Explanation: why the writers and readers of a topic match or do not, as a value.

For people who ask; nothing here decides anything.  The judgement of a pair is given (``engine.explaining``), so that
what is said is what the matchmaker would do.  DDS 1.4 §2.2.3, RTPS 2.5 §8.5.
"""

from __future__ import annotations

import difflib
from collections.abc import Callable, Iterable, Iterator
from fnmatch import fnmatchcase
from itertools import islice
from typing import Literal

from ..structure.dataclass import dataclass
from ..structure.discovered import DiscoveredReaderData, DiscoveredWriterData
from ..structure.guid import Guid
from .remedies import Disagreement

__all__ = [
    "MOST_EXPLAINED",
    "EndpointKind",
    "Explanation",
    "LonelyTopic",
    "PairExplanation",
    "ParticipantTrouble",
    "TroubleKind",
    "explained_pairs",
    "lonely_topics",
]

EndpointKind = Literal["writer", "reader"]
TroubleKind = Literal["unreachable", "security", "silent", "dropped"]

MOST_EXPLAINED = 100_000
"""Pairs that are looked at.  Strangers may announce ten thousand writers and as many readers for one topic."""
_MOST_SIMILAR = 3
_MOST_COMPARED = 20_000
"""Names compared with names, in all: it takes a tenth of a millisecond each."""
_ROS_PREFIXES = ("rt/", "rq/", "rr/", "rs/", "rp/", "ra/")


@dataclass(frozen=True, slots=True)
class PairExplanation:
    """A writer and a reader, and everything that stands between them.

    ``is_awaited``: whether the types fit is not known yet, their owners are being asked.
    """

    writer: DiscoveredWriterData
    reader: DiscoveredReaderData
    disagreements: tuple[Disagreement, ...] = ()
    is_awaited: bool = False

    @property
    def is_matching(self) -> bool:
        return not self.disagreements and not self.is_awaited


@dataclass(frozen=True, slots=True)
class LonelyTopic:
    """A topic of which only writers, or only readers, were seen; ``similar``: topics of the other kind named alike."""

    topic: str
    kind: EndpointKind
    endpoints: tuple[Guid, ...]
    similar: tuple[str, ...]


@dataclass(frozen=True, slots=True)
class ParticipantTrouble:
    """A participant that was heard, but whose endpoints cannot be known or reached.

    ``guid`` is None for traffic that is not acted upon, of whomever.  ``offered``: what it announces.
    ``requested``: what there would have to be.
    """

    guid: Guid | None
    kind: TroubleKind
    offered: str
    requested: str
    remedy: str


@dataclass(frozen=True, slots=True)
class Explanation:
    """``asked``: a pattern of topics, or Guids as text; empty for everything.  ``unknown``: Guids nobody announces.

    ``left_out``: how many pairs there are beyond the 100,000 that were looked at, and of which nothing is said.
    ``unused``: those endpoints of the participant itself that were given policies in vain, and the names of these.
    """

    asked: tuple[str, ...]
    pairs: tuple[PairExplanation, ...]
    lonely: tuple[LonelyTopic, ...] = ()
    troubles: tuple[ParticipantTrouble, ...] = ()
    unknown: tuple[Guid, ...] = ()
    left_out: int = 0
    unused: tuple[tuple[Guid, tuple[str, ...]], ...] = ()

    @property
    def mismatches(self) -> tuple[PairExplanation, ...]:
        return tuple(pair for pair in self.pairs if pair.disagreements)

    @property
    def matching_count(self) -> int:
        return sum(pair.is_matching for pair in self.pairs)

    @property
    def is_complete(self) -> bool:
        """False while somebody is being asked what types are made of: ask once more a moment later."""
        return not any(pair.is_awaited for pair in self.pairs)


Judge = Callable[[DiscoveredWriterData, DiscoveredReaderData], PairExplanation]


def explained_pairs(
    writers: Iterable[DiscoveredWriterData],
    readers: Iterable[DiscoveredReaderData],
    judge: Judge,
    pattern: str = "",
    *,
    of: Guid | None = None,
) -> tuple[tuple[PairExplanation, ...], int]:
    """Every writer with every reader of its topic, and with those of a topic that was probably meant.

    That is one that differs by case, blanks or the prefix of ROS 2, where one of the two topics lacks its other half.
    ``of``: the pairs of this endpoint alone.  Returns the first MOST_EXPLAINED, and how many more there are.
    """
    groups = list(_meeting(writers, readers, pattern, of))
    pairs = (judge(writer, reader) for offering, asking in groups for writer in offering for reader in asking)
    count = sum(len(offering) * len(asking) for offering, asking in groups)
    return tuple(islice(pairs, MOST_EXPLAINED)), max(0, count - MOST_EXPLAINED)


def _meeting(
    writers: Iterable[DiscoveredWriterData], readers: Iterable[DiscoveredReaderData], pattern: str, of: Guid | None
) -> Iterator[tuple[list[DiscoveredWriterData], list[DiscoveredReaderData]]]:
    """Of each topic, and of each two that were probably meant to be one: who writes, and who reads."""
    offered: dict[str, list[DiscoveredWriterData]] = {}
    requested: dict[str, list[DiscoveredReaderData]] = {}
    for writer in writers:
        offered.setdefault(writer.topic_name, []).append(writer)
    for reader in readers:
        requested.setdefault(reader.topic_name, []).append(reader)
    folded: dict[str, list[str]] = {}
    for name in requested:
        folded.setdefault(_folded(name), []).append(name)
    for topic, offering in offered.items():
        for other in folded.get(_folded(topic), ()):
            is_lonely = topic not in requested or other not in offered
            if (topic == other or is_lonely) and (fits(pattern, topic) or fits(pattern, other)):
                asking = requested[other]
                if of is None:
                    yield offering, asking
                elif of.entity_id.is_writer:
                    yield [data for data in offering if data.guid == of], asking
                else:
                    yield offering, [data for data in asking if data.guid == of]


def fits(pattern: str, topic: str) -> bool:
    """Is it the topic of that name, or one that the shell pattern stands for?  An empty pattern stands for all."""
    return not pattern or pattern == topic or fnmatchcase(topic, pattern)


def lonely_topics(
    writers: Iterable[DiscoveredWriterData], readers: Iterable[DiscoveredReaderData], pattern: str = ""
) -> tuple[LonelyTopic, ...]:
    """The topics that miss their other half, by name."""
    offered: dict[str, list[Guid]] = {}
    requested: dict[str, list[Guid]] = {}
    for writer in writers:
        offered.setdefault(writer.topic_name, []).append(writer.guid)
    for reader in readers:
        requested.setdefault(reader.topic_name, []).append(reader.guid)
    return tuple(sorted(_lonely(offered, requested, pattern), key=lambda found: found.topic))


def _lonely(offered: dict[str, list[Guid]], requested: dict[str, list[Guid]], pattern: str) -> Iterator[LonelyTopic]:
    sides: tuple[tuple[EndpointKind, dict[str, list[Guid]], dict[str, list[Guid]]], ...] = (
        ("writer", offered, requested),
        ("reader", requested, offered),
    )
    for kind, here, there in sides:
        lonely = [topic for topic in here if topic not in there and fits(pattern, topic)]
        names = _Names(there)
        for topic in lonely:
            similar = names.similar(topic, _MOST_COMPARED // len(lonely))
            yield LonelyTopic(topic, kind, tuple(here[topic]), similar)


class _Names:
    """Names that may have been meant: another case, a slip of the pen, a prefix such as that of ROS 2 (``rt/``)."""

    def __init__(self, names: Iterable[str]) -> None:
        self._by_plain: dict[str, list[str]] = {}
        for name in names:
            self._by_plain.setdefault(_plain(name), []).append(name)

    def similar(self, topic: str, most_compared: int) -> tuple[str, ...]:
        """The best few, of which those that differ in case or prefix alone come first."""
        wanted = _plain(topic)
        close = difflib.get_close_matches(wanted, islice(self._by_plain, most_compared), n=_MOST_SIMILAR)
        found = [*self._by_plain.get(wanted, ()), *(name for plain in close for name in self._by_plain[plain])]
        return tuple(dict.fromkeys(found))[:_MOST_SIMILAR]


def _plain(name: str) -> str:
    return name.strip().lower().rpartition("/")[2]


def _folded(name: str) -> str:
    """What is left of a name without case, blanks and the prefix that ROS 2 puts before it."""
    folded = "".join(name.split()).casefold()
    for prefix in _ROS_PREFIXES:
        folded = folded.removeprefix(prefix)
    return folded.lstrip("/")
