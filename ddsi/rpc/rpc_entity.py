"""RpcEntity: what a client and a service have in common: a name, two topics, and a reader and a writer of these.

DDS-RPC 1.0 §7.9 (request-reply style), whose Requester and Replier have such a base.  Who reads which topic, and what
comes first, is theirs.
"""

from __future__ import annotations

from typing import Any, Generic, TypeVar

from ..dcps import DomainParticipant, Topic
from ..structure.qos import Qos
from ..structure.qos_policies import KeepAll, Reliable
from .correlation import CorrelatedReader, CorrelatedWriter
from .mapping import Mapping, wire

__all__ = ["RpcEntity"]

Req = TypeVar("Req")
Rep = TypeVar("Rep")

_SERVICE_QOS = Qos(reliability=Reliable(max_blocking_time=1.0), history=KeepAll())
"""Of the four endpoints of a service and its client, wherever nothing else is said."""


class RpcEntity(Generic[Req, Rep]):
    """The base of Client and Service."""

    _reader: CorrelatedReader[Any]
    _writer: CorrelatedWriter[Any]

    def __init__(
        self,
        participant: DomainParticipant,
        name: str,
        request_type: type[Req],
        reply_type: type[Rep],
        *,
        instance_name: str = "",
        mapping: Mapping = Mapping.BASIC,
        qos: Qos | None = None,
        request_topic: str | None = None,
        reply_topic: str | None = None,
    ) -> None:
        """``name`` gives the topics their names, ``name_Request`` and ``name_Reply``, unless others are given.

        ``instance_name``: of a client: ask only the service that has it, empty for any; of a service: answer only who
        asks for it, or for any.  ``qos`` goes before the default, which is reliable and keeps all.

        Raises BadParameter, InconsistentPolicy, NotAllowedBySecurity, AlreadyDeleted.
        """
        self._name = name
        self._instance_name = instance_name
        self._wire = wire(mapping, name, request_type, reply_type)
        requests: Topic[Any] = Topic(participant, request_topic or f"{name}_Request", self._wire.request_type)
        replies: Topic[Any] = Topic(participant, reply_topic or f"{name}_Reply", self._wire.reply_type)
        self._open(participant, requests, replies, _SERVICE_QOS | (qos or Qos()))

    def _open(self, participant: DomainParticipant, requests: Topic[Any], replies: Topic[Any], qos: Qos) -> None:
        """Make the reader and the writer; what is raised leaves neither."""
        raise NotImplementedError

    def close(self) -> None:
        """End it: calls that wait raise AlreadyDeleted, and requests that were taken can no longer be answered.

        Safe twice.
        """
        for entity in (self._reader, self._writer, self._reader.topic, self._writer.topic):
            entity.close()
