"""Plain and secured participants on one domain, as allow_unauthenticated_participants says."""

from __future__ import annotations

from pathlib import Path

from ddsi.config.secure import secure
from ddsi.simulation import Domain
from ddsi.structure.qos import Qos
from ddsi.structure.qos_policies import KeepAll, Properties, Reliable, TransientLocal
from ddsi.structure.status import SecurityRefused
from ddsi_security.access_control.smime import sign_document
from ddsi_security.keystore.authority import Authority
from ddsi_security.keystore.documents import GovernanceDraft, Rights
from ddsi_security.keystore.keystore import IdentityTerms, create_keystore
from ddsi_security.keystore.validity import Validity

from .keystores import make_identities

RELIABLE = Qos(reliability=Reliable(), history=KeepAll(), durability=TransientLocal())
START_NS = 1_700_000_000 * 10**9

OPEN_TOPIC = b"""<topic_rule>
        <topic_expression>Open</topic_expression>
        <enable_discovery_protection>false</enable_discovery_protection>
        <enable_liveliness_protection>false</enable_liveliness_protection>
        <enable_read_access_control>false</enable_read_access_control>
        <enable_write_access_control>false</enable_write_access_control>
        <metadata_protection_kind>NONE</metadata_protection_kind>
        <data_protection_kind>NONE</data_protection_kind>
      </topic_rule>
      <topic_rule>"""


def lenient_identities(folder: Path) -> list[Properties]:
    """Strangers are let in to the topic Open; all other topics are protected in every way but whole messages."""
    draft = GovernanceDraft(allow_unauthenticated=True, rtps="NONE")
    create_keystore(
        folder, ("alice", "bob"), terms=IdentityTerms(Validity.of_days(START_NS)), governance=draft, rights=Rights()
    )
    certificate, key = folder / "public/permissions_ca.cert.pem", folder / "private/permissions_ca.key.pem"
    authority = Authority.parse(certificate.read_bytes(), key.read_bytes(), where="the test's")
    xml = draft.xml().replace(b"<topic_rule>", OPEN_TOPIC, 1)
    signed = sign_document(xml, authority.certificate, authority.private_key)
    (folder / "enclaves/governance.p7s").write_bytes(signed)
    properties = [secure(folder / "enclaves" / name).properties for name in ("alice", "bob")]
    return [found for found in properties if found is not None]


def test_a_stranger_is_refused_and_the_reason_is_told(tmp_path: Path) -> None:
    domain = Domain(1)
    alice = domain.node(properties=make_identities(tmp_path, "encrypt")[0])
    stranger = domain.node()
    writer, reader = stranger.writer("Square", RELIABLE), alice.reader("Square", RELIABLE)
    writer.write()
    domain.run(5.0)
    assert not reader.taken
    refusals = [status for _, _, status in alice.statuses if isinstance(status, SecurityRefused)]
    assert len(refusals) == 1
    assert refusals[0].remote == stranger.guid
    assert "announces no identity" in refusals[0].reason


def test_where_strangers_are_let_in_they_meet_only_what_nothing_protects(tmp_path: Path) -> None:
    domain = Domain(1)
    alice, bob = (domain.node(properties=properties) for properties in lenient_identities(tmp_path))
    stranger = domain.node()
    for topic in ("Open", "Closed"):
        for node in (alice, bob, stranger):
            node.writer(topic, RELIABLE).write()
        for node in (alice, bob, stranger):
            node.reader(topic, RELIABLE)
    domain.run(10.0)
    heard = {
        (node.name, reader.topic): len({change.writer_guid.prefix for _, change in reader.taken})
        for node in (alice, bob, stranger)
        for reader in node.readers
    }
    assert heard == {
        ("a", "Open"): 3, ("b", "Open"): 3, ("c", "Open"): 3,
        ("a", "Closed"): 2, ("b", "Closed"): 2, ("c", "Closed"): 1,
    }  # fmt: skip
