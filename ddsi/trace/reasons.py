"""Why the engine dropped, lost or refused something: closed lists, so that counters and searches can rely on them.

A reason's value is its name in traces and in ``ddsi ls --stats``; it never changes its meaning, and what no list
holds goes into an event's ``detail``.
"""

from __future__ import annotations

from enum import StrEnum

__all__ = ["DropReason", "LossReason", "RejectReason", "SampleLossReason", "SecurityStep", "TypeStep"]


class DropReason(StrEnum):
    """Why a datagram, a submessage or a discovery announcement was not acted upon.

    Grouped from the outside in: the datagram, who it is from, what it is for, its place in the order, our
    bounds, and security.  An engine may keep one counter per member.
    """

    # The datagram is no RTPS, or broken RTPS.
    NOT_RTPS = "not_rtps"
    """No "RTPS" in front, or under 20 octets: somebody else's traffic on this port."""
    UNSUPPORTED_VERSION = "unsupported_version"
    """The protocol's major version is not 2."""
    MALFORMED_MESSAGE = "malformed_message"
    """A submessage breaks the grammar; what stood before it in the message was processed."""
    MALFORMED_DISCOVERY_DATA = "malformed_discovery_data"
    """The parameter list of an announcement does not decode or lacks what it must hold."""
    MUST_UNDERSTAND = "must_understand"
    """A parameter list holds an unknown parameter with the must-understand bit."""

    # Not for us by its origin.
    OWN_MESSAGE = "own_message"
    """Our own multicast came back."""
    WRONG_DOMAIN = "wrong_domain"
    """The participant announces another domain id."""
    DOMAIN_TAG = "domain_tag"
    """The participant announces another domain tag."""
    IGNORED = "ignored"
    """The application asked to ignore this participant or endpoint."""
    UNKNOWN_PARTICIPANT = "unknown_participant"
    """No participant with this prefix has been discovered (or it was lost)."""
    UNKNOWN_WRITER = "unknown_writer"
    """The participant is known, but this writer of it is not."""
    UNKNOWN_READER = "unknown_reader"
    """An ACKNACK or NACK_FRAG from a reader that is not known."""
    UNKNOWN_ENDPOINT = "unknown_endpoint"
    """It is addressed to an endpoint that we do not have (or no longer)."""
    UNMATCHED = "unmatched"
    """Both endpoints are known, but they are not matched."""
    NOT_FOR_US = "not_for_us"
    """INFO_DST names another participant, or only others hold the keys, or can verify it.  Normal under multicast."""

    # Its place in the order.
    STALE_COUNT = "stale_count"
    """A HEARTBEAT, ACKNACK or fragment submessage whose count is not newer than the last."""
    DUPLICATE = "duplicate"
    """This change, or this fragment, is here already."""
    OUT_OF_ORDER = "out_of_order"
    """Older than what a best-effort reader has already handed over."""
    INVALID_SEQUENCE = "invalid_sequence"
    """Contradicts what is known: an ACKNACK of changes never sent, a HEARTBEAT that goes backward."""

    # Our bounds: each table that strangers can fill has one.
    TABLE_FULL_PARTICIPANTS = "table_full_participants"
    TABLE_FULL_ENDPOINTS = "table_full_endpoints"
    TABLE_FULL_INSTANCES = "table_full_instances"
    TABLE_FULL_FRAGMENTS = "table_full_fragments"
    TABLE_FULL_REORDER = "table_full_reorder"
    READER_FULL = "reader_full"
    """Resource limits; a reliable reader leaves it unacknowledged and gets it again."""
    SAMPLE_TOO_LARGE = "sample_too_large"
    OVERLOADED_MESSAGE = "overloaded_message"
    """One message asks for more work than any honest one: numbers by the thousand, participants by the dozen."""
    RATE_LIMITED = "rate_limited"
    """Answering would amplify: it was answered a moment ago, or nothing more goes to who has not proved himself."""
    QUEUE_FULL = "queue_full"
    """The operating system, or our own queue to it, took no more."""

    # Security.
    NO_KEYS = "no_keys"
    """Protected under a key that has not arrived (yet)."""
    REJECTED_BY_SECURITY = "rejected_by_security"
    """A MAC is wrong, a replay was seen, or a permission is missing; the detail says which."""
    CLEAR_TEXT = "clear_text"
    """It came in clear, but governance demands that it be protected."""

    # Everything else that the specification says to ignore.
    UNSUPPORTED = "unsupported"
    """Well-formed, but of a kind that this implementation does not act upon."""


class LossReason(StrEnum):
    """Why a participant or endpoint is gone, or a match ended."""

    GOODBYE = "goodbye"
    """It said so: dispose or unregister on the discovery topic."""
    LEASE_EXPIRED = "lease_expired"
    """It, or its participant, was not heard for the time that it promised to be.  It may return."""
    PARTICIPANT_LOST = "participant_lost"
    """The endpoint went with its participant."""
    RESTARTED = "restarted"
    """It has begun anew: its writers count from 1 again, or it authenticated once more."""
    CLOSED = "closed"
    """Our own endpoint or participant was closed."""
    QOS_CHANGED = "qos_changed"
    """A changeable policy made the two incompatible (partition, for one)."""
    IGNORED = "ignored"
    EVICTED = "evicted"
    """Its place in a full table was taken by a better-founded one."""
    UNRESPONSIVE = "unresponsive"
    """It never acknowledged within the bound set for it."""
    REJECTED_BY_SECURITY = "rejected_by_security"


class SampleLossReason(StrEnum):
    """Why samples that a writer wrote never reach a reader.  DDS 1.4 §2.2.4.1, SAMPLE_LOST."""

    NOT_AVAILABLE = "not_available"
    """The writer no longer has them: a HEARTBEAT begins after them, or a GAP names them."""
    BEST_EFFORT = "best_effort"
    """Skipped by a best-effort stream."""
    MALFORMED_SAMPLE = "malformed_sample"
    """The payload does not decode as the type."""
    INCOMPLETE = "incomplete"
    """Fragments were given up: too old, or the table was full."""
    WRITER_LOST = "writer_lost"
    """The writer went before they could be repaired, or before there was room for them."""
    INCOMPLETE_SET = "incomplete_set"
    """They came, but not all of their coherent set did, or there was no room for it."""
    REJECTED_BY_SECURITY = "rejected_by_security"


class RejectReason(StrEnum):
    """Which limit refused a sample.  DDS 1.4 §2.2.4.1, SampleRejectedStatusKind."""

    INSTANCES_LIMIT = "instances_limit"
    SAMPLES_LIMIT = "samples_limit"
    SAMPLES_PER_INSTANCE_LIMIT = "samples_per_instance_limit"


class SecurityStep(StrEnum):
    """What security decided about somebody: ``what`` in a SecurityEvent of the engine.  DDS-Security 1.1 §8.8.2."""

    AUTHENTICATING = "authenticating"
    """A participant has said who it is; until this is proved only ParticipantStatelessMessage is exchanged with it."""
    ADMITTED = "admitted"
    """A participant was authenticated, or may take part without."""
    REFUSED = "refused"
    """A participant, or the endpoint named, may not take part; the detail says why."""
    KEYS_AWAITED = "keys_awaited"
    """A match with this endpoint waits for its keys."""
    REVOKED = "revoked"
    """Our own identity or permissions have ended; the participant closes."""


class TypeStep(StrEnum):
    """What became of two endpoints whose types are not plainly the same: ``step`` in TypesCompared.  DDS-XTypes 1.3
    §7.6.3.4.2."""

    AWAITED = "awaited"
    """The match waits: the other's TypeObjects have been asked for."""
    ASSIGNABLE = "assignable"
    """The types differ, and the reader's can be assigned from the writer's."""
    BY_NAME = "by_name"
    """The type names alone were compared; the detail says what was missing."""
    EXTENSIBILITY = "extensibility"
    """One is final and the other appendable, as IDL without annotations is for different vendors; in XCDR1 they are
    written alike, and so they match by name."""
