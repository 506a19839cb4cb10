"""Request and reply: each caller gets its own answer, in time or not at all."""

from __future__ import annotations

import logging
import struct
from collections.abc import AsyncIterator, Awaitable, Callable
from contextlib import asynccontextmanager
from typing import Annotated, Any, assert_type

import pytest
import trio

import ddsi
from ddsi import idl, rpc
from ddsi.rpc import mapping as mappings
from ddsi.rpc.correlation import CorrelatedReader, CorrelatedSample, CorrelatedWriter
from ddsi.structure.guid import Guid
from ddsi.xtypes.definition import struct_type
from tests.dcps.running import RELIABLE, eventually, in_trio


@idl.struct
class Numbers:
    a: idl.int32
    b: idl.int32


@idl.struct
class Sum:
    total: idl.int32


@idl.struct
class Keyed:
    """In the enhanced mapping the type is the topic's own, key and all."""

    color: Annotated[str, idl.key]
    x: idl.int32 = 0


Service = rpc.Service[Numbers, Sum]
Client = rpc.Client[Numbers, Sum]
BOTH = pytest.mark.parametrize("mapping", list(rpc.Mapping))


def service_of(participant: ddsi.DomainParticipant, **options: Any) -> Service:
    return rpc.Service(participant, "Adder", Numbers, Sum, **options)


def client_of(participant: ddsi.DomainParticipant, **options: Any) -> Client:
    return rpc.Client(participant, "Adder", Numbers, Sum, **options)


async def adding(service: Service) -> None:
    async for request in service:
        await request.reply(Sum(request.data.a + request.data.b))


@asynccontextmanager
async def running(
    domain: int, serve: Callable[[Service], Awaitable[None]] = adding, *, local: bool = False, **options: Any
) -> AsyncIterator[tuple[Client, Service]]:
    """A client and a service, in two participants or one; the service ends with the block."""
    async with ddsi.DomainParticipant(domain) as here, ddsi.DomainParticipant(domain) as there:
        client, service = client_of(here, **options), service_of(here if local else there, **options)
        async with trio.open_nursery() as nursery:
            nursery.start_soon(serve, service)
            yield client, service
            service.close()


@pytest.mark.parametrize("local", [False, True], ids=["two participants", "one participant"])
@BOTH
@in_trio
async def test_a_call_returns_the_reply(domain: int, mapping: rpc.Mapping, local: bool) -> None:
    async with running(domain, mapping=mapping, local=local) as (client, _):
        reply = await client.call(Numbers(2, 3), timeout=10)
        assert_type(reply, Sum)
        assert reply == Sum(5)
        for number in range(50):
            assert await client.call(Numbers(number, 1)) == Sum(number + 1)


@BOTH
@in_trio
async def test_many_calls_at_once_each_get_their_own_answer_whatever_the_order(
    domain: int, mapping: rpc.Mapping
) -> None:
    async def backwards(service: Service) -> None:
        requests = []
        async for request in service:
            requests.append(request)
            if len(requests) == 20:
                for late in reversed(requests):
                    await late.reply(Sum(late.data.a + late.data.b))

    answers: dict[int, Sum] = {}
    async with running(domain, backwards, mapping=mapping) as (client, _), trio.open_nursery() as nursery:

        async def ask(number: int) -> None:
            answers[number] = await client.call(Numbers(number, 100))

        for number in range(20):
            nursery.start_soon(ask, number)
    assert answers == {number: Sum(number + 100) for number in range(20)}


@BOTH
@in_trio
async def test_clients_do_not_get_each_others_replies_and_idle_ones_hold_nobody_up(
    domain: int, mapping: rpc.Mapping
) -> None:
    async with running(domain, mapping=mapping) as (client, _), ddsi.DomainParticipant(domain) as elsewhere:
        other, idle = client_of(elsewhere, mapping=mapping), client_of(elsewhere, mapping=mapping)
        for each in (client, other, idle):
            await each.wait_for_service(timeout=5)
        for number in range(30):
            assert await client.call(Numbers(number, 0)) == Sum(number)
            assert await other.call(Numbers(number, 1000)) == Sum(number + 1000)
        await eventually(lambda: idle.dropped_count == 60)
        assert len(idle._reader.read()) == 0


@in_trio
async def test_a_service_that_comes_late_and_one_that_comes_back_are_found(domain: int) -> None:
    async with ddsi.DomainParticipant(domain) as here:
        client = client_of(here)
        for start in (0, 100):
            answers: list[Sum] = []
            async with trio.open_nursery() as nursery:

                async def ask(into: list[Sum] = answers, start: int = start) -> None:
                    into.append(await client.call(Numbers(start, 1)))

                nursery.start_soon(ask)
                await trio.sleep(0.05)
                async with ddsi.DomainParticipant(domain) as there, trio.open_nursery() as serving:
                    service = service_of(there)
                    serving.start_soon(adding, service)
                    await eventually(lambda answers=answers: answers)  # type: ignore[misc]
                    service.close()
            assert answers == [Sum(start + 1)]
            await eventually(lambda: not client._writer.matched_subscriptions())


@in_trio
async def test_a_call_that_nobody_answers_ends_in_time_and_says_what_it_waited_for(domain: int) -> None:
    async def silent(service: Service) -> None:
        async for _ in service:
            pass

    async with ddsi.DomainParticipant(domain) as alone:
        with pytest.raises(ddsi.DdsTimeout, match=r"no service 'Adder' was found in 0.05 s; `ddsi why Adder_Request`"):
            await client_of(alone).call(Numbers(1, 1), timeout=0.05)
        with pytest.raises(ddsi.DdsTimeout, match="no service 'Adder'"):
            await client_of(alone).wait_for_service(timeout=0.05)
    async with running(domain, silent) as (client, service):
        with pytest.raises(ddsi.DdsTimeout, match=r"was asked and has not answered in 0.3 s"):
            await client.call(Numbers(1, 1), timeout=0.3)
        assert client._pending == {}
        with trio.move_on_after(1) as scope:
            scope.deadline = trio.current_time() + 0.05
            await client.call(Numbers(1, 1))
        assert scope.cancelled_caught
        assert client._pending == {}
        async with trio.open_nursery() as nursery:

            async def asked_and_left() -> None:
                with pytest.raises(ddsi.DdsTimeout, match="went without an answer"):
                    await client.call(Numbers(1, 1), timeout=1)

            nursery.start_soon(asked_and_left)
            await eventually(lambda: client._pending)
            service.close()


@in_trio
async def test_a_reply_that_comes_too_late_is_dropped(domain: int) -> None:
    may_answer = trio.Event()

    async def late(service: Service) -> None:
        async for request in service:
            await may_answer.wait()
            await request.reply(Sum(request.data.a))

    async with running(domain, late) as (client, _):
        with pytest.raises(ddsi.DdsTimeout):
            await client.call(Numbers(1, 0), timeout=0.3)
        may_answer.set()
        assert await client.call(Numbers(2, 0)) == Sum(2)
        assert client.dropped_count == 1


@in_trio
async def test_what_a_service_cannot_do_is_an_error_with_its_code(domain: int) -> None:
    async def refusing(service: Service) -> None:
        async for request in service:
            with pytest.raises(ddsi.BadParameter, match="no failure"):
                await request.fail(rpc.RemoteExceptionCode.REMOTE_EX_OK)
            wrong: Any = Sum("many")  # type: ignore[arg-type]
            with pytest.raises(ddsi.BadParameter, match="total"):
                await request.reply(wrong)
            await request.fail(rpc.RemoteExceptionCode(request.data.a))
            with pytest.raises(ddsi.PreconditionNotMet, match="answered before"):
                await request.reply(Sum(0))

    async with running(domain, refusing) as (client, _):
        for code in list(rpc.RemoteExceptionCode)[1:]:
            with pytest.raises(rpc.RemoteError, match=code.name) as caught:
                await client.call(Numbers(code, 0))
            assert caught.value.code is code


@in_trio
async def test_the_enhanced_mapping_has_no_place_for_a_failure(domain: int) -> None:
    async def refusing(service: Service) -> None:
        async for request in service:
            with pytest.raises(ddsi.BadParameter, match="no place for it"):
                await request.fail(rpc.RemoteExceptionCode.REMOTE_EX_UNSUPPORTED)
            await request.reply(Sum(-1))

    async with running(domain, refusing, mapping=rpc.Mapping.ENHANCED) as (client, _):
        assert await client.call(Numbers(0, 0)) == Sum(-1)


@in_trio
async def test_serve_answers_with_what_a_handler_returns_or_raises(
    domain: int, caplog: pytest.LogCaptureFixture
) -> None:
    running_now = most = 0

    async def handle(numbers: Numbers) -> Sum:
        nonlocal running_now, most
        running_now += 1
        most = max(most, running_now)
        await trio.sleep(0.02)
        running_now -= 1
        if numbers.a == -1:
            raise rpc.RemoteError(rpc.RemoteExceptionCode.REMOTE_EX_INVALID_ARGUMENT)
        if numbers.a == -2:
            raise ZeroDivisionError("by mistake")
        if numbers.a == -3:
            return Sum("wrong")  # type: ignore[arg-type]
        return Sum(numbers.a * numbers.b)

    async def serve(service: Service) -> None:
        await service.serve(handle, at_once=3)

    answers: list[Sum] = []
    with caplog.at_level(logging.ERROR, "ddsi.rpc"):
        async with running(domain, serve) as (client, _):
            for a, code in ((-1, "INVALID_ARGUMENT"), (-2, "UNKNOWN_EXCEPTION"), (-3, "UNKNOWN_EXCEPTION")):
                with pytest.raises(rpc.RemoteError, match=code):
                    await client.call(Numbers(a, 0))
            async with trio.open_nursery() as nursery:

                async def ask(number: int) -> None:
                    answers.append(await client.call(Numbers(number, 2)))

                for number in range(9):
                    nursery.start_soon(ask, number)
    assert sorted(answer.total for answer in answers) == [2 * number for number in range(9)]
    assert most == 3
    assert "by mistake" in caplog.text


@in_trio
async def test_an_instance_answers_only_those_who_ask_for_it_or_for_any(domain: int) -> None:
    async def answering(service: Service, total: int) -> None:
        async for request in service:
            await request.reply(Sum(total))

    async with ddsi.DomainParticipant(domain) as here, ddsi.DomainParticipant(domain) as there:
        left, right = service_of(there, instance_name="left"), service_of(there, instance_name="right")
        async with trio.open_nursery() as nursery:
            nursery.start_soon(answering, left, 1)
            nursery.start_soon(answering, right, 2)
            for name, total in (("left", {1}), ("right", {2}), ("", {1, 2})):
                client = client_of(here, instance_name=name)
                await client._writer.wait_for_matched(2, timeout=5)
                for _ in range(5):
                    assert (await client.call(Numbers(0, 0))).total in total
            with pytest.raises(ddsi.DdsTimeout):
                await client_of(here, instance_name="middle").call(Numbers(0, 0), timeout=0.3)
            left.close()
            right.close()


@in_trio
async def test_closing_ends_calls_and_iteration(domain: int) -> None:
    async with ddsi.DomainParticipant(domain) as here, ddsi.DomainParticipant(domain) as there:
        client, service = client_of(here), service_of(there)
        ended: list[str] = []

        async def ask() -> None:
            with pytest.raises(ddsi.AlreadyDeleted):
                await client.call(Numbers(1, 1))
            ended.append("call")

        async def serve() -> None:
            async for _ in service:
                client.close()
                client.close()
                service.close()
            ended.append("service")

        async with trio.open_nursery() as nursery:
            nursery.start_soon(ask)
            nursery.start_soon(serve)
        assert sorted(ended) == ["call", "service"]
        with pytest.raises(ddsi.AlreadyDeleted):
            await client.call(Numbers(1, 1))


@in_trio
async def test_requests_that_are_no_samples_of_their_type_are_refused_before_they_are_sent(domain: int) -> None:
    async with running(domain) as (client, _):
        wrong: Any = Numbers("x", 1)  # type: ignore[arg-type]
        with pytest.raises(ddsi.BadParameter, match="'x'"):
            await client.call(wrong)
        assert client._pending == {}
        assert await client.call(Numbers(1, 1)) == Sum(2)


@in_trio
async def test_types_and_mappings_that_cannot_be_are_refused(domain: int) -> None:
    wrong: Any = "basic"
    async with ddsi.DomainParticipant(domain) as participant:
        with pytest.raises(ddsi.BadParameter, match="no topic type"):
            rpc.Client(participant, "Adder", int, Sum)
        with pytest.raises(ddsi.BadParameter, match="mapping"):
            rpc.Client(participant, "Adder", Numbers, Sum, mapping=wrong)


@in_trio
async def test_the_topics_have_the_names_that_the_specification_gives_or_the_program(domain: int) -> None:
    async with ddsi.DomainParticipant(domain) as participant:
        client = client_of(participant)
        assert (client._writer.topic.name, client._reader.topic.name) == ("Adder_Request", "Adder_Reply")
        assert (client._writer.topic.type_name, client._reader.topic.type_name) == ("Adder_Request", "Adder_Reply")
        own = client_of(participant, request_topic="rq/add", reply_topic="rr/add", mapping=rpc.Mapping.ENHANCED)
        assert (own._writer.topic.name, own._reader.topic.name) == ("rq/add", "rr/add")
        assert (own._writer.topic.type_name, own._reader.topic.type_name) == ("Numbers", "Sum")


@in_trio
async def test_a_keyed_type_is_a_topic_of_the_enhanced_mapping(domain: int) -> None:
    async with ddsi.DomainParticipant(domain) as here, ddsi.DomainParticipant(domain) as there:
        client = rpc.Client(here, "Painter", Keyed, Keyed, mapping=rpc.Mapping.ENHANCED)
        service = rpc.Service(there, "Painter", Keyed, Keyed, mapping=rpc.Mapping.ENHANCED)

        async def paint() -> None:
            async for request in service:
                await request.reply(Keyed(request.data.color, request.data.x + 1))

        async with trio.open_nursery() as nursery:
            nursery.start_soon(paint)
            assert await client.call(Keyed("RED", 1)) == Keyed("RED", 2)
            assert await client.call(Keyed("BLUE", 2)) == Keyed("BLUE", 3)
            service.close()


# --- octets ----------------------------------------------------------------------------------------------------

WRITER = Guid(bytes(range(1, 17)))
IDENTITY = bytes(range(1, 17)) + struct.pack("<iI", 1, 7)  # writer_guid, sequence_number: high, low


def test_a_request_of_the_basic_mapping_octet_by_octet() -> None:
    basic = mappings.wire(rpc.Mapping.BASIC, "Adder", Numbers, Sum)
    request = basic.request(Numbers(2, 3), WRITER, (1 << 32) + 7, "left")
    assert ddsi.serialize(request, representation=ddsi.XCDR1) == (
        b"\0\1\0\0"  # CDR_LE
        + IDENTITY  # header.requestId
        + struct.pack("<I5s3x", 5, b"left\0")  # header.instanceName
        + struct.pack("<ii", 2, 3)  # data
    )
    sample = CorrelatedSample(request, None, (WRITER, 1), None)  # type: ignore[arg-type]
    assert basic.request_in(sample) == ((WRITER, (1 << 32) + 7), "left", Numbers(2, 3))


def test_a_reply_of_the_basic_mapping_octet_by_octet() -> None:
    basic = mappings.wire(rpc.Mapping.BASIC, "Adder", Numbers, Sum)
    request = WRITER, (1 << 32) + 7
    for reply, code, data in (
        (basic.reply(Sum(5), request), 0, 5),
        (basic.failure(rpc.RemoteExceptionCode.REMOTE_EX_UNSUPPORTED, request), 1, 0),
    ):
        expected = b"\0\1\0\0" + IDENTITY + struct.pack("<ii", code, data)  # relatedRequestId, remoteEx, data
        assert ddsi.serialize(reply, representation=ddsi.XCDR1) == expected
    kinds = [struct_type(type_).type_name for type_ in (rpc.RequestHeader, rpc.ReplyHeader, rpc.SampleIdentity)]
    assert kinds == ["dds::rpc::RequestHeader", "dds::rpc::ReplyHeader", "dds::SampleIdentity"]


def test_the_types_are_to_other_vendors_what_they_are_to_us() -> None:
    """The identifier that Cyclone DDS 11.0.1 computes of the same types, written by hand."""
    basic = mappings.wire(rpc.Mapping.BASIC, "Adder", Numbers, Sum)
    assert ddsi.type_information(basic.request_type).minimal.hex() == "ff2c5f63066216ee7b2f0809dd82"


@pytest.mark.parametrize("local", [False, True], ids=["two participants", "one participant"])
@in_trio
async def test_the_identity_of_what_a_sample_answers_goes_with_it(domain: int, local: bool) -> None:
    async with ddsi.DomainParticipant(domain) as here, ddsi.DomainParticipant(domain) as elsewhere:
        there = here if local else elsewhere
        writer = CorrelatedWriter(here, ddsi.Topic(here, "Sum", Sum), RELIABLE)
        reader = CorrelatedReader(there, ddsi.Topic(there, "Sum", Sum), RELIABLE)
        await writer.wait_for_matched(timeout=5)
        await reader.wait_for_matched(timeout=5)
        far = WRITER, (1 << 33) + 5
        for number, related in enumerate((None, far, (WRITER, 1)), 1):
            assert await writer.write_related(Sum(number), related) == (writer.guid, number)
            sample = await reader.__anext__()
            assert isinstance(sample, CorrelatedSample)
            assert (sample.data.total, sample.identity, sample.related) == (number, (writer.guid, number), related)
