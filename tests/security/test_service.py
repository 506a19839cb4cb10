"""The entry point that the core finds: until the plugins are there, it refuses, and never runs unprotected."""

from __future__ import annotations

import pytest

from ddsi.spi import PLAINTEXT, SPI_VERSION, load_hooks
from ddsi.structure.errors import ConfigurationError
from ddsi.structure.qos_policies import Properties, Property
from ddsi_security import service


def _load(properties: Properties) -> object:
    return load_hooks(properties, entropy=bytes, wall_clock=lambda: 0)


@pytest.mark.parametrize(
    "properties",
    [
        {"dds.sec.auth.identity_ca": "file:ca.pem"},
        {"dds.sec.crypto.plugin": ""},
        {"other": "x", "dds.sec.auth.password": Property("hunter2"), "dds.sec.access.governance": "data:,x"},
    ],
)
def test_asking_for_security_is_refused_in_one_sentence(properties: Properties) -> None:
    with pytest.raises(ConfigurationError) as refusal:
        _load(properties)
    message = str(refusal.value)
    assert all(name in message for name in properties if name.startswith("dds.sec."))
    assert "come with a later release" in message
    assert "remove all dds.sec.* properties" in message
    assert "hunter2" not in message
    assert "\n" not in message


def test_without_such_properties_nobody_asks_it() -> None:
    assert _load({"application.name": "x"}) is PLAINTEXT


def test_it_is_made_for_this_version_of_the_seam() -> None:
    assert service.load.spi_version == SPI_VERSION
