"""``ddsi why``: why do these two not match?  Every cause at once, both values and the remedy, for every pair seen.

It judges what participants announce, as this implementation's own endpoints would: it prints what
``DomainParticipant.explain`` returns.
"""

from __future__ import annotations

import argparse
import json
import re
from collections.abc import Iterable, Iterator

from ..discovery.explanation import Explanation, PairExplanation, ParticipantTrouble
from ..discovery.remedies import Disagreement
from ..structure.guid import Guid
from ..trace.wording import count_text
from .arguments import add_domain, add_json, add_listening
from .census import Census, SeenParticipant, take_census
from .census_tables import who
from .exit_status import ExitStatus
from .listening import listen, observer, with_types
from .runner import run as run_async
from .tables import shown
from .topic_session import add_security, participant_qos

__all__ = ["SUMMARY", "add_arguments", "run"]

SUMMARY = "say why endpoints of a topic do not match, and what to do"

_MOST_NAMED = 4
_GUID = re.compile(r"(?:[0-9a-f]{8}:){3}[0-9a-f]{8}|[0-9a-f]{32}", re.IGNORECASE)


def add_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "asked",
        nargs="*",
        default=[],
        metavar="TOPIC | GUID...",
        help="only this topic (a shell pattern), this endpoint, or these endpoints with each other; GUIDs as "
        "`ddsi ls --json` prints them",
    )
    add_domain(parser)
    add_listening(parser)
    add_security(parser)
    add_json(parser)


def run(arguments: argparse.Namespace) -> int:
    return run_async(lambda: _explain(arguments))


async def _explain(arguments: argparse.Namespace) -> int:
    asked = [Guid(bytes.fromhex(one.replace(":", ""))) if _GUID.fullmatch(one) else str(one) for one in arguments.asked]
    async with observer(arguments.domain, participant_qos(arguments, "ddsi why")) as participant:
        participant.explain(*asked)  # what cannot be asked is refused before the listening
        await listen(participant, arguments.time)
        explanation = await with_types(participant, lambda: participant.explain(*asked))
        census = take_census(participant)
    if arguments.json:
        print(json.dumps(_explanation_json(census, explanation), indent=2))
    else:
        print("\n".join(_lines(census, explanation)))
    return ExitStatus.OK if _is_well(explanation) else ExitStatus.NOT_AS_HOPED


def _is_well(explanation: Explanation) -> bool:
    is_cut_off = any(trouble.kind in ("unreachable", "silent") for trouble in explanation.troubles)
    is_partial = explanation.left_out > 0
    return not (explanation.mismatches or explanation.unknown or is_cut_off or is_partial or _is_empty(explanation))


def _is_empty(explanation: Explanation) -> bool:
    """Was what was asked for not seen at all?"""
    return bool(explanation.asked) and not (explanation.pairs or explanation.lonely or explanation.unknown)


# --- for people ------------------------------------------------------------------------------------------------


def _lines(census: Census, explanation: Explanation) -> Iterator[str]:
    yield from _trouble_lines(census, explanation.troubles)
    if _is_empty(explanation):
        asked = " ".join(map(shown, explanation.asked))
        yield f"Nobody was seen with a writer or reader of {asked}; `ddsi ls topics` shows what there is."
        return
    for guid in explanation.unknown:
        yield f"{guid}: not discovered; `ddsi ls endpoints` shows who is there"
        yield "    remedy: compare domain id, interfaces and multicast on both hosts (`ddsi doctor --peer HOST`)"
    for group in _grouped(explanation.mismatches):
        yield from _group_lines(census, group)
        yield ""
    if explanation.asked:
        for group in _grouped(pair for pair in explanation.pairs if not pair.disagreements):
            yield from _group_lines(census, group)
            yield ""
    told = {name for pair in explanation.pairs for name in (pair.writer.topic_name, pair.reader.topic_name)}
    lonely_topics = [lonely for lonely in explanation.lonely if lonely.topic not in told]
    for lonely in lonely_topics:
        other = "reader" if lonely.kind == "writer" else "writer"
        names = " or ".join(shown(name) for name in lonely.similar)
        hint = f"; was {names} meant?" if names else ""
        yield f"{shown(lonely.topic)}: {count_text(len(lonely.endpoints), lonely.kind)}, but no {other} was seen{hint}"
    if lonely_topics:
        yield ""
    bad = len(explanation.mismatches)
    fitting = count_text(explanation.matching_count, "pair")
    yield f"{fitting} of a writer and a reader fit, {bad or 'none'} {'does' if bad == 1 else 'do'} not."
    if explanation.left_out:
        left_out = count_text(explanation.left_out, "more pair")
        verb = "was" if explanation.left_out == 1 else "were"
        yield f"{left_out} {verb} not looked at: ask about one topic or endpoint (`ddsi why TOPIC`, `ddsi why GUID`)."


def _trouble_lines(census: Census, troubles: tuple[ParticipantTrouble, ...]) -> Iterator[str]:
    for trouble in troubles:
        of = f" of {_owner(census, trouble.guid)}" if trouble.guid is not None else ""
        whom = f"participant {trouble.guid.prefix}{of}" if trouble.guid is not None else "somebody"
        yield f"{whom}: {trouble.kind}: it announces {shown(trouble.offered)}; {shown(trouble.requested)}"
        yield f"    remedy: {shown(trouble.remedy)}"
    if troubles:
        yield ""


def _grouped(pairs: Iterable[PairExplanation]) -> list[list[PairExplanation]]:
    """Pairs with the same reasons are told of together: fifty readers of one kind have one problem."""
    groups: dict[tuple[str, str, tuple[Disagreement, ...], bool], list[PairExplanation]] = {}
    for pair in pairs:
        key = (pair.writer.topic_name, pair.reader.topic_name, pair.disagreements, pair.is_awaited)
        groups.setdefault(key, []).append(pair)
    return list(groups.values())


def _group_lines(census: Census, group: list[PairExplanation]) -> Iterator[str]:
    first = group[0]
    writers = list(dict.fromkeys(pair.writer.guid for pair in group))
    readers = list(dict.fromkeys(pair.reader.guid for pair in group))
    topics = " and ".join(dict.fromkeys((shown(first.writer.topic_name), shown(first.reader.topic_name))))
    counts = f"{count_text(len(writers), 'writer')} and {count_text(len(readers), 'reader')}"
    verdict = (
        "do not match" if first.disagreements else "would match, if their types fit" if first.is_awaited else "match"
    )
    yield f"{topics}: {counts} {verdict}"
    for kind, guids in (("writer", writers), ("reader", readers)):
        for guid in guids[:_MOST_NAMED]:
            yield f"  {kind} {guid} of {_owner(census, guid)}"
        if len(guids) > _MOST_NAMED:
            yield f"  and {count_text(len(guids) - _MOST_NAMED, f'more {kind}')}"
    for one in first.disagreements:
        detail = f": {shown(one.detail)}" if one.detail else ""
        yield f"  {one.policy}: offered {shown(one.offered)}, requested {shown(one.requested)}{detail}"
        yield f"    remedy: {shown(one.remedy)}"


def _owner(census: Census, guid: Guid) -> str:
    participant: SeenParticipant | None = census.participant_of(guid)
    return who(participant) if participant is not None else "an unknown participant"


# --- for programs ----------------------------------------------------------------------------------------------


def _explanation_json(census: Census, explanation: Explanation) -> dict[str, object]:
    return {
        "domain_id": census.domain_id,
        "topic": explanation.asked[0] if explanation.asked else "",
        "asked": list(explanation.asked),
        "complete": explanation.is_complete,
        "matching": explanation.matching_count,
        "left_out": explanation.left_out,
        "mismatches": [_pair_json(census, pair) for pair in explanation.mismatches],
        "pairs": [
            {
                "topic": pair.writer.topic_name,
                "writer": str(pair.writer.guid),
                "reader": str(pair.reader.guid),
                "matching": pair.is_matching,
            }
            for pair in explanation.pairs
        ],
        "lonely": [
            {
                "topic": lonely.topic,
                "kind": lonely.kind,
                "endpoints": [str(guid) for guid in lonely.endpoints],
                "similar": list(lonely.similar),
            }
            for lonely in explanation.lonely
        ],
        "troubles": [
            {
                "participant": str(trouble.guid.prefix) if trouble.guid is not None else "",
                "kind": trouble.kind,
                "offered": trouble.offered,
                "requested": trouble.requested,
                "remedy": trouble.remedy,
            }
            for trouble in explanation.troubles
        ],
        "unknown": [str(guid) for guid in explanation.unknown],
    }


def _pair_json(census: Census, pair: PairExplanation) -> dict[str, object]:
    return {
        "topic": pair.writer.topic_name,
        "kind": _kind(pair.disagreements[0]),
        "writer": _endpoint_json(census, pair.writer.guid, pair.writer.type_name),
        "reader": _endpoint_json(census, pair.reader.guid, pair.reader.type_name),
        "disagreements": [
            {
                "policy": one.policy,
                "offered": one.offered,
                "requested": one.requested,
                "detail": one.detail,
                "remedy": one.remedy,
            }
            for one in pair.disagreements
        ],
    }


def _kind(first: Disagreement) -> str:
    """What the first cause, which outweighs the others, is about."""
    if first.policy == "key":
        return "type"
    return first.policy if first.policy in ("topic", "type", "partition", "security", "locator") else "qos"


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
