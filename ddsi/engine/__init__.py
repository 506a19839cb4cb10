"""The participant as one sans-I/O machine: octets and clock in; datagrams, deadlines and deliveries out."""

from .alarms import Timer
from .builtin_topic_data import participant_data, publication_data, subscription_data
from .builtin_topic_readers import BuiltinTopicChange, LocalBuiltinTopicReader
from .effects import (
    Compute,
    DataAvailable,
    DiscoveryChanged,
    Effect,
    MatchRefused,
    SendDatagram,
    StatusChanged,
    WriterProgress,
)
from .local_endpoints import KeyCodec, LocalReader, LocalWriter
from .participant import Participant, ParticipantSetup

__all__ = [
    "BuiltinTopicChange",
    "Compute",
    "DataAvailable",
    "DiscoveryChanged",
    "Effect",
    "KeyCodec",
    "LocalBuiltinTopicReader",
    "LocalReader",
    "LocalWriter",
    "MatchRefused",
    "Participant",
    "ParticipantSetup",
    "SendDatagram",
    "StatusChanged",
    "Timer",
    "WriterProgress",
    "participant_data",
    "publication_data",
    "subscription_data",
]
