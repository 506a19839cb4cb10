"""What the others cannot do in secured cases: failures that are expected and explained, as in ``limits.py``.

Here a limit depends on more than the names of the two: on who begins the handshake, and on what is protected.
"""

from __future__ import annotations

from dataclasses import replace

from .cases import Case

__all__ = ["secured_limit"]

FASTDDS_BEGINS = (
    "Fast DDS begins with a Diffie-Hellman key as plain octets; Cyclone expects an ASN.1 integer and answers nothing"
)
ONLY_DATA = "where only payloads are protected, Cyclone's readers have no keys, and Fast DDS's writers wait for them"
UNAUTHENTICATED = (
    "Fast DDS never matches endpoints of a secured and an unsecured participant, also not among its own, though "
    "allow_unauthenticated_participants is set and nothing protects the topic"
)
HASH_ALONE = "Fast DDS sends the key hash and no key; Cyclone cannot get a key out of an MD5"
KEY_ALONE = "Cyclone sends the key and no key hash; Fast DDS takes the first 16 octets of the payload for the hash"
LOST_FINAL = (
    "Cyclone, which begins, sends its last handshake message once where RTPS messages are protected; if that is lost, "
    "it takes itself for authenticated and answers no repeated reply"
)
UNHEARD_FINAL = (
    "Fast DDS now and then does not hear the last handshake message of Cyclone, which sends it once; then it asks for "
    "it for ever, and its writer matches nobody, also not those with whom it is done"
)


def secured_limit(case: Case, publisher: str, subscriber: str) -> str | None:
    """Why this combination is expected to fail, or None."""
    options, other = replace(case.options, **case.publisher), replace(case.options, **case.subscriber)
    pair = (publisher, subscriber)
    if case.name.startswith("admitted-"):
        return UNAUTHENTICATED if "fastdds" in pair else None
    initiator, replier = pair if options.identity < other.identity else (subscriber, publisher)
    if (initiator, replier) == ("fastdds", "cyclone") and not case.name.startswith("three-makes-"):
        return FASTDDS_BEGINS
    is_with_cyclone = subscriber == "cyclone" or (case.name.startswith("three-makes-") and publisher == "fastdds")
    if publisher == "fastdds" and is_with_cyclone and options.governance in ("data.p7s", "data-sign.p7s"):
        return ONLY_DATA
    if case.name.startswith("three-makes-") and publisher == "fastdds":
        return UNHEARD_FINAL
    if options.dispose and pair == ("fastdds", "cyclone"):
        return HASH_ALONE
    if options.dispose and pair == ("cyclone", "fastdds"):
        return KEY_ALONE
    if case.weather is not None and initiator == "cyclone":
        return LOST_FINAL
    return None
