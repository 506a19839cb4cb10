"""Security that is asked for is had or refused; it is never left out in silence."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import pytest

from ddsi.spi import PLAINTEXT, SPI_VERSION, load_hooks
from ddsi.spi.loader import ENTRY_POINT_GROUP
from ddsi.structure.errors import ConfigurationError

SECURED = {"dds.sec.auth.identity_ca": "file:ca.pem"}


class Provider:
    """Stands for an installed entry point of the group."""

    group = ENTRY_POINT_GROUP

    def __init__(self, load: Callable[[], Any], name: str = "builtin") -> None:
        self.name = name
        self.value = f"somewhere:{name}"
        self.load = load


def entropy(octets: int) -> bytes:
    return bytes(octets)


def wall_clock() -> int:
    return 0


def load(properties: dict[str, str], *providers: Any) -> Any:
    return load_hooks(properties, entropy=entropy, wall_clock=wall_clock, providers=providers)


def test_without_security_properties_everything_is_plain() -> None:
    assert load({"some.other": "property"}) is PLAINTEXT


def test_security_without_a_provider_is_refused_with_the_remedy() -> None:
    with pytest.raises(ConfigurationError, match=r"pip install 'ddsi\[security\]'"):
        load(SECURED)


def test_two_providers_are_refused_by_name() -> None:
    with pytest.raises(ConfigurationError, match=r"one.*two"):
        load(SECURED, Provider(object, "one"), Provider(object, "two"))


def test_a_provider_for_another_seam_is_refused() -> None:
    class Old:
        spi_version = SPI_VERSION + 1

    with pytest.raises(ConfigurationError, match=f"this is {SPI_VERSION}"):
        load(SECURED, Provider(Old))


def test_a_provider_that_cannot_be_imported_is_refused() -> None:
    def missing() -> Any:
        raise ImportError("no module named 'cryptography'")

    with pytest.raises(ConfigurationError, match="cryptography"):
        load(SECURED, Provider(missing))


def test_the_provider_gets_properties_entropy_and_clock() -> None:
    given: dict[str, Any] = {}

    def factory(properties: Any, **sources: Any) -> Any:
        given.update(sources, properties=properties)
        return PLAINTEXT

    factory.spi_version = SPI_VERSION  # type: ignore[attr-defined]
    assert load(SECURED, Provider(lambda: factory)) is PLAINTEXT
    assert given == {"properties": SECURED, "entropy": entropy, "wall_clock": wall_clock}
