"""Scenario: a random piece of life of a domain, all of it from one seed, and the check of every invariant at its end.

A scenario is made first and lived through afterwards: :attr:`Scenario.steps` are plain values that can be printed,
so a failing seed tells what it did.  Its sizes are those of tests: a second scenario teaches more than a long one.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from itertools import cycle

from ..behavior.filtering_writer import FilteringWriter
from ..config import Config
from ..structure.cache_change import ChangeKind
from ..structure.guid import GUID_UNKNOWN, Guid
from ..structure.qos import Qos
from ..structure.qos_policies import (
    BestEffort,
    History,
    KeepAll,
    KeepLast,
    Lifespan,
    Partition,
    Properties,
    Reliable,
    ResourceLimits,
    TransientLocal,
    Volatile,
)
from ..trace.sink import TraceSink
from . import invariants
from .dice import Dice
from .domain import Domain
from .endpoints import NodeReader, NodeWriter
from .link import GOOD_WEATHER, LinkConditions
from .node import Node
from .vendors import Vendor

__all__ = ["Failure", "Report", "Scenario"]

_FILTERED = 3  # the topic whose writers filter
_INTRODUCTION_S = 15.0
_SECURED_INTRODUCTION_S = 60.0
"""A handshake message has to arrive whole: in small fragments over a bad network that takes many attempts."""
_REST_S = 120.0
_QUIET_S = 30.0


class Failure(AssertionError):
    """An invariant did not hold.  ``flaws`` says in words which; the seed is in the text."""

    def __init__(self, seed: int, when: str, flaws: list[str]) -> None:
        shown = flaws[:12] + ([f"... and {len(flaws) - 12} more"] if len(flaws) > 12 else [])
        super().__init__("\n  ".join([f"seed {seed}, {when}:", *shown, f"replay it: ddsi sim --seed {seed}"]))
        self.seed = seed
        self.flaws = flaws


@dataclass(frozen=True, slots=True)
class EndpointPlan:
    """An endpoint that a scenario creates: writer or reader, on which topic, with which QoS.

    ``is_filtered``: the writers of this topic send each reader its own changes only.  ``takes``: a reader whose
    application takes samples as they come; else only now and then.
    """

    node: int
    is_writer: bool
    topic: str
    is_keyed: bool
    qos: Qos
    is_filtered: bool = False
    takes: bool = True

    def __str__(self) -> str:
        words = [
            "filtering" if self.is_filtered and self.is_writer else "",
            "" if self.takes else "slow",
            "keyed" if self.is_keyed else "",
            "writer" if self.is_writer else "reader",
        ]
        return f"node {self.node}: {' '.join(filter(None, words))} of {self.topic}, {self.qos}"


# --- steps: each is a value, and does one thing to a run -----------------------------------------------------------


@dataclass(frozen=True, slots=True)
class Wait:
    seconds: float

    def __str__(self) -> str:
        return f"{self.seconds} s pass"


@dataclass(frozen=True, slots=True)
class Create:
    endpoint: EndpointPlan

    def __str__(self) -> str:
        return str(self.endpoint)


@dataclass(frozen=True, slots=True)
class Write:
    """``count`` samples by the writer chosen by ``choice`` among those that live, of sizes up to ``size`` octets."""

    choice: int
    count: int
    size: int

    def __str__(self) -> str:
        return f"a writer (by {self.choice}) writes {self.count} samples of up to {self.size} octets"


@dataclass(frozen=True, slots=True)
class End:
    """Dispose or unregister an instance."""

    choice: int
    kind: ChangeKind
    key: int

    def __str__(self) -> str:
        return f"a writer (by {self.choice}) says {self.kind.name} of instance {self.key}"


@dataclass(frozen=True, slots=True)
class Take:
    """The application of a slow reader takes what is there."""

    choice: int

    def __str__(self) -> str:
        return f"a slow reader (by {self.choice}) takes"


@dataclass(frozen=True, slots=True)
class Delete:
    """Delete an endpoint, a writer or a reader."""

    choice: int

    def __str__(self) -> str:
        return f"an endpoint (by {self.choice}) is deleted"


@dataclass(frozen=True, slots=True)
class Restart:
    """A participant goes and comes back, with the endpoints that it had."""

    node: int
    goodbye: bool

    def __str__(self) -> str:
        return f"node {self.node}: restarts {'after a goodbye' if self.goodbye else 'after a crash'}"


@dataclass(frozen=True, slots=True)
class Cut:
    """The network falls apart: the nodes of this bit mask are on one side."""

    side: int
    seconds: float

    def __str__(self) -> str:
        numbers = [str(number) for number in range(self.side.bit_length()) if self.side >> number & 1]
        return f"the network is cut between {', '.join(numbers)} and the others for {self.seconds} s"


Step = Wait | Create | Write | End | Take | Delete | Restart | Cut


@dataclass(frozen=True, slots=True)
class Report:
    """What a run that went well came to."""

    seed: int
    nodes: int
    written: int
    delivered: int
    datagrams: int
    dropped: int
    seconds: float

    def __str__(self) -> str:
        return (
            f"seed {self.seed}: {self.nodes} participants, {self.written} changes written, "
            f"{self.delivered} deliveries, {self.datagrams} datagrams sent of which {self.dropped} were lost, "
            f"{self.seconds:.1f} s of virtual time: every invariant held"
        )


@dataclass(slots=True)
class Scenario:
    """The plan that a seed stands for; :meth:`run` lives through it."""

    seed: int
    conditions: LinkConditions
    configs: list[Config]
    max_message_octets: int
    hosts: list[str]
    multicast: bool
    steps: list[Step] = field(default_factory=list)

    @classmethod
    def from_seed(cls, seed: int) -> Scenario:
        return _Planner(seed).plan()

    def describe(self) -> Iterator[str]:
        """The plan in words, a line each."""
        yield f"seed {self.seed}: {len(self.hosts)} participants on {len(set(self.hosts))} hosts"
        yield f"network: {self.conditions}"
        way = "multicast" if self.multicast else "unicast to peers"
        yield f"messages of at most {self.max_message_octets} octets, discovery by {way}"
        for step in self.steps:
            yield f"- {step}"

    def run(
        self,
        trace: TraceSink | None = None,
        *,
        properties: Sequence[Properties] = ({},),
        vendors: Sequence[Vendor | None] = (None,),
    ) -> Report:
        """Live through it and check every invariant.  Raises Failure.

        The participants get ``properties`` by turns; those that configure security make it a secured domain.  By turns
        they play the ``vendors``, too; None for ours.
        """
        return _Run(self, trace, properties, vendors).run()


# --- making a plan -------------------------------------------------------------------------------------------------


class _Planner:
    """Draws a scenario.  What is drawn here decides what the thousand seeds of the tests cover."""

    def __init__(self, seed: int) -> None:
        self._seed = seed
        self._dice = Dice(seed)
        self._topics = [("Square", False), ("Circle", True), ("Triangle", self._dice.chance(0.5)), ("keys", False)]

    def plan(self) -> Scenario:
        dice = self._dice
        node_count = dice.pick((2, 2, 2, 3, 3, 4))
        multicast = dice.chance(0.8)
        hosts = [
            f"10.0.0.{1 + (dice.below(number + 1) if dice.chance(0.2) else number)}" for number in range(node_count)
        ]
        scenario = Scenario(
            seed=self._seed,
            conditions=self._weather(),
            configs=[self._config() for _ in range(node_count)],
            max_message_octets=dice.pick((600, 1452, 1452, 8192, 65_000)),
            hosts=hosts,
            multicast=multicast,
        )
        steps = scenario.steps
        # Every scenario has at least one reliable pair on different nodes, or it would say little.
        topic = _FILTERED if dice.chance(0.2) else 0
        steps.append(Create(self._endpoint(0, is_writer=True, topic=topic, reliable=True)))
        steps.append(Create(self._endpoint(1, is_writer=False, topic=topic, reliable=True)))
        for _ in range(dice.below(4)):
            steps.append(self._creation(node_count))
        steps.append(Wait(dice.pick((0.0, 0.01, 1.0))))
        for _ in range(4 + dice.below(8)):
            steps.append(self._step(node_count))
        return scenario

    def _weather(self) -> LinkConditions:
        dice = self._dice
        kind = dice.below(6)
        return LinkConditions(
            loss=dice.between(0.01, 0.3) if kind in (1, 5) else 0.0,
            duplication=dice.between(0.05, 0.3) if kind in (2, 5) else 0.0,
            reordering=dice.between(0.05, 0.3) if kind in (3, 5) else 0.0,
            reordering_delay=dice.pick((0.001, 0.01, 0.1)),
            delay=dice.pick((0.0001, 0.001, 0.02, 0.1)) if kind in (4, 5) else 0.0002,
            jitter=dice.pick((0.0, 0.001, 0.02)) if kind in (4, 5) else 0.0,
        )

    def _config(self) -> Config:
        return Config(lease_duration=self._dice.pick((3.0, 10.0, 20.0)))

    def _creation(self, node_count: int) -> Create:
        dice = self._dice
        return Create(
            self._endpoint(
                dice.below(node_count),
                is_writer=dice.chance(0.4),
                topic=dice.pick((0, 0, 1, 1, 2, 2, _FILTERED, _FILTERED)),
                reliable=dice.chance(0.7),
            )
        )

    def _endpoint(self, node: int, *, is_writer: bool, topic: int, reliable: bool) -> EndpointPlan:
        dice = self._dice
        name, is_keyed = self._topics[topic]
        is_filtered = topic == _FILTERED
        histories: tuple[History, ...] = (KeepAll(), KeepAll(), KeepLast(1), KeepLast(5))
        history = KeepAll() if is_filtered and is_writer else dice.pick(histories)
        limits = ResourceLimits()
        if isinstance(history, KeepAll) and dice.chance(0.2):
            limits = ResourceLimits(max_samples=20)
        qos = Qos(
            reliability=Reliable() if reliable else BestEffort(),
            durability=TransientLocal() if dice.chance(0.3) else Volatile(),
            history=history,
            resource_limits=limits,
            partition=Partition(dice.pick(("p", "q", "p*"))) if dice.chance(0.1) else None,
            lifespan=Lifespan(dice.pick((0.02, 0.5))) if is_writer and dice.chance(0.05) else None,
        )
        takes = is_writer or not dice.chance(0.15)
        return EndpointPlan(node, is_writer, name, is_keyed, qos, is_filtered, takes)

    def _step(self, node_count: int) -> Step:
        dice = self._dice
        drawn = dice.below(100)
        if drawn < 45:
            return Write(dice.below(1 << 16), 1 + dice.below(12), self._size())
        if drawn < 55:
            kinds = (
                ChangeKind.NOT_ALIVE_DISPOSED,
                ChangeKind.NOT_ALIVE_UNREGISTERED,
                ChangeKind.NOT_ALIVE_DISPOSED_UNREGISTERED,
            )
            return End(dice.below(1 << 16), dice.pick(kinds), dice.below(4))
        if drawn < 70:
            return Wait(dice.pick((0.0005, 0.003, 0.05, 0.3, 2.0)))
        if drawn < 73:
            return Take(dice.below(1 << 16))
        if drawn < 80:
            return self._creation(node_count)
        if drawn < 86:
            return Delete(dice.below(1 << 16))
        if drawn < 92:
            return Restart(dice.below(node_count), dice.chance(0.4))
        return Cut(1 + dice.below((1 << node_count) - 1), dice.pick((0.02, 0.5, 4.0, 30.0)))

    def _size(self) -> int:
        """Mostly small, some of a few fragments, few of many."""
        return self._dice.pick((8, 8, 8, 100, 100, 1400, 3000, 10_000, 30_000))


# --- living through it -----------------------------------------------------------------------------------------------


class _Run:
    def __init__(
        self,
        scenario: Scenario,
        trace: TraceSink | None,
        properties: Sequence[Properties],
        vendors: Sequence[Vendor | None],
    ) -> None:
        self._scenario = scenario
        self._dice = Dice(scenario.seed ^ 0x5EED)
        self._domain = Domain(scenario.seed, conditions=scenario.conditions, vendors=vendors, trace=trace)
        self._plans: dict[int, list[EndpointPlan]] = {}
        self._introduction_s = _SECURED_INTRODUCTION_S if any(properties) else _INTRODUCTION_S
        hosts = tuple(dict.fromkeys(scenario.hosts))
        for host, config, own in zip(scenario.hosts, scenario.configs, cycle(properties)):
            self._domain.node(
                address=host,
                config=config,
                multicast=scenario.multicast,
                peers=() if scenario.multicast else hosts,
                max_message_octets=scenario.max_message_octets,
                properties=own,
            )

    def run(self) -> Report:
        domain = self._domain
        for step in self._scenario.steps:
            self._do(step)
            self._check(f"after {step}", invariants.always(domain))
        self._settle()
        self._check("at rest", invariants.at_rest(domain))
        self._clear_up()
        self._check("in the quiet after it", invariants.quiet(domain, _QUIET_S))
        self._check("at the end", invariants.at_rest(domain))
        return self._report()

    def _settle(self) -> None:
        """The network is whole; everybody finds everybody, and what is under way arrives."""
        domain = self._domain
        domain.network.heal()
        # A participant that was killed is remembered until its lease is over.
        longest = max(config.lease_duration for config in self._scenario.configs)
        domain.run_until(lambda: domain.are_introduced() and domain.all_matched(), longest + self._introduction_s)
        self._check("some seconds after the network healed", invariants.matched(domain))
        for writer in domain.writers():
            writer.write()
        for reader in domain.readers():
            reader.hurry()
        # It takes a moment until those who lack something know it.
        domain.run(1.0)
        if not domain.run_until(self._is_at_rest, _REST_S):
            self._check(f"{_REST_S} s later", ["not at rest", *invariants.at_rest(domain)])

    def _is_at_rest(self) -> bool:
        # In bad weather a lease may just have run out; then the two will find each other again.
        domain = self._domain
        return invariants.is_at_rest(domain) and domain.are_introduced() and domain.all_matched()

    def _clear_up(self) -> None:
        """Good weather from here on: where announcements get lost, a lease may run out at any time."""
        domain = self._domain
        domain.network.conditions = GOOD_WEATHER
        domain.run(5.0)
        domain.run_until(self._is_at_rest, self._introduction_s)

    def _check(self, when: str, flaws: list[str]) -> None:
        if flaws:
            raise Failure(self._scenario.seed, f"{when}, at {self._domain.now:.3f} s", flaws)

    def _report(self) -> Report:
        domain = self._domain
        readers = [reader for node in domain.nodes for reader in node.readers]
        return Report(
            seed=self._scenario.seed,
            nodes=len(domain.nodes),
            written=sum(len(writer.written) for node in domain.nodes for writer in node.writers),
            delivered=sum(
                len(session.changes)
                for reader in readers
                for sessions in reader.sessions.values()
                for session in sessions
            ),
            datagrams=domain.network.sent,
            dropped=domain.network.dropped.total(),
            seconds=domain.now,
        )

    # --- steps -------------------------------------------------------------------------------------------------------

    def _do(self, step: Step) -> None:
        domain = self._domain
        match step:
            case Wait(seconds):
                domain.run(seconds)
            case Create(plan):
                self._plans.setdefault(plan.node, []).append(plan)
                self._create(plan)
            case Write(choice, count, size):
                self._write(choice, count, size)
            case End(choice, kind, key):
                keyed = [writer for writer in domain.writers() if writer.is_keyed]
                if keyed:
                    keyed[choice % len(keyed)].end(kind, key)
            case Take(choice):
                slow = [reader for reader in domain.readers() if not reader.takes]
                if slow:
                    slow[choice % len(slow)].take()
            case Delete(choice):
                self._delete(choice)
            case Restart(number, goodbye):
                domain.nodes[number].restart(goodbye=goodbye)
                for plan in self._plans.get(number, []):
                    self._create(plan)
            case Cut(side, seconds):
                hosts = [node.host for node in domain.nodes]
                domain.network.partition([host for number, host in enumerate(hosts) if side >> number & 1])
                domain.run(seconds)
                domain.network.heal()

    def _create(self, plan: EndpointPlan) -> None:
        node: Node = self._domain.nodes[plan.node]
        if plan.is_writer:
            node.writer(plan.topic, plan.qos, keyed=plan.is_keyed, filters=plan.is_filtered)
        else:
            node.reader(plan.topic, plan.qos, keyed=plan.is_keyed, takes=plan.takes, uses_filter=plan.is_filtered)

    def _write(self, choice: int, count: int, size: int) -> None:
        writers = self._domain.writers()
        if not writers:
            return
        writer = writers[choice % len(writers)]
        for _ in range(count):
            writer.write(self._dice.below(size + 1), self._dice.below(4), destination=self._destination(writer))
            if self._dice.chance(0.2):
                self._domain.run(0.0005)

    def _destination(self, writer: NodeWriter) -> Guid:
        """Of a filtering writer: everybody, or one of the readers that there ever were, or the participant of one."""
        readers = [reader for node in self._domain.nodes for reader in node.readers if reader.topic == writer.topic]
        if not isinstance(writer.local.behavior, FilteringWriter) or not readers:
            return GUID_UNKNOWN
        reader = self._dice.pick(readers).guid
        return self._dice.pick((reader, reader.participant, GUID_UNKNOWN))

    def _delete(self, choice: int) -> None:
        endpoints: list[NodeWriter | NodeReader] = [*self._domain.writers(), *self._domain.readers()]
        if endpoints:
            endpoints[choice % len(endpoints)].delete()
