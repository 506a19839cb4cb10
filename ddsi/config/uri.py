"""``DDSI_URI``: where the configuration is, or the configuration itself.

One or more sources between commas; a later one overrides an earlier one.  A source is ``file:`` and a path, a path, or
XML: a whole document with the root ``<DDSI>`` (or Cyclone's ``<CycloneDDS>``), or only a part of it from ``<Domain>``
or ``<General>`` on.  Only ``<Domain>`` elements whose ``Id`` is ``any``, missing, or the domain in question count.
"""

from __future__ import annotations

import os
from collections.abc import Iterator, Mapping
from pathlib import Path

from ddsi.structure.errors import ConfigurationError

from .config import Config
from .environment import ENVIRONMENT_VARIABLE
from .settings import Settings
from .units import parse_integer
from .variables import expand_variables
from .vocabulary import DOMAIN, ROOT_NAMES, Word
from .xml_document import Element, parse_untrusted_xml

__all__ = ["config_from_uri"]

_MOST_SOURCES = 100


def config_from_uri(text: str, *, domain_id: int, environ: Mapping[str, str]) -> Config:
    """See :meth:`Config.from_uri`."""
    # The two names that Cyclone adds, used in the names of log files.
    settings = Settings({"CYCLONEDDS_PID": str(os.getpid()), "CYCLONEDDS_DOMAIN_ID": str(domain_id), **environ})
    for root, source in _documents(text):
        for domain in _domains(root, source):
            _check_names(domain, DOMAIN, source)
            if _is_for(domain, domain_id, settings, source):
                settings.read(domain, source)
    return settings.to_config()


# --- sources ---


def _documents(text: str) -> Iterator[tuple[Element, str]]:
    """The root element of each source, and its name for messages."""
    # Undecodable octets of the environment come as surrogates; so they become what they were.
    rest = text.encode("utf-8", "surrogateescape").strip(b", \t\r\n")
    for _ in range(_MOST_SOURCES):
        if not rest:
            return
        if rest.startswith(b"<"):
            root, rest = parse_untrusted_xml(rest, ENVIRONMENT_VARIABLE, encoding="utf-8")
            yield root, ENVIRONMENT_VARIABLE
        else:
            location, _, rest = rest.partition(b",")
            path = _path(os.fsdecode(location.strip()))
            root, junk = parse_untrusted_xml(_read_file(path), str(path))
            if junk:
                raise ConfigurationError(f"{path}: more follows the end of <{root.name}>; a file holds one document")
            yield root, str(path)
        rest = rest.lstrip(b", \t\r\n")
    raise ConfigurationError(f"{ENVIRONMENT_VARIABLE} names more than {_MOST_SOURCES} sources")


def _path(location: str) -> Path:
    """``file:///etc/x``, ``file:/etc/x`` and ``file:x`` are all in use, and a path alone."""
    if location.startswith("file:"):
        location = location.removeprefix("file:").removeprefix("//")
        if location[:1] == "/" and location[2:3] == ":":  # file:///C:/x
            location = location[1:]
    elif "://" in location:
        raise ConfigurationError(f"{ENVIRONMENT_VARIABLE} is {location!r}; only file: is read, nothing is fetched")
    return Path(location)


def _read_file(path: Path) -> bytes:
    try:
        return path.read_bytes()
    except (OSError, ValueError) as error:
        reason = error.strerror if isinstance(error, OSError) else error
        raise ConfigurationError(
            f"{ENVIRONMENT_VARIABLE} names {str(path)!r}, which cannot be read ({reason}): "
            "give an existing file, or the XML itself, which begins with <"
        ) from error


# --- the root and its domains ---


def _domains(root: Element, source: str) -> Iterator[Element]:
    """The ``<Domain>`` elements; sections that stand without one are taken as one for any domain."""
    name = root.name.lower()
    if name == "domain":
        yield root
    elif DOMAIN.child(name) is not None:
        yield Element("Domain", root.line, {}, [root])
    elif name not in (known.lower() for known in ROOT_NAMES):
        raise ConfigurationError(
            f"{source}, line {root.line}: <{root.name}> is no root of a configuration; it must be "
            f"{' or '.join(f'<{known}>' for known in ROOT_NAMES)}"
        )
    else:
        _check_root(root, source)
        for child in root.children:
            yield child if child.name.lower() == "domain" else Element("Domain", child.line, {}, [child])


def _check_root(root: Element, source: str) -> None:
    if root.text:
        raise ConfigurationError(f"{source}, line {root.line}: <{root.name}> holds elements, not {root.text[:40]!r}")
    for attribute in root.attributes:
        # A schema may be named, for editors; it is not read.
        if not attribute.startswith(("xmlns", "xsi:")):
            raise ConfigurationError(f"{source}, line {root.line}: <{root.name}> has no attribute {attribute!r}")


def _is_for(domain: Element, domain_id: int, settings: Settings, source: str) -> bool:
    said = [text for name, text in domain.attributes.items() if name.lower() == "id"]
    said += [child.text for child in domain.children if child.name.lower() == "id"]
    place = f"{source}, line {domain.line}: <Domain> Id"
    for text in said:
        try:
            text = expand_variables(text, settings.variables, lambda _name: None).strip()
            if text.lower() not in ("any", "default", "") and parse_integer(text) != domain_id:
                return False
        except ValueError as error:
            raise ConfigurationError(f"{place} is {text!r}; it must be any or {error}") from None
    return True


def _check_names(element: Element, word: Word, source: str) -> None:
    """Every element and attribute inside ``element``, whichever domain it is for: a slip in any is worth telling."""
    place = f"{source}, line {element.line}: <{word.path or 'Domain'}>"
    for attribute in element.attributes:
        if attribute.lower() not in word.attributes:
            raise ConfigurationError(f"{place} has no attribute {attribute!r}: {word.attribute_suggestion(attribute)}")
    if element.text and word.children:
        raise ConfigurationError(f"{place} holds elements, not {element.text[:40]!r}")
    for child in element.children:
        child_word = word.child(child.name)
        if child_word is None:
            raise ConfigurationError(
                f"{source}, line {child.line}: <{child.name}> is not known in <{word.path or 'Domain'}>: "
                f"{word.suggestion(child.name)}"
            )
        _check_names(child, child_word, source)
