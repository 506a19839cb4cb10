"""dataclass: the standard library's decorator, for classes of which there are many.

``dataclasses.dataclass`` compiles six functions for each class.  This stack has some hundred and fifty small values,
and making them took more than half of the time that importing it takes.  Here only ``__init__`` is compiled; the other
methods are the same functions for all classes.  What comes out behaves alike (``tests/structure/test_dataclass.py``
compares the two): it is a dataclass to ``fields`` and ``replace``, to type checkers and to pickle.

Not for everything: no ``InitVar``, no ``order``; and a class of this kind and one of the standard library's do not
inherit from each other when they are frozen.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

__all__ = ["dataclass"]

if TYPE_CHECKING:
    from dataclasses import dataclass
else:
    import dataclasses
    from dataclasses import MISSING, Field, FrozenInstanceError
    from operator import attrgetter
    from reprlib import recursive_repr

    def dataclass(*, frozen=False, slots=False, eq=True, repr=True, kw_only=False):
        """As ``dataclasses.dataclass`` with these arguments."""
        bare = dataclasses.dataclass(init=False, repr=False, eq=False, slots=slots, kw_only=kw_only)

        def decorate(cls):
            own = vars(cls)
            methods = {"__repr__": _repr} if repr else {}
            if frozen:
                methods |= {"__setattr__": _refuse_to_set, "__delattr__": _refuse_to_delete}
                if slots:
                    methods |= {"__getstate__": _state, "__setstate__": _set_state}
            if eq:
                methods |= {"__eq__": _equal, "__hash__": _hash if frozen else None}
            methods = {
                name: method
                for name, method in methods.items()
                if name not in own or (name == "__hash__" and own[name] is None)
            }
            cls = bare(cls)
            fields = dataclasses.fields(cls)
            for name, method in methods.items():
                setattr(cls, name, method)
            if "__init__" not in own:
                cls.__init__ = _init(cls, fields, frozen=frozen)
            if eq:
                cls._compared = staticmethod(_values_of([field.name for field in fields if field.compare]))
            return cls

        return decorate

    def _values_of(names):
        """What gives the values of an object's fields as a tuple."""
        if len(names) > 1:
            return attrgetter(*names)
        return lambda instance: tuple(getattr(instance, name) for name in names)

    def _equal(self, other):
        if other.__class__ is not self.__class__:
            return NotImplemented
        return self._compared(self) == self._compared(other)

    def _hash(self):
        return hash(self._compared(self))

    @recursive_repr()
    def _repr(self):
        shown = (f"{field.name}={getattr(self, field.name)!r}" for field in dataclasses.fields(self) if field.repr)
        return f"{self.__class__.__qualname__}({', '.join(shown)})"

    def _refuse_to_set(self, name, value):
        raise FrozenInstanceError(f"cannot assign to field {name!r}")

    def _refuse_to_delete(self, name):
        raise FrozenInstanceError(f"cannot delete field {name!r}")

    def _state(self):
        return [getattr(self, field.name) for field in dataclasses.fields(self)]

    def _set_state(self, state):
        for field, value in zip(dataclasses.fields(self), state, strict=True):
            object.__setattr__(self, field.name, value)

    class _Factory:
        def __repr__(self):
            return "<factory>"

    _GIVEN_BY_FACTORY = _Factory()

    def _init(cls, fields: tuple[Field, ...], *, frozen):
        """The one function that is written for the class, as every class has other parameters."""
        names = {"_set": object.__setattr__, "_MISSING": _GIVEN_BY_FACTORY}
        positional, keywords, body = ["self"], [], []
        for field in fields:
            name, value = field.name, field.name
            parameter = name
            if field.default is not MISSING:
                names[f"_default_{name}"] = field.default
                parameter = f"{name}=_default_{name}"
            elif field.default_factory is not MISSING:
                names[f"_new_{name}"] = field.default_factory
                parameter = f"{name}=_MISSING"
                value = f"_new_{name}() if {name} is _MISSING else {name}"
            if field.init:
                (keywords if field.kw_only else positional).append(parameter)
            elif field.default_factory is not MISSING:
                value = f"_new_{name}()"
            elif field.default is not MISSING:
                value = f"_default_{name}"
            else:
                continue  # it is for __post_init__ to set
            body.append(f"_set(self, {name!r}, {value})" if frozen else f"self.{name} = {value}")
        if hasattr(cls, "__post_init__"):
            body.append("self.__post_init__()")
        parameters = ", ".join([*positional, *(["*", *keywords] if keywords else [])])
        source = f"def __init__({parameters}):\n " + "\n ".join(body or ["pass"])
        made = {}
        exec(compile(source, f"<__init__ of {cls.__qualname__}>", "exec"), names, made)
        init = made["__init__"]
        init.__qualname__ = f"{cls.__qualname__}.__init__"
        init.__module__ = cls.__module__
        init.__annotations__ = {field.name: field.type for field in fields if field.init} | {"return": None}
        return init
