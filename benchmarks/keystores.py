"""Keystores: made on the spot, one for each way of protecting, for all domains; gone when the run ends."""

from __future__ import annotations

import atexit
import shutil
import tempfile
import time
from functools import cache
from pathlib import Path

from ddsi_security.keystore.documents import GovernanceDraft, Rights
from ddsi_security.keystore.domain_ranges import CYCLONE_HIGHEST_DOMAIN, DomainRanges
from ddsi_security.keystore.keystore import IdentityTerms, create_keystore
from ddsi_security.keystore.validity import Validity

__all__ = ["enclaves"]

# Protected layers, in the governance's words: payload, submessage, message.
_KINDS = {"data": "ENCRYPT", "metadata": "ENCRYPT", "rtps": "SIGN"}
_ALL_DOMAINS = DomainRanges(((0, CYCLONE_HIGHEST_DOMAIN),))


@cache
def enclaves(layers: tuple[str, ...], *, discovery: str = "NONE") -> tuple[str, str]:
    """The folders of two identities, in a domain of which these layers are protected and no other."""
    root = Path(tempfile.mkdtemp(prefix="benchmark-keystore-"))
    atexit.register(shutil.rmtree, root, ignore_errors=True)
    data, metadata, rtps = (_KINDS[name] if name in layers else "NONE" for name in _KINDS)
    governance = GovernanceDraft(
        domains=_ALL_DOMAINS, discovery=discovery, liveliness=discovery, rtps=rtps, metadata=metadata, data=data
    )
    alice, bob = create_keystore(
        root,
        ("alice", "bob"),
        terms=IdentityTerms(Validity.of_days(time.time_ns(), 1)),
        governance=governance,
        rights=Rights(domains=_ALL_DOMAINS),
    )
    return str(alice), str(bob)
