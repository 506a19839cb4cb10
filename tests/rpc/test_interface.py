"""Operations of a class, called as if they were local."""

from __future__ import annotations

import hashlib
import struct
from typing import Any, assert_type

import pytest
import trio

import ddsi
from ddsi import idl, rpc
from ddsi.rpc import mapping as mappings
from ddsi.rpc.interface import _Operations
from ddsi.structure.guid import Guid
from ddsi.xtypes.annotations import autoid_hash
from ddsi.xtypes.unions import union_type
from tests.dcps.running import in_trio


@idl.struct
class Point:
    x: idl.int32 = 0
    y: idl.int32 = 0


class Robot:
    """The interface: what it can be asked."""

    async def move(self, to: Point, speed: idl.float64 = 1.0) -> Point:
        raise NotImplementedError

    async def name(self) -> str:
        raise NotImplementedError

    async def stop(self) -> None:
        raise NotImplementedError

    def _not_an_operation(self) -> None: ...


class RealRobot(Robot):
    def __init__(self) -> None:
        self.at = Point(0, 0)
        self.stop_count = 0

    async def move(self, to: Point, speed: float = 1.0) -> Point:
        if speed > 10:
            raise rpc.RemoteError(rpc.RemoteExceptionCode.REMOTE_EX_INVALID_ARGUMENT)
        before, self.at = self.at, to
        return before

    async def name(self) -> str:
        return "robby"

    async def stop(self) -> None:
        self.stop_count += 1


@in_trio
async def test_operations_are_called_with_their_arguments_and_return_or_raise(domain: int) -> None:
    async with ddsi.DomainParticipant(domain) as here, ddsi.DomainParticipant(domain) as there:
        client = rpc.InterfaceClient(here, Robot)
        assert_type(client.calls, Robot)
        service = rpc.InterfaceService(there, Robot)
        robot = RealRobot()
        async with trio.open_nursery() as nursery:
            nursery.start_soon(service.serve, robot)
            await client.wait_for_service(timeout=5)
            assert await client.calls.name() == "robby"
            assert await client.calls.move(Point(1, 2)) == Point(0, 0)
            assert await client.calls.move(to=Point(3, 4), speed=2.5) == Point(1, 2)
            nothing: object = await client.calls.stop()  # type: ignore[func-returns-value]
            assert nothing is None
            assert (robot.at, robot.stop_count) == (Point(3, 4), 1)
            with pytest.raises(rpc.RemoteError, match="INVALID_ARGUMENT"):
                await client.calls.move(Point(), 11.0)
            wrong: Any = client.calls
            with pytest.raises(ddsi.BadParameter, match=r"move\(to: .*: missing a required argument: 'to'"):
                await wrong.move()
            with pytest.raises(ddsi.BadParameter, match="speed"):
                await wrong.move(Point(), "fast")
            service.close()
        client.close()
        with pytest.raises(ddsi.AlreadyDeleted):
            await client.calls.stop()


@in_trio
async def test_an_operation_that_is_none_of_the_interface_is_an_error(domain: int) -> None:
    """As a client may ask for whose types nobody compares."""
    operations = _Operations(Robot)
    async with ddsi.DomainParticipant(domain) as participant:
        client = rpc.Client(participant, "Robot", operations.call_type, operations.return_type)
        service = rpc.InterfaceService(participant, Robot)
        async with trio.open_nursery() as nursery:
            nursery.start_soon(service.serve, RealRobot())
            with pytest.raises(rpc.RemoteError, match="UNKNOWN_OPERATION"):
                await client.call(operations.call_type(discriminator=7, unknownOp=0))
            service.close()


@in_trio
async def test_interfaces_of_other_operations_do_not_match(domain: int) -> None:
    class Dancer:
        async def dance(self) -> None: ...

    async with ddsi.DomainParticipant(domain) as participant:
        client = rpc.InterfaceClient(participant, Dancer, "Robot", timeout=0.05)
        rpc.InterfaceService(participant, Robot)
        with pytest.raises(ddsi.DdsTimeout, match="`ddsi why Robot_Request`"):
            await client.calls.dance()
        assert any("Robot_Request" in str(refusal) for refusal in participant.match_refusals().values())


@in_trio
async def test_a_call_that_nobody_serves_ends_in_time(domain: int) -> None:
    async with ddsi.DomainParticipant(domain) as participant:
        with pytest.raises(ddsi.DdsTimeout):
            await rpc.InterfaceClient(participant, Robot, timeout=0.05).calls.stop()


def test_the_types_are_those_of_the_specifications_mapping() -> None:
    operations = _Operations(Robot)
    names = [operations.call_type, operations.return_type]
    names += [operations.all[0].in_type, operations.all[0].out_type, operations.all[0].result_type]
    assert [type_.__name__ for type_ in names] == [
        "Robot_Call", "Robot_Return", "Robot_move_In", "Robot_move_Out", "Robot_move_Result",
    ]  # fmt: skip
    assert [operation.name for operation in operations.all] == ["move", "name", "stop"]
    assert [case.name for case in union_type(operations.call_type).cases] == ["unknownOp", "move", "name", "stop"]
    call = operations.call_type(move=operations.all[0].in_type(Point(1, 2), 0.5))
    stop = operations.call_type(stop=operations.by_name["stop"].in_type())
    wire = mappings.wire(rpc.Mapping.BASIC, "Robot", operations.call_type, operations.return_type)
    for asked, data in (
        (call, struct.pack("<iii4xd", _hash("move"), 1, 2, 0.5)),
        (stop, struct.pack("<iB", _hash("stop"), 0)),  # UnusedMember
    ):
        octets = ddsi.serialize(wire.request(asked, Guid(bytes(16)), 1, ""), representation=ddsi.XCDR1)
        assert octets[36 : 36 + len(data)] == data, "behind the header: identity, and an empty name with its padding"


def test_operations_are_known_by_the_hash_that_typelookup_has() -> None:
    """DDS-XTypes 1.3 §7.6.3.3.3 prints them."""
    assert (autoid_hash("getTypes"), autoid_hash("getDependencies")) == (0x018252D3, 0x05AAFB31)


def _hash(name: str) -> int:
    return int.from_bytes(hashlib.md5(name.encode()).digest()[:4], "little") & 0x0FFFFFFF


class Plain:
    def ask(self) -> None: ...


class Untyped:
    async def ask(self, what) -> None:  # type: ignore[no-untyped-def]
        ...


class NoResult:
    async def ask(self):  # type: ignore[no-untyped-def]
        ...


class Starred:
    async def ask(self, *what: int) -> None: ...


class Empty:
    pass


@pytest.mark.parametrize(
    ("interface", "message"),
    [
        (Plain, "Plain.ask: an operation is an async method"),
        (Untyped, "Untyped.ask: parameter 'what' needs a type"),
        (NoResult, "NoResult.ask: it needs a type of what it returns"),
        (Starred, r"Starred.ask: parameter 'what' .* may not be \*"),
        (Empty, "Empty has no operations"),
        ("Robot", "an interface is a class"),
    ],
)
def test_what_cannot_be_an_interface_is_refused(interface: Any, message: str) -> None:
    with pytest.raises(ddsi.BadParameter, match=message):
        _Operations(interface)
