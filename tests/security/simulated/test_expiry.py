"""Rights that end while they are used, in virtual time: by whose clock, who says what, and that nobody comes back.

DDS-Security 1.1 §8.3.2.11.12, §8.4.2.9.22.  With real processes: ``multiproc_tests/test_expiry.py``.
"""

from __future__ import annotations

from datetime import timedelta
from pathlib import Path

import pytest

from ddsi.config.secure import secure
from ddsi.simulation import Domain, Node
from ddsi.structure.qos import Qos
from ddsi.structure.qos_policies import KeepAll, Properties, Reliable, TransientLocal
from ddsi.structure.status import SecurityRefused, SecurityRevoked
from ddsi_security.keystore.authority import Authority
from ddsi_security.keystore.documents import Rights
from ddsi_security.keystore.file_set import FileSet
from ddsi_security.keystore.keystore import IdentityTerms, Keystore
from ddsi_security.keystore.validity import Validity, utc

from .keystores import make_identities

RELIABLE = Qos(reliability=Reliable(), history=KeepAll(), durability=TransientLocal())
START_NS = 1_700_000_000 * 10**9
LIFE_S = 60.0
ENDED = "the permissions ended at 2023-11-14T22:14:20Z"
IDENTITY_ENDED = "the identity certificate ended at 2023-11-14T22:14:21Z"
"""A certificate is valid in its last second too (RFC 5280 §4.1.2.5), a grant is not."""


@pytest.fixture
def identities(tmp_path: Path) -> list[Properties]:
    """Alice's and Bob's, which last; and that of Brief, which ends after a minute."""
    alice, bob, _ = make_identities(tmp_path, "encrypt")
    keystore = Keystore.at(tmp_path)
    authorities = [
        Authority.parse(certificate.read_bytes(), key.read_bytes(), where="the test's")
        for certificate, key in (
            (keystore.identity_ca_certificate, keystore.identity_ca_key),
            (keystore.permissions_ca_certificate, keystore.permissions_ca_key),
        )
    ]
    begin = Validity.of_days(START_NS).not_before
    terms = IdentityTerms(Validity(begin, utc(START_NS) + timedelta(seconds=LIFE_S)))
    files = FileSet()
    folder = keystore.add_enclave(
        files, "brief", identity_ca=authorities[0], permissions_ca=authorities[1], terms=terms, rights=Rights()
    )
    files.write(force=False)
    brief = secure(folder).properties
    assert brief is not None
    return [alice, bob, brief]


class Scene:
    """Brief writes to Alice, who has admitted her; and Bob, who is good for longer, writes too."""

    def __init__(self, identities: list[Properties]) -> None:
        self.domain = Domain(5)
        self.alice, self.bob, self.brief = (self.domain.node(properties=properties) for properties in identities)
        self.reader = self.alice.reader("Square", RELIABLE)
        self.writers = [node.writer("Square", RELIABLE) for node in (self.bob, self.brief)]
        assert self.domain.run_until(self.domain.all_matched, 20.0)
        assert self.received() == 2

    def received(self) -> int:
        """How many of one new sample of each writer Alice gets."""
        before = len(self.reader.taken)
        for writer in self.writers:
            writer.write(50)
        self.domain.run(3.0)
        return len(self.reader.taken) - before


def has_admitted(node: Node, other: Node) -> bool:
    proxy = node.engine.participants.get(other.guid.prefix)
    return proxy is not None and proxy.is_admitted


def test_whose_rights_end_is_out_at_that_second_with_the_reason(identities: list[Properties]) -> None:
    scene = Scene(identities)
    scene.domain.run(LIFE_S - 1.0 - scene.domain.now)
    assert has_admitted(scene.alice, scene.brief)
    scene.domain.run(2.0)
    for node in (scene.alice, scene.bob):
        assert not has_admitted(node, scene.brief)
        assert SecurityRefused(remote=scene.brief.guid, reason=ENDED) in node.statuses_of(SecurityRefused)
    assert scene.received() == 1, "Bob's alone"


def test_the_owner_is_told_what_ended_and_the_others_are_not(identities: list[Properties]) -> None:
    """An application's participant closes at the first; this one goes on."""
    scene = Scene(identities)
    scene.domain.run(LIFE_S + 100.0)
    assert scene.brief.statuses_of(SecurityRevoked) == [
        SecurityRevoked(reason=f"{reason}: renew what has ended, and create the participant anew")
        for reason in (ENDED, IDENTITY_ENDED)
    ]
    assert not scene.alice.statuses_of(SecurityRevoked)


def test_who_is_out_stays_out_and_its_announcements_are_no_news(identities: list[Properties]) -> None:
    """It announces itself for ten minutes more: the reason is told when it ends, and when it is first seen again."""
    scene = Scene(identities)
    scene.domain.run(LIFE_S + 600.0)
    assert not has_admitted(scene.alice, scene.brief)
    assert scene.alice.statuses_of(SecurityRefused) == 2 * [SecurityRefused(remote=scene.brief.guid, reason=ENDED)]
    assert has_admitted(scene.alice, scene.bob)


def test_a_newcomer_refuses_what_has_ended_already(identities: list[Properties]) -> None:
    """Brief's own clock may be wrong; it does not matter what she thinks."""
    scene = Scene(identities)
    scene.domain.run(LIFE_S + 1.0)
    scene.alice.restart()
    scene.domain.run(20.0)
    assert has_admitted(scene.alice, scene.bob)
    assert not has_admitted(scene.alice, scene.brief)
