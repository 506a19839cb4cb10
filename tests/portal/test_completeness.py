"""What entities offer in ddsi, they offer in ddsi.blocking and ddsi.aio; what they do not is said here, and why."""

from __future__ import annotations

from typing import Any

import pytest

import ddsi
from ddsi import aio, blocking

LEFT_OUT = {
    "abandon": "for the rooms inside",
    "participant": "the caller made the entity with it",
    "type_support": "for the rooms inside",
    "endpoint_defaults": "for the rooms inside",
    "content_filtered_topic": "the caller made the reader with it",
    "topics": "the caller made the multi-topic of them",
    # These would hand out entities of trio.
    "readers": "those of a multi-topic's parts; `explain` tells of their matches",
    "contained_entities": "the caller made them",
    "lookup_topicdescription": "the caller made it",
    "lookup_datawriter": "the caller made it",
    "lookup_datareader": "the caller made it",
    # These speak of what a type is made of: for tools.
    "type_objects": "endpoint_type makes a class of them",
    "type_object": "endpoint_type makes a class of them",
}


def _public(kind: type[Any]) -> set[str]:
    return {name for name in dir(kind) if not name.startswith("_")}


@pytest.mark.parametrize("module", [aio, blocking], ids=["aio", "blocking"])
@pytest.mark.parametrize(
    "name",
    [
        *("DomainParticipant", "Topic", "ContentFilteredTopic", "Publisher", "Subscriber", "DataWriter", "DataReader"),
        *("MultiTopic", "MultiTopicReader"),
        *("BuiltinTopicReader", "WaitSet", "GuardCondition", "StatusCondition", "ReadCondition", "QueryCondition"),
    ],
)
def test_entities_offer_what_they_offer_in_trio(module: Any, name: str) -> None:
    assert _public(getattr(ddsi, name)) - _public(getattr(module, name)) <= set(LEFT_OUT)


def test_what_is_left_out_exists() -> None:
    kinds = (ddsi.DomainParticipant, ddsi.Topic, ddsi.Publisher, ddsi.Subscriber, ddsi.DataReader)
    joined = (ddsi.MultiTopic, ddsi.MultiTopicReader)
    assert set(LEFT_OUT) <= set().union(*(_public(kind) for kind in (*kinds, *joined)))
