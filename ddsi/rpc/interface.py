"""Interfaces: operations of a class, called as if they were local.  DDS-RPC 1.0 §7.5.1.1 (mapping of interfaces).

A plain class whose methods are async and annotated says what there is.  It becomes the types that the basic mapping
asks for: of each operation a struct of its arguments (``Name_op_In``) and one of its result (``Name_op_Out``), and of
all of them the unions ``Name_Call`` and ``Name_Return``, which select by a hash of the operation's name.  The hash is
the one of member ids (DDS-XTypes 1.3 §7.3.1.2.1.1), as in the one such service that participants have, TypeLookup.

Both sides must have the same operations: types that differ in them do not match, as ``ddsi why`` tells.

Not here: attributes, ``inout`` and ``out`` parameters, inheritance, and exceptions of one's own, for which a result may
be a union.
"""

from __future__ import annotations

import inspect
from collections.abc import Awaitable, Callable
from typing import Any, Generic, TypeVar, cast, get_type_hints

from ..dcps import DomainParticipant
from ..structure.errors import BadParameter
from ..xtypes import idl
from ..xtypes.annotations import autoid_hash
from ..xtypes.unions import selected_member
from .client import Client
from .identity import RemoteError, RemoteExceptionCode
from .service import Service

__all__ = ["InterfaceClient", "InterfaceService"]

P = TypeVar("P")

_UNUSED = {"dummy": idl.octet}
"""``UnusedMember``: what stands in a struct that has no members, which older IDL cannot say."""
_RESULT_OK = 0


class InterfaceClient(Generic[P]):
    """``await client.calls.add(2, 3)`` asks whoever serves the interface."""

    def __init__(
        self,
        participant: DomainParticipant,
        interface: type[P],
        name: str | None = None,
        *,
        timeout: float | None = 10.0,
        instance_name: str = "",
    ) -> None:
        """``interface``: a class; ``name``: of the service, the class's if none is given.

        ``timeout``: seconds for each call, None for no limit.  Raises BadParameter for an interface that cannot be one.
        """
        operations = _Operations(interface)
        self._client: Client[Any, Any] = Client(
            participant,
            name or interface.__name__,
            operations.call_type,
            operations.return_type,
            instance_name=instance_name,
        )
        self._timeout = timeout
        self.calls: P = cast(P, _Calls({each.name: self._caller(operations, each) for each in operations.all}))
        """What has the interface's methods.  They raise as :meth:`ddsi.rpc.Client.call` does."""

    async def wait_for_service(self, timeout: float | None = None) -> None:
        """Until there is a service to ask.  Raises DdsTimeout, AlreadyDeleted."""
        await self._client.wait_for_service(timeout)

    def close(self) -> None:
        """End it; calls that wait raise AlreadyDeleted.  Safe twice."""
        self._client.close()

    def _caller(self, operations: _Operations, operation: _Operation) -> Callable[..., Awaitable[Any]]:
        async def call(*args: Any, **kwargs: Any) -> Any:
            try:
                given = operation.signature.bind(*args, **kwargs)
            except TypeError as error:
                raise BadParameter(f"{operation.name}{operation.signature}: {error}") from None
            given.apply_defaults()
            asked = operations.call_type(**{operation.name: operation.in_type(**given.arguments)})
            answer = await self._client.call(asked, timeout=self._timeout)
            if selected_member(answer) != operation.name:
                raise RemoteError(RemoteExceptionCode.REMOTE_EX_UNKNOWN_OPERATION)
            result = getattr(answer, operation.name)
            if selected_member(result) != "result":
                raise RemoteError(RemoteExceptionCode.REMOTE_EX_UNKNOWN_EXCEPTION)
            return result.result.return_ if operation.has_result else None

        return call


class InterfaceService(Generic[P]):
    """Has the methods of an object called for those who ask."""

    def __init__(
        self, participant: DomainParticipant, interface: type[P], name: str | None = None, *, instance_name: str = ""
    ) -> None:
        """As :class:`InterfaceClient`."""
        self._operations = _Operations(interface)
        self._service: Service[Any, Any] = Service(
            participant,
            name or interface.__name__,
            self._operations.call_type,
            self._operations.return_type,
            instance_name=instance_name,
        )

    async def serve(self, implementation: P, *, at_once: int = 16) -> None:
        """Answer with what the ``implementation``'s methods return or raise, until the service is closed.

        See :meth:`ddsi.rpc.Service.serve`.
        """

        async def handle(call: Any) -> Any:
            name = selected_member(call)
            operation = self._operations.by_name.get(name or "")
            if operation is None:
                raise RemoteError(RemoteExceptionCode.REMOTE_EX_UNKNOWN_OPERATION)
            asked = getattr(call, operation.name)
            arguments = {member: getattr(asked, member) for member in operation.signature.parameters}
            returned = await getattr(implementation, operation.name)(**arguments)
            out = operation.out_type(returned) if operation.has_result else operation.out_type(0)
            return self._operations.return_type(**{operation.name: operation.result_type(result=out)})

        await self._service.serve(handle, at_once=at_once)

    def close(self) -> None:
        """End it.  Safe twice."""
        self._service.close()


class _Calls:
    """An object with these methods, and no others that an operation's name could meet."""

    def __init__(self, methods: dict[str, Callable[..., Awaitable[Any]]]) -> None:
        self.__dict__.update(methods)


class _Operation:
    """One method, and the types of what goes to and fro."""

    def __init__(self, interface: type[Any], name: str, method: Callable[..., Any]) -> None:
        whole = f"{interface.__name__}.{name}"
        if not inspect.iscoroutinefunction(method):
            raise BadParameter(f"{whole}: an operation is an async method")
        self.name = name
        _, *parameters = inspect.signature(method).parameters.values()
        hints = get_type_hints(method, include_extras=True)
        for parameter in parameters:
            if parameter.kind is not inspect.Parameter.POSITIONAL_OR_KEYWORD or parameter.name not in hints:
                raise BadParameter(f"{whole}: parameter {parameter.name!r} needs a type, and may not be * or **")
        if "return" not in hints:
            raise BadParameter(f"{whole}: it needs a type of what it returns, or None")
        self.signature = inspect.Signature(parameters)
        self.has_result = hints["return"] is not type(None)
        arguments = {parameter.name: hints[parameter.name] for parameter in parameters}
        prefix = f"{interface.__name__}_{name}"
        self.in_type = _struct(f"{prefix}_In", arguments) if arguments else _struct(f"{prefix}_In", _UNUSED, dummy=0)
        self.out_type = _struct(f"{prefix}_Out", {"return_": hints["return"]} if self.has_result else _UNUSED)
        self.result_type = _union(f"{prefix}_Result", "unknownEx", {"result": (_RESULT_OK, self.out_type)})


class _Operations:
    """All of an interface, in the order in which they stand in its class."""

    def __init__(self, interface: type[Any]) -> None:
        if not isinstance(interface, type):
            raise BadParameter(f"an interface is a class with async methods, not {interface!r}")
        methods = {name: value for name, value in vars(interface).items() if inspect.isfunction(value)}
        self.all = [_Operation(interface, name, each) for name, each in methods.items() if not name.startswith("_")]
        if not self.all:
            raise BadParameter(f"{interface.__name__} has no operations: an interface is a class with async methods")
        self.by_name = {operation.name: operation for operation in self.all}
        name = interface.__name__
        calls = {each.name: (autoid_hash(each.name), each.in_type) for each in self.all}
        returns = {each.name: (autoid_hash(each.name), each.result_type) for each in self.all}
        self.call_type = _union(f"{name}_Call", "unknownOp", calls)
        self.return_type = _union(f"{name}_Return", "unknownOp", returns)


def _struct(name: str, members: dict[str, Any], **defaults: Any) -> type[Any]:
    fields = {"__annotations__": dict(members), "__module__": __name__, **defaults}
    made: type[Any] = idl.struct(typename=name, extensibility=idl.FINAL)(type(name, (), fields))
    return made


def _union(name: str, otherwise: str, cases: dict[str, tuple[int, type[Any]]]) -> type[Any]:
    """``union name switch (long) { default: octet otherwise; case ...: ...; }``"""
    annotations: dict[str, Any] = {"discriminator": idl.int32, otherwise: idl.octet}
    fields: dict[str, Any] = {"discriminator": idl.switch, otherwise: idl.case(default=True)}
    for member, (label, type_) in cases.items():
        annotations[member] = type_
        fields[member] = idl.case(label)
    fields |= {"__annotations__": annotations, "__module__": __name__}
    made: type[Any] = idl.union(typename=name, extensibility=idl.FINAL)(type(name, (), fields))
    return made
