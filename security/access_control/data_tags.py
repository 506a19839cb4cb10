"""DataTags on the wire: what a writer or reader is tagged with, in its secure announcement.

DDS-Security 1.1 §7.2.5, §9.3.2.1; parameter 0x1003, ``sequence<Tag>`` of ``{string name; string value}`` in CDR.
"""

from __future__ import annotations

from collections.abc import Iterable
from typing import Final

from ddsi.serialization.cursor import Reader, Writer
from ddsi.structure.discovered import Parameter

from ..attributes import DataTags

__all__ = ["PID_DATA_TAGS", "data_tags_of", "data_tags_parameter"]

PID_DATA_TAGS: Final = 0x1003
_MOST_TAGS = 100


def data_tags_parameter(tags: DataTags) -> Parameter:
    """The parameter that announces ``tags``."""
    writer = Writer(little_endian=True)
    writer.sequence_length(len(tags))
    for name, value in tags:
        writer.string(name)
        writer.string(value)
    return PID_DATA_TAGS, writer.getvalue()


def data_tags_of(parameters: Iterable[Parameter]) -> DataTags:
    """The tags that an endpoint announces; none, if it has no such parameter.  Raises MalformedMessage."""
    octets = next((value for pid, value in parameters if pid == PID_DATA_TAGS), None)
    if octets is None:
        return ()
    reader = Reader(octets, little_endian=True)
    count = reader.sequence_length(most=_MOST_TAGS)
    return tuple((reader.string(), reader.string()) for _ in range(count))
