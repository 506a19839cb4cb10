"""Tracing that is off costs nothing: not even the making of the event classes."""

import subprocess
import sys

import pytest

import ddsi.trace


def test_events_are_imported_when_they_are_first_used() -> None:
    program = (
        "import sys, ddsi.trace as trace\n"
        "assert 'ddsi.trace.events' not in sys.modules\n"
        "from ddsi.trace.reasons import DropReason\n"
        "assert 'ddsi.trace.events' not in sys.modules\n"
        "assert trace.events.Remark.NAME == 'remark'\n"
        "assert 'ddsi.trace.events' in sys.modules\n"
    )
    subprocess.run([sys.executable, "-c", program], check=True, timeout=60)


def test_other_names_are_not_made_up() -> None:
    with pytest.raises(AttributeError, match="no attribute 'event_horizon'"):
        ddsi.trace.event_horizon  # noqa: B018
