"""``ddsi doctor``: what it finds on this host's loopback, and what it says where something is wrong."""

from __future__ import annotations

import json
import re
import socket
import subprocess
import sys
from pathlib import Path

import pytest
import trio

import ddsi
from ddsi.cli import doctor, doctor_host, doctor_peers, main
from ddsi.cli.doctor import Finding, Verdict, examine
from ddsi.cli.doctor_peers import peer_findings
from ddsi.config import Config
from ddsi.config.environment import load_config
from ddsi.transport import host_facts
from ddsi.transport.host_facts import PortHolder, port_holders, probe_port, reassembly_counts, source_towards
from ddsi.transport.platform import Interface
from ddsi.transport.self_test import multicast_returns, unicast_returns

URI = (
    "<DDSI><Domain><General><Interfaces><NetworkInterface address='127.0.0.1'/></Interfaces>{}"
    "</General></Domain></DDSI>"
)
LOOPBACK = Interface("lo", "127.0.0.1", "255.0.0.0", 65536, is_loopback=True)
NOWHERE = Interface("gone0", "198.51.100.77", "255.255.255.0", 1500, is_loopback=False)


def _findings(domain: int = 173) -> dict[str, Finding]:
    """By subject; of several the last."""
    return {finding.subject: finding for finding in examine(domain)}


@pytest.fixture(autouse=True)
def _loopback(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("DDSI_URI", URI.format(""))


def test_a_sound_host() -> None:
    found = _findings()
    assert list(found) == [
        "versions", "configuration", "interface", "sockets", "reach", "unicast", "multicast", "buffers",
        "ports", "filter", "fragments", "ipv6", "clock",
    ]  # fmt: skip
    assert found["versions"].text.startswith("Python 3.")
    assert "interfaces=('127.0.0.1',)" in found["configuration"].text
    assert "participant index 0" in found["sockets"].text
    assert found["unicast"] == Finding("unicast", Verdict.OK, "a datagram to 127.0.0.1 arrives")
    assert not any(finding.verdict is Verdict.FAULT for finding in found.values())


def test_a_configuration_that_is_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    """It is the last finding: nothing else can be said."""
    monkeypatch.setenv("DDSI_URI", "<DDSI><Domain><Generel/></Domain></DDSI>")
    *_, last = examine(0)
    assert last.verdict is Verdict.FAULT
    assert "did you mean <General>" in last.text


def test_an_interface_that_is_not_there(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("DDSI_URI", URI.format("").replace("127.0.0.1", "198.51.100.77"))
    *_, last = examine(0)
    assert (last.subject, last.verdict) == ("sockets", Verdict.FAULT)
    assert "there is no interface '198.51.100.77'" in last.text


def test_settings_that_mean_nothing_here(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("DDSI_URI", URI.format("<RedundantNetworking>true</RedundantNetworking>"))
    warnings = [finding for finding in examine(173) if finding.verdict is Verdict.WARNING]
    assert any("RedundantNetworking" in finding.text for finding in warnings)


def test_cyclones_variable_is_not_ours(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("CYCLONEDDS_URI", "file:///etc/cyclone.xml")
    assert "CYCLONEDDS_URI is set" not in str(list(doctor._configuration(load_config(0))))
    monkeypatch.delenv("DDSI_URI")
    findings = list(doctor._configuration(Config()))
    assert [finding.verdict for finding in findings] == [Verdict.OK, Verdict.WARNING]
    assert "DDSI_URI=$CYCLONEDDS_URI" in findings[1].advice


def test_all_well_known_ports_taken(monkeypatch: pytest.MonkeyPatch) -> None:
    """Domain 99 has its first port, 7400 + 250 * 99 + 10, taken by somebody, and only that one is tried."""
    limit = "</General><Discovery><MaxAutoParticipantIndex>0</MaxAutoParticipantIndex></Discovery><General>"
    monkeypatch.setenv("DDSI_URI", URI.format(limit))
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as taken:
        taken.bind(("127.0.0.1", 32_160))
        finding = _findings(99)["sockets"]
    assert finding.verdict is Verdict.WARNING
    assert "all well-known ports" in finding.text
    assert "MaxAutoParticipantIndex" in finding.advice


def test_what_is_sent_must_arrive(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(doctor, "unicast_returns", lambda interface: False)
    monkeypatch.setattr(doctor, "multicast_returns", lambda interface, group: False)
    found = _findings()
    assert found["unicast"].verdict is Verdict.FAULT
    assert "packet filter" in found["unicast"].advice
    assert found["multicast"].verdict is Verdict.WARNING, "on loopback others are found by unicast"


def test_multicast_that_does_not_work_is_a_fault_where_nobody_else_would_be_found(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    class Transport:
        uses_multicast = True

    monkeypatch.setattr(doctor, "unicast_returns", lambda interface: True)
    monkeypatch.setattr(doctor, "multicast_returns", lambda interface, group: False)

    def verdicts(config: Config) -> list[Verdict]:
        findings = doctor._datagrams(NOWHERE, config, Transport())  # type: ignore[arg-type]
        return [finding.verdict for finding in findings]

    assert verdicts(Config()) == [Verdict.OK, Verdict.FAULT]
    assert verdicts(Config(peers=("198.51.100.1",))) == [Verdict.OK, Verdict.WARNING]


@pytest.mark.parametrize(("limit", "verdict"), [(None, "ok"), (212_992, "warning"), (4 << 20, "ok")])
def test_the_kernels_limit(limit: int | None, verdict: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(doctor, "kernel_receive_limit", lambda: limit)
    finding = _findings()["buffers"]
    assert finding.verdict == verdict
    assert ("sysctl -w net.core.rmem_max=4194304" in finding.advice) == (verdict == "warning")


def test_self_tests_are_not_fooled() -> None:
    """They say no, and do not raise, where the interface does not exist."""
    assert unicast_returns(LOOPBACK)
    assert not unicast_returns(NOWHERE)
    assert not multicast_returns(NOWHERE, "239.255.0.1")


def test_json_and_status(capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch) -> None:
    assert main(["doctor", "-d", "173", "--json"]) == 0
    form = json.loads(capsys.readouterr().out)
    assert (form["domain_id"], form["faults"]) == (173, 0)
    assert form["findings"][1] == {
        "subject": "configuration",
        "verdict": "ok",
        "text": "DDSI_URI is understood: Config(interfaces=('127.0.0.1',))",
        "advice": "",
    }
    monkeypatch.setenv("DDSI_URI", "<nonsense")
    assert main(["doctor"]) == 1
    assert capsys.readouterr().out.endswith("1 fault, 0 warnings.\n")


# --- the host --------------------------------------------------------------------------------------------------


def test_who_holds_a_port_is_another_process_by_name() -> None:
    """Our own sockets are not somebody else's."""
    program = "import socket, sys; s = socket.socket(socket.AF_INET, socket.SOCK_DGRAM); s.bind(('127.0.0.1', 0)); "
    program += "print(s.getsockname()[1], flush=True); sys.stdin.read()"
    command = [sys.executable, "-c", program]
    with subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True) as other:
        assert other.stdout is not None
        port = int(other.stdout.readline())
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as own:
            own.bind(("127.0.0.1", 0))
            (holder,) = port_holders([port, own.getsockname()[1]])
        other.communicate()
    assert (holder.port, holder.address) == (port, "127.0.0.1")
    assert holder.process.endswith(f"({other.pid})")


@pytest.mark.parametrize(("count", "verdict"), [(0, "ok"), (3, "ok"), (9, "warning")])
def test_participant_indices_that_are_taken(count: int, verdict: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """Ten indices, one of which doctor itself would get."""
    held = [PortHolder(7400 + 250 * 173 + 10 + 2 * index, "127.0.0.1", "talker (17)") for index in range(count)]
    monkeypatch.setattr(doctor_host, "port_holders", lambda ports: held)
    finding = _findings()["ports"]
    assert finding.verdict == verdict
    assert ("0 (port 50660) by talker (17)" in finding.text) == bool(count)
    assert ("MaxAutoParticipantIndex" in finding.advice) == (verdict == "warning")


def test_signs_of_a_packet_filter_come_with_advice(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(doctor_host, "packet_filter_signs", lambda: ["iptables filter"])
    assert "nft list ruleset" in _findings()["filter"].advice
    monkeypatch.setattr(doctor_host, "packet_filter_signs", list)
    assert _findings()["filter"].advice == ""


def test_fragments_that_find_no_room(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(doctor_host, "reassembly_counts", lambda: None)
    monkeypatch.setattr(doctor_host, "fragment_memory", lambda: 262_144)
    narrow = doctor_host._fragments(65_000, [NOWHERE])
    assert narrow.verdict is Verdict.WARNING
    assert "ipfrag_high_thresh=4194304" in narrow.advice
    assert doctor_host._fragments(1400, [NOWHERE]).text == "messages of up to 1400 octets go unfragmented"


@pytest.mark.parametrize(("came", "lost", "verdict"), [(0, 0, "ok"), (100_000, 30, "ok"), (15_033, 11_616, "warning")])
def test_fragments_of_others_that_were_in_vain(
    came: int, lost: int, verdict: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Our own messages fit a frame here; a peer's did not."""
    monkeypatch.setattr(doctor_host, "reassembly_counts", lambda: (came, lost))
    finding = doctor_host._fragments(1400, [NOWHERE])
    assert finding.verdict == verdict
    assert ("15033 IP fragments came to this host, and 11616 times" in finding.text) == (verdict == "warning")
    assert ("ipfrag_time" in finding.advice) == (verdict == "warning")


def test_the_host_counts_fragments(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(host_facts, "_PROC", tmp_path)
    assert reassembly_counts() is None, "another system has no such file"
    (tmp_path / "net").mkdir()
    (tmp_path / "net/snmp").write_text("Ip: Forwarding ReasmReqds ReasmOKs ReasmFails\nIp: 2 404 130 7\nIcmp: InMsgs\n")
    assert reassembly_counts() == (404, 7)
    (tmp_path / "net/snmp").write_text("Ip: Forwarding\nIp: 2\n")
    assert reassembly_counts() is None


@pytest.mark.parametrize(("answer", "verdict"), [(None, "ok"), (True, "ok"), (False, "warning")])
def test_the_clock(answer: bool | None, verdict: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(doctor_host, "is_clock_synchronized", lambda: answer)
    assert _findings()["clock"].verdict == verdict


# --- peers -----------------------------------------------------------------------------------------------------


def _peer(host: str, domain: int = 171) -> Finding:
    """What is found of that host, with a participant in domain 172 on the loopback."""

    async def ask() -> Finding:
        config = ddsi.Config(interfaces=("127.0.0.1",))
        async with ddsi.DomainParticipant(172, config=config):
            findings = [one async for one in peer_findings(domain, config, (LOOPBACK,), [host], 0.5)]
        (finding,) = findings
        return finding

    return trio.run(ask)


def test_a_peer_that_answers() -> None:
    finding = _peer("127.0.0.1", domain=172)
    assert finding.verdict is Verdict.OK
    assert re.fullmatch(r"127.0.0.1: \d+ participants? of domain 172 answered", finding.text)


def test_a_peer_on_which_nobody_listens() -> None:
    finding = _peer("127.0.0.1")
    assert finding.verdict is Verdict.FAULT
    assert "the host answers, but nobody listens on port 50160" in finding.text


def test_nothing_is_sent_on_an_interface_that_is_not_chosen(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(doctor_peers, "source_towards", lambda address: "192.0.2.2")
    monkeypatch.setattr(doctor_peers, "_of_host", None)  # who would send
    finding = _peer("198.51.100.77")
    assert finding.verdict is Verdict.FAULT
    assert "would leave from 192.0.2.2; the configuration chooses lo alone" in finding.text


def test_a_name_that_nobody_knows(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(doctor_peers, "resolve", lambda host: None)
    assert "no IPv4 address of that name" in _peer("robot.example").text


def test_a_port_on_which_nobody_listens_is_refused_by_the_host() -> None:
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as taken:
        taken.bind(("127.0.0.1", 0))
        port = taken.getsockname()[1]
        assert probe_port("127.0.0.1", "127.0.0.1", port) is None
    assert probe_port("127.0.0.1", "127.0.0.1", port) is False
    assert source_towards("127.0.0.1") == "127.0.0.1"
