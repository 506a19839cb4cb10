"""``ddsi why``: why do these two not match?  Policy, both values and the remedy, for every pair that was seen.

It judges what participants announce, as this implementation's own endpoints would.  Types that both sides announce are
fetched and compared; others go by name and key.
"""

from __future__ import annotations

import argparse
import difflib
import json
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from fnmatch import fnmatchcase
from itertools import islice

from ..structure.guid import Guid
from ..trace.wording import count_text
from .arguments import add_domain, add_json, add_listening
from .census import Census, EndpointKind, Pair, SeenParticipant, take_census
from .census_tables import who
from .exit_status import ExitStatus
from .listening import listen, observer
from .remedies import Disagreement, disagreements
from .runner import run as run_async
from .tables import shown
from .type_judgements import TypeJudgements, judge_types, with_types

__all__ = ["SUMMARY", "Diagnosis", "Lonely", "Mismatch", "add_arguments", "diagnose", "run"]

SUMMARY = "say why endpoints of a topic do not match, and what to do"

_MOST_SIMILAR = 3
_MOST_NAMED = 4
_MOST_COMPARED = 20_000
"""Names compared with names, in all: it takes a tenth of a millisecond each."""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("topic", nargs="?", default="", metavar="TOPIC", help="only this topic (a shell pattern)")
    add_domain(parser)
    add_listening(parser)
    add_json(parser)


def run(arguments: argparse.Namespace) -> int:
    return run_async(lambda: _explain(arguments))


async def _explain(arguments: argparse.Namespace) -> int:
    async with observer(arguments.domain, "ddsi why") as participant:
        await listen(participant, arguments.time)
        census = take_census(participant)
        judgements = await judge_types(participant, _asked(census, arguments.topic))
    diagnosis = diagnose(census, arguments.topic, judgements)
    if arguments.json:
        print(json.dumps(_diagnosis_json(diagnosis), indent=2))
    else:
        print("\n".join(_lines(diagnosis)))
    return ExitStatus.NOT_AS_HOPED if diagnosis.mismatches or diagnosis.is_empty else ExitStatus.OK


@dataclass(frozen=True, slots=True)
class Mismatch:
    """A pair that does not match, with every reason."""

    pair: Pair
    disagreements: tuple[Disagreement, ...]


@dataclass(frozen=True, slots=True)
class Lonely:
    """A topic of which only writers, or only readers, were seen; ``similar``: topics of the other kind named alike."""

    topic: str
    kind: EndpointKind
    endpoints: tuple[Guid, ...]
    similar: tuple[str, ...]


@dataclass(frozen=True, slots=True)
class Diagnosis:
    """``asked``: the pattern of topics, empty for all.  ``matching``: how many pairs fit."""

    census: Census
    asked: str
    mismatches: tuple[Mismatch, ...]
    lonely: tuple[Lonely, ...]
    matching: int

    @property
    def is_empty(self) -> bool:
        """Was the topic that was asked for not seen at all?"""
        return bool(self.asked) and not (self.mismatches or self.lonely or self.matching)


def diagnose(census: Census, topic: str = "", judgements: TypeJudgements | None = None) -> Diagnosis:
    """Everything that keeps endpoints of the topic (a shell pattern; empty for any) apart.

    ``judgements``: what is known of their types besides names.
    """
    pairs = [with_types(pair, judgements or {}) for pair in _asked(census, topic)]
    mismatches = tuple(
        Mismatch(pair, disagreements(pair.writer, pair.reader, pair.refusal)) for pair in pairs if pair.refusal
    )
    lonely = tuple(found for found in _lonely(census) if not topic or fnmatchcase(found.topic, topic))
    return Diagnosis(census, topic, mismatches, lonely, len(pairs) - len(mismatches))


def _asked(census: Census, topic: str) -> Iterator[Pair]:
    return (pair for pair in census.pairs() if not topic or fnmatchcase(pair.writer.topic_name, topic))


def _lonely(census: Census) -> Iterator[Lonely]:
    by_topic: dict[str, dict[EndpointKind, list[Guid]]] = {}
    for _, endpoint in census.endpoints():
        kinds = by_topic.setdefault(endpoint.data.topic_name, {})
        kinds.setdefault(endpoint.kind, []).append(endpoint.data.guid)
    lonely = sorted(topic for topic, kinds in by_topic.items() if len(kinds) == 1)
    candidates: dict[EndpointKind, _Names] = {
        "writer": _Names(topic for topic, kinds in by_topic.items() if "reader" in kinds),
        "reader": _Names(topic for topic, kinds in by_topic.items() if "writer" in kinds),
    }
    for topic in lonely:
        ((kind, guids),) = by_topic[topic].items()
        similar = candidates[kind].similar(topic, _MOST_COMPARED // len(lonely))
        yield Lonely(topic, kind, tuple(guids), similar)


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
    return name.lower().rpartition("/")[2]


# --- for people ------------------------------------------------------------------------------------------------


def _lines(diagnosis: Diagnosis) -> Iterator[str]:
    if diagnosis.is_empty:
        asked = shown(diagnosis.asked)
        yield f"Nobody was seen with a writer or reader of {asked}; `ddsi ls topics` shows what there is."
        return
    for group in _grouped(diagnosis.mismatches):
        yield from _group_lines(diagnosis.census, group)
        yield ""
    for lonely in diagnosis.lonely:
        other = "reader" if lonely.kind == "writer" else "writer"
        names = " or ".join(shown(name) for name in lonely.similar)
        hint = f"; was {names} meant?" if names else ""
        yield f"{shown(lonely.topic)}: {count_text(len(lonely.endpoints), lonely.kind)}, but no {other} was seen{hint}"
    if diagnosis.lonely:
        yield ""
    bad = len(diagnosis.mismatches)
    fitting = count_text(diagnosis.matching, "pair")
    yield f"{fitting} of a writer and a reader fit, {bad or 'none'} {'does' if bad == 1 else 'do'} not."


def _grouped(mismatches: tuple[Mismatch, ...]) -> list[list[Mismatch]]:
    """Pairs with the same reasons are told of together: fifty readers of one kind have one problem."""
    groups: dict[tuple[str, tuple[Disagreement, ...]], list[Mismatch]] = {}
    for mismatch in mismatches:
        groups.setdefault((mismatch.pair.writer.topic_name, mismatch.disagreements), []).append(mismatch)
    return list(groups.values())


def _group_lines(census: Census, group: list[Mismatch]) -> Iterator[str]:
    first = group[0]
    writers = list(dict.fromkeys(mismatch.pair.writer.guid for mismatch in group))
    readers = list(dict.fromkeys(mismatch.pair.reader.guid for mismatch in group))
    counts = f"{count_text(len(writers), 'writer')} and {count_text(len(readers), 'reader')}"
    yield f"{shown(first.pair.writer.topic_name)}: {counts} do not match"
    for kind, guids in (("writer", writers), ("reader", readers)):
        for guid in guids[:_MOST_NAMED]:
            yield f"  {kind} {guid} of {_owner(census, guid)}"
        if len(guids) > _MOST_NAMED:
            yield f"  and {count_text(len(guids) - _MOST_NAMED, f'more {kind}')}"
    for disagreement in first.disagreements:
        offered, requested = shown(disagreement.offered), shown(disagreement.requested)
        yield f"  {disagreement.policy}: offered {offered}, requested {requested}"
        yield f"    remedy: {shown(disagreement.remedy)}"


def _owner(census: Census, guid: Guid) -> str:
    participant: SeenParticipant | None = census.participant_of(guid)
    return who(participant) if participant is not None else "an unknown participant"


# --- for programs ----------------------------------------------------------------------------------------------


def _diagnosis_json(diagnosis: Diagnosis) -> dict[str, object]:
    return {
        "domain_id": diagnosis.census.domain_id,
        "topic": diagnosis.asked,
        "matching": diagnosis.matching,
        "mismatches": [_mismatch_json(diagnosis.census, mismatch) for mismatch in diagnosis.mismatches],
        "lonely": [
            {
                "topic": lonely.topic,
                "kind": lonely.kind,
                "endpoints": [str(guid) for guid in lonely.endpoints],
                "similar": list(lonely.similar),
            }
            for lonely in diagnosis.lonely
        ],
    }


def _mismatch_json(census: Census, mismatch: Mismatch) -> dict[str, object]:
    pair = mismatch.pair
    assert pair.refusal is not None
    return {
        "topic": pair.writer.topic_name,
        "kind": str(pair.refusal.kind),
        "writer": _endpoint_json(census, pair.writer.guid, pair.writer.type_name),
        "reader": _endpoint_json(census, pair.reader.guid, pair.reader.type_name),
        "disagreements": [
            {"policy": one.policy, "offered": one.offered, "requested": one.requested, "remedy": one.remedy}
            for one in mismatch.disagreements
        ],
    }


def _endpoint_json(census: Census, guid: Guid, type_name: str) -> dict[str, object]:
    participant = census.participant_of(guid)
    return {
        "guid": str(guid),
        "type": type_name,
        "vendor": participant.vendor if participant is not None else "",
        "entity_name": participant.data.entity_name if participant is not None else "",
        "host": participant.host if participant is not None else "",
        "pid": participant.pid if participant is not None else "",
    }
