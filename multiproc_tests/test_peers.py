"""The peers among themselves, briefly: what they say of each other is worth as much as they are started right."""

from __future__ import annotations

from pathlib import Path

import pytest

from .framework import Unavailable, async_test
from .matrix import find_case, missing_ability
from .matrix.outcome import play
from .peers import build as build_module
from .peers.build import FASTDDS, build
from .peers.catalogue import CYCLONE_C, CYCLONE_PYTHON, DUST, FAST_DDS, FOREIGN, PEERS
from .peers.options import Options
from .peers.peer import Ability, Peer, network_environment
from .peers.programs.protocol import blob_octets, describe


@pytest.mark.peers
@pytest.mark.parametrize(
    ("publisher", "subscriber"),
    [(CYCLONE_C, FAST_DDS), (FAST_DDS, CYCLONE_PYTHON), (DUST, CYCLONE_C), (CYCLONE_C, DUST)],
)
@async_test
async def test_foreign_peers_reach_each_other(publisher: Peer, subscriber: Peer) -> None:
    """Each of the four publishes or subscribes at least once, so that a failure of ours is not one of theirs."""
    await play(find_case("reliable"), publisher, subscriber)


@pytest.mark.peers
@pytest.mark.parametrize("peer", FOREIGN, ids=str)
def test_every_peer_tells_its_version(peer: Peer) -> None:
    """Results without versions are worth nothing."""
    peer.locate()
    assert peer.version()[0].isdigit()


def test_a_case_that_a_peer_cannot_play_is_told_apart() -> None:
    """Dust DDS has no keys in Python: not a failure, but not applicable."""
    assert missing_ability(find_case("keyed-dispose"), CYCLONE_C, DUST) == "dust has no keyed topics"
    assert missing_ability(find_case("reliable"), *PEERS) is None
    assert Ability.XCDR2 not in FAST_DDS.abilities


def test_options_become_the_documented_words() -> None:
    """What is not the default of the program is said, flags only where set."""
    words = Options(colors=("RED", "BLUE"), blob_octets=10, dispose=True, partitions=("a", "b")).arguments()
    assert " ".join(words) == "-d 1 -t Square -c RED,BLUE -n 5 -i 10 -w 15 -s 30 -x 1 -M 1 -P a,b -B 10 -D -H"


def test_the_environment_names_one_interface() -> None:
    """No peer may choose an interface by itself."""
    multicast, unicast = network_environment("lo"), network_environment("tap0", ["10.0.0.1"])
    for name in ("CYCLONEDDS_URI", "DDSI_URI"):
        assert '<NetworkInterface name="lo"/>' in multicast[name]
        assert "Peer" not in multicast[name]
        assert '<NetworkInterface name="tap0"/>' in unicast[name]
        assert '<Peer Address="10.0.0.1"/>' in unicast[name]
        assert "<AllowMulticast>false" in unicast[name]


def test_blob_octets_are_as_documented() -> None:
    """Octet j of blob i is 31 j + 7 (j >> 8) + i modulo 256; the CRC is that of the captures of real vendors."""
    octets = blob_octets(70_000, 3)
    assert all(octets[j] == (31 * j + 7 * (j >> 8) + 3) & 255 for j in (0, 1, 255, 256, 65_535, 65_536, 69_999))
    assert len(octets) == 70_000

    class Blob:
        def __init__(self) -> None:
            self.id, self.data = 0, blob_octets(200_000, 0)

    assert describe(Blob()) == "0 200000 181b83ae"


def test_a_missing_compiler_is_named(monkeypatch: pytest.MonkeyPatch) -> None:
    """The reason says what to install."""
    monkeypatch.setenv("PATH", "/nowhere")
    with pytest.raises(Unavailable, match=r"'g\+\+' is missing: apt-get install g\+\+ libfastrtps-dev"):
        build(FASTDDS)


def test_a_changed_source_is_another_build(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    """The folder of a build is named after what it is made of."""
    before = build_module._fingerprint(FASTDDS)
    for source in FASTDDS.sources:
        (tmp_path / source).write_bytes((build_module.PROGRAMS / source).read_bytes())
    monkeypatch.setattr(build_module, "PROGRAMS", tmp_path)
    assert build_module._fingerprint(FASTDDS) == before
    (tmp_path / "payload.h").write_text("changed")
    assert build_module._fingerprint(FASTDDS) != before
