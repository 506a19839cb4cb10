"""Whatever strangers send: no error leaves the engine, no table exceeds its bound, and friends are served."""

from __future__ import annotations

import gc
import tracemalloc

import pytest

from tests.fuzz.strangers import Flood, main, tables

MOST_GROWTH = 3 << 20
"""Octets; the tables are full long before half of a flood is over."""


def check(flood: Flood) -> None:
    assert flood.is_friend_served()
    assert flood.octets_sent() < flood.octets, "all of it together is no amplification"
    for ear in (flood.plain, flood.secured):
        assert ear.engine.drops.total() > 100
    (peer,) = flood.secured.engine.participants.values()
    assert peer.is_admitted, "nobody has pushed it out, and nobody else got in"


def test_a_flood_of_strangers_leaves_every_table_within_its_bound() -> None:
    """``Flood`` looks at all tables after every 200 datagrams."""
    flood = Flood(1)
    flood.run(4000)
    check(flood)
    largest = {table.name: table.size for table in flood.peaks["without security"]}
    assert (largest["participants"], largest["hosts of one participant"]) == (100, 8)
    assert all(largest[name] > 10 for name in ("endpoints", "instances", "octets of fragments")), "they fill"


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(2, 5))
def test_however_long_it_lasts_it_takes_no_more_memory(seed: int) -> None:
    tracemalloc.start()
    try:
        flood = Flood(seed)
        flood.run(10_000)
        before = held_beside_fragments(flood)
        flood.run(5000)
        after = held_beside_fragments(flood)
    finally:
        tracemalloc.stop()
    check(flood)
    assert after - before < MOST_GROWTH


def held_beside_fragments(flood: Flood) -> int:
    """Octets.  Unfinished samples are now many, now few; they have a bound of their own, which ``Flood`` looks at."""
    gc.collect()
    engines = (flood.plain.engine, flood.secured.engine)
    fragments = sum(one.defrag_budget.octets + one.stateless_defrag_budget.octets for one in engines)
    return tracemalloc.get_traced_memory()[0] - fragments


def test_the_same_seed_makes_the_same_flood() -> None:
    floods = [Flood(7), Flood(7)]
    for flood in floods:
        flood.run(400)
    one, other = floods
    assert one.plain.engine.drops == other.plain.engine.drops
    assert one.secured.engine.drops == other.secured.engine.drops
    assert tables(one.plain.engine) == tables(other.plain.engine)
    assert (one.octets, one.octets_sent()) == (other.octets, other.octets_sent())


def test_the_command_prints_tables_memory_and_drops(capsys: pytest.CaptureFixture[str]) -> None:
    main(["--datagrams", "200", "--seed", "3"])
    said = capsys.readouterr().out
    for words in (
        "KiB resident",
        "without security",
        "secured",
        "participants",
        "dropped: ",
        "the friend is served: True",
    ):
        assert words in said
