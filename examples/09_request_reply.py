"""Request and reply: a clerk who looks words up, and two people who ask at once.

A client asks a service by its name and gets the answer that is its own, an error of the service, or a timeout; the
service answers when it likes, in any order.  Underneath are two topics, `Dictionary_Request` and `Dictionary_Reply`,
laid out as DDS-RPC's basic mapping has it.

You will see what each of the two was told; which of them is first, chance decides:

    alice: heartbeat: says which samples there are
    bob:   nothing, REMOTE_EX_INVALID_ARGUMENT

    python examples/09_request_reply.py
"""

import trio

import ddsi
from ddsi import idl, rpc

WORDS = {"heartbeat": "says which samples there are", "acknack": "says which have come, and which are missing"}


@idl.struct
class Word:
    text: str


@idl.struct
class Meaning:
    text: str


async def look_up(word: Word) -> Meaning:
    """What the service does with a request; several of these run at a time."""
    if word.text not in WORDS:
        raise rpc.RemoteError(rpc.RemoteExceptionCode.REMOTE_EX_INVALID_ARGUMENT)
    return Meaning(WORDS[word.text])


async def ask(name: str, word: str) -> None:
    async with ddsi.DomainParticipant(0) as participant:
        client = rpc.Client(participant, "Dictionary", Word, Meaning)
        try:
            meaning = await client.call(Word(word), timeout=10)
            print(f"{name + ':':6} {word}: {meaning.text}")
        except rpc.RemoteError as error:
            print(f"{name + ':':6} nothing, {error.code.name}")


async def main() -> None:
    async with ddsi.DomainParticipant(0) as participant, trio.open_nursery() as serving:
        service = rpc.Service(participant, "Dictionary", Word, Meaning)
        serving.start_soon(service.serve, look_up)
        async with trio.open_nursery() as asking:
            asking.start_soon(ask, "alice", "heartbeat")
            asking.start_soon(ask, "bob", "gap")
        service.close()


trio.run(main)
