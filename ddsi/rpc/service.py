"""Service: takes requests and answers them.  DDS-RPC 1.0 §7.9 (request-reply style: Replier)."""

from __future__ import annotations

import logging
from collections.abc import Awaitable, Callable
from typing import Any, Generic, Self, TypeVar

import trio

from ..dcps import DomainParticipant, Topic
from ..structure.errors import BadParameter, DdsError, PreconditionNotMet
from ..structure.guid import Guid
from ..structure.qos import Qos
from ..structure.sample_info import SampleInfo
from .correlation import CorrelatedReader, CorrelatedSample, CorrelatedWriter, Identity
from .identity import RemoteError, RemoteExceptionCode
from .rpc_entity import RpcEntity

__all__ = ["Request", "Service"]

Req = TypeVar("Req")
Rep = TypeVar("Rep")

_PATIENCE_S = 1.0
"""How long a reply waits for its client's reader to be discovered, whose request may have been faster."""
_LOOK_S = 0.005
_log = logging.getLogger("ddsi.rpc")


class Request(Generic[Req, Rep]):
    """One request, to be answered once, by :meth:`reply` or :meth:`fail`; who gets neither runs into its timeout."""

    __slots__ = ("_is_answered", "_service", "data", "identity", "info")

    def __init__(self, service: Service[Req, Rep], data: Req, info: SampleInfo, identity: Identity) -> None:
        self._service = service
        self._is_answered = False
        self.data = data
        self.info = info
        self.identity = identity

    def __repr__(self) -> str:
        return f"<rpc.Request {self.identity[1]} of {self.identity[0]}: {self.data!r}>"

    async def reply(self, data: Rep) -> None:
        """Answer with this.  Raises PreconditionNotMet when it was answered before, BadParameter, DdsTimeout."""
        await self._answer(self._service._wire.reply(data, self.identity))

    async def fail(self, code: RemoteExceptionCode) -> None:
        """Answer that it cannot be done: the caller's ``call`` raises RemoteError with this ``code``.

        Raises BadParameter for REMOTE_EX_OK and in the enhanced mapping, which cannot say it; else as :meth:`reply`.
        """
        if code is RemoteExceptionCode.REMOTE_EX_OK:
            raise BadParameter("REMOTE_EX_OK is no failure; answer by reply(...)")
        await self._answer(self._service._wire.failure(RemoteExceptionCode(code), self.identity))

    async def _answer(self, sample: Any) -> None:
        if self._is_answered:
            raise PreconditionNotMet(f"{self!r} was answered before")
        self._is_answered = True
        try:
            await self._service._answer(sample, self.identity, self.info.publication_handle)
        except BadParameter:  # the sample is not of its type: nothing has been sent
            self._is_answered = False
            raise


class Service(RpcEntity[Req, Rep]):
    """``async for request in service``, or :meth:`serve`.  Closed with its participant, or by :meth:`close`."""

    def _open(self, participant: DomainParticipant, requests: Topic[Any], replies: Topic[Any], qos: Qos) -> None:
        # The writer first: whoever finds the reader and asks shall find the writer too.
        self._writer = CorrelatedWriter(participant, replies, qos)
        try:
            self._reader = CorrelatedReader(participant, requests, qos)
        except BaseException:
            self._writer.close()
            raise

    def __repr__(self) -> str:
        return f"<rpc.Service {self._name!r}>"

    async def wait_for_client(self, timeout: float | None = None) -> None:
        """Until there is somebody who may ask.  Raises DdsTimeout, AlreadyDeleted."""
        await self._reader.wait_for_matched(timeout=timeout)

    def __aiter__(self) -> Self:
        return self

    async def __anext__(self) -> Request[Req, Rep]:
        """The next request, waiting for one.  Iteration ends when the service is closed."""
        while True:
            sample = await self._reader.__anext__()
            if sample.info.valid_data and isinstance(sample, CorrelatedSample):
                identity, instance_name, data = self._wire.request_in(sample)
                if instance_name in ("", self._instance_name):
                    return Request(self, data, sample.info, identity)

    async def serve(self, handler: Callable[[Req], Awaitable[Rep]], *, at_once: int = 16) -> None:
        """Answer each request with what ``handler`` returns for its data, until the service is closed.

        ``at_once``: at most so many run at the same time.  A RemoteError that it raises is the answer; any other
        exception is logged to ``ddsi.rpc`` and answered as REMOTE_EX_UNKNOWN_EXCEPTION.
        """
        limit = trio.Semaphore(at_once)

        async def handle(request: Request[Req, Rep]) -> None:
            try:
                await _handled(request, handler)
            finally:
                limit.release()

        async with trio.open_nursery() as nursery:
            while True:
                await limit.acquire()
                try:
                    request = await self.__anext__()
                except StopAsyncIteration:
                    return
                nursery.start_soon(handle, request)

    async def _answer(self, sample: Any, request: Identity, asker: Guid) -> None:
        """``asker``: the writer of the request, whose participant has the reader that waits."""
        with trio.move_on_after(_PATIENCE_S):
            while not self._reaches(asker):
                await trio.sleep(_LOOK_S)
        await self._writer.write_related(sample, request)

    def _reaches(self, asker: Guid) -> bool:
        """Is the client's reader matched?  It is not waited for where the client has gone."""
        if any(reader[:12] == asker[:12] for reader in self._writer.matched_subscriptions()):
            return True
        return self._reader.is_closed or asker not in self._reader.matched_publications()


async def _handled(request: Request[Req, Rep], handler: Callable[[Req], Awaitable[Rep]]) -> None:
    """Whatever goes wrong concerns this one request; the service goes on."""
    code = RemoteExceptionCode.REMOTE_EX_UNKNOWN_EXCEPTION
    try:
        await request.reply(await handler(request.data))
        return
    except RemoteError as error:
        code = error.code
    except Exception:
        _log.exception("%r could not be handled", request)
    try:
        await request.fail(code)
    except DdsError as error:
        _log.warning("%r stays without an answer: %s", request, error)
