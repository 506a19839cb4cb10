"""The elements and attributes that may stand in ``DDSI_URI``: Cyclone DDS's names, and ``Bounds``, which is ours.

A name that is not here is a mistake, and is refused with the nearest that is.  Which of these have an effect,
``settings.py`` says; all others are known, so that people can bring the file they have, and are warned about.
Names are compared without regard to case, as Cyclone does.
"""

from __future__ import annotations

import difflib
from dataclasses import dataclass, field

__all__ = ["DOMAIN", "ROOT_NAMES", "Word"]

ROOT_NAMES = ("DDSI", "CycloneDDS")


@dataclass(slots=True)
class Word:
    """An element that may stand at this place, with its attributes and what may stand inside it."""

    name: str
    path: str
    attributes: dict[str, str] = field(default_factory=dict)
    children: dict[str, Word] = field(default_factory=dict)

    def child(self, name: str) -> Word | None:
        return self.children.get(name.lower())

    def suggestion(self, name: str) -> str:
        """What somebody who wrote the element ``name`` here may have meant, as the end of a sentence."""
        names = list(dict.fromkeys(word.name for word in self.children.values()))
        for word in _everywhere(DOMAIN):
            if word.name.lower() == name.lower():
                return f"<{word.name}> belongs into <{word.path.rpartition('/')[0] or 'Domain'}>"
        if near := _nearest(name, names):
            return f"did you mean <{near}>?"
        return f"here may stand {', '.join(f'<{name}>' for name in names)}" if names else "nothing may stand here"

    def attribute_suggestion(self, name: str) -> str:
        names = list(self.attributes.values())
        if near := _nearest(name, names):
            return f"did you mean {near}?"
        if (child := self.child(name)) is not None:
            return f"it is an element: <{child.name}>"
        return f"there may be {', '.join(names)}" if names else "it has none"


def _nearest(name: str, names: list[str]) -> str | None:
    by_lower = {candidate.lower(): candidate for candidate in names}
    # The length is bounded, as the comparison takes time with its square.
    near = difflib.get_close_matches(name.lower()[:100], list(by_lower), n=1)
    return by_lower[near[0]] if near else None


def _everywhere(word: Word) -> list[Word]:
    found = list(word.children.values())
    for child in word.children.values():
        found += _everywhere(child)
    return found


# Indented below what they stand in; attributes on the line of their element; an older name after a bar.
# From the reference of Cyclone DDS's configuration, releases 0.8 to 11.
_OUTLINE = """
Domain @Id
    Id
    General
        AddrsetCosts
            uc
            mc
            ssm
            delivered
            discarded
            redundant_psmx
        AllowMulticast
        DontRoute
        EnableMulticastLoopback
        EntityAutoNaming @seed
        ExternalNetworkAddress
        ExternalNetworkMask
        FragmentSize
        Interfaces
            NetworkInterface @name @address @autodetermine @multicast @allow_multicast @priority @prefer_multicast \
                    @presence_required
                AddrsetCosts
                    uc
                    mc
                    ssm
                    delivered
                    discarded
                    redundant_psmx
            PubSubMessageExchange @type @library @priority @config
        MaxMessageSize
        MaxRexmitMessageSize
        MulticastRecvNetworkInterfaceAddresses
        MulticastTimeToLive
        NetworkInterfaceAddress
        PreferMulticast
        RedundantNetworking
        Transport
        UseIPv6
    Discovery
        AnnounceTypes
        DSGracePeriod
        DefaultMulticastAddress
        DiscoveredLocatorPruneDelay
        EnableTopicDiscoveryEndpoints
        ExternalDomainId
        InitialLocatorPruneDelay
        LeaseDuration
        MaxAutoParticipantIndex
        ParticipantIndex
        Peers @AddLocalhost
            Peer @Address @PruneDelay
            Group
                Peer @Address @PruneDelay
        Ports
            Base
            DomainGain
            ParticipantGain
            MulticastMetaOffset
            UnicastMetaOffset
            MulticastDataOffset
            UnicastDataOffset
        SPDPInterval
        SPDPMulticastAddress
        Tag
    Bounds
        MaxParticipants
        MaxEndpoints
        MaxInstances
        MaxSampleSize
        MaxDefragOctets
        MaxReorderSamples
        ReaderOctets
        UnacknowledgedOctets
    Tracing
        Category|EnableCategory
        Verbosity
        OutputFile
        AppendToFile
        PacketCaptureFile
    Security|DDSSecurity
        Authentication
            Library @path @initFunction @finalizeFunction
            IdentityCA
            IdentityCertificate
            PrivateKey
            Password
            CRL
            TrustedCADirectory
            IncludeOptionalFields
        AccessControl
            Library @path @initFunction @finalizeFunction
            PermissionsCA
            Governance
            Permissions
        Cryptographic
            Library @path @initFunction @finalizeFunction
    Internal|Unsupported
        AccelerateRexmitBlockSize
        AckDelay
        AssumeMulticastCapable
        AutoReschedNackDelay
        BuiltinEndpointSet
        BurstSize
            MaxRexmit
            MaxInitTransmit
            MaxFragsRexmitSample
        ControlTopic
        DDSI2DirectMaxThreads
        DefragReliableMaxSamples
        DefragUnreliableMaxSamples
        DeliveryQueueMaxSamples
        EnableExpensiveChecks
        ExtendedPacketInfo
        FragmentSize
        GenerateKeyhash
        HeartbeatInterval @min @minsched @max
        LateAckMode
        LeaseDuration
        LivelinessMonitoring @Interval @StackTraces
        MaxMessageSize
        MaxParticipants
        MaxQueuedRexmitBytes
        MaxQueuedRexmitMessages
        MaxSampleSize
        MeasureHbToAckLatency
        MinimumSocketReceiveBufferSize
        MinimumSocketSendBufferSize
        MonitorPort
        MultipleReceiveThreads @maxretries
        NackDelay
        PreEmptiveAckDelay
        PrimaryReorderMaxSamples
        PrioritizeRetransmit
        RediscoveryBlacklistDuration @enforce
        RetransmitMerging
        RetransmitMergingPeriod
        RetryOnRejectBestEffort
        ScheduleTimeRounding
        SecondaryReorderMaxSamples
        SocketReceiveBufferSize @min @max
        SocketSendBufferSize @min @max
        SPDPResponseMaxDelay
        SquashParticipants
        SynchronousDeliveryLatencyBound
        SynchronousDeliveryPriorityThreshold
        Test
            XmitLossiness
        UnicastResponseToSPDPMessages
        UseMulticastIfMreqn
        Watermarks
            WhcLow
            WhcHigh
            WhcHighInit
            WhcAdaptive|WhcAdaptative
        WriteBatch
        WriterLingerDuration
    Compatibility
        AllowInvalidExtensibility
        AllowInvalidTryConstruct
        AllowMismatchingTypeId
        AllowRecursiveTypes
        AssumeRtiHasPmdEndpoints
        ExplicitlyPublishQosSetToDefault
        IgnoreTypeInformation
        ManySocketsMode
        ProtocolVersion
        StandardsConformance
    Partitioning
        NetworkPartitions
            NetworkPartition @Name @Address @Interface
        IgnoredPartitions
            IgnoredPartition @DCPSPartitionTopic
        PartitionMappings
            PartitionMapping @NetworkPartition @DCPSPartitionTopic
    SharedMemory
        Enable
        Locator
        LogLevel
        Prefix
        PubHistoryCapacity
        SubHistoryRequest
        SubQueueCapacity
    Sizing
        ReceiveBufferChunkSize
        ReceiveBufferSize
    SSL
        CertificateVerification
        Ciphers
        Enable
        EntropyFile
        KeyPassphrase
        KeystoreFile
        MinimumTLSVersion
        SelfSignedCertificates
        VerifyClient
    TCP
        AlwaysUsePeeraddrForUnicast
        Enable
        NoDelay
        Port
        ReadTimeout
        WriteTimeout
    Threads
        Thread @Name
            Scheduling
                Affinity
                Class
                Priority
            StackSize
"""


def _read_outline(outline: str) -> Word:
    """The tree of the outline.  Paths leave out ``Domain``, as error messages do."""
    root = Word("", "")
    above: list[Word] = [root]
    for line in outline.strip().splitlines():
        names, *attributes = line.split()
        name, *older = names.split("|")
        depth = (len(line) - len(line.lstrip())) // 4
        del above[depth + 1 :]
        path = f"{above[-1].path}/{name}".lstrip("/") if depth else ""
        word = Word(name, path, {text[1:].lower(): text[1:] for text in attributes})
        above[-1].children.update({alias.lower(): word for alias in (name, *older)})
        above.append(word)
    (domain,) = root.children.values()
    return domain


DOMAIN = _read_outline(_OUTLINE)
"""``<Domain>``, and all that may stand in it."""
