"""What ``ddsi sim handshake`` says of each kind of message: its clause, what it is for, and how its loss is repaired.

Clauses are of DDS-Security 1.1 unless RTPS stands before them.
"""

from __future__ import annotations

from dataclasses import dataclass

__all__ = ["KINDS", "Kind"]


@dataclass(frozen=True, slots=True)
class Kind:
    """``repair``: who notices that it is lost, how, and by which rule."""

    title: str
    clause: str
    purpose: str
    repair: str


_ON_STATELESS = "The topic is best effort (§7.4.3), so whoever waits says again what it said last (§8.8.2): "
_ON_VOLATILE = (
    "The topic is reliable (§7.4.4). The writer's HEARTBEAT, under the key that the two share, tells what there is; "
    "the reader's ACKNACK what is missing; and that is sent again (RTPS 2.5 §8.4.9.2, §8.4.12)."
)
_ON_RELIABLE = (
    "The topic is reliable. HEARTBEAT tells what there is, ACKNACK what is missing, and that is sent again "
    "(RTPS 2.5 §8.4.9.2, §8.4.12), protected anew, as every message is (§8.5.1.9.2)."
)

KINDS = {
    "announcement": Kind(
        "SPDP announcement",
        "§7.4.1.4",
        "who I say I am: digests of my identity and permissions, and how I protect messages; anybody can read it",
        "Announcements are repeated, and a newcomer is answered at once (RTPS 2.5 §8.5.3).",
    ),
    "auth-request": Kind(
        "AuthRequest",
        "§8.3.2.11.3",
        "whose Guid is the higher asks the other to begin, and is bound to the challenge that it will use",
        "Nothing has to wait for it: the other begins by itself, a moment after the announcement (§8.3.2.11.3). It is "
        "repeated only as long as no request comes.",
    ),
    "request": Kind(
        "HandshakeRequest",
        "§8.3.2.11.4, §9.3.2.5.1",
        "my certificate, my permissions, half of a Diffie-Hellman agreement, and a challenge; nothing is signed yet",
        _ON_STATELESS + "by its timer, the one that began sends the same request.",
    ),
    "reply": Kind(
        "HandshakeReply",
        "§8.3.2.11.5, §9.3.2.5.2",
        "the same of the other side, and its signature over both challenges and both halves",
        _ON_STATELESS + "the reply, or the request, whichever timer is first. A request that comes again is answered "
        "by the same reply.",
    ),
    "final": Kind(
        "HandshakeFinal",
        "§8.3.2.11.6, §9.3.2.5.3",
        "the signature of the one that began; both now know each other, and a secret that nobody else knows",
        _ON_STATELESS + "nothing answers a final, so it is repeated until the peer shows that it has the secret, and "
        "whenever the reply comes again.",
    ),
    "participant-tokens": Kind(
        "key of a participant",
        "§8.5.1.8.1, §8.8.9",
        "the key of whole messages; encrypted with one that both derive from their secret",
        _ON_VOLATILE,
    ),
    "writer-tokens": Kind(
        "keys of a writer",
        "§8.5.1.8.3, §8.8.9",
        "of its submessages, and of its payloads if they are encrypted; one message for each reader that it matches",
        _ON_VOLATILE,
    ),
    "reader-tokens": Kind(
        "key of a reader",
        "§8.5.1.8.5, §8.8.9",
        "of its ACKNACKs; one message for each writer that it matches",
        _ON_VOLATILE,
    ),
    "discovery": Kind(
        "discovery",
        "§7.4.1.6, §7.4.5",
        "participants again, and endpoints; on secure topics where governance wants it",
        _ON_RELIABLE,
    ),
    "data": Kind(
        "DATA",
        "§8.5.1.9.1, §8.5.1.9.2, §8.5.1.9.4",
        "a sample: payload, submessage and message are protected in this order, each as governance wants it",
        _ON_RELIABLE,
    ),
}
"""By the name that ``--drop`` takes."""
