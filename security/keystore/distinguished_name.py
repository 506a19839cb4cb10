"""Names of subjects: from what people type to X.509, and to the text that grants bear.  RFC 4514, RFC 2253.

Comparing names is access control's business; this module only reads and writes them.
"""

from __future__ import annotations

import re
from typing import Final

from cryptography import x509
from cryptography.x509.oid import NameOID

from ddsi.structure.errors import BadParameter

__all__ = ["common_name", "parse_name", "rfc2253_text"]

# What OpenSSL prints, and RFC 4514 does not name: others compare these texts.
_OPENSSL_NAMES: Final = {
    NameOID.EMAIL_ADDRESS: "emailAddress",
    NameOID.SERIAL_NUMBER: "serialNumber",
    NameOID.SURNAME: "SN",
    NameOID.GIVEN_NAME: "GN",
    NameOID.TITLE: "title",
    NameOID.STREET_ADDRESS: "street",
}
_OIDS: Final = {
    **{name: oid for oid, name in _OPENSSL_NAMES.items()},
    "E": NameOID.EMAIL_ADDRESS,
    "S": NameOID.STATE_OR_PROVINCE_NAME,
}
_SLASHED_PART: Final = re.compile(r"/(?=[A-Za-z0-9.]+=)")
"""Where a part begins.  A slash without a type and "=" after it belongs to a value, as in ``/CN=/robot/arm``."""
_RFC4514_SPECIAL: Final = re.compile(r'([,+"\\<>;=# ])')


def parse_name(text: str) -> x509.Name:
    """``/O=Example/CN=alice``, or ``CN=alice,O=Example`` (RFC 4514: the most specific first).  Raises BadParameter."""
    try:
        name = x509.Name.from_rfc4514_string(_from_slashes(text), _OIDS)
    except (ValueError, KeyError) as error:
        detail = f" ({error.args[0]})" if error.args and error.args[0] else ""
        raise BadParameter(
            f"{text!r} is not the name of a subject{detail}: write /O=Example/CN=alice, or CN=alice,O=Example"
        ) from error
    if not list(name):
        raise BadParameter("a subject needs a name: write /O=Example/CN=alice")
    return name


def rfc2253_text(name: x509.Name) -> str:
    """As ``openssl x509 -subject -nameopt RFC2253`` prints it, which every vendor accepts in ``<subject_name>``."""
    return name.rfc4514_string(_OPENSSL_NAMES)


def common_name(name: x509.Name) -> str:
    """The CN, or the whole name where there is none."""
    for attribute in name.get_attributes_for_oid(NameOID.COMMON_NAME):
        return str(attribute.value)
    return rfc2253_text(name)


def _from_slashes(text: str) -> str:
    """The form of ``openssl req -subj`` as RFC 4514 has it; a text of another form as it is."""
    if not text.startswith("/"):
        return text
    first, *parts = _SLASHED_PART.split(text)
    if first:
        raise ValueError("no type before the value")
    escaped = []
    for part in reversed(parts):
        kind, _, value = part.partition("=")
        escaped.append(kind + "=" + _RFC4514_SPECIAL.sub(r"\\\1", value))
    return ",".join(escaped)
