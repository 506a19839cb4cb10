"""QosProvider: profile files of the OMG's schema, and of RTI's and Fast DDS's dialects."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path
from typing import Any

import pytest

import ddsi
from ddsi import QosProvider
from ddsi.config.qos_profile_words import FAST, OMG, Leaf, Members, Skipped, Word
from ddsi.config.qos_profiles import _MAKERS

FILES = Path(__file__).parent / "qos_profiles"
OMG_FILES = (FILES / "omg.xml", FILES / "deep.xml")
DOCUMENT = Path(__file__).parents[2] / "docs" / "qos_profiles.md"


@pytest.fixture(scope="module")
def omg() -> QosProvider:
    return QosProvider(*OMG_FILES)


Written = Callable[[str], QosProvider]


@pytest.fixture
def written(tmp_path: Path) -> Written:
    """A provider of the document given."""

    def provider(text: str) -> QosProvider:
        path = tmp_path / "profiles.xml"
        path.write_text(text, encoding="utf-8")
        return QosProvider(path)

    return provider


def _writer(members: str) -> str:
    return (
        f'<dds>\n<qos_library name="L"><qos_profile name="P"><datawriter_qos>\n{members}\n'
        "</datawriter_qos></qos_profile></qos_library></dds>"
    )


# --- what is read ----------------------------------------------------------------------------------------------

BASE_WRITER = ddsi.Qos(
    durability=ddsi.TransientLocal(),
    deadline=ddsi.Deadline(1.5),
    latency_budget=ddsi.LatencyBudget(0.002),
    liveliness=ddsi.ManualByTopic(math.inf),
    reliability=ddsi.Reliable(0.25),
    destination_order=ddsi.BySourceTimestamp(),
    history=ddsi.KeepLast(4),
    resource_limits=ddsi.ResourceLimits(400, 20, 8),
    transport_priority=ddsi.TransportPriority(-3),
    lifespan=ddsi.Lifespan(60),
    user_data=ddsi.UserData(b"pilot"),
    ownership=ddsi.Exclusive(),
    ownership_strength=ddsi.OwnershipStrength(16),
    writer_data_lifecycle=ddsi.WriterDataLifecycle(False),
    data_representation=ddsi.DataRepresentation(ddsi.XCDR2),
    data_tags=ddsi.DataTags(("level", "crew")),
)
BASE_READER = ddsi.Qos(
    history=ddsi.KeepAll(),
    time_based_filter=ddsi.TimeBasedFilter(0.1),
    reader_data_lifecycle=ddsi.ReaderDataLifecycle(math.inf, 5),
    type_consistency=ddsi.TypeConsistency(0, False, False, True, True, True),
)


def test_every_policy_of_the_omgs_schema(omg: QosProvider) -> None:
    base = "Harbour::Base"
    assert omg.writer(base) == BASE_WRITER
    assert omg.reader(base) == BASE_READER
    assert omg.topic(base) == ddsi.Qos(
        topic_data=ddsi.TopicData(b"tide"),
        durability_service=ddsi.DurabilityService(3, ddsi.KeepAll(), 100),
    )
    assert omg.publisher(base) == ddsi.Qos(
        presentation=ddsi.Presentation(ddsi.AccessScope.TOPIC, True, True),
        partition=ddsi.Partition("quay", "pier*"),
        group_data=ddsi.GroupData(b""),
    )
    assert omg.subscriber(base) == ddsi.Qos(partition=ddsi.Partition("quay"))
    assert omg.participant(base) == ddsi.Qos(
        user_data=ddsi.UserData(b"harbour"),
        entity_factory=ddsi.EntityFactory(False),
        properties={
            "berth": ddsi.Property("seven", True),
            "dds.sec.auth.private_key": ddsi.Property("file:key.pem"),
            "seal": ddsi.BinaryProperty(b"\1\2\3"),
        },
    )


def test_a_profile_overrides_its_base_member_by_member(omg: QosProvider) -> None:
    changed = ddsi.Qos(reliability=ddsi.Reliable(2), history=ddsi.KeepLast(6))
    assert omg.writer("Harbour::Pilot") == BASE_WRITER | changed
    assert omg.writer("Harbour::Tug") == BASE_WRITER | changed
    assert omg.participant("Tug") == omg.participant("Base")


def test_an_entitys_part_may_build_on_another_profile_of_another_file(omg: QosProvider) -> None:
    """The profile's own base first, then the part's, then the part itself."""
    assert omg.reader("Harbour::Tug") == BASE_READER | ddsi.Qos(
        reliability=ddsi.Reliable(), history=ddsi.KeepLast(9), time_based_filter=ddsi.TimeBasedFilter(0)
    )


@pytest.mark.parametrize(
    ("topic", "history"),
    [
        (None, ddsi.KeepLast(6)),
        ("TideTable", ddsi.KeepLast(2)),
        ("Wind", ddsi.KeepLast(2)),
        ("Windy", ddsi.KeepAll()),
        ("tide", ddsi.KeepAll()),
    ],
)
def test_the_first_part_counts_whose_filter_fits_the_topic(
    omg: QosProvider, topic: str | None, history: object
) -> None:
    for profile in ("Harbour::Pilot", "Harbour::Tug"):
        assert omg.writer(profile, topic=topic).history == history


def test_names_and_defaults(omg: QosProvider) -> None:
    assert omg.profiles == ("Harbour::Base", "Harbour::Pilot", "Harbour::Tug", "Deep::Sea", "Deep::Buoy")
    assert omg.writer() == omg.writer("Harbour::Pilot") == omg.writer("Pilot")
    assert omg.writer("Deep::Buoy") == ddsi.Qos(lifespan=ddsi.Lifespan(1))
    assert omg.reader("Deep::Buoy") == ddsi.Qos()
    with pytest.raises(ddsi.BadParameter, match=r"'Ferry' was asked for, .* there are Harbour::Base, "):
        omg.writer("Ferry")
    number: Any = 5
    with pytest.raises(ddsi.BadParameter, match="as 'Library::Profile', not 5"):
        omg.writer(number)
    with pytest.raises(ddsi.BadParameter, match="default for a writer"):
        QosProvider(FILES / "deep.xml").writer()
    with pytest.raises(ddsi.BadParameter, match="at least one file"):
        QosProvider()


def test_rtis_dialect() -> None:
    provider = QosProvider(FILES / "rti.xml")
    assert provider.participant("Mill::Wheel") == ddsi.Qos(
        entity_name="the mill", user_data=ddsi.UserData(b"\x01\x10\xff")
    )
    assert provider.publisher("Wheel") == ddsi.Qos(entity_name="chute")
    assert provider.subscriber("Wheel") == ddsi.Qos(entity_name="hopper")
    assert provider.writer("Mill::Wheel") == ddsi.Qos(
        entity_name="sluice",
        reliability=ddsi.Reliable(),
        resource_limits=ddsi.ResourceLimits(),
        data_representation=ddsi.DataRepresentation(ddsi.XCDR1, ddsi.XCDR2),
        writer_data_lifecycle=ddsi.WriterDataLifecycle(False),
        durability=ddsi.Persistent(),
        deadline=ddsi.Deadline(0.01),
        properties={"cogs": ddsi.Property("12"), "grit": ddsi.Property("fine")},
    )
    assert provider.reader("Mill::Wheel") == ddsi.Qos(
        entity_name="sack", durability=ddsi.Transient(), liveliness=ddsi.Automatic(2)
    )
    skipped = [place.partition("<")[2].partition(">")[0] for place in provider.skipped]
    assert skipped == ["role_name", "discovery", "acknowledgment_kind", "initial_samples", "protocol", "publish_mode"]
    assert provider.skipped[1].startswith(f"{FILES / 'rti.xml'}, line 8: <discovery>: it steers only")


BUILTIN = """<dds>
<qos_library name="L">
  <qos_profile name="P" base_name="BuiltinQosLibExp::Generic.StrictReliable">
    <datawriter_qos><history><depth>5</depth></history></datawriter_qos>
    <datareader_qos>
      <base_name><element>BuiltinQosSnippetLib::QosPolicy.Durability.TransientLocal</element></base_name>
    </datareader_qos>
  </qos_profile>
  <qos_profile name="Q" base_name="{}"/>
</qos_library></dds>"""


def test_rtis_builtin_profiles_are_what_their_names_say_of_policies(written: Written) -> None:
    provider = written(BUILTIN.format("BuiltinQosLib::Generic.KeepLastReliable.Persistent"))
    assert provider.writer("P") == ddsi.Qos(reliability=ddsi.Reliable(), history=ddsi.KeepAll())
    assert provider.reader("P") == provider.writer("P") | ddsi.Qos(durability=ddsi.TransientLocal())
    assert provider.reader("Q") == ddsi.Qos(
        reliability=ddsi.Reliable(), history=ddsi.KeepLast(1), durability=ddsi.Persistent()
    )
    assert provider.participant("P") == ddsi.Qos()


def test_builtin_profiles_of_another_meaning_are_refused_above_all_those_of_security(written: Written) -> None:
    """Read as nothing, a participant that was to be secured would be none."""
    for name in ("BuiltinQosSnippetLib::Feature.Security.Enable", "BuiltinQosLib::Generic.Security"):
        with pytest.raises(ddsi.ConfigurationError, match=f"line 9: .*'{name}', which is built into RTI"):
            written(BUILTIN.format(name))
    own = "<qos_library name='BuiltinQosLib'><qos_profile name='Generic.Security'/></qos_library>"
    written(BUILTIN.format("BuiltinQosLib::Generic.Security").replace("<dds>", f"<dds>{own}"))


def test_fast_ddss_dialect() -> None:
    provider = QosProvider(FILES / "fast.xml")
    assert provider.participant() == ddsi.Qos(
        entity_name="apples",
        user_data=ddsi.UserData(b"\x3a\x0f\xff"),
        properties={"dds.sec.auth.plugin": ddsi.Property("builtin.PKI-DH"), "tree": ddsi.Property("old", True)},
    )
    assert provider.writer() == provider.writer("picker")
    assert provider.writer("picker") == ddsi.Qos(
        history=ddsi.KeepLast(20),
        resource_limits=ddsi.ResourceLimits(500, 10, 50),
        durability=ddsi.TransientLocal(),
        durability_service=ddsi.DurabilityService(history=ddsi.KeepLast(3)),
        deadline=ddsi.Deadline(1),
        latency_budget=ddsi.LatencyBudget(0.005),
        liveliness=ddsi.ManualByParticipant(8),
        reliability=ddsi.Reliable(1),
        destination_order=ddsi.BySourceTimestamp(),
        lifespan=ddsi.Lifespan(math.inf),
        ownership=ddsi.Exclusive(),
        ownership_strength=ddsi.OwnershipStrength(5),
        transport_priority=ddsi.TransportPriority(9),
        partition=ddsi.Partition("north", "south"),
        presentation=ddsi.Presentation(ddsi.AccessScope.GROUP, True, False),
        user_data=ddsi.UserData(b"\1"),
        topic_data=ddsi.TopicData(b"\2"),
        group_data=ddsi.GroupData(b"\3"),
        properties={"ladder": ddsi.Property("long")},
    )
    assert provider.reader("basket") == ddsi.Qos(
        reliability=ddsi.BestEffort(), time_based_filter=ddsi.TimeBasedFilter(2)
    )
    assert provider.writer("cart") == ddsi.Qos(durability=ddsi.Volatile())
    assert provider.reader("press") == ddsi.Qos(durability=ddsi.Transient())
    # To Fast DDS 0 is no limit.
    assert provider.topic("fruit") == ddsi.Qos(history=ddsi.KeepAll(), resource_limits=ddsi.ResourceLimits())
    with pytest.raises(ddsi.BadParameter, match="default for a reader"):
        provider.reader()


@pytest.mark.parametrize(
    ("said", "seconds"),
    [
        ("<sec>3</sec><nanosec>250000000</nanosec>", 3.25),
        ("<sec>3</sec>", 3),
        ("<nanosec>250000000</nanosec>", 0.25),
        ("<sec>0</sec><nanosec>0</nanosec>", 0),
        ("DURATION_INFINITY", math.inf),
        ("DURATION_INFINITE", math.inf),
        ("DDS_DURATION_INFINITE", math.inf),
        ("DURATION_ZERO", 0),
        ("<sec>DURATION_INFINITE_SEC</sec><nanosec>DURATION_INFINITE_NSEC</nanosec>", math.inf),
        ("<sec>DURATION_INFINITY</sec>", math.inf),
        ("<sec>DURATION_ZERO_SEC</sec><nanosec>1000000</nanosec>", 0.001),
        ("<sec>2147483647</sec><nanosec>2147483647</nanosec>", math.inf),
        ("<sec>2147483647</sec><nanosec>4294967295</nanosec>", math.inf),
        ("<nanosec>DURATION_INFINITE_NSEC</nanosec>", math.inf),
    ],
)
def test_durations_in_all_their_spellings(written: Written, said: str, seconds: float) -> None:
    provider = written(_writer(f"<lifespan><duration>{said}</duration></lifespan>"))
    assert provider.writer("L::P").lifespan == ddsi.Lifespan(seconds)


def test_booleans_in_all_their_spellings(written: Written) -> None:
    name = "autodispose_unregistered_instances"
    text = f"<writer_data_lifecycle><{name}>{{}}</{name}></writer_data_lifecycle>"
    for said, value in (
        ("true", True),
        ("1", True),
        ("BOOLEAN_TRUE", True),
        ("false", False),
        ("0", False),
        ("NO", False),
    ):
        lifecycle = written(_writer(text.format(said))).writer("L::P").writer_data_lifecycle
        assert lifecycle == ddsi.WriterDataLifecycle(value)
    with pytest.raises(ddsi.ConfigurationError, match="is 'perhaps'; it must be true or false"):
        written(_writer(text.format("perhaps")))


def test_a_kind_that_is_not_said_is_the_omgs_default_for_that_entity(written: Written) -> None:
    provider = written(
        '<qos_profile name="P">'
        "<datawriter_qos><reliability><max_blocking_time><sec>1</sec></max_blocking_time></reliability></datawriter_qos>"
        "<datareader_qos><reliability><max_blocking_time><sec>1</sec></max_blocking_time></reliability></datareader_qos>"
        "</qos_profile>"
    )
    assert provider.writer("P").reliability == ddsi.Reliable(1)
    assert provider.reader("P").reliability == ddsi.BestEffort(1)


# --- what is refused -------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("members", "message"),
    [
        ("<reliabilty/>", r"profiles.xml, line 3: <reliabilty> .* in <datawriter_qos>: did you mean <reliability>\?"),
        ("<reliability>\n<knd>X</knd></reliability>", r"line 4: <knd> .* in <reliability>: did you mean <kind>\?"),
        ("<zzz/>", r"<zzz> is not known in <datawriter_qos>: there may be <durability>, "),
        ("<time_based_filter/>", r"<time_based_filter> is not known in <datawriter_qos>"),
        ("<reliability><kind>RELIABEL</kind></reliability>", r"<kind> is 'RELIABEL'; it must be BEST_EFFORT_RELIAB"),
        ("<history><depth>many</depth></history>", r"<depth> is 'many'; it must be a whole number of 32 bits"),
        ("<history><depth>99999999999</depth></history>", r"it must be a whole number of 32 bits"),
        ("<history><depth>0</depth></history>", r"line 3: <depth> is '0', which cannot be: KeepLast.depth"),
        ("<history><depth><a/></depth></history>", r"<a> may not stand in it"),
        ("<history>5</history>", r"<history> holds elements, but there is text"),
        ("<resource_limits><max_samples>-2</max_samples></resource_limits>", r"is '-2', which cannot be"),
        ("<resource_limits><max_samples>LOTS</max_samples></resource_limits>", r"or LENGTH_UNLIMITED"),
        ("<lifespan><duration>soon</duration></lifespan>", r"is 'soon'; it must be <sec> and <nanosec>, or DUR"),
        ("<lifespan><duration><sec>-1</sec></duration></lifespan>", r"is '-1'; it must be <sec> and <nanosec>"),
        ("<lifespan><duration><sec>1</sec><sec>2</sec></duration></lifespan>", r"<sec> is one too many"),
        ("<lifespan><duration><sec>1</sec><nanosec>1000000000</nanosec></duration></lifespan>", r"below 1000000000"),
        ("<lifespan><duration><min>1</min></duration></lifespan>", r"<min> is one too many"),
        ("<user_data><value>!!</value></user_data>", r"octets in base64"),
        ("<user_data><value>1,256</value></user_data>", r"numbers from 0 to 255"),
        ("<history kind='x'/>", r"<history> has no attribute 'kind': it has none"),
        ("<ownership><kind/></ownership>", r"<kind> is ''; it must be SHARED_OWNERSHIP_QOS or EXCLUSIVE_OWNERSHIP_QOS"),
        ("<data_representation><value><element>JSON</element></value></data_representation>", r"XCDR2_DATA_REPRES"),
        ("<data_tags><tags><item/></tags></data_tags>", r"<item> is not known in <tags>: .*<element>"),
        ("<property><value><element><name>x</name></element></value></property>", r"<element> lacks <value>"),
        ("<property><value><element><value>x</value></element></value></property>", r"<element> lacks <name>"),
        (
            "<data_tags><tags><element><name>x</name><value>y</value><propagate>1</propagate></element></tags></data_tags>",
            r"<propagate> is not known in <element>",
        ),
    ],
)  # fmt: skip
def test_what_cannot_be_meant_is_refused_with_its_place(written: Written, members: str, message: str) -> None:
    with pytest.raises(ddsi.ConfigurationError, match=message):
        written(_writer(members))


def _library(inside: str) -> str:
    return f'<dds>\n<qos_library name="L">{inside}</qos_library></dds>'


@pytest.mark.parametrize(
    ("document", "message"),
    [
        ("<dss/>", r"line 1: <dss> is not known at the top of QoS profiles: did you mean <dds>\?"),
        ("<dds><qos_libary/></dds>", r"did you mean <qos_library>\?"),
        ("<dds><qos_library/></dds>", r"<qos_library> needs a name"),
        ("<dds>words</dds>", r"<dds> holds elements"),
        ("<dds colour='red'/>", r"<dds> has no attribute 'colour'"),
        (_library("<qos_profil name='P'/>"), r"line 2: <qos_profil> .* did you mean <qos_profile>\?"),
        (_library("<qos_profile/>"), r"<qos_profile> needs a name"),
        (_library("<qos_profile name='P' base_nam='x'/>"), r"no attribute 'base_nam': did you mean base_name\?"),
        (_library("<qos_profile name='P' is_default_qos='maybe'/>"), r"is_default_qos is 'maybe'"),
        (_library("<qos_profile name='P'><datawriterqos/></qos_profile>"), r"did you mean <datawriter_qos>\?"),
        (_library("<qos_profile name='P'/><qos_profile name='P'/>"), r"'L::P' already, at .*, line 2"),
        (_library("<qos_profile name='P' base_name='Q'/>"), r"builds on 'Q', which is in no file; there are L::P"),
        (
            _library("<qos_profile name='P' base_name='Q'/><qos_profile name='Q' base_name='L::P'/>"),
            r"in a circle: L::P on L::Q on L::P",
        ),
        (_library("<qos_profile name='P' base_name='P'/>"), r"in a circle: L::P on L::P"),
        (
            _library("<qos_profile name='P'><publisher_qos topic_filter='*'/></qos_profile>"),
            r"<publisher_qos> has a topic_filter",
        ),
        ("<dds><profiles><data_wrtr profile_name='x'/></profiles></dds>", r"did you mean <data_writer>\?"),
        ("<dds><profiles><data_writer/></profiles></dds>", r"give it the attribute profile_name"),
        ("<dds></dds><dds/>", r"more follows the end of <dds>"),
        ("<dds>", r"not well-formed XML"),
        ("<!DOCTYPE dds [<!ENTITY a 'b'>]><dds>&a;</dds>", r"a document type is not allowed"),
        ("<!DOCTYPE dds SYSTEM 'http://example.com/x.dtd'><dds/>", r"a document type is not allowed"),
        ("<dds>" + "<a>" * 50 + "</a>" * 50 + "</dds>", r"nested deeper than"),
    ],
)
def test_documents_that_are_no_profiles_are_refused(written: Written, document: str, message: str) -> None:
    with pytest.raises(ddsi.ConfigurationError, match=message):
        written(document)


def test_a_file_that_is_not_there_or_too_long_is_refused(tmp_path: Path) -> None:
    with pytest.raises(ddsi.ConfigurationError, match="cannot be read"):
        QosProvider(tmp_path / "nothing.xml")
    long = tmp_path / "long.xml"
    long.write_bytes(b"<dds>" + b" " * (1 << 20) + b"</dds>")
    with pytest.raises(ddsi.ConfigurationError, match="at most"):
        QosProvider(long)


def _ladder(levels: int, bases: Callable[[int], str]) -> str:
    """Profiles of which each builds on the ones below, the lowest last."""
    rungs = [f"<qos_profile name='P{n}'>{bases(n)}</qos_profile>" for n in range(levels, 0, -1)]
    return _library("".join(rungs) + "<qos_profile name='P0'/>")


def test_what_builds_on_what_is_bounded(written: Written) -> None:
    below = "<base_name><element>P{0}</element><element>P{0}</element></base_name>"
    written(_ladder(30, lambda n: below.format(n - 1)))  # two to the thirtieth, if each were resolved anew
    written(_ladder(30, lambda n: below.format(n - 1))).writer("L::P30", topic="Square")
    with pytest.raises(ddsi.ConfigurationError, match="more than 32 deep"):
        written(_ladder(40, lambda n: below.format(n - 1)))
    upwards = "".join(f"<qos_profile name='P{n}' base_name='P{n - 1}'/>" for n in range(1, 40))
    with pytest.raises(ddsi.ConfigurationError, match="more than 32 deep"):
        written(_library("<qos_profile name='P0'/>" + upwards))
    with pytest.raises(ddsi.ConfigurationError, match="more than 1000"):
        written(_library("".join(f"<qos_profile name='P{n}'/>" for n in range(1001))))


def test_the_value_of_a_property_is_in_no_message(written: Written) -> None:
    secret = "<element><name>{}</name><value>hunter2</value>{}</element>"
    for element in (secret.format("", ""), secret.format("x", "<propagate>hm</propagate>"), secret.format("x", "<a/>")):
        with pytest.raises(ddsi.ConfigurationError) as caught:
            written(_writer(f"<property><value>{element}</value></property>"))
        assert "hunter2" not in str(caught.value)
    binary = "<binary_value><element><name>x</name><value>hunter2!</value></element></binary_value>"
    with pytest.raises(ddsi.ConfigurationError, match="what it may not be") as caught:
        written(_writer(f"<property>{binary}</property>"))
    assert "hunter2" not in str(caught.value)
    provider = written(_writer(f"<property><value>{secret.format('x', '')}</value></property>"))
    assert "hunter2" not in repr(provider.writer("L::P"))


def test_security_from_a_file_is_that_of_a_keystore_folder(written: Written, tmp_path: Path) -> None:
    names = (
        "identity_ca.cert.pem",
        "cert.pem",
        "key.pem",
        "permissions_ca.cert.pem",
        "governance.p7s",
        "permissions.p7s",
    )
    for name in names:
        (tmp_path / name).touch()
    secured = ddsi.secure(tmp_path)
    texts = {
        name: value.value if isinstance(value, ddsi.Property) else value for name, value in secured.properties.items()
    }
    elements = "".join(f"<element><name>{name}</name><value>{text}</value></element>" for name, text in texts.items())
    provider = written(
        "<dds><qos_profile name='Secured'><domain_participant_qos>"
        f"<property><value>{elements}</value></property></domain_participant_qos></qos_profile></dds>"
    )
    read = provider.participant("Secured").properties
    assert {name: value.value for name, value in read.items() if isinstance(value, ddsi.Property)} == texts
    assert len(texts) == 6


# --- the document ----------------------------------------------------------------------------------------------


def _leaves(words: Mapping[str, Word], above: str = "") -> Iterator[tuple[str, str]]:
    """Each setting, and the path of its element."""
    for name, word in words.items():
        path = f"{above}/{name}" if above else name
        if isinstance(word, Leaf | Members):
            yield word.setting, f"{path}/{word.element}" if isinstance(word, Members) else path
        elif not isinstance(word, Skipped):
            yield from _leaves(word, path)


def _table() -> dict[str, tuple[set[str], set[str]]]:
    """The document's table: by policy, the elements in the OMG's and RTI's files, and in Fast DDS's."""
    rows: dict[str, tuple[set[str], set[str]]] = {}
    for line in DOCUMENT.read_text(encoding="utf-8").splitlines():
        cells = [cell.strip() for cell in line.strip("|").split("|")]
        if line.startswith("| `") and len(cells) == 4:
            names = [{name.strip("` ") for name in cell.split(",") if name.strip() not in ("", "-")} for cell in cells]
            rows[cells[0].strip("`")] = names[1], names[2]
    return rows


def test_the_document_lists_what_is_read_from_which_dialect() -> None:
    expected: dict[str, tuple[set[str], set[str]]] = {}
    for column, dialect in enumerate((OMG, FAST)):
        for words in dialect.values():
            for setting, path in _leaves(words):
                policy = setting.partition(".")[0]
                parts = path.split("/")
                parts = parts[1:] if column and parts[0] in ("qos", "topic", "rtps") else parts
                expected.setdefault(policy, (set(), set()))[column].add(parts[0])
    assert _table() == expected


def test_every_setting_makes_a_policy_and_every_policy_has_its_settings() -> None:
    settings = {setting for dialect in (OMG, FAST) for words in dialect.values() for setting, _ in _leaves(words)}
    policies = {setting.partition(".")[0] for setting in settings}
    assert policies - {"property"} == set(_MAKERS)
    qos = set(ddsi.Qos.__dataclass_fields__)
    assert set(_MAKERS) <= qos
    assert qos - set(_MAKERS) == {"properties"}
