"""LogOptions, as the participant's properties say them.  DDS-Security 1.1 §8.6.2, §9.6."""

from __future__ import annotations

import difflib
from typing import Final

from ddsi.structure.errors import ConfigurationError
from ddsi.structure.qos_policies import Properties

from ..logging_plugin import LogLevel, LogOptions
from ..properties import LOG_DISTRIBUTE, LOG_FILE, LOG_LEVEL, security_properties

__all__ = ["LEVEL_NAMES", "options_from"]

# The OMG's names, with or without their ending, and the one that Fast DDS spells out.
LEVEL_NAMES: Final = {
    **{level.name: level for level in LogLevel},
    **{level.name.removesuffix("_LEVEL"): level for level in LogLevel},
    "INFORMATIONAL_LEVEL": LogLevel.INFO_LEVEL,
    "INFORMATIONAL": LogLevel.INFO_LEVEL,
}
_BOOLEANS: Final = {"true": True, "1": True, "false": False, "0": False}


def options_from(properties: Properties) -> LogOptions:
    """The options, with the OMG's defaults for what is not given.  Raises ConfigurationError."""
    given = security_properties(properties)
    default = LogOptions()
    return LogOptions(
        logging_level=_level(given[LOG_LEVEL]) if LOG_LEVEL in given else default.logging_level,
        log_file=_path(given.get(LOG_FILE, default.log_file)),
        distribute=_boolean(given[LOG_DISTRIBUTE]) if LOG_DISTRIBUTE in given else default.distribute,
    )


def _level(name: str) -> LogLevel:
    level = LEVEL_NAMES.get(name.upper())
    if level is None:
        nearest = difflib.get_close_matches(name.upper(), LEVEL_NAMES, n=1)
        hint = f"did you mean {nearest[0]}?" if nearest else f"known are {', '.join(level.name for level in LogLevel)}"
        raise ConfigurationError(f"property {LOG_LEVEL} is {name!r}, which is no level: {hint}")
    return level


def _path(text: str) -> str:
    """A path; also as the URI by which other properties name files."""
    return text.removeprefix("file://") if text.startswith("file://") else text.removeprefix("file:")


def _boolean(text: str) -> bool:
    if text.lower() not in _BOOLEANS:
        raise ConfigurationError(f"property {LOG_DISTRIBUTE} is {text!r}: write true or false")
    return _BOOLEANS[text.lower()]
