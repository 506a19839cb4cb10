"""Endpoint: what DataWriter and DataReader share - policies from three places, which may change.

DDS 1.4 §2.2.2.4.2, §2.2.2.5.3, §2.2.3.  An endpoint has the policies that it was given; where it was given none, those
of its publisher or subscriber; then those of its topic.  Whoever of the three changes, the change is planned for all
endpoints that it concerns, and done for all or for none.
"""

from __future__ import annotations

from collections.abc import Iterable
from typing import TYPE_CHECKING, Any

from ..engine import LocalReader, LocalWriter
from ..structure.dataclass import dataclass
from ..structure.qos import EndpointQos, Qos
from .entity import Entity

if TYPE_CHECKING:
    from .entity import Parent
    from .participant import DomainParticipant
    from .topic import Topic

__all__ = ["Endpoint", "QosPlan", "follow_all"]


@dataclass(frozen=True, slots=True)
class QosPlan:
    """What an endpoint's policies are to become: ``own`` those that it sets itself, ``resolved`` all of them."""

    endpoint: Endpoint
    own: Qos
    merged: Qos
    resolved: EndpointQos


class Endpoint(Entity):
    """The base of DataWriter and DataReader."""

    _participant: DomainParticipant
    _parent: Parent
    _topic: Topic[Any]
    _endpoint_qos: EndpointQos

    @property
    def topic(self) -> Topic[Any]:
        return self._topic

    @property
    def endpoint_qos(self) -> EndpointQos:
        """Every policy as it holds for this endpoint now, defaults filled in."""
        return self._endpoint_qos

    def _plan(self, *, own: Qos | None = None, group: Qos | None = None, topic: Qos | None = None) -> QosPlan:
        """Its policies with these, each in the place of the present ones.  Raises InconsistentPolicy."""
        own = own if own is not None else self._own_qos
        group = group if group is not None else self._parent.endpoint_defaults
        topic = topic if topic is not None else self._topic.qos
        merged = topic | group | own
        return QosPlan(self, own, merged, self._resolve(merged))

    def _resolve(self, merged: Qos) -> EndpointQos:
        """All policies, of the kind of endpoint that it is.  Raises InconsistentPolicy."""
        raise NotImplementedError

    def _local(self) -> LocalWriter | LocalReader:
        """Itself, as the engine has it."""
        raise NotImplementedError

    def _follow(self, plan: QosPlan) -> None:
        """Do as planned; it was checked."""
        self._own_qos, self._qos, self._endpoint_qos = plan.own, plan.merged, plan.resolved

    def _create(self, plan: QosPlan) -> None:
        """Make it in the engine, and enable it there if it is enabled.  Raises NotAllowedBySecurity."""
        raise NotImplementedError

    def _delete(self, local: LocalWriter | LocalReader) -> None:
        """Undo :meth:`_create`."""
        raise NotImplementedError

    def _create_anew(self, plan: QosPlan) -> None:
        """It is not enabled, so whatever it is to become it may; nobody has seen it yet."""
        before = self._local()
        self._create(plan)
        self._delete(before)
        Endpoint._follow(self, plan)

    def _say_farewell(self) -> None:
        """It is about to end: a last word, if it has one."""

    @property
    def _factory(self) -> Parent:
        return self._parent

    def _change_qos(self, after: Qos) -> None:
        follow_all([self._plan(own=after)])


def follow_all(plans: Iterable[QosPlan]) -> None:
    """Every plan, or none.  Raises ImmutablePolicy, NotAllowedBySecurity."""
    plans = list(plans)
    for plan in plans:
        endpoint = plan.endpoint
        if endpoint.is_enabled:
            endpoint._participant._running_pump().engine.qos_changes.check(endpoint._local(), plan.resolved)
    for plan in plans:
        if plan.endpoint.is_enabled:
            plan.endpoint._follow(plan)
        else:
            plan.endpoint._create_anew(plan)
