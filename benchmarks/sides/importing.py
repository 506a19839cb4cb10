"""Importing: how long it takes to import modules in a fresh interpreter that has imported next to nothing yet."""

from __future__ import annotations

import importlib
import time

from .protocol import play


def import_all(modules: list[str]) -> dict[str, float]:
    start = time.perf_counter()
    for module in modules:
        importlib.import_module(module)
    return {"ms": (time.perf_counter() - start) * 1e3}


if __name__ == "__main__":
    play({"import": import_all})
