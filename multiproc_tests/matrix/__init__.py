"""The matrix: what any publisher and any subscriber are put through together, and what came of it.

A case is a short play for two programs (``stories.py``); ``cases.py`` lists them; ``outcome.py`` runs one and says
how it ended.  ``test_interop.py`` and ``python -m multiproc_tests.interop`` are the two ways in.
"""

from .cases import CASES, Case, find_case
from .outcome import Outcome, Verdict, missing_ability, run_case

__all__ = [
    "CASES",
    "Case",
    "Outcome",
    "Verdict",
    "find_case",
    "missing_ability",
    "run_case",
]
