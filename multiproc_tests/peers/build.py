"""Compiles the C and C++ peers, once for each state of their sources, into ``build/peers`` beside the project's code.

The folder's name holds a hash of sources and commands, so that a changed program is never mistaken for the old one, and
a finished build is moved into place as a whole, so that no half of one is ever seen.  ``DDSI_PEERS_BUILD`` names
another folder.
"""

from __future__ import annotations

import hashlib
import os
import shutil
import subprocess
import sysconfig
import tempfile
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from ..framework.errors import Unavailable

__all__ = ["CYCLONE", "CYCLONE_SHAPE_MAIN", "FASTDDS", "FASTDDS_FILTERED", "PROGRAMS", "Recipe", "build"]

ROOT = Path(__file__).resolve().parents[2]
PROGRAMS = Path(__file__).resolve().parent / "programs"
BUILD_FOLDER_VARIABLE = "DDSI_PEERS_BUILD"


@dataclass(frozen=True, slots=True)
class Recipe:
    """How one program is made: its sources, what must be installed, and the commands, run in the build folder."""

    program: str
    sources: tuple[str, ...]
    tools: tuple[str, ...]
    header: str
    packages: str
    commands: tuple[tuple[str, ...], ...]


_MULTIARCH = sysconfig.get_config_var("MULTIARCH") or "x86_64-linux-gnu"

CYCLONE = Recipe(
    program="cyclone_shapes",
    sources=("cyclone_shapes.c", "payload.h", "shapes.idl"),
    tools=("gcc", "idlc"),
    header="/usr/include/dds/dds.h",
    packages="gcc libc6-dev cyclonedds-dev cyclonedds-tools",
    commands=(
        ("idlc", "-l", "c", "{sources}/shapes.idl"),
        (
            *("gcc", "-O1", "-Wall", "-Wextra", "-I", ".", "-I", "{sources}"),
            f'-DSECURITY_LIBRARIES="/usr/lib/{_MULTIARCH}/libddsc0debian"',
            *("{sources}/cyclone_shapes.c", "shapes.c", "-o", "cyclone_shapes", "-lddsc"),
        ),
    ),
)

CYCLONE_SHAPE_MAIN = Recipe(
    program="cyclone_shape_main",
    sources=("cyclone_shape_main.c", "suite_shape.idl"),
    tools=("gcc", "idlc"),
    header="/usr/include/dds/dds.h",
    packages="gcc libc6-dev cyclonedds-dev cyclonedds-tools",
    commands=(
        ("idlc", "-l", "c", "{sources}/suite_shape.idl"),
        (
            *("gcc", "-O1", "-Wall", "-Wextra", "-I", ".", "{sources}/cyclone_shape_main.c", "suite_shape.c"),
            *("-o", "cyclone_shape_main", "-lddsc"),
        ),
    ),
)

FASTDDS = Recipe(
    program="fastdds_shapes",
    sources=("fastdds_shapes.cpp", "fastdds_types.hpp", "payload.h"),
    tools=("g++",),
    header="/usr/include/fastdds/dds/domain/DomainParticipant.hpp",
    packages="g++ libfastrtps-dev libfastcdr-dev",
    commands=(
        (
            *("g++", "-std=c++17", "-O1", "-Wall", "-Wextra", "-Wno-deprecated-declarations", "-I", "{sources}"),
            *("{sources}/fastdds_shapes.cpp", "-o", "fastdds_shapes", "-lfastrtps", "-lfastcdr"),
        ),
    ),
)

FASTDDS_FILTERED = Recipe(
    program="fastdds_filtered",
    sources=("fastdds_filtered.cpp",),
    tools=("g++",),
    header="/usr/include/fastdds/dds/topic/ContentFilteredTopic.hpp",
    packages="g++ libfastrtps-dev libfastcdr-dev",
    commands=(
        (
            *("g++", "-std=c++17", "-O1", "-Wall", "-Wextra", "-Wno-deprecated-declarations"),
            *("{sources}/fastdds_filtered.cpp", "-o", "fastdds_filtered", "-lfastrtps", "-lfastcdr"),
        ),
    ),
)


def build(recipe: Recipe) -> Path:
    """The compiled program, made now if it was not made before (some seconds).

    Raises Unavailable if something that must be installed is not, and RuntimeError with what the compiler said if the
    program does not compile.
    """
    for tool in recipe.tools:
        if shutil.which(tool) is None:
            raise Unavailable(f"the program {tool!r} is missing: apt-get install {recipe.packages}")
    if not Path(recipe.header).exists():
        raise Unavailable(f"{recipe.header} is missing: apt-get install {recipe.packages}")
    parent = Path(os.environ.get(BUILD_FOLDER_VARIABLE) or ROOT / "build" / "peers")
    folder = parent / f"{recipe.program}-{_fingerprint(recipe)}"
    if not (folder / recipe.program).exists():
        parent.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryDirectory(dir=parent) as workshop:
            for command in recipe.commands:
                _run([word.replace("{sources}", os.fspath(PROGRAMS)) for word in command], Path(workshop))
            _move_into_place(Path(workshop), folder)
    return folder / recipe.program


def _fingerprint(recipe: Recipe) -> str:
    digest = hashlib.sha256(repr(recipe.commands).encode())
    for source in recipe.sources:
        digest.update(b"\0" + source.encode() + b"\0" + (PROGRAMS / source).read_bytes())
    return digest.hexdigest()[:12]


def _run(command: Sequence[str], folder: Path) -> None:
    result = subprocess.run(command, cwd=folder, check=False, capture_output=True, text=True)
    if result.returncode != 0:
        raise RuntimeError(f"{' '.join(command)} failed:\n{result.stdout}{result.stderr}")


def _move_into_place(workshop: Path, folder: Path) -> None:
    """Renames the finished folder; if another run was faster, its equal work is used."""
    finished = workshop / "finished"
    finished.mkdir()
    for item in list(workshop.iterdir()):
        if item != finished:
            item.rename(finished / item.name)
    try:
        finished.rename(folder)
    except OSError:
        if not folder.exists():
            raise
