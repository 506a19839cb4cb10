"""What ``ddsi-shape-main`` prints: the lines that the OMG's interoperability suite looks for, and people read.

One call, one line: nothing of two tasks is ever mixed within a line.
"""

from __future__ import annotations

from ..structure.sample_info import InstanceState, SampleInfo
from ..structure.status import (
    InconsistentTopic,
    LivelinessChanged,
    LivelinessLost,
    OfferedDeadlineMissed,
    OfferedIncompatibleQos,
    PublicationMatched,
    RequestedDeadlineMissed,
    RequestedIncompatibleQos,
    Status,
    SubscriptionMatched,
)
from .shape_types import Shape

__all__ = ["sample_line", "state_line", "status_line"]

_STATES = {
    InstanceState.NOT_ALIVE_NO_WRITERS: "NOT_ALIVE_NO_WRITERS_INSTANCE_STATE",
    InstanceState.NOT_ALIVE_DISPOSED: "NOT_ALIVE_DISPOSED_INSTANCE_STATE",
}


def sample_line(topic: str, shape: Shape) -> str:
    """Topic, colour, place and size; of a payload, its last octet."""
    payload = getattr(shape, "additional_payload_size", b"")
    tail = f" {{{payload[-1]}}}" if len(payload) else ""
    return f"{topic:<10} {shape.color:<10} {shape.x:03d} {shape.y:03d} [{shape.shapesize}]{tail}"


def state_line(topic: str, color: str, info: SampleInfo) -> str | None:
    """That the instance is not alive; None while it is."""
    state = _STATES.get(info.instance_state)
    return f"{topic:<10} {color:<10} {state}" if state is not None else None


def status_line(topic: str, type_name: str, status: Status) -> str | None:
    """A status as the listener of the other programs says it; None for those that they keep to themselves."""
    about = f"topic: '{topic}'  type: '{type_name}'"
    match status:
        case InconsistentTopic():
            return f"on_inconsistent_topic() {about}"
        case PublicationMatched(current_count=count, current_count_change=change):
            return f"on_publication_matched() {about} : matched readers {count} (change = {change})"
        case SubscriptionMatched(current_count=count, current_count_change=change):
            return f"on_subscription_matched() {about} : matched writers {count} (change = {change})"
        case OfferedIncompatibleQos():
            return f"on_offered_incompatible_qos() {about} : {_policy(status)}"
        case RequestedIncompatibleQos():
            return f"on_requested_incompatible_qos() {about} : {_policy(status)}"
        case OfferedDeadlineMissed(total_count=total, total_count_change=change):
            return f"on_offered_deadline_missed() {about} : (total = {total}, change = {change})"
        case RequestedDeadlineMissed(total_count=total, total_count_change=change):
            return f"on_requested_deadline_missed() {about} : (total = {total}, change = {change})"
        case LivelinessLost(total_count=total, total_count_change=change):
            return f"on_liveliness_lost() {about} : (total = {total}, change = {change})"
        case LivelinessChanged(alive_count=alive, not_alive_count=not_alive):
            return f"on_liveliness_changed() {about} : (alive = {alive}, not_alive = {not_alive})"
        case _:
            return None


def _policy(status: OfferedIncompatibleQos | RequestedIncompatibleQos) -> str:
    """The number and name of the policy that does not fit, such as ``11 (RELIABILITY)``."""
    names = [reason.policy for reason in status.incompatibilities if reason.policy_id == status.last_policy_id]
    return f"{status.last_policy_id} ({names[0].upper() if names else '?'})"
