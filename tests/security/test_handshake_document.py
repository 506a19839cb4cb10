"""docs/handshake.md says what the table and the constants say."""

from __future__ import annotations

import re
from pathlib import Path

from ddsi_security import admission, handshake, key_exchange, waiting_room
from ddsi_security.handshake import TRANSITIONS, State
from ddsi_security.handshake_diagram import legend, state_diagram

PAGE = (Path(__file__).parents[2] / "docs" / "handshake.md").read_text(encoding="utf-8")
LIMITS = {
    match[1]: float(match[2]) for match in re.finditer(r"^\| `(_?[A-Z_]+)` \| ([\d.]+)(?: s)? \| .+ \|$", PAGE, re.M)
}


def test_the_document_draws_the_table() -> None:
    advice = "python -m ddsi_security.handshake_diagram prints what belongs there"
    assert state_diagram() in PAGE, advice
    assert legend() in PAGE, advice


def test_every_transition_is_drawn_once() -> None:
    drawn = [
        (source, event, action, following)
        for source, following, events, action in re.findall(r"^    (\w+) --> (\w+): ([\w, ]+) / (\w+)$", PAGE, re.M)
        for event in events.split(", ")
    ]
    table = [
        (state.name, event.name, action.name, following.name)
        for (state, event), (action, following) in TRANSITIONS.items()
    ]
    assert sorted(drawn) == sorted(table)


def test_every_state_can_be_reached_and_left() -> None:
    reached = {following for _, following in TRANSITIONS.values()} | {State.VALIDATING}
    assert reached == set(State) == {state for state, _ in TRANSITIONS}


def test_the_numbers_are_those_of_the_code() -> None:
    for name, value in LIMITS.items():
        (module,) = (module for module in (handshake, admission, key_exchange, waiting_room) if hasattr(module, name))
        assert value == getattr(module, name), name


def test_every_number_of_the_machine_is_there() -> None:
    constants = {name for name, value in vars(handshake).items() if name.isupper() and isinstance(value, int | float)}
    assert constants <= set(LIMITS)
    assert len(constants) >= 10
