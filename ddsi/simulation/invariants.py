"""What must hold in every run, whatever the network did: checked after each simulated scenario.

Each function looks at a domain and returns what is wrong, in words; an empty list is what everybody hopes for.  Some
hold at any moment, others only once nothing is written any more and the network lets things through (*at rest*).

1. No sample twice, none out of order, none that is for another, and each as it was written (any moment).
2. A reliable reader holds exactly what its matched writers hold or held for it since the match (at rest).
3. Memory is bounded (any moment), and given back (at rest).
4. Whoever fits is matched, on both sides, and nobody else (at rest).
5. When nothing is written, nothing is sent but announcements of participants (at rest).
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Iterator

from ..behavior.filtering_writer import FilteringWriter
from ..behavior.stateful_writer import StatefulWriter
from ..engine import LocalWriter
from ..messages.fast import DATA_BODY
from ..messages.raw_submessage import SubmessageKind, iterate_submessages
from ..structure.builtin_entity_ids import SPDP_WRITER
from ..structure.cache_change import CacheChange, ChangeKind
from ..structure.guid import GUID_UNKNOWN, Guid
from ..structure.qos_policies import KeepAll, KeepLast
from ..structure.status import PublicationMatched
from .domain import Domain
from .endpoints import NodeReader, NodeWriter
from .node import Node

__all__ = ["always", "at_rest", "complete", "in_order", "is_at_rest", "matched", "memory_bounded", "quiet"]

_SLACK = 1  # a bound is checked before something is added


def always(domain: Domain) -> list[str]:
    """What holds at any moment."""
    return [*in_order(domain), *memory_bounded(domain)]


def at_rest(domain: Domain) -> list[str]:
    """What holds once :func:`is_at_rest`; does not let time pass."""
    return [*always(domain), *matched(domain), *complete(domain), *memory_released(domain)]


# --- samples ---------------------------------------------------------------------------------------------------


def in_order(domain: Domain) -> list[str]:
    """Of each writer, a reader gets ascending numbers, and what stands behind each is what was written."""
    writers = {writer.guid: writer for node in domain.nodes for writer in node.writers}
    wrong: list[str] = []
    for node in domain.nodes:
        for reader in node.readers:
            for guid, sessions in reader.sessions.items():
                for session in sessions:
                    wrong.extend(_session_flaws(reader, writers[guid], session.changes))
            wrong.extend(_taking_flaws(reader))
    return wrong


def _session_flaws(reader: NodeReader, writer: NodeWriter, changes: list[CacheChange]) -> Iterator[str]:
    previous = 0
    for change in changes:
        number = change.sequence_number
        if number <= previous:
            yield f"{_pair(writer, reader)}: {number} came after {previous}"
        previous = number
        original = writer.written.get(number)
        if original is None:
            yield f"{_pair(writer, reader)}: {number} was never written"
        elif not _is_same(change, original):
            yield f"{_pair(writer, reader)}: {number} is not as it was written"
        elif original.destination not in (GUID_UNKNOWN, reader.guid, reader.guid.participant):
            yield f"{_pair(writer, reader)}: {number} was for another"


def _is_same(received: CacheChange, original: CacheChange) -> bool:
    """Kind, key and octets.  A submessage is padded to a multiple of 4, so zeros may follow the payload; short keys are
    filled up with more of them.  Some vendors send no payload with the end of an instance."""
    if (received.kind, received.key) != (original.kind, original.key):
        return False
    if not received.payload and received.kind is not ChangeKind.ALIVE:
        return True
    size = len(original.payload)
    if bytes(received.payload[:size]) != original.payload or any(received.payload[size:]):
        return False
    return len(received.payload) - size < 4 or received.kind is not ChangeKind.ALIVE


def _taking_flaws(reader: NodeReader) -> Iterator[str]:
    """A KEEP_ALL reader's application gets each sample that its history accepted, once, but for what expired before."""
    if not reader.takes or reader.is_deleted or not isinstance(reader.local.data.qos.history, KeepAll):
        return
    taken = Counter(
        (bytes(change.writer_guid), change.sequence_number) for info, change in reader.taken if info.valid_data
    )
    given = [
        change
        for sessions in reader.sessions.values()
        for session in sessions
        for change in session.changes
        if change.kind is ChangeKind.ALIVE
    ]
    # A best-effort reader without room accepts a sample only to reject it.
    rejected = 0 if reader.local.data.qos.is_reliable else reader.local.rejected.total_count
    missing = len(given) - taken.total() - rejected
    may_expire = sum(change.expiry < math.inf for change in given)
    surplus = taken - Counter((bytes(change.writer_guid), change.sequence_number) for change in given)
    if surplus or not 0 <= missing <= may_expire:
        yield f"{reader.topic} at {reader.node.name}: {taken.total()} samples taken of {len(given)} received"


def complete(domain: Domain) -> list[str]:
    """A reliable reader has all that its writer wrote since they matched (or holds as history), but for what
    KEEP_LAST or LIFESPAN have since removed."""
    wrong: list[str] = []
    for writer, reader in domain.fitting_pairs():
        if writer.local.data.qos.is_reliable and reader.local.data.qos.is_reliable:
            wrong.extend(_gaps(writer, reader))
    return wrong


def _gaps(writer: NodeWriter, reader: NodeReader) -> Iterator[str]:
    behavior = writer.local.behavior
    proxy = behavior.readers.get(reader.guid) or behavior.local_readers.get(reader.guid)
    if proxy is None:
        return  # reported by `matched`
    received = {number for session in reader.sessions.get(writer.guid, []) for number in session.numbers}
    replaceable = _replaceable(writer)
    missing = [
        number
        for number, change in writer.written.items()
        if number > proxy.history_sn
        and number not in received
        and number not in replaceable
        and proxy.is_relevant(change)
    ]
    if missing:
        yield f"{_pair(writer, reader)}: {_some(missing)} never came, of {len(writer.written)}"
    session = reader.session(writer.guid).numbers
    early = [number for number in session if number <= proxy.history_sn]
    if early and not writer.local.data.qos.is_transient_local and not _may_be_early(writer, reader):
        yield f"{_pair(writer, reader)}: {_some(early)} came, which were written before the match"


def _may_be_early(writer: NodeWriter, reader: NodeReader) -> bool:
    """Samples to another reader at the same address, of this participant or one that was there before, may have been
    under way when the pair matched.  And where the writer lost the reader for a while and the reader never noticed, its
    session began earlier."""
    has_neighbour = any(other is not reader and other.topic == writer.topic for other in reader.node.readers)
    return has_neighbour or _match_count(writer, reader) > 1


def _match_count(writer: NodeWriter, reader: NodeReader) -> int:
    """How often the writer found this reader."""
    return sum(
        entity == writer.guid
        and isinstance(status, PublicationMatched)
        and status.last_subscription_handle == reader.guid
        and status.current_count_change > 0
        for _, entity, status in writer.node.statuses
    )


def _replaceable(writer: NodeWriter) -> set[int]:
    """Numbers that the writer need not have sent: its history had moved on.  Asked for membership only."""
    qos = writer.local.data.qos
    if qos.lifespan.duration != float("inf"):
        return set(writer.written)
    if not isinstance(qos.history, KeepLast):
        return set()
    of_instance: dict[bytes, list[int]] = {}
    for number, change in writer.written.items():
        of_instance.setdefault(change.key, []).append(number)
    return {number for numbers in of_instance.values() for number in numbers[: -qos.history.depth]}


# --- memory ----------------------------------------------------------------------------------------------------


def memory_bounded(domain: Domain) -> list[str]:
    """No buffer of any engine is above its bound."""
    return [f"{node.name}: {flaw}" for node in domain.live_nodes() for flaw in _bound_flaws(node)]


def _bound_flaws(node: Node) -> Iterator[str]:
    engine = node.engine
    config = engine.config
    if len(engine.participants) > config.max_participants:
        yield f"{len(engine.participants)} participants"
    if len(engine.known_writers) + len(engine.known_readers) > config.max_endpoints:
        yield f"{len(engine.known_writers) + len(engine.known_readers)} endpoints"
    for reader in engine.local_readers.values():
        for proxy in reader.behavior.writers.values():
            if len(proxy.reorder) > config.max_reorder_samples + _SLACK:
                yield f"{len(proxy.reorder)} samples wait for their turn in {reader.guid}"
    if engine.defrag_budget.octets > config.max_defrag_octets:
        yield f"{engine.defrag_budget.octets} octets of unfinished samples"
    counted = engine.defrag_budget.octets + engine.stateless_defrag_budget.octets
    if counted != sum(remote.defragmenter.octets for remote in engine.remote_writers.values()):
        yield f"{counted} octets of unfinished samples are counted wrongly"
    for writer in engine.local_writers.values():
        yield from _history_flaws(writer)


def _history_flaws(writer: LocalWriter) -> Iterator[str]:
    cache, qos = writer.behavior.cache, writer.data.qos
    held = cache.changes()
    if cache.octets != sum(len(change.payload) for change in held):
        yield f"{writer.guid} counts {cache.octets} octets in its history, wrongly"
    if isinstance(qos.history, KeepLast):
        per_instance: dict[bytes, int] = {}
        for change in held:
            per_instance[change.key] = per_instance.get(change.key, 0) + 1
        most = max(per_instance.values(), default=0)
        if most > qos.history.depth:
            yield f"{writer.guid} holds {most} changes of one instance, depth {qos.history.depth}"


def memory_released(domain: Domain) -> list[str]:
    """At rest nothing waits anywhere, and a volatile writer holds no samples any more."""
    return [f"{node.name}: {flaw}" for node in domain.live_nodes() for flaw in _leftovers(node)]


def _leftovers(node: Node) -> Iterator[str]:
    engine = node.engine
    for reader in engine.local_readers.values():
        for guid, proxy in reader.behavior.writers.items():
            if len(proxy.reorder) or proxy.reorder:
                yield f"{reader.guid} still holds back {len(proxy.reorder)} samples of {guid}"
    for remote in engine.remote_writers.values():
        # Best effort, nobody asks for the rest: an unfinished sample stays until a later one has come.
        if len(remote.defragmenter) and remote.is_reliable:
            yield f"{len(remote.defragmenter)} unfinished samples of {remote.guid}"
    for writer in engine.local_writers.values():
        cache = writer.behavior.cache
        if len(cache) and not writer.data.qos.is_transient_local:
            yield f"volatile {writer.guid} still holds {len(cache)} changes"
        if cache.unacknowledged_octets and not isinstance(writer.behavior, FilteringWriter):  # it does not count them
            yield f"{writer.guid} counts {cache.unacknowledged_octets} unacknowledged octets"
        if writer.behavior.in_flight_octets:
            yield f"{writer.guid} counts {writer.behavior.in_flight_octets} octets in flight"
    if engine.closing:
        yield f"{len(engine.closing)} writers still linger"


# --- matching and silence --------------------------------------------------------------------------------------


def matched(domain: Domain) -> list[str]:
    """Everybody knows everybody, and exactly the pairs that fit are matched."""
    wrong = []
    if not domain.are_introduced():
        known = {node.name: len(node.engine.participants) for node in domain.live_nodes()}
        wrong.append(f"not everybody knows everybody: {known}")
    if not domain.all_matched():
        wrong.extend(_unmatched(domain))
    return wrong


def _unmatched(domain: Domain) -> Iterator[str]:
    for writer, reader in domain.fitting_pairs():
        behavior = writer.local.behavior
        if reader.guid not in behavior.readers and reader.guid not in behavior.local_readers:
            yield f"{_pair(writer, reader)}: the writer has not matched"
        if writer.guid not in reader.local.behavior.writers:
            yield f"{_pair(writer, reader)}: the reader has not matched"
    endpoints: list[NodeWriter | NodeReader] = [*domain.writers(), *domain.readers()]
    for endpoint in endpoints:
        fitting = sum(endpoint in pair for pair in domain.fitting_pairs())
        if endpoint.matched_count != fitting:
            yield f"{endpoint}: {endpoint.matched_count} matched, {fitting} fit"


def is_at_rest(domain: Domain) -> bool:
    """Is nothing under way: everything acknowledged, nobody about to ask or to repeat anything?"""
    return all(
        all(_is_settled(writer.behavior) for writer in node.engine.local_writers.values())
        and all(
            proxy.schedule.due == float("inf")
            for reader in node.engine.local_readers.values()
            for proxy in reader.behavior.writers.values()
        )
        and not node.engine.closing
        for node in domain.live_nodes()
    )


def _is_settled(writer: StatefulWriter) -> bool:
    return writer.heartbeat.due == float("inf") and writer.next_unsent_sn > writer.cache.last_sn


def quiet(domain: Domain, seconds: float) -> list[str]:
    """Let time pass: nothing but announcements may be sent, and no more of these than their period says."""
    announced: dict[Guid, int] = {}
    others: list[str] = []

    def watch(sender: bytes, octets: bytes) -> None:
        guid = Guid(sender + b"\0\0\x01\xc1")
        if is_announcement(octets):
            announced[guid] = announced.get(guid, 0) + 1
        else:
            others.append(f"{domain.now:.3f} s: {_names(octets)} from {_node_name(domain, guid)}")

    timeouts = {node.guid: node.timeout_count for node in domain.live_nodes()}
    domain.network.watch = watch
    domain.run(seconds)
    domain.network.watch = None
    wrong = [f"{len(others)} messages in a quiet time, the first at {others[0]}"] if others else []
    for node in domain.live_nodes():
        # The first announcements come in quick succession; so do a few calls to each participant that was lost.
        most = seconds / node.engine.config.announcement_period * 1.2 + 6 + 16 * len(domain.nodes)
        if announced.get(node.guid, 0) > most:
            wrong.append(f"{node.name} announced itself {announced[node.guid]} times in {seconds} s")
        # Besides announcing, leases are looked at now and then.
        woken = node.timeout_count - timeouts.get(node.guid, 0)
        if woken > 2 * most + len(domain.nodes) * seconds:
            wrong.append(f"{node.name} woke up {woken} times in {seconds} s, for nothing")
    return wrong


def is_announcement(octets: bytes) -> bool:
    """Is this message SPDP and nothing else?"""
    kinds = list(iterate_submessages(octets))
    return all(raw.kind == SubmessageKind.DATA and DATA_BODY.unpack_from(raw.body)[3] == SPDP_WRITER for raw in kinds)


def _names(octets: bytes) -> str:
    return " ".join(SubmessageKind(raw.kind).name for raw in iterate_submessages(octets))


def _node_name(domain: Domain, guid: Guid) -> str:
    return next((node.name for node in domain.nodes if node.guid == guid), str(guid))


def _pair(writer: NodeWriter, reader: NodeReader) -> str:
    return (
        f"{writer.topic} from {writer.node.name} ({writer.guid.entity_id}) "
        f"to {reader.node.name} ({reader.guid.entity_id})"
    )


def _some(numbers: list[int]) -> str:
    shown = ", ".join(map(str, numbers[:8]))
    return f"{shown} and {len(numbers) - 8} more" if len(numbers) > 8 else shown
