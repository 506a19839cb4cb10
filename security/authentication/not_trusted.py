"""NotTrusted: why a certificate, a key or a message is not believed."""

from __future__ import annotations

__all__ = ["NotTrusted"]


class NotTrusted(Exception):
    """Never leaves this package: what it says of a peer becomes ``Refused``, of our own material ConfigurationError.

    The text is for people, begins in lower case and holds no secret.
    """
