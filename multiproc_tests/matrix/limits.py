"""What implementations of others cannot do, with each other or with us: failures that are expected and explained.

A run that fails in such a way is reported as a known limit; one that passes is reported as passed, so that an entry
that is out of date does no harm.  Nothing of ours belongs here but for what the other side alone is to blame for.
"""

from __future__ import annotations

from dataclasses import dataclass

from .cases import Case
from .secured_limits import secured_limit

__all__ = ["known_limit"]

CYCLONES = frozenset({"cyclone", "cyclone11"})
FASTDDS = frozenset({"fastdds"})
DUST = frozenset({"dust"})
OURS = frozenset({"ddsi"})
FOREIGN = CYCLONES | FASTDDS | DUST


@dataclass(frozen=True, slots=True)
class _Limit:
    cases: frozenset[str]
    publishers: frozenset[str]
    subscribers: frozenset[str]
    reason: str


_LIMITS = (
    _Limit(
        frozenset({"keyed-dispose", "keyed-unregister"}),
        FASTDDS,
        CYCLONES,
        "Fast DDS sends the key hash and no key; Cyclone cannot get a key out of an MD5",
    ),
    _Limit(
        frozenset({"short-key-dispose", "fragments-keyed"}),
        FASTDDS,
        frozenset({"cyclone11"}),
        "Fast DDS sends the key hash and no key; Cyclone 11 takes every hash for an MD5",
    ),
    _Limit(
        frozenset({"keyed-dispose", "keyed-unregister", "short-key-dispose", "fragments-keyed"}),
        CYCLONES,
        FASTDDS,
        "Cyclone sends the key and no key hash; Fast DDS takes the first 16 octets of the payload for the hash",
    ),
    _Limit(
        frozenset({"goodbye"}),
        CYCLONES,
        FASTDDS | DUST,
        "Cyclone sends its last words without a key hash, and without it they are not understood",
    ),
    _Limit(
        frozenset({"appendable-xcdr2-dispose"}),
        frozenset({"cyclone11", "ddsi"}),
        frozenset({"cyclone"}),
        "Cyclone 0.10 reads the key of an appendable type without its delimiter header",
    ),
    _Limit(
        frozenset({"appendable-xcdr2-dispose"}),
        frozenset({"cyclone"}),
        frozenset({"cyclone11"}),
        "Cyclone 0.10 writes the key of an appendable type without its delimiter header",
    ),
    _Limit(
        frozenset({"fragments", "fragments-late"}),
        FOREIGN | OURS,
        DUST,
        'Dust DDS fails ("index out of bounds") when more than 256 fragments of a sample are missing, and does not '
        "recover from the loss of larger ones",
    ),
    _Limit(
        frozenset({"fragments-late"}),
        DUST,
        FOREIGN | OURS,
        "Dust DDS does not send again what went out in fragments",
    ),
    _Limit(
        frozenset({"goodbye"}),
        OURS,
        DUST,
        "Dust DDS now and then misses the goodbye of a participant that it has known for a moment only (seen twice in "
        "some dozen runs, cause not found; the lease ends it)",
    ),
    _Limit(frozenset({"burst"}), DUST, DUST, "Dust DDS does not repair all that a full socket buffer loses"),
)


def known_limit(case: Case, publisher: str, subscriber: str) -> str | None:
    """Why this combination is expected to fail, or None."""
    if case.keystore is not None:
        return secured_limit(case, publisher, subscriber)
    for limit in _LIMITS:
        if case.name in limit.cases and publisher in limit.publishers and subscriber in limit.subscribers:
            return limit.reason
    return None
