"""What an enemy can send: every change of every message is refused, changes nothing, and raises nothing."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import replace

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from ddsi_security.authentication.algorithms import ECDH_P256
from ddsi_security.authentication.certificate import Certificate
from ddsi_security.authentication.handshake_tokens import AgreedValues, Credentials, reply_token, required
from ddsi_security.authentication.key_agreement import _G, _P, _Q, EphemeralKey
from ddsi_security.authentication.not_trusted import NotTrusted
from ddsi_security.authentication.participant_data import ParticipantData
from ddsi_security.plugins import HandshakeStep, RemoteIdentity
from ddsi_security.tokens import NIL, DataHolder

from .material import Pair, done, identity, message, pair, participant_data, refusal, settle

FOREIGN = {"c.id": identity("carol").pem.encode(), "c.dsign_algo": b"RSASSA-PSS-SHA256"}
OPTIONAL = {"+Req": {"hash_c1", "c.perm"}, "+Reply": {"hash_c1", "hash_c2", "dh1"}, "+Final": {"hash_c1", "hash_c2"}}


def mutations(token: DataHolder) -> Iterator[tuple[str, DataHolder]]:
    """Each property missing, empty, shorter, longer, with a bit turned over at several places, or another's."""
    kind = token.class_id[token.class_id.index("+") :]
    for suffix in ("", "+", "+Req2", "+AuthReq", *({"+Req", "+Reply", "+Final"} - {kind})):
        yield f"class {suffix}", DataHolder(f"DDS:Auth:PKI-DH:1.0{suffix}", (), token.binary_properties)
    for version in ("DDS:Auth:PKI-DH:2.0", "DDS:Auth:PKI-DH:", "dds:auth:pki-dh:1.0", "DDS:Auth:PSK:1.2"):
        yield f"class {version}", DataHolder(version + kind, (), token.binary_properties)
    for index, (name, octets) in enumerate(token.binary_properties):
        for what, changed in _changes(name, octets):
            properties = list(token.binary_properties)
            if changed is not None:
                properties[index] = (name, changed)
            elif name in OPTIONAL[kind] | ({"dh1", "dh2"} if kind == "+Final" else set()):
                continue
            else:
                del properties[index]
            yield f"{name} {what}", DataHolder(token.class_id, (), tuple(properties))


def _changes(name: str, octets: bytes) -> Iterator[tuple[str, bytes | None]]:
    yield "missing", None
    yield "empty", b""
    yield "shorter", octets[:-1]
    yield "longer", octets + b"\x01"
    yield "twice", octets + octets
    if name in FOREIGN:
        yield "foreign", FOREIGN[name]
    for at in range(0, len(octets), max(len(octets) // 8, 1)):
        yield f"bit of {at}", octets[:at] + bytes([octets[at] ^ 0x10]) + octets[at + 1 :]


def without_hashes(token: DataHolder) -> DataHolder:
    """So that what is behind the hashes has to notice."""
    kept = tuple(item for item in token.binary_properties if item[0] not in ("hash_c1", "hash_c2"))
    return DataHolder(token.class_id, (), kept)


@pytest.mark.parametrize("kinds", [("EC", "EC"), ("RSA", "EC")])
def test_every_change_of_a_reply_or_final_is_refused_and_changes_nothing(kinds: tuple[str, str]) -> None:
    both = pair(*kinds)
    requested = both.request()
    replied = done(both.reply(message(requested)))
    for token in (message(replied), without_hashes(message(replied))):
        for what, changed in mutations(token):
            assert refusal(both.initiator.plugin.process_handshake(changed, requested.handle)), what
    finished = done(both.initiator.plugin.process_handshake(message(replied), requested.handle))
    for token in (message(finished), without_hashes(message(finished))):
        for what, changed in mutations(token):
            assert refusal(both.replier.plugin.process_handshake(changed, replied.handle)), what
    done(both.replier.plugin.process_handshake(message(finished), replied.handle))


def test_every_change_of_a_request_that_its_hash_covers_is_refused() -> None:
    """Challenge and key are not covered: a Request proves nothing, and the initiator notices in the Reply."""
    both = pair()
    requested = both.request()
    unnoticed = []
    for what, changed in mutations(message(requested)):
        step = settle(both.reply(changed))
        if isinstance(step, HandshakeStep):
            unnoticed.append(what)
            assert refusal(both.initiator.plugin.process_handshake(message(step), requested.handle)), what
    assert unnoticed
    assert {what.split()[0] for what in unnoticed} == {"challenge1"}
    assert all("bit of" in what for what in unnoticed)


@pytest.mark.parametrize("name", [b"ECDSA-SHA512", b"RSASSA-PKCS1-V1_5", b"", b"\xff"])
def test_a_signature_algorithm_that_nobody_knows_is_refused(name: bytes) -> None:
    both = pair()
    properties = tuple(
        (key, name if key == "c.dsign_algo" else octets)
        for key, octets in without_hashes(message(both.request())).binary_properties
    )
    reason = refusal(both.reply(DataHolder("DDS:Auth:PKI-DH:1.0+Req", (), properties)))
    assert "not known; its certificate's key is EC P-256" in reason


@pytest.mark.parametrize(
    ("kind", "name"), [("EC", b"RSASSA-PSS-SHA256"), ("EC", b"ECDSA+P384+SHA384"), ("RSA", b"ECDSA-SHA256\0")]
)
def test_the_certificate_s_key_and_not_what_is_said_of_it_tells_how_it_signs(kind: str, name: bytes) -> None:
    """Fast DDS says how its CA signs.  Nobody gains by it: the signature must be by the certificate's key."""
    both = pair("EC", kind)
    requested = both.request()
    request = message(requested)
    other = replace(Credentials.of(message(done(both.reply(request)))), c_dsign_algo=name)
    values = AgreedValues(
        hash_c1=required(request, "hash_c1"),
        challenge1=required(request, "challenge1"),
        dh1=required(request, "dh1"),
        hash_c2=other.hash(),
        challenge2=bytes(32),
        dh2=ON_CURVE,
    )
    content = values.reply_content()
    stolen = reply_token(other, values, both.initiator.identity.key.sign(content))
    assert refusal(both.initiator.plugin.process_handshake(stolen, requested.handle))
    genuine = reply_token(other, values, both.replier.identity.key.sign(content))
    assert isinstance(settle(both.initiator.plugin.process_handshake(genuine, requested.handle)), HandshakeStep)


def test_a_replier_cannot_choose_another_key_agreement() -> None:
    """Not even one who signs what he says."""
    both = pair()
    requested = both.request()
    request = message(requested)
    theirs = Credentials.of(message(done(both.reply(request))))
    other = replace(theirs, c_kagree_algo=b"ECDHE-CEUM+P384")
    values = AgreedValues(
        hash_c1=required(request, "hash_c1"),
        challenge1=required(request, "challenge1"),
        dh1=required(request, "dh1"),
        hash_c2=other.hash(),
        challenge2=bytes(32),
        dh2=ON_CURVE,
    )
    for credentials, accepted in ((theirs, True), (other, False)):
        said = replace(values, hash_c2=credentials.hash())
        reply = reply_token(credentials, said, both.replier.identity.key.sign(said.reply_content()))
        step = settle(both.initiator.plugin.process_handshake(reply, requested.handle))
        assert isinstance(step, HandshakeStep) == accepted


# --- public keys that are none --------------------------------------------------------------------------------


ON_CURVE = EphemeralKey(ECDH_P256, 5).public


def _modp(number: int) -> bytes:
    return number.to_bytes(256, "big")


@pytest.mark.parametrize(
    ("agreement", "dh1"),
    [
        (b"ECDH+prime256v1-CEUM", bytes(65)),
        (b"ECDH+prime256v1-CEUM", b"\x04" + bytes(64)),  # not on the curve
        (b"ECDH+prime256v1-CEUM", b"\x00"),  # infinity
        (b"ECDH+prime256v1-CEUM", b"\x06" + ON_CURVE[1:]),  # the hybrid form
        (b"ECDH+prime256v1-CEUM", bytes([2 + ON_CURVE[-1] % 2]) + ON_CURVE[1:33]),  # the compressed form
        (b"ECDH+prime256v1-CEUM", b"\x04" + b"\xff" * 64),  # above the field's size
        (b"ECDH+prime256v1-CEUM", b"\x04" + bytes(96)),  # of another curve
        (b"ECDHE-CEUM+P384", b"\x04" + bytes(96)),
        (b"DH+MODP-2048-256", b""),
        (b"DH+MODP-2048-256", _modp(0)),
        (b"DH+MODP-2048-256", _modp(1)),
        (b"DH+MODP-2048-256", _modp(_P - 1)),  # of order 2
        (b"DH+MODP-2048-256", _modp(_P)),
        (b"DH+MODP-2048-256", _modp(pow(3, _Q, _P))),  # of the other, smooth part of the group
        (b"DH+MODP-2048-256", _modp(2)),
        (b"DH+MODP-2048-256", b"\x02\x01\x01"),  # DER of 1
        (b"DH+MODP-2048-256", b"\x02\x01\xff"),  # DER of -1
        (b"DH+MODP-2048-256", b"\x02\x84\xff\xff\xff\xff"),
        (b"DH+MODP-2048-256", b"\x01" * 10_000),
        (b"DHX", _modp(_G)),
    ],
)
def test_public_keys_that_give_ours_away_are_refused(agreement: bytes, dh1: bytes) -> None:
    both = pair()
    replaced = {"c.kagree_algo": agreement, "dh1": dh1}
    properties = tuple(
        (name, replaced.get(name, octets))
        for name, octets in message(both.request()).binary_properties
        if name != "hash_c1"
    )
    reason = refusal(both.reply(DataHolder("DDS:Auth:PKI-DH:1.0+Req", (), properties)))
    assert "public key" in reason or "not supported" in reason


def test_the_generator_itself_is_a_public_key() -> None:
    """The table above would prove nothing if none were accepted."""
    both = pair()
    replaced = {"c.kagree_algo": b"DH+MODP-2048-256", "dh1": _modp(_G)}
    properties = tuple(
        (name, replaced.get(name, octets))
        for name, octets in message(both.request()).binary_properties
        if name != "hash_c1"
    )
    done(both.reply(DataHolder("DDS:Auth:PKI-DH:1.0+Req", (), properties)))


# --- participant data -----------------------------------------------------------------------------------------

GUID = pair().initiator.guid
DATA = participant_data(GUID)


@pytest.mark.parametrize(
    "octets",
    [
        DATA,
        b"\x00\x02\x00\x00" + DATA,
        b"\x00\x03\x00\x00" + b"\x50\x00\x10\x00" + GUID + b"\x01\x00\x00\x00",
    ],
)
def test_the_guid_is_found_with_and_without_an_encapsulation_header(octets: bytes) -> None:
    assert ParticipantData.read(octets).guid == GUID


@pytest.mark.parametrize(
    "octets",
    [
        b"",
        b"\x00\x01\x00\x00",
        DATA[:-4],
        DATA[:10],
        b"\x00\x50\xff\xff" + GUID + b"\x00\x01\x00\x00",
        b"\x00\x50\x00\x0c" + GUID[:12] + b"\x00\x01\x00\x00",
        b"\x50\x00\x10\x00" + GUID + b"\x01\x00\x00\x00",
        b"\x80\x01\x00\x00" * 2000 + DATA,
        b"\x10\x01\x00\x04\xff\xff\xff\xff" + DATA,
    ],
)
def test_participant_data_that_does_not_tell_a_guid_is_refused(octets: bytes) -> None:
    with pytest.raises(NotTrusted):
        ParticipantData.read(octets)


def test_the_announced_identity_token_is_the_one_that_is_vouched_for() -> None:
    both = pair()
    token = b"\x10\x01\x00\x14\x00\x00\x00\x06other\0\0\0" + bytes(8)
    both.initiator.data = token[:2] + (len(token) - 4).to_bytes(2, "big") + token[4:] + both.initiator.data
    assert "identity token in its participant data" in refusal(both.reply(message(both.request())))


# --- anything at all ------------------------------------------------------------------------------------------

OCTETS = st.binary(max_size=200)
NAMES = st.sampled_from(
    [
        *("c.id", "c.perm", "c.pdata", "c.dsign_algo", "c.kagree_algo", "hash_c1", "hash_c2"),
        *("dh1", "dh2", "challenge1", "challenge2", "signature", "x"),
    ]
)
CLASS_IDS = st.one_of(
    st.sampled_from([f"DDS:Auth:PKI-DH:1.0{suffix}" for suffix in ("", "+Req", "+Reply", "+Final", "+AuthReq")]),
    st.text(max_size=30),
)
TOKENS = st.builds(
    DataHolder,
    CLASS_IDS,
    st.lists(st.tuples(st.text(max_size=5), st.text(max_size=5)), max_size=2).map(tuple),
    st.lists(st.tuples(NAMES, OCTETS), max_size=13).map(tuple),
)


class Stage:
    """One waiting side for each message, made once: what is refused changes nothing, so it serves for all."""

    def __init__(self) -> None:
        self.both: Pair = pair()
        self.requested = self.both.request()
        self.replied = done(self.both.reply(message(self.requested)))
        finished = done(self.both.initiator.plugin.process_handshake(message(self.replied), self.requested.handle))
        self.tokens = [message(self.requested), message(self.replied), message(finished)]

    def consumers(self) -> list[Callable[[DataHolder], object]]:
        initiator, replier = self.both.initiator.plugin, self.both.replier.plugin
        return [
            self.both.reply,
            lambda token: initiator.process_handshake(token, self.requested.handle),
            lambda token: replier.process_handshake(token, self.replied.handle),
        ]


STAGE = Stage()


@given(token=TOKENS)
def test_any_token_is_refused_by_every_consumer(token: DataHolder) -> None:
    for consume in STAGE.consumers():
        result = consume(token)
        assert refusal(result)  # type: ignore[arg-type]
    local = STAGE.both.initiator.identity
    found = STAGE.both.initiator.plugin.validate_remote_identity(token, local, token, GUID)
    assert not isinstance(found, RemoteIdentity) or token == NIL


@settings(max_examples=60)
@given(data=st.data())
def test_real_tokens_with_some_octets_replaced_are_refused_or_prove_nothing(data: st.DataObject) -> None:
    """As above, but deep inside: real messages, of which one property has changed octets."""
    which = data.draw(st.integers(0, 2))
    token = STAGE.tokens[which]
    index = data.draw(st.integers(0, len(token.binary_properties) - 1))
    name, octets = token.binary_properties[index]
    at = data.draw(st.integers(0, max(len(octets) - 1, 0)))
    run = data.draw(st.binary(min_size=1, max_size=8))
    changed = octets[:at] + run + octets[at + len(run) :]
    properties = [*token.binary_properties]
    properties[index] = (name, changed)
    kept = tuple(item for item in properties if item[0] not in ("hash_c1", "hash_c2") or item[0] == name)
    result = STAGE.consumers()[which](DataHolder(token.class_id, (), kept))
    step = settle(result)
    if isinstance(step, HandshakeStep) and changed != octets:
        # Text around the PEM block, and a Request, which is not signed: the initiator notices either.
        assert which == 0
        assert refusal(STAGE.both.initiator.plugin.process_handshake(message(step), STAGE.requested.handle))


@given(octets=st.binary(max_size=300))
def test_any_octets_as_a_certificate_are_refused(octets: bytes) -> None:
    armoured = b"-----BEGIN CERTIFICATE-----\n" + octets + b"\n-----END CERTIFICATE-----\n"
    for read, given_octets in (
        (Certificate.from_pem, octets),
        (Certificate.from_pem, armoured),
        (Certificate.from_der, octets),
    ):
        with pytest.raises(NotTrusted):
            read(given_octets)


@settings(max_examples=300)
@given(data=st.data())
def test_damaged_certificates_are_refused_or_do_not_verify(data: st.DataObject) -> None:
    der = STAGE.both.initiator.identity.certificate.der
    at = data.draw(st.integers(0, len(der) - 1))
    octet = data.draw(st.integers(0, 255))
    damaged = der[:at] + bytes([octet]) + der[at + 1 :]
    now = STAGE.both.initiator.clock()
    if damaged == der:
        return
    with pytest.raises(NotTrusted):
        STAGE.both.initiator.identity.anchors.verify(Certificate.from_der(damaged), now)
