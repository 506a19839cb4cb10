"""Every test of this room gets its ``domain`` from here."""

from tests.dcps.running import domain as domain
