"""Asking a participant why endpoints match or do not: reads what was asked; the answer is ``engine.explaining``'s."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from typing import TYPE_CHECKING

from ..discovery.explanation import Explanation, PairExplanation, fits
from ..engine import Participant
from ..engine.explaining import explain, explain_endpoints, explain_pairs
from ..structure.errors import BadParameter
from ..structure.guid import Guid
from .endpoint import Endpoint
from .entity import Parent

if TYPE_CHECKING:
    from .participant import DomainParticipant

__all__ = ["explain_all", "pairs_seen"]


def explain_all(participant: DomainParticipant, asked: tuple[str | Guid, ...]) -> Explanation:
    """See ``DomainParticipant.explain``."""
    pump = participant._running_pump()
    explanation = _explain(pump.engine, asked, pump.now())
    pump.settle()  # questions about types
    return replace(explanation, unused=tuple(_unused(participant, asked)))


def _unused(parent: Parent, asked: tuple[str | Guid, ...]) -> Iterator[tuple[Guid, tuple[str, ...]]]:
    """The endpoints asked about that were given policies in vain, and the names of these."""
    for member in parent.contained_entities():
        if isinstance(member, Parent):
            yield from _unused(member, asked)
        elif isinstance(member, Endpoint) and member.unused_policies:
            guid, topic = member._local().guid, member.topic.name
            if not asked or guid in asked or any(isinstance(one, str) and fits(one, topic) for one in asked):
                yield guid, member.unused_policies


def _explain(engine: Participant, asked: tuple[str | Guid, ...], now: float) -> Explanation:
    guids = tuple(one for one in asked if isinstance(one, Guid))
    names = [one for one in asked if isinstance(one, str)]
    if len(guids) + len(names) < len(asked) or (guids and names) or len(names) > 1:
        raise BadParameter(f"explain() takes one topic's name or pattern, or Guids of endpoints, not {asked!r}")
    if not guids:
        return explain(engine, names[0] if names else "", now)
    if len(guids) > 1:
        for kind, is_all in (
            ("writers", all(guid.entity_id.is_writer for guid in guids)),
            ("readers", all(guid.entity_id.is_reader for guid in guids)),
        ):
            if is_all:
                raise BadParameter(f"{', '.join(map(str, guids))} are all {kind}: a writer and a reader are wanted")
    return explain_endpoints(engine, guids, now)


def pairs_seen(participant: DomainParticipant, topic: str = "") -> tuple[tuple[PairExplanation, ...], int]:
    """The pairs of ``participant.explain(topic)``, and its ``left_out``, without what else it finds.

    For tools that look again and again: names that may have been meant take long to find.
    """
    pump = participant._running_pump()
    found = explain_pairs(pump.engine, topic, pump.now())
    pump.settle()  # questions about types
    return found
