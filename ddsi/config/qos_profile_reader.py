"""QoS profile files, read into profiles: what each sets and what it builds on, with the place of everything.

OMG DDS-XML 1.0 §7.3.2, and the dialects of RTI Connext and Fast DDS.  Nothing is resolved here, and no policy made:
that is ``qos_profiles``.  The files are untrusted: see ``xml_document``; whatever is not known is refused.
"""

from __future__ import annotations

import difflib
import os
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from pathlib import Path

from ddsi.structure.errors import ConfigurationError
from ddsi.structure.qos_policies import BinaryProperty, Property

from .qos_profile_values import duration
from .qos_profile_words import FAST, OMG, Leaf, Members, Skipped, Word
from .xml_document import Element, parse_untrusted_xml

__all__ = ["EntityProfile", "Profile", "Setting", "read_profiles"]

_MOST_OCTETS = 1 << 20


@dataclass(frozen=True, slots=True)
class Setting:
    """One value, and where it stands.  ``shown`` is what a message may say of it."""

    value: object
    place: str
    shown: str


@dataclass(slots=True)
class EntityProfile:
    """What one element such as ``<datawriter_qos>`` says.  ``entity``: "writer", and so on."""

    entity: str
    place: str
    topic_filters: tuple[str, ...] = ()
    bases: tuple[str, ...] = ()
    settings: dict[str, Setting] = field(default_factory=dict)


@dataclass(slots=True)
class Profile:
    """``name``: ``Library::Profile``, or the profile's alone where it is in none.  ``defaults_for``: these entities,
    when nobody names a profile."""

    name: str
    place: str
    library: str = ""
    bases: tuple[str, ...] = ()
    defaults_for: tuple[str, ...] = ()
    entities: list[EntityProfile] = field(default_factory=list)


_OMG_ENTITIES = {
    "domain_participant_qos": "participant",
    "domainparticipant_qos": "participant",
    "participant_qos": "participant",
    "publisher_qos": "publisher",
    "subscriber_qos": "subscriber",
    "topic_qos": "topic",
    "datawriter_qos": "writer",
    "datareader_qos": "reader",
}
_FAST_ENTITIES = {
    "participant": "participant",
    "data_writer": "writer",
    "publisher": "writer",
    "data_reader": "reader",
    "subscriber": "reader",
    "topic": "topic",
}
_BESIDE_LIBRARIES = (
    "types", "domain_library", "domain_participant_library", "application_library", "data_library", "library_settings",
    "log", "participant_factory_qos",
)  # fmt: skip
_BESIDE_FAST_PROFILES = (
    "transport_descriptors", "domainparticipant_factory", "requester", "replier", "types", "log", "library_settings",
)  # fmt: skip


def read_profiles(path: str | os.PathLike[str]) -> tuple[list[Profile], list[str]]:
    """The profiles of one file, and what in it was skipped.  Raises ConfigurationError."""
    source = os.fspath(path)
    try:
        with Path(source).open("rb") as file:
            octets = file.read(_MOST_OCTETS + 1)
    except (OSError, ValueError) as error:
        reason = error.strerror if isinstance(error, OSError) else error
        raise ConfigurationError(f"QoS profiles: {source!r} cannot be read ({reason})") from error
    root, junk = parse_untrusted_xml(octets, source)
    if junk.strip():
        raise ConfigurationError(f"{source}: more follows the end of <{root.name}>; a file holds one document")
    reader = _Reader(source)
    reader.read(root)
    return reader.profiles, reader.skipped


class _Reader:
    """Collects the profiles of one document."""

    def __init__(self, source: str) -> None:
        self._source = source
        self.profiles: list[Profile] = []
        self.skipped: list[str] = []

    # --- libraries and profiles --------------------------------------------------------------------------

    def read(self, root: Element) -> None:
        if root.name != "dds":
            self._read_top(root, ("dds", "qos_library", "qos_profile", "profiles"))
            return
        self._check_text(root)
        self._check_attributes(root, ("version",))
        for child in root.children:
            if child.name in _BESIDE_LIBRARIES:
                self._skip(child, "it is no QoS")
            else:
                self._read_top(child, ("qos_library", "qos_profile", "profiles"))

    def _read_top(self, element: Element, names: tuple[str, ...]) -> None:
        if element.name == "qos_library":
            self._read_library(element)
        elif element.name == "qos_profile":
            self._read_profile(element, "")
        elif element.name == "profiles":
            self._read_fast_profiles(element)
        else:
            raise self._unknown(element, None, names)

    def _read_library(self, library: Element) -> None:
        self._check_text(library)
        name = self._name(library, "name", ("name",))
        for child in library.children:
            if child.name == "qos_profile":
                self._read_profile(child, name)
            elif child.name in _OMG_ENTITIES:  # of its own name, in no profile
                alone = Profile(f"{name}::{self._name(child, 'name', _ENTITY_ATTRIBUTES)}", self._place(child), name)
                alone.entities.append(self._read_entity(child))
                self.profiles.append(alone)
            else:
                raise self._unknown(child, library, ("qos_profile", *_OMG_ENTITIES))

    def _read_profile(self, element: Element, library: str) -> None:
        self._check_text(element)
        name = self._name(element, "name", _PROFILE_ATTRIBUTES)
        is_default = self._flag(element, "is_default_qos")
        profile = Profile(
            f"{library}::{name}" if library else name, self._place(element), library, self._bases(element)
        )
        for child in element.children:
            if child.name in _OMG_ENTITIES:
                profile.entities.append(self._read_entity(child))
            elif child.name == "base_name":
                profile.bases += tuple(item.text for item in child.children)
            elif child.name in _BESIDE_LIBRARIES:
                self._skip(child, "it is no QoS")
            else:
                raise self._unknown(child, element, tuple(_OMG_ENTITIES))
        if is_default:
            profile.defaults_for = tuple(dict.fromkeys(_OMG_ENTITIES.values()))
        self.profiles.append(profile)

    def _read_entity(self, element: Element) -> EntityProfile:
        self._check_text(element)
        self._check_attributes(element, _ENTITY_ATTRIBUTES)
        entity = _OMG_ENTITIES[element.name]
        filters = tuple(part.strip() for part in element.attributes.get("topic_filter", "").split(",") if part.strip())
        if filters and entity not in ("topic", "writer", "reader"):
            raise ConfigurationError(
                f"{self._place(element)} has a topic_filter, but only topics, writers and readers have topics"
            )
        found = EntityProfile(entity, self._place(element), filters, self._bases(element))
        policies = Element(element.name, element.line, {})
        for child in element.children:
            if child.name == "base_name":
                found.bases += tuple(item.text for item in child.children)
            else:
                policies.children.append(child)
        self._read_members(policies, OMG[entity], found.settings)
        return found

    def _read_fast_profiles(self, profiles: Element) -> None:
        """Fast DDS: each element is a profile of one kind of entity, all under one set of names."""
        self._check_text(profiles)
        for child in profiles.children:
            if child.name in _BESIDE_FAST_PROFILES:
                self._skip(child, "it is no QoS")
                continue
            entity = _FAST_ENTITIES.get(child.name)
            if entity is None:
                raise self._unknown(child, profiles, tuple(_FAST_ENTITIES))
            name = self._name(child, "profile_name", ("profile_name", "is_default_profile"))
            profile = Profile(name, self._place(child))
            if self._flag(child, "is_default_profile"):
                profile.defaults_for = (entity,)
            found = EntityProfile(entity, self._place(child))
            self._read_members(child, FAST[entity], found.settings)
            profile.entities.append(found)
            self.profiles.append(profile)

    # --- policies ----------------------------------------------------------------------------------------

    def _read_members(self, element: Element, words: Mapping[str, Word], into: dict[str, Setting]) -> None:
        self._check_text(element)
        for child in element.children:
            word = words.get(child.name)
            if word is None:
                raise self._unknown(child, element, tuple(words))
            if isinstance(word, Skipped):
                self._skip(child, "it steers only the inside of the product that it is for")
                continue
            self._check_attributes(child, ())
            if isinstance(word, Leaf):
                into[word.setting] = self._leaf(child, word)
            elif isinstance(word, Members):
                self._read_sequence(child, word, into)
            else:
                self._read_members(child, word, into)

    def _read_sequence(self, element: Element, word: Members, into: dict[str, Setting]) -> None:
        self._check_text(element)
        values: list[object] = []
        for child in element.children:
            if child.name != word.element:
                raise self._unknown(child, element, (word.element,))
            self._check_attributes(child, ())
            if "" in word.words:  # of plain values
                values.append(self._leaf(child, word.words[""]).value)
                continue
            parts: dict[str, Setting] = {}
            self._read_members(child, word.words, parts)
            missing = [name for name in ("name", "value") if name not in parts]
            if missing or not parts["name"].value:
                raise ConfigurationError(f"{self._place(child)} lacks <{(missing or ['name'])[0]}>")
            if word.setting.startswith("property."):
                name = str(parts["name"].value)
                propagate = bool(parts["propagate"].value) if "propagate" in parts else False
                value = parts["value"].value
                made = BinaryProperty(value, propagate) if isinstance(value, bytes) else Property(str(value), propagate)
                into[f"property {name}"] = Setting(made, self._place(child), "a property")
            else:
                values.append((str(parts["name"].value), str(parts["value"].value)))
        if not word.setting.startswith("property."):
            into[word.setting] = Setting(tuple(values), self._place(element), "a sequence")

    def _leaf(self, element: Element, word: Leaf) -> Setting:
        said = element.text or " ".join(child.text for child in element.children)
        shown = "what it may not be" if word.is_secret else repr(said[:60])
        try:
            if element.children and word.read is not duration:
                raise ValueError(f"a value; <{element.children[0].name}> may not stand in it")
            return Setting(word.read(element), self._place(element), shown)
        except ValueError as error:
            raise ConfigurationError(f"{self._place(element)} is {shown}; it must be {error}") from None

    # --- what is wrong -----------------------------------------------------------------------------------

    def _place(self, element: Element) -> str:
        return f"{self._source}, line {element.line}: <{element.name}>"

    def _unknown(self, element: Element, parent: Element | None, names: Iterable[str]) -> ConfigurationError:
        known = list(names)
        by_lower = {name.lower().replace("_", ""): name for name in known}
        # The length is bounded, as the comparison takes time with its square.
        near = difflib.get_close_matches(element.name.lower().replace("_", "")[:100], list(by_lower), n=1)
        hint = f"did you mean <{by_lower[near[0]]}>?" if near else f"there may be {_listed(known)}"
        where = f"in <{parent.name}>" if parent is not None else "at the top of QoS profiles"
        return ConfigurationError(f"{self._place(element)} is not known {where}: {hint}")

    def _check_text(self, element: Element) -> None:
        if element.text:
            raise ConfigurationError(f"{self._place(element)} holds elements, but there is text directly in it")

    def _check_attributes(self, element: Element, names: tuple[str, ...]) -> None:
        for attribute in element.attributes:
            # A schema may be named, for editors; it is not read.
            if attribute not in names and not attribute.startswith(("xmlns", "xsi:")):
                near = difflib.get_close_matches(attribute[:100], names, n=1)
                hint = f"did you mean {near[0]}?" if near else f"it has {', '.join(names) or 'none'}"
                raise ConfigurationError(f"{self._place(element)} has no attribute {attribute[:60]!r}: {hint}")

    def _name(self, element: Element, attribute: str, allowed: tuple[str, ...]) -> str:
        self._check_attributes(element, allowed)
        name = element.attributes.get(attribute, "").strip()
        if not name:
            raise ConfigurationError(f"{self._place(element)} needs a name: give it the attribute {attribute}")
        return name

    def _bases(self, element: Element) -> tuple[str, ...]:
        base = element.attributes.get("base_name", "").strip()
        return (base,) if base else ()

    def _flag(self, element: Element, attribute: str) -> bool:
        said = element.attributes.get(attribute, "false").strip().lower()
        if said not in ("true", "false", "1", "0"):
            raise ConfigurationError(f"{self._place(element)}: {attribute} is {said[:60]!r}; it must be true or false")
        return said in ("true", "1")

    def _skip(self, element: Element, why: str) -> None:
        self.skipped.append(f"{self._place(element)}: {why}")


_PROFILE_ATTRIBUTES = ("name", "base_name", "is_default_qos", "is_default_participant_factory_profile")
_ENTITY_ATTRIBUTES = ("name", "base_name", "topic_filter")


def _listed(names: list[str]) -> str:
    return ", ".join(f"<{name}>" for name in names)
