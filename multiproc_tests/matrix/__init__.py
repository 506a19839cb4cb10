"""The matrix: what any publisher and any subscriber are put through together, and what came of it.

A case is a short play for two programs (``stories.py``); ``cases.py``, ``secured.py`` and ``refusals.py`` list them;
``outcome.py`` runs one and says how it ended.  ``test_interop.py`` and ``python -m multiproc_tests.interop`` are the
two ways in.
"""

from .cases import CASES, Case
from .outcome import Outcome, Verdict, missing_ability, run_case
from .refusals import REFUSAL_CASES
from .secured import SECURED_CASES

__all__ = [
    "ALL_CASES",
    "CASES",
    "REFUSAL_CASES",
    "SECURED_CASES",
    "Case",
    "Outcome",
    "Verdict",
    "find_case",
    "missing_ability",
    "run_case",
]

ALL_CASES = (*CASES, *SECURED_CASES, *REFUSAL_CASES)


def find_case(name: str) -> Case:
    """The case of that name; KeyError tells the names there are."""
    for case in ALL_CASES:
        if case.name == name:
            return case
    raise KeyError(f"no case {name!r}; there are {', '.join(case.name for case in ALL_CASES)}")
