"""Random IDL text and random samples of its types, from a seed: to be compared with what other stacks make of them."""

from __future__ import annotations

import random
import struct
from typing import Any

from ddsi.xtypes.model import (
    ArrayType,
    BitmaskType,
    EnumType,
    IdlType,
    Member,
    Primitive,
    SequenceType,
    String,
    StructType,
    UnionType,
)

__all__ = ["RandomIdl", "random_sample"]

PRIMITIVES = [
    *("octet", "char", "boolean", "short", "unsigned short", "long", "unsigned long", "long long"),
    *("unsigned long long", "float", "double", "string", "string<7>", "string<400>"),
]

LIMITS = {"short": -5, "unsigned long": 4000000, "long long": 70000000000, "unsigned long long": 7, "double": 0.5}
"""Some numbers, and what they may be at most."""

LABELS = {"boolean": ["TRUE", "FALSE"], "char": ["'a'", "'b'", "'c'"], "long": ["-1", "2", "30"]}


class RandomIdl:
    """A module ``m`` of a few types, of which each may need those before it; ``Top`` needs all."""

    def __init__(self, seed: int, *, keys: bool = False, enums: bool = False) -> None:
        self._random = random.Random(seed)
        self._keys = keys
        self._enums = enums
        self._names = ["Bits"]
        self._structs: dict[str, list[str]] = {}
        self._keyed: set[str] = set()

    def text(self) -> str:
        bound = self._random.choice([8, 12, 16, 32, 64])
        lines = [f"@bit_bound({bound}) bitmask Bits {{ b0, @position(5) b5 }};"]
        if self._enums:
            lines.append(self._enum("Wide", ""))
            lines += [self._enum("Narrow", self._random.choice(["8", "16"]))] if self._random.random() < 0.3 else []
        for number in range(self._random.randint(2, 8)):
            make = self._random.choices([self._typedef, self._struct, self._union], [4, 4, 2])[0]
            lines.append(make(number))
        key = "@key long id; " if self._keys else ""
        members = " ".join(f"{name} x{number};" for number, name in enumerate(self._names))
        extensibility = self._random.choice(["final", "appendable", "mutable"]) if self._keys else "final"
        return "\n".join(["module m {", *lines, f"@{extensibility} struct Top {{ {key}{members} }};", "};"])

    def _enum(self, name: str, bit_bound: str) -> str:
        self._names.append(name)
        annotation = f"@bit_bound({bit_bound}) " if bit_bound else ""
        return f"{annotation}enum {name} {{ {name}_A, {name}_B, @value({self._random.randint(2, 100)}) {name}_C }};"

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
        base = choice(bases) if bases and self._random.random() < 0.5 else ""
        keyed = self._keys and base not in self._keyed and self._random.random() < 0.5
        if keyed or base in self._keyed:
            self._keyed.add(f"S{number}")
        members = []
        for index in range(self._random.randint(1, 5)):
            if keyed and index != 1:
                key_type = choice(["short", "string", "string<5>", "octet", "long long", *sorted(self._keyed)[:-1]])
                members.append(f"@key @hashid {key_type} s{number}m{index};")
                continue
            flags = choice(["", "", "@optional", "@external"]) + choice(
                ["", "", " @hashid", f' @hashid("h{number}_{index}")']
            )
            if extensibility == "mutable":
                flags += choice(["", " @must_understand"])
            flags += choice(["", "", ' @unit("m/s")', " @try_construct(USE_DEFAULT)"])
            type_, dimensions = self._type(), choice(["", "", "[4]", "[2][2]"])
            if type_.startswith("string<") and not dimensions and "try_construct" not in flags:
                flags += " @try_construct(TRIM)"
            if type_ in LIMITS and not self._keys:  # with keys samples are made, and not made to fit
                flags += choice(["", " @range(min=0, max=100)", f" @max({LIMITS[type_]})"])
            members.append(f"{flags} {type_} s{number}m{index}{dimensions};")
        annotations = f"@{extensibility}{choice(['', ' @autoid(HASH)'])}{choice(['', ' @nested'])}"
        bases.append(f"S{number}")
        self._names.append(f"S{number}")
        return f"{annotations} struct S{number} {f': {base}' if base else ''} {{ {' '.join(members)} }};"

    def _union(self, number: int) -> str:
        discriminator = self._random.choice([*LABELS, "Wide"] if self._enums else list(LABELS))
        labels = LABELS.get(discriminator, ["Wide_A", "Wide_C"])
        most = 1 if discriminator == "boolean" and self._enums else len(labels)
        cases = [
            f"case {label}: @id({index + 3}) {self._type()} u{number}m{index};"
            for index, label in enumerate(labels[: self._random.randint(1, most)])
        ]
        if self._enums and discriminator == "long":
            cases[0] = f"case 1000: case -7: {cases[0]}"
        if discriminator != "boolean":
            cases.append(f"default: @id(77) {self._type()} u{number}d;")
        extensibility = self._random.choice(["final", "appendable"])
        self._names.append(f"U{number}")
        return f"@{extensibility} union U{number} switch ({discriminator}) {{ {' '.join(cases)} }};"


def random_sample(type_: IdlType, dice: random.Random) -> Any:
    """A value of a type, as small as it may be nested and as large as it is cheap to compare."""
    match type_:
        case Primitive():
            return _item(type_, dice)
        case String():
            return _text(type_, dice)
        case EnumType():
            return dice.choice(list(type_.python_class))
        case BitmaskType():
            return type_.python_class(dice.choice([0, *type_.python_class, sum(type_.python_class)]))
        case SequenceType():
            count = min(dice.choice([0, 1, 2, 3]), type_.bound or 3)
            return [random_sample(type_.element, dice) for _ in range(count)]
        case ArrayType():
            return _rows(type_.element, type_.dimensions, dice)
        case StructType():
            return type_.python_class(**{member.name: _member(member, dice) for member in type_.members})
        case UnionType():
            case = dice.choice(type_.cases)
            return type_.python_class(**{case.name: random_sample(case.type, dice)})
        case _:
            raise NotImplementedError(str(type_))


def _member(member: Member, dice: random.Random) -> Any:
    return None if member.is_optional and dice.random() < 0.4 else random_sample(member.type, dice)


def _rows(element: IdlType, dimensions: tuple[int, ...], dice: random.Random) -> list[Any]:
    if not dimensions:
        return random_sample(element, dice)  # type: ignore[no-any-return]
    return [_rows(element, dimensions[1:], dice) for _ in range(dimensions[0])]


def _item(type_: Primitive, dice: random.Random) -> Any:
    if type_.name == "boolean":
        return dice.random() < 0.5
    if type_.name == "char":
        return chr(dice.randrange(1, 128))
    if type_.code in "fd":
        number = dice.choice([0.0, -0.5, dice.uniform(-1e9, 1e9)])
        return struct.unpack(type_.code, struct.pack(type_.code, number))[0]
    bits = 8 * type_.size
    number = dice.getrandbits(bits)
    return number - (1 << bits - 1) if type_.code.islower() else number


def _text(type_: String, dice: random.Random) -> str:
    text = "".join(dice.choice("aZ~ \u00e9\u20ac\U0001f600") for _ in range(dice.randrange(6)))
    while type_.bound is not None and len(text.encode()) > type_.bound:
        text = text[:-1]
    return text
