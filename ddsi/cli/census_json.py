"""The census as JSON: the documented, stable structure of ``ddsi ls --json`` (docs/cli.md).

Members are added over time, never removed or changed in meaning.
"""

from __future__ import annotations

import math
from collections.abc import Mapping

from ..structure.locator import Locator
from ..structure.qos_policies import Property
from .census import Census, SeenEndpoint, SeenParticipant
from .qos_words import qos_json

__all__ = ["census_json", "participant_json", "seconds_json", "topics_json"]


def census_json(census: Census, drop_counts: Mapping[str, int] | None = None) -> dict[str, object]:
    """The whole of it; ``stats`` only where drop counters are given."""
    form: dict[str, object] = {
        "domain_id": census.domain_id,
        "participants": [participant_json(participant, census.domain_id) for participant in census.participants],
        "topics": topics_json(census),
        "complete": census.is_complete,
        "left_out": census.left_out,
    }
    if drop_counts is not None:
        form["stats"] = {"dropped": dict(sorted(drop_counts.items()))}
    return form


def participant_json(participant: SeenParticipant, domain_id: int) -> dict[str, object]:
    data = participant.data
    return {
        "guid": str(data.guid),
        "prefix": str(participant.prefix),
        "vendor": participant.vendor,
        "vendor_id": bytes(data.vendor_id).hex(),
        "protocol_version": ".".join(map(str, data.protocol_version)),
        # Some vendors do not announce it; it is the one that they were found in.
        "domain_id": domain_id if data.domain_id is None else data.domain_id,
        "domain_tag": data.domain_tag,
        "entity_name": data.entity_name,
        "host": participant.host,
        "process": participant.process,
        "pid": int(participant.pid) if participant.pid.isdecimal() and len(participant.pid) < 19 else None,
        "lease": seconds_json(data.lease_duration),
        "secured": participant.is_secured,
        "locators": {
            "metatraffic_unicast": _locators(data.metatraffic_unicast),
            "metatraffic_multicast": _locators(data.metatraffic_multicast),
            "default_unicast": _locators(data.default_unicast),
            "default_multicast": _locators(data.default_multicast),
        },
        "user_data": data.user_data.hex(),
        "properties": {
            name: value.value if isinstance(value, Property) else value.value.hex() for name, value in data.properties
        },
        "endpoints": [_endpoint_json(endpoint) for endpoint in participant.endpoints],
    }


def _endpoint_json(endpoint: SeenEndpoint) -> dict[str, object]:
    data = endpoint.data
    return {
        "guid": str(data.guid),
        "kind": endpoint.kind,
        "topic": data.topic_name,
        "type": data.type_name,
        "keyed": data.is_keyed,
        "qos": qos_json(data.qos),
        "locators": {"unicast": _locators(data.unicast), "multicast": _locators(data.multicast)},
        "matched": [str(guid) for guid in endpoint.matches],
    }


def topics_json(census: Census) -> list[dict[str, object]]:
    """One object for each topic, by name; ``types`` has more than one where participants disagree."""
    topics: dict[str, dict[str, list[str]]] = {}
    for _, endpoint in census.endpoints():
        entry = topics.setdefault(endpoint.data.topic_name, {"types": [], "writers": [], "readers": []})
        entry[f"{endpoint.kind}s"].append(str(endpoint.data.guid))
        if endpoint.data.type_name not in entry["types"]:
            entry["types"].append(endpoint.data.type_name)
    return [{"topic": name, **topics[name]} for name in sorted(topics)]


def seconds_json(seconds: float) -> float | str:
    """JSON has no infinity."""
    return "infinite" if math.isinf(seconds) else seconds


def _locators(locators: tuple[Locator, ...]) -> list[str]:
    return [str(locator) for locator in locators]
