"""What holds for every test: whatever it starts stays on the loopback interface, and hypothesis repeats itself."""

from __future__ import annotations

import os

from hypothesis import HealthCheck, settings

LOOPBACK = '<DDSI><Domain><General><Interfaces><NetworkInterface name="lo"/></Interfaces></General></Domain></DDSI>'

# At import, before any test module is: no participant made by a test, or by a process that one starts, may choose an
# interface for itself.  Overwritten rather than defaulted, as a developer's own setting may name a real network.
os.environ["DDSI_URI"] = LOOPBACK
os.environ["CYCLONEDDS_URI"] = LOOPBACK.replace("DDSI>", "CycloneDDS>")

# The same examples on every run, so that a failure can be repeated; no deadline, as machines differ in speed.
settings.register_profile("ddsi", derandomize=True, deadline=None, suppress_health_check=[HealthCheck.too_slow])
settings.load_profile("ddsi")
