"""Files read, and files written together: private ones for their owner only, nothing overwritten without being asked.

Everything is looked at before anything is written, so that a refusal leaves the disk as it was.  Every file appears
whole, under a temporary name first; a private key is never, not for a moment, readable by others.
"""

from __future__ import annotations

import os
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Final

from ddsi.structure.errors import ConfigurationError

__all__ = ["MAX_FILE_OCTETS", "FileSet", "read_file"]

MAX_FILE_OCTETS: Final = 1 << 20
"""Certificates, keys and documents are some kilobytes; what is larger is none of these."""


_PRIVATE_FILE: Final = 0o600
_PUBLIC_FILE: Final = 0o644
_PRIVATE_FOLDER: Final = 0o700


@dataclass(slots=True)
class FileSet:
    """What is to be written; :meth:`write` does it.  Adding a path again replaces what was to be there."""

    _octets: dict[Path, bytes] = field(default_factory=dict, repr=False)
    _links: dict[Path, Path] = field(default_factory=dict)
    _private: set[Path] = field(default_factory=set)

    def add(self, path: Path, octets: bytes, *, private: bool = False) -> None:
        """A file; ``private`` for one that others must not read."""
        self._octets[path] = octets
        if private:
            self._private.add(path)

    def add_link(self, path: Path, target: Path) -> None:
        """A symbolic link, relative, to a file of this set or one that is there; a copy where links cannot be."""
        self._links[path] = target

    def add_private_folder(self, path: Path) -> None:
        """A folder that only its owner may enter.  The others come into being with their files, as the umask says."""
        self._private.add(path)

    @property
    def paths(self) -> list[Path]:
        """The files, without the links."""
        return list(self._octets)

    def write(self, *, force: bool) -> None:
        """All of it.  Raises ConfigurationError if something is there already, unless ``force``; OSError too."""
        if not force:
            _refuse_to_overwrite([path for path in (*self._octets, *self._links) if os.path.lexists(path)])
        for path in (*self._octets, *self._links):
            self._make_folder(path.parent)
        for path, octets in self._octets.items():
            _write(path, octets, _PRIVATE_FILE if path in self._private else _PUBLIC_FILE)
        for path, target in self._links.items():
            _link(path, target)

    def _make_folder(self, folder: Path) -> None:
        """It and those above it that are missing."""
        if folder.is_dir():
            return
        self._make_folder(folder.parent)
        folder.mkdir(mode=_PRIVATE_FOLDER if folder in self._private else 0o777)


def read_file(path: Path) -> bytes:
    """All of a file.  Raises ConfigurationError naming it if it cannot be read, or is too large to be one of ours."""
    try:
        with path.open("rb") as file:
            octets = file.read(MAX_FILE_OCTETS + 1)
    except OSError as error:
        raise ConfigurationError(
            f"{path} cannot be read: {error.strerror or error}; check its name and mode"
        ) from error
    if len(octets) > MAX_FILE_OCTETS:
        raise ConfigurationError(
            f"{path} has more than {MAX_FILE_OCTETS} octets: it is no certificate, key or document"
        )
    return octets


def _refuse_to_overwrite(present: Sequence[Path]) -> None:
    if present:
        others = f" and {len(present) - 1} more" if len(present) > 1 else ""
        raise ConfigurationError(
            f"{present[0]}{others} would be overwritten: choose another place, or say --force if they are not needed"
        )


def _write(path: Path, octets: bytes, mode: int) -> None:
    """A new file in the place of whatever is there; a symbolic link is replaced, not followed."""
    temporary = path.with_name(f".{path.name}.new")
    temporary.unlink(missing_ok=True)  # of somebody who was interrupted; "x" sees to it that nobody lent us theirs
    with open(temporary, "xb", opener=lambda name, flags: os.open(name, flags, mode)) as file:
        file.write(octets)
    os.replace(temporary, path)


def _link(path: Path, target: Path) -> None:
    path.unlink(missing_ok=True)
    try:
        path.symlink_to(os.path.relpath(target, path.parent))
    except (OSError, NotImplementedError):  # Windows asks for a privilege, and some file systems have no links
        _write(path, target.read_bytes(), _PUBLIC_FILE)
