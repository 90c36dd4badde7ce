"""Images as bytes and back, as JSON.

Each type is a row of a table, and everything else names it by its number.  The code of a body is a text inside the JSON, which is
parsed when the body is executed in Python, listed or drawn for the first time; a program that has machine code in the
cache never needs it."""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import astuple, dataclass, fields
from functools import cached_property
from operator import attrgetter
from typing import Any

from fbvm.base.areas import Mailbox
from fbvm.base.types import (
    ANYTHING,
    ELEMENTARY,
    AnyType,
    ArrayType,
    Elementary,
    EnumType,
    Field,
    OpenArrayType,
    RefType,
    StringType,
    StructType,
    SubrangeType,
    Type,
    fold,
    string,
)
from fbvm.code.image import Body, Image, Layout, Objects, ProgramRun, Retained, RungPicture, SfcPicture, Site, TaskRow
from fbvm.code.operations import Block
from fbvm.code.recursion import DEEPEST, with_room


def encode(image: Image) -> bytes:
    """An image as bytes, for `decode`.  Raises RecursionError for code that is nested deeper than Python's JSON goes."""
    types = _Writer()
    document = {
        "fingerprint": image.fingerprint,
        "layout": [image.layout.slots_size, image.layout.e_banks, [astuple(box) for box in image.layout.mailboxes],
                   image.layout.sized, image.layout.heap_bytes],
        "bodies": [[body.name, body.kind, body.instance_size, _dump(body.code), body.is_part] for body in image.bodies],
        "tasks": [[task.name, task.priority, task.interval_ns, task.single, [astuple(run) for run in task.programs]]
                  for task in image.tasks],
        "symbols": [[name, types.field(symbol)] for name, symbol in image.symbols.items()],
        "initial": image.initial,
        "retained": [[*vars(row).values()] for row in image.retained],
        "sites": [[*vars(site).values()] for site in image.sites],
        "objects": [*vars(image.objects).values()],
        "rungs": [[*vars(rung).values()] for rung in image.rungs],
        "charts": [[*vars(chart).values()] for chart in image.charts],
        "frames": [[name, [types.field(row) for row in rows.values()]] for name, rows in image.frames.items()],
        "derived": [[name, types.number(kind)] for name, kind in image.types.items()],
    }
    return _dump({**document, "types": types.rows}).encode("utf-8", "surrogatepass")


def decode(content: bytes) -> Image:
    """The image that `encode` made these bytes of.  Raises ValueError, LookupError or TypeError for other bytes."""
    stored = json.loads(content.decode("utf-8", "surrogatepass"), object_hook=_bytes)
    types = _Reader(stored["types"])
    slots_size, e_banks, mailboxes, sized, heap_bytes = stored["layout"]
    image = Image(
        Layout(slots_size, tuple(e_banks), tuple(Mailbox(*row) for row in mailboxes), None if sized is None else tuple(sized),
               heap_bytes),
        tuple(_StoredBody.of(*row) for row in stored["bodies"]),
        tuple(TaskRow(name, priority, interval_ns, single, tuple(ProgramRun(*run) for run in runs))
              for name, priority, interval_ns, single, runs in stored["tasks"]),
        {name: types.field(row) for name, row in stored["symbols"]},
        _tuples(stored["initial"]),
        tuple(Retained(*row) for row in stored["retained"]),
        tuple(Site(*row) for row in stored["sites"]),
        {name: types.type(number) for name, number in stored["derived"]},
        Objects(*_tuples(stored["objects"])),
        tuple(RungPicture(*row) for row in _tuples(stored["rungs"])),
        tuple(SfcPicture(*row) for row in _tuples(stored["charts"])),
        {name: {fold(found.name): found for found in map(types.field, rows)} for name, rows in stored["frames"]},
    )
    vars(image)["fingerprint"] = stored["fingerprint"]
    return image


class _StoredBody(Body):
    """A body whose code is parsed when it is asked for."""

    @classmethod
    def of(cls, name: str, kind: str, instance_size: int, text: str, is_part: bool) -> _StoredBody:
        body = cls.__new__(cls)
        vars(body).update(name=name, kind=kind, instance_size=instance_size, text=text, is_part=is_part)
        return body

    @cached_property
    def code(self) -> Block:
        return with_room(lambda: _code(vars(self)["text"]), lambda: DEEPEST)


# --- plain data -----------------------------------------------------------------------------------------------------


def _plain(item: object) -> object:
    if isinstance(item, bytes):
        return {"bytes": item.decode("latin-1")}
    raise TypeError(f"{item!r} is no part of an image")


_dump = json.JSONEncoder(separators=(",", ":"), ensure_ascii=False, check_circular=False, default=_plain).encode


def _bytes(row: dict[str, Any]) -> Any:
    return row["bytes"].encode("latin-1") if row.keys() == {"bytes"} else row


def _code(text: str) -> Block:
    code: Block = _tuples(json.loads(text, object_hook=_bytes))
    return code


def _tuples(item: Any) -> Any:
    return tuple([_tuples(part) if type(part) is list else part for part in item])


# --- types ----------------------------------------------------------------------------------------------------------

COMMON = ("name", "size", "align")
FIELD = tuple(each.name for each in fields(Field) if each.name != "type")
assert FIELD[-1] == "frame_at"
_PARTS = attrgetter(*FIELD)


@dataclass(frozen=True)
class _Kind:
    """How types of a class are encoded."""

    parts: Callable[[Any, _Writer], list[Any]]
    make: Callable[[dict[str, Any], list[Any], _Reader], Type]
    """From the common parts and the others."""


class _Writer:
    """Types as rows; `rows` grows."""

    def __init__(self) -> None:
        self.rows: list[list[Any] | None] = []
        self._numbers: dict[int, int] = {}
        self._kept: list[Type] = []

    def number(self, kind: Type) -> int:
        """The number of a type's row."""
        number = self._numbers.get(id(kind))
        if number is None:
            number = self._numbers[id(kind)] = len(self.rows)
            self._kept.append(kind)  # so that its id stays its own
            self.rows.append(None)
            name = type(kind).__name__
            self.rows[number] = [name, *(getattr(kind, part) for part in COMMON), *KINDS[name].parts(kind, self)]
        return number

    def field(self, field: Field) -> list[Any]:
        """A field as a row."""
        return [self.number(field.type), *_PARTS(field)]


class _Reader:
    """Rows as types, each once.  A structure is there before its fields, which may lead back to it."""

    def __init__(self, rows: list[list[Any]]) -> None:
        self._rows = rows
        self._types: dict[int, Type] = {}

    def type(self, number: int) -> Type:
        kind = self._types.get(number)
        if kind is None:
            name, *row = self._rows[number]
            common, parts = dict(zip(COMMON, row, strict=False)), row[len(COMMON):]
            kind = self._types[number] = KINDS[name].make(common, parts, self)
            if isinstance(kind, StructType):
                kind.fields.update((folded, self.field(written)) for folded, written in parts[2])
        return kind

    def field(self, row: list[Any]) -> Field:
        *values, frame_at = row[1:]
        return Field(type=self.type(row[0]), **dict(zip(FIELD[:-1], values, strict=True)), frame_at=tuple(frame_at))


def _target(kind: RefType, writer: _Writer) -> list[Any]:
    return [None if kind.target is None else writer.number(kind.target), kind.moves, kind.follows, kind.interface]


def _structure(kind: StructType, writer: _Writer) -> list[Any]:
    return [kind.block, kind.other_names, [[name, writer.field(field)] for name, field in kind.fields.items()]]


def _elementary(common: dict[str, Any], parts: list[Any], reader: _Reader) -> Type:
    return ELEMENTARY[common["name"]]


KINDS: dict[str, _Kind] = {
    Elementary.__name__: _Kind(lambda kind, w: [], _elementary),
    AnyType.__name__: _Kind(lambda kind, w: [], lambda common, parts, r: ANYTHING[common["name"]]),
    StringType.__name__: _Kind(lambda kind, w: [kind.capacity, kind.wide], lambda common, parts, r: string(*parts)),
    ArrayType.__name__: _Kind(
        lambda kind, w: [kind.bounds, w.number(kind.element), kind.packed],
        lambda common, parts, r: ArrayType(**common, bounds=_tuples(parts[0]), element=r.type(parts[1]), packed=parts[2])),
    OpenArrayType.__name__: _Kind(
        lambda kind, w: [kind.dimensions, w.number(kind.element)],
        lambda common, parts, r: OpenArrayType(**common, dimensions=parts[0], element=r.type(parts[1]))),
    StructType.__name__: _Kind(
        _structure, lambda common, parts, r: StructType(**common, fields={}, block=parts[0], other_names=parts[1])),
    EnumType.__name__: _Kind(
        lambda kind, w: [kind.base.name, kind.members, list(kind.shown.items())],
        lambda common, parts, r: EnumType(
            **common, base=ELEMENTARY[parts[0]], members=parts[1], shown=dict(_tuples(parts[2])))),
    SubrangeType.__name__: _Kind(
        lambda kind, w: [kind.base.name, kind.low, kind.high],
        lambda common, parts, r: SubrangeType(
            **common, base=ELEMENTARY[parts[0]], low=parts[1], high=parts[2])),
    RefType.__name__: _Kind(
        _target, lambda common, parts, r: RefType(
            **common, target=None if parts[0] is None else r.type(parts[0]), moves=parts[1], follows=parts[2],
            interface=parts[3])),
}  # fmt: skip
"""A row for each class of types."""
