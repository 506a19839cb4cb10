"""Cryptography: octets protected and opened again in one process, each beside one bare AES-GCM call of that size.

The ratio says what the plugin itself adds.
"""

from __future__ import annotations

import os
import time
from collections.abc import Callable
from functools import partial

from cryptography.hazmat.primitives.ciphers.aead import AESGCM

from benchmarks.sides.bursts import Operation, quickest
from benchmarks.sides.protocol import play
from ddsi.spi import Outcome, Parts, Refused
from ddsi_security.attributes import EndpointSecurityAttributes, ParticipantSecurityAttributes
from ddsi_security.cryptographic import AesGcmGmac
from ddsi_security.cryptographic.crypto_handles import (
    LocalParticipant,
    LocalReader,
    LocalWriter,
    RemoteParticipant,
    RemoteReader,
    RemoteWriter,
)
from ddsi_security.handles import IdentityHandle, PermissionsHandle, SharedSecretHandle

# Protected, encrypted, origin authenticated.
_KINDS = {
    "sign": (True, False, False),
    "encrypt": (True, True, False),
    "sign-origin": (True, False, True),
    "encrypt-origin": (True, True, True),
}


class _Participant:
    def __init__(self, kind: str) -> None:
        self.is_protected, self.encrypted, self.origin = _KINDS[kind]
        self.plugin = AesGcmGmac({}, entropy=os.urandom, wall_clock=time.time_ns)
        attributes = ParticipantSecurityAttributes(
            is_rtps_protected=True, plugin_participant_attributes=self.encrypted << 0 | self.origin << 3
        )
        self.local: LocalParticipant = self.plugin.register_local_participant(
            IdentityHandle(), PermissionsHandle(), {}, attributes
        )
        self.endpoint = EndpointSecurityAttributes(
            is_submessage_protected=True,
            is_payload_protected=True,
            plugin_endpoint_attributes=self.encrypted << 0 | self.encrypted << 1 | self.origin << 2,
        )

    def meet(self, secret: SharedSecretHandle) -> RemoteParticipant:
        return self.plugin.register_matched_remote_participant(
            self.local, IdentityHandle(), PermissionsHandle(), secret
        )


class _Pair:
    """A writer here, a reader there, in possession of each other's keys."""

    def __init__(self, kind: str) -> None:
        self.alice, self.bob = alice, bob = _Participant(kind), _Participant(kind)
        secrets = [SharedSecretHandle(bytes(32), bytes(32), bytes(32), is_replier=replier) for replier in (False, True)]
        self.there, self.here = alice.meet(secrets[0]), bob.meet(secrets[1])
        tokens = alice.plugin.create_local_participant_crypto_tokens(alice.local, self.there)
        assert bob.plugin.set_remote_participant_crypto_tokens(bob.local, self.here, tokens) is None
        self.writer: LocalWriter = alice.plugin.register_local_datawriter(alice.local, {}, alice.endpoint)
        self.reader: LocalReader = bob.plugin.register_local_datareader(bob.local, {}, bob.endpoint)
        self.remote_reader: RemoteReader = alice.plugin.register_matched_remote_datareader(
            self.writer, self.there, secrets[0], relay_only=False
        )
        self.remote_writer: RemoteWriter = bob.plugin.register_matched_remote_datawriter(
            self.reader, self.here, secrets[1]
        )
        tokens = alice.plugin.create_local_datawriter_crypto_tokens(self.writer, self.remote_reader)
        assert bob.plugin.set_remote_datawriter_crypto_tokens(self.reader, self.remote_writer, tokens) is None

    def payload(self, octets: int) -> tuple[Callable[[], Parts | Refused], Callable[[memoryview], object]]:
        plain = os.urandom(octets)
        protect = self.alice.plugin.encode_serialized_payload
        unprotect = self.bob.plugin.decode_serialized_payload
        encode = partial(protect, bytearray(), plain, self.writer)
        return encode, lambda protected: unprotect(protected, b"", self.reader, self.remote_writer)

    def submessage(self, octets: int) -> tuple[Callable[[], Parts | Refused], Callable[[memoryview], object]]:
        plain = (_data(octets),)
        protect = self.alice.plugin.encode_datawriter_submessage
        unprotect = self.bob.plugin.decode_datawriter_submessage
        receivers = [self.remote_reader]
        encode = partial(protect, plain, self.writer, receivers)
        return encode, lambda protected: unprotect(protected, self.reader, self.remote_writer)

    def message(self, octets: int) -> tuple[Callable[[], Parts | Refused], Callable[[memoryview], object]]:
        plain = (b"RTPS\2\5\1\x10" + bytes(12), _data(octets))
        protect = self.alice.plugin.encode_rtps_message
        unprotect = self.bob.plugin.decode_rtps_message
        receivers = [self.there]
        encode = partial(protect, plain, self.alice.local, receivers)
        return encode, lambda protected: unprotect(protected, self.bob.local, self.here)


def _data(octets: int) -> bytes:
    """A DATA submessage of so many octets."""
    return b"\x15\x05" + (octets - 4).to_bytes(2, "little") + os.urandom(octets - 4)


def transform(level: str, kind: str, octets: int, count: int) -> dict[str, float]:
    """``encode`` and ``decode`` in multiples of the bare call's time, and the times themselves in microseconds."""
    pair = _Pair(kind)
    encode, decode = {"payload": pair.payload, "submessage": pair.submessage, "message": pair.message}[level](octets)
    encoded = encode()
    assert not isinstance(encoded, Refused), encoded
    protected = memoryview(b"".join(encoded))
    opened = decode(protected)
    assert not isinstance(opened, Outcome), opened
    aead, nonce, plain = AESGCM(os.urandom(32)), os.urandom(12), os.urandom(octets)
    operations: dict[str, Operation] = {
        "bare": lambda: aead.encrypt(nonce, plain, None),
        "encode": encode,
        "decode": lambda: decode(protected),
    }
    seconds = quickest(operations, count)
    return {
        "encode": seconds["encode"] / seconds["bare"],
        "decode": seconds["decode"] / seconds["bare"],
        **{f"{name}_us": value * 1e6 for name, value in seconds.items()},
    }


if __name__ == "__main__":
    play({"transform": transform})
