"""The OMG's interoperability suite for DDS-RTPS (https://github.com/omg-dds/dds-rtps), played by our own code.

Its cases are facts (what each program is started with, and which codes are expected); how they are judged follows the
suite's documented rules.  Each case runs in a namespace of its own, so that several can run at a time.
"""

from .cases import CASES, SuiteCase, find_case
from .codes import Code
from .play import FULL, QUICK, Effort, play, run_case
from .programs import CYCLONE, OURS, PROGRAMS, ShapeMain

__all__ = [
    "CASES",
    "CYCLONE",
    "FULL",
    "OURS",
    "PROGRAMS",
    "QUICK",
    "Code",
    "Effort",
    "ShapeMain",
    "SuiteCase",
    "find_case",
    "play",
    "run_case",
]
