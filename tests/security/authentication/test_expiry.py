"""Certificates that expire while they are in use are told of, ours and those of peers, once each."""

from __future__ import annotations

from ddsi_security.authentication.expiry import ExpiryWatch
from ddsi_security.plugins import Authentication, AuthStatusKind, IdentityHandle

from .material import (
    DAY_S,
    NOW_S,
    SECOND,
    Clock,
    Pair,
    Side,
    authority,
    done,
    ec_key,
    identity,
    issue,
    message,
    properties,
    refusal,
)


class Heard:
    """Implements AuthenticationListener."""

    def __init__(self) -> None:
        self.revoked: list[IdentityHandle] = []
        self.ended_at: list[int] = []

    def on_revoke_identity(self, plugin: Authentication, handle: IdentityHandle, ended_at: int) -> None:
        self.revoked.append(handle)
        self.ended_at.append(ended_at)

    def on_status_changed(self, plugin: Authentication, handle: IdentityHandle, status_kind: AuthStatusKind) -> None:
        raise AssertionError("there is no status that could change")


def side(name: str, *, not_after: int, seed: int, clock: Clock) -> Side:
    return Side(issue(f"CN={name},O=Peers", ec_key(name), authority(), not_after=not_after), seed=seed, clock=clock)


def met(clock: Clock) -> tuple[Pair, Heard]:
    """alice, whose certificate is good for an hour, authenticated bob, whose is good for half of one."""
    alice = side("alice", not_after=NOW_S + 3600, seed=1, clock=clock)
    bob = side("bob", not_after=NOW_S + 1800, seed=2, clock=clock)
    both, heard = Pair(alice, bob), Heard()
    assert both.initiator is alice
    alice.plugin.set_listener(heard)
    finished, _ = both.run()
    alice.plugin.get_shared_secret(finished.handle)
    return both, heard


def test_a_peer_and_then_we_expire() -> None:
    clock = Clock()
    both, heard = met(clock)
    plugin = both.initiator.plugin
    assert plugin.next_deadline() == (NOW_S + 1801) * SECOND
    clock.seconds = NOW_S + 1800.999
    plugin.handle_timeout()
    assert heard.revoked == []
    clock.seconds = NOW_S + 1801
    plugin.handle_timeout()
    plugin.handle_timeout()
    assert heard.revoked == [both.replier_seen]
    assert plugin.next_deadline() == both.initiator.identity.valid_until == (NOW_S + 3601) * SECOND
    clock.seconds = NOW_S + 9999
    plugin.handle_timeout()
    assert heard.revoked == [both.replier_seen, both.initiator.identity]
    assert heard.ended_at == [(NOW_S + 1801) * SECOND, (NOW_S + 3601) * SECOND]
    assert plugin.next_deadline() is None


def test_an_expired_peer_cannot_authenticate_again() -> None:
    clock = Clock()
    both, _ = met(clock)
    clock.seconds = NOW_S + 1801
    request = both.request()
    both.replier.clock = clock
    reply = both.reply(message(request))
    assert "expired" not in str(reply), "alice's certificate is still good"
    answered = done(reply)
    reason = refusal(both.initiator.plugin.process_handshake(message(answered), request.handle))
    assert "the certificate of CN=bob,O=Peers expired at" in reason


def test_who_is_gone_or_was_never_proven_is_not_told_of() -> None:
    clock = Clock()
    both, heard = met(clock)
    stranger = side("carol", not_after=NOW_S + 60, seed=3, clock=clock)
    both.initiator.meet(stranger)
    both.initiator.plugin.return_identity_handle(both.replier_seen)
    assert both.initiator.plugin.next_deadline() == (NOW_S + 3601) * SECOND
    clock.seconds = NOW_S + DAY_S
    both.initiator.plugin.handle_timeout()
    assert heard.revoked == [both.initiator.identity]


def test_the_authority_s_expiry_is_ours_too() -> None:
    ca = issue("CN=ca", ec_key("ca"), not_after=NOW_S + 10)
    alice = Side(identity("alice", "EC", ca), settings=properties(identity("alice", "EC", ca), ca))
    assert alice.plugin.next_deadline() == (NOW_S + 11) * SECOND


def test_watching_is_lazy_and_in_order() -> None:
    watch = ExpiryWatch()
    handles = [IdentityHandle() for _ in range(5)]
    for valid_until, handle in zip((50, 20, 40, 20, 30), handles, strict=True):
        watch.watch(handle, valid_until)
        watch.watch(handle, 1)
    watch.forget(handles[3])
    watch.forget(IdentityHandle())
    assert watch.next() == 20
    assert watch.pop(19) is None
    popped = [watch.pop(45) for _ in range(4)]
    assert popped == [(handles[1], 20), (handles[4], 30), (handles[2], 40), None]
    assert watch.next() == 50
