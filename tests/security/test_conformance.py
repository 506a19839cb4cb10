"""What is said of objects that are no plugins, although they look like ones."""

from __future__ import annotations

from typing import Any, Protocol

import pytest

from ddsi_security.conformance import objections


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
