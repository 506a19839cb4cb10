"""Which hooks a participant gets: plain text when nothing asks for security, else what the one provider makes."""

from __future__ import annotations

from collections.abc import Callable
from importlib.metadata import EntryPoint

import pytest

from ddsi.spi import PLAINTEXT, SecurityHooks, load_hooks
from ddsi.spi.loader import ENTRY_POINT_GROUP, SPI_VERSION
from ddsi.structure.errors import ConfigurationError
from ddsi.structure.qos_policies import Properties

SECURE: Properties = {"dds.sec.auth.identity_ca": "file:ca.pem"}


def entropy(count: int) -> bytes:
    return bytes(count)


def wall_clock() -> int:
    return 0


def load(properties: Properties, *providers: EntryPoint) -> SecurityHooks:
    return load_hooks(properties, entropy=entropy, wall_clock=wall_clock, providers=providers)


def provider(name: str, value: str = "tests.spi.test_loader:make") -> EntryPoint:
    return EntryPoint(name, value, ENTRY_POINT_GROUP)


seen: list[tuple[Properties, Callable[[int], bytes], Callable[[], int]]] = []


class _Factory:
    spi_version = SPI_VERSION

    def __call__(
        self, properties: Properties, *, entropy: Callable[[int], bytes], wall_clock: Callable[[], int]
    ) -> SecurityHooks:
        seen.append((properties, entropy, wall_clock))
        return PLAINTEXT


class _OldFactory(_Factory):
    spi_version = SPI_VERSION - 1


make = _Factory()
make_old = _OldFactory()


@pytest.mark.parametrize("properties", [{}, {"dds.discovery": "x"}, {"sec.auth": "x"}])
def test_without_security_properties_nothing_is_loaded(properties: Properties) -> None:
    assert load(properties, provider("broken", "no.such.module:thing")) is PLAINTEXT


def test_the_provider_is_given_properties_entropy_and_clock() -> None:
    """Nothing ambient: simulation gives both from a seed."""
    seen.clear()
    assert load(SECURE, provider("ours")) is PLAINTEXT
    assert seen == [(SECURE, entropy, wall_clock)]


@pytest.mark.parametrize(
    ("providers", "remedy"),
    [
        ((), "pip install 'ddsi[security]'"),
        ((provider("one"), provider("other")), "keep one of them: one (tests.spi.test_loader:make), other"),
        ((provider("gone", "no.such.module:thing"),), "cannot be imported"),
        ((provider("old", "tests.spi.test_loader:make_old"),), f"made for version {SPI_VERSION - 1} of the seam"),
    ],
)
def test_security_that_cannot_be_had_is_an_error_with_its_remedy(
    providers: tuple[EntryPoint, ...], remedy: str
) -> None:
    """It never falls back to plain text: that would be the opposite of what was asked for."""
    with pytest.raises(ConfigurationError) as raised:
        load(SECURE, *providers)
    assert remedy in str(raised.value)


def test_the_installed_provider_is_found_by_its_entry_point() -> None:
    """Ours is registered by the package's metadata; the core does not know its name."""
    from importlib.metadata import entry_points

    installed = entry_points(group=ENTRY_POINT_GROUP)
    assert [entry.name for entry in installed] == ["builtin"]
