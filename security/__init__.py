"""DDS Security for ``ddsi``: installed as ``ddsi_security``, found through the entry point group ``ddsi.security``.

DDS-Security 1.1.  The core never imports this package; this package imports of the core only ``ddsi.structure``,
``.serialization``, ``.xtypes``, ``.messages``, ``.trace`` and ``.spi``.  Importing it loads no cryptographic library.
"""
