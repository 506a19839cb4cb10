"""The handshake machine drawn from its own table: what ``docs/handshake.md`` shows.  DDS-Security 1.1 §8.3.4.

``python -m ddsi_security.handshake_diagram`` prints both parts; a test holds the document to them.
"""

from __future__ import annotations

import sys
from collections.abc import Iterable
from enum import Enum

from .handshake import TRANSITIONS, Action, Event, State

__all__ = ["legend", "state_diagram"]


def state_diagram() -> str:
    """A Mermaid stateDiagram: an arrow for each state, action and next state, with the events that lead there."""
    arrows: dict[tuple[State, State, Action], list[str]] = {}
    for (state, event), (action, following) in TRANSITIONS.items():
        arrows.setdefault((state, following, action), []).append(event.name)
    return "\n".join(
        [
            "```mermaid",
            "stateDiagram-v2",
            f"    [*] --> {next(iter(State)).name}",
            *(
                f"    {state.name} --> {following.name}: {', '.join(events)} / {action.name}"
                for (state, following, action), events in arrows.items()
            ),
            "```",
        ]
    )


def legend() -> str:
    """What each state, event and action means, as three tables in Markdown."""
    return "\n\n".join(
        _table(title, members) for title, members in (("state", State), ("event", Event), ("action", Action))
    )


def _table(title: str, members: Iterable[Enum]) -> str:
    return "\n".join([f"| {title} | |", "|---|---|", *(f"| `{member.name}` | {member.value} |" for member in members)])


if __name__ == "__main__":
    sys.stdout.write(f"{state_diagram()}\n\n{legend()}\n")
