"""QosProvider: the QoS of entities, taken from profile files.  OMG DDS-XML 1.0 §7.3.2 (QoS building block).

A profile says something of each kind of entity, and may build on other profiles; so may an entity's part of it, on the
same part of another.  What is said closer to the name asked for wins, member by member.  Files are read and checked
whole when the provider is made, so that a mistake shows at once and not when its entity is first needed.
"""

from __future__ import annotations

import fnmatch
import os
from collections.abc import Callable, Iterable, Mapping
from typing import TYPE_CHECKING, Any

from ddsi.structure import qos_policies as p
from ddsi.structure.errors import BadParameter, ConfigurationError
from ddsi.structure.qos import Qos

if TYPE_CHECKING:
    from .qos_profile_reader import EntityProfile, Profile, Setting

__all__ = ["QosProvider"]

# Far beyond any real file; what builds on what can grow with the square of a file's size.
_MOST_LEVELS = 32
_MOST_PROFILES = 1000
_MOST_SETTINGS = 1000
ENTITIES = ("participant", "publisher", "subscriber", "topic", "writer", "reader")
Settings = dict[str, "Setting"]


class QosProvider:
    """``QosProvider("a.xml", "b.xml").writer("Library::Profile", topic="Square")`` and its like."""

    def __init__(self, *files: str | os.PathLike[str]) -> None:
        """Reads the files.  Raises ConfigurationError with file and line, and BadParameter when there is no file."""
        if not files:
            raise BadParameter("a QosProvider needs the name of at least one file of QoS profiles")
        self._profiles: dict[str, Profile] = {}
        from .qos_profile_reader import read_profiles  # reading XML costs start-up time that few programs need to pay

        skipped: list[str] = []
        for file in files:
            profiles, skipped_here = read_profiles(file)
            skipped += skipped_here
            for profile in profiles:
                self._add(profile)
        self._skipped = tuple(skipped)
        self._check()

    def __repr__(self) -> str:
        return f"<QosProvider of {', '.join(self._profiles) or 'no profile'}>"

    @property
    def profiles(self) -> tuple[str, ...]:
        """The names of the profiles, in the order of the files."""
        return tuple(self._profiles)

    @property
    def skipped(self) -> tuple[str, ...]:
        """What was read over, each with its file and line: known elements of other products without a meaning here."""
        return self._skipped

    def participant(self, profile: str | None = None) -> Qos:
        """The Qos of a DomainParticipant, security properties included.

        ``profile``: ``Library::Profile``, or the profile's name alone where it is the only one of that name; None: the
        one that says of itself that it is the default.  Raises BadParameter when there is no such profile.
        """
        return self._qos(profile, "participant", None)

    def publisher(self, profile: str | None = None) -> Qos:
        """The Qos of a Publisher: see :meth:`participant`."""
        return self._qos(profile, "publisher", None)

    def subscriber(self, profile: str | None = None) -> Qos:
        """The Qos of a Subscriber: see :meth:`participant`."""
        return self._qos(profile, "subscriber", None)

    def topic(self, profile: str | None = None, *, topic: str | None = None) -> Qos:
        """The Qos of a Topic of the name ``topic``: see :meth:`writer`."""
        return self._qos(profile, "topic", topic)

    def writer(self, profile: str | None = None, *, topic: str | None = None) -> Qos:
        """The Qos of a DataWriter: see :meth:`participant`.

        ``topic``: its topic's name.  Of a profile's several ``<datawriter_qos>`` the first counts whose topic_filter
        fits, else the one without; where no topic is given, the one without.
        """
        return self._qos(profile, "writer", topic)

    def reader(self, profile: str | None = None, *, topic: str | None = None) -> Qos:
        """The Qos of a DataReader: see :meth:`writer`."""
        return self._qos(profile, "reader", topic)

    # --- finding -----------------------------------------------------------------------------------------

    def _qos(self, name: str | None, entity: str, topic: str | None) -> Qos:
        profile = self._default(entity) if name is None else self._find(name)
        return _built(entity, _Resolution(self, entity, topic).settings(profile))

    def _find(self, name: str) -> Profile:
        if not isinstance(name, str):
            raise BadParameter(f"the name of a QoS profile is a str, as 'Library::Profile', not {name!r}")
        found = self._lookup(name, "")
        if found is None:
            raise BadParameter(f"QoS profile {name!r} was asked for, {self._why_unknown(name)}")
        return found

    def _lookup(self, name: str, library: str) -> Profile | None:
        """By its full name; by its own within ``library``; by its own where only one has it; a builtin one."""
        if found := self._profiles.get(name) or self._profiles.get(f"{library}::{name}"):
            return found
        alike = [profile for full, profile in self._profiles.items() if full.rpartition("::")[2] == name]
        if len(alike) == 1:
            return alike[0]
        from .rti_builtin_profiles import builtin_profile  # files for one product name them

        return builtin_profile(name)

    def _default(self, entity: str) -> Profile:
        for profile in self._profiles.values():
            if entity in profile.defaults_for:
                return profile
        raise BadParameter(f"no QoS profile is the default for a {entity}: name one; {self._there_are()}")

    def _why_unknown(self, name: str) -> str:
        if name.startswith("BuiltinQos"):
            return "which is built into RTI Connext, and not known here; define a profile of this name in a file"
        return f"which is in no file; {self._there_are()}"

    def _there_are(self) -> str:
        return f"there are {', '.join(self._profiles)}" if self._profiles else "the files hold none"

    # --- checking ----------------------------------------------------------------------------------------

    def _add(self, profile: Profile) -> None:
        known = self._profiles.get(profile.name)
        if known is None:
            self._profiles[profile.name] = profile
            return
        raise ConfigurationError(
            f"{profile.place}: there is a profile {profile.name!r} already, at {known.place}; rename one of them"
        )

    def _check(self) -> None:
        if len(self._profiles) > _MOST_PROFILES:
            raise ConfigurationError(f"QoS profiles: {len(self._profiles)} are more than {_MOST_PROFILES}")
        for entity in ENTITIES:
            resolution = _Resolution(self, entity, None)
            for profile in self._profiles.values():
                _built(entity, resolution.settings(profile))
                for part in profile.entities:
                    if part.entity == entity:
                        _built(entity, part.settings)


class _Resolution:
    """What profiles say of one kind of entity, and of one topic, together with all that they build on."""

    def __init__(self, provider: QosProvider, entity: str, topic: str | None) -> None:
        self._provider = provider
        self._entity = entity
        self._topic = topic
        self._known: dict[str, tuple[Settings, int]] = {}  # and how many levels are below

    def settings(self, profile: Profile) -> Settings:
        return self._resolve(profile, ())[0]

    def _resolve(self, profile: Profile, above: tuple[str, ...]) -> tuple[Settings, int]:
        """``above``: the profiles that build on this one, each on the next, for whom it is asked."""
        if profile.name in self._known:
            return self._known[profile.name]
        if profile.name in above:
            circle = " on ".join([*above[above.index(profile.name) :], profile.name])
            raise ConfigurationError(f"{profile.place}: profiles build on each other in a circle: {circle}")
        settings: Settings = {}
        depth = 0
        part = _part(profile, self._entity, self._topic)
        for base in (*profile.bases, *(part.bases if part is not None else ())):
            found = self._provider._lookup(base, profile.library)
            if found is None:
                raise ConfigurationError(f"{profile.place} builds on {base!r}, {self._provider._why_unknown(base)}")
            if len(above) < _MOST_LEVELS:
                below, levels = self._resolve(found, (*above, profile.name))
                settings.update(below)
                depth = max(depth, levels + 1)
            if len(above) >= _MOST_LEVELS or depth >= _MOST_LEVELS:
                raise ConfigurationError(f"{profile.place}: profiles build on each other more than {_MOST_LEVELS} deep")
        if part is not None:
            settings.update(part.settings)
        if len(settings) > _MOST_SETTINGS:
            raise ConfigurationError(f"{profile.place} sets {len(settings)} things, more than {_MOST_SETTINGS}")
        self._known[profile.name] = settings, depth
        return settings, depth


def _part(profile: Profile, entity: str, topic: str | None) -> EntityProfile | None:
    parts = [part for part in profile.entities if part.entity == entity]
    if topic is not None:
        for part in parts:
            if any(fnmatch.fnmatchcase(topic, pattern) for pattern in part.topic_filters):
                return part
    return next((part for part in parts if not part.topic_filters), None)


# --- settings into policies ------------------------------------------------------------------------------------


def _built(entity: str, settings: Mapping[str, Setting]) -> Qos:
    """Raises ConfigurationError, at the place of a setting, when a policy cannot be meant."""
    by_policy: dict[str, dict[str, Setting]] = {}
    properties: dict[str, str | p.Property | p.BinaryProperty] = {}
    for name, setting in settings.items():
        policy, _, member = name.partition(".")
        if name.startswith("property "):
            assert isinstance(setting.value, (p.Property, p.BinaryProperty))
            properties[name.removeprefix("property ")] = setting.value
        else:
            by_policy.setdefault(policy, {})[member] = setting
    policies: dict[str, Any] = {}
    for policy, members in by_policy.items():
        try:
            policies[policy] = _MAKERS[policy](entity, {name: setting.value for name, setting in members.items()})
        except BadParameter as error:
            last = list(members.values())[-1]
            raise ConfigurationError(f"{last.place} is {last.shown}, which cannot be: {error}") from error
    return Qos(properties=properties, **policies)


Members = dict[str, Any]


def _reliability(entity: str, members: Members) -> object:
    """Where the kind is not said it is the OMG's default, which is reliable for writers alone."""
    kind = members.pop("kind", p.Reliable if entity == "writer" else p.BestEffort)
    return kind(**members)


def _history(_entity: str, members: Members) -> object:
    kind = members.pop("kind", p.KeepLast)
    return kind(**members) if kind is p.KeepLast else kind()


def _durability_service(_entity: str, members: Members) -> object:
    kind, depth = members.pop("history_kind", p.KeepLast), members.pop("history_depth", 1)
    return p.DurabilityService(history=p.KeepAll() if kind is p.KeepAll else p.KeepLast(depth), **members)


def _liveliness(_entity: str, members: Members) -> object:
    return members.pop("kind", p.Automatic)(**members)


def _of_kind(_entity: str, members: Members) -> object:
    return members["kind"]()


def _plain(policy: Callable[..., object]) -> Callable[[str, Members], object]:
    return lambda _entity, members: policy(**members)


def _sequence(policy: Callable[..., object], member: str) -> Callable[[str, Members], object]:
    def make(_entity: str, members: Members) -> object:
        items: Iterable[object] = members[member]
        return policy(*items)

    return make


_MAKERS: dict[str, Callable[[str, Members], object]] = {
    "reliability": _reliability,
    "durability": _of_kind,
    "history": _history,
    "resource_limits": _plain(p.ResourceLimits),
    "durability_service": _durability_service,
    "deadline": _plain(p.Deadline),
    "latency_budget": _plain(p.LatencyBudget),
    "lifespan": _plain(p.Lifespan),
    "time_based_filter": _plain(p.TimeBasedFilter),
    "liveliness": _liveliness,
    "ownership": _of_kind,
    "ownership_strength": _plain(p.OwnershipStrength),
    "destination_order": _of_kind,
    "presentation": _plain(p.Presentation),
    "partition": _sequence(p.Partition, "name"),
    "user_data": _plain(p.UserData),
    "topic_data": _plain(p.TopicData),
    "group_data": _plain(p.GroupData),
    "data_tags": _sequence(p.DataTags, "tags"),
    "transport_priority": _plain(p.TransportPriority),
    "entity_factory": _plain(p.EntityFactory),
    "writer_data_lifecycle": _plain(p.WriterDataLifecycle),
    "reader_data_lifecycle": _plain(p.ReaderDataLifecycle),
    "data_representation": _sequence(p.DataRepresentation, "value"),
    "type_consistency": _plain(p.TypeConsistency),
    "entity_name": lambda _entity, members: members["name"],
}
