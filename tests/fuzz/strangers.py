"""Strangers by the thousand: a stream of hostile datagrams from a seed, and how large every table is afterwards.

``python -m tests.fuzz strangers --datagrams 1000000`` runs a million of them and prints the tables and the memory;
``test_strangers.py`` runs some thousands.  Two engines hear them in turn: one without security, which is matched with a
friend that they leave alone and with a victim in whose name they speak; and one that has authenticated its peer.
"""

from __future__ import annotations

import argparse
import gc
import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from random import Random

from ddsi.config import Config
from ddsi.engine import LocalReader, Participant
from ddsi.messages.acknack import AckNack, NackFrag
from ddsi.messages.data import Data
from ddsi.messages.data_frag import DataFrag
from ddsi.messages.gap import Gap
from ddsi.messages.heartbeat import Heartbeat, HeartbeatFrag
from ddsi.messages.interpreter import InfoDestination, InfoSource
from ddsi.simulation.endpoints import SIMULATED_KEYS
from ddsi.structure import builtin_entity_ids as ids
from ddsi.structure.cache_change import ChangeKind
from ddsi.structure.guid import EntityId, EntityKind, GuidPrefix
from ddsi.structure.locator import Locator
from ddsi.structure.qos import Qos, reader_qos, writer_qos
from ddsi.structure.qos_policies import KeepAll, Partition, Reliable, TransientLocal
from ddsi.structure.sequence_number import NumberSet
from tests.engine.wire import VENDOR, Stranger, engine
from tests.fuzz.plain import captured_datagrams
from tests.fuzz.session import Ear, Session

__all__ = ["BOUNDS", "Flood", "Table", "main", "tables"]

RELIABLE = Qos(reliability=Reliable(), history=KeepAll())
HISTORY = RELIABLE | Qos(durability=TransientLocal())
BOUNDS = Config(
    max_participants=100,
    max_endpoints=400,
    max_instances=100,
    max_sample_size=1 << 18,
    max_defrag_octets=4 << 20,
    max_reorder_samples=128,
    reader_octets=1 << 20,
)
"""Small, so that the tables are full before long."""
ALL = EntityId.UNKNOWN
IDENTITIES = 200
"""Participants that strangers play: more than the table holds."""
OUR_WRITER, OUR_READER = EntityId(b"\0\0\1\3"), EntityId(b"\0\0\2\4")
NUMBERS = (1, 2, 3, 7, 255, 256, 1 << 31, 1 << 32, 1 << 61, (1 << 62) - 1, (1 << 63) - 1000)


@dataclass(frozen=True)
class Table:
    """Something that strangers can fill."""

    name: str
    size: int
    most: int


def tables(participant: Participant) -> list[Table]:
    """All of one engine's."""
    config = participant.config
    readers, writers = participant.local_readers.values(), participant.local_writers.values()
    to_writers = [proxy for reader in readers for proxy in reader.behavior.writers.values()]
    to_readers = [proxy for writer in writers for proxy in writer.behavior.readers.values()]
    endpoints = len(participant.known_writers) + len(participant.known_readers)
    builtin = 16 * config.max_participants
    histories = [reader.history for reader in readers if reader.history is not None]
    most_waiting = config.max_reorder_samples + 1
    timers = participant.alarms._timers
    hosts = [len(proxy._hosts) for proxy in participant.participants.values()]
    return [
        Table("participants", len(participant.participants), config.max_participants),
        Table("endpoints", endpoints, config.max_endpoints),
        Table("remote writers that are read", len(participant.remote_writers), config.max_endpoints + builtin),
        Table("pairs that do not fit", len(participant.matchmaker.refusals), config.max_endpoints * 2),
        Table("hosts of one participant", max(hosts, default=0), 8),
        Table("instances", max(len(history.instances) for history in histories), config.max_instances),
        Table("octets of samples", max(history.octets for history in histories), config.reader_octets + (1 << 16)),
        Table("samples out of order, of one pair", _most(len(p.reorder) for p in to_writers), most_waiting),
        Table("gaps ahead, of one pair", _most(len(p.reorder._range_starts) for p in to_writers), 513),
        Table("numbers asked for, of one pair", _most(len(p.schedule._asked) for p in to_writers), 1024),
        Table("numbers sent again, to one reader", _most(len(p._resent) for p in to_readers), 1024),
        Table("octets of fragments", participant.defrag_budget.octets, config.max_defrag_octets),
        Table("octets of stateless fragments", participant.stateless_defrag_budget.octets, 4 << 20),
        Table("lost participants that are called", len(participant.discovery._announcer._lost), 64),
        Table("timers", len(timers), 64 + 2 * (len(to_writers) + len(to_readers)) + 4 * config.max_participants),
        Table("entries in the heap of timers", len(timers._heap), 64 + 5 * len(timers)),
    ]  # fmt: skip


def _most(sizes: Iterator[int]) -> int:
    return max(sizes, default=0)


# --- who hears them -------------------------------------------------------------------------------------------------


class Flood:
    """Hostile datagrams one after the other.  ``plain`` and ``secured`` hear them; ``reader`` is the plain one's."""

    def __init__(self, seed: int) -> None:
        self._dice = Random(seed)
        self.friend, self.victim = Stranger(9001), Stranger(9002)
        participant = engine(config=BOUNDS)
        self.plain = Ear(participant)
        self.writer = participant.create_writer("Out", "T", writer_qos(HISTORY), 0.0, is_keyed=False)
        self.reader: LocalReader = participant.create_reader(
            "In", "T", reader_qos(RELIABLE), 0.0, is_keyed=False, keys=SIMULATED_KEYS
        )
        for number in range(20):
            participant.write(self.writer, ChangeKind.ALIVE, b"\0\1\0\0" + bytes(100 * number), b"k", 0.0)
        for peer in (self.friend, self.victim):
            self._introduce(peer)
        self.session = Session.make()
        self.secured = Ear(self.session.bob.engine)
        self._said = self.session.of_alice
        self._captured = list(captured_datagrams())
        self._strangers = [Stranger(number) for number in range(IDENTITIES)]
        self._count = 10
        self._kinds: list[tuple[int, Callable[[], bytes]]] = [
            (20, self._noise), (40, self._mutated), (20, self._announcement), (60, self._endpoint), (80, self._sample),
            (80, self._numbers), (80, self._fragment), (1, self._farewell), (5, self._of_many),
        ]  # fmt: skip
        self._sent_before = sum(self.plain.sent.values()), sum(self.secured.sent.values())
        self.octets = 0
        self.peaks: dict[str, list[Table]] = {}
        """The largest that each table was, of each engine."""

    def _introduce(self, peer: Stranger) -> None:
        for octets in (
            peer.spdp(lease_duration=1e9), peer.first_heartbeats(),
            peer.sedp_writer(1, "In", RELIABLE), peer.sedp_reader(1, "Out", HISTORY),
        ):  # fmt: skip
            self.plain.hear(octets, peer.address)

    def run(self, datagrams: int) -> None:
        """Three to the plain engine, one to the secured one."""
        weights = [weight for weight, _ in self._kinds]
        makers = [maker for _, maker in self._kinds]
        for number in range(datagrams):
            is_secured = number % 4 == 3
            octets = self._said_and_altered() if is_secured else self._dice.choices(makers, weights)[0]()
            self.octets += len(octets)
            ear = self.secured if is_secured else self.plain
            ear.hear(octets, self._source(), after=self._dice.choice((0.0001, 0.001, 0.01)))
            if number % 200 == 0:
                self._look()
                self._honest_life()
        self._look()

    def _look(self) -> None:
        """How large are the tables?  None may ever be larger than its bound."""
        for name, ear in (("without security", self.plain), ("secured", self.secured)):
            now = tables(ear.engine)
            for table in now:
                assert table.size <= table.most, table
            before = self.peaks.setdefault(name, now)
            self.peaks[name] = [max(pair, key=lambda table: table.size) for pair in zip(before, now, strict=True)]

    def _honest_life(self) -> None:
        """The friend speaks on, the victim comes back, and the application takes what there is now and then."""
        self.plain.hear(self.friend.spdp(lease_duration=1e9), self.friend.address)
        self.victim._sn.clear()
        self._introduce(self.victim)
        if self._dice.random() < 0.1 and self.reader.history is not None:
            self.reader.history.take()
            self.plain.engine.samples_taken(self.reader, self.plain.now)

    def is_friend_served(self) -> bool:
        """Is the friend known and matched, and does what it writes arrive?"""
        history = self.reader.history
        assert history is not None
        history.take()
        self.plain.engine.samples_taken(self.reader, self.plain.now)
        guid = self.friend.endpoint(1, is_writer=True)
        beat = Heartbeat(ALL, guid.entity_id, 1, 0, 1, final=True).encode()
        sample = Data(ALL, guid.entity_id, 1, None, b"\0\1\0\0k" + bytes(15)).encode()
        self.plain.hear(self.friend.message(beat, sample), self.friend.address)
        is_read = any(change.writer_guid == guid and change.sequence_number == 1 for _, change in history.take())
        return is_read and self.friend.endpoint(1, is_writer=False) in self.writer.behavior.readers

    def octets_sent(self) -> int:
        """By both, to whomever, since the flood began."""
        return sum(self.plain.sent.values()) + sum(self.secured.sent.values()) - sum(self._sent_before)

    # --- the dice --------------------------------------------------------------------------------------------

    def _source(self) -> Locator:
        return Locator.udp_v4(f"10.{self._dice.randrange(60, 64)}.{self._dice.randrange(256)}.1", 7410)

    def _someone(self) -> Stranger:
        return self.victim if self._dice.random() < 0.6 else self._dice.choice(self._strangers)

    def _next_count(self) -> int:
        self._count += 1
        return self._count

    def _number(self) -> int:
        return self._dice.choice(NUMBERS) if self._dice.random() < 0.05 else self._dice.randrange(1, 3000)

    def _set(self) -> NumberSet:
        return NumberSet(self._number(), 256, self._dice.getrandbits(256))

    # --- what they say ---------------------------------------------------------------------------------------

    def _noise(self) -> bytes:
        octets = self._dice.randbytes(self._dice.randrange(200))
        return octets if self._dice.random() < 0.3 else self._someone().message(octets)

    def _mutated(self) -> bytes:
        octets = bytearray(self._dice.choice(self._captured))
        octets[8:20] = self._someone().prefix
        return self._altered(octets)

    def _altered(self, octets: bytearray) -> bytes:
        dice = self._dice
        for _ in range(dice.randrange(4)):
            at = dice.randrange(len(octets))
            match dice.randrange(4):
                case 0:
                    octets[at] = dice.choice((0, 1, 0x7F, 0x80, 0xFF))
                case 1:
                    octets[at] ^= 1 << dice.randrange(8)
                case 2:
                    del octets[at : at + dice.randrange(1, 9)]
                case _:
                    octets[at:at] = dice.randbytes(4)
            if not octets:
                break
        return bytes(octets)

    def _announcement(self) -> bytes:
        """SPDP of somebody, who may name any host."""
        dice, stranger = self._dice, self._dice.choice(self._strangers)
        hosts = tuple(self._source() for _ in range(dice.randrange(1, 70)))
        return stranger.spdp(
            metatraffic_unicast=hosts, default_unicast=hosts[:1], lease_duration=dice.choice((0.1, 5.0, 1e9)),
            entity_name=str(dice.random()),
        ) + stranger.first_heartbeats()[20:]  # fmt: skip

    def _endpoint(self) -> bytes:
        """SEDP of somebody, in step with what was announced before or not."""
        dice, stranger = self._dice, self._dice.choice(self._strangers)
        key, topic = dice.randrange(1, 40), dice.choice(("In", "Out", f"topic {dice.randrange(5000)}"))
        qos = dice.choice((RELIABLE, HISTORY, RELIABLE | Qos(partition=Partition(str(dice.random())))))
        octets = (stranger.sedp_writer if dice.random() < 0.5 else stranger.sedp_reader)(key, topic, qos)
        writer_id = EntityId(octets[32:36])
        number = stranger._sn[writer_id]
        beat = Heartbeat(ALL, writer_id, number, number - 1, self._next_count(), final=True).encode()
        return octets[:20] + beat + octets[20:]

    def _sample(self) -> bytes:
        """Of any instance, by a writer that may be matched; disposes and unregistrations too."""
        dice, number = self._dice, self._number() if self._dice.random() < 0.02 else self._dice.randrange(1, 3000)
        writer = EntityId.user(dice.choice((1, 1, 1, 2)), EntityKind.WRITER_NO_KEY)
        payload = b"\0\1\0\0" + dice.randbytes(1) + dice.randbytes(dice.randrange(3000))
        return self._someone().message(Data(dice.choice((ALL, OUR_READER)), writer, number, None, payload).encode())

    def _numbers(self) -> bytes:
        """HEARTBEAT, GAP, ACKNACK and their like, with numbers from everywhere."""
        dice, peer = self._dice, self._someone()
        theirs, reader = (peer.endpoint(1, is_writer=is_writer).entity_id for is_writer in (True, False))
        builtin = dice.choice((ids.SEDP_PUBLICATIONS_WRITER, ids.PARTICIPANT_MESSAGE_WRITER))
        writer = builtin if dice.random() < 0.02 else theirs
        first = self._number()
        last = self._number() if dice.random() < 0.1 else first + dice.randrange(300)
        count = self._next_count()
        fragments = NumberSet(1, 256, dice.getrandbits(256) | 1)
        said = dice.choice((
            Heartbeat(ALL, writer, min(first, last), last, count, dice.random() < 0.5, dice.random() < 0.1),
            Gap(ALL, writer, first, NumberSet(first + dice.randrange(3), 256, dice.getrandbits(256))),
            AckNack(reader, OUR_WRITER, self._set(), count, dice.random() < 0.5),
            NackFrag(reader, OUR_WRITER, first, fragments, count),
            HeartbeatFrag(ALL, writer, first, dice.choice((1, 0xFFFFFFFF)), count),
        ))  # fmt: skip
        return peer.message(InfoDestination(self.plain.engine.guid.prefix).encode(), said.encode())

    def _fragment(self) -> bytes:
        """Of samples that will never be complete."""
        dice, peer = self._dice, self._someone()
        size, of = dice.choice((1, 100, 1000)), dice.choice((1001, 60_000, 1 << 18, 1 << 30))
        first = dice.randrange(1, -(-of // size))
        writer = peer.endpoint(1, is_writer=True).entity_id
        return peer.message(DataFrag(ALL, writer, self._number(), first, 1, size, of, None, bytes(size)).encode())

    def _farewell(self) -> bytes:
        return self._dice.choice(self._strangers).goodbye()

    def _of_many(self) -> bytes:
        """Announcements of several, one behind the other in one datagram."""
        out = [self._dice.choice(self._strangers).message()]
        for _ in range(self._dice.randrange(1, 40)):
            stranger = self._dice.choice(self._strangers)
            out += [InfoSource((2, 4), VENDOR, stranger.prefix).encode(), stranger.spdp()[20:]]
        return b"".join(out)

    def _said_and_altered(self) -> bytes:
        """Of the secured session: what Alice said, again, altered, in another's name, or spliced."""
        dice = self._dice
        octets = bytearray(dice.choice(self._said))
        match dice.randrange(4):
            case 0:
                octets[8:20] = GuidPrefix(VENDOR + dice.randrange(IDENTITIES).to_bytes(10, "big"))
            case 1:
                other = dice.choice(self._said)
                at, to = (4 * dice.randrange(5, len(one) // 4 + 1) for one in (octets, other))
                octets[at:] = other[to:]
        return self._altered(octets)


# --- the command ----------------------------------------------------------------------------------------------------


def main(arguments: Sequence[str]) -> None:
    """Print the memory after every tenth of the flood, and how large each table ever was."""
    parser = argparse.ArgumentParser(prog="python -m tests.fuzz strangers", description="Strangers by the thousand")
    parser.add_argument("--datagrams", type=int, default=1_000_000)
    parser.add_argument("--seed", type=int, default=1)
    chosen = parser.parse_args(arguments)
    flood, begin = Flood(chosen.seed), time.monotonic()
    print(f"before: {_resident()} KiB resident")
    tenth = max(chosen.datagrams // 10, 1)
    for heard in range(tenth, chosen.datagrams + 1, tenth):
        flood.run(tenth)
        gc.collect()
        drops = flood.plain.engine.drops.total() + flood.secured.engine.drops.total()
        print(f"{heard}: {time.monotonic() - begin:.0f} s, {drops} drops, {_resident()} KiB resident", flush=True)
    for name, ear in (("without security", flood.plain), ("secured", flood.secured)):
        print(f"\n{name}, at most")
        for table in flood.peaks[name]:
            print(f"  {table.name:36} {table.size:9} of {table.most}")
        for reason, count in ear.engine.drops.most_common():
            print(f"  dropped: {reason.value:27} {count:9}")
    print(f"\n{flood.octets} octets heard, {flood.octets_sent()} sent")
    print(f"the friend is served: {flood.is_friend_served()}")


def _resident() -> int:
    """KiB of memory that this process has now; 0 where the system does not say."""
    try:
        return int(Path("/proc/self/statm").read_text().split()[1]) * 4
    except OSError:
        return 0
