"""Coherent sets and group order over a network that loses, doubles, delays and reorders, from a seed."""

from __future__ import annotations

from collections import Counter
from random import Random

import pytest

from ddsi.simulation import Domain, LinkConditions, Node, NodeReader, NodeWriter
from ddsi.simulation.groups import NodePublisher, NodeSubscriber
from ddsi.simulation.invariants import always, at_rest, is_at_rest
from ddsi.structure.qos import Qos
from ddsi.structure.qos_policies import (
    AccessScope,
    BestEffort,
    KeepAll,
    KeepLast,
    Partition,
    Presentation,
    Reliable,
    TransientLocal,
)
from ddsi.structure.status import SampleLost

SEEDS = range(6)
BAD_WEATHER = LinkConditions(loss=0.2, duplication=0.1, reordering=0.3, delay=0.001, jitter=0.02)
TOPIC, GROUP = AccessScope.TOPIC, AccessScope.GROUP
TOPICS = ("Red", "Green", "Blue")
Member = tuple[str, int]  # topic, sequence number


def _qos(presentation: Presentation, **policies: object) -> Qos:
    given = {"reliability": Reliable(), "history": KeepAll(), **policies}
    return Qos(presentation=presentation, **given)  # type: ignore[arg-type]


class Scene:
    """A publisher with a writer for each topic on one node, subscribers with a reader for each on others.

    ``sets``: what was written together.  ``single``: what was written outside of sets.
    """

    def __init__(self, seed: int, policy: Presentation, conditions: LinkConditions, **policies: object) -> None:
        self.domain = Domain(seed, conditions=conditions)
        self.random = Random(seed)
        self.qos = _qos(policy, **policies)
        self.policy = policy
        self.here = self.domain.node()
        self.publisher: NodePublisher = self.here.publisher()
        self.writers = [self.here.writer(topic, self.qos, keyed=True, publisher=self.publisher) for topic in TOPICS]
        self.sets: list[list[Member]] = []
        self.singles: list[Member] = []
        self.order: list[Member] = []

    def view(self, node: Node | None = None, topics: tuple[str, ...] = TOPICS) -> View:
        node = node or self.domain.node()
        subscriber = node.subscriber()
        return View(
            self, subscriber, [node.reader(t, self.qos, keyed=True, takes=False, subscriber=subscriber) for t in topics]
        )

    def introduce(self) -> None:
        assert self.domain.run_until(self.domain.all_matched, 60)
        self.domain.run(0.5)

    def write(self, writer: NodeWriter) -> Member:
        change = writer.write(
            self.random.randrange(2000) if self.random.random() < 0.1 else 8, self.random.randrange(3)
        )
        assert change is not None
        member = (writer.topic, change.sequence_number)
        self.order.append(member)
        return member

    def write_set(self, *, pause: float = 0.0, is_complete: bool = True) -> list[Member]:
        with self.publisher.coherent_changes(is_complete=is_complete):
            members: list[Member] = []
            for _ in range(self.random.randrange(1, 8)):
                members.append(self.write(self.random.choice(self.writers)))
                self.domain.run(pause)
        if is_complete:
            self.sets.append(members)
        return members

    def write_single(self) -> None:
        self.singles.append(self.write(self.random.choice(self.writers)))

    def units(self) -> list[set[Member]]:
        """What has to be seen together."""
        if self.policy.access_scope is GROUP:
            return [set(members) for members in self.sets]
        return [{m for m in members if m[0] == topic} for members in self.sets for topic in TOPICS]


class View:
    """What a subscriber's application sees, look by look."""

    def __init__(self, scene: Scene, subscriber: NodeSubscriber, readers: list[NodeReader]) -> None:
        self.scene = scene
        self.subscriber = subscriber
        self.readers = readers
        self.looks: list[list[Member]] = []

    @property
    def seen(self) -> list[Member]:
        return [member for look in self.looks for member in look]

    def look(self) -> list[Member]:
        with self.subscriber.access():
            taken = [(reader, *sample) for reader in self.readers for sample in reader.take()]
        found = [(info.arrival, reader.topic, change) for reader, info, change in taken if info.valid_data]
        found.sort(key=lambda entry: entry[0])
        self.looks.append([(topic, change.sequence_number) for _, topic, change in found])
        return self.looks[-1]

    def watch(self, seconds: float) -> None:
        """Let time pass and look now and then."""
        end = self.scene.domain.now + seconds
        while self.scene.domain.now < end:
            self.scene.domain.run(self.scene.random.choice((0.001, 0.01, 0.1)))
            self.look()

    def flaws(self) -> list[str]:
        """Nothing twice, nothing that was withdrawn, and of each unit all at once or nothing."""
        topics = {reader.topic for reader in self.readers}
        wrong = [f"{member} was seen {times} times" for member, times in Counter(self.seen).items() if times > 1]
        written = {m for members in self.scene.sets for m in members} | set(self.scene.singles)
        wrong += [f"{member} was withdrawn" for member in self.seen if member not in written]
        for unit in self.scene.units():
            wanted = {member for member in unit if member[0] in topics}
            for number, look in enumerate(self.looks):
                if 0 < len(wanted.intersection(look)) < len(wanted):
                    wrong.append(f"look {number} had {sorted(wanted.intersection(look))} of {sorted(wanted)}")
        return wrong

    def expected(self) -> list[Member]:
        """All that is to be seen in the end, in the order in which it was written."""
        topics = {reader.topic for reader in self.readers}
        written = {m for members in self.scene.sets for m in members} | set(self.scene.singles)
        return [member for member in self.scene.order if member in written and member[0] in topics]


def _coherent(scope: AccessScope, *, ordered: bool = False) -> Presentation:
    return Presentation(scope, coherent_access=True, ordered_access=ordered)


@pytest.mark.parametrize("seed", SEEDS)
@pytest.mark.parametrize("scope", [TOPIC, GROUP])
def test_sets_are_seen_whole_and_all_of_them_in_the_end(seed: int, scope: AccessScope) -> None:
    scene = Scene(seed, _coherent(scope), BAD_WEATHER)
    views = [scene.view(), scene.view(topics=TOPICS[:2])]
    scene.introduce()
    for _ in range(15):
        scene.write_set(pause=scene.random.choice((0.0, 0.02)))
        if scene.random.random() < 0.3:
            scene.write_single()
        for view in views:
            view.watch(0.05)
    assert scene.domain.run_until(lambda: is_at_rest(scene.domain), 120)
    for view in views:
        view.watch(1)
        assert view.flaws() == []
        assert sorted(view.seen) == sorted(view.expected())
    assert at_rest(scene.domain) == []


@pytest.mark.parametrize("seed", SEEDS)
@pytest.mark.parametrize("coherent", [True, False])
def test_group_order_is_that_of_writing_whoever_reads_what(seed: int, coherent: bool) -> None:
    """Also where a subscriber does not read all topics, so that numbers are missing for it."""
    scene = Scene(seed, Presentation(GROUP, coherent, ordered_access=True), BAD_WEATHER)
    views = [scene.view(), scene.view(topics=TOPICS[:2]), scene.view(topics=TOPICS[2:])]
    scene.introduce()
    for _ in range(40):
        scene.write_single()
        if coherent and scene.random.random() < 0.3:
            scene.write_set()
        for view in views:
            view.watch(scene.random.choice((0.001, 0.05)))
    assert scene.domain.run_until(lambda: is_at_rest(scene.domain), 120)
    for view in views:
        view.watch(2)
        assert view.flaws() == []
        assert view.seen == view.expected()


@pytest.mark.parametrize("seed", SEEDS)
@pytest.mark.parametrize("scope", [TOPIC, GROUP])
def test_best_effort_loses_whole_sets_only(seed: int, scope: AccessScope) -> None:
    scene = Scene(seed, _coherent(scope), LinkConditions(loss=0.1), reliability=BestEffort())
    view = scene.view()
    scene.introduce()
    for _ in range(30):
        scene.write_set(pause=0.002)
        view.watch(0.02)
    view.watch(2)
    assert view.flaws() == []
    assert view.seen, "a tenth of the datagrams is lost, not all sets"


@pytest.mark.parametrize("seed", SEEDS)
@pytest.mark.parametrize("scope", [TOPIC, GROUP])
def test_a_late_joiner_sees_the_sets_of_the_past_whole(seed: int, scope: AccessScope) -> None:
    scene = Scene(seed, _coherent(scope), BAD_WEATHER, durability=TransientLocal())
    for _ in range(10):
        scene.write_set()
        scene.write_single()
    view = scene.view()
    for _ in range(60):
        view.watch(0.5)
        if sorted(view.seen) == sorted(view.expected()):
            break
    assert view.flaws() == []
    assert sorted(view.seen) == sorted(view.expected())


@pytest.mark.parametrize("seed", SEEDS)
def test_what_a_volatile_reader_met_in_the_middle_of_a_set_it_does_not_see(seed: int) -> None:
    scene = Scene(seed, _coherent(GROUP), BAD_WEATHER)
    with scene.publisher.coherent_changes():
        begun = [scene.write(writer) for writer in scene.writers]
        scene.domain.run(0.1)
        view = scene.view()
        scene.introduce()
        begun += [scene.write(writer) for writer in scene.writers]
        view.watch(0.5)
    scene.write_set()
    view.watch(10)
    assert not set(begun).intersection(view.seen)
    assert sorted(view.seen) == sorted(scene.sets[0])


@pytest.mark.parametrize("seed", SEEDS)
@pytest.mark.parametrize("scope", [TOPIC, GROUP])
def test_a_set_that_is_withdrawn_or_whose_writer_dies_is_never_seen(seed: int, scope: AccessScope) -> None:
    scene = Scene(seed, _coherent(scope), BAD_WEATHER)
    view = scene.view()
    scene.introduce()
    scene.write_set()
    scene.write_set(is_complete=False)
    scene.write_set()
    view.watch(3)
    assert sorted(view.seen) == sorted(view.expected())
    with scene.publisher.coherent_changes():
        for writer in scene.writers:
            scene.write(writer)
        view.watch(1)
        scene.here.kill()
        view.watch(30)
        assert not any(reader.local.behavior.writers for reader in view.readers), "the lease has run out"
        scene.publisher.group.end_coherent_changes()
        scene.publisher.group.begin_coherent_changes()
    assert view.flaws() == []
    assert sorted(view.seen) == sorted(view.expected())
    statuses = view.subscriber.node.statuses_of(SampleLost)
    lost = sum(status.total_count_change for status in statuses if isinstance(status, SampleLost))
    assert lost >= len(scene.writers), "and its reader was told of what it lost"


def test_a_reader_without_coherent_access_sees_samples_as_they_come() -> None:
    scene = Scene(1, _coherent(GROUP), LinkConditions())
    plain = scene.domain.node().reader("Red", Qos(history=KeepAll(), reliability=Reliable()), keyed=True)
    scene.introduce()
    with scene.publisher.coherent_changes():
        scene.write(scene.writers[0])
        scene.domain.run(1)
        assert len(plain.taken) == 1
    scene.domain.run(1)
    assert len(plain.taken) == 1, "the end of the set is no sample"
    assert always(scene.domain) == []


def test_history_that_keeps_too_little_for_a_set_costs_late_joiners_the_set() -> None:
    """KEEP_LAST replaces a member before the late joiner comes: what is left of the set is no set."""
    scene = Scene(1, _coherent(TOPIC), LinkConditions(), durability=TransientLocal(), history=KeepLast(1))
    red, green, _ = scene.writers
    with scene.publisher.coherent_changes():
        for writer, key in ((red, 1), (red, 2), (green, 1)):
            writer.write(key=key)
    red.write(key=1)
    view = scene.view()
    view.watch(5)
    assert view.seen == [("Red", 4), ("Green", 1)]


def test_ends_of_sets_do_not_pile_up_behind_keep_last() -> None:
    scene = Scene(1, _coherent(GROUP), LinkConditions(), durability=TransientLocal(), history=KeepLast(1))
    view = scene.view()
    scene.introduce()
    for _ in range(200):
        scene.write_set()
        view.watch(0.02)
    view.watch(3)
    for writer in scene.writers:
        assert len(writer.local.behavior.cache) <= 2 * 3, "three instances, and an end for each at most"


@pytest.mark.parametrize("seed", range(10))
@pytest.mark.parametrize("scope", [TOPIC, GROUP])
def test_a_network_that_was_cut_within_a_set_leaves_no_half_of_it(seed: int, scope: AccessScope) -> None:
    """The lease runs out, and the writers return with their history: what comes twice must not come in pieces."""
    scene = Scene(seed, _coherent(scope), LinkConditions(loss=0.1, jitter=0.01), durability=TransientLocal())
    view = scene.view()
    scene.introduce()
    scene.write_set()
    with scene.publisher.coherent_changes():
        members = [scene.write(writer) for writer in scene.writers]
        scene.domain.run(scene.random.choice((0.0, 0.001, 0.1)))
        if seed % 2:
            scene.domain.network.partition([scene.here.host])
    scene.sets.append(members)
    if not seed % 2:
        scene.domain.run(scene.random.choice((0.0, 0.001, 0.005)))
        scene.domain.network.partition([scene.here.host])
    view.watch(150)
    assert not any(reader.local.behavior.writers for reader in view.readers), "the lease has run out"
    scene.domain.network.heal()
    scene.introduce()
    scene.write_set()
    view.watch(20)
    assert view.flaws() == []
    assert set(scene.sets[-1]) <= set(view.seen), "what was written since is seen"


@pytest.mark.parametrize("seed", range(10))
@pytest.mark.parametrize("scope", [TOPIC, GROUP])
@pytest.mark.parametrize("is_local", [False, True])
def test_who_leaves_within_a_set_and_comes_back_sees_no_half_of_it(
    seed: int, scope: AccessScope, is_local: bool
) -> None:
    """By a new partition: all of the history comes once more, and of each set all is seen or nothing."""
    scene = Scene(seed, _coherent(scope), LinkConditions(loss=0.1, jitter=0.01), durability=TransientLocal())
    view = scene.view(scene.here if is_local else None)
    scene.introduce()
    scene.write_set()
    view.watch(scene.random.choice((0.0, 0.01, 1.0)))

    def move(*partitions: str) -> None:
        for reader in view.readers:  # a partition is their subscriber's
            reader.change(scene.qos | Qos(partition=Partition(*partitions)))

    with scene.publisher.coherent_changes():
        members = [scene.write(writer) for writer in scene.writers]
        scene.domain.run(scene.random.choice((0.0, 0.001, 0.1)))
        if seed % 2:
            move("elsewhere")
    scene.sets.append(members)
    if not seed % 2:
        scene.domain.run(scene.random.choice((0.0, 0.001, 0.005)))
        move("elsewhere")
    view.watch(1)
    move()
    scene.introduce()
    scene.write_set()
    view.watch(20)
    assert view.flaws() == []
    assert set(scene.sets[-1]) <= set(view.seen), "what was written since is seen"
