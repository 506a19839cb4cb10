"""AesGcmGmac: the three Cryptographic interfaces in one object.  DDS-Security 1.1 §8.5, §9.5."""

from __future__ import annotations

from typing import Final

from .key_exchange import AesGcmGmacKeyExchange
from .key_factory import AesGcmGmacKeyFactory
from .transform import AesGcmGmacTransform

__all__ = ["AesGcmGmac"]


class AesGcmGmac(AesGcmGmacKeyFactory, AesGcmGmacKeyExchange, AesGcmGmacTransform):
    """The builtin plugin DDS:Crypto:AES-GCM-GMAC of one participant.

    All that it knows is in the handles that it gave out; unregister the participant, and nothing is left.
    """

    plugin_version: Final = 1
