"""Tokens, attributes and pending work: values that hold secrets do not show them."""

from __future__ import annotations

import pytest

from ddsi_security.attributes import EndpointSecurityAttributes, ParticipantSecurityAttributes
from ddsi_security.plugins import Pending
from ddsi_security.tokens import NIL, DataHolder

TOKEN = DataHolder(
    "DDS:Crypto:AES_GCM_GMAC",
    (("dds.cert.algo", "EC-prime256v1"), ("dds.cert.algo", "RSA-2048")),
    (("dds.cryp.keymat", b"\xaa" * 88),),
)


def test_properties_are_found_by_name_and_the_first_counts() -> None:
    assert TOKEN.property("dds.cert.algo") == "EC-prime256v1"
    assert TOKEN.binary_property("dds.cryp.keymat") == b"\xaa" * 88
    assert TOKEN.property("dds.cryp.keymat") is None
    assert TOKEN.binary_property("dds.cert.algo") is None


def test_a_token_shows_names_but_no_octets() -> None:
    assert repr(TOKEN) == "<DataHolder DDS:Crypto:AES_GCM_GMAC: dds.cert.algo, dds.cert.algo, dds.cryp.keymat>"
    assert repr(NIL) == "<DataHolder nil>"


def test_nil_is_the_empty_token() -> None:
    assert DataHolder() == NIL
    assert TOKEN != NIL


def test_pending_work_does_not_show_what_it_works_on() -> None:
    secret = b"a key"
    assert repr(Pending(lambda: secret)) == "Pending()"


@pytest.mark.parametrize(
    ("attributes", "mask"),
    [
        (ParticipantSecurityAttributes(), 0x80000000),
        (ParticipantSecurityAttributes(is_rtps_protected=True), 0x80000001),
        (ParticipantSecurityAttributes(is_discovery_protected=True), 0x80000002),
        (ParticipantSecurityAttributes(is_liveliness_protected=True), 0x80000004),
        # local only
        (ParticipantSecurityAttributes(allow_unauthenticated_participants=True, is_access_protected=True), 0x80000000),
        (EndpointSecurityAttributes(), 0x80000000),
        (EndpointSecurityAttributes(is_read_protected=True), 0x80000001),
        (EndpointSecurityAttributes(is_write_protected=True), 0x80000002),
        (EndpointSecurityAttributes(is_discovery_protected=True), 0x80000004),
        (EndpointSecurityAttributes(is_submessage_protected=True), 0x80000008),
        (EndpointSecurityAttributes(is_payload_protected=True), 0x80000010),
        (EndpointSecurityAttributes(is_key_protected=True), 0x80000020),
        (EndpointSecurityAttributes(is_liveliness_protected=True), 0x80000040),
        # As Cyclone announces a topic protected in every way (seen on the wire).
        (
            EndpointSecurityAttributes(
                is_read_protected=True,
                is_write_protected=True,
                is_discovery_protected=True,
                is_submessage_protected=True,
                is_payload_protected=True,
                is_key_protected=True,
                is_liveliness_protected=True,
            ),
            0x8000007F,
        ),
    ],
)
def test_masks(attributes: ParticipantSecurityAttributes | EndpointSecurityAttributes, mask: int) -> None:
    """DDS-Security 1.1 §8.4.2.5, §8.4.2.8."""
    assert attributes.mask == mask
