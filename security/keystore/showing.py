"""What ``ddsi keystore show`` does: says what the files hold."""

from __future__ import annotations

import argparse
import json
from pathlib import Path

from ddsi.structure.errors import ConfigurationError

from .portrait import Portrait, portrait_lines, portray
from .survey import survey

__all__ = ["show"]


def show(arguments: argparse.Namespace) -> int:
    portraits = [portrait for path in arguments.paths for portrait in _of(path)]
    if arguments.json:
        print(json.dumps(portraits, indent=2))
    else:
        print("\n\n".join("\n".join(portrait_lines(portrait)) for portrait in portraits))
    return 0


def _of(path: Path) -> list[Portrait]:
    """Of a folder, all that it holds, without the folders in it."""
    if not path.is_dir():
        return [portray(path)]
    found = survey(path)
    files = sorted({*found.certificates, *found.keys, *found.signed, *found.unsigned})
    if not files:
        raise ConfigurationError(f"{path} holds no certificate, key or document: name the folder of an identity")
    return [portray(file) for file in files]
