"""Events in words, one line each, for every event but the messages themselves (those are ``message_parts``').

``matched Square@A with Square@B``: whose engine it is stands elsewhere (in a column, or before the line).
"""

from __future__ import annotations

from ..structure.cache_change import ChangeKind
from ..structure.guid import Guid
from ..structure.locator import Locator
from ..structure.vendor import vendor_name
from . import events as e
from .event import Pairs, TraceEvent
from .names import Names
from .wording import count_text, printable, range_text, seconds_text

__all__ = ["event_text"]

_MAX_DETAIL_CHARACTERS = 160
_WRITTEN = {
    ChangeKind.ALIVE: "wrote",
    ChangeKind.NOT_ALIVE_DISPOSED: "disposed",
    ChangeKind.NOT_ALIVE_UNREGISTERED: "unregistered",
    ChangeKind.NOT_ALIVE_DISPOSED_UNREGISTERED: "disposed and unregistered",
}


def event_text(event: TraceEvent, names: Names) -> str:
    """What happened.  An event that no arm knows (a message, or one made outside this room) gives its name."""
    match event:
        case e.Dropped():
            return _dropped(event, names)
        case (
            e.ParticipantCreated()
            | e.ParticipantClosed()
            | e.ParticipantDiscovered()
            | e.ParticipantChanged()
            | e.ParticipantLost()
        ):
            return _participant(event, names)
        case e.EndpointCreated() | e.EndpointClosed() | e.EndpointDiscovered() | e.EndpointChanged() | e.EndpointLost():
            return _endpoint(event, names)
        case e.Matched() | e.Unmatched() | e.Incompatible() | e.TopicInconsistent() | e.TypesCompared():
            return _matching(event, names)
        case e.ChangeWritten() | e.SampleDelivered() | e.SampleLost() | e.SampleRejected() | e.Acknowledged():
            return _data(event, names)
        case e.LinkDropped(reason=reason):
            return f"lost ({printable(reason)})"
        case e.LinkDelayed(delay=delay):
            return f"delayed by {seconds_text(delay)}"
        case e.LinkDuplicated(copies=copies):
            return f"duplicated, {copies} in all"
        case _:
            return _other(event, names)


def _dropped(event: e.Dropped, names: Names) -> str:
    whose = f" from {names.guid(event.remote)}" if event.remote is not None else _from(event.source)
    return f"dropped{whose}: {event.reason}{_detail(event.detail)}"


def _participant(event: TraceEvent, names: Names) -> str:
    match event:
        case e.ParticipantCreated(domain_id=domain_id):
            return f"participant created in domain {domain_id}"
        case e.ParticipantDiscovered(remote=remote, lease_duration=lease, vendor_id=vendor_id):
            return f"discovered {names.guid(remote)} ({vendor_name(vendor_id)}, lease {seconds_text(lease)})"
        case e.ParticipantChanged(remote=remote):
            return f"{names.guid(remote)} changed"
        case e.ParticipantLost(remote=remote, reason=reason, detail=detail):
            return f"lost {names.guid(remote)}: {reason}{_detail(detail)}"
        case _:
            return "participant closed"


def _endpoint(event: TraceEvent, names: Names) -> str:
    match event:
        case e.EndpointCreated(endpoint=endpoint, type_name=type_name, qos=qos):
            return f"created {_role(endpoint)} {names.guid(endpoint)} ({printable(type_name)}){_qos(qos)}"
        case e.EndpointDiscovered(endpoint=endpoint, type_name=type_name, qos=qos):
            return f"discovered {_role(endpoint)} {names.guid(endpoint)} ({printable(type_name)}){_qos(qos)}"
        case e.EndpointChanged(endpoint=endpoint, qos=qos):
            return f"{_role(endpoint)} {names.guid(endpoint)} changed{_qos(qos)}"
        case e.EndpointLost(endpoint=endpoint, reason=reason, detail=detail):
            return f"lost {_role(endpoint)} {names.guid(endpoint)}: {reason}{_detail(detail)}"
        case e.EndpointClosed(endpoint=endpoint):
            return f"closed {_role(endpoint)} {names.guid(endpoint)}"
        case _:
            return event.NAME


def _matching(event: TraceEvent, names: Names) -> str:
    match event:
        case e.Matched(local=local, remote=remote):
            return f"matched {_role(local)} {names.guid(local)} with {_role(remote)} {names.guid(remote)}"
        case e.Unmatched(local=local, remote=remote, reason=reason):
            return f"unmatched {names.guid(local)} from {names.guid(remote)}: {reason}"
        case e.Incompatible(local=local, remote=remote, policy=policy, offered=offered, requested=requested):
            policies = f"{policy} offered {printable(offered)}, requested {printable(requested)}"
            return f"no match of {names.guid(local)} and {names.guid(remote)}: {policies}"
        case e.TypesCompared(local=local, remote=remote, step=step, detail=detail):
            return f"types of {names.guid(local)} and {names.guid(remote)}: {step}{_detail(detail)}"
        case e.TopicInconsistent(local=local, remote=remote, local_type=local_type, remote_type=remote_type):
            types = f"type {printable(local_type)} here, {printable(remote_type)} there"
            return f"no match of {names.guid(local)} and {names.guid(remote)}: {types}"
        case _:
            return event.NAME


def _data(event: TraceEvent, names: Names) -> str:
    match event:
        case e.ChangeWritten(writer=writer, sequence_number=number, kind=kind, payload_octets=octets):
            return f"{_WRITTEN[kind]} {_entity(writer, names)} #{number} ({count_text(octets, 'octet')})"
        case e.SampleDelivered(reader=reader, writer=writer, sequence_number=number):
            return f"delivered {_entity(reader, names)} #{number} of {names.letter(writer.prefix)}"
        case e.SampleLost(reader=reader, writer=writer, first=first, last=last, reason=reason, detail=detail):
            lost = f"lost {_entity(reader, names)} #{range_text(first, last)} of {names.letter(writer.prefix)}"
            return f"{lost}: {reason}{_detail(detail)}"
        case e.SampleRejected(reader=reader, writer=writer, sequence_number=number, reason=reason):
            return f"rejected {_entity(reader, names)} #{number} of {names.letter(writer.prefix)}: {reason}"
        case e.Acknowledged(writer=writer, reader=reader, sequence_number=number):
            return f"{names.guid(reader)} has {_entity(writer, names)} up to #{number}"
        case _:
            return event.NAME


def _other(event: TraceEvent, names: Names) -> str:
    match event:
        case e.TimerFired(timer=timer, deadline=deadline):
            late = event.now - deadline
            return f"timer {printable(timer)}{f' ({seconds_text(round(late, 6))} late)' if late > 1e-6 else ''}"
        case e.LivelinessChanged(reader=reader, writer=writer, alive=alive):
            return f"{names.guid(writer)} is {'alive' if alive else 'not alive'} for {_entity(reader, names)}"
        case e.StatusChanged(entity=entity, status=status, detail=detail):
            return f"{printable(status)} of {names.guid(entity)}{_detail(detail)}"
        case e.SecurityEvent(remote=remote, what=what, detail=detail):
            return (
                f"security: {printable(what)}{f' {names.guid(remote)}' if remote is not None else ''}{_detail(detail)}"
            )
        case e.Remark(text=text):
            return printable(text, limit=_MAX_DETAIL_CHARACTERS)
        case _:
            return event.NAME


def _role(guid: Guid) -> str:
    return "writer" if guid.entity_id.is_writer else "reader"


def _entity(guid: Guid, names: Names) -> str:
    return names.entity(guid.prefix, guid.entity_id)


def _from(source: Locator | None) -> str:
    return "" if source is None else f" from {source}"


def _detail(detail: str) -> str:
    return f" ({printable(detail, limit=_MAX_DETAIL_CHARACTERS)})" if detail else ""


def _qos(qos: Pairs) -> str:
    """The policies that are not the defaults, by their values alone: ``, Reliable(max_blocking_time=0.1)``."""
    return "".join(f", {printable(text, limit=_MAX_DETAIL_CHARACTERS)}" for _, text in qos)
