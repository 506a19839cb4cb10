"""The profiles that are built into RTI Connext, as far as their names say policies of DDS.

Files for Connext build on them by name (``BuiltinQosLib::Generic.StrictReliable``), and no file holds them.  What else
they tune is the inside of that product, or not known here: such a profile is refused unless a file defines it.
"""

from __future__ import annotations

import re

from ddsi.structure import qos_policies as p

from .qos_profile_reader import EntityProfile, Profile, Setting

__all__ = ["builtin_profile"]

_RELIABLE: dict[str, object] = {"reliability.kind": p.Reliable}
_KEEP_LAST: dict[str, object] = {"history.kind": p.KeepLast, "history.depth": 1}
_DURABILITY = {
    "TransientLocal": p.TransientLocal,
    "Transient": p.Transient,
    "Persistent": p.Persistent,
}
_MEANINGS: dict[str, dict[str, object]] = {
    "Generic.Common": {},
    "Generic.Monitoring.Common": {},
    "Generic.Monitoring2": {},
    "Generic.BestEffort": {"reliability.kind": p.BestEffort},
    "QosPolicy.Reliability.BestEffort": {"reliability.kind": p.BestEffort},
    "QosPolicy.Reliability.Reliable": _RELIABLE,
    "QosPolicy.History.KeepAll": {"history.kind": p.KeepAll},
    "QosPolicy.History.KeepLast_1": _KEEP_LAST,
    **{
        f"QosPolicy.Durability.{name}": {"durability.kind": kind}
        for name, kind in _DURABILITY.items()
    },
    **{
        f"Generic.StrictReliable{variant}": {**_RELIABLE, "history.kind": p.KeepAll}
        for variant in (
            "", ".HighThroughput", ".LowLatency", ".LargeData", ".LargeData.FastFlow", ".LargeData.MediumFlow",
            ".LargeData.SlowFlow",
        )
    },
    **{
        f"Generic.KeepLastReliable{variant}": {**_RELIABLE, **_KEEP_LAST}
        for variant in ("", ".LargeData", ".LargeData.FastFlow", ".LargeData.MediumFlow", ".LargeData.SlowFlow")
    },
    **{
        f"Generic.KeepLastReliable.{name}": {**_RELIABLE, **_KEEP_LAST, "durability.kind": kind}
        for name, kind in _DURABILITY.items()
    },
}  # fmt: skip


def builtin_profile(name: str) -> Profile | None:
    """The profile of this full name; None if there is none, or its meaning is not known."""
    found = re.fullmatch(r"BuiltinQos(?:Lib|LibExp|SnippetLib)::(.*)", name)
    meaning = _MEANINGS.get(found[1]) if found is not None else None
    if meaning is None:
        return None
    place = f"{name}, which is built into RTI Connext"
    settings = {setting: Setting(value, place, "a kind") for setting, value in meaning.items()}
    parts = [EntityProfile(entity, place, settings=dict(settings)) for entity in ("writer", "reader")]
    return Profile(name, place, entities=parts)
