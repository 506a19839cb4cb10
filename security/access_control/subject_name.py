"""SubjectName: who a certificate or a grant is about, compared by meaning rather than as text.

    SubjectName.parse(text: str) -> SubjectName          raises MalformedMessage, and nothing else

DDS-Security 1.1 §9.4.1.3.2.1 (subject names are RFC 2253's; 1.2: RFC 4514's).  Documents are written by hand, with what
OpenSSL happened to print: ``CN=alice,O=Example Org,C=US``, ``C = US, O = Example Org, CN = alice`` or
``/C=US/O=Example Org/CN=alice``.  All three are read, and compared as multisets of (object identifier, value): the
order, which differs between the three, does not count; the spelling of types does not; values must be alike to the
letter.  Looser comparisons, of which X.500 knows many, could let one person pass for another.
"""

from __future__ import annotations

import re
from dataclasses import field

from ddsi.structure.dataclass import dataclass
from ddsi.structure.errors import MalformedMessage

from .der import DerReader

__all__ = ["SubjectName"]

MOST_CHARACTERS = 4096
_MOST_ATTRIBUTES = 64

_TYPES = {
    "2.5.4.3": ("CN", "commonName"),
    "2.5.4.4": ("SN", "surname"),
    "2.5.4.5": ("serialNumber",),
    "2.5.4.6": ("C", "countryName"),
    "2.5.4.7": ("L", "localityName"),
    "2.5.4.8": ("ST", "S", "stateOrProvinceName"),
    "2.5.4.9": ("STREET", "streetAddress"),
    "2.5.4.10": ("O", "organizationName"),
    "2.5.4.11": ("OU", "organizationalUnitName"),
    "2.5.4.12": ("title", "T"),
    "2.5.4.13": ("description",),
    "2.5.4.17": ("postalCode",),
    "2.5.4.41": ("name",),
    "2.5.4.42": ("GN", "givenName"),
    "2.5.4.43": ("initials",),
    "2.5.4.44": ("generationQualifier",),
    "2.5.4.45": ("x500UniqueIdentifier",),
    "2.5.4.46": ("dnQualifier",),
    "2.5.4.65": ("pseudonym",),
    "2.5.4.97": ("organizationIdentifier",),
    "0.9.2342.19200300.100.1.1": ("UID", "userId"),
    "0.9.2342.19200300.100.1.25": ("DC", "domainComponent"),
    "1.2.840.113549.1.9.1": ("emailAddress", "E", "email", "Email"),
}
_IDENTIFIERS = {spelling.lower(): identifier for identifier, names in _TYPES.items() for spelling in names}

_DOTTED = re.compile(r"(?:OID\.)?((?:0|[1-9]\d{0,19})(?:\.(?:0|[1-9]\d{0,19})){1,30})", re.ASCII | re.IGNORECASE)
_KEYWORD = re.compile(r"[A-Za-z][A-Za-z0-9-]{0,63}")
# In the one-line form nothing escapes: a slash begins an attribute only if a type and a = follow.
_ONE_LINE = re.compile(r"/(?=[A-Za-z][A-Za-z0-9-]{0,63}=|[0-9][0-9.]{0,99}=)")
_SPACE = " \t\r\n"  # what may stand around types and values; other white space is part of them
_HEX_PAIR = re.compile(r"[0-9A-Fa-f]{2}")
# The string types of X.509's DirectoryString, and IA5String, with their codecs.
_STRINGS = {0x0C: "utf-8", 0x13: "ascii", 0x14: "latin-1", 0x16: "ascii", 0x1C: "utf-32-be", 0x1E: "utf-16-be"}


@dataclass(frozen=True, slots=True)
class SubjectName:
    """``attributes``: (object identifier in dots, value), sorted.  ``text``: as it was written; it does not compare."""

    attributes: tuple[tuple[str, str], ...]
    text: str = field(compare=False)

    @classmethod
    def parse(cls, text: str) -> SubjectName:
        """Read RFC 4514's form, OpenSSL's ``C = US, CN = alice``, or its one-line form, which begins with a slash."""
        if len(text) > MOST_CHARACTERS:
            raise _malformed(f"it has {len(text)} characters; there may be {MOST_CHARACTERS}")
        stripped = text.strip(_SPACE)
        found = _one_line(stripped) if stripped.startswith("/") else _rfc4514(text)
        if not found:
            raise _malformed("it is empty")
        # White space behind a backslash is part of the value.
        return cls(tuple(sorted(found)), text.lstrip(_SPACE) if stripped.endswith("\\") else stripped)

    def __str__(self) -> str:
        """For people: what does not print is escaped."""
        return "".join(character if character.isprintable() else ascii(character)[1:-1] for character in self.text)


def _malformed(reason: str) -> MalformedMessage:
    return MalformedMessage(reason, element="subject name")


def _append(found: list[tuple[str, str]], kind: str, value: str) -> None:
    if len(found) == _MOST_ATTRIBUTES:
        raise _malformed(f"it has more than {_MOST_ATTRIBUTES} attributes")
    found.append((kind, value))


def _identifier(text: str) -> str:
    """The type of an attribute as an object identifier; a keyword that nobody told us of stays, in lower case."""
    if (dotted := _DOTTED.fullmatch(text)) is not None:
        return dotted.group(1)
    if _KEYWORD.fullmatch(text) is None:
        raise _malformed(f"{text[:40]!r} is not the type of an attribute, such as CN")
    return _IDENTIFIERS.get(text.lower(), text.lower())


def _one_line(text: str) -> list[tuple[str, str]]:
    """``/C=US/O=Example Org/CN=alice``, from X509_NAME_oneline of OpenSSL."""
    found: list[tuple[str, str]] = []
    starts = [match.end() for match in _ONE_LINE.finditer(text)]
    if not starts or starts[0] != 1:
        raise _malformed("after the slash, TYPE=value is expected")
    for start, end in zip(starts, [*(start - 1 for start in starts[1:]), len(text)], strict=True):
        kind, _, value = text[start:end].partition("=")
        _append(found, _identifier(kind), value.strip(_SPACE))
    return found


def _rfc4514(text: str) -> list[tuple[str, str]]:
    """``CN=alice,O=Example Org,C=US``; ``+`` and ``;`` separate as the comma does, white space around is dropped."""
    found: list[tuple[str, str]] = []
    position = 0
    while True:
        equals = text.find("=", position)
        if equals < 0:
            raise _malformed(f"TYPE=value is expected, {text[position : position + 40]!r} is there")
        kind = _identifier(text[position:equals].strip(_SPACE))
        value, position = _value(text, equals + 1)
        _append(found, kind, value)
        if position == len(text):
            return found
        position += 1  # the separator


def _value(text: str, position: int) -> tuple[str, int]:
    """The value from ``position``, and the index of the separator after it, or the length of the text."""
    while text.startswith(tuple(_SPACE), position):
        position += 1
    if text.startswith("#", position):
        end = next((index for index in range(position, len(text)) if text[index] in ",;+"), len(text))
        return _from_der(text[position + 1 : end].strip(_SPACE)), end
    octets = bytearray()  # escapes are octets of UTF-8 (RFC 4514 §2.4)
    kept = 0  # as far as white space is not at the end
    quoted = False
    while position < len(text):
        character = text[position]
        position += 1
        if character == "\\":
            if (pair := _HEX_PAIR.match(text, position)) is not None:
                octets.append(int(pair.group(), 16))
                position += 2
            elif position < len(text):
                octets += text[position].encode("utf-8", "surrogatepass")
                position += 1
            else:
                raise _malformed("it ends in a backslash")
            kept = len(octets)
        elif character == '"':  # RFC 2253 §4, from RFC 1779
            quoted = not quoted
            kept = len(octets)
        elif character in ",;+" and not quoted:
            position -= 1
            break
        else:
            octets += character.encode("utf-8", "surrogatepass")
            if quoted or character not in _SPACE:
                kept = len(octets)
    if quoted:
        raise _malformed("a quotation mark is not closed")
    try:
        return octets[:kept].decode("utf-8"), position
    except UnicodeDecodeError as error:
        raise _malformed("its escapes are not UTF-8") from error


def _from_der(digits: str) -> str:
    """A value as ``#`` and its DER in hexadecimal (RFC 4514 §2.4): the text of a string; else the digits themselves."""
    try:
        octets = bytes.fromhex(digits)
    except ValueError as error:
        raise _malformed(f"{digits[:40]!r} is not hexadecimal") from error
    reader = DerReader(octets, "subject name")
    value = reader.next()
    reader.end()
    if value.tag not in _STRINGS:
        return f"#{digits.lower()}"
    try:
        return bytes(value.content).decode(_STRINGS[value.tag])
    except UnicodeDecodeError as error:
        raise _malformed("a string in it does not decode") from error
