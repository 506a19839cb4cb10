"""Values that were computed by others, independently of this code: formulas of DDS-Security 1.1 §9.3.2 and §9.3.3."""

from __future__ import annotations

from hashlib import sha256

from cryptography.hazmat.primitives.asymmetric import ec

from ddsi.structure.guid import Guid
from ddsi_security.authentication.adjusted_guid import adjusted_guid
from ddsi_security.authentication.algorithms import DH_MODP_2048_256, ECDH_P256
from ddsi_security.authentication.handshake_tokens import AgreedValues, Credentials
from ddsi_security.authentication.key_agreement import EphemeralKey
from ddsi_security.authentication.signatures import verify
from ddsi_security.tokens import serialize_binary_properties

from .material import name_of

SUBJECT = bytes.fromhex(
    "3033310b300906035504061302555331143012060355040a0c0b4578616d706c65204f7267310e300c06035504030c05616c696365"
)
CANDIDATE = Guid(bytes.fromhex("0110aabb0102030405060708000001c1"))
ADJUSTED = Guid(bytes.fromhex("e13ceaad96794d274c45dd50000001c1"))

DH1 = bytes.fromhex(
    "048291c136a67a2f6e035640aac72e5a22d3ac06cc963d084735557e34811d39391b8e98fb181c9121b684d442120db4"
    "cf591249a9cfc3a6c750d41c3056645894"
)
DH2 = bytes.fromhex(
    "046eb59e9a6d36325deefc043575605161a039ae8b412f0557e9acc0012c94dbc268390d9f8483d4efb67444ac85c822"
    "4e5537b722f92eafd42db91ff9ed87cd50"
)
HASH_C1 = "2e471f86df42d4a5fa7af538b09caf52597d41bae52a8062274fad67d4d7329e"
HASH_C1_WITHOUT_NULS = "7b8486f31d9c87344f3caa1af83b3c7f3bbaa911b7ce67e5550a3221fead5e65"
HASH_C2 = "1347d65932ebd2636cc218edd46f51ec8d19ed2a85028d1be0934b7967b288ee"
SERIALIZED_C1 = (
    "0000000500000005632e69640000000000000006434552542d41000000000007632e7065726d0000000000075045524d"
    "2d41000000000008632e7064617461000000001800500010e13ceaad96794d274c45dd50000001c1000100000000000d"
    "632e647369676e5f616c676f000000000000000d45434453412d534841323536000000000000000e632e6b6167726565"
    "5f616c676f00000000000015454344482b7072696d6532353676312d4345554d00"
)
REPLY_CONTENT = (
    "0000000600000008686173685f633200000000201347d65932ebd2636cc218edd46f51ec8d19ed2a85028d1be0934b79"
    "67b288ee0000000b6368616c6c656e676532000000000020a0a1a2a3a4a5a6a7a8a9aaabacadaeafb0b1b2b3b4b5b6b7"
    "b8b9babbbcbdbebf000000046468320000000041046eb59e9a6d36325deefc043575605161a039ae8b412f0557e9acc0"
    "012c94dbc268390d9f8483d4efb67444ac85c8224e5537b722f92eafd42db91ff9ed87cd500000000000000b6368616c"
    "6c656e676531000000000020101112131415161718191a1b1c1d1e1f202122232425262728292a2b2c2d2e2f00000004"
    "6468310000000041048291c136a67a2f6e035640aac72e5a22d3ac06cc963d084735557e34811d39391b8e98fb181c91"
    "21b684d442120db4cf591249a9cfc3a6c750d41c305664589400000000000008686173685f633100000000202e471f86"
    "df42d4a5fa7af538b09caf52597d41bae52a8062274fad67d4d7329e"
)
SIGNER = bytes.fromhex(
    "04ff264f898aa369adf2568bd1ca968ec88be9f9c9f125bc537727aa4886bc219dfadc0d19cd847555c6d3c9636e1e8a"
    "d524666f454e1b149cc6bc11277a990572"
)
SIGNATURE = bytes.fromhex(
    "304502206696b141d07d413d2fc4cec725be85d278b49eeb3765a50112dcd5aee6195208022100de46dd8c16104bae52"
    "ff9fbc7600cbff837f16f25ab8da2b023e8300bfb90c5c"
)
VALUES = AgreedValues(
    hash_c1=bytes.fromhex(HASH_C1),
    challenge1=bytes(range(0x10, 0x30)),
    dh1=DH1,
    hash_c2=bytes.fromhex(HASH_C2),
    challenge2=bytes(range(0xA0, 0xC0)),
    dh2=DH2,
)


def number(text: str) -> int:
    return int.from_bytes(sha256(text.encode()).digest(), "big")


def credentials(owner: str, nul: str = "\0") -> Credentials:
    return Credentials(
        c_id=f"CERT-{owner}".encode(),
        c_perm=f"PERM-{owner}{nul}".encode(),
        c_pdata=bytes.fromhex("00500010") + ADJUSTED + bytes.fromhex("00010000"),
        c_dsign_algo=f"ECDSA-SHA256{nul}".encode(),
        c_kagree_algo=f"ECDH+prime256v1-CEUM{nul}".encode(),
    )


def test_the_adjusted_guid_covers_all_sixteen_octets_of_the_candidate() -> None:
    assert adjusted_guid(SUBJECT, CANDIDATE) == ADJUSTED
    assert name_of("CN=alice,O=Example Org,C=US").public_bytes() == SUBJECT


def test_the_hashes_of_the_credentials() -> None:
    assert serialize_binary_properties(credentials("A").properties).hex() == SERIALIZED_C1
    assert credentials("A").hash().hex() == HASH_C1
    assert credentials("A", nul="").hash().hex() == HASH_C1_WITHOUT_NULS
    assert credentials("B").hash().hex() == HASH_C2


def test_ecdh_gives_the_shared_secret_on_both_sides() -> None:
    first = EphemeralKey(ECDH_P256, number("dds-security vector dh1"))
    second = EphemeralKey(ECDH_P256, number("dds-security vector dh2"))
    assert (first.public, second.public) == (DH1, DH2)
    secret = "f6342f8635732536269436c25efb499153b16dff238561bd686562449b4c4282"
    assert first.shared_secret(DH2).hex() == second.shared_secret(DH1).hex() == secret


def test_modp_gives_the_shared_secret_on_both_sides() -> None:
    order = 0x8CF83642A709A097B447997640129DA299B1A47D1EB3750BA308B0FE64F5FBD3
    first = EphemeralKey(DH_MODP_2048_256, number("dds-security vector modp x") % (order - 2) + 1)
    second = EphemeralKey(DH_MODP_2048_256, number("dds-security vector modp y") % (order - 2) + 1)
    publics = [sha256(key.public).hexdigest() for key in (first, second)]
    assert publics == [
        "66c9c2e0b56e110435f01dd7d17108015ceb8942e093079653267937c8241bbd",
        "535d2c195ac696d83b3eeaff0f60fdd7cdae95d8aa132af8214047b6ec320944",
    ]
    secret = "8a3368ccbf8d421c91399cb27271f5b15defef3eebd4eaef6b5a3a3ac642fb92"
    assert first.shared_secret(second.public).hex() == second.shared_secret(first.public).hex() == secret


def test_what_the_signatures_cover() -> None:
    assert VALUES.reply_content().hex() == REPLY_CONTENT
    assert len(VALUES.final_content()) == 364
    digest = "75effc9c01a1b7c31dbabc3acfb95105c321a9de5ef40e87ac4b56c86af8c2ce"
    assert sha256(VALUES.final_content()).hexdigest() == digest


def test_a_signature_of_somebody_else_s_code_is_right() -> None:
    verify(ec.EllipticCurvePublicKey.from_encoded_point(ec.SECP256R1(), SIGNER), SIGNATURE, VALUES.reply_content())
