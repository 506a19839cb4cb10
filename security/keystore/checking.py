"""What ``ddsi keystore check`` does: finds, and prints as text or JSON."""

from __future__ import annotations

import argparse
import json
from collections import Counter

from ddsi.structure.errors import BadParameter

from .finding import Finding, Severity
from .horizon import Horizon
from .linter import RULES, check_keystore

__all__ = ["check"]


def check(arguments: argparse.Namespace) -> int:
    """0, or 1 if there is an error; warnings and notes change nothing."""
    if arguments.rules:
        for rule in RULES.values():
            print(f"{rule.id:<28} {rule.severity:<8} {rule.summary}")
        return 0
    if not arguments.folders:
        raise BadParameter("which keystore? Name a folder")
    _refuse_unknown(arguments.ignore)
    horizon = Horizon.of_days(arguments.wall_clock(), arguments.soon)
    findings = [finding for folder in arguments.folders for finding in check_keystore(folder, horizon)]
    findings = [finding for finding in findings if finding.rule.id not in arguments.ignore]
    counts = Counter(finding.rule.severity for finding in findings)
    if arguments.json:
        print(json.dumps(_as_json(findings, counts), indent=2))
    else:
        for finding in findings:
            print(finding)
        print(", ".join(_count(counts[severity], severity) for severity in Severity) + ".")
    return 1 if counts[Severity.ERROR] else 0


def _refuse_unknown(ignored: list[str]) -> None:
    for name in ignored:
        if name not in RULES:
            raise BadParameter(f"there is no rule {name!r}: ddsi keystore check --rules lists them")


def _as_json(findings: list[Finding], counts: Counter[Severity]) -> dict[str, object]:
    totals = {f"{severity}s": counts[severity] for severity in Severity}
    return {**totals, "findings": [finding.as_json() for finding in findings]}


def _count(number: int, severity: Severity) -> str:
    return f"{number} {severity}" if number == 1 else f"{number} {severity}s"
