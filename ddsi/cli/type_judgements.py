"""What stands between the types of endpoints that others have: fetched from their participants, and compared.

DDS-XTypes 1.3 §7.6.3.3, §7.6.3.4.2.  Each two types are compared once, however many pairs there are of them; what
cannot be fetched in time is left to the type names.
"""

from __future__ import annotations

from collections.abc import Iterable
from itertools import islice

import trio

from ..dcps import DomainParticipant
from ..discovery.matching import MatchRefusal, RefusalKind, policies_refusal
from ..structure.discovered import DiscoveredReaderData, DiscoveredWriterData
from ..structure.errors import DdsError
from ..structure.qos_policies import TypeConsistency
from ..xtypes.assignability import MissingType, TypeMismatch, type_mismatch
from .census import Pair

__all__ = ["TypeJudgements", "judge_types", "with_types"]

_MOST_COMPARED = 256
_PATIENCE_S = 5.0

_Question = tuple[bytes, bytes, TypeConsistency]
TypeJudgements = dict[_Question, TypeMismatch | None]
"""By what the writer announces, what the reader does, and its policy: what stands between the types; None: they fit."""


async def judge_types(participant: DomainParticipant, pairs: Iterable[Pair]) -> TypeJudgements:
    """Compare the types of all pairs that announce them; takes some seconds at most."""
    different = {_question(pair): pair for pair in pairs if _announces_two_types(pair)}
    found: TypeJudgements = {}
    with trio.move_on_after(_PATIENCE_S):
        for question, pair in islice(different.items(), _MOST_COMPARED):
            try:
                written = await participant.type_objects(pair.writer)
                read = await participant.type_objects(pair.reader)
            except DdsError:
                continue  # nobody answers: names decide
            consistency = pair.reader.qos.type_consistency
            answer = type_mismatch(read.root, written.root, {**written.objects, **read.objects}, consistency)
            if not isinstance(answer, MissingType):
                found[question] = answer
    return found


def with_types(pair: Pair, judgements: TypeJudgements) -> Pair:
    """The pair, judged by what its types are made of where that is known."""
    writer, reader = pair.writer, pair.reader
    question = _question(pair)
    if question not in judgements or writer.is_keyed != reader.is_keyed:
        return pair
    mismatch = judgements[question]
    if mismatch is None:
        return Pair(writer, reader, policies_refusal(writer, reader))
    refusal = MatchRefusal(RefusalKind.TYPE, writer.type_name, reader.type_name, detail=str(mismatch))
    return Pair(writer, reader, refusal)


def _question(pair: Pair) -> _Question:
    return pair.writer.type_information, pair.reader.type_information, pair.reader.qos.type_consistency


def _announces_two_types(pair: Pair) -> bool:
    writer: DiscoveredWriterData = pair.writer
    reader: DiscoveredReaderData = pair.reader
    if not writer.type_information or not reader.type_information:
        return False
    return writer.type_information != reader.type_information or writer.type_name != reader.type_name
