"""The participant as one sans-I/O machine: octets and clock in; datagrams, deadlines and deliveries out."""

from .alarms import Timer
from .effects import Compute, DataAvailable, DiscoveryChanged, Effect, SendDatagram, StatusChanged, WriterProgress
from .local_endpoints import KeyCodec, LocalReader, LocalWriter
from .participant import Participant, ParticipantSetup

__all__ = [
    "Compute",
    "DataAvailable",
    "DiscoveryChanged",
    "Effect",
    "KeyCodec",
    "LocalReader",
    "LocalWriter",
    "Participant",
    "ParticipantSetup",
    "SendDatagram",
    "StatusChanged",
    "Timer",
    "WriterProgress",
]
