"""The type of a topic that this participant knows by name only."""

from __future__ import annotations

import pytest

import ddsi

from .running import Note, Shape, domain, in_trio, pair

__all__ = ["domain"]


@in_trio
async def test_a_discovered_type_reads_what_its_author_writes(domain: int) -> None:
    async with pair(domain, kind=Shape, announce_types=True) as both:
        dynamic = await both.there.discover_type("Square")
        assert dynamic is not Shape
        assert await both.there.discover_type("Square") is dynamic
        assert await both.there.endpoint_type(both.there.discovered_publications()[0]) is dynamic
        reader = ddsi.DataReader(both.there, ddsi.Topic(both.there, "Square", dynamic))
        await reader.wait_for_matched()
        await both.writer.write(Shape("BLUE", 1, 2))
        async for sample in reader:
            assert sample.data == dynamic("BLUE", 1, 2)
            break


@in_trio
async def test_a_topic_that_nobody_announces_is_waited_for_in_vain(domain: int) -> None:
    async with pair(domain, kind=Note) as both:
        with pytest.raises(ddsi.DdsTimeout, match="nobody announced a writer or reader of topic 'None'"):
            await both.there.discover_type("None", timeout=0.05)


@in_trio
async def test_peers_that_tell_no_more_than_a_name_are_told_of(domain: int, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("ddsi.dcps.type_discovery._GRACE_S", 0.05)
    async with pair(domain, kind=Note, announce_types=False) as both:
        with pytest.raises(ddsi.PreconditionNotMet) as caught:
            await both.there.discover_type("Square")
        assert "announces no type information, but only the type's name, 'Note'" in str(caught.value)
        (endpoint,) = both.there.discovered_publications()
        with pytest.raises(ddsi.PreconditionNotMet, match="announces no type information"):
            await both.there.endpoint_type(endpoint)
