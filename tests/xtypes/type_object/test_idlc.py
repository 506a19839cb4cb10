"""Random IDL beside a peer's generator: what ``idlc`` of Cyclone DDS says of each type is what we say of it.

Debian's release is 0.10.2.  It differs from 11.0.1, whose choices are ours, in four points, and the random types avoid
them: keys are to be understood, int8 and uint8 are octets, enums have no default literal, and union members are
numbered from 0.
"""

from __future__ import annotations

import re
import shutil
import subprocess
from pathlib import Path
from typing import Any

import pytest

import ddsi

from ..random_idl import RandomIdl

pytestmark = [
    pytest.mark.peers,
    pytest.mark.skipif(shutil.which("idlc") is None, reason="idlc of Cyclone DDS is not installed"),
]


def generated(text: str, folder: Path) -> dict[str, bytes]:
    """The TypeInformation in the C source for each topic type, by its name in C."""
    (folder / "random.idl").write_text(text)
    subprocess.run(["idlc", "-l", "c", "random.idl"], cwd=folder, check=True, capture_output=True, timeout=60)
    source = (folder / "random.c").read_text()
    arrays = re.findall(r"#define TYPE_INFO_CDR_(\w+) \((?:const )?unsigned char \[\]\)\{(.*?)\n\}", source, re.DOTALL)
    return {name: bytes.fromhex("".join(re.findall(r"0x(\w\w)", octets))) for name, octets in arrays}


@pytest.mark.parametrize("seed", range(12))
def test_random_types_are_the_same_types(seed: int, tmp_path: Path) -> None:
    text = RandomIdl(seed).text()
    namespace: Any = ddsi.idl.loads(text)
    found = generated(text, tmp_path)
    assert "m_Top" in found
    for name, octets in found.items():
        type_ = getattr(namespace.m, name.removeprefix("m_"))
        assert ddsi.type_information(type_).encode().hex() == octets.hex(), f"{name} in\n{text}"
