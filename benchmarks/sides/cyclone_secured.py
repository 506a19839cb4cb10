"""Cyclone, secured: the roles of secured participants, played by Debian's Cyclone DDS 0.10 through a C program.

That is compiled when it is first needed; this process becomes it.
"""

from __future__ import annotations

import os
import sys
import sysconfig
from typing import NoReturn

from multiproc_tests.framework.errors import Unavailable
from multiproc_tests.peers.build import Recipe, build

from .protocol import play

_MULTIARCH = sysconfig.get_config_var("MULTIARCH") or "x86_64-linux-gnu"

FIRST_SAMPLE = Recipe(
    program="cyclone_first_sample",
    sources=("cyclone_first_sample.c", "shapes.idl"),
    tools=("gcc", "idlc"),
    header="/usr/include/dds/dds.h",
    packages="gcc libc6-dev cyclonedds-dev cyclonedds-tools",
    commands=(
        ("idlc", "-l", "c", "{sources}/shapes.idl"),
        (
            *("gcc", "-O2", "-Wall", "-Wextra", "-I", "."),
            f'-DSECURITY_LIBRARIES="/usr/lib/{_MULTIARCH}/libddsc0debian"',
            *("{sources}/cyclone_first_sample.c", "shapes.c", "-o", "cyclone_first_sample", "-lddsc"),
        ),
    ),
)


def offer_secret(domain: int, enclave: str) -> NoReturn:
    _become("offer_secret", domain, enclave)


def learn_secret(domain: int, enclave: str) -> NoReturn:
    _become("learn_secret", domain, enclave)


def _become(role: str, domain: int, enclave: str) -> NoReturn:
    try:
        program = build(FIRST_SAMPLE)
    except Unavailable as error:
        sys.exit(str(error))
    os.execv(program, [str(program), role, str(domain), enclave])


if __name__ == "__main__":
    play({"offer_secret": offer_secret, "learn_secret": learn_secret})
