"""Admission: what security says about the participants that were discovered, and what follows from it.

DDS-Security 1.1 §7.3.11 (unauthenticated participants), §8.8.2.  A participant is found, then perhaps authenticated,
then admitted, and only then anything but SPDP and ParticipantStatelessMessage is exchanged with it.  One that is
refused stays in the table of participants, so that it is known and its announcements are no news; it is asked about
again when it announces itself, for security may have set it a time after which it may try once more.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from ..discovery.builtin_endpoints import Stage
from ..discovery.participant_proxy import ParticipantProxy
from ..spi import ADMITTED, PENDING, Admission, Refused
from ..structure.status import SecurityRefused
from ..trace.reasons import LossReason, SecurityStep

if TYPE_CHECKING:
    from .participant import Participant

__all__ = ["AdmissionDesk"]


class AdmissionDesk:
    """Asks the hooks about participants of one engine, and acts on their answers."""

    def __init__(self, engine: Participant) -> None:
        self._engine = engine

    def found(self, proxy: ParticipantProxy, now: float) -> None:
        """A participant that was not known announced itself."""
        admission = self._engine.hooks.remote_participant(proxy.data, now)
        if admission is ADMITTED:
            self._admit(proxy, now)  # at once, which is no news
        else:
            self.decided(proxy, admission, now)

    def announced_again(self, proxy: ParticipantProxy, now: float) -> None:
        """It announced something new, or, refused before, announced itself once more."""
        admission = self._engine.hooks.remote_participant_changed(proxy.data, now)
        if isinstance(admission, Refused) or not proxy.is_admitted:
            self.decided(proxy, admission, now)

    def decided(self, proxy: ParticipantProxy, admission: Admission, now: float) -> None:
        """This is what security says of it now.  An admitted one stays so until it is refused."""
        if isinstance(admission, Refused):
            self._refused(proxy, admission.reason, now)
        elif admission is PENDING:
            if proxy.is_admitted:
                return
            proxy.refusal = ""
            self._step(proxy, SecurityStep.AUTHENTICATING)
            self._engine.builtin.match(proxy, Stage.IDENTIFIED, now)
        else:
            self._step(proxy, SecurityStep.ADMITTED)
            if proxy.is_admitted:  # once more: it has started again, and has authenticated anew
                self._engine.discovery.endpoints_lost(proxy, LossReason.RESTARTED, now)
                self._engine.builtin_readers.announced(proxy.data, now)
                self._engine.builtin.begin_anew(proxy, now)
            else:
                self._admit(proxy, now)

    def _admit(self, proxy: ParticipantProxy, now: float) -> None:
        proxy.refusal = ""
        proxy.is_admitted = True
        self._engine.builtin_readers.announced(proxy.data, now)
        self._engine.builtin.match(proxy, Stage.ADMITTED, now)

    def _refused(self, proxy: ParticipantProxy, reason: str, now: float) -> None:
        """The application hears each reason once; whom we had admitted is gone."""
        engine = self._engine
        if reason != proxy.refusal:
            proxy.refusal = reason
            engine.status(engine.guid, SecurityRefused(remote=proxy.guid, reason=reason))
            self._step(proxy, SecurityStep.REFUSED, reason)
        if proxy.is_admitted:
            engine.discovery.participant_lost(proxy.guid, LossReason.REJECTED_BY_SECURITY, now, reason)

    def _step(self, proxy: ParticipantProxy, step: SecurityStep, detail: str = "") -> None:
        self._engine.recorder.security(proxy.guid, step, detail)
