"""XML of signed documents: read with nothing that XML can do to its reader, validated, and turned into plain nodes.

DDS-Security 1.1 §9.4.1.2 and §9.4.1.3; the schema is ``documents.xsd`` beside this file.  Call it with octets whose
signature was verified, and not before.  There are no document type declarations, so no entities and nothing to fetch;
octets, depth and the number of elements are bounded; comments and processing instructions are gone before anything is
compared.  Raises :class:`DocumentError` only.

It knows the form of the documents.  What their words mean is for ``governance.py`` and ``permissions.py``.
"""

from __future__ import annotations

import re
from collections.abc import Iterable
from dataclasses import field
from functools import cache
from importlib import resources

from lxml import etree  # pyright: ignore[reportAttributeAccessIssue]  (compiled, and without types)

from ddsi.structure.dataclass import dataclass

from .document_error import DocumentError, did_you_mean, shown

__all__ = ["Node", "parse_document"]

_MOST_OCTETS = 1 << 20
_MOST_DEPTH = 16  # the schema needs 9
_MOST_ELEMENTS = 50_000
_LONGEST_TAG = 100  # as errors show it; the schema's are shorter
_XSI = "{http://www.w3.org/2001/XMLSchema-instance}"
_MUST_INTERPRET = "must_interpret"
# Only encodings in which < is 0x3C: what follows looks for <!DOCTYPE in the octets.
_CODECS = {"utf-8": "utf-8", "utf8": "utf-8", "us-ascii": "ascii", "ascii": "ascii", "iso-8859-1": "latin-1"}
_DECLARATION = re.compile(rb"<\?xml\s[^>]{0,200}?encoding\s*=\s*[\"']([A-Za-z0-9._-]{1,40})[\"'][^>]{0,200}?\?>")

_POSITION = re.compile(r", line \d+, column \d+\Z")
_LINE = re.compile(r"line (\d{1,9})")


@dataclass(frozen=True, slots=True)
class Node:
    """An element.  ``text`` is its own, stripped; ``line`` is the file's; ``rule`` says in which rule it stands."""

    document: str
    tag: str
    text: str
    name: str
    """The attribute of that name, or ""."""
    line: int
    rule: str
    may_be_ignored: bool
    """It carries must_interpret="false", though we know it."""
    nodes: tuple[Node, ...] = field(repr=False)

    def all(self, tag: str) -> list[Node]:
        return [node for node in self.nodes if node.tag == tag]

    def find(self, tag: str) -> Node | None:
        """The element of this name, which must not stand twice."""
        found = self.all(tag)
        if len(found) > 1:
            raise found[1].error(f"<{tag}> stands there a second time; the first is in line {found[0].line}")
        return found[0] if found else None

    def get(self, tag: str) -> Node:
        """As :meth:`find`, and it must be there."""
        node = self.find(tag)
        if node is None:
            raise self.error(f"<{self.tag}> has no <{tag}>", remedy=f"add <{tag}>...</{tag}>")
        return node

    def error(self, reason: str, *, remedy: str = "") -> DocumentError:
        """For the caller to raise."""
        return DocumentError(self.document, reason, line=self.line, rule=self.rule, remedy=remedy)


def parse_document(xml: bytes, *, name: str, first_line: int = 1) -> Node:
    """The root of the document, all of it valid by the schema.  ``first_line``: of the file, where ``xml`` begins."""
    root = _parse(xml, name, first_line)
    _skip_what_may_be_ignored(root)
    node = _node(root, name, first_line - 1)
    if not (schema := _schema()).validate(root):
        raise _schema_error(node, schema.error_log)
    return node


# --- reading -------------------------------------------------------------------------------------------------


def _parse(xml: bytes, name: str, first_line: int) -> etree._Element:
    if len(xml) > _MOST_OCTETS:
        raise DocumentError(name, f"its XML has {len(xml)} octets; at most {_MOST_OCTETS} are read")
    text = _decode(xml, name)
    if "<!DOCTYPE" in text or "<!ENTITY" in text:
        line = first_line + text.count("\n", 0, min(i for i in map(text.find, ("<!DOCTYPE", "<!ENTITY")) if i >= 0))
        remedy = "remove it, and write its entities out"
        raise DocumentError(name, "a document type declaration is not read", line=line, remedy=remedy)
    parser = etree.XMLParser(
        encoding="utf-8",  # as it is now, whatever it declares
        resolve_entities=False,
        load_dtd=False,
        dtd_validation=False,
        no_network=True,
        huge_tree=False,
        remove_comments=True,
        remove_pis=True,
    )
    try:
        root = etree.fromstring(text.encode("utf-8"), parser)
    except etree.XMLSyntaxError as error:
        line, _ = error.position
        # The message ends with the position, and may name another line; both count from the beginning of the XML.
        message = _LINE.sub(lambda found: f"line {int(found.group(1)) + first_line - 1}", _POSITION.sub("", error.msg))
        raise DocumentError(name, f"it is not XML: {message}", line=first_line - 1 + max(line, 1)) from error
    except ValueError as error:
        raise DocumentError(name, f"it is not XML: {error}") from error
    if root.getroottree().docinfo.doctype:
        raise DocumentError(name, "a document type declaration is not read", line=first_line)
    return root


def _decode(xml: bytes, name: str) -> str:
    declaration = _DECLARATION.match(xml)
    encoding = declaration.group(1).decode("ascii").lower() if declaration else "utf-8"
    remedy = "save it as UTF-8"
    if encoding not in _CODECS:
        raise DocumentError(name, f"the encoding {encoding} is not read", remedy=remedy)
    try:
        return xml.decode(_CODECS[encoding]).removeprefix("\ufeff")
    except UnicodeDecodeError as error:
        raise DocumentError(name, f"it is not {encoding}, as it says or as XML is by default", remedy=remedy) from error


def _skip_what_may_be_ignored(root: etree._Element) -> None:
    """Remove elements that a newer version marks as optional (1.2), if we do not know them, and xsi: attributes.

    An element that we know is interpreted all the same: no mark may switch off a rule.
    """
    ignored = [
        element
        for element in root.iter(etree.Element)
        if element.tag not in _known_words() and element.get(_MUST_INTERPRET, "").strip() in ("false", "0")
    ]
    for element in ignored:
        parent = element.getparent()
        # Text after it would go with it; then it stays, and the schema finds both.
        if parent is not None and not (element.tail or "").strip():
            parent.remove(element)
    for element in root.iter(etree.Element):
        for attribute in [name for name in element.attrib if name.startswith(_XSI)]:
            del element.attrib[attribute]


# --- nodes ---------------------------------------------------------------------------------------------------

_RULES = {"grant", "allow_rule", "deny_rule", "domain_rule", "topic_rule"}


def _node(root: etree._Element, document: str, line_offset: int) -> Node:
    elements = 0

    def build(element: etree._Element, depth: int, rule: str) -> Node:
        nonlocal elements
        elements += 1
        line = line_offset + int(element.sourceline or 0)
        if elements > _MOST_ELEMENTS:
            raise DocumentError(document, f"it has more than {_MOST_ELEMENTS} elements", line=line)
        if depth > _MOST_DEPTH:
            raise DocumentError(document, f"its elements are more than {_MOST_DEPTH} deep", line=line, rule=rule)
        may_be_ignored = element.attrib.pop(_MUST_INTERPRET, "").strip() in ("false", "0")
        children: list[Node] = []
        numbers: dict[str, int] = {}
        for child in element:
            tag = str(child.tag)
            label = rule
            if tag in _RULES:
                numbers[tag] = numbers.get(tag, 0) + 1
                label = ", ".join(filter(None, (rule, _label(tag, child.get("name", ""), numbers[tag]))))
            children.append(build(child, depth + 1, label))
        tag, text = str(element.tag)[:_LONGEST_TAG], (element.text or "").strip(" \t\r\n")
        return Node(document, tag, text, element.get("name", ""), line, rule, may_be_ignored, tuple(children))

    return build(root, 1, "")


def _label(tag: str, name: str, number: int) -> str:
    """Its name, and for what has none, which of its kind it is in what it stands in, from 1."""
    return f"{tag} {shown(name) if name else number}"


# --- the schema ----------------------------------------------------------------------------------------------


@cache
def _schema_text() -> bytes:
    return (resources.files("ddsi_security.access_control") / "documents.xsd").read_bytes()


def _schema() -> etree.XMLSchema:
    """A new one each time, as it keeps the errors of its last use, and documents are read in several threads."""
    return etree.XMLSchema(etree.fromstring(_schema_text()))


@cache
def _known_words(*, optional_only: bool = False) -> tuple[str, ...]:
    """The names of the schema's elements, in its order."""
    elements = etree.fromstring(_schema_text()).iter("{http://www.w3.org/2001/XMLSchema}element")
    found = (str(word.get("name")) for word in elements if not optional_only or word.get("minOccurs") == "0")
    return tuple(dict.fromkeys(found))


# What the schema's simple types want, and the facets by which libxml2 names them.
_BOOLEAN, _DOMAIN_ID, _EXPRESSION = "true or false", "a whole number from 0 to 2147483647", "an expression such as *"
_WANTED = {
    "type 'Boolean'": _BOOLEAN,
    "type 'DomainId'": _DOMAIN_ID,
    "facet 'pattern'": _BOOLEAN,
    "facet 'maxInclusive'": _DOMAIN_ID,
    "facet 'minLength'": _EXPRESSION,
}
_SET = re.compile(r"The value '(.*)' is not an element of the set \{(.*)\}", re.DOTALL)
_EXPECTED = re.compile(r"Expected is (?:one of )?\(([^)]*)\)")
_QUOTED_ELEMENT = re.compile(r"\AElement '[^']*'(?:, attribute '[^']*')?: ")


def _schema_error(root: Node, log: Iterable[etree._LogEntry]) -> DocumentError:
    """The first of the schema's errors in the words of this room; libxml2's where there are no better ones."""
    entries = [entry for entry, _ in zip(log, range(8), strict=False)]
    if not entries:
        return root.error("it does not follow the schema")
    node = _at(root, entries[0].path or "")
    messages = " ".join(entry.message or "" for entry in entries if entry.path == entries[0].path)
    if found := _SET.search(messages):
        valid = re.findall(r"'([^']*)'", found.group(2))
        return node.error(f"<{node.tag}> is {shown(found.group(1))}", remedy=did_you_mean(found.group(1), valid))
    if wanted := next((wanted for word, wanted in _WANTED.items() if word in messages), ""):
        return node.error(f"<{node.tag}> is {shown(node.text)}", remedy=f"expected {wanted}")
    expected = _EXPECTED.search(messages)
    words = [word.strip() for word in expected.group(1).split(",")] if expected else []
    if "Missing child element" in messages:
        needed = [word for word in words if word not in _known_words(optional_only=True)]
        missing = " or ".join(f"<{word}>" for word in needed or words)
        return node.error(f"<{node.tag}> is not complete", remedy=f"add {missing}" if missing else "")
    if "This element is not expected" in messages:
        number = _NUMBER.search(entries[0].path or "")
        if number and int(number.group(1)) > 1 and node.tag not in words:
            return node.error(f"<{node.tag}> stands there a second time", remedy="keep one")
        return node.error(f"<{node.tag}> may not stand here", remedy=did_you_mean(node.tag, words or _known_words()))
    if "validation root" in messages:
        return node.error(f"<{node.tag}> is no document", remedy="it begins with <dds>, without a namespace")
    if "Character content" in messages:
        return node.error(f"<{node.tag}> has text beside its elements")
    return node.error(_QUOTED_ELEMENT.sub("", (entries[0].message or "").strip()).rstrip("."))


_NUMBER = re.compile(r"\[(\d{1,6})\]\Z")
_STEP = re.compile(r"(?:\*|([^\[]+))(?:\[(\d+)\])?")


def _at(root: Node, path: str) -> Node:
    """The element that an XPath such as ``/dds/permissions/grant[2]`` leads to, or the last one on the way."""
    node = root
    for step in path.split("/")[2:]:
        match = _STEP.fullmatch(step)
        if match is None:
            break
        candidates = node.all(match.group(1)) if match.group(1) else list(node.nodes)
        number = int(match.group(2) or 1)
        if not 1 <= number <= len(candidates):
            break
        node = candidates[number - 1]
    return node
