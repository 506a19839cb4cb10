"""XML as a tree of elements that know their line, read with the standard library's expat and nothing beyond it.

What is refused: a document type (and with it every entity, internal or external, and whatever attacks are built of
them), more than a mebibyte, more than forty levels.  Nothing is ever fetched.  It knows no element by name.
"""

from __future__ import annotations

import re
from dataclasses import dataclass, field
from xml.parsers import expat

from ddsi.structure.errors import ConfigurationError

__all__ = ["Element", "parse_untrusted_xml"]

# Both far beyond any real file: Cyclone's complete set of elements, written out with comments, is 100 kB and six deep.
_MOST_OCTETS = 1 << 20
_MOST_LEVELS = 40


@dataclass(slots=True)
class Element:
    """One element.  ``text`` is all character data directly inside, with the white space around it removed."""

    name: str
    line: int
    attributes: dict[str, str]
    children: list[Element] = field(default_factory=list)
    text: str = ""


def parse_untrusted_xml(octets: bytes, source: str, *, encoding: str | None = None) -> tuple[Element, bytes]:
    """The root element of the document at the beginning of ``octets``, and what follows it.

    ``source`` stands in error messages; ``encoding`` overrides the document's own declaration.
    Raises ConfigurationError, with the line, for all that is not one well-formed document within the bounds.
    """
    if len(octets) > _MOST_OCTETS:
        raise ConfigurationError(f"{source} has {len(octets)} octets; at most {_MOST_OCTETS} are read")
    octets = _with_long_end_tags(octets)
    parser = expat.ParserCreate(encoding)
    tree = _TreeBuilder(parser, source)
    try:
        parser.Parse(octets, True)
    except expat.ExpatError as error:
        if tree.root is not None and error.code == expat.errors.codes[expat.errors.XML_ERROR_JUNK_AFTER_DOC_ELEMENT]:
            return tree.root, octets[parser.ErrorByteIndex :]
        raise ConfigurationError(
            f"{source}, line {error.lineno}, column {error.offset + 1}: not well-formed XML: "
            f"{expat.errors.messages[error.code]}"
        ) from error
    except (LookupError, ValueError) as error:  # an encoding that Python does not know, or expat cannot use
        raise ConfigurationError(f"{source}: {error}; write it in UTF-8") from error
    assert tree.root is not None  # expat refuses a document without an element
    return tree.root, b""


class _TreeBuilder:
    """The handlers that expat calls, and the tree that they build."""

    def __init__(self, parser: expat.XMLParserType, source: str) -> None:
        self.root: Element | None = None
        self._open: list[Element] = []
        self._text: list[list[str]] = []
        self._parser = parser
        self._source = source
        parser.buffer_text = True
        parser.StartElementHandler = self._start
        parser.EndElementHandler = self._end
        parser.CharacterDataHandler = self._characters
        # Entities can be declared nowhere else, so this one refusal is enough against all of them.
        parser.StartDoctypeDeclHandler = self._refuse_doctype

    def _start(self, name: str, attributes: dict[str, str]) -> None:
        element = Element(name, self._parser.CurrentLineNumber, attributes)
        if len(self._open) == _MOST_LEVELS:
            raise ConfigurationError(f"{self._source}, line {element.line}: nested deeper than {_MOST_LEVELS} levels")
        if self._open:
            self._open[-1].children.append(element)
        else:
            self.root = element
        self._open.append(element)
        self._text.append([])

    def _end(self, _name: str) -> None:
        self._open.pop().text = "".join(self._text.pop()).strip()

    def _characters(self, text: str) -> None:
        self._text[-1].append(text)

    def _refuse_doctype(self, *_declaration: object) -> None:
        raise ConfigurationError(
            f"{self._source}, line {self._parser.CurrentLineNumber}: a document type is not allowed here; "
            "remove <!DOCTYPE ...> and write its entities out"
        )


# --- Cyclone's own reader lets every end tag be written </>, and its users do so in the environment variable --------

_NOT_A_TAG = {b"<!--": b"-->", b"<![CDATA[": b"]]>", b"<?": b"?>"}
# Possessive throughout: a tag that does not match must not be tried in every way to divide it.
_TAG = re.compile(rb"<(/?)([^\s<>/\"']*+)[^<>\"']*+(?:(?:\"[^\"]*+\"|'[^']*+')[^<>\"']*+)*+>")


def _with_long_end_tags(octets: bytes) -> bytes:
    """The same document with ``</>`` spelt out, on the same lines.  Stops where it cannot follow: expat says why."""
    if b"</>" not in octets:
        return octets
    pieces: list[bytes] = []
    names: list[bytes] = []
    done = start = 0
    while (start := octets.find(b"<", start)) >= 0:
        closing = next((end for begin, end in _NOT_A_TAG.items() if octets.startswith(begin, start)), None)
        if closing is not None:
            found = octets.find(closing, start)
            if found < 0:
                break
            start = found + len(closing)
            continue
        tag = _TAG.match(octets, start)
        if tag is None or (tag[1] and not names):
            break
        if tag[1]:
            name = names.pop()
            if not tag[2]:
                pieces += [octets[done:start], b"</", name, b">"]
                done = tag.end()
        elif not tag[0].endswith(b"/>"):
            names.append(tag[2])
        start = tag.end()
    return b"".join([*pieces, octets[done:]])
