"""The two roles of ``ddsi-shape-main``: a publisher that moves shapes, and a subscriber that prints what comes.

Both make their endpoints first, saying so line by line, and then go round until told to end.
"""

from __future__ import annotations

import random

import trio

from ..dcps import ContentFilteredTopic, DataReader, DataWriter, DomainParticipant, Publisher, Sample, Subscriber, Topic
from ..structure.errors import BadParameter, DdsTimeout
from ..structure.sample_info import ANY_SAMPLE_STATE, SampleState
from .shape_main_lines import sample_line, state_line, status_line
from .shape_main_options import ShapeMainOptions
from .shape_main_qos import content_filter, endpoint_qos, group_qos
from .shape_motion import MovingShape
from .shape_types import Shape, shape_form

__all__ = ["PublishingRole", "Role", "SubscribingRole"]

_ACKNOWLEDGMENT_S = 1.0


class Role:
    """``create`` makes the endpoints and watches their statuses; ``run`` goes round until ``end`` is set."""

    def __init__(self, options: ShapeMainOptions, end: trio.Event) -> None:
        self.options = options
        self.end = end
        self.form = shape_form("appendable", options.payload_octets)

    def create(self, topics: list[Topic[Shape]], participant: DomainParticipant, nursery: trio.Nursery) -> None:
        raise NotImplementedError

    async def run(self) -> None:
        """As many rounds as were asked for, a period from the beginning of one to that of the next.

        A round that is late is played at once, and those after it follow at its distance: there is no catching up.
        """
        rounds = 0
        due: float | None = None
        while not self.end.is_set():
            await self.play_round(rounds)
            rounds += 1
            if rounds == self.options.num_iterations:
                break
            with trio.move_on_after(self.period_s) as pause:
                now = pause.deadline - self.period_s
                due = pause.deadline if due is None else max(due + self.period_s, now)
                pause.deadline = due
                await self.end.wait()

    @property
    def period_s(self) -> float:
        raise NotImplementedError

    async def play_round(self, number: int) -> None:
        raise NotImplementedError

    async def watch(self, entity: DataWriter[Shape] | DataReader[Shape]) -> None:
        """Print each status as it changes."""
        async for status in entity.events():
            line = status_line(entity.topic.name, entity.topic.type_name, status)
            if line is not None:
                print(line)


class PublishingRole(Role):
    """Writes every instance on every topic, all at the same place and of the same size.

    With coherent access each round is a set.  It may hold several samples of each instance, each one larger than the
    one before if sizes grow.
    """

    def __init__(self, options: ShapeMainOptions, end: trio.Event) -> None:
        super().__init__(options, end)
        self.writers: list[DataWriter[Shape]] = []
        self._shape = MovingShape(options.size, random.Random())

    def create(self, topics: list[Topic[Shape]], participant: DomainParticipant, nursery: trio.Nursery) -> None:
        self._publisher = publisher = Publisher(participant, group_qos(self.options))
        for topic in topics:
            print(f"Create writer for topic: {topic.name} color: {self.options.colors()[0]}")
            writer = DataWriter(publisher, topic, endpoint_qos(self.options))
            self.writers.append(writer)
            nursery.start_soon(self.watch, writer)

    @property
    def period_s(self) -> float:
        return self.options.write_period_ms / 1000

    async def play_round(self, number: int) -> None:
        shape, options = self._shape, self.options
        shape.move()
        sizes = [self._next_size() for _ in range(options.coherent_sample_count or 1)]
        if not options.is_coherent:
            await self._write_round(sizes)
            return
        print("Started Coherent Set")
        with self._publisher.coherent_changes():
            await self._write_round(sizes)
        print("Finished Coherent Set")

    def _next_size(self) -> int:
        shape, options = self._shape, self.options
        if options.size == 0:
            shape.size = (shape.size % options.size_modulo if options.size_modulo else shape.size) + 1
        return shape.size

    async def _write_round(self, sizes: list[int]) -> None:
        shape = self._shape
        for writer in self.writers:
            for color in self.options.colors():
                for size in sizes:
                    await self._write(writer, self.form.sample(color, shape.x, shape.y, size))

    async def _write(self, writer: DataWriter[Shape], sample: Shape) -> None:
        try:
            await writer.write(sample)
        except DdsTimeout as error:  # the next round is another chance, as with the other programs of the suite
            print(f"write() timed out: {error}")
            return
        if self.options.prints_written:
            print(sample_line(writer.topic.name, sample))

    async def run(self) -> None:
        await super().run()
        for writer in self.writers:
            for color in self.options.colors():
                await self._end_instance(writer, self.form.sample(color, 0, 0, 0))
        for writer in self.writers:
            try:
                await writer.wait_for_acknowledgments(_ACKNOWLEDGMENT_S)
            except DdsTimeout as error:
                print(f"wait_for_acknowledgments() timed out: {error}")

    async def _end_instance(self, writer: DataWriter[Shape], sample: Shape) -> None:
        match self.options.final_instance_state:
            case "u":
                await writer.unregister(sample)
            case "d":
                await writer.dispose(sample)


class SubscribingRole(Role):
    """Prints, each period, all samples that are there; with coherent or ordered access it says first that it looks."""

    def __init__(self, options: ShapeMainOptions, end: trio.Event) -> None:
        super().__init__(options, end)
        self.readers: list[DataReader[Shape]] = []

    def create(self, topics: list[Topic[Shape]], participant: DomainParticipant, nursery: trio.Nursery) -> None:
        self._subscriber = subscriber = Subscriber(participant, group_qos(self.options))
        for topic in topics:
            wanted = self._filtered(participant, topic)
            print(f"Create reader for topic: {wanted.name}")
            reader = DataReader(subscriber, wanted, endpoint_qos(self.options))
            self.readers.append(reader)
            nursery.start_soon(self.watch, reader)

    def _filtered(
        self, participant: DomainParticipant, topic: Topic[Shape]
    ) -> Topic[Shape] | ContentFilteredTopic[Shape]:
        """The topic with the filter that was asked for; itself if none was."""
        wanted = content_filter(self.options)
        if wanted is None:
            return topic
        try:
            return ContentFilteredTopic(participant, f"{topic.name}_filtered", topic, *wanted)
        except BadParameter:
            print("failed to create content filtered topic")
            raise

    @property
    def period_s(self) -> float:
        return self.options.read_period_ms / 1000

    async def play_round(self, number: int) -> None:
        options = self.options
        if options.is_coherent:
            print(f"Reading coherent sets, iteration {number}")
        if options.is_ordered:
            print(f"Reading with ordered access, iteration {number}")
        with self._subscriber.access():
            if options.is_ordered and options.access_scope == "g":
                # One sample of each entry, in their order.
                unread = SampleState.NOT_READ if options.reads else ANY_SAMPLE_STATE
                for reader in self._subscriber.get_datareaders(sample_states=unread):
                    self._print_from(reader, sample_states=unread)
            else:
                for reader in self.readers:
                    self._print_from(reader)

    def _print_from(self, reader: DataReader[Shape], *, sample_states: int = ANY_SAMPLE_STATE) -> None:
        look = reader.read if self.options.reads else reader.take
        samples = look(sample_states=sample_states)
        if self.options.by_instance:
            samples.sort(key=lambda sample: sample.info.instance_handle)
        for sample in samples:
            self._print(reader.topic.name, sample)

    def _print(self, topic: str, sample: Sample[Shape]) -> None:
        if sample.info.valid_data:
            print(sample_line(topic, sample.data))
        state = state_line(topic, sample.data.color, sample.info)
        if state is not None:
            print(state)
