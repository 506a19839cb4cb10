"""The builtin cryptographic plugin of Cyclone DDS, called as its own core calls it (dds_security_api_cryptography.h).

Only as much as one participant with one peer needs.  Every operation returns whether it succeeded, or what it made;
why it did not is in :attr:`CyclonePlugin.reason`.
"""

from __future__ import annotations

import ctypes
from collections.abc import Sequence
from ctypes import POINTER, byref, c_char_p, c_int32, c_int64, c_ubyte, c_uint32, c_void_p
from pathlib import Path
from typing import Any

from ddsi_security.tokens import CryptoToken

PATHS = sorted(Path("/usr/lib").glob("*/libddsc*/libdds_security_crypto.so*"))


class _Octets(ctypes.Structure):
    _fields_ = [("maximum", c_uint32), ("length", c_uint32), ("buffer", POINTER(c_ubyte))]


class _Handles(ctypes.Structure):
    _fields_ = [("maximum", c_uint32), ("length", c_uint32), ("buffer", POINTER(c_int64))]


class _Property(ctypes.Structure):
    _fields_ = [("name", c_char_p), ("value", c_char_p), ("propagate", c_ubyte)]


class _Properties(ctypes.Structure):
    _fields_ = [("maximum", c_uint32), ("length", c_uint32), ("buffer", POINTER(_Property))]


class _BinaryProperty(ctypes.Structure):
    _fields_ = [("name", c_char_p), ("value", _Octets), ("propagate", c_ubyte)]


class _BinaryProperties(ctypes.Structure):
    _fields_ = [("maximum", c_uint32), ("length", c_uint32), ("buffer", POINTER(_BinaryProperty))]


class _Token(ctypes.Structure):
    _fields_ = [("class_id", c_char_p), ("properties", _Properties), ("binary_properties", _BinaryProperties)]


class _Tokens(ctypes.Structure):
    _fields_ = [("maximum", c_uint32), ("length", c_uint32), ("buffer", POINTER(_Token))]


class _Exception(ctypes.Structure):
    _fields_ = [("message", c_char_p), ("code", c_int32), ("minor_code", c_int32)]


class _ParticipantAttributes(ctypes.Structure):
    _fields_ = [("flags", c_ubyte * 5), ("mask", c_uint32), ("properties", _Properties)]


class _EndpointAttributes(ctypes.Structure):
    _fields_ = [("flags", c_ubyte * 7), ("mask", c_uint32), ("properties", _Properties)]


class _Secret(ctypes.Structure):
    _fields_ = [("secret", POINTER(c_ubyte)), ("size", c_int32), ("challenges", c_ubyte * 64)]


class _Plugin(ctypes.Structure):
    _fields_ = [("gv", c_void_p), *((name, POINTER(c_void_p)) for name in ("transform", "factory", "exchange"))]


_FACTORY = [
    "register_local_participant",
    "register_matched_remote_participant",
    "register_local_datawriter",
    "register_matched_remote_datareader",
    "register_local_datareader",
    "register_matched_remote_datawriter",
]
_EXCHANGE = [
    "create_local_participant_crypto_tokens",
    "set_remote_participant_crypto_tokens",
    "create_local_datawriter_crypto_tokens",
    "set_remote_datawriter_crypto_tokens",
    "create_local_datareader_crypto_tokens",
    "set_remote_datareader_crypto_tokens",
]
_TRANSFORM = [
    "encode_serialized_payload",
    "encode_datawriter_submessage",
    "encode_datareader_submessage",
    "encode_rtps_message",
    "decode_rtps_message",
    "preprocess_secure_submsg",
    "decode_datawriter_submessage",
    "decode_datareader_submessage",
    "decode_serialized_payload",
]
_ANY_HANDLE = 1


class CyclonePlugin:
    def __init__(self, path: Path) -> None:
        library = ctypes.CDLL(str(path))
        context = c_void_p()
        assert library.init_crypto(None, byref(context), None) == 0
        self._plugin = ctypes.cast(context, POINTER(_Plugin)).contents
        self.reason = ""

    def _call(self, part: str, names: list[str], name: str, result: Any, *arguments: object) -> Any:
        instance = getattr(self._plugin, part)
        kinds = [c_int64 if isinstance(argument, int) else c_void_p for argument in arguments]
        function = ctypes.CFUNCTYPE(result, c_void_p, *kinds, c_void_p)(instance[names.index(name)])
        error = _Exception()
        found = function(ctypes.cast(instance, c_void_p), *arguments, byref(error))
        self.reason = (error.message or b"").decode()
        return found

    # --- keys ----------------------------------------------------------------------------------------------------

    def register_local_participant(self, *, is_protected: bool, mask: int) -> int:
        attributes = _ParticipantAttributes((c_ubyte * 5)(0, 0, is_protected, 0, 0), mask, _Properties())
        name = "register_local_participant"
        return self._factory(name, _ANY_HANDLE, _ANY_HANDLE, byref(_Properties()), byref(attributes))

    def register_matched_remote_participant(self, local: int, first: bytes, second: bytes, secret: bytes) -> int:
        octets = (c_ubyte * len(secret)).from_buffer_copy(secret)
        shared = _Secret(octets, len(secret), (c_ubyte * 64).from_buffer_copy(first + second))
        self._secret = shared, octets
        handle = ctypes.addressof(shared)
        return self._factory("register_matched_remote_participant", local, _ANY_HANDLE, _ANY_HANDLE, handle)

    def register_local(
        self, kind: str, participant: int, *, flags: tuple[bool, bool], mask: int, name: str = ""
    ) -> int:
        """``kind``: datawriter or datareader; ``flags``: are submessages, are payloads protected?"""
        attributes = _EndpointAttributes((c_ubyte * 7)(0, 0, 0, 0, *flags, 0), mask, _Properties())
        properties = _Properties()
        if name:
            found = (_Property * 1)(_Property(b"dds.sec.builtin_endpoint_name", name.encode(), 0))
            properties = _Properties(1, 1, found)
        return self._factory(f"register_local_{kind}", participant, byref(properties), byref(attributes))

    def register_matched_remote(self, kind: str, local: int, participant: int) -> int:
        handle = ctypes.addressof(self._secret[0])
        relay_only = (0,) if kind == "datareader" else ()
        return self._factory(f"register_matched_remote_{kind}", local, participant, handle, *relay_only)

    def _factory(self, name: str, *arguments: object) -> int:
        return int(self._call("factory", _FACTORY, name, c_int64, *arguments))

    def create_tokens(self, kind: str, local: int, remote: int) -> list[CryptoToken]:
        tokens = _Tokens()
        name = f"create_local_{kind}_crypto_tokens"
        assert self._call("exchange", _EXCHANGE, name, c_ubyte, byref(tokens), local, remote), self.reason
        return [_from_c(tokens.buffer[number]) for number in range(tokens.length)]

    def set_tokens(self, kind: str, local: int, remote: int, tokens: Sequence[CryptoToken]) -> bool:
        found = (_Token * len(tokens))(*map(_to_c, tokens))
        sequence = _Tokens(len(tokens), len(tokens), found)
        name = f"set_remote_{kind}_crypto_tokens"
        return bool(self._call("exchange", _EXCHANGE, name, c_ubyte, local, remote, byref(sequence)))

    # --- octets --------------------------------------------------------------------------------------------------

    def encode_payload(self, plain: bytes, writer: int) -> bytes | None:
        return self._transform("encode_serialized_payload", byref(_Octets()), byref(_octets(plain)), writer)

    def encode_submessage(self, plain: bytes, writer: int, readers: list[int]) -> bytes | None:
        index = c_int32(0)
        arguments = byref(_octets(plain)), writer, byref(_handles(readers)), byref(index)
        return self._transform("encode_datawriter_submessage", *arguments)

    def encode_message(self, plain: bytes, participant: int, remotes: list[int]) -> bytes | None:
        index = c_int32(0)
        arguments = byref(_octets(plain)), participant, byref(_handles(remotes)), byref(index)
        return self._transform("encode_rtps_message", *arguments)

    def decode_payload(self, octets: bytes, reader: int, writer: int) -> bytes | None:
        arguments = byref(_octets(octets)), byref(_Octets()), reader, writer
        return self._transform("decode_serialized_payload", *arguments)

    def decode_submessage(self, octets: bytes, reader: int, writer: int) -> bytes | None:
        return self._transform("decode_datawriter_submessage", byref(_octets(octets)), reader, writer)

    def decode_answer(self, octets: bytes, writer: int, reader: int) -> bytes | None:
        return self._transform("decode_datareader_submessage", byref(_octets(octets)), writer, reader)

    def decode_message(self, octets: bytes, local: int, remote: int) -> bytes | None:
        return self._transform("decode_rtps_message", byref(_octets(octets)), local, remote)

    def _transform(self, name: str, *arguments: object) -> bytes | None:
        found = _Octets()
        if not self._call("transform", _TRANSFORM, name, c_ubyte, byref(found), *arguments):
            return None
        return bytes(found.buffer[: found.length])


def _octets(octets: bytes) -> _Octets:
    return _Octets(len(octets), len(octets), (c_ubyte * len(octets)).from_buffer_copy(octets))


def _handles(handles: list[int]) -> _Handles:
    return _Handles(len(handles), len(handles), (c_int64 * len(handles))(*handles))


def _to_c(token: CryptoToken) -> _Token:
    binary = [_BinaryProperty(name.encode(), _octets(value), 1) for name, value in token.binary_properties]
    count = len(binary)
    found = (_BinaryProperty * count)(*binary)
    return _Token(token.class_id.encode(), _Properties(), _BinaryProperties(count, count, found))


def _from_c(token: _Token) -> CryptoToken:
    properties = [token.binary_properties.buffer[number] for number in range(token.binary_properties.length)]
    binary = tuple((one.name.decode(), bytes(one.value.buffer[: one.value.length])) for one in properties)
    return CryptoToken(token.class_id.decode(), (), binary)
