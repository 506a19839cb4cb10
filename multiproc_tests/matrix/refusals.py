"""Secured pairs that must not come together: one of the two is at fault, and whoever finds out says why.

``good`` and ``faulty`` tell, by implementation, what that side says: of ours every reason, of the others what they have
words for.  In each case the publisher is the good one, and *reversed* the subscriber.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field, replace
from typing import Any

import trio

from ..framework import ExpectationFailed, Process
from ..peers.faulty_keystore import FORBIDDEN_TOPIC, faulty_keystore
from ..peers.options import Options
from ..peers.peer import Ability
from .cases import Case
from .stories import Cast, Story, deliver

__all__ = ["REFUSAL_CASES", "until_said"]

SILENCE = 4.0
"""Seconds without a sample that are enough where nobody says why."""
SECURED = Options(keystore=".", governance="encrypt-all.p7s")
_DIRECTIONS = (("ddsi", "cyclone"), ("cyclone", "ddsi"), ("ddsi", "fastdds"), ("fastdds", "ddsi"))


@dataclass(frozen=True, slots=True, kw_only=True)
class Refusal:
    """What the two have, and what is searched for in all that each prints, its standard error too."""

    name: str
    claim: str
    good: Mapping[str, Any]
    faulty: Mapping[str, Any]
    good_says: Mapping[str, str] = field(default_factory=dict)
    faulty_says: Mapping[str, str] = field(default_factory=dict)
    topic: str = "Square"


REFUSALS = (
    Refusal(
        name="unknown-ca",
        claim="a certificate of an identity CA that the other does not know",
        good={"identity": "bob"},
        faulty={"identity": "alice", "keystore": "stranger"},  # begins, so that it is the other who judges first
        good_says={
            "ddsi": r"REFUSED .*CN=alice,O=Peers was issued by .* none of the identity CAs",
            "cyclone": "Certificate not valid: .*unable to get local issuer certificate",
            "fastdds": "UNAUTHORIZED",
        },
    ),
    Refusal(
        name="revoked",
        claim="a certificate that the identity CA has taken back",
        good={"identity": "alice", "keystore": "revoking"},
        faulty={"identity": "bob"},
        good_says={
            "ddsi": "REFUSED the certificate of CN=bob,O=Peers is revoked by CN=identity_ca,O=Peers",
            "cyclone": "certificate revoked",
            "fastdds": "UNAUTHORIZED",
        },
    ),
    Refusal(
        name="unknown-permissions-ca",
        claim="permissions signed by somebody else than the permissions CA",
        good={"identity": "alice"},
        faulty={"identity": "bob", "keystore": "other-permissions"},
        good_says={
            "ddsi": "REFUSED permissions of 'CN=bob,O=Peers', as received: it is signed by another certificate",
            "cyclone": "Could not get remote participant .* permissions",
            "fastdds": "Error validating remote permissions",
        },
    ),
    Refusal(
        name="expired",
        claim="a certificate that is not valid any more",
        good={"identity": "alice"},
        faulty={"identity": "expired"},
        faulty_says={
            "ddsi": "ERROR .*the certificate of CN=expired,O=Peers expired at",
            "cyclone": "certificate has expired",
            "fastdds": "ERROR participant could not be made",
        },
    ),
    Refusal(
        name="altered-permissions",
        claim="permissions of which a word was changed after they were signed",
        good={"identity": "bob"},
        faulty={"identity": "alice", "keystore": "altered"},
        faulty_says={
            "ddsi": "ERROR .*altered/alice.permissions.p7s: it was altered after it was signed",
            "cyclone": "Error occurred while validating local permissions: .*digest failure",
            "fastdds": "ERROR participant could not be made",
        },
    ),
    Refusal(
        name="forbidden-topic",
        claim="a topic that no rule allows",
        good={"identity": "bob"},
        faulty={"identity": "narrow"},
        topic=FORBIDDEN_TOPIC,
        faulty_says={
            "ddsi": f"ERROR .*no allow rule lets it .* topic '{FORBIDDEN_TOPIC}' of domain 1",
            "cyclone": "ERROR topic: Not Allowed By Security",
            "fastdds": "ERROR (writer|reader) could not be made",
        },
    ),
    Refusal(
        name="forbidden-domain",
        claim="a domain that no rule allows",
        good={"identity": "alice"},
        faulty={"identity": "elsewhere"},
        # Fast DDS looks at the topic rules alone: it is there, and only its peer can refuse it.
        good_says={"ddsi<fastdds": "REFUSED .*no allow rule lets it join domain 1"},
        faulty_says={
            "ddsi": "ERROR .*no allow rule lets it join domain 1",
            "cyclone": "It is not allowed to create participant",
        },
    ),
    Refusal(
        name="other-governance",
        claim="a governance that protects participants otherwise",
        good={"identity": "alice"},
        faulty={"identity": "bob", "governance": "none.p7s"},
        good_says={
            "ddsi": "REFUSED its governance protects participants otherwise",
            "cyclone": "security_attributes mismatch",
        },
        faulty_says={
            "ddsi": "REFUSED its governance protects participants otherwise",
            "cyclone": "security_attributes mismatch",
        },
    ),
    Refusal(
        name="other-topic-governance",
        claim="a governance that protects the topic otherwise",
        good={"identity": "alice", "governance": "metadata.p7s"},
        faulty={"identity": "bob", "governance": "data.p7s"},
        good_says={
            "ddsi": "REFUSED governance protects topic 'Square' otherwise there",
            "cyclone": "security_attributes mismatch",
            "fastdds": "Security manager returns an error",
        },
        faulty_says={
            "ddsi": "REFUSED governance protects topic 'Square' otherwise there",
            "cyclone": "security_attributes mismatch",
            "fastdds": "Security manager returns an error",
        },
    ),
    Refusal(
        name="unauthenticated",
        claim="a participant without any security where everybody must authenticate",
        good={"identity": "alice"},
        faulty={"keystore": None},
        good_says={"ddsi": "REFUSED it announces no identity", "fastdds": "UNAUTHORIZED"},
    ),
    Refusal(
        name="unauthenticated-protected-topic",
        claim="the same where it may join, and the topic is protected",
        good={"identity": "alice", "governance": "unauthenticated.p7s"},
        faulty={"keystore": None},
        good_says={"ddsi": "REFUSED topic 'Square' is protected, and its participant is not authenticated"},
    ),
)


def _refusal_cases() -> Iterator[Case]:
    for number, refusal in enumerate(REFUSALS):
        for is_reversed in (False, True):
            publisher, subscriber = refusal.good, refusal.faulty
            if is_reversed:
                publisher, subscriber = subscriber, publisher
            yield Case(
                name=f"refused-{refusal.name}" + "-reversed" * is_reversed,
                claim=f"refused: {refusal.claim}; "
                + ("the subscriber" if is_reversed else "the publisher")
                + " is good",
                story=_refuse(refusal, is_reversed=is_reversed),
                options=replace(SECURED, topic=refusal.topic, wait_s=20),
                needs=frozenset({Ability.SECURITY}),
                publisher=publisher,
                subscriber=subscriber,
                is_ours=True,
                keystore=faulty_keystore,
                # In turn with each, so that ours is the good and the faulty one.
                quick_pairs=frozenset({_DIRECTIONS[(number % 2) * 2 + is_reversed]}),
            )
    for is_reversed in (False, True):
        sides: list[Mapping[str, Any]] = [{"identity": "alice", "governance": "open.p7s"}, {"keystore": None}]
        yield Case(
            name="admitted-unauthenticated" + "-reversed" * is_reversed,
            claim="admitted: a participant without any security where it may join and nothing protects the topic",
            story=deliver,
            options=SECURED,
            needs=frozenset({Ability.SECURITY}),
            publisher=sides[is_reversed],
            subscriber=sides[not is_reversed],
            keystore=faulty_keystore,
            quick_pairs=frozenset({_DIRECTIONS[is_reversed]}),
        )


def _refuse(refusal: Refusal, *, is_reversed: bool) -> Story:
    """Both are started, and whoever has something to say says it; no sample arrives."""

    async def story(cast: Cast) -> None:
        subscriber = await cast.start_subscriber()
        publisher = await cast.start_publisher()
        good, faulty = (subscriber, publisher) if is_reversed else (publisher, subscriber)
        names = [cast.publisher.name, cast.subscriber.name]
        good_name, faulty_name = reversed(names) if is_reversed else names
        reasons = [
            (good, refusal.good_says.get(f"{good_name}<{faulty_name}", refusal.good_says.get(good_name))),
            (faulty, refusal.faulty_says.get(faulty_name)),
        ]
        due = [(process, reason) for process, reason in reasons if reason is not None]
        for process, reason in due:
            await until_said(process, reason, timeout=cast.patience)
        if not due:
            await trio.sleep(SILENCE)
        if subscriber.matches("SAMPLE .*"):
            raise ExpectationFailed("a sample arrived")

    return story


async def until_said(process: Process, reason: str, *, timeout: float) -> None:
    """In any line, whatever stands before and behind it: the others write to their logs as they like."""
    expression = re.compile(reason)
    with trio.move_on_after(timeout):
        while not any(expression.search(line.text) for line in process.lines if line.stream in ("out", "err")):
            await trio.sleep(0.05)
        return
    raise ExpectationFailed(f"{process.name} did not say {reason!r}")


REFUSAL_CASES = tuple(_refusal_cases())
