"""Documents for the tests, written as plainly as people write them, and authorities to sign them."""

from __future__ import annotations

from collections.abc import Sequence
from datetime import UTC, datetime
from functools import cache

from cryptography import x509
from cryptography.hazmat.primitives import hashes
from cryptography.hazmat.primitives.asymmetric import ec, rsa
from cryptography.x509.oid import NameOID

from ddsi_security.access_control.permissions import Grant, Permissions
from ddsi_security.access_control.validity import parse_instant

__all__ = ["NOW", "PrivateKey", "authority", "certificate", "governance_xml", "grant", "new_key", "permissions_xml"]

PrivateKey = rsa.RSAPrivateKey | ec.EllipticCurvePrivateKey
NOW = parse_instant("2026-06-01T12:00:00Z")


def authority(kind: str = "ec") -> tuple[x509.Certificate, PrivateKey]:
    """A self-signed certificate and its key, the same in all tests of a run; ``kind`` as for new_key."""
    return _authority(kind)


@cache
def _authority(kind: str) -> tuple[x509.Certificate, PrivateKey]:
    key = new_key(kind)
    return certificate("permissions_ca", key), key


def new_key(kind: str) -> PrivateKey:
    """``kind``: ec (P-256), ec384, ec224, rsa (2048 bits), or rsa1024."""
    if kind.startswith("rsa"):
        return rsa.generate_private_key(public_exponent=65537, key_size=int(kind[3:] or 2048))
    curves = {"ec": ec.SECP256R1(), "ec384": ec.SECP384R1(), "ec224": ec.SECP224R1()}
    return ec.generate_private_key(curves[kind])


def certificate(
    name: str,
    key: PrivateKey,
    issuer: tuple[x509.Certificate, PrivateKey] | None = None,
    *,
    serial_number: int | None = None,
) -> x509.Certificate:
    subject = x509.Name(
        [x509.NameAttribute(NameOID.ORGANIZATION_NAME, "Tests"), x509.NameAttribute(NameOID.COMMON_NAME, name)]
    )
    builder = x509.CertificateBuilder().subject_name(subject).public_key(key.public_key())
    builder = builder.issuer_name(issuer[0].subject if issuer else subject)
    builder = builder.serial_number(serial_number or x509.random_serial_number())
    builder = builder.not_valid_before(datetime(2020, 1, 1, tzinfo=UTC))
    builder = builder.not_valid_after(datetime(2040, 1, 1, tzinfo=UTC))
    builder = builder.add_extension(x509.SubjectKeyIdentifier.from_public_key(key.public_key()), critical=False)
    return builder.sign(issuer[1] if issuer else key, hashes.SHA256())


_KIND_DEFAULTS = {
    "discovery": "ENCRYPT",
    "liveliness": "ENCRYPT",
    "rtps": "NONE",
    "metadata": "SIGN",
    "data": "ENCRYPT",
}


def governance_xml(
    *,
    domains: str = "<id_range><min>0</min><max>230</max></id_range>",
    unauthenticated: str = "false",
    join: str = "true",
    topics: Sequence[str] = ("*",),
    read: str = "true",
    write: str = "true",
    more: str = "",
    **kinds: str,
) -> bytes:
    """One domain_rule; a topic_rule for each of ``topics``.  ``more``: elements that follow in the domain_rule."""
    kind = _KIND_DEFAULTS | kinds
    topic_rules = "".join(
        f"""
        <topic_rule>
          <topic_expression>{topic}</topic_expression>
          <enable_discovery_protection>true</enable_discovery_protection>
          <enable_liveliness_protection>true</enable_liveliness_protection>
          <enable_read_access_control>{read}</enable_read_access_control>
          <enable_write_access_control>{write}</enable_write_access_control>
          <metadata_protection_kind>{kind["metadata"]}</metadata_protection_kind>
          <data_protection_kind>{kind["data"]}</data_protection_kind>
        </topic_rule>"""
        for topic in topics
    )
    return f"""<?xml version="1.0" encoding="UTF-8"?>
<dds xmlns:xsi="http://www.w3.org/2001/XMLSchema-instance" xsi:noNamespaceSchemaLocation="governance.xsd">
  <domain_access_rules>
    <domain_rule>
      <domains>{domains}</domains>
      <allow_unauthenticated_participants>{unauthenticated}</allow_unauthenticated_participants>
      <enable_join_access_control>{join}</enable_join_access_control>
      <discovery_protection_kind>{kind["discovery"]}</discovery_protection_kind>
      <liveliness_protection_kind>{kind["liveliness"]}</liveliness_protection_kind>
      <rtps_protection_kind>{kind["rtps"]}</rtps_protection_kind>{more}
      <topic_access_rules>{topic_rules}
      </topic_access_rules>
    </domain_rule>
  </domain_access_rules>
</dds>
""".encode()


_ALL = "<domains><id_range><min>0</min><max>230</max></id_range></domains>"


def permissions_xml(
    rules: str = f"<allow_rule>{_ALL}<publish><topics><topic>*</topic></topics></publish></allow_rule>",
    *,
    subject: str = "CN=alice,O=Tests",
    name: str = "alice",
    begin: str = "2020-01-01T00:00:00",
    end: str = "2037-12-31T00:00:00",
    default: str = "DENY",
    more: str = "",
) -> bytes:
    """One grant.  In ``rules``, ``@ALL`` stands for the domains 0 to 230.  ``more``: grants that follow."""
    return f"""<?xml version="1.0" encoding="UTF-8"?>
<dds xmlns:xsi="http://www.w3.org/2001/XMLSchema-instance">
  <permissions>
    <grant name="{name}">
      <subject_name>{subject}</subject_name>
      <validity>
        <not_before>{begin}</not_before>
        <not_after>{end}</not_after>
      </validity>
      {rules.replace("@ALL", _ALL)}
      <default>{default}</default>
    </grant>{more}
  </permissions>
</dds>
""".encode()


def grant(rules: str, *, default: str = "DENY") -> Grant:
    return Permissions.parse(permissions_xml(rules, default=default), name="alice.p7s").grants[0]
