"""DDSI_URI: from XML, in Cyclone DDS's words, to a Config."""

from __future__ import annotations

import dataclasses
import math
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from ddsi.config import Config, load_config
from ddsi.config.meanings import FIELDS, REFUSED
from ddsi.config.vocabulary import DOMAIN, Word
from ddsi.structure.errors import ConfigurationError

FULL = """<?xml version="1.0" encoding="UTF-8"?>
<CycloneDDS xmlns="https://cdds.io/config" xmlns:xsi="http://www.w3.org/2001/XMLSchema-instance"
            xsi:schemaLocation="https://cdds.io/config https://example.org/cyclonedds.xsd">
  <Domain Id="any">
    <General>
      <Interfaces>
        <NetworkInterface name="eth0" multicast="true"/>
        <NetworkInterface address="10.0.0.5" allow_multicast="spdp,asm"/>
      </Interfaces>
      <AllowMulticast>default</AllowMulticast>
      <MaxMessageSize>65500B</MaxMessageSize>
      <FragmentSize>4000 B</FragmentSize>
      <MulticastTimeToLive>32</MulticastTimeToLive>
      <Transport>udp</Transport>
    </General>
    <Discovery>
      <Tag>${TAG:-lab}</Tag>
      <LeaseDuration>30 s</LeaseDuration>
      <SPDPInterval>2500 ms</SPDPInterval>
      <SPDPMulticastAddress>239.255.0.7</SPDPMulticastAddress>
      <ParticipantIndex>5</ParticipantIndex>
      <MaxAutoParticipantIndex>30</MaxAutoParticipantIndex>
      <Peers AddLocalhost="true">
        <Peer Address="10.0.0.6"/>
        <Peer Address="udp/10.0.0.7:7410"/>
        <Peer Address="10.0.0.6"/>
      </Peers>
      <Ports><Base>7500</Base><UnicastDataOffset>13</UnicastDataOffset></Ports>
    </Discovery>
    <Bounds>
      <MaxParticipants>50</MaxParticipants>
      <MaxSampleSize>1 MiB</MaxSampleSize>
      <UnacknowledgedOctets>1 MiB</UnacknowledgedOctets>
    </Bounds>
    <Internal>
      <SocketReceiveBufferSize min="1MB" max="10MB"/>
      <MinimumSocketSendBufferSize>64KiB</MinimumSocketSendBufferSize>
    </Internal>
    <Tracing>
      <Verbosity>fine</Verbosity>
      <OutputFile>trace.${CYCLONEDDS_PID}.jsonl</OutputFile>
      <AppendToFile>true</AppendToFile>
      <PacketCaptureFile>out.pcapng</PacketCaptureFile>
    </Tracing>
  </Domain>
</CycloneDDS>
"""


def test_all_that_can_be_said() -> None:
    config = Config.from_uri(FULL, environ={"CYCLONEDDS_PID": "7"})
    ports = config.ports
    assert (ports.base, ports.unicast_user_offset, ports.domain_gain) == (7500, 13, 250)
    assert config == Config(
        interfaces=("eth0", "10.0.0.5"),
        multicast=True,
        max_message_size=65500,
        fragment_size=4000,
        multicast_ttl=32,
        domain_tag="lab",
        lease_duration=30.0,
        spdp_interval=2.5,
        multicast_address="239.255.0.7",
        participant_index=5,
        max_auto_participant_index=30,
        peers=("127.0.0.1", "10.0.0.6", "10.0.0.7:7410"),
        ports=ports,
        max_participants=50,
        max_sample_size=1 << 20,
        unacknowledged_octets=1 << 20,
        receive_buffer_size=10 << 20,
        send_buffer_size=64 << 10,
        trace_level="fine",
        trace_file="trace.7.jsonl",
        trace_append=True,
        pcap_file="out.pcapng",
    )
    assert config.config_warnings == ()


def test_every_field_has_its_element() -> None:
    """A setting of Config that files cannot hold would be found out only by those who need it."""
    by_element = {name.partition(".")[0] for name, _ in FIELDS.values()}
    by_several = {"interfaces", "multicast", "peers", "trace_level", "security"}
    of_tests_only = {"vendor_id", "config_warnings"}
    assert {item.name for item in dataclasses.fields(Config)} == by_element | by_several | of_tests_only


def test_every_element_with_a_meaning_is_in_the_vocabulary() -> None:
    for path in [*FIELDS, *REFUSED]:
        word: Word | None = DOMAIN
        element, _, attribute = path.partition("@")
        for name in element.split("/"):
            word = word.child(name) if word is not None else None
        assert word is not None, path
        assert word.path == element
        assert not attribute or attribute in word.attributes.values()


class TestWhereItStands:
    """``DDSI_URI`` holds ``file:`` and a path, a path, XML, or several of them."""

    @pytest.fixture
    def file(self, tmp_path: Path) -> Path:
        path = tmp_path / "ddsi.xml"
        path.write_text("<DDSI><Domain><Discovery><Tag>from file</Tag></Discovery></Domain></DDSI>", encoding="utf-8")
        return path

    @pytest.mark.parametrize("form", ["file:{}", "file://{}", "{}", " {} ", ",{},"])
    def test_files(self, file: Path, form: str) -> None:
        assert load_config(0, {"DDSI_URI": form.format(file)}).domain_tag == "from file"

    def test_relative_files(self, file: Path, monkeypatch: pytest.MonkeyPatch) -> None:
        monkeypatch.chdir(file.parent)
        assert Config.from_uri("file:ddsi.xml").domain_tag == "from file"

    def test_a_later_source_overrides_an_earlier_one(self, file: Path) -> None:
        xml = "<Domain><Discovery><Tag>from text</Tag><LeaseDuration>5 s</LeaseDuration></Discovery></Domain>"
        assert Config.from_uri(f"{xml},file:{file}") == Config(domain_tag="from file", lease_duration=5.0)
        assert Config.from_uri(f"file:{file} , {xml}").domain_tag == "from text"

    def test_parts_of_a_document_and_short_end_tags(self) -> None:
        """As people write Cyclone's variable on the command line."""
        text = "<General><MaxMessageSize>1400 B</></><Tracing><Verbosity>finest</></>,<DDSI><Discovery><Tag>x</></></>"
        assert Config.from_uri(text) == Config(max_message_size=1400, trace_file="ddsi-trace.jsonl", domain_tag="x")

    def test_not_set_means_the_defaults(self) -> None:
        assert load_config(0, {}) == load_config(0, {"DDSI_URI": " "}) == Config.from_uri("") == Config()

    def test_the_environment_is_read_when_no_other_is_given(self, monkeypatch: pytest.MonkeyPatch) -> None:
        monkeypatch.setenv("DDSI_URI", "<Discovery><Tag>${WHICH}</Tag></Discovery>")
        monkeypatch.setenv("WHICH", "mine")
        assert load_config().domain_tag == "mine"

    @pytest.mark.parametrize(
        ("uri", "reason"),
        [
            ("file:/no/such/file", r"'/no/such/file', which cannot be read \(No such file"),
            ("file:/", "which cannot be read"),
            ("http://example.org/ddsi.xml", "only file: is read, nothing is fetched"),
            ("no\0file", "which cannot be read"),
            ("<DDSI/>," * 101, "more than 100 sources"),
        ],
    )
    def test_refused(self, uri: str, reason: str) -> None:
        with pytest.raises(ConfigurationError, match=reason):
            Config.from_uri(uri)

    def test_a_file_holds_one_document(self, file: Path) -> None:
        file.write_text("<DDSI/>\n<DDSI/>")
        with pytest.raises(ConfigurationError, match=r"ddsi\.xml: more follows the end of <DDSI>"):
            Config.from_uri(f"file:{file}")

    def test_errors_in_a_file_name_it(self, file: Path) -> None:
        file.write_text("<DDSI>\n\n<Domain>\n<Generall/></Domain></DDSI>")
        with pytest.raises(ConfigurationError, match=r"ddsi\.xml, line 4: <Generall> is not known in <Domain>"):
            Config.from_uri(f"file:{file}")


class TestDomains:
    XML = """<DDSI>
      <Domain Id="any"><Discovery><Tag>all</Tag><LeaseDuration>9 s</LeaseDuration></Discovery></Domain>
      <Domain Id="3"><Discovery><Tag>three</Tag></Discovery></Domain>
      <domain><id>${FOUR}</id><discovery><tag>four</tag></discovery></domain>
    </DDSI>"""

    @pytest.mark.parametrize(("domain_id", "tag"), [(0, "all"), (3, "three"), (4, "four")])
    def test_only_those_for_this_domain_count(self, domain_id: int, tag: str) -> None:
        config = Config.from_uri(self.XML, domain_id=domain_id, environ={"FOUR": "4"})
        assert config == Config(domain_tag=tag, lease_duration=9.0)

    def test_the_id_is_checked(self) -> None:
        with pytest.raises(ConfigurationError, match="line 1: <Domain> Id is 'x'; it must be any or a whole number"):
            Config.from_uri('<Domain Id="x"/>')

    def test_names_are_checked_in_the_others_too(self) -> None:
        with pytest.raises(ConfigurationError, match="did you mean <General>"):
            Config.from_uri('<Domain Id="7"><Genral/></Domain>', domain_id=1)

    def test_values_of_others_do_not_matter(self) -> None:
        xml = '<Domain Id="7"><Security/><General><MaxMessageSize>?</MaxMessageSize></General></Domain>'
        assert Config.from_uri(xml, domain_id=1) == Config()


class TestMisspelt:
    @pytest.mark.parametrize(
        ("xml", "message"),
        [
            ("<DDSI>\n<Domain>\n<Genral/>", "line 3: <Genral> is not known in <Domain>: did you mean <General>?"),
            (
                "<General><MaxMesageSize>1 B",
                "<MaxMesageSize> is not known in <General>: did you mean <MaxMessageSize>?",
            ),
            ("<General><NetworkInterface/>", "<NetworkInterface> belongs into <General/Interfaces>"),
            ("<General><Discovery/>", "<Discovery> belongs into <Domain>"),
            (
                "<Security><Authentication><IdentityCertificat/>",
                "<IdentityCertificat> is not known in <Security/Authentication>: did you mean <IdentityCertificate>?",
            ),
            ("<Security><Authentication><Governance/>", "<Governance> belongs into <Security/AccessControl>"),
            (
                "<Tracing><X>",
                "here may stand <Category>, <Verbosity>, <OutputFile>, <AppendToFile>, <PacketCaptureFile>",
            ),
            ("<Discovery><Tag><X/>", "<X> is not known in <Discovery/Tag>: nothing may stand here"),
            (
                '<Discovery><Peers><Peer Adress="x"/>',
                "<Discovery/Peers/Peer> has no attribute 'Adress': did you mean Address?",
            ),
            ('<Discovery Tag="x"/>', "<Discovery> has no attribute 'Tag': it is an element: <Tag>"),
            ('<Discovery><Tag value="x"/>', "<Discovery/Tag> has no attribute 'value': it has none"),
            ('<Discovery><Peers X="x"/>', "has no attribute 'X': there may be AddLocalhost"),
            ("<Discovery>lab", "<Discovery> holds elements, not 'lab'"),
            ("<DDSI>lab", "<DDSI> holds elements, not 'lab'"),
            ('<DDSI Id="1">', "<DDSI> has no attribute 'Id'"),
            ("<Configuration/>", "<Configuration> is no root of a configuration; it must be <DDSI> or <CycloneDDS>"),
            (f"<General><{'x' * 100_000}/>", "here may stand"),
        ],
    )
    def test_is_refused_with_the_line_and_the_nearest_name(self, xml: str, message: str) -> None:
        with pytest.raises(ConfigurationError) as refusal:
            Config.from_uri(_closed(xml))
        assert message in str(refusal.value)
        assert str(refusal.value).startswith("DDSI_URI, line ")

    def test_case_does_not_matter(self) -> None:
        assert Config.from_uri(
            "<cyclonedds><DOMAIN iD='any'><discovery><TAG>x</TAG></discovery></DOMAIN></cyclonedds>"
        ) == (Config(domain_tag="x"))


class TestValues:
    @pytest.mark.parametrize(
        ("xml", "message"),
        [
            ("<General><MaxMessageSize>big", "<General/MaxMessageSize> is 'big'; it must be an amount of memory"),
            (
                "<General>\n<MaxMessageSize>10 B",
                "line 2: <General/MaxMessageSize> is 10; it must be a whole number from 512",
            ),
            ("<Discovery><LeaseDuration>10", "<Discovery/LeaseDuration> is '10'; it must be a duration with its unit"),
            ("<Discovery><ParticipantIndex>any", "must be auto, none, default or a whole number"),
            ("<Discovery><ParticipantIndex>120", "must be 'auto', 'none' or a whole number from 0 to 119"),
            ("<Discovery><Ports><Base>0", "<Discovery/Ports/Base> is 0; it must be at least 1"),
            ("<Discovery><Peers><Peer Address='h:0'/>", "<Discovery/Peers/Peer> is 'h:0'; it must be a host"),
            ("<Discovery><Peers><Peer/>", "<Discovery/Peers/Peer> needs an Address"),
            ("<Discovery><Tag>${X:?say which}", "<Discovery/Tag>: the environment variable X is not set: say which"),
            (
                "<Internal><SocketSendBufferSize min='x'/>",
                "<Internal/SocketSendBufferSize> min is 'x'; it must be an amount",
            ),
            ("<Tracing><Verbosity>loud", "<Tracing/Verbosity> is 'loud'; it must be one of none, severe"),
            ("<General><AllowMulticast>maybe", "<General/AllowMulticast> is 'maybe'; it must be true, false"),
            ("<General><AllowMulticast>false,spdp", "it must be true, false, default, or some of spdp, asm, ssm"),
            ("<General><Interfaces><NetworkInterface/>", "needs a name, an address, or autodetermine"),
            (
                "<General><Interfaces><NetworkInterface name='lo' autodetermine='true'/>",
                "with autodetermine there must be neither name nor address",
            ),
            (
                (
                    "<General><Interfaces><NetworkInterface name='a' multicast='true'/>"
                    "<NetworkInterface name='b' multicast='false'/>"
                ),
                "interfaces with and without multicast cannot be mixed",
            ),
        ],
    )
    def test_refused_with_element_line_value_and_remedy(self, xml: str, message: str) -> None:
        with pytest.raises(ConfigurationError) as refusal:
            Config.from_uri(_closed(xml))
        assert message in str(refusal.value)
        assert str(refusal.value).startswith("DDSI_URI, line ")

    @pytest.mark.parametrize(
        ("xml", "message"),
        [
            ("<Security/>", "names no certificate, key or document, so nothing would be protected"),
            ("<DDSSecurity><Cryptographic/>", "names no certificate, key or document"),
            ("<Security><Authentication><Library path='x'/>", "names no certificate, key or document"),
            ("<SSL><Enable>true", "<SSL/Enable> is 'true': SSL, which protects TCP, is not supported; remove it"),
            ("<TCP><Enable>true", "TCP is not supported"),
            ("<General><Transport>tcp", "only udp is supported"),
            ("<General><UseIPv6>true", "only IPv4 is supported"),
            ("<General><ExternalNetworkAddress>1.2.3.4", "is not supported"),
        ],
    )
    def test_what_would_silently_be_missing_is_refused(self, xml: str, message: str) -> None:
        with pytest.raises(ConfigurationError) as refusal:
            Config.from_uri(_closed(xml))
        assert message in str(refusal.value)

    @pytest.mark.parametrize(
        ("xml", "config"),
        [
            ("<Discovery><LeaseDuration>inf", {"lease_duration": math.inf}),
            ("<Discovery><SPDPInterval>default", {}),
            ("<Discovery><ParticipantIndex>default", {}),
            ("<Discovery><ParticipantIndex>none", {"participant_index": "none"}),
            ("<Discovery><Tag>default", {"domain_tag": "default"}),
            ("<Discovery><AnnounceTypes>true", {"announce_types": True}),
            ("<Discovery><Peers AddLocalhost='false'/>", {}),
            ("<General><NetworkInterfaceAddress>eth0, 10.0.0.1", {"interfaces": ("eth0", "10.0.0.1")}),
            ("<General><NetworkInterfaceAddress>auto", {}),
            ("<General><Interfaces><NetworkInterface autodetermine='true' multicast='default'/>", {}),
            (
                "<General><Interfaces><NetworkInterface name='lo' multicast='true'/>",
                {"interfaces": ("lo",), "multicast": True},
            ),
            (
                "<General><Interfaces><NetworkInterface name='lo' multicast='false'/>",
                {"interfaces": ("lo",), "multicast": False},
            ),
            ("<General><AllowMulticast>false", {"multicast": False}),
            ("<General><AllowMulticast>spdp", {"multicast": True}),
            (
                "<General><AllowMulticast>false</><Interfaces><NetworkInterface name='lo' multicast='true'/>",
                {"interfaces": ("lo",), "multicast": False},
            ),
            ("<Tracing><OutputFile>x", {}),  # the verbosity switches it on
            ("<Tracing><Verbosity>none</Verbosity><OutputFile>x", {}),
            ("<Tracing><Verbosity>info", {"trace_level": "info", "trace_file": "ddsi-trace.jsonl"}),
            ("<Internal><MaxSampleSize>1 GiB", {"max_sample_size": 1 << 30, "max_defrag_octets": 1 << 30}),
            ("<Internal><Watermarks><WhcHigh>500 kB", {"unacknowledged_octets": 512_000}),
            ("<Internal><SocketReceiveBufferSize min='2 MB' max='default'/>", {"receive_buffer_size": 2 << 20}),
            ("<Unsupported><MaxMessageSize>1400 B", {"max_message_size": 1400}),
        ],
    )
    def test_meaning(self, xml: str, config: dict[str, Any]) -> None:
        assert Config.from_uri(_closed(xml)) == Config(**config)


class TestWarnings:
    @pytest.mark.parametrize(
        ("xml", "warning"),
        [
            ("<Internal>\n<NackDelay>10 ms", "DDSI_URI, line 2: <Internal/NackDelay> has no effect in ddsi"),
            ("<Threads><Thread Name='recv'/>", "DDSI_URI, line 1: <Threads> has no effect in ddsi"),
            (
                "<General><Interfaces><NetworkInterface name='lo' priority='2'/>",
                "DDSI_URI, line 1: <General/Interfaces/NetworkInterface> priority has no effect in ddsi",
            ),
            (
                "<Discovery><Peers><Peer Address='x' PruneDelay='1s'/>",
                "DDSI_URI, line 1: <Discovery/Peers/Peer> PruneDelay has no effect in ddsi",
            ),
            (
                "<Tracing><OutputFile>${NAME}.log",
                "DDSI_URI, line 1: <Tracing/OutputFile>: the environment variable NAME is not set and reads as empty",
            ),
            (
                "<General><Interfaces><NetworkInterface name='eth0' address='10.0.0.1'/>",
                (
                    "DDSI_URI, line 1: <General/Interfaces/NetworkInterface>: the address is used; "
                    "that it is the named interface's is not checked"
                ),
            ),
        ],
    )
    def test_what_means_nothing_here_is_told(self, xml: str, warning: str) -> None:
        assert Config.from_uri(_closed(xml)).config_warnings == (warning,)

    def test_each_is_told_once(self) -> None:
        xml = "<Internal><NackDelay>1 s</NackDelay><NackDelay>2 s</NackDelay></Internal>"
        assert len(Config.from_uri(xml).config_warnings) == 1


_NAMES = [
    *("Domain", "General", "Interfaces", "NetworkInterface", "AllowMulticast", "MaxMessageSize", "Discovery", "Tag"),
    *("LeaseDuration", "Peers", "Peer", "Ports", "Base", "Internal", "Bounds", "Tracing", "Verbosity", "x"),
]


@given(
    st.recursive(
        st.text(max_size=8) | st.sampled_from(["10 s", "64 kB", "${X:-1}", "true", "default", "7"]),
        lambda inner: st.tuples(
            st.sampled_from(_NAMES),
            st.sampled_from(["", ' Id="1"', ' name="lo"', ' Address="h"', ' multicast="true"', " y='${'"]),
            st.lists(inner, max_size=3),
        ).map(lambda parts: f"<{parts[0]}{parts[1]}>{''.join(parts[2])}</{parts[0]}>"),
        max_leaves=8,
    )
)
def test_any_tree_gives_a_config_or_a_configuration_error(inside: str) -> None:
    try:
        config = Config.from_uri(f"<DDSI>{inside}</DDSI>")
    except ConfigurationError:
        return
    assert isinstance(config, Config)


def test_xml_is_not_loaded_where_none_is_given() -> None:
    """Most programs set nothing, and should not wait for a parser."""
    code = "import sys, ddsi.config; ddsi.config.load_config(0, {}); print([m for m in sys.modules if 'xml' in m])"
    assert subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout == "[]\n"


def _closed(xml: str) -> str:
    """The text with all its open elements closed, so that the tables above stay short."""
    names: list[str] = []
    position = 0
    while (position := xml.find("<", position)) >= 0:
        end = xml.find(">", position)
        end = len(xml) if end < 0 else end
        tag = xml[position + 1 : end]
        if tag.startswith("/"):
            names.pop()
        elif not tag.endswith("/"):
            names.append(tag.split()[0])
        position = end
    return xml + "".join(f"</{name}>" for name in reversed(names))
