"""What ``ddsi explain`` and ``ddsi keystore explain`` do: ask, and print the answer as text or JSON."""

from __future__ import annotations

import argparse
import json

from ddsi.structure.errors import BadParameter

from ..access_control.decision import Step
from ..attributes import DataTags
from .explanation import Explanation, Question
from .explanation import explain as explain_question
from .survey import Enclave, find_enclaves

__all__ = ["explain"]


def explain(arguments: argparse.Namespace) -> int:
    """0 if it may, 1 if it may not."""
    question = _question(arguments)
    enclave = _enclave(arguments)
    answer = explain_question(enclave, question, now=arguments.wall_clock())
    if arguments.json:
        print(json.dumps(_as_json(answer), indent=2))
    else:
        _print(answer)
    return 0 if answer.allowed else 1


def _question(arguments: argparse.Namespace) -> Question:
    is_join = arguments.question == "join"
    if is_join and (arguments.topic or arguments.partitions or arguments.tags):
        raise BadParameter("to join is a matter of the domain alone: leave out topic, partitions and tags")
    if not is_join and not arguments.topic:
        raise BadParameter(f"{arguments.question} which topic? Name it after the verb")
    return Question(
        verb=arguments.question,
        domain_id=arguments.domain,
        topic=arguments.topic or "",
        partitions=tuple(arguments.partitions),
        data_tags=_tags(arguments.tags),
    )


def _tags(texts: list[str]) -> DataTags:
    tags = []
    for text in texts:
        name, equals, value = text.partition("=")
        if not equals:
            raise BadParameter(f"a data tag is NAME=VALUE, not {text!r}")
        tags.append((name, value))
    return tuple(tags)


def _enclave(arguments: argparse.Namespace) -> Enclave:
    enclaves = find_enclaves(arguments.folder)
    names = ", ".join(enclave.name for enclave in enclaves)
    wanted = (arguments.identity or "").strip("/")
    if wanted:
        enclaves = [enclave for enclave in enclaves if enclave.name == wanted]
        if not enclaves:
            raise BadParameter(f"{arguments.folder} holds no identity {wanted!r}; there are {names}")
    if len(enclaves) > 1:
        raise BadParameter(f"whose rights? Say --identity NAME; {arguments.folder} holds {names}")
    return enclaves[0]


def _print(answer: Explanation) -> None:
    if answer.allowed:
        print(f"Yes: {answer.subject} may {answer.question}.")
    else:
        print(f"No: {answer.subject} may not {answer.question}.\n  {answer.reason}")
    for name, decision in answer.stages:
        print(f"{name}: {'yes' if decision.allowed else 'no'}")
        for step in decision.steps:
            print(f"  {step}")
    if answer.protection:
        print("protection:")
        for layer in answer.protection:
            print(f"  {layer.path}:{layer.line}: {layer.element} {layer.value}: {layer.effect}")


def _as_json(answer: Explanation) -> dict[str, object]:
    question = answer.question
    return {
        "allowed": answer.allowed,
        "reason": answer.reason,
        "subject": answer.subject,
        "question": question.verb,
        "domain_id": question.domain_id,
        "topic": question.topic,
        "partitions": list(question.partitions),
        "data_tags": dict(question.data_tags),
        "stages": [
            {"stage": name, "allowed": decision.allowed, "steps": [_step(step) for step in decision.steps]}
            for name, decision in answer.stages
        ],
        "protection": [
            {"file": str(one.path), "line": one.line, "element": one.element, "value": one.value, "effect": one.effect}
            for one in answer.protection
        ],
    }


def _step(step: Step) -> dict[str, object]:
    return {
        "file": step.document,
        "line": step.line,
        "rule": step.rule,
        "criterion": step.criterion,
        "applies": step.applies,
        "why": step.why,
    }
