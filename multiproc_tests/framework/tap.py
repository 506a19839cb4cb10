"""Tap devices: the userspace end of a virtual Ethernet interface that lives in a network namespace.

What the namespace sends on the interface is read from the file descriptor, one frame a read; what is written to it
arrives there.  Linux only (``/dev/net/tun``, setns(2)).
"""

from __future__ import annotations

import ctypes
import os
import struct
import threading
from pathlib import Path

from .errors import Unavailable
from .namespace import Namespace

__all__ = ["open_tap"]

TUNSETIFF = 0x400454CA
IFF_TAP = 0x0002
IFF_NO_PI = 0x1000  # frames as they are, without four octets of packet information before them
CLONE_NEWNET = 0x40000000
QUEUED_FRAMES = 10_000
"""Frames that wait in the device for the relay: a burst of some MiB must not be lost here, where no seed decides."""


def open_tap(inside: Namespace, interface: str, mac: str) -> int:
    """Makes the interface in the namespace, still down, and returns its non-blocking file descriptor.

    The interface exists as long as the descriptor is open.
    """
    opened: list[int] = []
    failure: list[OSError] = []

    def open_inside() -> None:
        try:
            _enter(inside)
            opened.append(_open_device(interface))
        except OSError as error:
            failure.append(error)

    # setns moves only the thread that calls it, and nothing moves it back as simply: a thread of its own, which
    # ends here, leaves all others where they are.  The descriptor belongs to the process and stays valid.
    thread = threading.Thread(target=open_inside, name="open_tap")
    thread.start()
    thread.join()
    if failure:
        raise Unavailable(f"a tap device cannot be opened here ({failure[0]}): run as root, with /dev/net/tun")
    os.set_blocking(opened[0], False)
    inside.ip("link", "set", interface, "address", mac, "txqueuelen", str(QUEUED_FRAMES))
    return opened[0]


def _enter(inside: Namespace) -> None:
    # os.setns is new in Python 3.12.
    libc = ctypes.CDLL(None, use_errno=True)
    with Path("/run/netns", inside.name).open("rb") as file:
        if libc.setns(file.fileno(), CLONE_NEWNET) != 0:
            number = ctypes.get_errno()
            raise OSError(number, os.strerror(number), inside.name)


def _open_device(interface: str) -> int:
    import fcntl  # not on Windows, where this file is imported but not used

    device = os.open("/dev/net/tun", os.O_RDWR | os.O_CLOEXEC)
    try:
        request = struct.pack("16sH22x", interface.encode(), IFF_TAP | IFF_NO_PI)
        fcntl.ioctl(device, TUNSETIFF, request)
    except OSError:
        os.close(device)
        raise
    return device
