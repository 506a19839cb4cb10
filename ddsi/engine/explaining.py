"""Explains: for all endpoints that an engine knows, its own and others', who matches whom, and if not, why.

The judges are those of the matchmaker: ``discovery.matching`` for policies, ``type_matching`` for types, and for our
own endpoints what the security hooks said.  Of what other participants' security decides among themselves, only the
announcements are known here.

Whether others can reach each other, only they know; a locator counts as unreachable here if its participant was never
heard from that host (``ParticipantProxy.reachable``).
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from typing import TYPE_CHECKING

from ..discovery.explanation import (
    Explanation,
    PairExplanation,
    ParticipantTrouble,
    explained_pairs,
    lonely_topics,
)
from ..discovery.matching import MatchRefusal, RefusalKind
from ..discovery.participant_proxy import ParticipantProxy
from ..discovery.remedies import Disagreement, disagreements, participant_remedy, security_disagreement
from ..serialization.parameter_id import ParameterId
from ..structure import builtin_entity_ids as ids
from ..structure.discovered import DiscoveredEndpointData, DiscoveredReaderData, DiscoveredWriterData
from ..structure.guid import Guid
from ..structure.locator import Locator
from ..trace.reasons import DropReason
from .type_matching import TypeVerdict

if TYPE_CHECKING:
    from .participant import Participant

__all__ = ["explain", "explain_endpoints", "explain_pairs", "judged_pair"]

_SEDP_READERS = (ids.SEDP_PUBLICATIONS_READER, ids.SEDP_SUBSCRIPTIONS_READER)
_MOST_LOCATORS = 4
_DROPS = {
    DropReason.WRONG_DOMAIN: ("another domain id", "start both sides with one domain id"),
    DropReason.DOMAIN_TAG: ("another domain tag", "give both sides one domain tag (Domain/Discovery/Tag in the XML)"),
    DropReason.UNSUPPORTED_VERSION: ("a major version of RTPS other than 2", "update that implementation"),
    DropReason.MALFORMED_DISCOVERY_DATA: (
        "announcements that cannot be read",
        "see `ddsi trace` for the element, and report it to that vendor",
    ),
    DropReason.TABLE_FULL_PARTICIPANTS: ("more participants than Config allows", "raise Config.max_participants"),
    DropReason.TABLE_FULL_ENDPOINTS: ("more endpoints than Config allows", "raise Config.max_endpoints"),
}
"""Drops that keep somebody from being known: what came, and what to do."""


def explain(engine: Participant, topic: str, now: float) -> Explanation:
    """All pairs of the topic (its name, or a shell pattern; empty for all topics), and what else stands in the way."""
    pairs, left_out = explain_pairs(engine, topic, now)
    return Explanation(
        asked=(topic,) if topic else (),
        pairs=pairs,
        lonely=lonely_topics(_writers(engine), _readers(engine), topic),
        troubles=tuple(_troubles(engine)),
        left_out=left_out,
    )


def explain_pairs(engine: Participant, topic: str, now: float) -> tuple[tuple[PairExplanation, ...], int]:
    """The pairs alone, and how many more there are than were looked at."""
    return explained_pairs(_writers(engine), _readers(engine), _Judge(engine, now), topic)


def explain_endpoints(engine: Participant, guids: tuple[Guid, ...], now: float) -> Explanation:
    """The pairs of these endpoints: of one, all on its topic; of more, each writer with each reader among them,
    whatever their topics are."""
    writers = {data.guid: data for data in _writers(engine)}
    readers = {data.guid: data for data in _readers(engine)}
    unknown = tuple(guid for guid in guids if guid not in writers and guid not in readers)
    judge = _Judge(engine, now)
    left_out = 0
    if len(guids) == 1:
        pairs, left_out = explained_pairs(writers.values(), readers.values(), judge, of=guids[0])
    else:
        pairs = tuple(
            judge(writers[one], readers[other])
            for one in guids
            for other in guids
            if one in writers and other in readers
        )
    asked, troubles = tuple(map(str, guids)), tuple(_troubles(engine))
    return Explanation(asked, pairs, troubles=troubles, unknown=unknown, left_out=left_out)


def judged_pair(
    engine: Participant,
    writer: DiscoveredWriterData,
    reader: DiscoveredReaderData,
    now: float,
    *,
    may_ask: bool = True,
) -> PairExplanation:
    """Everything that stands between the two.  ``may_ask``: others may be asked what their types are made of."""
    types = _judged_types(engine, writer, reader, now, may_ask)
    announced = disagreements(writer, reader, types.refusal)
    # Where governance differs the plugins refuse for that, and what is announced says it of both sides.
    is_told = any(one.policy == "security" for one in announced)
    found = (
        *announced,
        *(() if is_told else _security(engine, writer, reader)),
        *_unreachable(engine, writer, "writer"),
        *_unreachable(engine, reader, "reader"),
    )
    return PairExplanation(writer, reader, found, is_awaited=types.is_awaited)


def _judged_types(
    engine: Participant, writer: DiscoveredWriterData, reader: DiscoveredReaderData, now: float, may_ask: bool
) -> TypeVerdict:
    """As the matchmaker has it; where a member is at fault, by types that have its name, if they are to be had."""
    types = engine.type_matching.judge(writer, reader, now, may_ask=may_ask)
    if types.refusal is None or not types.refusal.detail:
        return types
    named = engine.type_matching.judge(writer, reader, now, may_ask=may_ask, names_members=True)
    has_name = named.refusal is not None and bool(named.refusal.detail)
    return named if has_name or (named.is_awaited and may_ask) else types


class _Judge:
    """Endpoints of one participant are often alike in all that a judgement looks at: it is made once for those."""

    def __init__(self, engine: Participant, now: float) -> None:
        self._engine = engine
        self._now = now
        self._aspects: dict[Guid, object] = {}
        self._judgements: dict[tuple[object, object], PairExplanation] = {}

    def __call__(self, writer: DiscoveredWriterData, reader: DiscoveredReaderData) -> PairExplanation:
        own = self._engine.guid.prefix
        if own in (writer.guid.prefix, reader.guid.prefix):  # security may say something else of each
            return judged_pair(self._engine, writer, reader, self._now)
        key = self._aspects_of(writer), self._aspects_of(reader)
        known = self._judgements.get(key)
        if known is None:
            known = self._judgements[key] = judged_pair(self._engine, writer, reader, self._now)
        return PairExplanation(writer, reader, known.disagreements, known.is_awaited)

    def _aspects_of(self, data: DiscoveredEndpointData) -> object:
        aspects = self._aspects.get(data.guid)
        if aspects is None:
            looked_at = (data.topic_name, data.type_name, data.is_keyed, data.type_information, data.qos, data.unicast)
            aspects = self._aspects[data.guid] = repr((data.guid.prefix, looked_at, data.security_parameters))
        return aspects


def _writers(engine: Participant) -> list[DiscoveredWriterData]:
    return [*engine.known_writers.all(), *(writer.data for writer in engine.user_writers())]


def _readers(engine: Participant) -> list[DiscoveredReaderData]:
    return [*engine.known_readers.all(), *(reader.data for reader in engine.user_readers())]


# --- what keeps two that fit apart -----------------------------------------------------------------------------


def _security(
    engine: Participant, writer: DiscoveredWriterData, reader: DiscoveredReaderData
) -> Iterator[Disagreement]:
    """What was decided of a pair of ours."""
    refusals = engine.matchmaker.refusals
    refusal: MatchRefusal | None = refusals.get((writer.guid, reader.guid)) or refusals.get((reader.guid, writer.guid))
    if refusal is not None and refusal.kind is RefusalKind.SECURITY:
        yield security_disagreement(refusal.offered)


def _unreachable(engine: Participant, data: DiscoveredEndpointData, side: str) -> Iterator[Disagreement]:
    proxy = engine.participants.get(data.guid.prefix)
    if proxy is None or proxy.user_traffic(data.unicast):
        return
    announced = _texts(data.unicast or proxy.data.default_unicast or proxy.data.metatraffic_unicast)
    offered, requested = (announced, _heard_from(proxy)) if side == "writer" else (_heard_from(proxy), announced)
    yield Disagreement("locator", offered, requested, _locator_remedy(f"the {side}'s participant"))


def _troubles(engine: Participant) -> Iterator[ParticipantTrouble]:
    """Participants that were heard, but about whose endpoints nothing can be known."""
    is_secured = bool(engine.discovery.data.security_parameters)
    for proxy in engine.participants.values():
        token = any(pid == ParameterId.IDENTITY_TOKEN for pid, _ in proxy.data.security_parameters)
        knows_endpoints = bool(
            engine.known_writers.of_participant(proxy.prefix) or engine.known_readers.of_participant(proxy.prefix)
        )
        if not proxy.metatraffic:
            announced = _texts(proxy.data.metatraffic_unicast or proxy.data.default_unicast)
            remedy = _locator_remedy("it")
            yield ParticipantTrouble(proxy.guid, "unreachable", announced, _heard_from(proxy), remedy)
        elif not proxy.is_admitted:
            reason = proxy.refusal or "it is not authenticated yet"
            offered = "an identity" if token else "no identity"
            remedy = participant_remedy(reason, has_identity=token)
            yield ParticipantTrouble(proxy.guid, "security", offered, reason, remedy)
        elif token and not is_secured and not knows_endpoints:
            remedy = "look with an identity that it accepts: `ddsi why --secure DIR`"
            wanted = "participants with an identity; this one has none"
            yield ParticipantTrouble(proxy.guid, "security", "an identity", wanted, remedy)
        elif not knows_endpoints and not _has_answered(engine, proxy):
            remedy = (
                "a firewall may let its announcements pass but not its answers: open the domain's UDP ports both ways"
            )
            wanted = "answers to what it is asked about its endpoints; none came"
            yield ParticipantTrouble(proxy.guid, "silent", "announcements", wanted, remedy)
    for reason, (what, remedy) in _DROPS.items():
        if engine.drops[reason]:
            yield ParticipantTrouble(None, "dropped", what, f"{engine.drops[reason]} messages were dropped", remedy)


def _has_answered(engine: Participant, proxy: ParticipantProxy) -> bool:
    for reader_id in _SEDP_READERS:
        reader = engine.builtin.reader(reader_id)
        for guid, writer in reader.behavior.writers.items() if reader is not None else ():
            if guid.prefix == proxy.prefix and not writer.has_historical_data:
                return False
    return True


def _heard_from(proxy: ParticipantProxy) -> str:
    hosts = ", ".join(proxy.hosts) or "nowhere"
    return f"heard from {hosts}"


def _locator_remedy(whose: str) -> str:
    return (
        f"let {whose} announce an address that it sends from and that can be reached from here "
        "(General/Interfaces, ExternalNetworkAddress; NAT and containers hide addresses)"
    )


def _texts(locators: Iterable[Locator]) -> str:
    texts = [str(locator) for locator in locators]
    more = len(texts) - _MOST_LOCATORS
    return ", ".join([*texts[:_MOST_LOCATORS], *([f"and {more} more"] if more > 0 else [])]) or "no locator"
