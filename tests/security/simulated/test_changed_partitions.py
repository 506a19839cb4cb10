"""A partition that changes on a live endpoint: rights are asked about again, by its owner and by everybody it matches.

DDS-Security 1.1 §8.4.2.9.4-5 (creating), §8.4.2.9.10-11 (remote endpoints).
"""

from __future__ import annotations

from pathlib import Path

import pytest

from ddsi.config.secure import secure
from ddsi.simulation import Domain, Node, NodeReader, NodeWriter
from ddsi.structure.errors import NotAllowedBySecurity
from ddsi.structure.qos import Qos
from ddsi.structure.qos_policies import KeepAll, Partition, Properties, Reliable
from ddsi.structure.status import SecurityRefused
from ddsi_security.keystore.documents import Rights
from ddsi_security.keystore.keystore import IdentityTerms, create_keystore
from ddsi_security.keystore.validity import Validity
from ddsi_security.own_participant import OwnParticipant

from .keystores import GOVERNANCES

WALL_CLOCK_AT_START_NS = 1_700_000_000 * 10**9
RELIABLE = Qos(reliability=Reliable(), history=KeepAll())
KEYLESS = {"writer": {"payload", "message", "nothing"}, "reader": {"message", "nothing"}}
"""Under which governances an endpoint needs no key of the other."""
BLUE, ANY_BLUE, RED = (RELIABLE | Qos(partition=Partition(name)) for name in ("blue", "b*", "red"))
either = pytest.mark.parametrize("who", ["writer", "reader"])
every_governance = pytest.mark.parametrize("governance", GOVERNANCES)

Identities = dict[str, list[Properties]]


@pytest.fixture(scope="module")
def identities_of(tmp_path_factory: pytest.TempPathFactory) -> Identities:
    """By governance: two who may be in partition blue, and in no other."""
    found = {}
    for number, (name, governance) in enumerate(GOVERNANCES.items()):
        folder: Path = tmp_path_factory.mktemp(f"keystore{number}")
        create_keystore(
            folder, ("alice", "bob"),
            terms=IdentityTerms(Validity.of_days(WALL_CLOCK_AT_START_NS)),
            governance=governance, rights=Rights(partitions=("blue", "b*")),
        )  # fmt: skip
        properties = [secure(folder / "enclaves" / name).properties for name in ("alice", "bob")]
        found[name] = [each for each in properties if each is not None]
    return found


@pytest.fixture
def identities(identities_of: Identities) -> list[Properties]:
    return identities_of["encrypt"]


def matched(identities: list[Properties]) -> tuple[Domain, NodeWriter, NodeReader]:
    domain = Domain()
    alice, bob = (domain.node(properties=properties) for properties in identities)
    writer, reader = alice.writer("Square", BLUE), bob.reader("Square", BLUE)
    assert they_match(domain, writer, reader)
    return domain, writer, reader


def they_match(domain: Domain, writer: NodeWriter, reader: NodeReader) -> bool:
    return domain.run_until(lambda: writer.matched_count == reader.matched_count == 1, 5.0)


def samples_flow(domain: Domain, writer: NodeWriter, reader: NodeReader) -> bool:
    before = len(reader.taken)
    writer.write()
    return domain.run_until(lambda: len(reader.taken) == before + 1, 5.0)


def test_an_allowed_partition_changes_and_samples_go_on(identities: list[Properties]) -> None:
    domain, writer, reader = matched(identities)
    writer.change(ANY_BLUE)
    domain.run(1.0)
    assert samples_flow(domain, writer, reader)


def test_who_parts_by_a_partition_and_meets_again_has_new_keys(identities: list[Properties]) -> None:
    domain, writer, reader = matched(identities)
    writer.change(RELIABLE | Qos(partition=Partition("bluish")))
    domain.run(1.0)
    assert (writer.matched_count, reader.matched_count) == (0, 0)
    reader.change(ANY_BLUE)
    assert they_match(domain, writer, reader)
    assert samples_flow(domain, writer, reader)


def test_an_owner_is_refused_a_partition_that_its_permissions_do_not_name(identities: list[Properties]) -> None:
    domain, writer, reader = matched(identities)
    for endpoint in (writer, reader):
        before = endpoint.local.data
        with pytest.raises(NotAllowedBySecurity, match="red"):
            endpoint.change(RED)
        assert endpoint.local.data == before
    domain.run(1.0)
    assert (writer.matched_count, reader.matched_count) == (1, 1)


@either
def test_a_peer_that_changes_to_it_all_the_same_is_unmatched(
    identities: list[Properties], monkeypatch: pytest.MonkeyPatch, who: str
) -> None:
    domain, writer, reader = matched(identities)
    wrongdoer, witness = (writer, reader) if who == "writer" else (reader, writer)
    protection = wrongdoer.local.protection
    monkeypatch.setattr(OwnParticipant, "endpoint_changed", lambda self, data: protection)
    wrongdoer.change(RELIABLE | Qos(partition=Partition("blue", "red")))  # the partitions still meet
    domain.run(2.0)
    assert witness.matched_count == 0
    (refused,) = witness.node.statuses_of(SecurityRefused)
    assert isinstance(refused, SecurityRefused)
    assert refused.remote == wrongdoer.guid
    assert "red" in refused.reason


def do_as_you_like(node: Node, endpoint: NodeWriter | NodeReader, monkeypatch: pytest.MonkeyPatch) -> None:
    """This participant does not check its own rights."""
    protection = endpoint.local.protection
    monkeypatch.setattr(node.engine.hooks, "local_endpoint_changed", lambda data: protection)


@every_governance
@either
def test_a_peer_that_was_unmatched_alone_and_corrects_itself_matches_again(
    identities_of: Identities, monkeypatch: pytest.MonkeyPatch, governance: str, who: str
) -> None:
    """To the one that erred the two were matched all the time."""
    domain, writer, reader = matched(identities_of[governance])
    wrongdoer, witness = (writer, reader) if who == "writer" else (reader, writer)
    do_as_you_like(wrongdoer.node, wrongdoer, monkeypatch)
    for _ in range(3):
        wrongdoer.change(RELIABLE | Qos(partition=Partition("blue", "red")))
        domain.run(10.0)
        assert (wrongdoer.matched_count, witness.matched_count) == (1, 0)
        seen = len(reader.taken)
        writer.write()
        domain.run(1.0)
        assert len(reader.taken) == seen
        wrongdoer.change(BLUE)
        assert they_match(domain, writer, reader)
        domain.run(2.0)
        assert samples_flow(domain, writer, reader)


@every_governance
@either
def test_who_throws_keys_away_as_it_parts_matches_again(
    identities_of: Identities, monkeypatch: pytest.MonkeyPatch, governance: str, who: str
) -> None:
    """As Fast DDS does.  The other hears of the last of its changes only, and does not part."""
    domain, writer, reader = matched(identities_of[governance])
    domain.run(10.0)
    forgetful, other = (writer, reader) if who == "writer" else (reader, writer)
    domain.network.partition([forgetful.node.host])
    forgetful.change(RELIABLE | Qos(partition=Partition("bluish")))
    forgetful.node.engine.hooks.remote_endpoint_lost(other.guid)
    forgetful.change(BLUE)
    assert (forgetful.matched_count, other.matched_count) == (governance in KEYLESS[who], 1)
    domain.network.heal()
    assert they_match(domain, writer, reader)
    assert samples_flow(domain, writer, reader)
