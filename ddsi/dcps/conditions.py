"""Conditions: which samples a reader shall wait for, read or take.

DDS 1.4 §2.2.2.5.8 (ReadCondition), .9 (QueryCondition).
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from ..structure.dataclass import dataclass
from ..structure.sample_info import ANY_INSTANCE_STATE, ANY_SAMPLE_STATE, ANY_VIEW_STATE

__all__ = ["ReadCondition"]


@dataclass(frozen=True, slots=True)
class ReadCondition:
    """Samples in one of these states; masks of SampleState, ViewState and InstanceState, all by default.

    ``query``, if given, is asked for the data of each sample that has the right states (a QueryCondition).
    """

    sample_states: int = ANY_SAMPLE_STATE
    view_states: int = ANY_VIEW_STATE
    instance_states: int = ANY_INSTANCE_STATE
    query: Callable[[Any], bool] | None = None
