"""ParticipantSecurity and EndpointSecurity: what security knows of an entity, in the core's own words.

DDS-Security 1.1 §7.4.1.4 to §7.4.1.8: what it adds to the builtin topics.  Values only; the hooks make them, and those
of a participant without security answer empty ones.  What is said here was proved or is enforced; only tokens are shown
as they were announced.
"""

from __future__ import annotations

from .dataclass import dataclass

__all__ = ["EndpointSecurity", "ParticipantSecurity", "SecurityToken"]


@dataclass(frozen=True, slots=True)
class SecurityToken:
    """A token as it was announced: a class id and named texts (DDS-Security 1.1 §7.2.4).  Empty: there is none."""

    class_id: str = ""
    properties: tuple[tuple[str, str], ...] = ()


@dataclass(frozen=True, slots=True, kw_only=True)
class _Identity:
    """Whose the entity is; ``subject_name`` is empty where it is not authenticated."""

    is_authenticated: bool = False
    subject_name: str = ""


@dataclass(frozen=True, slots=True, kw_only=True)
class ParticipantSecurity(_Identity):
    """Of a participant: who it is, and how all that it says is protected (§8.4.2.4).

    ``is_authenticated``: it has proved who it is, and may be here.  ``subject_name``: of its certificate, as RFC 4514
    text.  ``is_rtps_protected``: whole messages are signed or encrypted; ``is_discovery_protected`` and
    ``is_liveliness_protected``: what the secure builtin topics say is.  ``plugin_attributes``: the mask in which the
    cryptographic plugin says how (the builtin one's: §9.4.2.3); 0 where it has none.  ``identity_status_token`` comes
    with the protected announcement, some moments after the participant itself.
    """

    is_rtps_protected: bool = False
    is_discovery_protected: bool = False
    is_liveliness_protected: bool = False
    plugin_attributes: int = 0
    identity_token: SecurityToken = SecurityToken()
    permissions_token: SecurityToken = SecurityToken()
    identity_status_token: SecurityToken = SecurityToken()


@dataclass(frozen=True, slots=True, kw_only=True)
class EndpointSecurity(_Identity):
    """Of a writer or reader: who its participant is, and how its topic is protected by governance (§8.4.2.7).

    ``is_authenticated``: its participant has proved who it is, and may be here.  ``subject_name``: of that certificate,
    as RFC 4514 text.  ``is_read_protected``, ``is_write_protected``: only who has the right may subscribe, or publish.
    ``is_discovery_protected``: its announcement came protected, so nobody who is not authenticated can have made up its
    QoS and data tags.  ``is_submessage_protected``, ``is_payload_protected``: so is its data on the way.
    ``plugin_attributes``: the mask in which the cryptographic plugin says how (the builtin one's: §9.4.2.5); 0 where it
    has none.
    """

    is_read_protected: bool = False
    is_write_protected: bool = False
    is_discovery_protected: bool = False
    is_liveliness_protected: bool = False
    is_submessage_protected: bool = False
    is_payload_protected: bool = False
    is_key_protected: bool = False
    plugin_attributes: int = 0
