"""All targets, by the names of the folders in ``corpus/``."""

from __future__ import annotations

from tests.fuzz.documents import DOCUMENT_TARGETS
from tests.fuzz.envelopes import ENVELOPE_TARGETS
from tests.fuzz.plain import PLAIN_TARGETS
from tests.fuzz.secured import SECURED_TARGETS
from tests.fuzz.target import Target
from tests.fuzz.tokens import TOKEN_TARGETS

__all__ = ["TARGETS"]

TARGETS: dict[str, Target] = {
    **PLAIN_TARGETS,
    **TOKEN_TARGETS,
    **DOCUMENT_TARGETS,
    **ENVELOPE_TARGETS,
    **SECURED_TARGETS,
}
