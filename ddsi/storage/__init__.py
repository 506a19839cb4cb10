"""Storage: samples that outlive the process that received them, in a file of SQLite.  DDS 1.4 §2.2.3.4 (DURABILITY)."""

from __future__ import annotations

from .sample_store import SampleStore, StoredSample, StoredTopic

__all__ = ["SampleStore", "StoredSample", "StoredTopic"]
