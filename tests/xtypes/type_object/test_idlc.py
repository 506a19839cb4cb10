"""Random IDL beside a peer's generator: what ``idlc`` of Cyclone DDS says of each type is what we say of it.

Debian's release is 0.10.2.  It differs from 11.0.1, whose choices are ours, in four points, and the random types avoid
them: keys are to be understood, int8 and uint8 are octets, enums have no default literal, and union members are
numbered from 0.
"""

from __future__ import annotations

import random
import re
import shutil
import subprocess
from pathlib import Path
from typing import Any

import pytest

import ddsi

pytestmark = [
    pytest.mark.peers,
    pytest.mark.skipif(shutil.which("idlc") is None, reason="idlc of Cyclone DDS is not installed"),
]

PRIMITIVES = [
    *("octet", "char", "boolean", "short", "unsigned short", "long", "unsigned long", "long long"),
    *("unsigned long long", "float", "double", "string", "string<7>", "string<400>"),
]
LABELS = {"boolean": ["TRUE", "FALSE"], "char": ["'a'", "'b'", "'c'"], "long": ["-1", "2", "30"]}


class RandomIdl:
    """A module ``m`` of a few types, of which each may need those before it; ``Top`` needs all."""

    def __init__(self, seed: int) -> None:
        self._random = random.Random(seed)
        self._names = ["Bits"]
        self._structs: dict[str, list[str]] = {}

    def text(self) -> str:
        bound = self._random.choice([8, 12, 16, 32, 64])
        lines = [f"@bit_bound({bound}) bitmask Bits {{ b0, @position(5) b5 }};"]
        for number in range(self._random.randint(2, 8)):
            make = self._random.choices([self._typedef, self._struct, self._union], [4, 4, 2])[0]
            lines.append(make(number))
        members = " ".join(f"{name} x{number};" for number, name in enumerate(self._names))
        return "\n".join(["module m {", *lines, f"@final struct Top {{ {members} }};", "};"])

    def _type(self, depth: int = 0) -> str:
        kind = self._random.random()
        if kind < 0.5 or depth > 2:
            return self._random.choice(PRIMITIVES)
        if kind < 0.75:
            return self._random.choice(self._names)
        return f"sequence<{self._type(depth + 1)}{self._random.choice(['', ', 3', ', 300'])} >"

    def _typedef(self, number: int) -> str:
        line = f"typedef {self._type()} A{number}{self._random.choice(['', '', '[3]', '[2][300]'])};"
        self._names.append(f"A{number}")
        return line

    def _struct(self, number: int) -> str:
        choice = self._random.choice
        extensibility = choice(["final", "appendable", "mutable"])
        bases = self._structs.setdefault(extensibility, [])
        base = f": {choice(bases)}" if bases and self._random.random() < 0.5 else ""
        members = []
        for index in range(self._random.randint(1, 5)):
            flags = choice(["", "", "@optional", "@external"]) + choice(
                ["", "", " @hashid", f' @hashid("h{number}_{index}")']
            )
            if extensibility == "mutable":
                flags += choice(["", " @must_understand"])
            members.append(f"{flags} {self._type()} s{number}m{index}{choice(['', '', '[4]', '[2][2]'])};")
        annotations = f"@{extensibility}{choice(['', ' @autoid(HASH)'])}{choice(['', ' @nested'])}"
        bases.append(f"S{number}")
        self._names.append(f"S{number}")
        return f"{annotations} struct S{number} {base} {{ {' '.join(members)} }};"

    def _union(self, number: int) -> str:
        discriminator = self._random.choice(list(LABELS))
        labels = LABELS[discriminator]
        cases = [
            f"case {label}: @id({index + 3}) {self._type()} u{number}m{index};"
            for index, label in enumerate(labels[: self._random.randint(1, len(labels))])
        ]
        if discriminator != "boolean":
            cases.append(f"default: @id(77) {self._type()} u{number}d;")
        extensibility = self._random.choice(["final", "appendable"])
        self._names.append(f"U{number}")
        return f"@{extensibility} union U{number} switch ({discriminator}) {{ {' '.join(cases)} }};"


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
