"""The participant Guid that is bound to a certificate's subject.  DDS-Security 1.1 §9.3.3, table 52.

The first bit is 1, the next 47 are the first of SHA-256 over the subject, the next 48 come from the candidate Guid::

     0  1                47 48               95 96    127
    +--+-------------------+-------------------+---------+
    |1 | hash of subject   | hash of candidate | EntityId|
    +--+-------------------+-------------------+---------+

So nobody can take the Guid of another without a certificate for the same subject.  The prefix does not begin with the
vendor id any more: the vendor stands in the RTPS header alone.
"""

from __future__ import annotations

from hashlib import sha256

from ddsi.structure.guid import Guid

__all__ = ["adjusted_guid", "subject_octets"]

_HASH_OCTETS = 6


def adjusted_guid(subject: bytes, candidate: Guid) -> Guid:
    """``subject`` is the DER of the certificate's subject Name, with its tag and length."""
    # Cyclone DDS hashes only the 12 octets of the prefix; nobody can check that part, so it makes no difference.
    return Guid(subject_octets(subject) + sha256(candidate).digest()[:_HASH_OCTETS] + candidate.entity_id)


def subject_octets(subject: bytes) -> bytes:
    """The first six octets of every Guid that belongs to this subject."""
    bits = int.from_bytes(sha256(subject).digest()[:_HASH_OCTETS], "big")
    return (1 << 8 * _HASH_OCTETS - 1 | bits >> 1).to_bytes(_HASH_OCTETS, "big")
