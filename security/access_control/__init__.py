"""The builtin access control plugin, DDS:Access:Permissions.  DDS-Security 1.1 §9.4.

Bottom up: ``der``, ``cms`` and ``smime`` verify who signed a document; ``xml_document`` reads it; ``governance`` and
``permissions`` are its values; ``decision`` and ``checks`` reason on them, step by step; ``sec_attributes`` says how
what is allowed is protected; ``plugin`` holds the documents of a participant and answers by them.  All but the plugin
are pure functions, which the keystore's tools use as well.
"""

from .plugin import PermissionsAccessControl

__all__ = ["PermissionsAccessControl"]
