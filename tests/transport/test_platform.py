"""What differs between platforms stays in one place, and says what the platform has."""

from __future__ import annotations

import ast
import socket
from pathlib import Path

import pytest

from ddsi.transport.platform import Interface, allow_shared_port, enlarge_buffer

DDSI = Path(__file__).parents[2] / "ddsi"


def test_nothing_else_asks_on_which_platform_it_runs() -> None:
    asking = {
        path.relative_to(DDSI).as_posix()
        for path in DDSI.rglob("*.py")
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8")))
        if isinstance(node, ast.Attribute)
        and isinstance(node.value, ast.Name)
        and (node.value.id, node.attr) in {("sys", "platform"), ("os", "name"), ("platform", "system")}
    }
    assert asking == {"transport/platform.py"}


@pytest.mark.parametrize(
    ("address", "reached"), [("10.1.2.3", True), ("10.1.255.255", True), ("10.2.0.1", False), ("127.0.0.1", False)]
)
def test_an_interface_reaches_its_own_network(address: str, reached: bool) -> None:
    interface = Interface("eth0", "10.1.0.1", "255.255.0.0", 1500, is_loopback=False)
    assert interface.reaches(address) is reached


def test_a_buffer_becomes_what_the_system_allows() -> None:
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as sock:
        modest = enlarge_buffer(sock, socket.SO_RCVBUF, 70_000)
        assert modest >= 70_000
        assert enlarge_buffer(sock, socket.SO_RCVBUF, None) >= modest


def test_a_system_that_refuses_large_buffers_is_asked_for_less() -> None:
    class Picky:
        size = 4096

        def setsockopt(self, level: int, option: int, size: int) -> None:
            if size > 300_000:
                raise OSError("No buffer space available")
            self.size = size

        def getsockopt(self, level: int, option: int) -> int:
            return self.size

    picky = Picky()
    assert enlarge_buffer(picky, socket.SO_SNDBUF, 1 << 20) == 1 << 18  # type: ignore[arg-type]


def test_two_sockets_may_listen_on_a_shared_port() -> None:
    with (
        socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as one,
        socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as other,
    ):
        allow_shared_port(one)
        allow_shared_port(other)
        one.bind(("127.0.0.1", 0))
        other.bind(one.getsockname())
