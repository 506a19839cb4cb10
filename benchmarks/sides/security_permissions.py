"""Access control: signed permissions read, and endpoints checked by them, in one process.

``bare`` is what no implementation gets around.  Of reading: one signature verified and the XML parsed.  Of checking:
the topic compared with each expression up to the one that fits.
"""

from __future__ import annotations

import datetime
import os
import time
from collections.abc import Callable
from fnmatch import fnmatchcase
from typing import cast

from cryptography import x509
from cryptography.hazmat.primitives import hashes
from cryptography.hazmat.primitives.asymmetric import ec
from cryptography.hazmat.primitives.serialization import Encoding
from lxml import etree  # pyright: ignore[reportAttributeAccessIssue]

from benchmarks.sides.protocol import play
from ddsi.structure.discovered import DiscoveredParticipantData, DiscoveredWriterData
from ddsi.structure.guid import Guid
from ddsi.structure.qos import EndpointQos
from ddsi.structure.qos_policies import Partition
from ddsi_security.access_control import PermissionsAccessControl
from ddsi_security.access_control.smime import sign_document
from ddsi_security.authentication_plugin import Authentication
from ddsi_security.handles import IdentityHandle, Pending, PermissionsHandle
from ddsi_security.tokens import DataHolder

_SUBJECT = "CN=robot"
_EXPRESSIONS = [f"Topic{number}*" for number in range(19)] + ["Square"]
_RULE = """<allow_rule><domains><id_range><min>0</min><max>230</max></id_range></domains><publish><topics>
<topic>{}</topic></topics><partitions><partition>*</partition></partitions></publish></allow_rule>"""
_PERMISSIONS = f"""<dds><permissions><grant name="robot"><subject_name>{_SUBJECT}</subject_name>
<validity><not_before>2000-01-01T00:00:00</not_before><not_after>2100-01-01T00:00:00</not_after></validity>
{"".join(map(_RULE.format, _EXPRESSIONS))}
<default>DENY</default></grant></permissions></dds>"""
_GOVERNANCE = """<dds><domain_access_rules><domain_rule><domains><id>0</id></domains>
<allow_unauthenticated_participants>false</allow_unauthenticated_participants>
<enable_join_access_control>true</enable_join_access_control>
<discovery_protection_kind>ENCRYPT</discovery_protection_kind>
<liveliness_protection_kind>ENCRYPT</liveliness_protection_kind>
<rtps_protection_kind>ENCRYPT</rtps_protection_kind>
<topic_access_rules><topic_rule><topic_expression>*</topic_expression>
<enable_discovery_protection>true</enable_discovery_protection>
<enable_liveliness_protection>true</enable_liveliness_protection>
<enable_read_access_control>true</enable_read_access_control>
<enable_write_access_control>true</enable_write_access_control>
<metadata_protection_kind>ENCRYPT</metadata_protection_kind>
<data_protection_kind>ENCRYPT</data_protection_kind>
</topic_rule></topic_access_rules></domain_rule></domain_access_rules></dds>"""


class _OneSubject:
    """As much of an authentication plugin as access control asks."""

    def get_subject_name(self, handle: IdentityHandle) -> str:
        return _SUBJECT


class _Participant:
    """Ours, and the permissions that each peer sends it, which are the same."""

    def __init__(self) -> None:
        key = ec.generate_private_key(ec.SECP256R1())
        name, now = x509.Name.from_rfc4514_string("CN=permissions_ca"), datetime.datetime.now(datetime.UTC)
        builder = x509.CertificateBuilder().subject_name(name).issuer_name(name).public_key(key.public_key())
        builder = builder.serial_number(x509.random_serial_number()).not_valid_before(now - datetime.timedelta(days=1))
        authority = builder.not_valid_after(now + datetime.timedelta(days=1)).sign(key, hashes.SHA256())
        document = sign_document(_PERMISSIONS.encode(), authority, key)
        properties = {
            "dds.sec.access.permissions_ca": f"data:,{authority.public_bytes(Encoding.PEM).decode()}",
            "dds.sec.access.governance": f"data:,{sign_document(_GOVERNANCE.encode(), authority, key).decode()}",
            "dds.sec.access.permissions": f"data:,{document.decode()}",
        }
        self._authentication = cast("Authentication", _OneSubject())
        self._identity, self._peer = IdentityHandle(), IdentityHandle()
        self._credential = DataHolder("DDS:Auth:PKI-DH:1.0", (), (("c.perm", document),))
        self.plugin = PermissionsAccessControl(properties, entropy=os.urandom, wall_clock=time.time_ns)
        self._local = self.plugin.validate_local_permissions(self._authentication, self._identity, 0, properties)
        self._token = self.plugin.get_permissions_token(self._local)

    def read(self) -> PermissionsHandle:
        pending = self.plugin.validate_remote_permissions(
            self._authentication, self._identity, self._peer, self._token, self._credential
        )
        assert isinstance(pending, Pending)
        handle = pending.job()
        assert isinstance(handle, PermissionsHandle), handle
        return handle


def read(bare: bool, count: int) -> dict[str, float]:
    if not bare:
        return _rate(_Participant().read, count)
    key, content = ec.generate_private_key(ec.SECP256R1()), _PERMISSIONS.encode()
    public, ecdsa = key.public_key(), ec.ECDSA(hashes.SHA256())
    signature = key.sign(content, ecdsa)

    def verify_and_parse() -> None:
        public.verify(signature, content, ecdsa)
        etree.fromstring(content)

    return _rate(verify_and_parse, count)


def check(bare: bool, count: int) -> dict[str, float]:
    if bare:
        return _rate(lambda: any(fnmatchcase("Square", expression) for expression in _EXPRESSIONS), count)
    participant = _Participant()
    remote, guid = participant.read(), Guid(bytes(16))
    assert participant.plugin.check_remote_participant(remote, 0, DiscoveredParticipantData(guid=guid)) is None
    qos = EndpointQos(partition=Partition("A"))
    writer = DiscoveredWriterData(guid=guid, topic_name="Square", type_name="ShapeType", qos=qos)
    assert participant.plugin.check_remote_datawriter(remote, 0, writer) is None
    return _rate(lambda: participant.plugin.check_remote_datawriter(remote, 0, writer), count)


def _rate(operation: Callable[[], object], count: int) -> dict[str, float]:
    operation()
    start = time.perf_counter()
    for _ in range(count):
        operation()
    return {"per_second": count / (time.perf_counter() - start)}


if __name__ == "__main__":
    play({"read": read, "check": check})
