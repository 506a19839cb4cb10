"""A program that starts again under its former Guid, as some do in containers: nothing that was known of it holds."""

from __future__ import annotations

from pathlib import Path

import pytest

from ddsi.simulation import Domain, LinkConditions
from ddsi.simulation.endpoints import NodeReader
from ddsi.structure.guid import GuidPrefix
from ddsi.structure.qos import Qos
from ddsi.structure.qos_policies import KeepAll, Reliable, TransientLocal

from .keystores import GOVERNANCES, make_identities

LATE = Qos(reliability=Reliable(), history=KeepAll(), durability=TransientLocal())
CANDIDATE = GuidPrefix(b"\x01\xddcontainer1")


def samples(reader: NodeReader) -> list[int]:
    return [change.sequence_number for info, change in reader.taken if info.valid_data]


@pytest.mark.parametrize("governance", list(GOVERNANCES))
@pytest.mark.parametrize("loss", [0.0, 0.2])
def test_it_begins_anew(governance: str, loss: float, tmp_path: Path) -> None:
    """Its numbers are those of the former program: told by them alone, its first sample would be a repetition."""
    domain = Domain(7, conditions=LinkConditions(loss=loss, jitter=0.002))
    a, b = (domain.node(properties=properties) for properties in make_identities(tmp_path, governance)[:2])
    a.kill()
    a.start(CANDIDATE)
    reader, answering = b.reader("Square", LATE), b.writer("Answers", LATE)
    a.writer("Square", LATE).write()
    answering.write()
    assert domain.run_until(lambda: samples(reader) == [1], 60)
    guid = a.guid
    a.kill()
    a.start(CANDIDATE)
    assert a.guid == guid
    writer, answers = a.writer("Square", LATE), a.reader("Answers", LATE)
    writer.write()
    writer.write()
    # Where nothing protects the data, a sample of the new program may come before anybody knows that it is another one.
    expected = [[1, 1, 2], [1, 2, 1, 2]] if governance == "nothing" else [[1, 1, 2]]
    assert domain.run_until(lambda: samples(reader) in expected and samples(answers) == [1], 60)
