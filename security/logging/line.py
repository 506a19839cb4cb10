"""A security event as one line of text, after the form of syslog.  RFC 5424 §6; DDS-Security 1.1 §9.6.

    <83>1 2026-11-22T09:56:20.000000Z host app 4711 auth [DDS guid="010F..." domain_id="0"] certificate expired

What others supplied cannot end the line, start another, or be taken for a field: see :func:`printable`.
"""

from __future__ import annotations

from datetime import UTC, datetime

from ..builtin_logging_type import BuiltinLoggingTypeV2, Timestamp

__all__ = ["printable", "syslog_line"]


def printable(text: str, limit: int) -> str:
    r"""At most ``limit`` characters of ``text``; what does not print is escaped (``\n``, ``\x1b``, ``\u202e``).

    Characters that turn the direction of writing do not print, nor do halves of surrogates: the result is UTF-8 of
    one line, and reads as it stands.  A backslash is doubled, so that nothing looks like an escape that was none.
    """
    if len(text) > limit:
        text = text[: limit - 3] + "..."
    return "".join(
        character if character.isprintable() and character != "\\" else character.encode("unicode_escape").decode()
        for character in text
    )


def syslog_line(event: BuiltinLoggingTypeV2) -> str:
    """The line, without its end.  The texts of ``event`` are printable (see :func:`printable`)."""
    # A field that is empty is "-", and none holds a space; their lengths are those of the RFC.
    fields = (
        _field(text, limit)
        for text, limit in ((event.hostname, 255), (event.appname, 48), (event.procid, 128), (event.msgid, 32))
    )
    entries = "".join(
        f"[{_field(entry.key, 32)}{''.join(f' {_field(pair.name, 32)}={_quoted(pair.value)}' for pair in entry.pairs)}]"
        for entry in event.structured_data
    )
    priority = event.facility * 8 + event.severity
    return f"<{priority}>1 {_time(event.timestamp)} {' '.join(fields)} {entries or '-'} {event.message}"


def _time(timestamp: Timestamp) -> str:
    moment = datetime.fromtimestamp(timestamp.sec, UTC).replace(tzinfo=None)
    return f"{moment.isoformat()}.{timestamp.nanosec // 1000:06}Z"


def _field(text: str, limit: int) -> str:
    return "".join("_" if character in ' ="]' else character for character in text[:limit]) or "-"


def _quoted(value: str) -> str:
    for special in ("\\", '"', "]"):
        value = value.replace(special, "\\" + special)
    return f'"{value}"'
