"""Which keys and signatures of certificates vendors take beyond those that the standard names, and which they do not.

The table at the end of ``docs/keystore.md`` says it.  The keystores here differ from the usual one in the certificates
of the identity CA, of alice and of bob, and in nothing else.
"""

from __future__ import annotations

from collections.abc import Callable
from datetime import UTC, datetime, timedelta
from functools import partial
from pathlib import Path
from typing import Any

import pytest
from cryptography import x509
from cryptography.hazmat.primitives import hashes
from cryptography.hazmat.primitives.asymmetric import ec, rsa

from ddsi_security.keystore.certificate import certificate_pem
from ddsi_security.keystore.key_pair import PrivateKey, private_key_pem

from .framework import async_test, namespace, scenario
from .matrix.stories import Cast, deliver
from .peers.catalogue import CYCLONE_C, FAST_DDS, OURS
from .peers.keystore import PeerKeystore
from .peers.options import Options
from .peers.peer import Peer

pytestmark = pytest.mark.peers

Digest = hashes.SHA256 | hashes.SHA384 | hashes.SHA512
Make = Callable[[], PrivateKey]
P256: Make = partial(ec.generate_private_key, ec.SECP256R1())
P384: Make = partial(ec.generate_private_key, ec.SECP384R1())
RSA_3072: Make = partial(rsa.generate_private_key, 65537, 3072)


def keystore(
    folder: Path,
    *,
    ca: Make = P256,
    identity: Make = P256,
    ca_digest: Digest | None = None,
    alice_digest: Digest | None = None,
    bob_digest: Digest | None = None,
) -> Path:
    """The keys are of these kinds, and the certificates signed with SHA-256, or other digests."""
    made = PeerKeystore.create(folder)
    ca_key = ca()
    made.add("identity_ca.pem", _certificate("identity_ca", ca_key, ca_key, ca_digest))
    for name, digest in (("alice", alice_digest), ("bob", bob_digest)):
        key = identity()
        made.add(f"{name}.pem", _certificate(name, key, ca_key, digest))
        made.add(f"{name}.key", private_key_pem(key))
    return folder


def _certificate(name: str, key: PrivateKey, issuer_key: PrivateKey, digest: Digest | None) -> bytes:
    today = datetime.now(UTC)
    subject, issuer = (x509.Name.from_rfc4514_string(f"CN={cn},O=Peers") for cn in (name, "identity_ca"))
    builder = (
        x509.CertificateBuilder()
        .subject_name(subject)
        .issuer_name(issuer)
        .public_key(key.public_key())
        .serial_number(x509.random_serial_number())
        .not_valid_before(today - timedelta(days=1))
        .not_valid_after(today + timedelta(days=1))
        .add_extension(x509.BasicConstraints(ca=key is issuer_key, path_length=None), critical=True)
    )
    return certificate_pem(builder.sign(issuer_key, digest or hashes.SHA256()))


async def play(folder: Path, publisher: Peer, subscriber: Peer) -> None:
    """The publisher is alice, who begins the handshake."""
    for peer in (publisher, subscriber):
        peer.locate()
    alice, bob = (
        Options(keystore=str(folder), identity=name, governance="encrypt-all.p7s") for name in ("alice", "bob")
    )
    with namespace() as host:
        async with scenario("algorithms", deadline=60) as stage:
            await deliver(Cast(stage, host, host, publisher, subscriber, alice, bob))


@pytest.mark.parametrize("begins", [OURS, FAST_DDS], ids=str)
@async_test
async def test_fast_dds_takes_long_rsa_keys_and_so_do_we(tmp_path: Path, begins: Peer) -> None:
    folder = keystore(tmp_path, ca=RSA_3072, identity=RSA_3072)
    await play(folder, begins, OURS if begins is FAST_DDS else FAST_DDS)


@pytest.mark.parametrize("begins", [OURS, CYCLONE_C], ids=str)
@async_test
async def test_cyclone_dds_takes_other_digests_and_so_do_we(tmp_path: Path, begins: Peer) -> None:
    folder = keystore(tmp_path, ca_digest=hashes.SHA512(), alice_digest=hashes.SHA384(), bob_digest=hashes.SHA512())
    await play(folder, begins, OURS if begins is CYCLONE_C else CYCLONE_C)


@async_test
async def test_fast_dds_takes_another_digest_of_a_peer(tmp_path: Path) -> None:
    await play(keystore(tmp_path, bob_digest=hashes.SHA384()), FAST_DDS, OURS)


@pytest.mark.parametrize(
    ("peer", "what"),
    [
        (FAST_DDS, {"ca_digest": hashes.SHA384()}),
        (FAST_DDS, {"alice_digest": hashes.SHA384()}),
        (CYCLONE_C, {"ca": P384}),
        (CYCLONE_C, {"ca": RSA_3072}),
        (CYCLONE_C, {"identity": P384}),
        (CYCLONE_C, {"identity": RSA_3072}),
    ],
)
@async_test
async def test_what_a_vendor_does_not_start_with(tmp_path: Path, peer: Peer, what: dict[str, Any]) -> None:
    peer.locate()
    options = Options(keystore=str(keystore(tmp_path, **what)), governance="encrypt-all.p7s")
    with namespace() as host:
        async with scenario("no participant", deadline=30) as stage:
            process = await peer.start(stage, "sub", options, host=host)
            await process.expect("ERROR participant.*", timeout=20)
            await process.expect_exit(2)
