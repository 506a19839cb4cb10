"""Client: asks, and waits for the answer that is its own.  DDS-RPC 1.0 §7.9 (request-reply style: Requester)."""

from __future__ import annotations

from typing import Any, Generic, TypeVar

import trio

from ..dcps import DomainParticipant, Sample, Topic
from ..dcps.entity import deadline_scope
from ..structure.errors import AlreadyDeleted, DdsTimeout
from ..structure.guid import Guid
from ..structure.qos import Qos
from .correlation import CorrelatedReader, CorrelatedSample, CorrelatedWriter, Identity
from .identity import RemoteError
from .rpc_entity import RpcEntity

__all__ = ["Client"]

Req = TypeVar("Req")
Rep = TypeVar("Rep")


class _Pending(Generic[Rep]):
    """One call that waits."""

    __slots__ = ("answer", "arrived")

    def __init__(self) -> None:
        self.answer: Rep | RemoteError | None = None
        self.arrived = trio.Event()


class Client(RpcEntity[Req, Rep]):
    """Calls a service by its name; any number of calls at once.  Closed with its participant, or by :meth:`close`.

    Replies to others, and those that come too late, are dropped as they arrive.
    """

    def _open(self, participant: DomainParticipant, requests: Topic[Any], replies: Topic[Any], qos: Qos) -> None:
        self._pending: dict[Identity, _Pending[Rep]] = {}
        self._call_count = 0
        self._dropped_count = 0
        self._reader = CorrelatedReader(participant, replies, qos, self._replies_came, self._ended)
        try:
            self._writer = CorrelatedWriter(participant, requests, qos)
        except BaseException:
            self._reader.close()
            raise

    def __repr__(self) -> str:
        return f"<rpc.Client of {self._name!r}, {len(self._pending)} calls under way>"

    @property
    def guid(self) -> Guid:
        """What requests are known by: the writer of requests."""
        return self._writer.guid

    @property
    def dropped_count(self) -> int:
        """How many replies came that no call waits for: too late, twice, or for other clients."""
        return self._dropped_count

    async def wait_for_service(self, timeout: float | None = None) -> None:
        """Until there is a service to ask.  Raises DdsTimeout, AlreadyDeleted."""
        with deadline_scope(timeout):
            await self._writer.wait_for_matched()
            await self._reader.wait_for_matched()
            return
        raise DdsTimeout(self._why_not(timeout, is_asked=False))

    async def call(self, request: Req, *, timeout: float | None = 10.0) -> Rep:
        """Ask, and return what the first service to answer says.

        A service that is not there yet is waited for.  A request is asked once: where the service goes before it has
        answered, whether it was carried out cannot be known.

        Raises DdsTimeout after ``timeout`` seconds in all (None: never), RemoteError with what the service said,
        BadParameter when ``request`` is not of its type, AlreadyDeleted.
        """
        is_asked = False
        identity: Identity | None = None
        pending: _Pending[Rep] = _Pending()
        try:
            with deadline_scope(timeout):
                await self.wait_for_service()
                self._call_count += 1
                number = self._call_count
                sample = self._wire.request(request, self.guid, number, self._instance_name)
                written = await self._writer.write_related(sample, None)
                # No await since it was written: nobody can have answered yet.
                identity = self._wire.identity_of_request(written, self.guid, number)
                self._pending[identity] = pending
                is_asked = True
                self._writer._pump.before_waiting()
                await pending.arrived.wait()
        finally:
            if identity is not None:
                self._pending.pop(identity, None)
        answer = pending.answer
        if not pending.arrived.is_set():
            raise DdsTimeout(self._why_not(timeout, is_asked=is_asked))
        if isinstance(answer, RemoteError):
            raise answer
        if answer is None:
            raise AlreadyDeleted(f"{self!r} was closed while a call waited for its answer")
        return answer

    def _why_not(self, timeout: float | None, *, is_asked: bool) -> str:
        if not is_asked:
            topic = self._writer.topic.name
            return f"no service {self._name!r} was found in {timeout} s; `ddsi why {topic}` says why not"
        if not self._writer.matched_subscriptions():
            return f"service {self._name!r} was asked and went without an answer; {timeout} s have passed"
        return f"service {self._name!r} was asked and has not answered in {timeout} s"

    def _replies_came(self, samples: list[Sample[Any]]) -> None:
        for sample in samples:
            if not sample.info.valid_data or not isinstance(sample, CorrelatedSample):
                continue
            identity, answer = self._wire.reply_in(sample)
            pending = self._pending.pop(identity, None) if identity is not None else None
            if pending is None:
                self._dropped_count += 1
                continue
            pending.answer = answer
            pending.arrived.set()

    def _ended(self) -> None:
        for pending in self._pending.values():
            pending.arrived.set()
