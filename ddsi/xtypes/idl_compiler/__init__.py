"""The IDL compiler: IDL 4.2 text to Python types and Python source, and types back to IDL text.

OMG IDL 4.2, DDS-XTypes 1.3 §7.3.1.  The way of a file: ``preprocessor`` (with ``tokens``) gives tokens, ``parser`` a
syntax tree, ``analysis`` declarations with every name looked up and every rule checked, ``python_source`` Python text,
``loading`` runs that text.  ``idl_text`` goes back from types to IDL.  What no data type is (interfaces and their
like) is passed over with a warning.  Applications use all this as ``ddsi.idl.load``, ``loads`` and ``to_idl``, which
import it when they are called; only what is raised and warned of is imported here.
"""

from .source_text import IdlError, IdlWarning, Place, SourceText

__all__ = ["IdlError", "IdlWarning", "Place", "SourceText"]
