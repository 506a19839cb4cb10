"""``ddsi-shape-main``: its options, their QoS, its lines and statuses; the cases are ``multiproc_tests``' business."""

from __future__ import annotations

import re
import tomllib
from pathlib import Path
from typing import Any

import pytest

from ddsi.cli.shape_main import main
from ddsi.cli.shape_main_lines import sample_line, state_line, status_line
from ddsi.cli.shape_main_options import OptionError, ShapeMainOptions, option_parser, parse_options, warnings
from ddsi.cli.shape_main_qos import content_filter, endpoint_qos, group_qos, participant_config
from ddsi.cli.shape_types import shape_form
from ddsi.config import Config
from ddsi.structure import qos_policies as p
from ddsi.structure import status as s
from ddsi.structure.cache_change import CacheChange, ChangeKind
from ddsi.structure.guid import GUID_UNKNOWN
from ddsi.structure.sample_info import InstanceState, SampleInfo

ROOT = Path(__file__).parents[2]
PAGE = (ROOT / "docs" / "shape_main.md").read_text(encoding="utf-8")


def _options(words: str) -> ShapeMainOptions:
    return parse_options(["-t", "Square", *words.split()])


# --- options ---------------------------------------------------------------------------------------------

OPTIONS: list[tuple[str, dict[str, Any]]] = [
    ("-P", {"publishes": True, "domain": 0, "is_reliable": True, "history_depth": -1, "ownership_strength": -1}),
    ("-S", {"publishes": False, "size": 20, "write_period_ms": 33, "read_period_ms": 100, "color": None}),
    ("-P -d 7 -b -k 5 -f 300 -s 4 -c RED -p p1", {
        "domain": 7, "is_reliable": False, "history_depth": 5, "deadline_ms": 300, "ownership_strength": 4,
        "color": "RED", "partition": "p1"}),
    ("-P -b -r -s -1", {"is_reliable": True, "ownership_strength": -1}),
    ("-P -D l -x 2 -w -z 0 -R -v d", {
        "durability": "l", "representation": 2, "prints_written": True, "size": 0, "reads": True, "is_verbose": True}),
    ("-P --write-period 50 --read-period 200 --time-filter 1000 --lifespan 250 --num-iterations 3", {
        "write_period_ms": 50, "read_period_ms": 200, "time_filter_ms": 1000, "lifespan_ms": 250,
        "num_iterations": 3}),
    ("-P --num-instances 4 --num-topics 2 --final-instance-state u --access-scope g --coherent --ordered", {
        "num_instances": 4, "num_topics": 2, "final_instance_state": "u", "access_scope": "g",
        "is_coherent": True, "is_ordered": True}),
    ("-P --coherent-sample-count 3 --additional-payload-size 9 --take-read --periodic-announcement 5000", {
        "coherent_sample_count": 3, "payload_octets": 9, "by_instance": False, "announcement_ms": 5000}),
    ("-S --datafrag-size 65535 --size-modulo 50 --cft color='RED'", {
        "fragment_octets": 65535, "size_modulo": 50, "filter_expression": "color='RED'"}),
    ("-P --write-per=50 -d9", {"write_period_ms": 50, "domain": 9}),
]  # fmt: skip


@pytest.mark.parametrize(("words", "expected"), OPTIONS)
def test_options_are_read_as_the_suite_gives_them(words: str, expected: dict[str, Any]) -> None:
    options = _options(words)
    assert {name: getattr(options, name) for name in expected} == expected


@pytest.mark.parametrize(
    "words",
    ["-P -S", "", "-P -k -1", "-P -s -2", "-P -D x", "-P -x 3", "-P -z -1", "-P -d -1", "-P --num-instances 0",
     "-P --coherent-sample-count 1", "-P --datafrag-size 65536", "-P --size-modulo 0", "-P --final-instance-state x",
     "-P -v x", "-P --nonsense", "-P -k five", "-S -c RED --cft x=1"],
)  # fmt: skip
def test_what_cannot_be_meant_is_refused(words: str) -> None:
    with pytest.raises(OptionError):
        _options(words)


def test_wrong_arguments_end_with_status_1_and_the_help(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["-P"]) == 1
    said = capsys.readouterr().out
    assert said.startswith("please specify topic name [-t]\n")
    assert "--additional-payload-size" in said


def test_names_of_topics_and_instances_are_numbered_from_the_second() -> None:
    options = _options("-P --num-topics 3 --num-instances 2")
    assert options.topics() == ("Square", "Square1", "Square2")
    assert options.colors() == ("BLUE", "BLUE1")


def test_what_means_nothing_in_a_role_is_said_without_the_words_that_end_a_case() -> None:
    everything = (
        "-R --time-filter 1 --take-read --cft x=1 -z 1 --lifespan 1 --num-instances 2 --final-instance-state u "
        "--additional-payload-size 1"
    )
    said = warnings(_options(f"-P {everything}")) + warnings(_options(f"-S {everything}"))
    assert len(said) == 10
    assert not re.search("not supported", " ".join(said), re.IGNORECASE)


# --- QoS -------------------------------------------------------------------------------------------------


def test_the_defaults_are_reliable_volatile_and_one_representation() -> None:
    qos = endpoint_qos(_options("-S"))
    assert isinstance(qos.reliability, p.Reliable)
    assert isinstance(qos.durability, p.Volatile)
    assert isinstance(qos.ownership, p.Shared)
    assert qos.data_representation == p.DataRepresentation(p.DataRepresentationId.XCDR1)
    assert (qos.history, qos.deadline, qos.time_based_filter) == (None, None, None)
    assert group_qos(_options("-S")).partition is None


def test_options_become_policies() -> None:
    options = _options("-P -b -k 0 -D p -x 2 -s 3 -f 2000 --lifespan 250 --final-instance-state u -p p1")
    qos = endpoint_qos(options)
    assert isinstance(qos.reliability, p.BestEffort)
    assert isinstance(qos.durability, p.Persistent)
    assert qos.history == p.KeepAll()
    assert qos.data_representation == p.DataRepresentation(p.DataRepresentationId.XCDR2)
    assert (qos.ownership, qos.ownership_strength) == (p.Exclusive(), p.OwnershipStrength(3))
    assert (qos.deadline, qos.lifespan) == (p.Deadline(2.0), p.Lifespan(0.25))
    assert qos.writer_data_lifecycle == p.WriterDataLifecycle(autodispose_unregistered_instances=False)
    assert group_qos(options).partition == p.Partition("p1")


@pytest.mark.parametrize("final", ["", "--final-instance-state u", "--final-instance-state d"])
def test_the_end_of_a_writer_disposes_nothing(final: str) -> None:
    """The suite's FinalInstanceState_2 wants to see that nobody writes; case 1 disposes in so many words."""
    qos = endpoint_qos(_options(f"-P {final}"))
    assert qos.writer_data_lifecycle == p.WriterDataLifecycle(autodispose_unregistered_instances=False)


def test_a_subscriber_has_neither_strength_nor_lifespan() -> None:
    qos = endpoint_qos(_options("-S -s 3 -k 5 --lifespan 250 --time-filter 1000"))
    assert (qos.ownership, qos.ownership_strength, qos.lifespan) == (p.Exclusive(), None, None)
    assert (qos.history, qos.time_based_filter) == (p.KeepLast(5), p.TimeBasedFilter(1.0))


def test_announcements_and_fragments_are_configuration() -> None:
    config = participant_config(_options("-P --periodic-announcement 500 --datafrag-size 65535"), Config())
    assert (config.spdp_interval, config.fragment_size) == (0.5, 65507)
    assert participant_config(_options("-P"), Config(fragment_size=1000)) == Config(fragment_size=1000)


@pytest.mark.parametrize(
    ("words", "expected"),
    [
        ("-P", None),
        ("-P --access-scope t", p.Presentation(p.AccessScope.TOPIC)),
        ("-S --coherent", p.Presentation(coherent_access=True)),
        ("-S --ordered --access-scope g", p.Presentation(p.AccessScope.GROUP, ordered_access=True)),
        ("-P --coherent --ordered --access-scope i", p.Presentation(p.AccessScope.INSTANCE, True, True)),
    ],
)
def test_presentation_is_of_the_group(words: str, expected: p.Presentation | None) -> None:
    assert group_qos(_options(words)).presentation == expected
    assert endpoint_qos(_options(words)).presentation is None


@pytest.mark.parametrize(
    ("words", "expected"),
    [
        ("-S", None),
        ("-P -c RED", None),
        ("-S -c RED", ("color = %0", ("'RED'",))),
        ("-S -c it's", ("color = %0", ("'it''s'",))),
        ("-S --cft x=1", ("x=1", ())),
    ],
)
def test_a_subscriber_filters_by_color_or_by_expression(words: str, expected: object) -> None:
    assert content_filter(_options(words)) == expected


def test_a_filter_that_cannot_be_meant_is_said_in_the_suite_s_words(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["-t", "Square", "-d", "231", "-S", "--cft", "siz = 1"]) == 2
    lines = capsys.readouterr().out.splitlines()
    assert lines[-2] == "failed to create content filtered topic"
    assert "did you mean" in lines[-1] or "has no member 'siz'" in lines[-1]
    assert not any("Create reader" in line for line in lines)


# --- lines -----------------------------------------------------------------------------------------------


def test_a_sample_is_a_line_of_columns() -> None:
    plain, loaded = shape_form("appendable", 0), shape_form("appendable", 3)
    assert sample_line("Square", plain.sample("BLUE", 5, 123, 20)) == "Square     BLUE       005 123 [20]"
    assert sample_line("Square", loaded.sample("BLUE", 5, 123, 20)) == "Square     BLUE       005 123 [20] {255}"


def test_the_end_of_an_instance_is_a_line_and_a_living_one_is_none() -> None:
    info = SampleInfo(CacheChange(ChangeKind.ALIVE, GUID_UNKNOWN, 1, b"", b""), 0.0, valid_data=False)
    assert state_line("Square", "RED", info) is None
    info.instance_state = InstanceState.NOT_ALIVE_NO_WRITERS
    assert state_line("Square", "RED", info) == "Square     RED        NOT_ALIVE_NO_WRITERS_INSTANCE_STATE"
    info.instance_state = InstanceState.NOT_ALIVE_DISPOSED
    assert state_line("Square", "RED", info) == "Square     RED        NOT_ALIVE_DISPOSED_INSTANCE_STATE"


ABOUT = "topic: 'Square'  type: 'ShapeType'"
MISFIT = s.Incompatibility(policy="reliability", policy_id=11, offered="best effort", requested="reliable")
LINES: list[tuple[s.Status, str | None]] = [
    (s.PublicationMatched(current_count=2, current_count_change=-1),
     f"on_publication_matched() {ABOUT} : matched readers 2 (change = -1)"),
    (s.SubscriptionMatched(current_count=1, current_count_change=1),
     f"on_subscription_matched() {ABOUT} : matched writers 1 (change = 1)"),
    (s.OfferedIncompatibleQos(last_policy_id=11, incompatibilities=(MISFIT,)),
     f"on_offered_incompatible_qos() {ABOUT} : 11 (RELIABILITY)"),
    (s.RequestedIncompatibleQos(last_policy_id=11, incompatibilities=(MISFIT,)),
     f"on_requested_incompatible_qos() {ABOUT} : 11 (RELIABILITY)"),
    (s.OfferedDeadlineMissed(total_count=3, total_count_change=1),
     f"on_offered_deadline_missed() {ABOUT} : (total = 3, change = 1)"),
    (s.RequestedDeadlineMissed(total_count=3, total_count_change=1),
     f"on_requested_deadline_missed() {ABOUT} : (total = 3, change = 1)"),
    (s.LivelinessLost(total_count=1, total_count_change=1),
     f"on_liveliness_lost() {ABOUT} : (total = 1, change = 1)"),
    (s.LivelinessChanged(alive_count=1, not_alive_count=0),
     f"on_liveliness_changed() {ABOUT} : (alive = 1, not_alive = 0)"),
    (s.InconsistentTopic(), f"on_inconsistent_topic() {ABOUT}"),
    (s.SampleLost(), None),
]  # fmt: skip


@pytest.mark.parametrize(("status", "line"), LINES)
def test_a_status_is_the_line_that_the_suite_knows(status: s.Status, line: str | None) -> None:
    assert status_line("Square", "ShapeType", status) == line


# --- how it is found -------------------------------------------------------------------------------------


def test_it_is_installed_under_its_name() -> None:
    """The suite starts one file; the installed script is that file."""
    scripts = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]["scripts"]
    assert scripts["ddsi-shape-main"] == f"{main.__module__}:{main.__name__}"


# --- its page --------------------------------------------------------------------------------------------


def test_every_option_is_in_its_page() -> None:
    options = {option for action in option_parser()._actions for option in action.option_strings}
    assert options - set(re.findall(r"(?<![\w-])--?[a-zA-Z][a-z-]*", PAGE)) == set()
