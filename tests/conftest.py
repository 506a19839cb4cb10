"""What holds for every test: it stays on loopback, hypothesis repeats itself, a missing peer fails where required."""

from __future__ import annotations

import os
import signal
from collections.abc import Generator

import pytest
from hypothesis import HealthCheck, settings

from .peers import peer_must_be_there

LOOPBACK = '<DDSI><Domain><General><Interfaces><NetworkInterface name="lo"/></Interfaces></General></Domain></DDSI>'

# At import, before any test module is: no participant made by a test, or by a process that one starts, may choose an
# interface for itself.  Overwritten rather than defaulted, as a developer's own setting may name a real network.
os.environ["DDSI_URI"] = LOOPBACK
os.environ["CYCLONEDDS_URI"] = LOOPBACK.replace("DDSI>", "CycloneDDS>")

# A shell ignores SIGINT for what it starts in the background, and its children inherit that: tests of Ctrl-C would wait
# for ever.
if signal.getsignal(signal.SIGINT) is signal.SIG_IGN:
    signal.signal(signal.SIGINT, signal.default_int_handler)

# The same examples on every run, so that a failure can be repeated; no deadline, as machines differ in speed.
settings.register_profile("ddsi", derandomize=True, deadline=None, suppress_health_check=[HealthCheck.too_slow])
settings.load_profile("ddsi")


@pytest.hookimpl(wrapper=True)
def pytest_runtest_makereport(item: pytest.Item) -> Generator[None, pytest.TestReport, pytest.TestReport]:
    report = yield
    if report.skipped and item.get_closest_marker("peers") is not None and peer_must_be_there():
        report.outcome = "failed"
        report.longrepr = f"required, but unavailable: {report.longrepr}"
    return report
