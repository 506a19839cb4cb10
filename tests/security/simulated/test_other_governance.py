"""Two whose governance documents differ stay apart, and whoever asks is told what differs, once, and what to do."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest

from ddsi.engine.explaining import explain
from ddsi.simulation import Domain
from ddsi.structure.qos_policies import Properties, Property
from ddsi_security.keystore.authority import Authority
from ddsi_security.keystore.documents import GovernanceDraft

from .keystores import GOVERNANCES, make_identities


def identities(folder: Path, other: GovernanceDraft) -> tuple[Properties, Properties]:
    """Alice under governance "encrypt", bob under the other."""
    alice, bob, _ = make_identities(folder, "encrypt")
    certificate, key = folder / "public/permissions_ca.cert.pem", folder / "private/permissions_ca.key.pem"
    authority = Authority.parse(certificate.read_bytes(), key.read_bytes(), where="the test's")
    (folder / "other.p7s").write_bytes(authority.sign_document(other.xml()))
    return alice, {**bob, "dds.sec.access.governance": Property(f"file:{folder / 'other.p7s'}")}


def test_a_topic_that_is_protected_otherwise_is_told_of_once_and_in_words(tmp_path: Path) -> None:
    domain = Domain(1)
    other = replace(GOVERNANCES["encrypt"], metadata="SIGN")
    alice, bob = (domain.node(properties=properties) for properties in identities(tmp_path, other))
    alice.writer("Square")
    bob.reader("Square")
    domain.run(5.0)
    for node in (alice, bob):
        (pair,) = explain(node.engine, "Square", domain.now).pairs
        (found,) = pair.disagreements
        assert found.policy == "security"
        assert found.offered.endswith("protected, submessage encrypted, payload encrypted")
        assert found.requested.endswith("protected, payload encrypted")
        assert found.remedy == "give both participants one governance document, or the same rule for this topic"


@pytest.mark.parametrize("others_rtps", ["ENCRYPT", "NONE"])
def test_a_participant_that_is_protected_otherwise_needs_a_governance_and_no_other_identity(
    tmp_path: Path, others_rtps: str
) -> None:
    domain = Domain(1)
    other = replace(GOVERNANCES["encrypt"], rtps=others_rtps)
    alice, bob = (domain.node(properties=properties) for properties in identities(tmp_path, other))
    domain.run(5.0)
    (trouble,) = explain(alice.engine, "Square", domain.now).troubles
    assert trouble.guid == bob.guid
    what = {"ENCRYPT": "rtps encrypted there, not here", "NONE": "rtps protected here, not there"}[others_rtps]
    assert trouble.requested.startswith(f"its governance protects participants otherwise: {what}")
    assert trouble.remedy == "give both participants one governance document, or the same rule for this domain"
