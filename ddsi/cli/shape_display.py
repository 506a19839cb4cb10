"""Where shapes are shown: a field that is painted over and over, or a line per sample where there is no terminal."""

from __future__ import annotations

import sys
from abc import ABC, abstractmethod
from collections import Counter
from collections.abc import Iterable

import trio

from ..trace.wording import count_text
from .shape_field import DrawnShape, ShapeField
from .tables import shown
from .terminal import Screen, can_print, terminal_height, terminal_width, uses_colour

__all__ = ["FieldDisplay", "LineDisplay", "ShapeDisplay"]

_FRAME_S = 0.05
_MOST_SHAPES = 1000
"""Instances are named by whoever writes; more than these are counted, but not drawn."""
_BELOW_THE_FIELD = 6
_MOST_NOTICES = 2


class ShapeDisplay(ABC):
    """What a publisher or subscriber tells of its shapes."""

    @abstractmethod
    def show(self, shape: DrawnShape) -> None:
        """A sample was written or received."""

    @abstractmethod
    def remove(self, topic: str, color: str, why: str) -> None:
        """An instance came to its end."""

    @abstractmethod
    def match(self, topic: str, kind: str, count: int) -> None:
        """So many endpoints of the other kind are matched now."""

    @abstractmethod
    def notice(self, text: str) -> None:
        """Something that the user should know."""

    @abstractmethod
    async def paint(self) -> None:
        """Whatever must be done from time to time; runs until it is cancelled."""

    @abstractmethod
    def finish(self) -> None:
        """The end: say what should stay on the screen."""


class LineDisplay(ShapeDisplay):
    """Samples on standard output, in the form of the OMG's interoperability suite; all else on standard error."""

    def show(self, shape: DrawnShape) -> None:
        print(f"{shape.topic:<10} {shown(shape.color):<10} {shape.x:03d} {shape.y:03d} [{shape.size}]", flush=True)

    def remove(self, topic: str, color: str, why: str) -> None:
        print(f"{topic:<10} {shown(color):<10} {why}", flush=True)

    def match(self, topic: str, kind: str, count: int) -> None:
        self.notice(f"{topic}: {count_text(count, kind)} matched")

    def notice(self, text: str) -> None:
        print(f"ddsi shapes: {text}", file=sys.stderr, flush=True)

    async def paint(self) -> None:
        await trio.sleep_forever()

    def finish(self) -> None:
        pass  # Every line is out already.


class FieldDisplay(ShapeDisplay):
    """The shapes in their field, with counts and the latest notices below."""

    def __init__(self, title: str, topics: Iterable[str]) -> None:
        self._title = title
        self._shapes: dict[tuple[str, str], DrawnShape] = {}
        self._counts: Counter[str] = Counter(dict.fromkeys(topics, 0))
        self._matched: dict[str, str] = {}
        self._notices: list[str] = []

    def show(self, shape: DrawnShape) -> None:
        key = (shape.topic, shape.color)
        self._counts[shape.topic] += 1
        if key in self._shapes or len(self._shapes) < _MOST_SHAPES:
            self._shapes[key] = shape

    def remove(self, topic: str, color: str, why: str) -> None:
        self._shapes.pop((topic, color), None)
        self.notice(f"{topic} {color}: {why}")

    def match(self, topic: str, kind: str, count: int) -> None:
        self._matched[topic] = count_text(count, kind)

    def notice(self, text: str) -> None:
        self._notices = [*self._notices[-_MOST_NOTICES + 1 :], text]

    async def paint(self) -> None:
        with Screen() as screen:
            while True:
                screen.paint(self.lines())
                await trio.sleep(_FRAME_S)

    def finish(self) -> None:
        # What the field showed is gone from the screen by now.
        for text in self._texts():
            print(text)

    def lines(self) -> list[str]:
        """The picture as it is now."""
        width = terminal_width()
        rows = terminal_height() - _BELOW_THE_FIELD
        field = ShapeField(width, rows, colour=uses_colour(), blocks=can_print("┌█"))
        texts = [f"{self._title}; Ctrl+C ends", *self._texts()]
        return [*field.lines(self._shapes.values()), *(text[: width - 1] for text in texts)]

    def _texts(self) -> list[str]:
        counts = (
            f"{topic:<10} {count_text(count, 'sample')}, {self._matched.get(topic, 'nobody')} matched"
            for topic, count in self._counts.items()
        )
        return [shown(text) for text in (*counts, *self._notices)]
