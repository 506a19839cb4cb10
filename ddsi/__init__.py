"""ddsi: a complete RTPS/DDSI stack in pure Python, with OMG DDS Security built in.

General layout, top to bottom; a room imports only rooms above it, never this package itself
(``tests/test_layering.py`` holds the code to it):

    structure      values: Guid, Locator, SequenceNumber, Time, CacheChange, QoS        RTPS 8.2
    serialization  bounded cursors, encapsulation, parameter lists                      RTPS 10
    xtypes         types, generated codecs, keys, TypeObjects                           DDS-XTypes
    config         Config and DDSI_URI
    messages       datagrams to submessages and back                                    RTPS 8.3
    trace          what the engine does, as events, and their rendering
    spi            the seam to security
    behavior       writers, readers, caches, order and repair                           RTPS 8.4
    discovery      SPDP, SEDP, matching                                                 RTPS 8.5
    engine         the participant as one machine without I/O
    transport      sockets, clock, trio                  simulation   the same engine over a virtual network
    storage        samples that outlive a process, in SQLite
    dcps           what applications hold                                               DDS 1.4
    portal         the engine in a thread of its own; blocking, aio: its faces for scripts and for asyncio
    rpc            request and reply                                                    DDS-RPC 1.0
    cli            the ``ddsi`` command

The names below are the public face, and so are ``ddsi.blocking``, ``ddsi.aio`` and ``ddsi.rpc``, imported when they
are first used; everything else may change.
"""

from typing import TYPE_CHECKING

from .config import Config
from .config.secure import secure
from .dcps import (
    BuiltinTopicReader,
    Condition,
    ContentFilteredTopic,
    DataReader,
    DataWriter,
    DomainParticipant,
    Entity,
    EventStream,
    GuardCondition,
    MultiTopic,
    MultiTopicReader,
    Publisher,
    QueryCondition,
    ReadCondition,
    Sample,
    StatusCondition,
    Subscriber,
    Topic,
    WaitSet,
)
from .discovery.explanation import Explanation, LonelyTopic, PairExplanation, ParticipantTrouble
from .discovery.remedies import Disagreement
from .structure.builtin_topic_data import (
    ParticipantBuiltinTopicData,
    PublicationBuiltinTopicData,
    SubscriptionBuiltinTopicData,
    TopicBuiltinTopicData,
)
from .structure.errors import (
    AlreadyDeleted,
    BadParameter,
    ConfigurationError,
    DdsError,
    DdsTimeout,
    ImmutablePolicy,
    InconsistentPolicy,
    MalformedSample,
    NotAllowedBySecurity,
    OutOfResources,
    PreconditionNotMet,
)
from .structure.guid import Guid
from .structure.qos import EndpointQos, Qos
from .structure.qos_policies import (
    AccessScope,
    Automatic,
    BestEffort,
    BinaryProperty,
    ByReceptionTimestamp,
    BySourceTimestamp,
    DataRepresentation,
    DataRepresentationId,
    DataTags,
    Deadline,
    DurabilityService,
    EntityFactory,
    Exclusive,
    GroupData,
    KeepAll,
    KeepLast,
    LatencyBudget,
    Lifespan,
    ManualByParticipant,
    ManualByTopic,
    OwnershipStrength,
    Partition,
    Persistent,
    Presentation,
    Property,
    ReaderDataLifecycle,
    Reliable,
    ResourceLimits,
    Shared,
    TimeBasedFilter,
    TopicData,
    Transient,
    TransientLocal,
    TransportPriority,
    TypeConsistency,
    UserData,
    Volatile,
    WriterDataLifecycle,
)
from .structure.sample_info import InstanceState, SampleInfo, SampleState, ViewState
from .structure.security_information import EndpointSecurity, ParticipantSecurity
from .structure.status import (
    DataAvailable,
    DataOnReaders,
    Incompatibility,
    InconsistentTopic,
    LivelinessChanged,
    LivelinessLost,
    OfferedDeadlineMissed,
    OfferedIncompatibleQos,
    PublicationMatched,
    RequestedDeadlineMissed,
    RequestedIncompatibleQos,
    SampleLost,
    SampleRejected,
    SampleRejectedKind,
    SecurityRefused,
    SecurityRevoked,
    Status,
    SubscriptionMatched,
)
from .structure.time import Time
from .xtypes import deserialize, dynamic_type, idl, key_hash, serialize, type_information, type_objects

if TYPE_CHECKING:
    from . import aio as aio
    from . import blocking as blocking
    from . import rpc as rpc
    from .config.qos_profiles import QosProvider as QosProvider
    from .dcps.persistence_service import PersistenceService as PersistenceService
else:
    _LAZY = {"PersistenceService": "dcps.persistence_service", "QosProvider": "config.qos_profiles"}

    def __getattr__(name: str) -> object:
        """``ddsi.rpc`` after ``import ddsi`` alone: few programs need these, so they are not imported before."""
        if name in ("aio", "blocking", "rpc"):
            from importlib import import_module

            return import_module(f".{name}", __name__)
        if name in _LAZY:
            from importlib import import_module

            return getattr(import_module(f".{_LAZY[name]}", __name__), name)
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")


XCDR1 = DataRepresentationId.XCDR1
XCDR2 = DataRepresentationId.XCDR2

__version__ = "0.1.0"

__all__ = [
    "XCDR1",
    "XCDR2",
    "AccessScope",
    "AlreadyDeleted",
    "Automatic",
    "BadParameter",
    "BestEffort",
    "BinaryProperty",
    "BuiltinTopicReader",
    "ByReceptionTimestamp",
    "BySourceTimestamp",
    "Condition",
    "Config",
    "ConfigurationError",
    "ContentFilteredTopic",
    "DataAvailable",
    "DataOnReaders",
    "DataReader",
    "DataRepresentation",
    "DataRepresentationId",
    "DataTags",
    "DataWriter",
    "DdsError",
    "DdsTimeout",
    "Deadline",
    "Disagreement",
    "DomainParticipant",
    "DurabilityService",
    "EndpointQos",
    "EndpointSecurity",
    "Entity",
    "EntityFactory",
    "EventStream",
    "Exclusive",
    "Explanation",
    "GroupData",
    "GuardCondition",
    "Guid",
    "ImmutablePolicy",
    "Incompatibility",
    "InconsistentPolicy",
    "InconsistentTopic",
    "InstanceState",
    "KeepAll",
    "KeepLast",
    "LatencyBudget",
    "Lifespan",
    "LivelinessChanged",
    "LivelinessLost",
    "LonelyTopic",
    "MalformedSample",
    "ManualByParticipant",
    "ManualByTopic",
    "MultiTopic",
    "MultiTopicReader",
    "NotAllowedBySecurity",
    "OfferedDeadlineMissed",
    "OfferedIncompatibleQos",
    "OutOfResources",
    "OwnershipStrength",
    "PairExplanation",
    "ParticipantBuiltinTopicData",
    "ParticipantSecurity",
    "ParticipantTrouble",
    "Partition",
    "PersistenceService",
    "Persistent",
    "PreconditionNotMet",
    "Presentation",
    "Property",
    "PublicationBuiltinTopicData",
    "PublicationMatched",
    "Publisher",
    "Qos",
    "QosProvider",
    "QueryCondition",
    "ReadCondition",
    "ReaderDataLifecycle",
    "Reliable",
    "RequestedDeadlineMissed",
    "RequestedIncompatibleQos",
    "ResourceLimits",
    "Sample",
    "SampleInfo",
    "SampleLost",
    "SampleRejected",
    "SampleRejectedKind",
    "SampleState",
    "SecurityRefused",
    "SecurityRevoked",
    "Shared",
    "Status",
    "StatusCondition",
    "Subscriber",
    "SubscriptionBuiltinTopicData",
    "SubscriptionMatched",
    "Time",
    "TimeBasedFilter",
    "Topic",
    "TopicBuiltinTopicData",
    "TopicData",
    "Transient",
    "TransientLocal",
    "TransportPriority",
    "TypeConsistency",
    "UserData",
    "ViewState",
    "Volatile",
    "WaitSet",
    "WriterDataLifecycle",
    "deserialize",
    "dynamic_type",
    "idl",
    "key_hash",
    "secure",
    "serialize",
    "type_information",
    "type_objects",
]
