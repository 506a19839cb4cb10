"""Neighbours of the inputs that are kept, and of good ones: some other answer perhaps, but never another error."""

from __future__ import annotations

from functools import cache

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tests.fuzz.corpus import kept
from tests.fuzz.targets import TARGETS

INTERESTING = (b"\0", b"\1", b"\x7f", b"\x80", b"\xff", bytes(4), b"\xff" * 4, b"\xff\xff\xff\x7f", b"\0\0\0\x80")


@cache
def originals(name: str) -> tuple[bytes, ...]:
    target = TARGETS[name]
    return tuple(octets[: target.most_octets] for octets in [*(entry.octets for entry in kept(name)), *target.seeds()])


@st.composite
def mutated(draw: st.DrawFn, name: str) -> bytes:
    """Up to four octets or words overwritten, runs cut out or doubled, or the rest cut off."""
    octets = bytearray(draw(st.sampled_from(originals(name))))
    for _ in range(draw(st.integers(1, 4))):
        at = draw(st.integers(0, len(octets)))
        run = draw(st.integers(1, 16))
        match draw(st.sampled_from(("set", "set", "delete", "double", "insert", "cut"))):
            case "set":
                value = draw(st.sampled_from(INTERESTING) | st.binary(min_size=1, max_size=4))
                octets[at : at + len(value)] = value
            case "delete":
                del octets[at : at + run]
            case "double":
                octets[at:at] = octets[at : at + run]
            case "insert":
                octets[at:at] = draw(st.binary(min_size=1, max_size=8))
            case _:
                del octets[at:]
    return bytes(octets[: TARGETS[name].most_octets])


@pytest.mark.parametrize("name", TARGETS)
@settings(max_examples=50)
@given(st.data())
def test_neighbours_get_an_answer(name: str, data: st.DataObject) -> None:
    originals(name)  # made here, as some take entropy, which strategies must not
    TARGETS[name].run(data.draw(mutated(name)))


@pytest.mark.slow
@pytest.mark.parametrize("name", TARGETS)
@settings(max_examples=400)
@given(st.data())
def test_many_neighbours_get_an_answer(name: str, data: st.DataObject) -> None:
    originals(name)
    TARGETS[name].run(data.draw(mutated(name)))
