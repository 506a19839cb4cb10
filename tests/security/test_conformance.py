"""What is said of objects that are no plugins, although they look like ones."""

from __future__ import annotations

from typing import Any, Protocol

import pytest

from ddsi.spi import Octets, Parts, Refused
from ddsi.structure.errors import ConfigurationError
from ddsi_security.conformance import bypassed, objections
from ddsi_security.crypto_transform_plugin import SHORT_WAYS, CryptoTransform, OpensAlike, SealsAlike
from ddsi_security.cryptographic import AesGcmGmac
from ddsi_security.handles import DatawriterCryptoHandle
from ddsi_security.loading import load_plugins


class Interface(Protocol):
    def open(self, name: str, size: int) -> int: ...

    def close(self, *, now: bool) -> None: ...


class Alike:
    def open(self, name: Any, size: Any) -> Any: ...

    def close(self, *, now: bool) -> None: ...


class More:
    def open(self, name: str, size: int, mode: str = "r", *, quiet: bool = False) -> int:
        return 0

    def close(self, now: bool) -> None: ...


class Delegating:
    def __getattr__(self, name: str) -> object:
        return getattr(Alike(), name)


class Anything:
    def open(self, *args: Any, **kwargs: Any) -> Any: ...

    def close(self, **kwargs: Any) -> None: ...


@pytest.mark.parametrize("plugin", [Alike(), More(), Delegating(), Anything()])
def test_what_can_be_called_as_the_interface_says_is_accepted(plugin: object) -> None:
    assert objections(plugin, Interface) == []


def test_what_is_missing_or_no_method_is_named() -> None:
    class Lacking:
        open = 3

    assert objections(Lacking(), Interface) == ["lacks close, open"]


def test_of_many_that_are_missing_some_are_named() -> None:
    wide = type("Wide", (), {f"operation_{letter}": lambda self: None for letter in "abcdefg"})
    assert objections(object(), wide) == ["lacks operation_a, operation_b, operation_c, operation_d and 3 more"]


@pytest.mark.parametrize(
    ("parameters", "is_taken"),
    [
        ("name, size", True),
        ("name, size=3", True),
        ("name, size, mode=0", True),
        ("*args, **kwargs", True),
        ("name, size, *args", True),
        ("name, size, **kwargs", True),
        ("name, extent", False),
        ("size, name", False),
        ("name", False),
        ("name, *, size", False),
        ("name, size, /", False),
        ("name, size, mode", False),
        ("name, size, *, mode", False),
        ("*args", False),
        ("**kwargs", False),
        ("", False),
    ],
)
def test_parameters_have_the_names_and_the_order_of_the_interface(parameters: str, is_taken: bool) -> None:
    scope: dict[str, Any] = {}
    exec(f"class Plugin(Alike):\n    def open(self, {parameters}): ...", {"Alike": Alike}, scope)
    found = objections(scope["Plugin"](), Interface)
    assert found == ([] if is_taken else [f"open takes ({parameters}) instead of (name, size)"])


def test_a_parameter_that_is_given_by_name_only_must_be_there() -> None:
    class Immediate:
        def open(self, name: str, size: int) -> int:
            return 0

        def close(self) -> None: ...

    assert objections(Immediate(), Interface) == ["close takes () instead of (*, now)"]


def test_plugins_are_not_async() -> None:
    class Waiting(Alike):
        async def open(self, name: str, size: int) -> int:
            return 0

    assert objections(Waiting(), Interface) == ["open is async: return Pending(job) for slow work"]


# --- short ways ------------------------------------------------------------------------------------------


class Whole:
    def seal(self) -> int:
        return 1

    def sealer(self) -> int:
        return 2


class Overriding(Whole):
    def seal(self) -> int:
        return 3


class OverridingBoth(Overriding):
    def sealer(self) -> int:
        return 4


class AboveBoth(OverridingBoth):
    def another(self) -> None: ...


class WithoutShortWay:
    def seal(self) -> int:
        return 5


@pytest.mark.parametrize(
    ("plugin", "is_bypassed"),
    [(Whole(), False), (Overriding(), True), (OverridingBoth(), False), (AboveBoth(), False),
     (WithoutShortWay(), False), (Delegating(), False)],
)  # fmt: skip
def test_an_operation_that_an_inherited_short_way_goes_past(plugin: object, is_bypassed: bool) -> None:
    found = bypassed(plugin, {"sealer": ("open", "seal")})
    assert found == ["seal is overridden, but sealer, which it inherits, goes past it: override that too"] * is_bypassed


class Counting(AesGcmGmac):
    """Extends the builtin plugin, as is easily done."""

    def encode_serialized_payload(
        self, extra_inline_qos: bytearray, plain_buffer: Octets, sending_datawriter_crypto: DatawriterCryptoHandle
    ) -> Parts | Refused:
        return super().encode_serialized_payload(extra_inline_qos, plain_buffer, sending_datawriter_crypto)


class CountingAll(Counting):
    def payload_sealer(self, sending_datawriter_crypto: DatawriterCryptoHandle) -> None:
        return None


def cryptographic(name: str) -> object:
    chosen = {"dds.sec.crypto.plugin": f"{__name__}:{name}"}
    return load_plugins(chosen, entropy=bytes, wall_clock=int).cryptographic


def test_who_extends_the_builtin_cryptography_is_told_what_would_never_be_called() -> None:
    with pytest.raises(ConfigurationError) as refused:
        cryptographic("Counting")
    assert str(refused.value).endswith(
        ":Counting': of the Counting it makes, encode_serialized_payload is overridden, but payload_sealer, which it "
        "inherits, goes past it: override that too"
    )
    assert isinstance(cryptographic("CountingAll"), CountingAll)


def test_short_ways_are_those_that_can_be_offered_and_stand_for_all_that_transforms() -> None:
    offered = {name for interface in (SealsAlike, OpensAlike) for name in vars(interface) if not name.startswith("_")}
    assert set(SHORT_WAYS) == offered
    operations = [operation for operations in SHORT_WAYS.values() for operation in operations]
    assert sorted(operations) == sorted(
        name for name in vars(CryptoTransform) if name.startswith(("encode_", "decode_", "preprocess_"))
    )
