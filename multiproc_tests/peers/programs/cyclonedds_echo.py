"""Sends back what it receives, of the random types of some seeds, over the `cyclonedds` package of PyPI.

Arguments: the seeds.  For each, topic ``In<seed>`` is read and ``Out<seed>`` written, until standard input ends.
"""

# mypy: ignore-errors
# pyright: basic

import sys
import time
from typing import Any

from cyclonedds.core import Policy, Qos
from cyclonedds.domain import DomainParticipant
from cyclonedds.pub import DataWriter
from cyclonedds.sub import DataReader
from cyclonedds.topic import Topic
from cyclonedds.util import duration

import ddsi
from ddsi.xtypes.definition import struct_type
from tests.xtypes.peer_types import PeerTypes
from tests.xtypes.random_idl import RandomIdl

from .protocol import is_released, say

KEPT = Qos(
    Policy.Reliability.Reliable(duration(seconds=10)),
    Policy.History.KeepAll,
    Policy.Durability.TransientLocal,
    Policy.DurabilityService(0, Policy.History.KeepAll, -1, -1, -1),
    Policy.DataRepresentation(use_cdrv0_representation=False, use_xcdrv2_representation=True),
)


def main(seeds: list[int]) -> None:
    participant = DomainParticipant(0)
    pairs: list[tuple[DataReader[Any], DataWriter[Any]]] = []
    for seed in seeds:
        module: Any = ddsi.idl.loads(RandomIdl(seed, keys=True, enums=True).text()).m
        type_ = PeerTypes().class_of(struct_type(module.Top))
        reader = DataReader(participant, Topic(participant, f"In{seed}", type_), qos=KEPT)
        pairs.append((reader, DataWriter(participant, Topic(participant, f"Out{seed}", type_), qos=KEPT)))
    say("READY")
    while not is_released():
        for reader, writer in pairs:
            for sample in reader.take(16):
                if sample.sample_info.valid_data:
                    writer.write(sample)
        time.sleep(0.005)


if __name__ == "__main__":
    main([int(argument) for argument in sys.argv[1:]])
