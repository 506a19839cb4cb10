"""``pkcs11:`` URIs: which object of which hardware token is meant, and where its library and PIN are.  RFC 7512.

    pkcs11:token=robots;object=alice?module-path=/usr/lib/softhsm/libsofthsm2.so&pin-value=1234

Text only; ``pkcs11_token`` goes and finds it.
"""

from __future__ import annotations

from dataclasses import field
from typing import Final
from urllib.parse import unquote_to_bytes

from ddsi.structure.dataclass import dataclass
from ddsi.structure.errors import ConfigurationError

from ..resources import read_resource

__all__ = ["Pkcs11Uri"]

_PATH: Final = ("token", "manufacturer", "serial", "model", "object", "id", "type", "slot-id")
_IGNORED_PATH: Final = ("library-manufacturer", "library-version", "library-description", "slot-manufacturer")
_QUERY: Final = ("module-path", "module-name", "pin-value", "pin-source")
_DEFAULT_MODULE: Final = "p11-kit-proxy.so"
"""It offers the tokens of all modules that are registered on a Linux system."""


@dataclass(frozen=True, slots=True)
class Pkcs11Uri:
    """What is None, any will do.  ``module``: the library to load, a path or a name on the loader's own path."""

    module: str
    token: str | None = None
    manufacturer: str | None = None
    model: str | None = None
    serial: bytes | None = None
    slot_id: int | None = None
    label: str | None = None
    object_id: bytes | None = None
    pin: str | None = field(default=None, repr=False)

    @classmethod
    def parse(cls, name: str, uri: str, *, password: str | None) -> Pkcs11Uri:
        """``name`` is the property's; ``password`` serves where the URI has no PIN.  Raises ConfigurationError."""
        path, _, query = uri.removeprefix("pkcs11:").partition("?")
        where = _attributes(name, path, ";", (*_PATH, *_IGNORED_PATH))
        how = _attributes(name, query, "&", _QUERY)
        slot_id = where.get("slot-id")
        if slot_id is not None and not slot_id.isdigit():
            raise _refused(name, "its slot-id is no number")
        if "object" not in where and "id" not in where:
            raise _refused(name, "it says neither object= (the label) nor id= of what is meant")
        return cls(
            module=_text(how.get("module-path") or how.get("module-name") or _DEFAULT_MODULE.encode()),
            token=_optional_text(where.get("token")),
            manufacturer=_optional_text(where.get("manufacturer")),
            model=_optional_text(where.get("model")),
            serial=where.get("serial"),
            slot_id=None if slot_id is None else int(slot_id),
            label=_optional_text(where.get("object")),
            object_id=where.get("id"),
            pin=_pin(name, how) or password,
        )

    def __str__(self) -> str:
        """What is meant, in words, without the PIN."""
        what = f"label {self.label!r}" if self.label is not None else f"id {(self.object_id or b'').hex()}"
        return f"{what} in token {self.token!r}" if self.token is not None else what


def _attributes(name: str, text: str, separator: str, known: tuple[str, ...]) -> dict[str, bytes]:
    attributes: dict[str, bytes] = {}
    for part in filter(None, text.split(separator)):
        key, equals, value = part.partition("=")
        if not equals or key in attributes:
            raise _refused(name, "an attribute has no value, or occurs twice")
        if key not in known and not key.startswith("x-"):
            # Only the name is shown: the value may be a PIN.
            raise _refused(name, f"attribute {key[:40]!r} is unknown; known are {', '.join(known)}")
        attributes[key] = unquote_to_bytes(value)
    return attributes


def _pin(name: str, how: dict[str, bytes]) -> str | None:
    if "pin-value" in how:
        return _text(how["pin-value"])
    if "pin-source" not in how:
        return None
    source = _text(how["pin-source"])
    if source.startswith("|"):
        raise _refused(name, "its pin-source is a command, which is not run: write pin-source=file:/path/to/it")
    source = source if source.startswith("file:") else f"file:{source}"
    return _text(read_resource(name, source).strip())


def _optional_text(octets: bytes | None) -> str | None:
    return None if octets is None else _text(octets)


def _text(octets: bytes) -> str:
    return octets.decode("utf-8", "replace")


def _refused(name: str, reason: str) -> ConfigurationError:
    return ConfigurationError(
        f"property {name}: the pkcs11: URI cannot be used: {reason}; it looks like "
        "pkcs11:token=NAME;object=LABEL?module-path=/path/to/library.so&pin-source=file:/path (RFC 7512)"
    )
