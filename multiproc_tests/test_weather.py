"""Two hosts and a network that loses, delays, duplicates and reorders: what is promised arrives all the same.

The same plays as in ``test_interop.py``, over the seeded relay.  A failure prints the relay's seed and counters.
"""

from __future__ import annotations

from dataclasses import replace

import pytest

from .framework import Weather, async_test, namespace_pair, relayed_namespaces, scenario
from .matrix.stories import Cast, deliver, deliver_late
from .peers.catalogue import CYCLONE_C, CYCLONE_PYTHON, FAST_DDS, OURS
from .peers.options import Options
from .peers.peer import Peer

WEATHERS = {
    "loss": Weather(loss=0.1),
    "delay": Weather(delay=0.05, jitter=0.02),
    "disorder": Weather(duplicate=0.1, reorder=0.1),
}
STORM = Weather(loss=0.1, delay=0.05, jitter=0.02, duplicate=0.05, reorder=0.05)
SEED = 20
PAIRS = [
    pytest.param(OURS, OURS, id="ddsi-ddsi"),
    pytest.param(OURS, CYCLONE_C, id="ddsi-cyclone", marks=pytest.mark.peers),
    pytest.param(FAST_DDS, OURS, id="fastdds-ddsi", marks=pytest.mark.peers),
    pytest.param(CYCLONE_C, FAST_DDS, id="cyclone-fastdds", marks=pytest.mark.peers),
]
FRAGMENT_PAIRS = [
    pytest.param(OURS, OURS, id="ddsi-ddsi"),
    pytest.param(OURS, CYCLONE_C, id="ddsi-cyclone", marks=pytest.mark.peers),
    # Not Fast DDS: it sends datagrams of 64 kB, and of the 44 frames of one some are always lost.
    pytest.param(CYCLONE_C, OURS, id="cyclone-ddsi", marks=pytest.mark.peers),
]
PATIENT = Options(keyless=True, wait_s=40)


async def play_in_storm(
    publisher: Peer, subscriber: Peer, options: Options, *, weather: Weather = STORM, is_late: bool = False
) -> None:
    publisher.locate()
    subscriber.locate()
    with relayed_namespaces("pub", "sub", weather=weather, seed=SEED) as (hosts, relay):
        try:
            async with scenario(f"storm {publisher}-{subscriber}", deadline=100) as stage:
                told = replace(options, readers=0) if is_late else options
                cast = Cast(stage, hosts["pub"], hosts["sub"], publisher, subscriber, told, options)
                await (deliver_late if is_late else deliver)(cast)
        except BaseException as error:
            error.add_note(relay.report())
            raise
        counters = relay.links["pub", "sub"].counters
        assert counters.lost > 0 or not weather.loss, "the storm did not touch anything"
        assert min(counters.duplicated, counters.reordered) > 0 or not weather.reorder, "nothing was out of order"


@pytest.mark.parametrize("weather", WEATHERS.values(), ids=WEATHERS)
@async_test
async def test_reliable_samples_all_arrive_in_any_weather(weather: Weather) -> None:
    """Each kind of weather alone; all of it at once is the storm."""
    await play_in_storm(OURS, OURS, replace(PATIENT, count=100), weather=weather)


@pytest.mark.parametrize(("publisher", "subscriber"), PAIRS)
@async_test
async def test_reliable_samples_all_arrive_in_a_storm(publisher: Peer, subscriber: Peer) -> None:
    """Ten per cent of the packets are lost both ways, and every sample arrives, once and in order."""
    await play_in_storm(publisher, subscriber, replace(PATIENT, count=100))


@pytest.mark.parametrize(("publisher", "subscriber"), FRAGMENT_PAIRS)
@async_test
async def test_fragments_all_arrive_in_a_storm(publisher: Peer, subscriber: Peer) -> None:
    """Samples of many fragments, of which each may be lost, are completed by asking for those that are missing."""
    await play_in_storm(publisher, subscriber, replace(PATIENT, topic="Blob", blob_octets=100_000, count=3))


@async_test
async def test_a_late_joiner_gets_its_history_in_a_storm() -> None:
    """All history, all over a bad line."""
    await play_in_storm(OURS, OURS, replace(PATIENT, count=50), is_late=True)


@pytest.mark.peers
@pytest.mark.parametrize("is_unicast", [False, True], ids=["multicast", "unicast"])
@pytest.mark.parametrize(
    ("publisher", "subscriber"), [(OURS, OURS), (OURS, CYCLONE_PYTHON), (CYCLONE_C, OURS), (CYCLONE_C, CYCLONE_PYTHON)]
)
@async_test
async def test_two_hosts_on_a_cable_find_each_other(publisher: Peer, subscriber: Peer, is_unicast: bool) -> None:
    """An interface that is not the loopback, with and without multicast."""
    publisher.locate()
    subscriber.locate()
    options = Options(unicast=is_unicast)
    with namespace_pair() as (left, right):
        async with scenario(f"cable {publisher}-{subscriber}", deadline=40) as stage:
            await deliver(Cast(stage, left, right, publisher, subscriber, options, options))
