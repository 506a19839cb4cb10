"""``RefusedSetting``: a value that cannot be meant, with its parts, so that whoever knows where it stood can say so."""

from __future__ import annotations

from ddsi.structure.errors import ConfigurationError

__all__ = ["RefusedSetting"]


class RefusedSetting(ConfigurationError):
    """``name`` is the field of Config (``ports.base`` for one of its ports), ``expected`` what it must be instead."""

    def __init__(self, name: str, value: object, expected: str, *, place: str = "") -> None:
        super().__init__(f"{place or f'Config.{name}'} is {value!r}; it must be {expected}")
        self.name = name
        self.value = value
        self.expected = expected

    def at(self, place: str) -> RefusedSetting:
        """The same refusal, naming where the value was read instead of the field."""
        return RefusedSetting(self.name, self.value, self.expected, place=place)
