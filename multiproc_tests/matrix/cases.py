"""The cases: for each its claim, the options of both programs, what they must be able to do, and the play.

A case that does not need keys runs without them, so that every peer can take part.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

from ..framework import Capture, Weather
from ..peers.options import Options
from ..peers.peer import Ability
from .stories import Story, deliver, deliver_late, deliver_some, refuse, say_goodbye

__all__ = ["CASES", "Case"]

MEBIBYTE = 1 << 20


@dataclass(frozen=True, slots=True, kw_only=True)
class Case:
    """One claim about two programs.  ``publisher`` and ``subscriber`` change ``options`` for one of them."""

    name: str
    claim: str
    story: Story
    options: Options
    needs: frozenset[Ability] = frozenset()
    publisher: Mapping[str, Any] = field(default_factory=dict)
    subscriber: Mapping[str, Any] = field(default_factory=dict)
    is_quick: bool = False
    """Part of every test run, with each peer in both roles; the others run on request."""
    quick_pairs: frozenset[tuple[str, str]] = frozenset()
    """Part of every test run with these publishers and subscribers only."""
    is_ours: bool = False
    """Not for the others among themselves."""
    keystore: Callable[[], Path] | None = None
    """The folder that the options' keystores are in; made when it is first asked for."""
    evidence: Callable[[Capture], Sequence[str]] | None = None
    """What the capture of the play lacks, a line each; without it nothing is captured."""
    weather: Weather | None = None
    """Two hosts and this between them, instead of one."""

    def publisher_options(self) -> Options:
        return self._with_keystore(replace(self.options, **self.publisher))

    def subscriber_options(self) -> Options:
        return self._with_keystore(replace(self.options, **self.subscriber))

    def is_quick_for(self, publisher: str, subscriber: str) -> bool:
        """Is it part of every test run with these two?"""
        return self.is_quick or (publisher, subscriber) in self.quick_pairs

    def _with_keystore(self, options: Options) -> Options:
        if self.keystore is None or options.keystore is None:
            return options
        return replace(options, keystore=os.fspath(self.keystore() / options.keystore))


KEYLESS = Options(keyless=True)
KEYED = Options()

CASES = (
    Case(
        name="best-effort",
        claim="best-effort samples arrive, once and in order",
        story=deliver_some,
        options=replace(KEYLESS, best_effort=True, volatile=True, count=40),
        publisher={"gate": True},
        subscriber={"count": 20},
        is_quick=True,
    ),
    Case(
        name="reliable",
        claim="all reliable samples arrive, once and in order, and are acknowledged",
        story=deliver,
        options=replace(KEYLESS, count=20),
        is_quick=True,
    ),
    Case(
        name="reliable-volatile",
        claim="reliable samples written after the match arrive also without durability",
        story=deliver,
        options=replace(KEYLESS, volatile=True),
        publisher={"gate": True},
    ),
    Case(
        name="burst",
        claim="a thousand samples written without pause arrive, once and in order",
        story=deliver,
        options=replace(KEYLESS, count=1000, interval_ms=0),
    ),
    Case(
        name="keyed-dispose",
        claim="a disposed instance is reported with its key",
        story=deliver,
        options=replace(KEYED, dispose=True),
        needs=frozenset({Ability.KEYS}),
        is_quick=True,
    ),
    Case(
        name="keyed-unregister",
        claim="an unregistered instance is reported, with its key, as without writers and not as disposed",
        story=deliver,
        options=replace(KEYED, unregister=True),
        needs=frozenset({Ability.KEYS}),
        is_quick=True,
    ),
    Case(
        name="short-key-dispose",
        claim="the same with a key that is its own key hash",
        story=deliver,
        options=replace(KEYED, blob_octets=100, dispose=True),
        needs=frozenset({Ability.KEYS}),
    ),
    Case(
        name="late-joiner",
        claim="a transient-local subscriber that comes late gets all that is kept",
        story=deliver_late,
        options=KEYLESS,
        publisher={"readers": 0},
        is_quick=True,
    ),
    Case(
        name="late-joiner-keyed",
        claim="of three instances with KEEP_LAST 2, a late joiner gets the last two samples of each",
        story=deliver_late,
        options=replace(KEYED, colors=("RED", "GREEN", "BLUE"), depth=2, count=9),
        needs=frozenset({Ability.KEYS}),
        publisher={"readers": 0},
        subscriber={"count": 6},
    ),
    Case(
        name="fragments-few",
        claim="samples of 20 kB arrive whole",
        story=deliver,
        options=replace(KEYLESS, topic="Blob", blob_octets=20_000),
        publisher={"gate": True},
    ),
    Case(
        name="fragments",
        claim="samples of 1 MiB arrive whole, in DATA_FRAGs",
        story=deliver,
        options=replace(KEYLESS, topic="Blob", blob_octets=MEBIBYTE, count=3, interval_ms=300),
        publisher={"gate": True},
        needs=frozenset({Ability.LARGE}),
        is_quick=True,
    ),
    Case(
        name="fragments-keyed",
        claim="large samples with a key arrive, and the dispose after them",
        story=deliver,
        options=replace(KEYED, topic="Blob", blob_octets=200_000, dispose=True),
        needs=frozenset({Ability.KEYS, Ability.LARGE}),
    ),
    Case(
        name="fragments-late",
        claim="large samples arrive whole also when they are all history",
        story=deliver_late,
        options=replace(KEYLESS, topic="Blob", blob_octets=300_000, count=4),
        needs=frozenset({Ability.LARGE}),
        publisher={"readers": 0},
    ),
    Case(
        name="xcdr2",
        claim="a final type in XCDR2",
        story=deliver,
        options=replace(KEYED, representation=2, dispose=True),
        needs=frozenset({Ability.KEYS, Ability.XCDR2}),
        is_quick=True,
    ),
    Case(
        name="appendable-xcdr2",
        claim="an appendable type with 8-octet members in XCDR2 (delimited, aligned to 4)",
        story=deliver,
        options=replace(KEYED, appendable=True, representation=2),
        needs=frozenset({Ability.KEYS, Ability.APPENDABLE_XCDR2}),
        is_quick=True,
    ),
    Case(
        name="appendable-xcdr2-dispose",
        claim="the key alone of an appendable type in XCDR2",
        story=deliver,
        options=replace(KEYED, appendable=True, representation=2, dispose=True),
        needs=frozenset({Ability.KEYS, Ability.APPENDABLE_XCDR2}),
    ),
    Case(
        name="appendable-xcdr1",
        claim="an appendable type with 8-octet members in XCDR1 (aligned to 8)",
        story=deliver,
        options=replace(KEYED, appendable=True, representation=1),
        needs=frozenset({Ability.KEYS, Ability.APPENDABLE_XCDR1}),
        is_quick=True,
    ),
    Case(
        name="unicast",
        claim="two on one host find each other without multicast",
        story=deliver,
        options=replace(KEYED, unicast=True),
        needs=frozenset({Ability.KEYS, Ability.UNICAST}),
        is_quick=True,
    ),
    Case(
        name="partition",
        claim="a partition of one that fits a wildcard of the other",
        story=deliver,
        options=KEYLESS,
        needs=frozenset({Ability.PARTITIONS}),
        publisher={"partitions": ("elsewhere", "plant.north")},
        subscriber={"partitions": ("plant.*",)},
    ),
    Case(
        name="goodbye",
        claim="a publisher that leaves is unmatched at once",
        story=say_goodbye,
        options=KEYLESS,
        is_quick=True,
    ),
    Case(
        name="refused-reliability",
        claim="a best-effort writer does not match a reliable reader",
        story=refuse,
        options=replace(KEYLESS, wait_s=2),
        publisher={"best_effort": True},
    ),
    Case(
        name="refused-partition",
        claim="different partitions do not match",
        story=refuse,
        options=replace(KEYLESS, wait_s=2),
        needs=frozenset({Ability.PARTITIONS}),
        publisher={"partitions": ("north",)},
        subscriber={"partitions": ("south",)},
    ),
)
