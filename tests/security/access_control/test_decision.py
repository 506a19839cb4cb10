"""Decisions: rules in document order, what they cover, and the derivation that says why."""

from __future__ import annotations

import pytest

from ddsi.spi import Refused
from ddsi_security.access_control.decision import Decision, decide, decide_participant, decide_topic
from ddsi_security.access_control.permissions import ActionKind, Permissions
from ddsi_security.access_control.subject_name import SubjectName
from ddsi_security.access_control.validity import parse_instant
from tests.security.access_control.documents import NOW, grant, permissions_xml


def rule(kind: str, *criteria: str, domains: str = "<id>0</id>") -> str:
    return f"<{kind}_rule><domains>{domains}</domains>{''.join(criteria)}</{kind}_rule>"


def criterion(kind: str, *topics: str, partitions: tuple[str, ...] | None = None, tags: str = "") -> str:
    """``tags``: NAME=VALUE, separated by blanks."""
    text = f"<topics>{''.join(f'<topic>{topic}</topic>' for topic in topics)}</topics>"
    if partitions is not None:
        text += f"<partitions>{''.join(f'<partition>{name}</partition>' for name in partitions)}</partitions>"
    if tags:
        pairs = [tag.split("=") for tag in tags.split()]
        inner = "".join(f"<tag><name>{name}</name><value>{value}</value></tag>" for name, value in pairs)
        text += f"<data_tags>{inner}</data_tags>"
    return f"<{kind}>{text}</{kind}>"


def decision(
    rules: str, topic: str = "Square", *, partitions: tuple[str, ...] = (), tags: str = "", default: str = "DENY"
) -> Decision:
    data_tags = tuple((name, value) for name, value in (tag.split("=") for tag in tags.split()))
    return decide(
        grant(rules, default=default),
        domain_id=0,
        kind=ActionKind.PUBLISH,
        topic=topic,
        partitions=partitions,
        data_tags=data_tags,
    )


def allow(*criteria: str) -> str:
    return rule("allow", *criteria)


def deny(*criteria: str) -> str:
    return rule("deny", *criteria)


PUBLISH_SQUARE = criterion("publish", "Square")
IN_A = criterion("publish", "Square", partitions=("A",))
IN_A_AND_B = criterion("publish", "Square", partitions=("A", "B*"))
SECRET = criterion("publish", "Square", tags="level=secret")


@pytest.mark.parametrize(
    ("rules", "default", "allowed"),
    [
        ("", "DENY", False),
        ("", "ALLOW", True),  # Fast DDS uses no default
        (allow(PUBLISH_SQUARE), "DENY", True),
        (deny(PUBLISH_SQUARE), "ALLOW", False),
        (allow(criterion("publish", "Circle")), "DENY", False),
        (allow(criterion("publish", "Circle", "S*")), "DENY", True),
        (allow(criterion("subscribe", "Square")), "DENY", False),
        (allow(criterion("relay", "Square")), "DENY", False),
        (allow(), "DENY", False),  # nothing is allowed by a rule that names nothing
        (deny(), "ALLOW", True),
        (allow(PUBLISH_SQUARE) + deny(PUBLISH_SQUARE), "DENY", True),  # the first decides
        (deny(PUBLISH_SQUARE) + allow(PUBLISH_SQUARE), "ALLOW", False),
        (deny(criterion("publish", "Circle")) + allow(PUBLISH_SQUARE), "DENY", True),
        # a rule for the topic in other partitions does not end the search, as it does with Fast DDS
        (allow(IN_A) + allow(PUBLISH_SQUARE), "DENY", True),
        (allow(IN_A + PUBLISH_SQUARE), "DENY", True),
        # rules are for domains, for the local participant too, where Fast DDS looks at all of them
        (rule("allow", PUBLISH_SQUARE, domains="<id>1</id>"), "DENY", False),
        (rule("deny", PUBLISH_SQUARE, domains="<id>1</id>"), "ALLOW", True),
        (rule("allow", PUBLISH_SQUARE, domains="<id_range><min>0</min></id_range>"), "DENY", True),
        (rule("allow", PUBLISH_SQUARE, domains="<id_range><max>0</max></id_range>"), "DENY", True),
        (rule("allow", PUBLISH_SQUARE, domains="<id_range><min>1</min></id_range>"), "DENY", False),
        (
            rule("allow", PUBLISH_SQUARE, domains="<id>5</id><id_range><max>0</max></id_range>"),
            "DENY",
            True,
        ),
    ],
)
def test_the_first_rule_that_applies_decides_and_else_the_default(rules: str, default: str, allowed: bool) -> None:
    assert decision(rules, default=default).allowed is allowed


@pytest.mark.parametrize(
    ("rules", "partitions", "allowed"),
    [
        # an allow rule must cover all partitions; without any, it is for "" alone
        (allow(PUBLISH_SQUARE), (), True),
        (allow(PUBLISH_SQUARE), ("",), True),
        (allow(PUBLISH_SQUARE), ("A",), False),
        (allow(IN_A), ("A",), True),
        (allow(IN_A), (), False),
        (allow(IN_A), ("A", "B"), False),
        (allow(IN_A_AND_B), ("A", "B", "B1"), True),
        (allow(IN_A_AND_B), ("A", "B", ""), False),
        (allow(criterion("publish", "Square", partitions=("*",))), (), True),
        (allow(criterion("publish", "Square", partitions=("",))), (), True),
        (allow(criterion("publish", "Square", partitions=("?",))), ("*",), True),  # the known flaw of the specification
        # two criteria do not add up
        (allow(IN_A + criterion("publish", "Square", partitions=("B",))), ("A", "B"), False),
        # a deny rule applies to one partition of several (RustDDS: only if to all), and without any to all of them
        # (Cyclone DDS: to "" alone)
        (deny(PUBLISH_SQUARE), (), False),
        (deny(PUBLISH_SQUARE), ("A",), False),
        (deny(IN_A), ("A", "B"), False),
        (deny(IN_A), ("B",), True),  # the topic alone is enough for Fast DDS
        (deny(IN_A), (), True),
        (deny(IN_A_AND_B), ("B7", "C"), False),
    ],
)
def test_partitions(rules: str, partitions: tuple[str, ...], allowed: bool) -> None:
    default = "ALLOW" if rules.startswith("<deny") else "DENY"
    assert decision(rules, partitions=partitions, default=default).allowed is allowed


@pytest.mark.parametrize(
    ("rules", "tags", "allowed"),
    [
        # only RustDDS among the open ones looks at tags
        (allow(PUBLISH_SQUARE), "", True),
        (allow(PUBLISH_SQUARE), "level=secret", False),
        (allow(SECRET), "level=secret", True),
        (allow(SECRET), "", True),
        (allow(SECRET), "level=public", False),
        (allow(SECRET), "level=secret area=north", False),
        (allow(criterion("publish", "Square", tags="level=secret area=north")), "area=north", True),
        (deny(PUBLISH_SQUARE), "level=secret", False),
        (deny(SECRET), "level=secret area=north", False),
        (deny(SECRET), "level=public", True),
        (deny(SECRET), "", True),
    ],
)
def test_data_tags(rules: str, tags: str, allowed: bool) -> None:
    default = "ALLOW" if rules.startswith("<deny") else "DENY"
    assert decision(rules, tags=tags, default=default).allowed is allowed


def test_each_kind_has_its_own_criteria() -> None:
    held = grant(allow(criterion("publish", "P"), criterion("subscribe", "S"), criterion("relay", "R")))
    allowed = {
        (kind.value, topic): decide(held, domain_id=0, kind=kind, topic=topic).allowed
        for kind in ActionKind
        for topic in "PSR"
    }
    assert {pair for pair, is_allowed in allowed.items() if is_allowed} == {
        ("publish", "P"),
        ("subscribe", "S"),
        ("relay", "R"),
    }


@pytest.mark.parametrize(
    ("domains", "tag", "allowed"),
    [
        ("<id>0</id>", "", True),
        ("<id>0</id>", "red", True),  # 1.1 knows no tags: its documents are for all of them
        ("<id>0</id><tag>red</tag>", "red", True),
        ("<id>0</id><tag>red</tag>", "", False),
        ("<id>0</id><tag>r*</tag>", "red", False),
        ("<id>0</id><tag>r*</tag>", "r*", True),
        ("<id>0</id><tag_expression>r*</tag_expression>", "red", True),
        ("<id>1</id><tag>red</tag>", "red", False),
        ("<tag>blue</tag><tag>red</tag>", "red", True),
        ("<tag></tag>", "", True),
        ("<tag></tag>", "red", False),
    ],
)
def test_domain_tags(domains: str, tag: str, allowed: bool) -> None:
    held = grant(rule("allow", PUBLISH_SQUARE, domains=domains))
    assert decide(held, domain_id=0, kind=ActionKind.PUBLISH, topic="Square", domain_tag=tag).allowed is allowed
    assert decide_participant(held, domain_id=0, domain_tag=tag).allowed is allowed


# --- topics and participants -------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("rules", "default", "allowed"),
    [
        (allow(PUBLISH_SQUARE), "DENY", True),
        (allow(criterion("subscribe", "Square")), "DENY", True),
        (allow(criterion("relay", "Square")), "DENY", True),
        (allow(criterion("publish", "Circle")), "DENY", False),
        (allow(IN_A), "DENY", True),  # some partition is enough for a topic
        (deny(PUBLISH_SQUARE), "DENY", False),
        (deny(PUBLISH_SQUARE), "ALLOW", True),  # it may subscribe
        (deny(PUBLISH_SQUARE, criterion("subscribe", "*"), criterion("relay", "*")), "ALLOW", False),
        (deny(IN_A), "ALLOW", True),
        ("", "ALLOW", True),
    ],
)
def test_a_topic_may_be_made_by_whoever_may_use_it_somehow(rules: str, default: str, allowed: bool) -> None:
    assert decide_topic(grant(rules, default=default), domain_id=0, topic="Square").allowed is allowed


@pytest.mark.parametrize(
    ("rules", "default", "allowed"),
    [
        ("", "DENY", False),
        ("", "ALLOW", True),
        (allow(), "DENY", True),
        (allow(PUBLISH_SQUARE), "DENY", True),
        (deny(), "ALLOW", False),  # without criteria it denies the domain
        (deny(PUBLISH_SQUARE), "ALLOW", True),
        (deny(PUBLISH_SQUARE), "DENY", False),
        (deny(PUBLISH_SQUARE) + allow(), "DENY", True),
        (deny() + allow(), "ALLOW", False),  # the first for the domain decides; with RTI before 6.1.1 it was the last
        (allow() + deny(), "DENY", True),
        (rule("allow", domains="<id>1</id>"), "DENY", False),
        (rule("deny", domains="<id>1</id>"), "ALLOW", True),
    ],
)
def test_who_may_join_a_domain(rules: str, default: str, allowed: bool) -> None:
    assert decide_participant(grant(rules, default=default), domain_id=0).allowed is allowed


# --- the derivation ------------------------------------------------------------------------------------------------


def test_a_refusal_names_document_rule_line_and_the_missing_right() -> None:
    refused = decision(allow(criterion("publish", "Square", "Circle")), "Foo", partitions=("p",)).refusal
    assert refused == Refused(
        "permissions alice.p7s, grant 'alice' (line 4): no allow rule lets it publish topic 'Foo' in partition 'p' of "
        "domain 0; the nearest, at line 10, allows topics 'Square', 'Circle'. Missing right: publish 'Foo' in "
        "partition 'p'"
    )


@pytest.mark.parametrize(
    ("rules", "nearest"),
    [
        ("", "it has no allow rule"),
        (deny(criterion("publish", "Circle")), "it has no allow rule"),
        (rule("allow", PUBLISH_SQUARE, domains="<id>7</id>"), "the nearest, at line 10, is for domains 7"),
        (allow(criterion("subscribe", "Square")), "the nearest, at line 10, lets it subscribe, not publish"),
        (allow(IN_A), "the nearest, at line 10, allows the topic in partitions 'A'"),
        (
            allow(criterion("publish", "Circle", "Squares")),
            "the nearest, at line 10, allows topics 'Circle', 'Squares'",
        ),
        # of several, the one whose topic is spelt most alike
        (
            allow("\n" + criterion("publish", "Disk"), "\n" + criterion("publish", "Sqare")),
            "the nearest, at line 12, allows",
        ),
        # a topic that fits is nearer than a kind that fits, and that nearer than a domain
        (
            rule("allow", PUBLISH_SQUARE, domains="<id>7</id>")
            + allow("\n" + criterion("publish", "X"), "\n" + IN_A, criterion("subscribe", "Square")),
            "the nearest, at line 12, allows the topic in partitions 'A'",
        ),
    ],
)
def test_a_refusal_tells_what_comes_nearest(rules: str, nearest: str) -> None:
    assert f"of domain 0; {nearest}" in decision(rules).reason


def test_steps_lead_to_the_decision_line_by_line() -> None:
    found = decision(
        rule("allow", PUBLISH_SQUARE, domains="<id>1</id>")
        + "\n"
        + deny(criterion("publish", "Circle"))
        + "\n"
        + allow("\n" + criterion("subscribe", "*"), "\n" + IN_A, "\n" + PUBLISH_SQUARE)
    )
    assert [str(step) for step in found.steps] == [
        "alice.p7s:10: allow_rule: is for domains 1",
        "alice.p7s:11: deny_rule, publish: topic 'Square' is none of 'Circle'",
        "alice.p7s:13: allow_rule, subscribe: is about subscribe, not publish",
        "alice.p7s:14: allow_rule, publish: covers partitions 'A', not partition ''",
        "alice.p7s:15: allow_rule, publish: applies, and decides",
    ]
    assert [step.applies for step in found.steps] == [False, False, False, False, True]
    assert found.reason == (
        "permissions alice.p7s, grant 'alice' (line 4): the allow_rule in line 12, by line 15, lets it publish topic "
        "'Square' of domain 0"
    )
    assert found.refusal is None


def test_a_deny_rule_is_named() -> None:
    assert decision(deny(PUBLISH_SQUARE)).reason == (
        "permissions alice.p7s, grant 'alice' (line 4): the deny_rule in line 10, by line 10, forbids it to publish "
        "topic 'Square' of domain 0"
    )


def test_hostile_names_are_not_repeated_at_length() -> None:
    topic, partitions = "T" * 60_000, tuple(f"{'P' * 200}{number}" for number in range(200))
    found = decision(allow(PUBLISH_SQUARE), topic, partitions=partitions)
    assert not found.allowed
    assert len(found.reason) < 2000
    assert sum(len(str(step)) for step in found.steps) < 2000


# --- which grant -----------------------------------------------------------------------------------------------------


def chosen(xml: bytes, *, subject: str = "O=Tests,CN=alice", now: int = NOW) -> str:
    """The name of the grant, or why there is none."""
    found = Permissions.parse(xml, name="p.p7s").grant_for(SubjectName.parse(subject), now)
    return found.reason if isinstance(found, Refused) else found.name


SECOND = """
    <grant name="second">
      <subject_name>{subject}</subject_name>
      <validity><not_before>2020-01-01T00:00:00</not_before><not_after>2037-01-01T00:00:00</not_after></validity>
      <default>ALLOW</default>
    </grant>"""


def test_the_first_grant_for_the_subject_is_chosen() -> None:
    assert chosen(permissions_xml()) == "alice"
    assert chosen(permissions_xml(more=SECOND.format(subject="CN=bob"))) == "alice"
    assert chosen(permissions_xml(more=SECOND.format(subject="CN=bob")), subject="CN=bob") == "second"
    assert chosen(permissions_xml(more=SECOND.format(subject="CN=alice,O=Tests"))) == "alice"


def test_without_a_grant_for_the_subject_those_that_there_are_are_named() -> None:
    assert chosen(permissions_xml(), subject="CN=mallory") == (
        "permissions p.p7s: no grant is for the subject CN=mallory; there are grants for CN=alice,O=Tests"
    )


def test_an_expired_grant_is_not_replaced_by_a_later_one() -> None:
    """As Cyclone DDS does; Fast DDS would go on to the second."""
    reason = chosen(permissions_xml(end="2026-01-01T00:00:00Z", more=SECOND.format(subject="CN=alice,O=Tests")))
    assert reason == (
        "permissions p.p7s, grant 'alice' (line 4) expired at 2026-01-01T00:00:00Z; the one in line 13 is valid, but "
        "the first for a name decides"
    )


def test_a_grant_is_valid_from_its_begin_to_before_its_end() -> None:
    xml = permissions_xml(begin="2026-01-01T00:00:00Z", end="2026-01-01T00:00:10Z")
    begin, second = parse_instant("2026-01-01T00:00:00Z"), 1_000_000_000
    assert "is not valid before 2026-01-01T00:00:00Z" in chosen(xml, now=begin - 1)
    assert chosen(xml, now=begin) == "alice"
    assert chosen(xml, now=begin + 10 * second - 1) == "alice"
    assert chosen(xml, now=begin + 10 * second).endswith(
        "expired at 2026-01-01T00:00:10Z; it needs other dates, and to be signed anew: `ddsi keystore permissions`"
    )


def test_a_subject_name_expression_is_matched() -> None:
    xml = (
        permissions_xml()
        .replace(b"subject_name>", b"subject_name_expression>")
        .replace(b"CN=alice,O=Tests", b"CN=*,O=Tests")
    )
    assert chosen(xml, subject="CN=anybody,O=Tests") == "alice"
    assert "no grant is for" in chosen(xml, subject="CN=anybody,O=Others")


INSTANTS = {
    "1970-01-01T00:00:00": 0,
    "1970-01-01T00:00:00Z": 0,
    "1970-01-01T00:00:01.5Z": 1_500_000_000,
    "1970-01-01T00:00:00.000000001": 1,
    "1970-01-01T00:00:00.0000000019": 1,
    "1970-01-01T01:00:00+01:00": 0,
    "1969-12-31T18:30:00-05:30": 0,
    "1969-12-31T23:59:59Z": -1_000_000_000,
    "2038-01-19T03:14:08Z": 2_147_483_648_000_000_000,
    "9999-12-31T23:59:59Z": 253_402_300_799_000_000_000,
    "2024-02-29t12:00:00z": 1_709_208_000_000_000_000,
}


@pytest.mark.parametrize(("text", "instant"), INSTANTS.items())
def test_instants_are_read_to_the_nanosecond_in_any_zone(text: str, instant: int) -> None:
    assert parse_instant(text) == instant


@pytest.mark.parametrize(
    "text",
    ["", "2026-01-01", "2026-01-01 00:00:00", "2026-13-01T00:00:00", "2026-02-29T00:00:00", "2026-01-01T24:00:00", "x",
     "2026-01-01T00:00:60", "2026-01-01T00:00:00+15:00", "2026-01-01T00:00:00+01:60", "2026-01-01T00:00:00.",
     "2026-01-01T00:00:00Zulu", "26-01-01T00:00:00", "0000-01-01T00:00:00", "\u0662026-01-01T00:00:00",
     "2026-01-01T00:00:00." + "1" * 30],
)  # fmt: skip
def test_what_is_no_instant_is_refused(text: str) -> None:
    with pytest.raises(ValueError):
        parse_instant(text)
