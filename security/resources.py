"""Reads what a property points to: certificates, keys and documents, by URI.  DDS-Security 1.1 §9.3.1, §9.4.1.

``file:`` with a path, absolute or not, with or without ``//`` before it, and ``data:,`` with the text itself.  The path
is taken as it is, as all stacks do, and where there is no such file, as a URI has it (``%20``, as ``Path.as_uri``
writes).  A ``pkcs11:`` URI names an object in a hardware token and is not read, so it is refused here.
"""

from __future__ import annotations

import os
from pathlib import Path
from typing import Final
from urllib.parse import unquote

from ddsi.structure.errors import ConfigurationError

__all__ = ["MAX_RESOURCE_OCTETS", "read_resource", "resource_name"]

MAX_RESOURCE_OCTETS: Final = 1 << 20
"""Documents and certificates are some kilobytes; what is larger is not one of them."""


def read_resource(name: str, uri: str) -> bytes:
    """The octets that the property ``name`` points to.  Raises ConfigurationError, which says what to do."""
    if uri.startswith("data:,"):
        octets = uri.removeprefix("data:,").encode()
    elif uri.startswith("file:"):
        octets = _read_file(name, _existing(resource_name(uri)))
    else:
        # Nothing of a value that may be a secret in the wrong place is shown, unless it is a scheme that we know.
        scheme = uri.partition(":")[0]
        given = f"begins with {scheme}:" if scheme in ("http", "https", "pkcs11") else "has no known scheme"
        raise ConfigurationError(
            f"property {name} is a URI, and its value {given}: write file:/path/to/it, or data:, followed by the text"
        )
    if not octets.strip():
        raise ConfigurationError(f"property {name}: {resource_name(uri)} is empty")
    if len(octets) > MAX_RESOURCE_OCTETS:
        raise ConfigurationError(f"property {name}: {resource_name(uri)} is larger than {MAX_RESOURCE_OCTETS} octets")
    return octets


def resource_name(uri: str) -> str:
    """How to call a resource in texts: the path of a file; of the others nothing, as they may hold a secret."""
    if uri.startswith("file:"):
        path = uri.removeprefix("file:")
        return path.removeprefix("//") if path.startswith("//") else path
    return f"the {uri.partition(':')[0]}: URI"


def _existing(path: str) -> str:
    return unquote(path) if "%" in path and not os.path.exists(path) else path


def _read_file(name: str, path: str) -> bytes:
    try:
        with Path(path).open("rb") as file:
            return file.read(MAX_RESOURCE_OCTETS + 1)
    except OSError as error:
        raise ConfigurationError(
            f"property {name}: cannot read {path}: {error.strerror or error}; relative paths start at {Path.cwd()}"
        ) from error
    except ValueError as error:  # a NUL in the path
        raise ConfigurationError(f"property {name}: {path!r} is not a path") from error
