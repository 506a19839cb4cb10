"""Keystores: make, sign, check and explain identities, governance and permissions.  DDS-Security 1.1 §9.3.1, §9.4.1.

``ddsi keystore`` is the command (:mod:`.command`); :mod:`.keystore` makes a whole keystore from a program.  Nothing
here runs in a participant.  Importing this package loads no cryptographic library.
"""
