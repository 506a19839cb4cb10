"""How a scenario fails: something did not happen, took too long, or cannot be had on this machine."""

from __future__ import annotations

__all__ = ["DeadlineExceeded", "ExpectationFailed", "Unavailable"]


class ExpectationFailed(AssertionError):
    """A process did not print, or did not end, as it was expected to."""


class DeadlineExceeded(AssertionError):
    """A process or a whole scenario took longer than it was given."""


class Unavailable(Exception):
    """What the test needs is missing here: a permission, a program, a peer.  The message names it and the remedy.

    ``multiproc_tests/conftest.py`` turns it into a skip, or into a failure where ``DDSI_REQUIRE_PEERS=1``.
    """
