"""Content filters between an engine and strangers: hostile expressions, and what writers say of their samples."""

from __future__ import annotations

from typing import Annotated

import pytest

from ddsi.behavior.content_filter import filter_signatures
from ddsi.discovery.parameters import encode_reader
from ddsi.engine import LocalReader, LocalWriter, Participant
from ddsi.messages.content_filter_info import encode_content_filter_info
from ddsi.messages.data import Data
from ddsi.serialization.parameter_id import ParameterId
from ddsi.serialization.parameter_list import ParameterList
from ddsi.structure import builtin_entity_ids as ids
from ddsi.structure.cache_change import ChangeKind
from ddsi.structure.discovered import ContentFilterProperty, DiscoveredReaderData
from ddsi.structure.guid import EntityId
from ddsi.structure.qos import Qos, reader_qos, writer_qos
from ddsi.structure.qos_policies import BestEffort, KeepAll
from ddsi.xtypes import idl, serialize
from ddsi.xtypes.sql import SampleFilters
from ddsi.xtypes.type_support import type_support

from .wire import Stranger, engine, sent

BEST_EFFORT = Qos(reliability=BestEffort(), history=KeepAll())


@idl.struct
class Shape:
    color: Annotated[str, idl.key]
    size: idl.int32


def announced(expression: str, *parameters: str, of: str = "Square", kind: str = "DDSSQL") -> ContentFilterProperty:
    return ContentFilterProperty(
        content_filtered_topic_name="F", related_topic_name=of, filter_class_name=kind,
        filter_expression=expression, expression_parameters=parameters,
    )  # fmt: skip


def filtering_writer(participant: Participant) -> LocalWriter:
    compiler = SampleFilters(type_support(Shape)).compile
    return participant.create_writer(
        "Square", "T", writer_qos(BEST_EFFORT), 0.0, is_keyed=False, compile_filter=compiler
    )  # fmt: skip


def subscribe(stranger: Stranger, to: Participant, content_filter: ContentFilterProperty | None) -> None:
    data = DiscoveredReaderData(
        guid=stranger.endpoint(1, is_writer=False), topic_name="Square", type_name="T", qos=reader_qos(BEST_EFFORT),
        content_filter=content_filter,
    )  # fmt: skip
    octets = stranger._sedp(ids.SEDP_SUBSCRIPTIONS_WRITER, ids.SEDP_SUBSCRIPTIONS_READER, encode_reader(data))
    to.receive_datagram(octets, stranger.address, 0.0)
    to.drain_effects()


def sizes_sent(participant: Participant, writer: LocalWriter, *sizes: int) -> list[int]:
    out = []
    for size in sizes:
        participant.write(writer, ChangeKind.ALIVE, serialize(Shape("RED", size)), b"", 0.0)
        participant.flush()
        if sent(participant):
            out.append(size)
    return out


EXPRESSIONS = [
    (announced("size > 2"), [3]),
    (announced("size > %0", "2"), [3]),
    (announced(""), [1, 2, 3]),
    (announced("size > 2", of="Circle"), [1, 2, 3]),
    (announced("size > 2", kind="OWN"), [1, 2, 3]),
    (announced("size > %0"), [1, 2, 3]),
    (announced("size > %0", "x"), [1, 2, 3]),
    (announced("no_such > 2"), [1, 2, 3]),
    (announced("size > "), [1, 2, 3]),
    (announced("(" * 5000), [1, 2, 3]),
    (announced("NOT " * 2000 + "size = 1"), [1, 2, 3]),
    (announced("size = 1 OR " * 600 + "size = 1"), [1, 2, 3]),
    (announced("size > " + "9" * 5000), [1, 2, 3]),
    (announced("size = %0", *["3"] * 101), [1, 2, 3]),
    (announced("color LIKE '" + "%a" * 1000 + "'"), [1, 2, 3]),
    (announced("__class__ = 1"), [1, 2, 3]),
    (announced("size.__class__ = 1"), [1, 2, 3]),
    (None, [1, 2, 3]),
]


@pytest.mark.parametrize(("content_filter", "expected"), EXPRESSIONS)
def test_what_cannot_be_evaluated_passes(content_filter: ContentFilterProperty | None, expected: list[int]) -> None:
    """Whatever a stranger announces."""
    participant, stranger = engine(), Stranger()
    writer = filtering_writer(participant)
    stranger.introduce(participant)
    subscribe(stranger, participant, content_filter)
    assert len(writer.behavior.readers) == 1
    sent(participant)
    assert sizes_sent(participant, writer, 1, 2, 3) == expected


def test_a_stranger_may_change_its_mind_and_the_last_word_holds() -> None:
    participant, stranger = engine(), Stranger()
    writer = filtering_writer(participant)
    stranger.introduce(participant)
    for content_filter, expected in ((announced("size = 1"), [1]), (announced("sise = 1"), [1, 2]), (None, [1, 2]),
                                     (announced("size = 2"), [2])):  # fmt: skip
        subscribe(stranger, participant, content_filter)
        sent(participant)
        assert sizes_sent(participant, writer, 1, 2) == expected


# --- as a reader -------------------------------------------------------------------------------------------------


class Receiving:
    """A reader with a filter, and a stranger that writes to it."""

    def __init__(self) -> None:
        self.participant, self.stranger = engine(), Stranger()
        self.filter = announced("size > %0", "2")
        self.evaluated = 0
        passes = SampleFilters(type_support(Shape)).compile("size > %0", ("2",))

        def evaluate(change: object) -> bool:
            self.evaluated += 1
            return passes(change)  # type: ignore[arg-type]

        self.reader: LocalReader = self.participant.create_reader(
            "Square", "T", reader_qos(BEST_EFFORT), 0.0, is_keyed=False, content_filter=(self.filter, evaluate)
        )
        self.stranger.introduce(self.participant)
        octets = self.stranger.sedp_writer(qos=BEST_EFFORT)
        self.participant.receive_datagram(octets, self.stranger.address, 0.0)

    def hear(self, number: int, size: int, info: bytes | None) -> list[int]:
        """One sample, with this filter information: the numbers that the reader holds then."""
        inline = ParameterList([(ParameterId.CONTENT_FILTER_INFO, info)]) if info is not None else None
        writer_id = self.stranger.endpoint(1, is_writer=True).entity_id
        data = Data(EntityId.UNKNOWN, writer_id, number, inline, serialize(Shape("RED", size)))
        self.participant.receive_datagram(self.stranger.message(data.encode()), self.stranger.address, 0.0)
        assert self.reader.history is not None
        return [change.sequence_number for _, change in self.reader.history.take()]


def test_a_reader_believes_what_a_writer_says_of_its_own_filter_and_of_no_other() -> None:
    receiving = Receiving()
    own, rti = filter_signatures(receiving.filter)
    foreign, _ = filter_signatures(announced("size > %0", "3"))
    assert receiving.hear(1, 1, None) == []
    assert receiving.hear(2, 9, None) == [2]
    assert receiving.hear(3, 1, encode_content_filter_info({foreign: True})) == []
    assert receiving.hear(4, 9, encode_content_filter_info({foreign: False})) == [4]
    assert receiving.evaluated == 4
    assert receiving.hear(5, 9, encode_content_filter_info({foreign: True, own: False})) == []
    assert receiving.hear(6, 9, encode_content_filter_info({foreign: False, rti: True})) == [6]
    assert receiving.hear(7, 9, encode_content_filter_info({rti: False})) == []
    assert receiving.evaluated == 4
    assert receiving.reader.lost.total_count == 0


def test_filter_information_that_is_cut_short_ends_the_message() -> None:
    receiving = Receiving()
    info = encode_content_filter_info({bytes(16): True})
    assert receiving.hear(1, 9, info[:20]) == []
    assert receiving.participant.drops.total() == 1
    assert receiving.hear(2, 9, info) == [2]
