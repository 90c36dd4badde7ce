"""The Image as text for people: `fbvm list`.

One statement a line, its line and column in the source beside it; expressions as `name type operands`."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import Any

from fbvm.base.areas import SLOTS_OFFSET, Area
from fbvm.base.areas import Address as AreaAddress
from fbvm.base.types import Field, StructType
from fbvm.code.image import Body, Image, TaskRow
from fbvm.code.operations import CALLS, FIRST_OBJECT, WHOLE_BYTES, Address, Block, Node
from fbvm.code.recursion import DEEPEST, with_room
from fbvm.code.shapes import is_address, is_expression, operand_words

MARGIN = 10
"""Columns for line and column of the source."""
LONGEST_BYTES = 32
"""Bytes that are shown of a longer pattern."""


def listing(image: Image, observations: bool = False) -> str:
    """An image as text.

    observations: list the `observe` statements too, which only builds that look inside a scan execute.

    >>> from fbvm import compile_text
    >>> print(listing(compile_text("PROGRAM Main VAR n : INT; END_VAR n := 1; END_PROGRAM").image).splitlines()[-1].strip())
    1:35      store i16 self+8 <- 1"""
    return with_room(lambda: _listed(image, observations), lambda: DEEPEST)


def _listed(image: Image, observations: bool) -> str:
    lines = [*_layout(image), *_tasks(image), *_symbols(image), *_initial(image), *_retained(image), *_objects(image)]
    files: dict[str, set[str]] = {}
    for site in image.sites:
        files.setdefault(site.pou, set()).add(site.file)
    for number, body in enumerate(image.bodies):
        lines += ["", *_Writer(image, observations).body(number, body, sorted(files.get(body.name, ())))]
    return "\n".join(lines)


# --- what is around the code ----------------------------------------------------------------------------------------


def _layout(image: Image) -> Iterator[str]:
    layout = image.layout
    yield f"layout    {layout.size} bytes: {layout.slots_size} of slots from {SLOTS_OFFSET}" + (
        f", E banks {' '.join(layout.e_banks)}" if layout.e_banks else "")
    if layout.sized:
        yield f"apart     {' '.join(f'{name} at {layout.areas[name].offset}' for name in layout.sized)}"
    for box in layout.mailboxes:
        yield f"mailbox   {box.name}: {box.head_words} words, then {box.slots} slots of {box.slot_words}"


def _tasks(image: Image) -> Iterator[str]:
    for task in image.tasks:
        priority = f"priority {task.priority}, " if task.name else ""
        yield f"task      {task.name or 'no task'}: {priority}{_when(task)}"
        for run in task.programs:
            yield f"{'':10}{run.name} at {run.offset}: body {run.body} {image.bodies[run.body].name}"


def _when(task: TaskRow) -> str:
    if task.single:
        return f"when {task.single} rises"
    return f"every {task.interval_ns / 1e6:g} ms" if task.interval_ns else "every cycle"


def _symbols(image: Image) -> Iterator[str]:
    for field in image.symbols.values():
        yield from _symbol(field, 0, field.name, image.layout.areas)


def _symbol(field: Field, start: int, path: str, areas: dict[str, Area]) -> Iterator[str]:
    offset = field.offset + (0 if field.absolute else start)
    kind = ("REFERENCE TO " if field.reference else "") + str(field.type)
    yield f"symbol    {_absolute(offset, areas, field.bit):12} {path} : {kind}"
    if isinstance(field.type, StructType) and not field.reference:
        for member in field.type.fields.values():
            yield from _symbol(member, offset, f"{path}.{member.name}", areas)


def _initial(image: Image) -> Iterator[str]:
    for offset, data in image.initial:
        yield f"initial   {_absolute(offset, image.layout.areas):12} {_bytes(data)}"


def _retained(image: Image) -> Iterator[str]:
    for row in image.retained:
        yield f"retained  {_absolute(row.offset, image.layout.areas):12} {row.name}, {row.size} bytes"


def _objects(image: Image) -> Iterator[str]:
    """What pointers may be moved in."""
    areas = image.layout.areas
    for number, (start, end) in enumerate(image.objects.extents, FIRST_OBJECT):
        yield f"object    {_absolute(start, areas):12} number {number}, {end - start} bytes"
    if image.objects.leases:
        where = _absolute(image.objects.leases_at, areas)
        yield f"leases    {where:12} {image.objects.leases} of what ends while pointers are kept"
    if image.objects.heap_rows:
        yield f"heap      {_absolute(image.layout.heap_at, areas):12} {image.layout.heap_bytes} bytes for __NEW"


def _absolute(offset: int, areas: dict[str, Area], bit: int | None = None) -> str:
    """A place in the buffer, by its word where it lies in an area of words, with its bit as the word counts them."""
    for area in areas.values():
        if area.offset <= offset < area.offset + area.size_bytes and area.unit_bits > 1:
            number, odd = divmod(offset - area.offset, area.unit_bits // 8)
            if bit is not None:
                return str(AreaAddress(area.name, number, 8 * odd + bit))
            if area.address_bits > 8:
                number, odd = divmod(number, area.address_bits // 8)
                return str(AreaAddress(area.name, number, None, area.address_bits)) + (f"+{odd}" if odd else "")
            word = str(AreaAddress(area.name, number, None, 8 if area.unit_bits == 8 else 0))
            return word + ("+1" if odd else "")
    return str(offset) + (f".{bit}" if bit is not None else "")


def _bytes(data: bytes) -> str:
    return data[:LONGEST_BYTES].hex(" ") + (f" ... {len(data)} bytes" if len(data) > LONGEST_BYTES else "")


# --- code -----------------------------------------------------------------------------------------------------------


class _Writer:
    """Writes the code of one body."""

    def __init__(self, image: Image, observations: bool) -> None:
        self.image, self.observations = image, observations
        self.areas = image.layout.areas
        self.lines: list[str] = []
        self.indent = 0
        self.mark = ""

    def body(self, number: int, body: Body, files: list[str]) -> list[str]:
        """The heading and the code of a body from these files."""
        size = f", instance of {body.instance_size} bytes" if body.instance_size else ""
        self.lines.append(f"body {number}  {body.kind} {body.name}{size}" + (f", {', '.join(files)}" if files else ""))
        self.block(body.code)
        return self.lines

    def line(self, text: str) -> None:
        """Write one line; the place of the statement stands beside the first line of it."""
        self.lines.append(f"{self.mark:{MARGIN}}{'  ' * self.indent}{text}".rstrip())
        self.mark = ""

    def block(self, block: Block) -> None:
        for node in block:
            name, *operands = node
            row = _CONTROL.get(name)
            if row:
                row(self, *operands)
            elif name == "observe" and operands[0] == "statement":
                self.mark = self.place(operands[1])
            elif name != "observe" or self.observations:
                self.line(self.simple(name, operands))

    def inner(self, block: Block) -> None:
        self.indent += 1
        self.block(block)
        self.indent -= 1

    def simple(self, name: str, operands: list[Any]) -> str:
        """A statement without blocks; `<-` stands before what is stored."""
        if name in CALLS:
            place = f" of {self.address(operands[1])}" if operands[1] else ""
            given = f"t{operands[2]} <- " if name == "attempt" else ""
            return f"{given}{name} {self.image.bodies[operands[0]].name}{place}{' traps' * bool(operands[3:] and operands[3])}"
        if name == "observe":
            return f"observe {operands[0]} {self.detail(operands[2])}".rstrip()
        if name == "let":
            return f"t{operands[0]} {operands[1]} <- {self.bare(operands[2])}"
        texts = [self.operand(word, item) for word, item in zip(operand_words(name), operands, strict=True)]
        if name.startswith("store"):
            return f"{name} {' '.join(texts[:-1])} <- {self.bare(operands[-1])}"
        if name == "copy":
            return f"copy {texts[0]} <- {texts[1]} {texts[2]} bytes"
        return " ".join([name, *texts])

    def operand(self, word: str, item: Any) -> str:
        """An operand, by its word in the table of operations."""
        if word == "site":
            return f"@{self.place(item)}"
        if word == "bit":
            return f"bit {item}"
        if is_address(item):
            return self.address(item)
        if is_expression(item):
            return self.nested(item)
        if isinstance(item, bytes):
            return _bytes(item)
        if isinstance(item, tuple) and word.startswith("("):
            return "(" + ", ".join(self.bare(part) for part in item) + ")"
        return str(item)

    def nested(self, node: Node) -> str:
        """An expression as an operand of another."""
        text = self.bare(node)
        return text if node[0] in ("const", "tmp") else f"({text})"

    def bare(self, node: Node) -> str:
        """An expression by itself."""
        name, machine, *operands = node
        if name == "const":
            return _constant(machine, operands[0])
        if name == "tmp":
            return f"t{operands[0]}"
        texts = [self.operand(word, item) for word, item in zip(operand_words(name), operands, strict=True)]
        return " ".join([name, machine, *texts])

    def address(self, address: Address) -> str:
        """A place: `self+12`, `D100`, `184320+2*(...)`, `ref (...)+4`."""
        base, offset, terms = address
        if base == "abs":
            text = _absolute(offset, self.areas) if offset >= 0 else f"0{offset}"
        else:
            text = base if isinstance(base, str) else f"ref {self.nested(base[1])}"
            text += f"{offset:+}" if offset else ""
        return text + "".join(f"+{stride}*{self.nested(term)}" for stride, term in terms)

    def place(self, site: int) -> str:
        """Line and column of a site."""
        return f"{self.image.sites[site].line}:{self.image.sites[site].column}"

    def detail(self, detail: Any) -> str:
        """What an observation carries."""
        if not isinstance(detail, tuple):
            return "" if detail is None else str(detail)
        if is_expression(detail[1]):
            return f"{detail[0]} {self.bare(detail[1])}"
        kind, address, bit = detail
        return f"{kind} {self.address(address)}" + (f".{bit}" if bit != WHOLE_BYTES else "")


def _if(w: _Writer, rows: tuple[tuple[Node, Block], ...], otherwise: Block) -> None:
    for number, (condition, block) in enumerate(rows):
        w.line(f"{'elsif' if number else 'if'} {w.bare(condition)}")
        w.inner(block)
    if otherwise:
        w.line("else")
        w.inner(otherwise)
    w.line("end")


def _case(w: _Writer, machine: str, a: Node, rows: tuple[tuple[Any, Block], ...], otherwise: Block) -> None:
    w.line(f"case {machine} {w.bare(a)}")
    for labels, block in rows:
        w.line(", ".join(str(low) if low == high else f"{low}..{high}" for low, high in labels) + ":")
        w.inner(block)
    if otherwise:
        w.line("else")
        w.inner(otherwise)
    w.line("end")


def _loop(w: _Writer, head: Block, body: Block, tail: Block) -> None:
    for word, block in (("loop", head), ("body", body), ("tail", tail)):
        if block or word == "loop":
            w.line(word)
            w.inner(block)
    w.line("end")


_CONTROL: dict[str, Callable[..., None]] = {"if": _if, "case": _case, "loop": _loop}


def _constant(machine: str, value: Any) -> str:
    if machine == "b":
        return "TRUE" if value else "FALSE"
    if isinstance(value, str):
        return '"' + repr(value)[1:-1] + '"'
    return repr(value)[1:] if isinstance(value, bytes) else repr(value)

