"""DDS:Crypto:AES-GCM-GMAC, the builtin cryptographic plugin.  DDS-Security 1.1 §9.5.

    transformation    kinds of transformation, and the protection that attributes ask for
    key_material      KeyMaterial and its token; the pairwise key of two participants
    session_keys      keys that we send with: sessions, and nonces that never repeat
    received_keys     keys that peers gave us, and which of them may open what
    payload           a protected SerializedPayload
    envelope          where the parts of a protected submessage or message lie
    sealing, opening  what goes into envelopes, and comes out
    aes_gcm           large buffers
    crypto_handles    what belongs to whom
    key_factory, key_exchange, transform   the three interfaces of §8.5; plugin has them all

Not here: the pre-shared keys and key revisions of DDS-Security 1.2.
"""

from .plugin import AesGcmGmac

__all__ = ["AesGcmGmac"]
