"""DDS:Security:LogTopic, the builtin Logging plugin: to a file, to Python's logging, and to the topic."""

from .log_topic import LogTopic

__all__ = ["LogTopic"]
