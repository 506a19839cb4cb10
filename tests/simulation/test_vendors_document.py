"""docs/vendors.md names what there is: every quirk with the vendors that have it and a test of it; its code runs."""

from __future__ import annotations

import re
from pathlib import Path

from ddsi.simulation import VENDORS, quirks
from ddsi.structure.vendor import vendor_name

ROOT = Path(__file__).parents[2]
PAGE = (ROOT / "docs" / "vendors.md").read_text(encoding="utf-8")
TESTS = [ROOT / "tests/simulation/test_quirks.py", ROOT / "tests/security/simulated/test_vendor_quirks.py"]
ROWS = {match[1]: match[2].split(" | ") for match in re.finditer(r"^\| `(\w+)`: (.*) \|$", PAGE, re.M)}


def test_every_quirk_is_there_with_its_vendors() -> None:
    assert set(ROWS) == set(quirks.__all__) - {"Quirk"}
    for name, (_, who, *_) in ROWS.items():
        having = [vendor.name for vendor in VENDORS if getattr(quirks, name) in vendor.quirks]
        assert who == (", ".join(having) or "hosts of that byte order"), name


def test_its_tests_exist() -> None:
    there = {name for path in TESTS for name in re.findall(r"^def (test_\w+)", path.read_text(encoding="utf-8"), re.M)}
    assert all(path.relative_to(ROOT).as_posix() in PAGE for path in TESTS)
    assert set(re.findall(r"`(test_\w+)`", PAGE)) <= there
    assert all(re.fullmatch(r"`test_\w+`", row[-1]) for row in ROWS.values())


def test_its_code_runs() -> None:
    names: dict[str, object] = {}
    blocks = re.findall(r"^```python\n(.*?)^```", PAGE, re.M | re.S)
    assert len(blocks) == 2
    for block in blocks:
        exec(compile(block, "docs/vendors.md", "exec"), names)
    asking = names["ASKING"]
    assert vendor_name(asking.vendor_id) == "vendor 01.ee"  # type: ignore[attr-defined]
