"""Keystores for simulated domains: one for each way of protecting, valid when the simulated clock begins."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

from ddsi.config.secure import secure
from ddsi.structure.qos_policies import Properties
from ddsi_security.keystore.documents import GovernanceDraft, Rights
from ddsi_security.keystore.keystore import IdentityTerms, create_keystore
from ddsi_security.keystore.validity import Validity

__all__ = ["GOVERNANCES", "IDENTITIES", "make_identities"]

IDENTITIES = ("alice", "bob", "carol")
_WALL_CLOCK_AT_START_NS = 1_700_000_000 * 10**9

_OA = "ENCRYPT_WITH_ORIGIN_AUTHENTICATION"
GOVERNANCES: Mapping[str, GovernanceDraft] = {
    "encrypt": GovernanceDraft(),
    "encrypt all": GovernanceDraft(rtps="ENCRYPT"),
    "origin": GovernanceDraft(discovery=_OA, liveliness=_OA, rtps="SIGN_WITH_ORIGIN_AUTHENTICATION", metadata=_OA),
    "sign": GovernanceDraft(discovery="SIGN", liveliness="SIGN", metadata="SIGN", data="SIGN"),
    "payload": GovernanceDraft(discovery="NONE", liveliness="NONE", rtps="NONE", metadata="NONE"),
    "submessage": GovernanceDraft(rtps="NONE", data="NONE"),
    "message": GovernanceDraft(discovery="NONE", liveliness="NONE", rtps="ENCRYPT", metadata="NONE", data="NONE"),
    "nothing": GovernanceDraft(discovery="NONE", liveliness="NONE", rtps="NONE", metadata="NONE", data="NONE"),
}


def make_identities(folder: Path, governance: str) -> list[Properties]:
    """The properties of three participants under that governance, each allowed everything."""
    create_keystore(
        folder,
        IDENTITIES,
        terms=IdentityTerms(Validity.of_days(_WALL_CLOCK_AT_START_NS)),
        governance=GOVERNANCES[governance],
        rights=Rights(),
    )
    properties = [secure(folder / "enclaves" / name).properties for name in IDENTITIES]
    return [found for found in properties if found is not None]
