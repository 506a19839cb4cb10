"""What security logs reaches a reader of DDS:Security:LogTopicV2 in another participant, protected as its rule says."""

from __future__ import annotations

from pathlib import Path

from ddsi.simulation import Domain
from ddsi.structure.qos import Qos
from ddsi.structure.qos_policies import KeepAll, Property, Reliable, TransientLocal
from ddsi.xtypes import deserialize
from ddsi_security.builtin_logging_type import LOG_TOPIC_NAME, BuiltinLoggingTypeV2

from .keystores import make_identities
from .watch import Watch

READS_HISTORY = Qos(reliability=Reliable(), durability=TransientLocal(), history=KeepAll())


def test_events_are_published_and_only_those_who_have_keys_read_them(tmp_path: Path) -> None:
    watch = Watch()
    domain = Domain(1, trace=watch)
    alice, bob, carol = make_identities(tmp_path, "encrypt")
    telling = {"dds.sec.log.distribute": Property("true"), "dds.sec.log.log_level": Property("INFORMATIONAL")}
    domain.node(properties={**alice, **telling})
    second = domain.node(properties=bob)
    reader = second.reader(LOG_TOPIC_NAME, READS_HISTORY, type_name="DDSSecurity::BuiltinLoggingTypeV2")
    domain.run_until(domain.are_introduced, 5.0)
    third = domain.node(properties=carol)
    assert domain.run_until(lambda: len(reader.taken) >= 2, 10.0)
    events = [deserialize(BuiltinLoggingTypeV2, bytes(change.payload)) for _, change in reader.taken]
    assert [event.msgid for event in events] == ["authenticated", "authenticated"]
    for event, peer, name in zip(events, (second, third), ("bob", "carol"), strict=True):
        assert f"{peer.guid} is CN={name}, authenticated" in event.message
        (entry,) = event.structured_data
        assert {"domain_id", "guid"} <= {pair.name for pair in entry.pairs}
    assert not watch.holds(b"CN=carol, authenticated")


def test_nothing_is_published_unless_it_is_asked_for(tmp_path: Path) -> None:
    domain = Domain(1)
    nodes = [domain.node(properties=properties) for properties in make_identities(tmp_path, "encrypt")]
    assert domain.run_until(domain.are_introduced, 5.0)
    domain.run(2.0)
    assert not any(node.engine.user_writers(LOG_TOPIC_NAME) for node in nodes)
