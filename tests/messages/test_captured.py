"""What other vendors really send, octet by octet: every submessage is read, and written again as it was."""

from __future__ import annotations

import zlib
from collections import Counter

import pytest

from ddsi.messages.header import HEADER_LENGTH, Header
from ddsi.messages.receiver import MessageReceiver
from ddsi.messages.submessages import (
    Data,
    DataFrag,
    Opaque,
    SubmessageKind,
    Unknown,
    decode_submessage,
    iterate_submessages,
)
from ddsi.serialization import Encapsulation, ParameterId, Reader, decode_encapsulation
from ddsi.structure.guid import Guid
from tests.captures.capture import PLAIN, SECURED, load


def test_captures_are_there() -> None:
    assert (len(PLAIN), len(SECURED)) == (21, 25)


@pytest.mark.parametrize("name", PLAIN + SECURED)
def test_every_submessage_is_written_as_it_was_read(name: str) -> None:
    """Without an exception: all these stacks write the one canonical form of each submessage."""
    capture = load(name)
    counts = capture.facts["counts"]
    assert (len(capture.datagrams), capture.others) == (counts["rtps_datagrams"], counts.get("not_rtps_datagrams", 0))
    for datagram in capture.datagrams:
        assert Header.decode(datagram).encode() == datagram[:HEADER_LENGTH]
        end = HEADER_LENGTH
        for raw in iterate_submessages(datagram):
            again = decode_submessage(raw).encode(little_endian=raw.little_endian)
            assert again == datagram[raw.offset : raw.end]
            end = raw.end
        assert end == len(datagram)


@pytest.mark.parametrize("name", PLAIN + SECURED)
def test_kinds_that_are_unknown_are_vendors_own(name: str) -> None:
    for datagram in load(name).datagrams:
        for submessage, state in MessageReceiver(datagram):
            if isinstance(submessage, Unknown):
                assert (submessage.kind, state.source_vendor_id) == (0x80, b"\x01\x0f"), "Fast DDS tells its statistics"
            elif isinstance(submessage, Opaque):
                assert name in SECURED


@pytest.mark.parametrize("name", PLAIN)
def test_headers_name_the_participants(name: str) -> None:
    facts = load(name).facts
    announced = {(Guid(bytes.fromhex(peer["guid"])).prefix, peer["vendor_id"], peer["rtps"]) for peer in facts["guids"]}
    found = set()
    for datagram in load(name).datagrams:
        header = Header.decode(datagram)
        major, minor = header.protocol_version
        found.add((header.guid_prefix, header.vendor_id.hex(), f"{major}.{minor}"))
    assert found == announced


@pytest.mark.parametrize("name", PLAIN)
def test_samples_are_those_that_were_written(name: str) -> None:
    facts = load(name).facts
    joined: dict[tuple[Guid, int], bytearray] = {}
    samples: dict[tuple[Guid, int], str] = {}
    disposed: set[tuple[Guid, int]] = set()
    for datagram in load(name).datagrams:
        for submessage, state in MessageReceiver(datagram):
            if not isinstance(submessage, (Data, DataFrag)) or submessage.writer_id.is_builtin:
                continue
            change = Guid.of(state.source_guid_prefix, submessage.writer_id), submessage.writer_sn
            # All these stacks say when a sample was written; Cyclone only with the first of its fragments.
            is_first = not isinstance(submessage, DataFrag) or submessage.fragment_starting_num == 1
            assert not is_first or state.timestamp is not None
            if isinstance(submessage, DataFrag):
                whole = joined.setdefault(change, bytearray(submessage.sample_size))
                run = slice(submessage.run_start, submessage.run_start + submessage.run_length)
                whole[run] = submessage.serialized_payload[: submessage.run_length]
            elif submessage.is_key or not submessage.serialized_payload:
                assert submessage.inline_qos is not None
                assert submessage.inline_qos.get(ParameterId.STATUS_INFO) == b"\0\0\0\1"
                disposed.add(change)
            else:
                samples[change] = sample_line(facts["type"], submessage.serialized_payload)
    samples.update((change, sample_line(facts["type"], whole)) for change, whole in joined.items())
    written = [line for peer in facts["peers"] for line in peer.get("wrote", ())]
    assert [samples[change] for change in sorted(samples)] == written
    assert len(disposed) == facts["counts"].get("key_only_changes", 0)


def sample_line(type_name: str, payload: bytes | bytearray | memoryview) -> str:
    """The sample as the JSON files write it.  These types are laid out alike in XCDR1 and XCDR2."""
    encapsulation = decode_encapsulation(payload).encapsulation
    assert encapsulation in (Encapsulation.CDR_LE, Encapsulation.CDR2_LE)
    reader = Reader(payload, little_endian=True, start=4)
    if type_name == "Blob":
        number, octets = reader.u32(), reader.octet_sequence()
        return f"{number} {len(octets)} {zlib.crc32(octets):08x}"
    color = reader.string()
    reader.align(4)
    return f"{color} {reader.i32()} {reader.i32()} {reader.i32()}"


@pytest.mark.parametrize("name", SECURED)
def test_envelopes_come_in_their_order(name: str) -> None:
    """DDS-Security 1.1 §7.3.6: PREFIX, one submessage, POSTFIX; SRTPS_PREFIX is first and its POSTFIX last, but
    for what Fast DDS adds behind it."""
    counts = load(name).facts["counts"]
    seen: Counter[str] = Counter()
    for datagram in load(name).datagrams:
        kinds = [raw.kind for raw in iterate_submessages(datagram)]
        for index, kind in enumerate(kinds):
            if kind == SubmessageKind.SEC_PREFIX:
                assert kinds[index + 2] == SubmessageKind.SEC_POSTFIX
                seen["triples"] += 1
            elif kind == SubmessageKind.SRTPS_PREFIX:
                assert index == 0
                postfix = kinds.index(SubmessageKind.SRTPS_POSTFIX)
                assert set(kinds[postfix + 1 :]) <= {0x80}
                seen["messages"] += 1
                seen["more behind"] += postfix + 1 < len(kinds)
    assert seen["messages"] == counts.get("rtps_messages", 0)
    assert seen["more behind"] == counts.get("rtps_messages_with_more_behind", 0)
    if not seen["messages"]:
        protected = ("datawriter_submessages", "datareader_submessages", "info_ts_submessages", "volatile_submessages")
        assert seen["triples"] == sum(counts.get(kind, 0) for kind in protected)


def test_protected_fragment_is_longer_than_its_run() -> None:
    longer = 0
    for datagram in load("sec-data-fragments-cyclone-cyclone").datagrams:
        for submessage, _ in MessageReceiver(datagram):
            if isinstance(submessage, DataFrag) and not submessage.writer_id.is_builtin:
                longer += len(submessage.serialized_payload) > submessage.run_length + 3
    assert longer == load("sec-data-fragments-cyclone-cyclone").facts["counts"]["fragment_payloads"]
