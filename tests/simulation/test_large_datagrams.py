"""Samples in datagrams of many frames, as Fast DDS sends them: with one frame the whole datagram is lost.

At 10 % loss, of datagrams of 28 frames one in nineteen arrives, so nearly all that is asked for is asked for often.
How soon it is asked for again is then all that counts.
"""

from __future__ import annotations

from ddsi.simulation import Domain, LinkConditions
from ddsi.simulation.dice import Dice
from ddsi.structure.qos import Qos
from ddsi.structure.qos_policies import KeepAll, Reliable

FRAME_OCTETS = 1480
SAMPLE_OCTETS = 40 << 10
SAMPLES = 5
PATIENCE = 40.0
EVERYTHING = Qos(reliability=Reliable(), history=KeepAll())


def test_late_answers_do_not_slow_the_questions_down() -> None:
    """A tenth of what arrives is late by up to 0.3 s, where the rest is there and back in 30 ms."""
    slow = {seed: taken for seed in range(20) if (taken := taken_in_time(seed)) < SAMPLES}
    assert not slow, f"samples after {PATIENCE} s, by seed"


def taken_in_time(seed: int) -> int:
    late = LinkConditions(delay=0.01, jitter=0.01, reordering=0.1, reordering_delay=0.3)
    domain = Domain(seed, conditions=late)
    dice = Dice(seed)
    sender, receiver = domain.node(max_message_octets=65_000), domain.node()
    writer, reader = sender.writer("Blob", EVERYTHING), receiver.reader("Blob", EVERYTHING)
    assert domain.run_until(domain.all_matched, 10)
    domain.network.loses = lambda source, target, octets: dice.chance(1 - 0.9 ** -(-len(octets) // FRAME_OCTETS))
    for _ in range(SAMPLES):
        writer.write(SAMPLE_OCTETS)
    domain.run_until(lambda: len(reader.taken) == SAMPLES, PATIENCE)
    return len(reader.taken)
