"""``refuse_unknown_keywords``: a misspelt policy or setting is refused with the nearest name that there is.

Python's own TypeError says that it is unknown, and no more.  For what people write from memory: Qos and Config.
"""

from __future__ import annotations

from collections.abc import Collection

from .errors import BadParameter

__all__ = ["refuse_unknown_keywords"]


def refuse_unknown_keywords(class_name: str, known: Collection[str], given: Collection[str], positional: int) -> None:
    """Raises BadParameter unless all names ``given`` are ``known``, and nothing is given by its position."""
    if positional:
        raise BadParameter(f"{class_name} takes everything by name, as {class_name}({next(iter(known))}=...)")
    for name in given:
        if name not in known:
            import difflib  # it costs start-up time, and few misspell

            near = difflib.get_close_matches(name.lower()[:100], known, n=1)
            hint = f"did you mean {near[0]}?" if near else f"there are {', '.join(known)}"
            raise BadParameter(f"{class_name}({name}=...) is not known: {hint}")
