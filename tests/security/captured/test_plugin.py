"""Our crypto plugin opens all that real vendors sent each other, and notices each octet that was changed."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator

import pytest

from ddsi.messages.raw_submessage import SubmessageKind
from ddsi.spi import NOT_FOR_US, NoKeys, NotForUs, Outcome
from ddsi.structure.guid import Guid
from tests.captures.capture import SECURED, load
from tests.security.captured.role import Opened, played, roles
from tests.security.captured.straight import INFO_TS, submessages
from tests.security.captured.whole import decoded, sample_line

FOR_SOMEBODY_ELSE = "sec-alloa-three-cyclone"
"""Here a message may be for one of two, and the other sees that it bears no MAC for it."""


def all_opened(name: str) -> Iterator[tuple[int, Opened]]:
    """With the numbers of their datagrams; what several opened, several times."""
    for role in played(name):
        for number, entries in role.opened.items():
            yield from ((number, opened) for opened in entries)


@pytest.mark.parametrize("name", SECURED)
def test_every_envelope_is_opened_and_counted(name: str) -> None:
    """What is for several counts once; MACs, each of which is for one receiver, count one by one."""
    envelopes = {(number, opened.kind, opened.position): opened for number, opened in all_opened(name)}
    counts = Counter(kind for _, kind, _ in envelopes)
    counts["payloads"] += counts["fragment_payloads"]
    for (_, kind, _), opened in envelopes.items():
        if kind.endswith("_submessages") and opened.plain[0] == INFO_TS:
            counts["info_ts_submessages_volatile" if kind.startswith("volatile") else "info_ts_submessages"] += 1
    counts["datawriter_submessages"] -= counts["info_ts_submessages"]
    counts["receiver_macs"] = sum(opened.has_receiver_mac for _, opened in all_opened(name))
    expected = load(name).facts["counts"]
    assert {kind: count for kind, count in counts.items() if count} == {
        kind: expected[kind]
        for kind in (
            "rtps_messages",
            "datawriter_submessages",
            "datareader_submessages",
            "info_ts_submessages",
            "volatile_submessages",
            "info_ts_submessages_volatile",
            "payloads",
            "fragment_payloads",
            "receiver_macs",
        )
        if kind in expected
    }


@pytest.mark.parametrize("name", SECURED)
def test_nothing_is_refused(name: str) -> None:
    refused = {outcome for role in played(name) for _, outcome in role.refused}
    assert refused == ({NOT_FOR_US} if name == FOR_SOMEBODY_ELSE else set())


@pytest.mark.parametrize("name", SECURED)
def test_what_comes_before_its_key_waits_for_it(name: str) -> None:
    """In the order of the wire, without having heard the keys before: NoKeys at most, and the samples all the same."""
    for role in roles(name):
        for number, datagram in enumerate(load(name).datagrams):
            role.hear(number, datagram)
        outcomes = {type(outcome) for _, outcome in role.refused}
        assert outcomes <= ({NoKeys, NotForUs} if name == FOR_SOMEBODY_ELSE else {NoKeys})
        assert role.changes == next(other.changes for other in played(name) if other.guid == role.guid)


@pytest.mark.parametrize("name", SECURED)
def test_tokens_are_those_that_were_sent(name: str) -> None:
    assert sorted(token for role in played(name) for token in role.tokens) == sorted(decoded(name).tokens)


@pytest.mark.parametrize("name", SECURED)
def test_subscribers_get_what_was_written(name: str) -> None:
    facts = load(name).facts
    written = [line for peer in facts["peers"] for line in peer.get("wrote", ())]
    subscribers = {Guid(bytes.fromhex(peer["guid"])): peer["samples"] for peer in facts["subscribers"]}
    for role in played(name):
        lines = [sample_line(facts["type"], role.changes[change]) for change in sorted(role.changes)]
        if role.guid in subscribers:
            assert set(subscribers[role.guid]) <= set(lines) <= set(written)
            assert lines == (written if name != FOR_SOMEBODY_ELSE else lines)
            assert len(role.key_only) == facts["counts"].get("key_only_changes", 0)
        else:
            assert lines == []


@pytest.mark.parametrize("name", SECURED)
def test_protected_writers_send_nothing_in_clear(name: str) -> None:
    facts = load(name).facts
    for role in played(name):
        users = [writer_id for writer_id in role.clear if not writer_id.is_builtin]
        assert users == [] or facts["governance"]["metadata"] == "NONE"


# --- tampering --------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("name", SECURED)
def test_a_changed_octet_is_noticed(name: str) -> None:
    """In the shortest envelope of each kind, for each of its receivers, octet by octet."""
    for role in played(name):
        shortest: dict[str, Opened] = {}
        for entries in role.opened.values():
            for opened in entries:
                if opened.kind not in shortest or len(opened.encoded) < len(shortest[opened.kind].encoded):
                    shortest[opened.kind] = opened
        for opened in shortest.values():
            assert opened.decode(opened.encoded) == opened.plain
            unnoticed = set(_unnoticed(opened))
            assert unnoticed <= set(_unprotected(opened)), opened.kind


def _unnoticed(opened: Opened) -> Iterator[int]:
    """Where a change makes no difference: none that it makes may pass for what was sent."""
    for position in range(len(opened.encoded)):
        changed = bytearray(opened.encoded)
        changed[position] ^= 1 << position % 8
        plain = opened.decode(bytes(changed))
        if not isinstance(plain, Outcome):
            assert plain == opened.plain
            yield position


def _unprotected(opened: Opened) -> Iterator[int]:
    """Octets that no MAC covers and that mean nothing."""
    octets = bytes(opened.encoded)
    position = 0
    if opened.kind.endswith("payloads"):
        yield from range(len(octets) - 3, len(octets))  # up to three that pad the submessage
        return
    if opened.kind == "rtps_messages":
        yield from range(8)  # "RTPS", version and vendor: those in the protected INFO_SRC are used
        position = 20
    for item in submessages(octets[position:]):
        end = position + len(item.octets)
        if item.kind >= SubmessageKind.SEC_BODY:
            yield position + 1  # flags, but for the byte order
        if item.kind == SubmessageKind.SEC_BODY:
            yield from range(position + 8 + int.from_bytes(item.body[:4], "big"), end)  # padding
        if item.kind in (SubmessageKind.SEC_POSTFIX, SubmessageKind.SRTPS_POSTFIX):
            # MACs for others, or where none is expected: whoever needs one, checks its own.
            count = int.from_bytes(item.body[16:20], "big")
            if count > 1 or not opened.has_receiver_mac:
                yield from range(position + 24, end)
        if item.kind == SubmessageKind.SRTPS_POSTFIX:
            yield from range(end, len(octets))  # what Fast DDS sends in clear
            return
        position = end
