"""An intruder on the loopback of a test: he reads and writes everything there, and has no key.

    python -m multiproc_tests.peers.programs.intruder TOPIC

He attacks the participants that are ours.  He says READY once he records.  Orders come on standard input, one a line:
``replay``, ``alter``, ``forge``, ``steal``, ``flood``.  Each is answered by ``DONE order COUNT``, when so many
datagrams were sent.  Linux only, with the right to open packet sockets.
"""

from __future__ import annotations

import socket
import sys
import threading
import time
from collections.abc import Iterable, Iterator
from random import Random

from . import forgeries
from .forgeries import Knowledge
from .protocol import say

ETH_P_IP = 0x0800
UDP = 17
MAX_RECORDED = 20_000
REPLAYED = 4000
PACE_S = 0.0007
"""Between two datagrams: the victim shall work on them, and not lose them in the buffer of its socket."""


class Recorder:
    """What arrives on the loopback, but for what he sent himself: RTPS messages, oldest first."""

    def __init__(self, own_port: int) -> None:
        self.messages: list[bytes] = []
        self._own_port = own_port
        self._socket = socket.socket(socket.AF_PACKET, socket.SOCK_DGRAM, socket.htons(ETH_P_IP))
        self._socket.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 8 << 20)
        self._socket.bind(("lo", ETH_P_IP))
        threading.Thread(target=self._run, daemon=True).start()

    def _run(self) -> None:
        while len(self.messages) < MAX_RECORDED:
            packet = self._socket.recv(1 << 16)
            at = 4 * (packet[0] & 15)
            is_message = packet[9] == UDP and packet[at + 8 : at + 12] == b"RTPS"
            is_own = int.from_bytes(packet[at : at + 2], "big") == self._own_port
            if is_message and not is_own:
                self.messages.append(packet[at + 8 :])


class Intruder:
    """Does what he is told, with what he knows by then."""

    def __init__(self, topic: str) -> None:
        self._topic = topic
        self._dice = Random(7)
        self._socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self._socket.bind(("127.0.0.1", 0))
        self._recorder = Recorder(self._socket.getsockname()[1])

    def obey(self, order: str) -> int:
        known = Knowledge.of(list(self._recorder.messages))
        ports = {
            (locator.host, locator.port)
            for data in known.victims
            for locator in (*data.metatraffic_unicast, *data.default_unicast)
        }
        if not ports or not known.handshakes:
            raise SystemExit(f"of {len(known.messages)} messages none tells where the victims are, or how they met")
        count = 0
        for octets in self._attack(order, known):
            for port in ports:
                self._socket.sendto(octets, port)
                count += 1
                time.sleep(PACE_S)
        return count

    def _attack(self, order: str, known: Knowledge) -> Iterator[bytes]:
        dice, victims = self._dice, known.victims
        match order:
            case "replay":
                yield from known.messages[:REPLAYED]
                yield from dice.sample(known.messages, min(len(known.messages), 600))
            case "alter":
                yield from forgeries.altered(known.messages, dice, 1000)
            case "forge":
                for sender in known.participants:
                    yield from forgeries.forged_announcements(sender, self._topic)
                    for receiver in victims:
                        if receiver is not sender:
                            yield from forgeries.forged_submessages(sender, receiver)
            case "steal":
                yield from forgeries.stolen_handshakes(known, dice)
            case "flood":
                yield from forgeries.invented_participants(known, dice, 600)
            case _:
                raise SystemExit(f"no order {order!r}")


def main(words: list[str]) -> None:
    intruder = Intruder(words[0])
    say("READY")
    orders: Iterable[str] = sys.stdin
    for line in orders:
        order = line.strip()
        if order == "leave":
            break
        say("DONE", order, intruder.obey(order))


if __name__ == "__main__":
    main(sys.argv[1:])
