"""Readers that come and go in the middle of a coherent set: DDS 1.4 §2.2.2.4.1.10, begin_coherent_changes.

Whom such a change keeps from the whole set behaves as if it had received nothing of it.  With access scope GROUP that
is the subscriber: all its readers see their parts, or none does.  Others are not concerned, nor are later sets.
"""

from __future__ import annotations

from collections.abc import Callable

import pytest

from ddsi.simulation import LinkConditions
from ddsi.structure.qos import Qos
from ddsi.structure.qos_policies import AccessScope, Partition, TransientLocal, Volatile

from .test_coherent_sets import TOPICS, Member, Scene, View, _coherent

FINE, RAINY = LinkConditions(), LinkConditions(loss=0.1, jitter=0.01)
RED, GREEN, BLUE = range(3)


class Moving(Scene):
    """A scene with one view that stays, and one whose readers are moved."""

    def __init__(self, seed: int, *, keeps: bool, is_local: bool, conditions: LinkConditions) -> None:
        policy = _coherent(AccessScope.GROUP)
        super().__init__(seed, policy, conditions, durability=TransientLocal() if keeps else Volatile())
        self.staying = self.view()
        self.moved = self.view(self.here if is_local else None)
        self.introduce()
        self.write_set()
        self.look()

    def look(self, seconds: float = 0.0) -> None:
        for view in (self.staying, self.moved):
            view.watch(seconds or self.random.choice((0.01, 1.0)))

    def pause(self) -> None:
        self.domain.run(self.random.choice((0.0, 0.001, 0.02, 0.2)))

    def some(self, most: int = 4) -> list[Member]:
        members = []
        for _ in range(self.random.randrange(most)):
            members.append(self.write(self.random.choice(self.writers)))
            self.pause()
        return members

    def delete(self, index: int) -> None:
        self.moved.readers[index].delete()

    def renew(self, index: int) -> None:
        node, subscriber = self.moved.subscriber.node, self.moved.subscriber
        self.moved.readers[index] = node.reader(TOPICS[index], self.qos, keyed=True, takes=False, subscriber=subscriber)

    def part(self, index: int) -> None:
        self.moved.readers[index].change(self.qos | Qos(partition=Partition("elsewhere")))

    def meet(self, index: int) -> None:
        self.moved.readers[index].change(self.qos)

    def later_sets_are_seen(self) -> None:
        self.introduce()
        later: list[Member] = []
        for _ in range(3):
            later += self.write_set()
            self.look(0.1)
        self.look(20.0)
        assert set(later) <= set(self.staying.seen)
        assert set(later) <= set(self.moved.seen)


def _seen_of(view: View, members: list[Member]) -> list[Member]:
    return sorted(set(members).intersection(view.seen))


@pytest.mark.parametrize("seed", range(8))
@pytest.mark.parametrize("keeps", [False, True])
@pytest.mark.parametrize("is_local", [False, True])
@pytest.mark.parametrize("conditions", [FINE, RAINY])
@pytest.mark.parametrize("leaving", [Moving.delete, Moving.part])
def test_whoever_moves_in_a_set_holds_nobody_up_and_those_who_stay_see_it_whole(
    seed: int, keeps: bool, is_local: bool, conditions: LinkConditions, leaving: Callable[[Moving, int], None]
) -> None:
    scene = Moving(seed, keeps=keeps, is_local=is_local, conditions=conditions)
    movers = scene.random.sample(range(3), scene.random.randrange(1, 4))
    with scene.publisher.coherent_changes():
        members = [scene.write(scene.random.choice(scene.writers)), *scene.some()]
        for index in movers:
            leaving(scene, index)
        scene.pause()
        members += scene.some()
        for index in movers:
            (Moving.meet if leaving is Moving.part else Moving.renew)(scene, index)
        scene.pause()
        members += scene.some()
    scene.sets.append(members)
    scene.look(5.0)
    for view in (scene.staying, scene.moved):
        assert repr(view.subscriber.group).endswith(" 0 units wait>"), "though the writers are silent"
    scene.later_sets_are_seen()
    assert scene.staying.flaws() == []
    assert sorted(scene.staying.seen) == sorted(scene.staying.expected())
    assert max(map(scene.moved.seen.count, scene.moved.seen)) == 1


@pytest.mark.parametrize("seed", range(5))
@pytest.mark.parametrize("is_local", [False, True])
@pytest.mark.parametrize("conditions", [FINE, RAINY])
def test_a_volatile_reader_made_within_a_set_keeps_its_subscriber_from_seeing_a_half_of_it(
    seed: int, is_local: bool, conditions: LinkConditions
) -> None:
    """Also where its writer writes nothing more, so that only the end of the set comes to the reader."""
    scene = Moving(seed, keeps=False, is_local=is_local, conditions=conditions)
    scene.delete(RED)
    with scene.publisher.coherent_changes():
        members = [scene.write(scene.writers[RED]), scene.write(scene.writers[GREEN])]
        scene.look()
        scene.renew(RED)
        scene.introduce()
        members.append(scene.write(scene.writers[BLUE]))
        scene.pause()
    scene.later_sets_are_seen()
    assert _seen_of(scene.moved, members) == []
    assert _seen_of(scene.staying, members) == sorted(members)


@pytest.mark.parametrize("seed", range(5))
@pytest.mark.parametrize("is_local", [False, True])
@pytest.mark.parametrize("conditions", [FINE, RAINY])
def test_a_volatile_reader_made_within_a_set_costs_nothing_where_its_writer_had_no_part_before(
    seed: int, is_local: bool, conditions: LinkConditions
) -> None:
    scene = Moving(seed, keeps=False, is_local=is_local, conditions=conditions)
    scene.delete(RED)
    with scene.publisher.coherent_changes():
        members = [scene.write(scene.writers[GREEN])]
        scene.look()
        scene.renew(RED)
        scene.introduce()
        members += [scene.write(scene.writers[index]) for index in range(seed % 3)]
    scene.later_sets_are_seen()
    assert _seen_of(scene.moved, members) == sorted(members)


@pytest.mark.parametrize("seed", range(5))
@pytest.mark.parametrize("is_local", [False, True])
@pytest.mark.parametrize("conditions", [FINE, RAINY])
def test_a_reader_with_history_made_within_a_set_sees_all_of_it_with_its_siblings(
    seed: int, is_local: bool, conditions: LinkConditions
) -> None:
    scene = Moving(seed, keeps=True, is_local=is_local, conditions=conditions)
    with scene.publisher.coherent_changes():
        members = [scene.write(scene.writers[RED]), scene.write(scene.writers[GREEN])]
        scene.look()
        scene.delete(RED)
        scene.renew(RED)
        scene.introduce()
        members += [scene.write(scene.writers[BLUE]), *scene.some()]
    scene.sets.append(members)
    scene.later_sets_are_seen()
    assert _seen_of(scene.moved, members) == sorted(members)
    assert any(set(members) <= set(look) for look in scene.moved.looks), "and at once"


@pytest.mark.parametrize("seed", range(5))
@pytest.mark.parametrize("is_local", [False, True])
@pytest.mark.parametrize("conditions", [FINE, RAINY])
def test_a_reader_deleted_within_a_set_costs_its_siblings_nothing(
    seed: int, is_local: bool, conditions: LinkConditions
) -> None:
    scene = Moving(seed, keeps=False, is_local=is_local, conditions=conditions)
    with scene.publisher.coherent_changes():
        members = [scene.write(writer) for writer in scene.writers]
        scene.pause()
        scene.delete(RED)
        members += scene.some()
    del scene.moved.readers[RED]
    scene.look(20.0)
    theirs = sorted(member for member in members if member[0] != TOPICS[RED])
    assert _seen_of(scene.moved, theirs) == theirs


@pytest.mark.parametrize("is_local", [False, True])
def test_a_reader_that_goes_before_its_writer_wrote_in_the_set_keeps_its_subscriber_from_it_too(is_local: bool) -> None:
    """Nobody knows what it would have brought: the others are not shown theirs as if that were all."""
    scene = Moving(1, keeps=False, is_local=is_local, conditions=FINE)
    with scene.publisher.coherent_changes():
        members = [scene.write(scene.writers[GREEN])]
        scene.look(1.0)  # a HEARTBEAT of the other writers says that they have nothing yet
        scene.part(RED)
        scene.domain.run(0.5)
        members.append(scene.write(scene.writers[RED]))
    scene.look(5.0)
    assert _seen_of(scene.moved, members) == []
    scene.meet(RED)
    scene.later_sets_are_seen()


def test_writers_of_the_same_participant_that_resume_one_by_one_show_no_part_of_a_set() -> None:
    scene = Moving(1, keeps=False, is_local=True, conditions=FINE)
    presentation = scene.here.engine.presentation
    for writer in scene.writers:
        presentation.suspend(writer.local)
    with scene.publisher.coherent_changes():
        members = [scene.write(writer) for writer in scene.writers]
    for writer in scene.writers:
        assert _seen_of(scene.moved, members) == []
        presentation.resume(writer.local, scene.domain.now)
        scene.moved.look()
    assert _seen_of(scene.moved, members) == sorted(members)
