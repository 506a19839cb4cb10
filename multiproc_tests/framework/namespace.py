"""Network namespaces: a network of its own for each test, from which no packet can reach a real interface.

A namespace has a loopback that takes multicast and nothing else; :func:`namespace_pair` joins two by a virtual cable,
:func:`.relay.relayed_namespaces` any number by a relay that may lose packets.  Linux only, with ``ip`` (iproute2) and
the right to make namespaces (root, or CAP_SYS_ADMIN and CAP_NET_ADMIN).

The calls are synchronous: each takes some milliseconds, and is made before and after a test, not within.
"""

from __future__ import annotations

import itertools
import os
import shutil
import subprocess
import sys
from collections.abc import Iterator, Sequence
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass, field

from .errors import Unavailable

__all__ = ["Namespace", "bare_namespace", "namespace", "namespace_pair", "require_namespaces"]

_counter = itertools.count(1)


@dataclass(slots=True)
class Namespace:
    """A network namespace, and the interface in it that the processes of a test shall use.

    ``interface`` is ``lo``, or the one end of a cable or relay; ``address`` its IPv4 address.
    """

    name: str
    interface: str = "lo"
    address: str = "127.0.0.1"
    network_octets: int = 8
    neighbours: dict[str, str] = field(default_factory=dict)
    """Link-layer address by IPv4 address, set by hand so that no ARP request is needed (or lost)."""

    def command(self, command: Sequence[str]) -> list[str]:
        """The command line that runs ``command`` in here; ``ip`` executes it, so that the pid is the program's."""
        return ["ip", "netns", "exec", self.name, *command]

    def run(self, *command: str) -> str:
        """Runs a short command in here to its end and returns what it printed."""
        return _run(*self.command(command))

    def ip(self, *words: str) -> str:
        """``ip`` on this namespace: ``ip("link", "show")``."""
        return _run("ip", "-n", self.name, *words)

    def interface_down(self) -> None:
        """Takes the interface away, as a pulled cable or a lost Wi-Fi does: addresses stay, routes go."""
        self.ip("link", "set", self.interface, "down")

    def interface_up(self) -> None:
        """Brings the interface up with its multicast route; also after ``interface_down``."""
        if self.interface == "lo":
            self.ip("link", "set", "lo", "up", "multicast", "on")
        else:
            self.ip("address", "replace", f"{self.address}/{self.network_octets}", "dev", self.interface)
            self.ip("link", "set", self.interface, "up")
        self.ip("route", "replace", "224.0.0.0/4", "dev", self.interface)
        for address, mac in self.neighbours.items():
            self.ip("neighbour", "replace", address, "lladdr", mac, "dev", self.interface, "nud", "permanent")

    def set_sysctl(self, name: str, value: str) -> bool:
        """Writes a setting below ``/proc/sys``, dots for slashes; False where this machine does not let us."""
        path = "/proc/sys/" + name.replace(".", "/")
        try:
            self.run("sh", "-c", f"echo {value} > {path}")
        except RuntimeError:
            return False
        return True


@contextmanager
def namespace() -> Iterator[Namespace]:
    """A namespace with nothing but ``lo``: up, with multicast, and all of 224.0.0.0/4 routed to it."""
    with bare_namespace() as made:
        made.interface_up()
        yield made


@contextmanager
def namespace_pair() -> Iterator[tuple[Namespace, Namespace]]:
    """Two namespaces joined by a virtual cable (veth): 10.77.0.1 and 10.77.0.2, each on its ``veth0``."""
    with ExitStack() as stack:
        left, right = (stack.enter_context(bare_namespace()) for _ in range(2))
        cable = ["link", "add", "veth0", "type", "veth", "peer", "name", "veth0", "netns", right.name]
        left.ip(*cable)
        for number, end in enumerate((left, right), start=1):
            end.interface, end.address, end.network_octets = "veth0", f"10.77.0.{number}", 24
            end.ip("link", "set", "lo", "up")
            end.interface_up()
        yield left, right


@contextmanager
def bare_namespace() -> Iterator[Namespace]:
    """A namespace whose interfaces are all still down; removed at the end, with all that is in it."""
    require_namespaces()
    made = _add()
    try:
        yield made
    finally:
        subprocess.run(["ip", "netns", "delete", made.name], check=False, capture_output=True)


def require_namespaces() -> None:
    """Raises Unavailable, with the reason, where namespaces cannot be made."""
    if sys.platform != "linux":
        raise Unavailable("network namespaces exist on Linux only")
    if shutil.which("ip") is None:
        raise Unavailable("the program 'ip' is missing: apt-get install iproute2")


def _add() -> Namespace:
    # The pid makes the name unique among those who run now; the counter also gets us past what a killed run with
    # the same pid has left behind.
    for _ in range(1000):
        name = f"ddsi-test-{os.getpid()}-{next(_counter)}"
        result = subprocess.run(["ip", "netns", "add", name], check=False, capture_output=True, text=True)
        if result.returncode == 0:
            return Namespace(name)
        if "File exists" not in result.stderr:
            raise Unavailable(f"'ip netns add' is not permitted here ({result.stderr.strip()}): run as root")
    raise Unavailable("every name for a network namespace is taken: remove old ones with 'ip netns delete'")


def _run(*command: str) -> str:
    result = subprocess.run(command, check=False, capture_output=True, text=True)
    if result.returncode != 0:
        raise RuntimeError(f"'{' '.join(command)}' failed: {result.stderr.strip()}")
    return result.stdout
