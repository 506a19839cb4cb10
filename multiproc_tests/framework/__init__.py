"""A small framework for tests of several processes on one machine: roles, steps, deadlines, networks, captures.

It knows nothing of DDS and may serve any program that prints what it does, one event a line.  ``docs/multiproc.md``
has the tour; in short::

    @async_test
    async def test_two_hosts_talk() -> None:
        with namespace() as host:
            async with scenario("two talk", deadline=30) as stage:
                server = await stage.start("server", ["./server"], namespace=host)
                await server.expect("READY")
                client = await stage.start("client", ["./client"], namespace=host)
                assert (await client.expect(r"GOT (\\d+)"))[1] == "42"
                await client.expect_exit(0)

What is still running when the block is left, for whatever reason, is stopped; what it printed is shown with the
failure.  It does not look into programs: what a process does not print did not happen.
"""

from .capture import Capture, capture
from .errors import DeadlineExceeded, ExpectationFailed, Unavailable
from .namespace import Namespace, namespace, namespace_pair
from .process import Line, Process
from .relay import Relay, relayed_namespaces
from .runner import async_test
from .scenario import Scenario, scenario
from .weather import CALM, Link, LinkCounters, Weather

__all__ = [
    "CALM",
    "Capture",
    "DeadlineExceeded",
    "ExpectationFailed",
    "Line",
    "Link",
    "LinkCounters",
    "Namespace",
    "Process",
    "Relay",
    "Scenario",
    "Unavailable",
    "Weather",
    "async_test",
    "capture",
    "namespace",
    "namespace_pair",
    "relayed_namespaces",
    "scenario",
]
