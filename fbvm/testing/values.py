"""Variables by name, as attributes and by path: `pump.Done`, `pump["m.ET"]`, `pump.m.ET = "50ms"`."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, SupportsIndex
from weakref import WeakKeyDictionary

from fbvm.base.types import ArrayType, StructType, base
from fbvm.machine.plc import Plc
from fbvm.step.facts import ProgramFacts
from fbvm.step.properties import Properties
from fbvm.testing.value_types import as_read, for_writing
from fbvm.watch.paths import Place, Span, UnknownPlace, element
from fbvm.watch.scopes import Scope

OnRead = Callable[[Place], None]
"""Called with the place of each variable that is read."""
_properties: WeakKeyDictionary[Plc, Properties] = WeakKeyDictionary()


def write(plc: Plc, place: Place | Span, value: object) -> None:
    """Writes a Python value; text is parsed as a literal of the variable's type (`"50ms"`, `"16#FF"`).

    Raises ValueError (out of range) or TypeError (a value of another kind, or a bare number for a TIME or a date)."""
    plc.write(place, for_writing(place.type, value, place.name) if isinstance(place, Place) else value)


class Values:
    """The variables of one structure or instance.  Structures in it are `Values` again, arrays are `Elements`.

    A variable whose name is no attribute in Python is `values["name"]`."""

    __slots__ = ("_place", "_plc", "_read")
    _place: Place
    _plc: Plc
    _read: OnRead

    def __init__(self, plc: Plc, place: Place, read: OnRead) -> None:
        set_ = object.__setattr__
        set_(self, "_plc", plc)
        set_(self, "_place", place)
        set_(self, "_read", read)

    def __getattr__(self, name: str) -> Any:
        if name.startswith("__"):
            raise AttributeError(name)
        try:
            return self[name]
        except UnknownPlace as error:
            raise AttributeError(str(error)) from None

    def __setattr__(self, name: str, value: object) -> None:
        try:
            self[name] = value
        except UnknownPlace as error:
            raise AttributeError(str(error)) from None

    def __getitem__(self, path: str) -> Any:
        try:
            found = self._find(path)
        except UnknownPlace as unknown:
            return property_value(self._plc, f"{self._place.name}.{path}", unknown)
        return value_of(self._plc, found, self._read)

    def __setitem__(self, path: str, value: object) -> None:
        write(self._plc, self._find(path), value)

    def __dir__(self) -> list[str]:
        kind = self._place.type
        return [field.name for field in kind.fields.values()] if isinstance(kind, StructType) else []

    def __eq__(self, other: object) -> bool:
        return as_dict(self) == (as_dict(other) if isinstance(other, Values) else other)

    __hash__ = None  # type: ignore[assignment]

    def __repr__(self) -> str:
        return f"{self._place.type.name} {as_dict(self)!r}"

    def _find(self, path: str) -> Place:
        found = self._plc.find(f"{self._place.name}.{path}")
        assert isinstance(found, Place), "only addresses have ranges"
        return found


class Elements(list[Any]):
    """The elements of an array, the first one with index 0; structures and instances are `Values`.

    An assignment to one writes it in the PLC.  The list has the values of the moment at which it was read."""

    def __init__(self, plc: Plc, place: Place, values: list[Any], read: OnRead) -> None:
        kind = base(place.type)
        assert isinstance(kind, ArrayType)
        self._plc, self._place, self._kind = plc, place, kind
        is_structured = isinstance(base(kind.element), StructType)
        super().__init__([Values(plc, self._element(at), read) for at in range(len(values))] if is_structured else values)

    def __setitem__(self, index: SupportsIndex | slice, value: Any) -> None:
        if isinstance(index, slice):
            raise TypeError(f"{self._place.name}: assign to one element after the other, or a list to the whole array")
        at = range(len(self))[index]
        place = self._element(at)
        write(self._plc, place, value)
        if not isinstance(self[at], Values):  # which reads what is there now
            super().__setitem__(at, as_read(self._kind.element, self._plc.read(place)))

    def _element(self, at: int) -> Place:
        return element(self._place, self._kind, at)


def value_of(plc: Plc, found: Place | Span, read: OnRead) -> Any:
    """The value at a place; of a structure or instance its variables, of an array its elements."""
    if isinstance(found, Place):
        if isinstance(base(found.type), StructType):
            return Values(plc, found, read)
        read(found)
        value = as_read(found.type, plc.read(found))
        return Elements(plc, found, value, read) if isinstance(value, list) else value
    return plc.read(found)


def property_value(plc: Plc, path: str, unknown: UnknownPlace) -> Any:
    """The value of the property that a path such as `Main.pump.Starts` names, by its GET accessor.

    Raises `unknown` if it names none, UnknownPlace for a method, ValueError if the accessor ends with a trap."""
    __tracebackhide__ = True
    if plc not in _properties:
        _properties[plc] = Properties(ProgramFacts.of(plc))
    properties, scope = _properties[plc], Scope(plc.find)
    found = properties.read(path, scope, plc.memory)
    if found is not None:
        return as_read(found.place.type, found.value)
    if properties.is_method(path, scope, plc.memory):
        name = path.rpartition(".")[2]
        raise UnknownPlace(f"{name} is a method: call it in a test in Structured Text") from None
    raise unknown


def as_dict(values: Values) -> dict[str, Any]:
    """All variables of an instance as a dictionary of Python values."""
    found: dict[str, Any] = as_read(values._place.type, values._plc.read(values._place))
    return found

