"""TypeMatching: do the types of a writer and a reader fit, by what is known of them now?

DDS-XTypes 1.3 §7.6.3.4.2, with ``xtypes.assignability`` as the judge.  Where both sides announce type information:

- equal identifiers, minimal or complete, fit;
- others are fetched first, and the match waits (``engine.type_lookup``); then the reader's TypeConsistencyEnforcement
  decides, and names mean nothing;
- where the types cannot be had, as where one side announces none, the type names must be equal, as with all vendors;
  unless the reader insists (``force_type_validation``).

And one deviation.  IDL without annotations is final to Cyclone DDS's compiler and appendable to all others, and so to
us; such types are written alike in XCDR1, and pairs of them have always matched by name.  They go on doing so where the
names are equal, the samples are XCDR1, and nothing but final or appendable is between the types; a trace says so.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from functools import lru_cache
from typing import TYPE_CHECKING

from ..discovery.matching import MatchRefusal, RefusalKind, names_refusal
from ..structure.dataclass import dataclass
from ..structure.discovered import DiscoveredEndpointData, DiscoveredReaderData, DiscoveredWriterData
from ..structure.errors import MalformedMessage
from ..structure.guid import Guid
from ..structure.qos_policies import DataRepresentationId, TypeConsistency
from ..structure.vendor import OUR_VENDOR_ID
from ..trace.reasons import TypeStep
from ..xtypes.assignability import MissingType, TypeMismatch, type_mismatch
from ..xtypes.type_object import HashedIdentifier, TypeInformation, decode_type_information
from .type_quirks import knows_old_kinds_alone

if TYPE_CHECKING:
    from .participant import Participant

__all__ = ["FITS", "TypeMatching", "TypeVerdict"]

_MOST_REMEMBERED = 1024
_NEITHER = "neither announces type information"


@dataclass(frozen=True, slots=True)
class TypeVerdict:
    """``refusal``: why the types do not fit.  ``step``: what else is to be told of a pair, with its detail in words;
    the match of one that is AWAITED has to wait.  ``withdraws``: our endpoint must go by its type's name from now on,
    or the other would not match it."""

    refusal: MatchRefusal | None = None
    step: TypeStep | None = None
    detail: str = ""
    withdraws: bool = False

    @property
    def is_awaited(self) -> bool:
        return self.step is TypeStep.AWAITED


FITS = TypeVerdict()

_Answer = TypeMismatch | None


class TypeMatching:
    """Judges pairs of one participant, and remembers those whose match waits for types."""

    def __init__(self, engine: Participant) -> None:
        self._engine = engine
        self._waiting: dict[bytes, dict[tuple[Guid, Guid], None]] = {}
        self._answers: dict[tuple[object, ...], _Answer] = {}

    def judge(
        self,
        writer: DiscoveredWriterData,
        reader: DiscoveredReaderData,
        now: float,
        *,
        may_ask: bool,
        names_members: bool = False,
    ) -> TypeVerdict:
        """Of two endpoints, ours or others'.  Types are asked for only where we ``may_ask``.

        ``names_members``: compare complete types if both announce them.  Minimal ones have hashes in place of names.
        """
        refusal = names_refusal(writer, reader)
        if refusal is not None and writer.is_keyed != reader.is_keyed:
            return TypeVerdict(refusal)
        of_writer, of_reader = _information(writer.type_information), _information(reader.type_information)
        pair = _comparable(of_writer, of_reader, names_members=names_members)
        if of_writer is None or of_reader is None or pair is None:
            return self._by_name(writer, reader, refusal, _without(writer, reader, of_writer, of_reader))
        if of_writer.minimal == of_reader.minimal or of_writer.complete == of_reader.complete:
            return FITS
        sides = ((writer, of_writer, pair[0]), (reader, of_reader, pair[1]))
        others = [side for side in sides if side[0].guid.prefix != self._engine.guid.prefix]
        if len(others) == 1:
            ((remote, _, _),) = others
            if self._is_unreadable(of_reader if remote is writer else of_writer, remote):
                why = f"{remote.guid} cannot read what the type of this one is made of"
                return replace(self._by_name(writer, reader, refusal, why), withdraws=True)
        owners = tuple(side[0].guid.prefix for side in others)
        answer = self._compare(pair, owners, reader.qos.type_consistency)
        if isinstance(answer, MissingType):
            unavailable = self._ask(others, now) if may_ask else None
            if unavailable is None and others:
                asked = others[0][0]
                detail = f"{asked.guid} has another {asked.type_name}: what is it made of?"
                return TypeVerdict(step=TypeStep.AWAITED, detail=detail)
            return self._by_name(writer, reader, refusal, unavailable or "a type of ours is not known")
        if answer is None:
            return TypeVerdict(step=TypeStep.ASSIGNABLE, detail=_texts(writer, reader))
        is_lenient = len(others) < 2 or OUR_VENDOR_ID in (writer.vendor_id, reader.vendor_id)
        if is_lenient and refusal is None and _is_xcdr1(writer):
            lenient = self._compare(pair, owners, reader.qos.type_consistency, ignores_extensibility=True)
            if lenient is None:
                return TypeVerdict(step=TypeStep.EXTENSIBILITY, detail=str(answer), withdraws=True)
        return TypeVerdict(_refusal(writer, reader, answer))

    def _is_unreadable(self, ours: TypeInformation, remote: DiscoveredEndpointData) -> bool:
        proxy = self._engine.participants.get(remote.guid.prefix)
        is_old = proxy is not None and knows_old_kinds_alone(proxy.data)
        return is_old and self._engine.types.registry.has_new_kinds(ours.minimal)

    def _by_name(
        self, writer: DiscoveredWriterData, reader: DiscoveredReaderData, refusal: MatchRefusal | None, why: str
    ) -> TypeVerdict:
        """``refusal``: what stands between their names."""
        if reader.qos.type_consistency.force_type_validation:
            return TypeVerdict(
                _refusal(writer, reader, TypeMismatch("", f"the reader insists on validation, but {why or _NEITHER}"))
            )
        return TypeVerdict(refusal, None if refusal is not None or not why else TypeStep.BY_NAME, why)

    def _ask(
        self, others: Sequence[tuple[DiscoveredEndpointData, TypeInformation, HashedIdentifier]], now: float
    ) -> str | None:
        """Have the participants asked whose types are not known; why one of them is of no use, if so."""
        for endpoint, information, root in others:
            answer = self._engine.types.fetch_all(endpoint.guid, root, information, now)
            if isinstance(answer, str):
                return answer
        return None

    def _compare(
        self,
        pair: tuple[HashedIdentifier, HashedIdentifier],
        owners: tuple[bytes, ...],
        consistency: TypeConsistency,
        *,
        ignores_extensibility: bool = False,
    ) -> MissingType | TypeMismatch | None:
        """What assignability says; remembered, as a peer may announce the same again and again."""
        of_writer, of_reader = pair
        question = (of_writer, of_reader, owners, consistency, ignores_extensibility)
        if question in self._answers:
            return self._answers[question]
        objects = self._engine.types.registry.known_to(*owners)
        answer = type_mismatch(of_reader, of_writer, objects, consistency, ignores_extensibility=ignores_extensibility)
        if not isinstance(answer, MissingType):
            if len(self._answers) >= _MOST_REMEMBERED:
                self._answers.clear()
            self._answers[question] = answer
        return answer

    # --- pairs that wait ---------------------------------------------------------------------------------

    def wait(self, local: Guid, remote: Guid) -> bool:
        """The pair's match waits for types; returns whether that is news."""
        waiting = self._waiting.setdefault(remote.prefix, {})
        is_news = (local, remote) not in waiting
        waiting[local, remote] = None
        return is_news

    def no_longer_waiting(self, local: Guid, remote: Guid) -> None:
        waiting = self._waiting.get(remote.prefix)
        if waiting is not None:
            waiting.pop((local, remote), None)
            if not waiting:
                del self._waiting[remote.prefix]

    def waiting_for(self, prefix: bytes) -> list[tuple[Guid, Guid]]:
        """The pairs that wait for types of this participant."""
        return list(self._waiting.get(prefix, ()))


@lru_cache(maxsize=1024)
def _information(octets: bytes) -> TypeInformation | None:
    """What was announced; None where it is nothing that can be read."""
    if not octets:
        return None
    try:
        return decode_type_information(octets)
    except MalformedMessage:
        return None


def _comparable(
    of_writer: TypeInformation | None, of_reader: TypeInformation | None, *, names_members: bool
) -> tuple[HashedIdentifier, HashedIdentifier] | None:
    """The identifiers of the kind that both announce, the writer's first.  All vendors know minimal TypeObjects."""
    if of_writer is None or of_reader is None:
        return None
    kinds = [(of_writer.minimal, of_reader.minimal), (of_writer.complete, of_reader.complete)]
    for one, two in reversed(kinds) if names_members else kinds:
        if isinstance(one, HashedIdentifier) and isinstance(two, HashedIdentifier):
            return one, two
    return None


def _without(
    writer: DiscoveredEndpointData,
    reader: DiscoveredEndpointData,
    of_writer: TypeInformation | None,
    of_reader: TypeInformation | None,
) -> str:
    """Who announces no type information that could be compared; nothing to tell where neither does."""
    if of_writer is None and of_reader is None:
        return ""
    if of_writer is None or of_reader is None:
        return f"{(writer if of_writer is None else reader).guid} announces no type information"
    return "one of the two announces minimal types alone, the other complete ones"


def _is_xcdr1(writer: DiscoveredWriterData) -> bool:
    offered = writer.qos.data_representation.ids
    return not offered or offered[0] == DataRepresentationId.XCDR1


def _refusal(writer: DiscoveredEndpointData, reader: DiscoveredEndpointData, mismatch: TypeMismatch) -> MatchRefusal:
    return MatchRefusal(RefusalKind.TYPE, writer.type_name, reader.type_name, detail=str(mismatch))


def _texts(writer: DiscoveredEndpointData, reader: DiscoveredEndpointData) -> str:
    return f"the reader's {reader.type_name} takes the writer's {writer.type_name}, which is another"
