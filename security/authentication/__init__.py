"""DDS:Auth:PKI-DH, the builtin authentication plugin.  DDS-Security 1.1 §9.3; of 1.2 the algorithms and their names.

pki_dh              the plugin
handshake           its three messages      handshake_tokens    their octets, and what is hashed and signed
identities          what handles hold       identity_material   what the properties point to
peer                who is at the other end, and may it be believed
trust_anchors       identity CAs and revocation lists           certificate
key_agreement  signatures  private_key      algorithms          all their names
pkcs11_uri  pkcs11_token                    keys in hardware
adjusted_guid  participant_data  expiry  der  not_trusted
"""

from .pki_dh import PkiDhAuthentication

__all__ = ["PkiDhAuthentication"]
