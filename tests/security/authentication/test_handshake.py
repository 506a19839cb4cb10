"""Two participants of ours authenticate each other: identities, key agreements, names, and what comes twice."""

from __future__ import annotations

import itertools

import pytest

from ddsi.spi import Refused
from ddsi.structure.errors import PreconditionNotMet
from ddsi.structure.vendor import CYCLONE, FAST_DDS, OPENDDS, OUR_VENDOR_ID, RTI, VendorId
from ddsi_security.authentication.algorithms import DH_MODP_2048_256, ECDH_P256, ECDH_P384
from ddsi_security.authentication.der import read_integer
from ddsi_security.authentication.handshake_tokens import auth_request_token
from ddsi_security.plugins import Pending, RemoteIdentity, ValidationResult
from ddsi_security.tokens import NIL, DataHolder

from .material import (
    Pair,
    Side,
    candidate,
    done,
    foreign_request,
    identity,
    message,
    pair,
    participant_data,
    refusal,
    settle,
)

OPTIONAL = ("hash_c1", "hash_c2", "dh1", "dh2")
AGREEMENTS = {
    "ECDH": (ECDH_P256, False),
    "ECDH-P384": (ECDH_P384, False),
    "DH-raw": (DH_MODP_2048_256, False),
    "DH-DER": (DH_MODP_2048_256, True),
}


def without(token: DataHolder, *names: str) -> DataHolder:
    kept = tuple(item for item in token.binary_properties if item[0] not in names)
    return DataHolder(token.class_id, token.properties, kept)


def replaced(token: DataHolder, name: str, octets: bytes) -> DataHolder:
    properties = tuple((key, octets if key == name else value) for key, value in token.binary_properties)
    return DataHolder(token.class_id, token.properties, properties)


# --- identities and key agreements ----------------------------------------------------------------------------


@pytest.mark.parametrize("replier", ["EC", "RSA", "EC-384"])
@pytest.mark.parametrize("initiator", ["EC", "RSA", "EC-384"])
def test_both_sides_end_with_one_secret_and_the_identity_of_the_other(initiator: str, replier: str) -> None:
    both = pair(initiator, replier)
    finished, ended = both.run()
    assert (finished.result, ended.result) == (ValidationResult.OK_FINAL_MESSAGE, ValidationResult.OK)
    assert ended.message is None
    ours = both.initiator.plugin.get_shared_secret(finished.handle)
    theirs = both.replier.plugin.get_shared_secret(ended.handle)
    assert ours.shared_secret == theirs.shared_secret
    assert (ours.challenge1, ours.challenge2) == (theirs.challenge1, theirs.challenge2)
    assert len(ours.shared_secret) == len(ours.challenge1) == len(ours.challenge2) == 32
    assert ours.challenge1 != ours.challenge2
    assert (ours.is_replier, theirs.is_replier) == (False, True)
    assert both.initiator.plugin.get_subject_name(both.replier_seen) == "CN=bob,O=Peers"
    assert both.replier.plugin.get_subject_name(both.initiator_seen) == "CN=alice,O=Peers"
    credential = both.initiator.plugin.get_authenticated_peer_credential_token(finished.handle)
    assert credential.binary_property("c.id") == identity("bob", replier).pem.encode()
    assert credential.binary_property("c.perm") == b"permissions of 2"
    assert credential.binary_property("c.pdata") == both.replier.data


@pytest.mark.parametrize("agreement", AGREEMENTS)
@pytest.mark.parametrize(("initiator", "replier"), list(itertools.product(["EC", "RSA"], repeat=2)))
def test_whatever_key_agreement_is_proposed_is_answered_in_kind(initiator: str, replier: str, agreement: str) -> None:
    both = pair(initiator, replier)
    proposed, der = AGREEMENTS[agreement]
    waiting = foreign_request(both, proposed, der=der)
    assert waiting.sent is not None
    replied = done(both.reply(waiting.sent))
    finished = done(both.initiator.plugin.process_handshake(message(replied), waiting))
    ended = done(both.replier.plugin.process_handshake(message(finished), replied.handle))
    ours = both.initiator.plugin.get_shared_secret(finished.handle)
    assert ours.shared_secret == both.replier.plugin.get_shared_secret(ended.handle).shared_secret
    dh2 = message(replied).binary_property("dh2") or b""
    assert (read_integer(dh2) is not None) == (agreement == "DH-DER")


def test_the_initiator_always_proposes_ecdh() -> None:
    for kinds in itertools.product(["EC", "RSA", "EC-384"], repeat=2):
        request = message(pair(*kinds).request())
        assert request.binary_property("c.kagree_algo") == b"ECDH+prime256v1-CEUM\0"
        assert len(request.binary_property("dh1") or b"") == 65


def test_each_handshake_has_its_own_ephemeral_key() -> None:
    both = pair()
    requests = [message(both.request()) for _ in range(3)]
    assert len({request.binary_property("dh1") for request in requests}) == 3
    replies = [message(done(both.reply(request))) for request in requests]
    assert len({reply.binary_property("dh2") for reply in replies}) == 3


def test_a_seed_gives_the_same_octets_again() -> None:
    def octets() -> list[DataHolder]:
        both = pair()
        requested = both.request()
        replied = done(both.reply(message(requested)))
        finished = done(both.initiator.plugin.process_handshake(message(replied), requested.handle))
        return [message(requested), message(replied), message(finished)]

    assert octets() == octets()


# --- names of algorithms --------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("vendor", "ending"),
    [
        (CYCLONE, b"\0"),
        (OPENDDS, b"\0"),
        (FAST_DDS, b""),
        (b"\x01\x12", b""),
        (RTI, b"\0"),
        (OUR_VENDOR_ID, b"\0"),
        (None, b"\0"),
    ],
)
def test_the_initiator_ends_names_as_the_peer_s_vendor_wants(vendor: VendorId | None, ending: bytes) -> None:
    both = pair("EC", "EC", **({} if vendor is None else {"replier_vendor": vendor}))
    request = message(both.request())
    assert request.binary_property("c.dsign_algo") == b"ECDSA-SHA256" + ending
    assert request.binary_property("c.kagree_algo") == b"ECDH+prime256v1-CEUM" + ending


@pytest.mark.parametrize("replier", ["EC", "RSA"])
@pytest.mark.parametrize("revised", [False, True])
def test_the_replier_writes_names_as_the_initiator_did(replier: str, revised: bool) -> None:
    both = pair("EC", replier)
    waiting = foreign_request(both, DH_MODP_2048_256, revised=revised)
    assert waiting.sent is not None
    reply = message(done(both.reply(waiting.sent)))
    names = {
        ("EC", False): b"ECDSA-SHA256",
        ("EC", True): b"ECDSA+P256+SHA256",
        ("RSA", False): b"RSASSA-PSS-SHA256",
        ("RSA", True): b"RSASSA-PSS-MGF1SHA256+2048+SHA256",
    }
    assert reply.binary_property("c.dsign_algo") == names[replier, revised]
    agreement = b"DHE+MODP-2048-256" if revised else b"DH+MODP-2048-256"
    assert reply.binary_property("c.kagree_algo") == agreement


@pytest.mark.parametrize(
    "name", [b"ECDH+prime256v1", b"ECDH+prime256v1\0", b"ECDHE-CEUM+P256", b"ECDH+prime256v1-CEUM"]
)
def test_every_spelling_of_ecdh_is_accepted_and_repeated(name: bytes) -> None:
    both = pair()
    request = without(replaced(message(both.request()), "c.kagree_algo", name), "hash_c1")
    assert message(done(both.reply(request))).binary_property("c.kagree_algo") == name


def test_minor_versions_of_the_protocol_are_accepted() -> None:
    both = pair()
    requested = both.request()
    newer = DataHolder("DDS:Auth:PKI-DH:1.2+Req", (), message(requested).binary_properties)
    assert message(done(both.reply(newer))).class_id == "DDS:Auth:PKI-DH:1.0+Reply"


# --- optional properties --------------------------------------------------------------------------------------


def test_optional_properties_are_sent_and_not_required() -> None:
    both = pair()
    requested = both.request()
    assert message(requested).binary_property("hash_c1")
    replied = done(both.reply(without(message(requested), "hash_c1")))
    assert all(message(replied).binary_property(name) for name in OPTIONAL)
    bare_reply = without(message(replied), "hash_c1", "hash_c2", "dh1")
    finished = done(both.initiator.plugin.process_handshake(bare_reply, requested.handle))
    assert all(message(finished).binary_property(name) for name in OPTIONAL)
    bare_final = without(message(finished), *OPTIONAL)
    assert done(both.replier.plugin.process_handshake(bare_final, replied.handle)).result is ValidationResult.OK


def test_without_access_control_there_is_no_permissions_document() -> None:
    both = pair()
    request = without(message(both.request()), "c.perm", "hash_c1")
    replied = done(both.reply(request))
    assert replied.result is ValidationResult.PENDING_HANDSHAKE_MESSAGE


def test_nuls_behind_the_permissions_are_hashed_and_not_handed_on() -> None:
    both = pair()
    document = DataHolder("x", (), (("dds.perm.cert", b"S/MIME\r\n\0\0"),))
    both.replier.plugin.set_permissions_credential_and_token(both.replier.identity, document, NIL)
    finished, _ = both.run()
    credential = both.initiator.plugin.get_authenticated_peer_credential_token(finished.handle)
    assert credential.binary_property("c.perm") == b"S/MIME\r\n"


# --- messages that come twice, late or not at all -------------------------------------------------------------


def test_a_repeated_message_is_answered_as_it_was() -> None:
    both = pair()
    requested = both.request()
    replied = done(both.reply(message(requested)))
    again = both.replier.plugin.process_handshake(message(requested), replied.handle)
    assert again == replied, "and at once, without a job"
    finished = done(both.initiator.plugin.process_handshake(message(replied), requested.handle))
    assert both.initiator.plugin.process_handshake(message(replied), finished.handle) == finished
    ended = done(both.replier.plugin.process_handshake(message(finished), replied.handle))
    assert both.replier.plugin.process_handshake(message(finished), ended.handle) == ended


def test_a_message_that_does_not_fit_the_state_is_refused() -> None:
    both = pair()
    requested = both.request()
    replied = done(both.reply(message(requested)))
    finished = done(both.initiator.plugin.process_handshake(message(replied), requested.handle))
    initiator, replier = both.initiator.plugin, both.replier.plugin
    assert "REQUEST is not what RequestSent waits for" in refusal(
        initiator.process_handshake(message(requested), requested.handle)
    )
    assert "FINAL" in refusal(initiator.process_handshake(message(finished), requested.handle))
    assert "REPLY" in refusal(replier.process_handshake(message(replied), replied.handle))
    assert "begins with a Request" in refusal(both.reply(message(replied)))
    ended = done(replier.process_handshake(message(finished), replied.handle))
    assert "REQUEST" in refusal(replier.process_handshake(message(requested), ended.handle))


def test_messages_of_two_handshakes_do_not_mix() -> None:
    both = pair()
    first, second = both.request(), both.request()
    reply = message(done(both.reply(message(second))))
    assert "is not that of this handshake" in refusal(both.initiator.plugin.process_handshake(reply, first.handle))


def test_a_job_whose_result_is_dropped_leaves_nothing_behind() -> None:
    both = pair()
    requested = both.request()
    pending = both.reply(message(requested))
    assert isinstance(pending, Pending)
    first, second = pending.job(), pending.job()
    assert not isinstance(first, Refused)
    assert not isinstance(second, Refused)
    assert first.message == second.message
    with pytest.raises(PreconditionNotMet):
        both.replier.plugin.get_subject_name(both.initiator_seen)


# --- who begins, and the challenges promised before ------------------------------------------------------------


def test_the_lower_guid_begins() -> None:
    both = pair()
    with pytest.raises(PreconditionNotMet, match="that is the peer"):
        both.replier.plugin.begin_handshake_request(both.replier.identity, both.initiator_seen, b"")
    with pytest.raises(PreconditionNotMet, match="that is ours"):
        both.initiator.plugin.begin_handshake_reply(NIL, both.replier_seen, both.initiator.identity, b"")


def auth_request(side: Side, other: Side) -> tuple[RemoteIdentity, DataHolder]:
    """``side`` meets the other and promises a challenge."""
    token = other.plugin.get_identity_token(other.identity)
    found = side.plugin.validate_remote_identity(NIL, side.identity, token, other.guid)
    assert isinstance(found, RemoteIdentity)
    return found, found.auth_request_token


def test_a_promise_is_kept_and_answered_by_none() -> None:
    """The AuthRequest of either, or of both, or of none, may have arrived when the peer is validated."""
    for of_initiator, of_replier in itertools.product([False, True], repeat=2):
        both = pair()
        initiator, replier = both.initiator, both.replier
        both.replier_seen = initiator.meet(replier)
        promise = auth_request_token(both.replier_seen.our_challenge or b"")
        both.initiator_seen = replier.meet(initiator, promise if of_initiator else NIL)
        assert (both.initiator_seen.our_challenge is None) == of_initiator
        if of_replier and both.initiator_seen.our_challenge is not None:
            both.replier_seen = initiator.meet(replier, auth_request_token(both.initiator_seen.our_challenge))
            assert both.replier_seen.our_challenge is None
        requested = both.request()
        replied = done(both.reply(message(requested)))
        done(initiator.plugin.process_handshake(message(replied), requested.handle))
        for seen, token, name in (
            (both.replier_seen, requested, "challenge1"),
            (both.initiator_seen, replied, "challenge2"),
        ):
            assert message(token).binary_property(name) == seen.our_challenge or seen.our_challenge is None


def test_the_promise_itself() -> None:
    alice, bob = Side(identity("alice"), seed=1), Side(identity("bob"), seed=2)
    _, token = auth_request(alice, bob)
    assert token.class_id == "DDS:Auth:PKI-DH:1.0+AuthReq"
    assert [(name, len(octets)) for name, octets in token.binary_properties] == [("future_challenge", 32)]
    assert auth_request(alice, bob)[1] != token, "who authenticates anew, promises anew"


def test_another_challenge_than_the_promised_one_is_refused() -> None:
    both = pair()
    both.initiator_seen = both.replier.meet(both.initiator, auth_request_token(both.replier_seen.our_challenge or b""))
    forged = replaced(message(both.request()), "challenge1", bytes(32))
    assert "challenge1 is not the one expected" in refusal(both.reply(forged))
    both.initiator_seen = both.replier.meet(both.initiator)
    other = both.initiator.meet(both.replier, auth_request_token(bytes(32)))
    request = message(both.request())
    both.replier_seen = other
    requested = both.request()
    replied = done(both.reply(message(requested)))
    assert "challenge2 is not the one expected" in refusal(
        both.initiator.plugin.process_handshake(message(replied), requested.handle)
    )
    assert request != message(requested)


@pytest.mark.parametrize(
    "token",
    [
        DataHolder("DDS:Auth:PKI-DH:1.0+AuthReq"),
        DataHolder("DDS:Auth:PKI-DH:1.0+AuthReq", (), (("future_challenge", bytes(31)),)),
        DataHolder("DDS:Auth:PKI-DH:1.0+Req", (), (("future_challenge", bytes(32)),)),
        DataHolder("DDS:Auth:PKI-DH:2.0+AuthReq", (), (("future_challenge", bytes(32)),)),
    ],
)
def test_an_auth_request_that_is_none_is_refused(token: DataHolder) -> None:
    alice, bob = Side(identity("alice"), seed=1), Side(identity("bob"), seed=2)
    announced = bob.plugin.get_identity_token(bob.identity)
    assert isinstance(alice.plugin.validate_remote_identity(token, alice.identity, announced, bob.guid), Refused)


@pytest.mark.parametrize(
    ("class_id", "accepted"),
    [
        ("DDS:Auth:PKI-DH:1.0", True),
        ("DDS:Auth:PKI-DH:1.2", True),
        ("DDS:Auth:PKI-DH:2.0", False),
        ("DDS:Auth:PKI-DH:1", False),
        ("DDS:Auth:PSK:1.2", False),
        ("DDS:Auth:PKI-DH:1.0+Req", False),
        ("", False),
    ],
)
def test_which_identity_tokens_are_ours_to_judge(class_id: str, accepted: bool) -> None:
    alice, bob = Side(identity("alice"), seed=1), Side(identity("bob"), seed=2)
    found = alice.plugin.validate_remote_identity(NIL, alice.identity, DataHolder(class_id), bob.guid)
    assert isinstance(found, RemoteIdentity) == accepted


def test_the_identity_token_tells_algorithms_and_no_names() -> None:
    alice = Side(identity("alice", "RSA"))
    token = alice.plugin.get_identity_token(alice.identity)
    assert token == DataHolder("DDS:Auth:PKI-DH:1.0", (("dds.cert.algo", "RSA-2048"), ("dds.ca.algo", "EC-prime256v1")))
    assert alice.plugin.get_identity_status_token(alice.identity) == NIL


# --- whose Guid is it -----------------------------------------------------------------------------------------


def test_a_guid_of_another_participant_in_the_participant_data_is_refused() -> None:
    both = pair()
    both.initiator.data = participant_data(candidate(99))
    assert "c.pdata" in refusal(both.reply(message(both.request())))


def test_a_certificate_does_not_help_whom_it_does_not_name() -> None:
    """mallory has a certificate, and announces the Guid of alice."""
    alice, mallory, bob = (Side(identity(name), seed=seed) for seed, name in enumerate(("alice", "mallory", "bob"), 1))
    both = Pair(alice, bob)
    both.initiator.identity.pem, both.initiator.identity.key = mallory.identity.pem, mallory.identity.key  # type: ignore[misc]
    reason = refusal(both.reply(message(both.request())))
    assert "its Guid does not belong to CN=mallory,O=Peers" in reason


def test_another_certificate_for_the_same_subject_is_refused_once_one_was_believed() -> None:
    both = pair()
    finished, _ = both.run()
    both.initiator.plugin.get_shared_secret(finished.handle)
    renewed = Side(identity("bob", "RSA"), seed=2)
    assert renewed.guid == both.replier.guid
    anew = Pair(both.initiator, renewed)
    requested = anew.request()
    replied = message(done(anew.reply(message(requested))))
    judge = both.initiator.plugin.process_handshake
    assert "another certificate than before" in refusal(judge(replied, requested.handle))
    both.initiator.plugin.return_identity_handle(both.replier_seen)
    assert done(judge(replied, requested.handle)), "it was forgotten, and is another participant now"


def test_a_participant_may_authenticate_anew_beside_what_was_agreed() -> None:
    both = pair()
    finished, _ = both.run()
    secret = both.initiator.plugin.get_shared_secret(finished.handle).shared_secret
    anew = Pair(both.initiator, both.replier)
    assert anew.replier_seen is not both.replier_seen
    again, _ = anew.run()
    assert both.initiator.plugin.get_shared_secret(again.handle).shared_secret != secret
    both.initiator.plugin.return_identity_handle(both.replier_seen)
    assert both.initiator.plugin.get_subject_name(anew.replier_seen) == "CN=bob,O=Peers"


# --- handles --------------------------------------------------------------------------------------------------


def test_secrets_are_wiped_when_handles_are_returned() -> None:
    both = pair()
    requested = both.request()
    replied = done(both.reply(message(requested)))
    finished = done(both.initiator.plugin.process_handshake(message(replied), requested.handle))
    both.replier.plugin.return_handshake_handle(replied.handle)
    assert "returned" in refusal(both.replier.plugin.process_handshake(message(finished), replied.handle))
    both.initiator.plugin.return_handshake_handle(finished.handle)
    with pytest.raises(PreconditionNotMet, match="returned"):
        both.initiator.plugin.get_shared_secret(finished.handle)
    both.initiator.plugin.return_handshake_handle(requested.handle)
    assert refusal(both.initiator.plugin.process_handshake(message(replied), requested.handle))


def test_handles_of_others_and_calls_out_of_turn_are_mistakes_of_the_caller() -> None:
    both = pair()
    requested = both.request()
    initiator, replier = both.initiator, both.replier
    with pytest.raises(PreconditionNotMet, match="not done yet"):
        initiator.plugin.get_shared_secret(requested.handle)
    with pytest.raises(PreconditionNotMet, match="not authenticated"):
        initiator.plugin.get_subject_name(both.replier_seen)
    with pytest.raises(PreconditionNotMet, match="no LocalIdentityHandle"):
        initiator.plugin.begin_handshake_request(both.replier_seen, both.replier_seen, b"")
    with pytest.raises(PreconditionNotMet, match="validated for another local one"):
        initiator.plugin.begin_handshake_request(initiator.identity, both.initiator_seen, b"")
    found = initiator.plugin.validate_remote_identity(
        NIL, initiator.identity, replier.plugin.get_identity_token(replier.identity), initiator.guid
    )
    assert found == Refused("it bears our own Guid")


def test_no_repr_shows_a_secret() -> None:
    both = pair()
    requested = both.request()
    replied = done(both.reply(message(requested)))
    finished = done(both.initiator.plugin.process_handshake(message(replied), requested.handle))
    secret = both.initiator.plugin.get_shared_secret(finished.handle).shared_secret
    shown = " ".join(
        repr(each)
        for each in (
            *(requested, replied, finished, both.initiator.identity, both.replier_seen, settle(replied)),
            *(requested.handle, finished.handle, both.initiator.identity.key),
        )
    )
    assert secret.hex() not in shown
    assert repr(secret) not in shown
    assert "PRIVATE" not in shown
