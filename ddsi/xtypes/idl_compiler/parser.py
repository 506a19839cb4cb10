"""The parser: tokens to the syntax tree, by recursive descent (OMG IDL 4.2 §7.4, the data types of DDS).

Here are definitions and types; ``expressions.py`` has the rest.  Where something else stands than the grammar wants,
IdlError says what was expected.  Interfaces and their like, which are no data, are passed over with a warning.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Sequence

from .annotations import BUILTIN
from .directives import Directives
from .expressions import KEYWORDS, ExpressionParser
from .source_text import IdlError, IdlWarning
from .syntax import (
    Annotation,
    BasicSpec,
    BitfieldNode,
    BitmaskNode,
    BitsetNode,
    CaseNode,
    ConstNode,
    Declarator,
    Definition,
    EnumeratorNode,
    EnumNode,
    Expression,
    ForwardNode,
    KeylistNode,
    MapSpec,
    MemberNode,
    ModuleNode,
    Name,
    NameSpec,
    SequenceSpec,
    SkippedNode,
    StringSpec,
    StructNode,
    TypedefNode,
    TypeSpec,
    UnionNode,
)
from .tokens import Token, TokenKind

__all__ = ["Parser"]

_BASIC = {
    "boolean": "boolean",
    "octet": "octet",
    "char": "char",
    "wchar": "wchar",
    "short": "int16",
    "float": "float32",
    "double": "float64",
    **{name: name for name in ("int8", "uint8", "int16", "uint16", "int32", "uint32", "int64", "uint64")},
}
_UNFIT_TYPES = {
    "any": "any holds values of every type, which DDS cannot send; use a union",
    "fixed": "fixed-point numbers are not supported; use double, or an integer and a scale",
    "Object": "object references are no data",
    "void": "void is no type of a value",
    "native": "native types are no data",
    "ValueBase": "value types are no data",
}
_SKIPPED = frozenset(
    (
        "interface",
        "valuetype",
        "exception",
        "native",
        "typeid",
        "typeprefix",
        "import",
        "component",
        "home",
        "eventtype",
    )
)
_JOINTS = re.compile(r"\s*(::|\.)\s*")
_IN_MODIFIERS = frozenset(("abstract", "local", "custom"))


class Parser(ExpressionParser):
    """Parses the tokens of one file.  ``warnings`` grow meanwhile."""

    def __init__(self, tokens: Sequence[Token]) -> None:
        super().__init__([token for token in tokens if token.kind is not TokenKind.PRAGMA or _is_keylist(token)])
        self.warnings: list[IdlWarning] = []
        self._directives = Directives(tokens, self.warnings)
        self._declared: set[str] = set()
        """Annotations that the text itself declares: for other programs, and no mistake."""
        self._constructed: dict[str, Callable[[], list[Definition]]] = {
            "struct": self._struct,
            "union": self._union,
            "enum": self._enum,
            "bitmask": self._bitmask,
            "bitset": self._bitset,
        }

    def specification(self) -> list[Definition]:
        """All definitions, up to the end."""
        definitions: list[Definition] = []
        while self.token.kind is not TokenKind.END:
            definitions += self._definition()
        return definitions

    # --- definitions -------------------------------------------------------------------------------------

    def _definition(self) -> list[Definition]:
        comment = self.token.comment
        if self.token.kind is TokenKind.PRAGMA:
            return self._pragma()
        if self.token.text == ";":  # one too many, which every compiler forgives
            self.take()
            return []
        if self.token.text == "@" and self._after().text == "annotation":
            self._skip_braces("annotation")
            return []
        annotations = self.annotations()
        word = self.token.text
        simple = {"module": self._module, "const": self._const, "typedef": self._typedef}
        parse = simple.get(word) or self._constructed.get(word)
        if parse is not None:
            definitions = parse()
        elif word in _SKIPPED or word in _IN_MODIFIERS:
            definitions = self._skipped()
        else:
            raise self.unexpected("a definition (module, struct, union, enum, typedef, const, ...)")
        end = self.expect(";", f"behind the {word}")
        for definition in definitions:
            said = definition.annotations or annotations
            definition.annotations = [*said, *self._directives.behind(end, said)]
            definition.comment = comment
        return definitions

    def _module(self) -> list[Definition]:
        self.take()
        name = self.name("of the module")
        self.expect("{", "behind the name of the module")
        with self.deeper():
            definitions: list[Definition] = []
            while self.token.text != "}":
                definitions += self._definition()
        self.expect("}", "")
        return [ModuleNode(name=name.text, place=name.place, definitions=definitions)]

    def _const(self) -> list[Definition]:
        self.take()
        type_ = self._type()
        name = self.name("of the constant")
        self.expect("=", "behind the name of the constant")
        return [ConstNode(name=name.text, place=name.place, type=type_, value=self.expression())]

    def _typedef(self) -> list[Definition]:
        """Of any type, also of one that is defined in the typedef itself."""
        self.take()
        annotations = self.annotations()
        found: list[Definition] = []
        define = self._constructed.get(self.token.text)
        if define is None:
            type_ = self._type()
        else:
            found = define()
            found[0].annotations = annotations
            type_ = NameSpec(Name((found[0].name,), False, found[0].place))
        for declarator in self._declarators("of the typedef"):
            found.append(
                TypedefNode(name=declarator.name, place=declarator.place, type=type_, dimensions=declarator.dimensions)
            )
        return found

    def _struct(self) -> list[Definition]:
        self.take()
        name = self.name("of the struct")
        if self.token.text == ";":
            return [ForwardNode(name=name.text, place=name.place, kind="struct")]
        base = self._base()
        self.expect("{", "and the members of the struct")
        members: list[MemberNode] = []
        while self.token.text != "}":
            members += self._members()
        self.take()
        return [StructNode(name=name.text, place=name.place, base=base, members=members)]

    def _base(self) -> Name | None:
        if self.token.text != ":":
            return None
        self.take()
        base = self.scoped_name("of the base")
        if self.token.text == ",":
            raise IdlError(self.token.place, "a type has one base at most")
        return base

    def _members(self) -> list[MemberNode]:
        comment = self.token.comment
        annotations = self.annotations()
        if self.token.text in ("struct", "union", "enum", "bitmask", "bitset"):
            raise IdlError(
                self.token.place, f"expected a member; define the {self.token.text} before, and name it here"
            )
        type_ = self._type()
        declarators = self._declarators("of the member")
        end = self.expect(";", "behind the member")
        annotations += self._directives.behind(end, annotations)
        return [
            MemberNode(type=type_, declarator=declarator, annotations=annotations, comment=comment)
            for declarator in declarators
        ]

    def _union(self) -> list[Definition]:
        self.take()
        name = self.name("of the union")
        if self.token.text == ";":
            return [ForwardNode(name=name.text, place=name.place, kind="union")]
        self.expect("switch", "behind the name of the union")
        self.expect("(", "behind 'switch'")
        annotations = self.annotations()
        discriminator = self._type()
        self.expect(")", "behind the discriminator's type")
        self.expect("{", "and the cases of the union")
        cases: list[CaseNode] = []
        while self.token.text != "}":
            cases.append(self._case())
        self.take()
        return [
            UnionNode(
                name=name.text,
                place=name.place,
                discriminator=discriminator,
                discriminator_annotations=annotations,
                cases=cases,
            )
        ]

    def _case(self) -> CaseNode:
        comment = self.token.comment
        labels: list[Expression] = []
        is_default = False
        if self.token.text not in ("case", "default"):
            raise self.unexpected("'case', 'default' or '}'")
        while self.token.text in ("case", "default"):
            if self.take().text == "default":
                is_default = True
            else:
                labels.append(self.expression())
            self.expect(":", "behind the label")
        members = self._members()
        if len(members) != 1:
            raise IdlError(members[1].declarator.place, "a case has one member; expected ';'")
        members[0].comment = members[0].comment or comment
        return CaseNode(labels=labels, is_default=is_default, member=members[0])

    def _enum(self) -> list[Definition]:
        self.take()
        name = self.name("of the enum")
        return [EnumNode(name=name.text, place=name.place, literals=self._enumerators("the enum", "literal"))]

    def _bitmask(self) -> list[Definition]:
        self.take()
        name = self.name("of the bitmask")
        return [BitmaskNode(name=name.text, place=name.place, flags=self._enumerators("the bitmask", "flag"))]

    def _enumerators(self, of: str, what: str) -> list[EnumeratorNode]:
        self.expect("{", f"and the {what}s of {of}")
        found: list[EnumeratorNode] = []
        while self.token.text != "}" or not found:
            comment = self.token.comment
            annotations = self.annotations()
            name = self.name(f"of the {what}")
            value = None
            if self.token.text == "=":
                self.take()
                value = self.expression()
            found.append(
                EnumeratorNode(name=name.text, place=name.place, annotations=annotations, comment=comment, value=value)
            )
            if self.token.text != ",":
                break
            self.take()
        self.expect("}", f"or ',' behind the {what}")
        return found

    def _bitset(self) -> list[Definition]:
        self.take()
        name = self.name("of the bitset")
        base = self._base()
        self.expect("{", "and the fields of the bitset")
        fields: list[BitfieldNode] = []
        while self.token.text != "}":
            fields += self._bitfields()
        self.take()
        return [BitsetNode(name=name.text, place=name.place, base=base, fields=fields)]

    def _bitfields(self) -> list[BitfieldNode]:
        comment = self.token.comment
        annotations = self.annotations()
        place = self.token.place
        self.expect("bitfield", "in the bitset")
        self.expect("<", "behind 'bitfield'")
        width = self.expression(in_template=True)
        type_ = None
        if self.token.text == ",":
            self.take()
            type_ = self._type()
        self.expect(">", "behind the width of the field")
        names = [(name.name, name.place) for name in self._declarators("of the field")] if self._is_name() else []
        self.expect(";", "behind the field")
        return [
            BitfieldNode(width=width, type=type_, name=name, place=where, annotations=annotations, comment=comment)
            for name, where in names or [("", place)]
        ]

    # --- what is no data ---------------------------------------------------------------------------------

    def _skipped(self) -> list[Definition]:
        start = self.token.place
        while self.token.text in _IN_MODIFIERS:
            self.take()
        kind = self.take().text
        name = self.token.text if self.token.kind is TokenKind.NAME else ""
        depth = 0
        while depth > 0 or self.token.text != ";":
            if self.token.kind is TokenKind.END:
                raise IdlError(start, f"the {kind} has no end; expected '}}' and ';'")
            depth += {"{": 1, "}": -1}.get(self.take().text, 0)
        self.warnings.append(IdlWarning(start, f"the {kind} {name} is no data type, and left out"))
        return [SkippedNode(name=name, place=start, kind=kind)] if name else []

    def _skip_braces(self, kind: str) -> None:
        """The declaration of an annotation: what it means to others is not known, so it needs no checking.

        Some files declare the builtin ones, which mean what they always do.
        """
        start = self.take().place
        self.take()
        name = self.name(f"of the {kind}", any_word=True).text
        if name not in BUILTIN:
            self._declared.add(name)
        self.expect("{", f"behind the name of the {kind}")
        depth = 1
        while depth:
            if self.token.kind is TokenKind.END:
                raise IdlError(start, f"the {kind} has no end; expected '}}'")
            depth += {"{": 1, "}": -1}.get(self.take().text, 0)
        self.expect(";", f"behind the {kind}")

    def _pragma(self) -> list[Definition]:
        token = self.take()
        words = _JOINTS.sub(r"\1", token.text.replace(",", " ")).split()
        match words[0]:
            case "keylist" if len(words) > 1:
                return [KeylistNode(name=words[1], place=token.place, members=words[2:])]
            case "DCPS_DATA_KEY" if len(words) > 2:  # OpenDDS: "module::Type member"
                return [KeylistNode(name="::" + words[1].strip('"'), place=token.place, members=[words[2].strip('"')])]
            case _:
                raise IdlError(token.place, f"expected a type, and its key members, behind #pragma {words[0]}")

    # --- types ---------------------------------------------------------------------------------------------

    def _type(self) -> TypeSpec:
        self.annotations()  # those of an element or of a discriminator's type say nothing that matters here
        token = self.token
        match token.text:
            case "string" | "wstring":
                self.take()
                return StringSpec(token.text == "wstring", self._string_bound(), token.place)
            case "sequence" | "map":
                with self.deeper():
                    return self._template()
            case "long" | "unsigned" | "signed":
                return self._integer()
            case _ if token.text in _BASIC:
                self.take()
                return BasicSpec(_BASIC[token.text], token.place)
            case _ if token.text in _UNFIT_TYPES:
                raise IdlError(token.place, _UNFIT_TYPES[token.text])
        if token.text == "::" or (token.kind is TokenKind.NAME and token.text not in KEYWORDS):
            return NameSpec(self.scoped_name("of a type"))
        raise self.unexpected("a type")

    def _string_bound(self) -> Expression | None:
        if self.token.text != "<":
            return None
        self.take()
        bound = self.expression(in_template=True)
        self.expect(">", "behind the bound")
        return bound

    def _template(self) -> TypeSpec:
        token = self.take()
        self.expect("<", f"behind '{token.text}'")
        first = self._type()
        second: TypeSpec | None = None
        if token.text == "map":
            self.expect(",", "between the types of key and value")
            second = self._type()
        bound = None
        if self.token.text == ",":
            self.take()
            bound = self.expression(in_template=True)
        self.expect(">", f"behind the {token.text}'s {'element' if second is None else 'value'}")
        if second is not None:
            return MapSpec(first, second, bound, token.place)
        return SequenceSpec(first, bound, token.place)

    def _integer(self) -> BasicSpec:
        """``short``, ``long``, ``long long``, each perhaps ``unsigned``."""
        token = self.take()
        sign = "u" if token.text == "unsigned" else ""
        if token.text in ("unsigned", "signed"):
            if self.token.text not in ("short", "long"):
                raise self.unexpected(f"'short' or 'long' behind '{token.text}'")
            if self.take().text == "short":
                return BasicSpec(f"{sign}int16", token.place)
        if self.token.text == "long":
            self.take()
            return BasicSpec(f"{sign}int64", token.place)
        if self.token.text == "double":
            raise IdlError(token.place, "long double is not supported; use double, or octet[16] to pass it on")
        return BasicSpec(f"{sign}int32", token.place)

    def _declarators(self, of: str) -> list[Declarator]:
        found = [self._declarator(of)]
        while self.token.text == ",":
            self.take()
            found.append(self._declarator(of))
        return found

    def _declarator(self, of: str) -> Declarator:
        name = self.name(of)
        dimensions: list[Expression] = []
        while self.token.text == "[":
            self.take()
            dimensions.append(self.expression())
            self.expect("]", "behind the dimension")
        return Declarator(name.text, name.place, tuple(dimensions))

    def _is_name(self) -> bool:
        return self.token.kind is TokenKind.NAME

    # --- annotations -------------------------------------------------------------------------------------

    def annotations(self) -> list[Annotation]:
        found: list[Annotation] = []
        while self.token.text == "@":
            place = self.take().place
            if self.token.text == "::":
                self.take()
            name = self.name("of the annotation", any_word=True).text
            while self.token.text == "::" and not self.token.spaced:  # else it begins the type behind the annotation
                self.take()
                name = f"{name}::{self.name('of the annotation', any_word=True).text}"
            arguments = self._annotation_arguments()
            if name.rpartition("::")[2] not in self._declared:
                found.append(Annotation(name, arguments, place))
        return found

    def _annotation_arguments(self) -> dict[str, Expression]:
        arguments: dict[str, Expression] = {}
        if self.token.text != "(":
            return arguments
        self.take()
        while self.token.text != ")":
            parameter = "value"
            if self._is_name() and self._after().text == "=":
                parameter = self.take().text
                self.take()
            value = self.expression()
            arguments[parameter] = value
            if self.token.text != ",":
                break
            self.take()
        self.expect(")", "behind the annotation's arguments")
        return arguments


def _is_keylist(pragma: Token) -> bool:
    """Other pragmas are for other compilers."""
    return pragma.text.split()[0] in ("keylist", "DCPS_DATA_KEY")
