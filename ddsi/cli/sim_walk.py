"""Walk: the meeting of two secured participants in a simulation, told line by line as it happens.

DDS-Security 1.1 §8.8.2 to §8.8.10.  What each says is heard at the seam (:mod:`.sim_seam`), what it comes to is taken
from the trace.  Of tokens and keys only names and sizes are told.
"""

from __future__ import annotations

import textwrap
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from enum import Enum
from typing import cast

from ..config import Config
from ..messages.acknack import AckNack
from ..messages.heartbeat import Heartbeat
from ..simulation import Domain, LinkConditions, Node, Vendor
from ..simulation.vendor_hooks import VendorHooks
from ..spi import SecurityHooks, load_hooks
from ..structure import builtin_entity_ids as ids
from ..structure.guid import EntityId, Guid, GuidPrefix
from ..structure.qos import Qos
from ..structure.qos_policies import KeepAll, Properties, Reliable
from ..trace.event import TraceEvent
from ..trace.events import Matched, SampleDelivered, SecurityEvent
from ..trace.names import Names
from ..trace.reasons import SecurityStep
from ..trace.wording import number_ranges, range_text
from .sim_handshake_words import KINDS
from .sim_messages import Message, message_of
from .sim_seam import Said, WatchedHooks

__all__ = ["Walk"]

_DELAY_S = 0.001
_LARGEST_MESSAGE = 65_000
"""Each message of the handshake in one datagram, so that losing it is losing one."""
_LIMIT_S = 20.0
_AFTERMATH_S = 0.01
_TOPIC = "Square"
_QOS = Qos(reliability=Reliable(), history=KeepAll())
_SAMPLE_OCTETS = 32
_INDENT = " " * 22
_CLAUSES = {"HEARTBEAT": "RTPS 2.5 §8.3.8.6; §8.5.1.9.2", "ACKNACK": "RTPS 2.5 §8.3.8.1; §8.5.1.9.3"}


@dataclass(slots=True)
class _Side:
    """One of the two.  ``path``: the states that its handshake went through and that were not told yet."""

    name: str
    hooks: WatchedHooks
    path: list[Enum] = field(default_factory=list)
    cause: str = ""


@dataclass(slots=True)
class _Loss:
    """What was lost, and what is known since: who noticed, and when it was said again."""

    message: Message
    at: float
    sender: str
    receiver: str
    noticed: str = ""
    repeated_at: float | None = None


class Walk:
    """``identities``: the security properties of two participants, by name.  ``dropped``: a kind of message by its
    name, or a message by its number.  ``vendor``: whom the second plays.
    ``pause()`` is called between datagrams until it is False."""

    def __init__(
        self,
        identities: dict[str, Properties],
        *,
        seed: int,
        vendor: Vendor | None,
        dropped: str | int | None,
        started_ns: int,
        width: int,
        ascii_only: bool,
        pause: Callable[[], bool] | None,
    ) -> None:
        self._dropped = dropped
        self._vendor = vendor
        self._width = width
        self._arrow, self._cross, self._clause = ("->", "x", "clause ") if ascii_only else ("→", "✗", "§")
        self._pause = pause
        self._sides: dict[GuidPrefix, _Side] = {}
        self._names = Names()
        self._count = 0
        self._explained: set[str] = set()
        self._arrived: set[tuple[object, ...]] = set()
        self._numbers: dict[tuple[object, ...], int] = {}
        self._loss: _Loss | None = None
        self._lost: set[tuple[object, ...]] = set()
        self._domain = Domain(seed, conditions=LinkConditions(delay=_DELAY_S), trace=self._notice)
        self._domain.network.loses = lambda sender, receiver, octets: True  # until both are there
        for (name, properties), played in zip(identities.items(), (None, vendor), strict=True):
            self._join(name, properties, started_ns, played)
        self._domain.network.loses = self._sent

    def _join(self, name: str, properties: Properties, started_ns: int, vendor: Vendor | None) -> None:
        side: _Side

        def moved(before: Enum | None, after: Enum, cause: str) -> None:
            if not side.path:
                side.cause = cause
                side.path.extend([before] if before is not None else [])
            side.path.append(after)

        inner = load_hooks(
            properties,
            entropy=self._domain.dice.fork().octets,
            wall_clock=lambda: started_ns + int(self._domain.now * 1e9),
        )
        # What is watched is what leaves at last, quirks and all.  Either passes on what it does not name itself.
        played = VendorHooks(inner, vendor.quirks if vendor is not None else ())
        side = _Side(name, WatchedHooks(cast(SecurityHooks, played), moved, teller=inner))
        hooks = cast(SecurityHooks, side.hooks)
        node = self._domain.node(
            name=name,
            config=vendor.config(Config()) if vendor is not None else None,
            properties=properties,
            make_hooks=lambda: hooks,
            max_message_octets=_LARGEST_MESSAGE,
        )
        node.played = played
        played.joined(node.engine)
        self._sides[node.guid.prefix] = side

    # --- the walk ----------------------------------------------------------------------------------------

    def run(self) -> bool:
        """Until a sample has crossed, protected; returns whether it did, and what was to be lost was."""
        first, second = self._domain.nodes
        lower, higher = sorted((first, second), key=lambda node: node.guid)
        for node in (lower, higher):
            self._tell(f"{node.name} is {node.guid}")
        self._tell(f"{lower.name} has the lower Guid and begins (§8.3.2.11.3).  Clauses are of DDS-Security 1.1.")
        if self._vendor is not None:
            self._tell(f"{second.name} plays {self._vendor.name} by its quirks.")
        writer = first.writer(_TOPIC, _QOS)
        reader = second.reader(_TOPIC, _QOS)
        is_matched = self._live(lambda: bool(writer.matched_count and reader.matched_count))
        if is_matched:
            writer.write(_SAMPLE_OCTETS)
        is_done = is_matched and self._live(lambda: bool(reader.taken))
        loss = self._loss
        if loss is not None and loss.message.is_reliable:
            is_done = is_done and self._live(lambda: loss.repeated_at is not None)
        self._live(lambda: False, _AFTERMATH_S)
        self._tell("")
        if self._vendor is not None:
            self._tell_quirks(second)
        return self._conclude(is_done)

    def _live(self, condition: Callable[[], bool], limit_s: float = _LIMIT_S) -> bool:
        def is_over() -> bool:
            self._tell_states()
            return condition()

        return self._domain.run_until(is_over, limit_s)

    def _tell_quirks(self, node: Node) -> None:
        """Those that had something to do, as they stand in ``ddsi.simulation.quirks``."""
        acts = node.played.acts if node.played is not None else {}
        told = ", ".join(f"{quirk.__name__} {count}" for quirk, count in acts.items() if count)
        self._tell(f"What {node.name} did otherwise than we do, and how often: {told or 'nothing'}.")

    def _conclude(self, is_done: bool) -> bool:
        if not is_done:
            missing = "no sample has crossed" if self._loss is None else "what was lost is not repaired"
            self._tell(f"After {self._domain.now:g} s {missing}.")
            return False
        if self._loss is None:
            if self._dropped is None:
                self._tell(f"{self._count} messages, nothing lost.  --drop MESSAGE loses one.")
            else:
                self._tell(f"No message {self._dropped} was sent, so none was lost.")
            return self._dropped is None
        loss = self._loss
        kind = KINDS[loss.message.kind]
        self._tell(f"Lost: {loss.message.number} {kind.title} of {loss.sender} to {loss.receiver}, at {loss.at:.6f} s.")
        if loss.repeated_at is None:
            self._tell("It was never said again: nothing came to need it.")
        else:
            self._tell(f"Noticed by {loss.noticed}.")
            later = loss.repeated_at - loss.at
            self._tell(f"Said again at {loss.repeated_at:.6f} s, {later:.3f} s after it was lost.")
        self._tell(f"The rule: {kind.repair}")
        return True

    # --- what happens ------------------------------------------------------------------------------------

    def _notice(self, event: TraceEvent) -> None:
        """From the trace: what it comes to."""
        self._names.learn_event(event)
        side = self._sides.get(event.participant)
        if side is None:
            return
        match event:
            case SecurityEvent(what=SecurityStep.ADMITTED):
                self._tell_states()
                self._tell_result(side, "admits the other: its permissions allow it to join (§8.4.2.9.2, §8.4.2.9.9)")
            case SecurityEvent(what=SecurityStep.REFUSED, detail=detail):
                self._tell_states()
                self._tell_result(side, f"refuses: {detail}")
            case Matched(local=local, topic_name=topic_name) if not local.entity_id.is_builtin:
                role = "writer" if local.entity_id.is_writer else "reader"
                self._tell_result(side, f"matches its {role} of {topic_name}: no key is missing any more (§8.8.9)")
            case SampleDelivered(reader=reader) if not reader.entity_id.is_builtin:
                opened = "what was protected is opened (§8.5.1.9.5 to §8.5.1.9.9)"
                self._tell_result(side, f"has the sample of {_TOPIC}; {opened}")

    def _sent(self, sender: GuidPrefix, receiver: GuidPrefix, octets: bytes) -> bool:
        """A datagram is on its way; True to lose it."""
        side, other = self._sides.get(sender), self._sides.get(receiver)
        if side is None or other is None:
            return False
        said = side.hooks.said_in(octets)
        messages, notes = self._messages(said), self._notes(said)
        is_lost = self._loss is None and any(self._dropped in (it.kind, it.number) for it in messages)
        self._tell_states()
        if messages or notes:
            if self._pause is not None and not self._pause():
                self._pause = None
            self._tell(f"{self._domain.now:.6f} s  {side.name} {self._arrow} {other.name}")
        for message in messages:
            self._tell_message(message, side)
        for note in notes:
            self._tell(note, indent=_INDENT)
        if is_lost:
            self._lose(messages, side, other)
        else:
            self._arrived.update(message.identity for message in messages)
            self._watch_for_repair(side, said, messages)
        return is_lost

    def _lose(self, messages: Sequence[Message], side: _Side, other: _Side) -> None:
        self._lost = {message.identity for message in messages}
        named = next(message for message in messages if self._dropped in (message.kind, message.number))
        self._loss = _Loss(named, self._domain.now, side.name, other.name)
        company = len(messages) - 1
        also = f", and {company} more in the same datagram" if company else ""
        self._tell(f"{self._cross} lost: {named.number}{also}.  Nobody knows yet.", indent=_INDENT)

    def _watch_for_repair(self, side: _Side, said: Sequence[Said], messages: Sequence[Message]) -> None:
        loss = self._loss
        if loss is None or loss.repeated_at is not None:
            return
        is_asked_for = side.name == loss.receiver and any(loss.message.is_asked_for_by(it.submessage) for it in said)
        if is_asked_for and not loss.noticed:
            loss.noticed = f"{side.name}, which asks by ACKNACK at {self._domain.now:.6f} s"
        for message in messages:
            is_repeated = self._numbers[message.identity] < message.number
            if is_repeated and not loss.noticed and not loss.message.is_reliable:
                loss.noticed = f"{side.name} at {self._domain.now:.6f} s ({_because(side.hooks.cause)})"
            if message.identity == loss.message.identity:
                loss.repeated_at = self._domain.now

    # --- what is in a datagram ---------------------------------------------------------------------------

    def _messages(self, said: Sequence[Said]) -> list[Message]:
        """Those that count, numbered; an announcement that has arrived before is none."""
        messages = []
        for it in said:
            message = message_of(it, self._count + 1)
            if message is None or (message.kind == "announcement" and message.identity in self._arrived):
                continue
            self._count += 1
            messages.append(message)
        return messages

    def _notes(self, said: Sequence[Said]) -> list[str]:
        """The last HEARTBEAT and ACKNACK of each topic that carries keys or samples, unless it says nothing; and of the
        one on which something was lost."""
        notes: dict[tuple[Guid, str], str] = {}
        for it in said:
            if not isinstance(it.submessage, Heartbeat | AckNack) or not self._is_worth_a_note(it.submessage.writer_id):
                continue
            topic = self._names.entity(it.sender.prefix, it.sender.entity_id)
            match it.submessage:
                case Heartbeat(first_sn=first, last_sn=last) if last >= first:
                    notes[it.sender, "HEARTBEAT"] = f"HEARTBEAT of {topic} has {range_text(first, last)}"
                case AckNack(reader_sn_state=wanted) if wanted:
                    notes[it.sender, "ACKNACK"] = f"ACKNACK of {topic} lacks {number_ranges(wanted)}"
                case AckNack(reader_sn_state=wanted) if wanted.base > 1:
                    notes[it.sender, "ACKNACK"] = f"ACKNACK of {topic} has all before {wanted.base}"
        return [f"{text}  [{_CLAUSES[name]}]" for (_, name), text in notes.items()]

    def _is_worth_a_note(self, writer: EntityId) -> bool:
        if not writer.is_builtin or writer == ids.PARTICIPANT_VOLATILE_MESSAGE_SECURE_WRITER:
            return True
        return self._loss is not None and self._loss.message.data.writer_id == writer

    # --- telling -----------------------------------------------------------------------------------------

    def _tell_message(self, message: Message, side: _Side) -> None:
        kind = KINDS[message.kind]
        number = f"{message.number:>18}  "
        self._tell(f"{kind.title}{self._about(message)}{self._again(message, side)}  [{kind.clause}]", indent=number)
        self._numbers.setdefault(message.identity, message.number)
        if message.kind in self._explained:
            return
        self._explained.add(message.kind)
        for text in (kind.purpose, message.contents(), message.protection()):
            if text:
                self._tell(text, indent=_INDENT)

    def _about(self, message: Message) -> str:
        """Which endpoint it concerns."""
        sender = message.said.sender
        if message.kind in ("discovery", "data"):
            return f" of {self._names.entity(sender.prefix, sender.entity_id)} #{message.data.writer_sn}"
        if message.kind in ("writer-tokens", "reader-tokens") and message.outline is not None:
            source = message.outline.source_endpoint
            return f" for {self._names.entity(source.prefix, source.entity_id)}"
        return ""

    def _again(self, message: Message, side: _Side) -> str:
        before = self._numbers.get(message.identity)
        if before is None:
            return ""
        why = "" if message.is_reliable else f" ({_because(side.hooks.cause)})"
        return f"{why}: {before} again{', which was lost' if message.identity in self._lost else ''}"

    def _tell_states(self) -> None:
        for side in self._sides.values():
            if side.path:
                states = f" {self._arrow} ".join(state.name for state in side.path)
                self._tell_result(side, f"({_because(side.cause)}) {states}: {side.path[-1].value}")
                side.path.clear()

    def _tell_result(self, side: _Side, text: str) -> None:
        self._tell(text, indent=f"{self._domain.now:.6f} s  {side.name:<8}  ")

    def _tell(self, text: str, *, indent: str = "") -> None:
        lines = textwrap.wrap(
            text.replace("§", self._clause),
            self._width,
            initial_indent=indent,
            subsequent_indent=_INDENT if indent else "",
            break_long_words=False,
        )
        print("\n".join(lines), flush=True)


def _because(cause: str) -> str:
    if cause in KINDS:
        return f"the {KINDS[cause].title} came"
    return "it has seen the other's announcement" if cause == "the announcement" else cause
