"""Does one expression mean all that another means?  Can two mean the same?  The same for domains.  For rules on rules.

DDS-Security 1.1 §9.4.1.3.2.3 (fnmatch).  ``*`` and ``?`` are understood; of ``[...]`` only that it may be any one
character.  :func:`covers` says yes only when it is sure, :func:`overlaps` says no only when it is sure, so that what
the linter complains of is so.  Time is the product of the lengths.
"""

from __future__ import annotations

import re
from typing import Final

from ..access_control.domains import DomainRange, Domains
from ..access_control.wildcard import matches

__all__ = ["covers", "domains_cover", "domains_overlap", "overlaps"]

_STAR, _ANY = "*", "?"
_TOKEN: Final = re.compile(r"\[!?\]?[^\]]*\]|.", re.DOTALL)


def covers(wide: str, narrow: str) -> bool:
    """Is every name that ``narrow`` matches one that ``wide`` matches?  False where it is hard to tell."""
    if wide in (narrow, _STAR):
        return True
    if not any(wildcard in narrow for wildcard in "*?["):
        return matches(wide, narrow)
    if "[" in wide:
        return False
    # Narrow is taken as a text of tokens.  Of "?" and "[...]" nothing is known but that they are a character, and only
    # a star can stand for a star.  reachable[j]: the tokens of wide so far match the first j of narrow.
    text = _TOKEN.findall(narrow)
    reachable = [True] + [False] * len(text)
    for token in wide:
        above, reachable = reachable, [reachable[0] and token == _STAR] + [False] * len(text)
        for j, other in enumerate(text):
            if token == _STAR:
                reachable[j + 1] = above[j + 1] or reachable[j]
            else:
                reachable[j + 1] = above[j] and other != _STAR and token in (_ANY, other)
    return reachable[-1]


def overlaps(first: str, second: str) -> bool:
    """Is there a name that both match?  True where it is hard to tell."""
    left, right = _TOKEN.findall(first), _TOKEN.findall(second)
    # reachable[j]: the tokens of left so far and the first j of right can mean one text.
    reachable = [True]
    for token in right:
        reachable.append(reachable[-1] and token == _STAR)
    for one in left:
        above, reachable = reachable, [reachable[0] and one == _STAR]
        for j, other in enumerate(right):
            if _STAR in (one, other):  # the star means nothing here, or takes what the other stands for
                reachable.append(above[j + 1] or reachable[j])
            else:
                reachable.append(above[j] and _may_be_same(one, other))
    return reachable[-1]


def _may_be_same(one: str, other: str) -> bool:
    return one == other or _ANY in (one, other) or one.startswith("[") or other.startswith("[")


# --- domains -------------------------------------------------------------------------------------------------


def domains_cover(wide: Domains, narrow: Domains) -> bool:
    """Is every domain that ``narrow`` includes one that ``wide`` includes?  False where it is hard to tell."""
    if wide.tags and wide.tags != narrow.tags:
        return False
    return all(any(_range_covers(one, other) for one in _ranges(wide)) for other in _ranges(narrow))


def domains_overlap(first: Domains, second: Domains) -> bool:
    """Is there a domain that both include?  True where it is hard to tell, as with tags."""
    return any(
        (one.last is None or other.first <= one.last) and (other.last is None or one.first <= other.last)
        for one in _ranges(first)
        for other in _ranges(second)
    )


def _range_covers(wide: DomainRange, narrow: DomainRange) -> bool:
    return wide.first <= narrow.first and (wide.last is None or (narrow.last is not None and narrow.last <= wide.last))


def _ranges(domains: Domains) -> tuple[DomainRange, ...]:
    return domains.ranges or (DomainRange(0, None),)
