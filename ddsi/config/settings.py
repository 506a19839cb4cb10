"""From the elements in a ``<Domain>`` to a ``Config``: values are read and put together, each with its place."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any, TypeVar

from ddsi.structure.errors import ConfigurationError

from .config import Config, TraceLevel
from .meanings import FIELDS, LARGEST_WINS, MULTICAST, REFUSED, SECURITY, VERBOSITIES, has_effect, parse_text
from .ports import PortMapping
from .refusal import RefusedSetting
from .units import parse_boolean
from .variables import expand_variables
from .vocabulary import DOMAIN, Word
from .xml_document import Element

__all__ = ["Settings"]

_T = TypeVar("_T")
_PASSWORD = SECURITY["Security/Authentication/Password"]
_DEFAULT_TRACE_FILE = "ddsi-trace.jsonl"


@dataclass
class Settings:
    """What has been read so far, for one domain.  Later elements override earlier ones; interfaces and peers add up."""

    variables: Mapping[str, str]
    warnings: list[str] = field(default_factory=list)
    values: dict[str, Any] = field(default_factory=dict)
    """By field of Config.  Any: they are as yet unchecked, which Config does."""
    places: dict[str, str] = field(default_factory=dict)
    """Where each of them was read."""
    interfaces: dict[str, bool | None] = field(default_factory=dict)
    """By name or address: may it multicast?  None: it does not say."""
    peers: list[str] = field(default_factory=list)
    trace_level: TraceLevel | None = None
    security: dict[str, str] = field(default_factory=dict, repr=False)
    """By property."""

    def read(self, domain: Element, source: str) -> None:
        """Take over all that stands in this ``<Domain>``; its names must be known to be right."""
        _DomainReader(self, source).children(domain, DOMAIN)

    def to_config(self) -> Config:
        """All together.  Raises ConfigurationError, naming the element and its line where there is one."""
        values = dict(self.values)
        ports = {name.removeprefix("ports."): values.pop(name) for name in list(values) if name.startswith("ports.")}
        values["interfaces"] = tuple(self.interfaces)
        values["peers"] = tuple(dict.fromkeys(self.peers))
        values["security"] = tuple(self.security.items())
        if values.get("multicast") is None:
            values["multicast"] = self._multicast_of_interfaces()
        self._settle_tracing(values)
        if "max_defrag_octets" not in values:
            # Whoever only raises the size of samples wants such samples to arrive.
            values["max_defrag_octets"] = max(values.get("max_sample_size", 0), Config().max_defrag_octets)
        try:
            return Config(**values, ports=PortMapping(**ports), config_warnings=tuple(dict.fromkeys(self.warnings)))
        except RefusedSetting as error:
            place = self.places.get(error.name)
            raise (error.at(place) if place else error) from None

    def _multicast_of_interfaces(self) -> bool | None:
        said = set(self.interfaces.values())
        if {True, False} <= said:
            raise ConfigurationError(
                f"{self.places['interfaces']}: interfaces with and without multicast cannot be mixed; give all of them "
                "the same, or leave the attribute out and set <General/AllowMulticast>"
            )
        return said.pop() if len(said) == 1 else None

    def _settle_tracing(self, values: dict[str, Any]) -> None:
        """The file alone switches nothing on, the verbosity does; as in Cyclone, it has a default file."""
        if self.trace_level is None:
            values.pop("trace_file", None)
        else:
            values["trace_level"] = self.trace_level
            values.setdefault("trace_file", _DEFAULT_TRACE_FILE)


class _DomainReader:
    """Walks the elements of one document."""

    def __init__(self, settings: Settings, source: str) -> None:
        self._settings = settings
        self._source = source

    def children(self, element: Element, word: Word) -> None:
        for child in element.children:
            child_word = word.child(child.name)
            assert child_word is not None, "names are checked before values are read"
            self._element(child, child_word)

    def _element(self, element: Element, word: Word) -> None:
        match word.path:
            case "Id":
                pass
            case "General/Interfaces/NetworkInterface":
                self._interface(element, word)
            case "General/NetworkInterfaceAddress":
                self._interface_addresses(element, word)
            case "General/AllowMulticast":
                self._note("multicast", self._multicast(element.text, self._place(element, word)), element, word)
            case "Discovery/Peers":
                self._peers(element, word)
            case "Discovery/Peers/Peer" | "Discovery/Peers/Group/Peer":
                self._peer(element, word)
            case "Tracing/Verbosity":
                self._verbosity(element, word)
            case "Security":
                self._security(element, word)
            case path if path in SECURITY:
                self._security_property(element, word)
            case path if not has_effect(path):
                self._settings.warnings.append(f"{self._place(element, word)} has no effect in ddsi")
            case _:
                self._plain(element, word)

    def _plain(self, element: Element, word: Word) -> None:
        """An element that sets a field itself, by its attributes, or by what stands in it."""
        for name, text in element.attributes.items():
            self._value(element, word, text, attribute=name)
        if word.children:
            self.children(element, word)
        elif element.text or not element.attributes:
            self._value(element, word, element.text)

    def _value(self, element: Element, word: Word, text: str, *, attribute: str = "") -> None:
        path = f"{word.path}@{word.attributes[attribute.lower()]}" if attribute else word.path
        place = self._place(element, word, attribute)
        text = self._expand(text, place)
        if path in REFUSED:
            harmless, objection = REFUSED[path]
            if text not in harmless:
                raise ConfigurationError(f"{place} is {text!r}: {objection}; remove it")
        elif path not in FIELDS:
            self._settings.warnings.append(f"{place} has no effect in ddsi")
        else:
            name, reader = FIELDS[path]
            if text != "default" or reader is parse_text:
                self._note(name, _read(reader, text, place), element, word, attribute)

    # --- those that say something only together ---

    def _interface(self, element: Element, word: Word) -> None:
        place = self._place(element, word)
        given = {name.lower(): self._expand(text, place) for name, text in element.attributes.items()}
        for name in given.keys() - {"name", "address", "autodetermine", "multicast", "allow_multicast"}:
            self._settings.warnings.append(f"{self._place(element, word, name)} has no effect in ddsi")
        interface = given.get("address") or given.get("name")
        if _read(parse_boolean, given.get("autodetermine", "false"), place):
            if interface:
                raise ConfigurationError(f"{place}: with autodetermine there must be neither name nor address")
            return
        if not interface:
            raise ConfigurationError(f'{place} needs a name, an address, or autodetermine="true"')
        if given.get("address") and given.get("name"):
            self._settings.warnings.append(
                f"{place}: the address is used; that it is the named interface's is not checked"
            )
        # The one says what the interface can, the other what it may: a no of either is a no.
        said = [self._multicast(given.get(name, "default"), place) for name in ("multicast", "allow_multicast")]
        self._settings.interfaces[interface] = False if False in said else (True if True in said else None)
        self._settings.places.setdefault("interfaces", place)

    def _interface_addresses(self, element: Element, word: Word) -> None:
        """The older form: names and addresses between commas, ``auto`` for any."""
        for interface in self._expand(element.text, self._place(element, word)).split(","):
            if interface.strip() not in ("", "auto"):
                self._settings.interfaces.setdefault(interface.strip(), None)
        self._settings.places.setdefault("interfaces", self._place(element, word))

    def _multicast(self, text: str, place: str) -> bool | None:
        """From a list between commas; ``false`` and ``default`` stand alone."""
        words = [word.strip().lower() for word in self._expand(text, place).split(",")]
        if any(word not in MULTICAST for word in words) or (len(words) > 1 and {"false", "default"} & set(words)):
            raise ConfigurationError(f"{place} is {text!r}; it must be true, false, default, or some of spdp, asm, ssm")
        return MULTICAST[words[0]]

    def _peers(self, element: Element, word: Word) -> None:
        for text in element.attributes.values():  # there is but one
            place = self._place(element, word, "AddLocalhost")
            text = self._expand(text, place)
            if text != "default" and _read(parse_boolean, text, place):
                self._settings.peers.append("127.0.0.1")
        self.children(element, word)

    def _peer(self, element: Element, word: Word) -> None:
        place = self._place(element, word)
        for name, text in element.attributes.items():
            if name.lower() == "address":
                # Cyclone also takes the form in which it prints its locators.
                self._settings.peers.append(self._expand(text, place).removeprefix("udp/"))
                self._settings.places["peers"] = place
            else:
                self._settings.warnings.append(f"{self._place(element, word, name)} has no effect in ddsi")
        if "address" not in {name.lower() for name in element.attributes}:
            raise ConfigurationError(f'{place} needs an Address, such as <Peer Address="192.168.1.7"/>')

    def _verbosity(self, element: Element, word: Word) -> None:
        place = self._place(element, word)
        text = self._expand(element.text, place).lower()
        if text not in VERBOSITIES:
            raise ConfigurationError(f"{place} is {text!r}; it must be one of {', '.join(VERBOSITIES)}")
        self._settings.trace_level = VERBOSITIES[text]

    def _security(self, element: Element, word: Word) -> None:
        self.children(element, word)
        if not self._settings.security:
            raise ConfigurationError(
                f"{self._place(element, word)} names no certificate, key or document, so nothing would be protected: "
                "fill it, or remove it to run unprotected"
            )

    def _security_property(self, element: Element, word: Word) -> None:
        name, place = SECURITY[word.path], self._place(element, word)
        text = self._expand_secret(element.text, place) if name == _PASSWORD else self._expand(element.text, place)
        if name and text:
            self._settings.security[name] = text

    def _expand_secret(self, text: str, place: str) -> str:
        """A ``${`` may be part of a password, and not meant as a variable: nothing of it is shown."""

        def on_unset(_name: str) -> None:
            self._settings.warnings.append(f"{place}: an environment variable in it is not set and reads as empty")

        try:
            return expand_variables(text, self._settings.variables, on_unset).strip()
        except ValueError:
            raise ConfigurationError(
                f"{place} holds ${{, and no environment variable that can be read follows: give a password that holds "
                "these characters by a variable, ${NAME}"
            ) from None

    # --- values and places ---

    def _note(self, name: str, value: Any, element: Element, word: Word, attribute: str = "") -> None:
        if name in LARGEST_WINS:
            value = max(value, self._settings.values.get(name, 0))
        self._settings.values[name] = value
        self._settings.places[name] = self._place(element, word, attribute)

    def _place(self, element: Element, word: Word, attribute: str = "") -> str:
        name = f" {word.attributes[attribute.lower()]}" if attribute else ""
        return f"{self._source}, line {element.line}: <{word.path}>{name}"

    def _expand(self, text: str, place: str) -> str:
        def on_unset(name: str) -> None:
            self._settings.warnings.append(f"{place}: the environment variable {name} is not set and reads as empty")

        try:
            return expand_variables(text, self._settings.variables, on_unset).strip()
        except ValueError as error:
            raise ConfigurationError(f"{place}: {error}") from None


def _read(reader: Callable[[str], _T], text: str, place: str) -> _T:
    try:
        return reader(text)
    except ValueError as error:
        raise ConfigurationError(f"{place} is {text!r}; it must be {error}") from None
