"""The command line of the peer programs as a value.  ``docs/multiproc.md`` has the meaning of each option."""

from __future__ import annotations

from dataclasses import dataclass

__all__ = ["Options"]


@dataclass(frozen=True, slots=True, kw_only=True)
class Options:
    """What a peer program is told; the defaults suit a test (short waits, held until released)."""

    domain: int = 1
    topic: str = "Square"
    colors: tuple[str, ...] = ("BLUE",)
    count: int = 5
    interval_ms: int = 10
    wait_s: int = 15
    size: int = 30
    depth: int = 0
    representation: int = 1
    partitions: tuple[str, ...] = ()
    blob_octets: int | None = None
    readers: int = 1
    best_effort: bool = False
    volatile: bool = False
    dispose: bool = False
    unregister: bool = False
    keyless: bool = False
    appendable: bool = False
    unicast: bool = False
    gate: bool = False
    hold: bool = True
    keystore: str | None = None
    """A folder (``keystore.py``); without one, nothing is secured."""
    identity: str = "alice"
    governance: str = "governance.p7s"
    lease_s: int | None = None
    """For how long a participant is believed to be there without being heard."""
    read_pause_ms: int = 0
    max_samples: int | None = None

    def arguments(self) -> list[str]:
        """The options as words, without the role."""
        words = ["-d", str(self.domain), "-t", self.topic, "-c", ",".join(self.colors), "-n", str(self.count)]
        words += ["-i", str(self.interval_ms), "-w", str(self.wait_s), "-s", str(self.size)]
        words += ["-x", str(self.representation), "-M", str(self.readers)]
        if self.depth:
            words += ["-h", str(self.depth)]
        if self.partitions:
            words += ["-P", ",".join(self.partitions)]
        if self.blob_octets is not None:
            words += ["-B", str(self.blob_octets)]
        if self.keystore is not None:
            words += ["-k", self.keystore, "-p", self.identity, "-g", self.governance]
        if self.lease_s is not None:
            words += ["-L", str(self.lease_s)]
        if self.read_pause_ms:
            words += ["-z", str(self.read_pause_ms)]
        if self.max_samples is not None:
            words += ["-r", str(self.max_samples)]
        flags = {
            "-b": self.best_effort,
            "-v": self.volatile,
            "-D": self.dispose,
            "-U": self.unregister,
            "-K": self.keyless,
            "-A": self.appendable,
            "-u": self.unicast,
            "-G": self.gate,
            "-H": self.hold,
        }
        return words + [flag for flag, is_set in flags.items() if is_set]
