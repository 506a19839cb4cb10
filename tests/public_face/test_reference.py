"""docs/api.md names the whole public face: names, members, settings, and each policy as it is written."""

from __future__ import annotations

import inspect
import math
import re
from dataclasses import fields, is_dataclass
from pathlib import Path
from typing import Any

import pytest

import ddsi
from ddsi import idl
from ddsi.structure import qos_policies

PAGE = (Path(__file__).parents[2] / "docs" / "api.md").read_text(encoding="utf-8")
CODE = " ".join([*re.findall(r"^```python\n(.*?)^```", PAGE, re.M | re.S), *re.findall(r"`([^`\n]+)`", PAGE)])
WORDS = set(re.findall(r"\w+", CODE))
ENTITIES = (
    ddsi.Entity, ddsi.DomainParticipant, ddsi.Publisher, ddsi.Subscriber, ddsi.DataWriter, ddsi.DataReader, ddsi.Topic,
)  # fmt: skip
# Of use to the rest of the package, not to applications.
INSIDE = {"STATUSES", "abandon", "endpoint_defaults", "participant", "type_support"}


def public(of: type) -> set[str]:
    return {name for name in dir(of) if not name.startswith("_")}


def test_every_name_is_there() -> None:
    assert set(ddsi.__all__) - WORDS == set()


def test_every_name_of_idl_is_there_with_its_module() -> None:
    assert {f"idl.{name}" for name in idl.__all__} - set(re.findall(r"\bidl\.\w+", CODE)) == set()
    assert set(re.findall(r"\bidl\.(\w+)", CODE)) - set(idl.__all__) <= {"md"}


@pytest.mark.parametrize("entity", ENTITIES)
def test_every_member_of_entities_is_there(entity: type) -> None:
    assert public(entity) - WORDS - INSIDE == set()


def test_what_it_says_of_ddsi_exists() -> None:
    assert {name for name in re.findall(r"\bddsi\.(\w+)", CODE) if not hasattr(ddsi, name)} == set()


@pytest.mark.parametrize("of", [ddsi.Qos, ddsi.Config, ddsi.SampleInfo])
def test_every_policy_setting_and_field_is_there(of: type) -> None:
    named = (
        {field.name for field in fields(of)} if is_dataclass(of) else public(of) - {"arrival", "change", "source_ticks"}
    )
    assert named - WORDS == set()


STATUSES = [
    status
    for name in ddsi.__all__
    if inspect.isclass(status := getattr(ddsi, name))
    and status.__module__ == ddsi.SampleLost.__module__
    and is_dataclass(status)
]


@pytest.mark.parametrize("status", STATUSES)
def test_every_status_is_there_with_its_fields(status: Any) -> None:
    """The changes besides the totals need no mention."""
    assert {field.name for field in fields(status) if not field.name.endswith("_change")} - WORDS == set()


POLICIES = [
    policy
    for name in ddsi.__all__
    if inspect.isclass(policy := getattr(ddsi, name))
    and policy.__module__ == qos_policies.__name__
    and not issubclass(policy, int)
]


@pytest.mark.parametrize("policy", POLICIES)
def test_every_policy_is_written_with_its_defaults(policy: type) -> None:
    assert f"{policy.__name__}({', '.join(map(_shown, inspect.signature(policy).parameters.values()))})" in CODE


def _shown(parameter: inspect.Parameter) -> str:
    if parameter.kind is inspect.Parameter.VAR_POSITIONAL:
        return f"*{parameter.name}"
    if parameter.default is inspect.Parameter.empty:
        return parameter.name
    value = parameter.default
    if isinstance(value, ddsi.AccessScope):
        return f"{parameter.name}=AccessScope.{value.name}"
    return f"{parameter.name}={'math.inf' if value == math.inf else repr(value)}"
