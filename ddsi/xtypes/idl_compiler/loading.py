"""From IDL text to Python classes in this process: the compiler's source is run, its types put into namespaces.

What ``ddsi.idl.load`` and ``loads`` do.  The classes are those of the source that ``ddsi idl`` would write, so that
both ways give the same; debuggers show that source.
"""

from __future__ import annotations

import linecache
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

from ...structure.errors import BadParameter
from ..model import Extensibility
from .analysis import analyze
from .declarations import Compilation, Module
from .parser import Parser
from .preprocessor import Preprocessor, read_source
from .python_names import python_identifier
from .python_source import PythonSource
from .source_text import IdlWarning, Place, SourceText

__all__ = ["Namespace", "compile_file", "compile_idl", "load_file", "load_text"]


class Namespace:
    """The types and constants of an IDL file or module, by name; inner modules are namespaces as well.

    ``idl_warnings`` says what the compiler left out; iterating gives the names.
    """

    idl_warnings: tuple[IdlWarning, ...] = ()

    def __init__(self, name: str) -> None:
        self.__name__ = name

    def __getattr__(self, name: str) -> Any:
        raise AttributeError(f"the IDL {self.__name__} has no {name}; it has {', '.join(self) or 'nothing'}")

    def __iter__(self) -> Iterator[str]:
        return (name for name in vars(self) if not name.startswith("__") and name != "idl_warnings")

    def __repr__(self) -> str:
        return f"<IDL {self.__name__}: {', '.join(self)}>"


def compile_idl(
    source: SourceText,
    path: Path | None,
    *,
    include: Sequence[str | Path],
    defines: Mapping[str, str],
    default_extensibility: Extensibility,
) -> Compilation:
    """Everything up to the declarations.  Raises IdlError; BadParameter for options that cannot be meant."""
    if isinstance(include, (str, Path)):
        raise BadParameter(f"include is a list of folders, as [{str(include)!r}]")
    if not isinstance(default_extensibility, Extensibility):
        raise BadParameter(
            f"default_extensibility is idl.FINAL, idl.APPENDABLE or idl.MUTABLE, not {default_extensibility!r}"
        )
    preprocessor = Preprocessor([Path(folder) for folder in include], defines)
    parser = Parser(preprocessor.tokens(source, path))
    definitions = parser.specification()
    return analyze(
        definitions,
        Place(source, 0),
        default_extensibility=default_extensibility,
        warnings=[*preprocessor.warnings, *parser.warnings],
    )


def compile_file(path: Path, **options: Any) -> Compilation:
    """As :func:`compile_idl`, of a file.  Raises OSError too."""
    return compile_idl(read_source(path), path, **options)


def load_file(path: str | Path, **options: Any) -> Namespace:
    """See :func:`ddsi.idl.load`."""
    path = Path(path)
    return _run(compile_file(path, **options), path.name, python_identifier(path.stem))


def load_text(text: str, **options: Any) -> Namespace:
    """See :func:`ddsi.idl.loads`."""
    if not isinstance(text, str):
        raise BadParameter(f"IDL text is a str, not {text!r}")
    return _run(compile_idl(SourceText("<text>", text.removeprefix("\ufeff")), None, **options), "<text>", "idl_text")


def _run(compilation: Compilation, title: str, module_name: str) -> Namespace:
    python = PythonSource(compilation, title)
    text = python.text()
    filename = f"<made from {title} by ddsi.idl>"
    linecache.cache[filename] = (len(text), None, text.splitlines(keepends=True), filename)
    names: dict[str, Any] = {"__name__": __name__}  # dataclasses look for the module of a class
    exec(compile(text, filename, "exec", dont_inherit=True), names)
    types = {declaration: names[name] for declaration, name in python.names.items()}
    for class_ in types.values():
        if isinstance(class_, type) and class_.__module__ == __name__:
            class_.__module__ = module_name
    root = _namespace(compilation.root, title, types)
    root.idl_warnings = tuple(compilation.warnings)
    return root


def _namespace(module: Module, title: str, types: Mapping[Any, Any]) -> Namespace:
    namespace = Namespace(title)
    for name, member in module.members.items():
        found = types.get(member)
        if isinstance(member, Module):
            found = _namespace(member, f"module {member.scoped_name}", types)
        if found is not None:
            setattr(namespace, name, found)
            setattr(namespace, python_identifier(name), found)  # such as from_, which can be written
    return namespace
