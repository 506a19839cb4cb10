"""``ddsi why`` over real peers: each cause with what is offered, what is requested and the remedy.

The observer is neither the writer nor the reader: it judges two participants of other implementations from what they
announce, and where both tell what their types are made of, by asking them.
"""

from __future__ import annotations

import json
import sys
from collections.abc import Awaitable, Callable
from dataclasses import dataclass
from typing import Any

import pytest

from .framework import Namespace, Process, Scenario, async_test, namespace, namespace_pair, scenario
from .peers.catalogue import CYCLONE_C, CYCLONE_PYTHON, FAST_DDS
from .peers.keystore import shared_keystore
from .peers.options import Options
from .peers.peer import ROOT, Peer, Role, network_environment

DOMAIN = 1
POLICIES = "multiproc_tests.peers.programs.cyclonedds_policies"
STEP_S = 40.0
OFTEN = "<SPDPInterval>500 ms</SPDPInterval>"
"""Whom nobody answers is heard only when it announces itself again, every 30 s by default."""

Start = Callable[[Scenario, Namespace, Role], Awaitable[Process]]


def shapes(peer: Peer, **options: Any) -> Start:
    """The shapes program of that implementation."""

    async def start(stage: Scenario, host: Namespace, role: Role) -> Process:
        return await peer.start(stage, role, Options(domain=DOMAIN, wait_s=60, **options), host=host)

    return start


def policies(*words: str, topic: str = "Square") -> Start:
    """``cyclonedds_policies`` with these policies, else with the defaults of DDS."""

    async def start(stage: Scenario, host: Namespace, role: Role) -> Process:
        CYCLONE_PYTHON.locate()
        command = [sys.executable, "-m", POLICIES, role, str(DOMAIN), topic, *words]
        environment = network_environment(host.interface)
        return await stage.start(f"{role} cyclone11", command, namespace=host, environment=environment, folder=ROOT)

    return start


async def why(stage: Scenario, host: Namespace, *words: str) -> tuple[dict[str, Any], str]:
    """What ``ddsi why`` says to programs and to people; it ends with 1, as something does not match."""
    outputs = []
    for form in ("--json",), ():
        command = [sys.executable, "-m", "ddsi.cli", "why", "-d", str(DOMAIN), *words, *form]
        environment = network_environment(host.interface)
        process = await stage.start("why", command, namespace=host, environment=environment)
        await process.expect_exit(1, timeout=STEP_S)
        outputs.append("\n".join(line.text for line in process.lines if line.stream == "out"))
    return json.loads(outputs[0]), outputs[1]


@dataclass(frozen=True, slots=True)
class Case:
    """Who writes, who reads, and the cause that is to be named; ``remedy`` is a part of it."""

    policy: str
    writer: Start
    reader: Start
    offered: str
    requested: str
    remedy: str
    detail: str = ""


CASES = {
    "reliability": Case(
        "reliability", shapes(FAST_DDS, best_effort=True), shapes(CYCLONE_C), "BestEffort", "Reliable",
        "make the writer Reliable()",
    ),
    "durability": Case(
        "durability", shapes(CYCLONE_C, volatile=True), shapes(FAST_DDS), "Volatile", "TransientLocal",
        "let the writer keep its samples with TransientLocal()",
    ),
    "partition": Case(
        "partition", shapes(FAST_DDS, partitions=("blue",)), shapes(CYCLONE_C, partitions=("red", "green")),
        "'blue'", "'red', 'green'", "one partition name in common",
    ),
    "default partition": Case(
        "partition", shapes(CYCLONE_C), policies("partition"), "none (the default partition)", "'red'",
        "put the writer into Partition('red') too",
    ),
    "keyed and keyless": Case(
        "key", shapes(FAST_DDS, keyless=True), shapes(CYCLONE_C), "without key", "with key", "declare the same @key",
    ),
    "type name": Case(
        "type", policies("other"), shapes(FAST_DDS), "Other", "ShapeType", "give both the same type name",
    ),
    "member of a type": Case(
        "type", policies("plain"), policies("changed"), "Drawing", "Drawing", "use one definition on both sides", "x: ",
    ),
    "data representation": Case(
        "data_representation", shapes(CYCLONE_C, representation=2, appendable=True), shapes(FAST_DDS, appendable=True),
        "XCDR2", "XCDR1", "let the writer use DataRepresentation(XCDR1)",
    ),
    "topic in another case": Case(
        "topic", shapes(CYCLONE_C), shapes(FAST_DDS, topic="square"), "'Square'", "'square'", "upper and lower case",
    ),
    "topic with a prefix": Case(
        "topic", shapes(FAST_DDS, topic="rt/Square"), shapes(CYCLONE_C), "'rt/Square'", "'Square'", "ROS 2",
    ),
    "deadline": Case(
        "deadline", shapes(CYCLONE_C), policies("deadline"), "Deadline(period=inf)", "Deadline(period=1.0)",
        "let the writer promise Deadline(1)",
    ),
    "latency budget": Case(
        "latency_budget", policies("budget"), shapes(FAST_DDS), "LatencyBudget(duration=1.0)",
        "LatencyBudget(duration=0.0)", "let the writer offer LatencyBudget(0)",
    ),
    "ownership": Case(
        "ownership", shapes(FAST_DDS), policies("exclusive"), "Shared", "Exclusive", "Shared() or Exclusive()",
    ),
    "liveliness": Case(
        "liveliness", shapes(CYCLONE_C), policies("manual"), "Automatic(lease_duration=inf)",
        "ManualByTopic(lease_duration=5.0)", "assert itself at least as ManualByTopic",
    ),
    "destination order": Case(
        "destination_order", shapes(FAST_DDS), policies("by-source"), "ByReceptionTimestamp", "BySourceTimestamp",
        "BySourceTimestamp()",
    ),
    "presentation": Case(
        "presentation", shapes(CYCLONE_C), policies("coherent"), "access_scope=<AccessScope.INSTANCE", "TOPIC",
        "set the publisher's access scope",
    ),
}  # fmt: skip


@pytest.mark.peers
@pytest.mark.parametrize("name", CASES)
@async_test
async def test_the_cause_is_named_with_both_values_and_a_remedy(name: str) -> None:
    case = CASES[name]
    with namespace() as host:
        async with scenario(f"why: {name}", deadline=120) as stage:
            await case.writer(stage, host, "pub")
            await case.reader(stage, host, "sub")
            form, text = await why(stage, host)
    (mismatch,) = form["mismatches"]
    (cause,) = (one for one in mismatch["disagreements"] if one["policy"] == case.policy)
    assert case.offered in cause["offered"]
    assert case.requested in cause["requested"]
    assert case.remedy in cause["remedy"]
    assert cause["detail"].startswith(case.detail)
    assert f"  {case.policy}: offered {cause['offered']}, requested {cause['requested']}" in text
    assert f"    remedy: {cause['remedy']}" in text
    assert form["complete"]


@pytest.mark.peers
@async_test
async def test_every_cause_is_named_at_once() -> None:
    """One look at Fast DDS's writer and Cyclone DDS's reader tells all that has to be changed."""
    writer = shapes(FAST_DDS, best_effort=True, volatile=True, keyless=True, partitions=("blue",))
    reader = shapes(CYCLONE_C, topic="square")
    with namespace() as host:
        async with scenario("why: everything", deadline=120) as stage:
            await writer(stage, host, "pub")
            await reader(stage, host, "sub")
            form, _ = await why(stage, host, "Square")
    (mismatch,) = form["mismatches"]
    causes = [one["policy"] for one in mismatch["disagreements"]]
    assert causes == ["topic", "key", "type", "partition", "reliability", "durability"]


# --- participants that cannot be known -------------------------------------------------------------------------------


async def cyclone_with(stage: Scenario, host: Namespace, *, general: str = "", discovery: str = "") -> None:
    """A writer whose configuration has this too."""
    CYCLONE_PYTHON.locate()
    environment = network_environment(host.interface)
    uri = environment["CYCLONEDDS_URI"].replace("</General>", f"{general}</General>")
    environment["CYCLONEDDS_URI"] = uri.replace("</Discovery>", f"{discovery}</Discovery>")
    command = [sys.executable, "-m", POLICIES, "pub", str(DOMAIN), "Square"]
    process = await stage.start("pub cyclone11", command, namespace=host, environment=environment, folder=ROOT)
    await process.expect("HOLDING .*", timeout=STEP_S)


@pytest.mark.peers
@async_test
async def test_an_address_that_nobody_was_heard_from_is_unreachable() -> None:
    """As behind NAT, or with a wrong external address: nothing is sent there, so nothing is known of its endpoints."""
    with namespace_pair() as (here, there):
        async with scenario("why: unreachable", deadline=120) as stage:
            external = "<ExternalNetworkAddress>198.51.100.7</ExternalNetworkAddress>"
            await cyclone_with(stage, there, general=external, discovery=OFTEN)
            form, text = await why(stage, here, "Square")
    (trouble,) = form["troubles"]
    assert trouble["kind"] == "unreachable"
    assert "198.51.100.7" in trouble["offered"]
    assert trouble["requested"] == f"heard from {there.address}"
    assert "ExternalNetworkAddress" in trouble["remedy"]
    assert "unreachable: it announces udpv4/198.51.100.7" in text


@pytest.mark.peers
@async_test
async def test_another_domain_tag_is_not_discovered() -> None:
    with namespace() as host:
        async with scenario("why: domain tag", deadline=120) as stage:
            await cyclone_with(stage, host, discovery=f"<Tag>blue</Tag>{OFTEN}")
            form, text = await why(stage, host, "Square")
    (trouble,) = form["troubles"]
    assert (trouble["kind"], trouble["offered"]) == ("dropped", "another domain tag")
    assert "one domain tag" in trouble["remedy"]
    assert "Nobody was seen with a writer or reader of Square" in text


@pytest.mark.peers
@async_test
async def test_a_participant_that_wants_an_identity() -> None:
    """Cyclone DDS, secured: who has no identity learns nothing of its endpoints, and is told what is missing."""
    with namespace() as host:
        async with scenario("why: security", deadline=120) as stage:
            start = shapes(CYCLONE_C, keystore=str(shared_keystore().folder), governance="encrypt-all.p7s")
            await start(stage, host, "pub")
            form, text = await why(stage, host, "Square", "--time", "6")  # it has documents to verify first
    (trouble,) = form["troubles"]
    assert (trouble["kind"], trouble["offered"]) == ("security", "an identity")
    assert "this one has none" in trouble["requested"]
    assert "ddsi why --secure DIR" in trouble["remedy"]
    assert "security: it announces an identity" in text


@pytest.mark.peers
@async_test
async def test_governance_that_differs_is_named_to_who_may_look() -> None:
    """Cyclone DDS's writer protects payloads alone, its reader submessages: an observer with rights sees both."""
    store = shared_keystore().folder
    files = {
        "auth.identity_ca": "identity_ca.pem",
        "auth.identity_certificate": "bob.pem",
        "auth.private_key": "bob.key",
        "access.permissions_ca": "permissions_ca.pem",
        "access.governance": "data.p7s",
        "access.permissions": "bob.permissions.p7s",
    }
    rights = [word for name, file in files.items() for word in ("--property", f"dds.sec.{name}=file:{store}/{file}")]
    with namespace() as host:
        async with scenario("why: governance", deadline=120) as stage:
            await shapes(CYCLONE_C, keystore=str(store), governance="data.p7s")(stage, host, "pub")
            await shapes(CYCLONE_C, keystore=str(store), governance="metadata.p7s")(stage, host, "sub")
            form, _ = await why(stage, host, "Square", "--time", "8", *rights)
    (mismatch,) = form["mismatches"]
    (cause,) = mismatch["disagreements"]
    assert (mismatch["kind"], cause["policy"]) == ("security", "security")
    assert "payload" in cause["offered"]
    assert "submessage" in cause["requested"]
    assert "one governance document" in cause["remedy"]
