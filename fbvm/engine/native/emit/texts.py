"""Text operations as instructions of LLVM.  A text is a pointer to its characters, their number and their width.

An operation that yields a part of a text copies nothing.  One that makes a new text writes it to scratch bytes of the context,
whose size is known at compile time because every text has a greatest length."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import Any

from fbvm.base.strings import packed
from fbvm.base.types import SHORT_NAMES
from fbvm.code.operations import TEXT_UNITS, Address, Block, Node
from fbvm.code.shapes import statements
from fbvm.engine.native.emit.expressions import as_double, chooser, cut, text_order
from fbvm.engine.native.emit.writer import Text, Unsupported, Writer, ir
from fbvm.engine.native.library.reading import KINDS
from fbvm.engine.ranges import is_float

LONGEST_NUMBER = 48
"""Bytes that hold any number, time or date as text."""


# --- greatest lengths -----------------------------------------------------------------------------------------------


def capacity(w: Writer, node: Node) -> int:
    """How many characters the value of a text expression has at most."""
    name, operands = node[0], node[2:]
    if name == "const":
        return len(operands[0])
    if name == "load_text":
        return int(operands[1])
    if name == "tmp":
        return kept(w)[operands[0]][1]
    if name == "enum_text":
        return max((len(text) for _, text in operands[0]), default=0) + LONGEST_NUMBER
    if name == "to_text":
        return LONGEST_NUMBER
    if name == "character":
        return 1
    texts = [item for item in (operands[1] if name == "mux" else operands) if isinstance(item, tuple) and item[1] in TEXT_UNITS]
    sizes = [capacity(w, text) for text in texts]
    return max(sizes) if name in ("select", "mux", "min", "max") else sum(sizes)


def kept(w: Writer) -> dict[int, tuple[int, int]]:
    """For each text temporary of the body its offset in the context, unless it is on the host's stack, and how many characters
    it has at most."""
    if w.capacities is not None:
        return w.capacities
    lets = list(_text_lets(w.body.code))
    w.capacities = {number: (0, 0) for number, _ in lets}
    for _ in range(len(lets) + 1):  # a text that needs longer depends on itself
        before = dict(w.capacities)
        for number, node in lets:
            w.capacities[number] = 0, max(w.capacities[number][1], capacity(w, node))
        if w.capacities == before:
            break
    else:
        raise Unsupported(f"a text of {w.body.name} grows without bound")
    units = {number: TEXT_UNITS[node[1]] for number, node in lets}
    if w.is_recursive:  # each execution has temporaries of its own
        w.kept_texts = {_kept_name(number): f"[{max(size, 1) * units[number]} x i8]"
                        for number, (_, size) in w.capacities.items()}
    else:
        w.capacities = {number: (w.module.room(size * units[number]), size) for number, (_, size) in w.capacities.items()}
    return w.capacities


def _text_lets(block: Block) -> Iterator[tuple[int, Node]]:
    for node in statements(block):
        if node[0] == "let" and node[2] in TEXT_UNITS:
            yield node[1], node[3]


def keep(w: Writer, number: int, a: Node) -> None:
    """`let` of a text: its characters are copied."""
    text = w.text(a)
    place, count = _kept_place(w, number), in_bytes(w, text.length, text.unit)
    w.emit(f"call void @llvm.memmove.p0.p0.i64(ptr {place}, ptr {text.at}, i64 {count}, i1 false)")
    w.emit(f"store i64 {text.length}, ptr {w.temporary(number, 'i64')}, align 8")


def _kept_name(number: int) -> str:
    return f"%text{number}"


def _kept_place(w: Writer, number: int) -> str:
    place = kept(w)[number][0]
    if w.is_recursive:
        return _kept_name(number)
    return w.new(f"getelementptr inbounds i8, ptr %c, i64 {place}")


def _tmp(w: Writer, form: str, number: int) -> Text:
    return Text(_kept_place(w, number), w.new(f"load i64, ptr {w.temporary(number, 'i64')}, align 8"), TEXT_UNITS[form])


def in_bytes(w: Writer, length: str, unit: int) -> str:
    """How many bytes that many characters take."""
    return length if unit == 1 else w.new(f"mul i64 {length}, {unit}")


# --- parts ----------------------------------------------------------------------------------------------------------


def _const(w: Writer, form: str, value: bytes | str) -> Text:
    if not value:
        return Text("%c", "0", TEXT_UNITS[form])
    data = value if isinstance(value, bytes) else packed(value)
    return Text(w.module.constant(data), str(len(data) // TEXT_UNITS[form]), TEXT_UNITS[form])


def _load_text(w: Writer, form: str, address: Address, size: int) -> Text:
    unit = TEXT_UNITS[form]
    pointer = w.pointer(address, size * unit)
    return Text(pointer, w.call("text_length" if unit == 1 else "wide_length", w.integer(pointer), str(size)), unit)


def _not_less(w: Writer, low: int, value: str, site: int) -> None:
    w.trap_if(w.new(f"icmp slt i64 {value}, {low}"), "R0108", site, ("i64", value))


def _lesser(w: Writer, a: str, b: str) -> str:
    return w.new(f"call i64 @llvm.umin.i64(i64 {a}, i64 {b})")


def _from(w: Writer, text: Text, start: str, length: str) -> Text:
    """So many characters of a text, from one on that is counted from 0."""
    return Text(w.new(f"getelementptr i{8 * text.unit}, ptr {text.at}, i64 {start}"), length, text.unit)


def _left(w: Writer, form: str, a: Node, n: Node, site: int) -> Text:
    text, count = w.text(a), w.value(n)
    _not_less(w, 0, count, site)
    return Text(text.at, _lesser(w, text.length, count), text.unit)


def _right(w: Writer, form: str, a: Node, n: Node, site: int) -> Text:
    text, count = w.text(a), w.value(n)
    _not_less(w, 0, count, site)
    length = _lesser(w, text.length, count)
    return _from(w, text, w.new(f"sub i64 {text.length}, {length}"), length)


def _span(w: Writer, text: Text, n: str, p: str) -> tuple[str, str]:
    """Where n characters from position p on begin in a text, counted from 0, and how many of them there are."""
    start = _lesser(w, text.length, w.new(f"sub i64 {p}, 1"))
    return start, _lesser(w, n, w.new(f"sub i64 {text.length}, {start}"))


def _mid(w: Writer, form: str, a: Node, n: Node, p: Node, site: int) -> Text:
    text, count, position = w.text(a), w.value(n), w.value(p)
    _not_less(w, 0, count, site)
    _not_less(w, 1, position, site)
    start, length = _span(w, text, count, position)
    return _from(w, text, start, length)


# --- new texts ------------------------------------------------------------------------------------------------------


def _joined(w: Writer, size: int, *parts: Text) -> Text:
    """The texts one after the other, at most so many characters."""
    unit = parts[0].unit
    made = Text(w.scratch(size * unit), "0", unit)
    for part in parts:
        end, count = _from(w, made, made.length, part.length).at, in_bytes(w, part.length, unit)
        w.emit(f"call void @llvm.memcpy.p0.p0.i64(ptr {end}, ptr {part.at}, i64 {count}, i1 false)")
        made = Text(made.at, w.new(f"add i64 {made.length}, {part.length}"), unit)
    return made


def _concat(w: Writer, form: str, a: Node, b: Node) -> Text:
    left, right = w.text(a), w.text(b)
    return _joined(w, capacity(w, a) + capacity(w, b), left, right)


def _spliced(w: Writer, size: int, text: Text, between: Text, start: str, dropped: str) -> Text:
    """A text with another one in place of `dropped` characters."""
    end = w.new(f"add i64 {start}, {dropped}")
    rest = _from(w, text, end, w.new(f"sub i64 {text.length}, {end}"))
    return _joined(w, size, Text(text.at, start, text.unit), between, rest)


def _insert(w: Writer, form: str, a: Node, b: Node, p: Node, site: int) -> Text:
    text, between, position = w.text(a), w.text(b), w.value(p)
    _not_less(w, 0, position, site)
    return _spliced(w, capacity(w, a) + capacity(w, b), text, between, _lesser(w, text.length, position), "0")


def _replaced(w: Writer, size: int, text: Text, between: Text, n: str, p: str, site: int) -> Text:
    _not_less(w, 0, n, site)
    _not_less(w, 1, p, site)
    return _spliced(w, size, text, between, *_span(w, text, n, p))


def _delete(w: Writer, form: str, a: Node, n: Node, p: Node, site: int) -> Text:
    text, count, position = w.text(a), w.value(n), w.value(p)
    return _replaced(w, capacity(w, a), text, _const(w, form, b""), count, position, site)


def _replace(w: Writer, form: str, a: Node, b: Node, n: Node, p: Node, site: int) -> Text:
    text, between, count, position = w.text(a), w.text(b), w.value(n), w.value(p)
    return _replaced(w, capacity(w, a) + capacity(w, b), text, between, count, position, site)


# --- choices --------------------------------------------------------------------------------------------------------


def _either(w: Writer, condition: str, yes: Text, no: Text) -> Text:
    return Text(w.new(f"select i1 {condition}, ptr {yes.at}, ptr {no.at}"),
                w.new(f"select i1 {condition}, i64 {yes.length}, i64 {no.length}"), yes.unit)


def _select(w: Writer, form: str, g: Node, a: Node, b: Node) -> Text:
    chosen, left, right = w.value(g), w.text(a), w.text(b)
    return _either(w, chosen, right, left)


def _mux(w: Writer, form: str, k: Node, choices: tuple[Node, ...], site: int) -> Text:
    number = w.value(k)
    texts = [w.text(choice) for choice in choices]
    choose = chooser(w, number, len(texts), site)
    return Text(choose("ptr", [text.at for text in texts]), choose("i64", [text.length for text in texts]), TEXT_UNITS[form])


def _extreme(comparison: str) -> Callable[..., Text]:
    def emit(w: Writer, form: str, a: Node, b: Node) -> Text:
        left, right = w.text(a), w.text(b)
        return _either(w, w.new(f"icmp {comparison} i64 {text_order(w, left, right)}, 0"), left, right)

    return emit


# --- characters -----------------------------------------------------------------------------------------------------


def _character(w: Writer, form: str, a: Node) -> Text:
    unit = TEXT_UNITS[form]
    code, at = w.value(a), w.scratch(unit)
    w.emit(f"store i{8 * unit} {code}, ptr {at}, align 1")
    return Text(at, w.new(f"zext i1 {w.new(f'icmp ne i{8 * unit} {code}, 0')} to i64"), unit)


def _recode(w: Writer, form: str, a: Node) -> Text:
    text, unit = w.text(a), TEXT_UNITS[form]
    at = w.scratch(capacity(w, a) * unit)
    w.call("widen" if unit == 2 else "narrow", w.integer(at), w.integer(text.at), text.length)
    return Text(at, text.length, unit)


# --- values ---------------------------------------------------------------------------------------------------------

_WRITERS = {
    **dict.fromkeys(("ULINT", "LWORD"), "put_number"), "REAL": "put_real", "LREAL": "put_lreal", "TIME": "put_time",
    "LTIME": "put_ltime", "DATE": "put_date", "LDATE": "put_ldate", "TIME_OF_DAY": "put_tod",
    "LTIME_OF_DAY": "put_ltod", "DATE_AND_TIME": "put_dt", "LDATE_AND_TIME": "put_ldt",
}
"""The routine that writes a value of each data type; the others are integers."""


def _to_text(w: Writer, form: str, data_type: str, a: Node) -> Text:
    data_type = SHORT_NAMES.get(data_type, data_type)
    if data_type == "BOOL":
        value = w.value(a) if a[1] == "b" else w.new(f"icmp ne i64 {w.wide(a)}, 0")
        return _either(w, value, _const(w, "s8", b"TRUE"), _const(w, "s8", b"FALSE"))
    number = as_bits(w, a) if is_float(a[1]) else w.wide(a)
    return _written(w, _WRITERS.get(data_type, "put_integer"), number)


def as_bits(w: Writer, a: Node) -> str:
    """The 64 bits of a float as LREAL."""
    return w.new(f"bitcast double {as_double(w, w.value(a), a[1])} to i64")


def _written(w: Writer, routine: str, number: str) -> Text:
    at = w.scratch(LONGEST_NUMBER)
    return Text(at, w.call(routine, w.integer(at), number))


def _enum_text(w: Writer, form: str, names: tuple[tuple[int, str], ...], a: Node) -> Text:
    value, after, other = w.wide(a), w.label(), w.label()
    rows = [(number, _const(w, "s8", name.encode("latin-1", "replace")), w.label()) for number, name in dict(names).items()]
    w.emit(f"switch i64 {value}, label %{other} [ {' '.join(f'i64 {n}, label %{label}' for n, _, label in rows)} ]")
    for _, _, label in rows:
        w.begin(label)
        w.jump(after)
    w.begin(other)
    written = _written(w, "put_integer", value)
    w.jump(after)
    w.begin(after)
    texts = [(text, label) for _, text, label in rows] + [(written, other)]
    return Text(w.new("phi ptr " + ", ".join(f"[ {text.at}, %{label} ]" for text, label in texts)),
                w.new("phi i64 " + ", ".join(f"[ {text.length}, %{label} ]" for text, label in texts)))


def _length(w: Writer, machine: str, a: Node) -> str:
    return cut(w, w.text(a).length, machine)


def _characters(w: Writer, machine: str, a: Node) -> str:
    text = w.text(a)
    return cut(w, w.call("wide_characters", w.integer(text.at), text.length), machine)


def _units_of(w: Writer, machine: str, a: Node, n: Node) -> str:
    text, count = w.text(a), w.value(n)
    return cut(w, w.call("wide_units", w.integer(text.at), text.length, count), machine)


def _find(w: Writer, machine: str, a: Node, b: Node) -> str:
    text, wanted = w.text(a), w.text(b)
    found = w.call("text_find", w.integer(text.at), text.length, w.integer(wanted.at), wanted.length, str(text.unit))
    return cut(w, found, machine)


def _first(w: Writer, machine: str, a: Node) -> str:
    text, kind = w.text(a), ir(machine)
    empty = w.new(f"icmp eq i64 {text.length}, 0")
    at = w.new(f"select i1 {empty}, ptr %c, ptr {text.at}")  # behind an empty text nothing may be read
    return w.new(f"select i1 {empty}, {kind} 0, {kind} {w.new(f'load {kind}, ptr {at}, align 1')}")


def _from_text(w: Writer, machine: str, data_type: str, a: Node, site: int) -> str:
    """`from_text`: the routine tells whether the text is a literal and whether its value fits."""
    text, result = w.text(a), w.field("result")
    at = w.integer(text.at)
    kind = KINDS[SHORT_NAMES.get(data_type, data_type)]
    status = w.call("read_value", w.integer(result), str(kind), at, text.length)
    shown: tuple[tuple[Any, ...], ...] = (("text", at, text.length), ("const", data_type))
    w.trap_if(w.new(f"icmp eq i64 {status}, 1"), "R0111", site, *shown)
    w.trap_if(w.new(f"icmp eq i64 {status}, 2"), "R0105", site, *shown)
    return _read(w, machine, result)


def _read(w: Writer, machine: str, result: str) -> str:
    """The value that a routine has read, as a `machine`."""
    number = w.new(f"load i64, ptr {result}, align 8")
    if machine == "b":
        return w.new(f"icmp ne i64 {number}, 0")
    if not is_float(machine):
        return cut(w, number, machine)
    value = w.new(f"bitcast i64 {number} to double")
    return w.new(f"fptrunc double {value} to float") if machine == "f32" else value


def _from_leading(w: Writer, machine: str, data_type: str, whole: int, a: Node) -> str:
    """`from_leading`: what is no literal is 0, so nothing traps."""
    text, result = w.text(a), w.field("result")
    kind = KINDS[SHORT_NAMES.get(data_type, data_type)]
    w.call("read_leading", w.integer(result), str(kind), str(whole), w.integer(text.at), text.length)
    return _read(w, machine, result)


TEXTS: dict[str, Callable[..., Text]] = {
    "const": _const, "tmp": _tmp, "load_text": _load_text, "left": _left, "right": _right, "mid": _mid,
    "concat": _concat, "insert": _insert, "delete": _delete, "replace": _replace, "select": _select, "mux": _mux,
    "min": _extreme("sle"), "max": _extreme("sge"), "to_text": _to_text, "enum_text": _enum_text,
    "character": _character, "recode": _recode,
}
"""How each operation is written that yields a text: called with the operands of its row."""

VALUES: dict[str, Callable[..., str]] = {"length": _length, "find": _find, "characters": _characters, "units_of": _units_of,
          "first": _first, "from_text": _from_text,
          "from_leading": _from_leading}
"""The same for those that read a text and yield a number."""
