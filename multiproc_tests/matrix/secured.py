"""The secured cases: the plays of the plain ones under every governance, and what a capture of each must show.

A governance alone is played twice: with the publisher as alice, whose GUID is the lower one and who begins the
handshake, and *reversed*, with the subscriber as alice; and as who begins matters apart from who is there first, the
two are also started in both orders, in turn.
"""

from __future__ import annotations

import itertools
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from ddsi_security.keystore.key_pair import Algorithm

from ..framework import Capture, Weather
from ..peers.catalogue import CYCLONE_C, FAST_DDS, OURS
from ..peers.keystore import GOVERNANCES, shared_keystore
from ..peers.options import Options
from ..peers.peer import Ability
from ..peers.programs.protocol import blob_octets
from .cases import Case
from .evidence import messages_of, shortcomings
from .stories import (
    Cast,
    Story,
    deliver,
    deliver_late,
    deliver_some,
    deliver_to_all,
    deliver_to_newcomer,
    deliver_to_two,
    restart_publisher,
    restart_subscriber,
)

__all__ = ["SECURED_CASES", "SECURED_PEERS"]

SECURED_PEERS = (CYCLONE_C, OURS, FAST_DDS)
"""In the order of the GUIDs that they need when all meet: Fast DDS can begin with us, and not with Cyclone DDS."""

KIBIBYTE = 1 << 10
COLOR = "VERMILION"
"""In every shape of a secured case, so that whoever looks for it in a capture finds it nowhere else."""

SHAPES = Options(keystore=".", topic="SecretSquare", colors=(COLOR,))
STORM = Weather(loss=0.1, delay=0.01, jitter=0.01)

_DIRECTIONS = (("ddsi", "cyclone"), ("cyclone", "ddsi"), ("ddsi", "fastdds"), ("fastdds", "ddsi"))
_FORWARD: Mapping[str, Any] = {"publisher": {"identity": "alice"}, "subscriber": {"identity": "bob"}}
_REVERSED: Mapping[str, Any] = {"publisher": {"identity": "bob"}, "subscriber": {"identity": "alice"}}
_SECURITY = frozenset({Ability.SECURITY})


@dataclass(frozen=True, slots=True)
class Evidence:
    """Judges the capture of a case by its governance."""

    options: Options
    receivers: int = 1

    def __call__(self, captured: Capture) -> list[str]:
        o = self.options
        secret = COLOR.encode() if o.blob_octets is None else blob_octets(64, 0)
        governance = GOVERNANCES[o.governance.removesuffix(".p7s")]
        return shortcomings(messages_of(captured), governance, topic=o.topic, secret=secret, receivers=self.receivers)


def _case(
    name: str,
    claim: str,
    story: Story,
    governance: str,
    *,
    options: Options = SHAPES,
    is_reversed: bool = False,
    algorithm: Algorithm = Algorithm.EC,
    authorities: Algorithm | None = None,
    needs: frozenset[Ability] = frozenset(),
    receivers: int = 1,
    quick: tuple[tuple[str, str], ...] = (),
    weather: Weather | None = None,
    **publisher: Any,
) -> Case:
    options = replace(options, governance=f"{governance}.p7s")
    roles = _REVERSED if is_reversed else _FORWARD
    return Case(
        name=name + "-reversed" * is_reversed,
        claim=claim,
        story=story,
        options=options,
        needs=_SECURITY | needs,
        publisher={**roles["publisher"], **publisher},
        subscriber=roles["subscriber"],
        quick_pairs=frozenset(quick),
        keystore=_keystore_of(algorithm, authorities),
        evidence=Evidence(options, receivers),
        weather=weather,
    )


def _keystore_of(algorithm: Algorithm, authorities: Algorithm | None) -> Callable[[], Path]:
    return lambda: shared_keystore(algorithm, authorities).folder


def _governance_cases() -> Iterator[Case]:
    """Every document, both roles; a quick run takes one direction of each, and all where everything is encrypted."""
    for number, (governance, draft) in enumerate(GOVERNANCES.items()):
        kinds = (draft.discovery, draft.liveliness, draft.rtps, draft.metadata, draft.data)
        claim = f"{' / '.join(map(_brief, kinds))} (discovery / liveliness / rtps / metadata / data)"
        for is_reversed in (False, True):
            is_late = (number + is_reversed) % 2
            directions: tuple[tuple[str, str], ...] = ()
            if governance == "encrypt-all":
                directions = _DIRECTIONS
            elif is_reversed == bool(number & 4):
                directions = (_DIRECTIONS[number % 4],)
            if governance in _QUICK_WITH_OURSELVES and not is_reversed:
                directions += (("ddsi", "ddsi"),)
            story = deliver_to_newcomer if is_late else deliver
            yield _case(governance, claim, story, governance, is_reversed=is_reversed, quick=directions)


_QUICK_WITH_OURSELVES = ("data", "metadata-sign-data", "rtps-sign", "all-origin")
"""What we could get wrong in the same way on both sides, and a capture would show."""


def _brief(kind: str) -> str:
    return kind.replace("_WITH_ORIGIN_AUTHENTICATION", "+OA").replace("NONE", "-")


def _rsa_cases() -> Iterator[Case]:
    for governance, is_reversed in itertools.product(("encrypt-all", "sign-all", "all-origin", "none"), (False, True)):
        quick = _DIRECTIONS[1:3] if governance == "encrypt-all" else ()
        claim = f"governance {governance} with RSA identities"
        yield _case(
            f"rsa-{governance}", claim, deliver, governance,
            algorithm=Algorithm.RSA, is_reversed=is_reversed, quick=quick[is_reversed : is_reversed + 1],
        )  # fmt: skip


def _mixed_key_cases() -> Iterator[Case]:
    """Fast DDS says in its handshakes how its CA signs, and signs as its identity does."""
    kinds = (("RSA", Algorithm.RSA, "EC", Algorithm.EC), ("EC", Algorithm.EC, "RSA", Algorithm.RSA))
    for number, (theirs, authorities, own, algorithm) in enumerate(kinds):
        for is_reversed in (False, True):
            yield _case(
                f"{own.lower()}-issued-by-{theirs.lower()}",
                f"{own} identities that an authority with an {theirs} key issued", deliver, "encrypt-all",
                algorithm=algorithm, authorities=authorities, is_reversed=is_reversed,
                quick=(_DIRECTIONS[2 + (number + is_reversed) % 2],),
            )  # fmt: skip


def _sample_cases() -> Iterator[Case]:
    """What else can happen to samples."""
    large = frozenset({Ability.LARGE})
    blobs = replace(SHAPES, topic="SecretBlob", keyless=True, count=3, interval_ms=100)
    for number, governance in enumerate(("data", "metadata-data", "rtps", "encrypt-all", "all-origin")):
        for kibibytes in (40, KIBIBYTE):
            yield _case(
                f"fragments-{kibibytes}k-{governance}", f"samples of {kibibytes} KiB under {governance}", deliver,
                governance, options=replace(blobs, blob_octets=kibibytes * KIBIBYTE), needs=large, gate=True,
                quick=(_DIRECTIONS[number % 4],) if (number + (kibibytes == 40)) % 2 else (),
            )  # fmt: skip
    for number, governance in enumerate(("data", "metadata-sign-data", "encrypt-all")):
        yield _case(
            f"late-joiner-{governance}", f"a late joiner gets what is kept, under {governance}", deliver_late,
            governance, quick=(_DIRECTIONS[number],), readers=0,
        )  # fmt: skip
    for number, governance in enumerate(("data", "metadata", "encrypt-all")):
        yield _case(
            f"dispose-{governance}", f"a disposed instance is reported with its key, under {governance}", deliver,
            governance, options=replace(SHAPES, dispose=True), quick=(_DIRECTIONS[(number + 1) % 4],),
        )  # fmt: skip


def _meeting_cases() -> Iterator[Case]:
    """Who else is there, who comes back, and what is lost on the way."""
    for is_reversed in (False, True):
        for number, (name, story, claim) in enumerate(
            (
                ("restart-subscriber", restart_subscriber, "a subscriber that died and came back gets what is kept"),
                ("restart-publisher", restart_publisher, "a publisher that died and came back is heard again"),
            )
        ):
            quick = (_DIRECTIONS[2 * is_reversed + number],)
            yield _case(name, claim, story, "encrypt-all", is_reversed=is_reversed, quick=quick)
        yield _case(
            "storm", "all samples arrive though a tenth of all packets is lost both ways", deliver, "encrypt-all",
            options=replace(SHAPES, count=30, wait_s=40), weather=STORM, is_reversed=is_reversed,
            quick=(_DIRECTIONS[2 * is_reversed],),
        )  # fmt: skip
    yield _case(
        "storm-fragments", "the same with samples of 40 KiB", deliver, "metadata-data", weather=STORM, gate=True,
        options=replace(SHAPES, topic="SecretBlob", keyless=True, blob_octets=40 * KIBIBYTE, wait_s=40),
    )  # fmt: skip
    yield _case(
        "best-effort-encrypt-all", "best-effort samples arrive, once and in order", deliver_some, "encrypt-all",
        options=replace(SHAPES, best_effort=True, volatile=True, count=20), gate=True, quick=(_DIRECTIONS[3],),
    )  # fmt: skip
    for number, governance in enumerate(("data", "metadata-origin", "all-origin")):
        yield _case(
            f"two-subscribers-{governance}", f"two subscribers get everything, under {governance}", deliver_to_two,
            governance, receivers=2, readers=2, quick=(_DIRECTIONS[number],),
        )  # fmt: skip
        yield _case(
            f"three-makes-{governance}",
            f"a third participant, of the make that the two are not, gets everything as well, under {governance}",
            _deliver_to_third, governance, receivers=2, readers=2, quick=(_DIRECTIONS[number + 1],) if number else (),
        )  # fmt: skip


async def _deliver_to_third(cast: Cast) -> None:
    """Publisher, subscriber and a third; their names are in an order in which each pair can shake hands."""
    third = next(peer for peer in SECURED_PEERS if peer not in (cast.publisher, cast.subscriber))
    makes = (cast.publisher, cast.subscriber, third)
    order = sorted(range(3), key=lambda part: SECURED_PEERS.index(makes[part]))
    names = [("alice", "bob", "dave")[order.index(part)] for part in range(3)]
    first = replace(
        cast,
        publisher_options=replace(cast.publisher_options, identity=names[0]),
        subscriber_options=replace(cast.subscriber_options, identity=names[1]),
    )
    second = replace(cast, subscriber=third, subscriber_options=replace(cast.subscriber_options, identity=names[2]))
    await deliver_to_all(first, second)


SECURED_CASES = (*_governance_cases(), *_rsa_cases(), *_mixed_key_cases(), *_sample_cases(), *_meeting_cases())
