"""Types in a module with ``from __future__ import annotations`` (PEP 563), at module level and inside a function."""

from __future__ import annotations

from typing import Annotated

import ddsi
from ddsi import idl
from tests.dcps.running import RELIABLE, in_trio


@idl.struct
class Inner:
    flag: idl.boolean


@idl.struct
class Outer:
    name: Annotated[str, idl.key]
    inner: Inner
    several: idl.sequence[Inner]


@in_trio
async def test_types_of_the_module(domain: int) -> None:
    async with ddsi.DomainParticipant(domain) as participant:
        topic = ddsi.Topic(participant, "Outer", Outer)
        writer, reader = ddsi.DataWriter(participant, topic, RELIABLE), ddsi.DataReader(participant, topic)
        sample = Outer("a", Inner(True), [Inner(False), Inner(True)])
        await writer.write(sample)
        assert (await anext(reader)).data == sample


@in_trio
async def test_types_of_a_function(domain: int) -> None:
    @idl.struct
    class Local:
        number: Annotated[idl.int16, idl.key]
        text: Annotated[str, idl.bound(5)] = ""

    async with ddsi.DomainParticipant(domain) as participant:
        topic = ddsi.Topic(participant, "Local", Local)
        writer, reader = ddsi.DataWriter(participant, topic, RELIABLE), ddsi.DataReader(participant, topic)
        await writer.write(Local(7, "seven"))
        assert (await anext(reader)).data == Local(7, "seven")
