"""Two participants of ours authenticate each other; repeats are answered alike, and what is altered changes nothing."""

from __future__ import annotations

import pytest

from ddsi_security.plugins import ValidationResult

from .material import identity, pair


@pytest.mark.parametrize("replier", ["EC", "RSA", "EC-384"])
@pytest.mark.parametrize("initiator", ["EC", "RSA", "EC-384"])
def test_both_sides_end_with_one_secret_and_the_identity_of_the_other(initiator: str, replier: str) -> None:
    both = pair(initiator, replier)
    finished, ended = both.run()
    assert (finished.result, ended.result) == (ValidationResult.OK_FINAL_MESSAGE, ValidationResult.OK)
    assert ended.message is None
    ours = both.initiator.plugin.get_shared_secret(finished.handle)
    theirs = both.replier.plugin.get_shared_secret(ended.handle)
    assert (ours.challenge1, ours.challenge2, ours.shared_secret) == (
        theirs.challenge1,
        theirs.challenge2,
        theirs.shared_secret,
    )
    assert len(ours.shared_secret) == 32
    assert ours.challenge1 != ours.challenge2
    assert (ours.is_replier, theirs.is_replier) == (False, True)
    assert both.initiator.plugin.get_subject_name(both.replier_seen) == "CN=bob,O=Peers"
    assert both.replier.plugin.get_subject_name(both.initiator_seen) == "CN=alice,O=Peers"
    credential = both.initiator.plugin.get_authenticated_peer_credential_token(finished.handle)
    assert credential.binary_property("c.id") == identity("bob", replier).pem.encode()
    assert credential.binary_property("c.perm") == b"permissions of 2"
    assert credential.binary_property("c.pdata") == both.replier.data
