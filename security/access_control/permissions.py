"""Permissions: what the bearers of subject names may do.  DDS-Security 1.1 §9.4.1.3.

    Permissions.parse(xml: bytes, *, name: str, first_line: int = 1) -> Permissions    raises DocumentError
    permissions.grant_for(subject: SubjectName, now: int) -> Grant | Refused           now: ns since 1970

What a grant allows, ``decision.py`` finds.  Values only: they hold no plugin and no signature, so that the keystore's
tools and the plugin reason from one code.
"""

from __future__ import annotations

from dataclasses import field
from enum import Enum

from ddsi.spi import Refused
from ddsi.structure.dataclass import dataclass
from ddsi.structure.errors import MalformedMessage

from ..attributes import DataTags
from .document_error import titled
from .domains import Domains, expression_of
from .subject_name import SubjectName
from .validity import Validity
from .wildcard import matches
from .xml_document import Node, parse_document

__all__ = ["ActionKind", "Criterion", "Grant", "Permissions", "Rule"]


class ActionKind(Enum):
    """What a criterion is about (§9.4.1.3.2.3); the values are the words of the documents."""

    PUBLISH = "publish"
    SUBSCRIBE = "subscribe"
    RELAY = "relay"


@dataclass(frozen=True, slots=True, kw_only=True)
class Criterion:
    """One ``<publish>``, ``<subscribe>`` or ``<relay>``.  ``partitions`` and ``data_tags`` may be empty."""

    kind: ActionKind
    line: int
    topics: tuple[str, ...]
    partitions: tuple[str, ...] = ()
    data_tags: DataTags = ()


@dataclass(frozen=True, slots=True, kw_only=True)
class Rule:
    """An ``<allow_rule>`` or ``<deny_rule>`` for some domains."""

    is_allow: bool
    line: int
    label: str
    domains: Domains
    criteria: tuple[Criterion, ...]


@dataclass(frozen=True, slots=True, kw_only=True)
class Grant:
    """What one subject may do.  ``subject`` is None where ``subject_expression``, of 1.2, says who is meant."""

    document: str
    name: str
    line: int
    subject: SubjectName | None
    subject_expression: str
    validity: Validity
    rules: tuple[Rule, ...] = field(repr=False)
    default_allow: bool

    def is_for(self, subject: SubjectName) -> bool:
        if self.subject is not None:
            return self.subject == subject
        return matches(self.subject_expression, subject.text)

    def __str__(self) -> str:
        """Where it stands, as sentences about it begin."""
        name = f"grant {self.name!r}" if self.name else "its grant"
        return f"{titled('permissions', self.document)}, {name} (line {self.line})"


@dataclass(frozen=True, slots=True)
class Permissions:
    """A permissions document."""

    name: str
    grants: tuple[Grant, ...] = field(repr=False)

    @classmethod
    def parse(cls, xml: bytes, *, name: str, first_line: int = 1) -> Permissions:
        """From its XML, which somebody has verified; ``first_line``: of the file, where the XML begins."""
        root = parse_document(xml, name=name, first_line=first_line)
        permissions = root.find("permissions")
        if permissions is None:
            remedy = "a permissions document has <permissions> inside <dds>"
            raise root.error("it is a governance document, not permissions", remedy=remedy)
        return cls(name, tuple(_grant(node) for node in permissions.all("grant")))

    def grant_for(self, subject: SubjectName, now: int) -> Grant | Refused:
        """The first grant for the subject, if it is valid at ``now`` (§9.4.1.3.2.1).

        A name is to have one grant only.  Where it has several, Cyclone DDS and we look at the first alone, Fast DDS
        and RustDDS at the first that is valid.
        """
        grants = [grant for grant in self.grants if grant.is_for(subject)]
        if not grants:
            named = [str(grant.subject or grant.subject_expression) for grant in self.grants[:3]]
            more = f" and {len(self.grants) - 3} more" if len(self.grants) > 3 else ""
            return Refused(
                f"{titled('permissions', self.name)}: no grant is for the subject {subject}; there are grants for "
                f"{', '.join(named)}{more}"
            )
        grant, *others = grants
        if problem := grant.validity.problem(now):
            valid = next((other for other in others if now in other.validity), None)
            hint = (
                f"the one in line {valid.line} is valid, but the first for a name decides"
                if valid
                else "it needs other dates, and to be signed anew: `ddsi keystore permissions`"
            )
            return Refused(f"{grant} {problem}; {hint}")
        return grant


def _grant(node: Node) -> Grant:
    subject, expression = _subject(node)
    default = node.get("default")
    return Grant(
        document=node.document,
        name=node.name,
        line=node.line,
        subject=subject,
        subject_expression=expression,
        validity=Validity.from_node(node.get("validity")),
        rules=tuple(_rule(rule) for rule in node.nodes if rule.tag in ("allow_rule", "deny_rule")),
        default_allow=default.text == "ALLOW",
    )


def _subject(node: Node) -> tuple[SubjectName | None, str]:
    name, expression = node.find("subject_name"), node.find("subject_name_expression")
    if name is not None and expression is not None:
        raise expression.error("a grant has a <subject_name> or a <subject_name_expression>, not both")
    if expression is not None:
        return None, expression_of(expression)
    name = node.get("subject_name")
    try:
        return SubjectName.parse(name.text), ""
    except MalformedMessage as error:
        remedy = "write what `openssl x509 -noout -subject -nameopt RFC2253` prints, such as CN=alice,O=Example"
        raise name.error(f"<subject_name> cannot be read: {error.reason}", remedy=remedy) from error


def _rule(node: Node) -> Rule:
    criteria = tuple(_criterion(child) for child in node.nodes if child.tag != "domains")
    return Rule(
        is_allow=node.tag == "allow_rule",
        line=node.line,
        label=f"{node.tag} {node.name!r}" if node.name else node.tag,
        domains=Domains.from_node(node.get("domains")),
        criteria=criteria,
    )


def _criterion(node: Node) -> Criterion:
    partitions, tags = node.find("partitions"), node.find("data_tags")
    return Criterion(
        kind=ActionKind(node.tag),
        line=node.line,
        topics=tuple(expression_of(topic) for topic in node.get("topics").nodes),
        partitions=tuple(expression_of(partition) for partition in partitions.nodes) if partitions else (),
        data_tags=tuple((tag.get("name").text, tag.get("value").text) for tag in tags.nodes) if tags else (),
    )
