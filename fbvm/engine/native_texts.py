"""Text operations as instructions of LLVM: a text is the place of its bytes and their number.

What only looks at a part of a text copies nothing; what makes a new one writes it to scratch bytes of the context, whose
size is known before because every text has a greatest length."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import Any

from fbvm.base.types import SHORT_NAMES
from fbvm.code.operations import Address, Block, Node
from fbvm.code.shapes import statements
from fbvm.engine.native_expressions import as_double, chooser, cut
from fbvm.engine.native_reading import KINDS
from fbvm.engine.native_writer import Text, Unsupported, Writer
from fbvm.engine.ranges import is_float

EMPTY = Text("%c", "0")
LONGEST_NUMBER = 48
"""Bytes that hold any number, time or date as text."""


# --- greatest lengths -----------------------------------------------------------------------------------------------


def capacity(w: Writer, node: Node) -> int:
    """Bytes that a text has at most."""
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
    texts = [item for item in (operands[1] if name == "mux" else operands) if isinstance(item, tuple) and item[1] == "s8"]
    sizes = [capacity(w, text) for text in texts]
    return max(sizes) if name in ("select", "mux", "min", "max") else sum(sizes)


def kept(w: Writer) -> dict[int, tuple[int, int]]:
    """For each text temporary of the body where its bytes are kept in the context, and how many they are at most."""
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
    w.capacities = {number: (w.module.room(size), size) for number, (_, size) in w.capacities.items()}
    return w.capacities


def _text_lets(block: Block) -> Iterator[tuple[int, Node]]:
    for node in statements(block):
        if node[0] == "let" and node[2] == "s8":
            yield node[1], node[3]


def keep(w: Writer, number: int, a: Node) -> None:
    """`let` of a text: its bytes are copied."""
    text = w.text(a)
    place = _kept_place(w, number)
    w.emit(f"call void @llvm.memmove.p0.p0.i64(ptr {place}, ptr {text.at}, i64 {text.length}, i1 false)")
    w.emit(f"store i64 {text.length}, ptr {w.temporary(number, 'i64')}, align 8")


def _kept_place(w: Writer, number: int) -> str:
    return w.new(f"getelementptr inbounds i8, ptr %c, i64 {kept(w)[number][0]}")


def _tmp(w: Writer, number: int) -> Text:
    return Text(_kept_place(w, number), w.new(f"load i64, ptr {w.temporary(number, 'i64')}, align 8"))


# --- parts ----------------------------------------------------------------------------------------------------------


def _const(w: Writer, value: bytes) -> Text:
    return Text(w.module.constant(value), str(len(value))) if value else EMPTY


def _load_text(w: Writer, address: Address, size: int) -> Text:
    pointer = w.pointer(address, size)
    return Text(pointer, w.call("text_length", w.integer(pointer), str(size)))


def _not_less(w: Writer, low: int, value: str, site: int) -> None:
    w.trap_if(w.new(f"icmp slt i64 {value}, {low}"), "R0108", site, ("i64", value))


def _lesser(w: Writer, a: str, b: str) -> str:
    return w.new(f"call i64 @llvm.umin.i64(i64 {a}, i64 {b})")


def _moved(w: Writer, pointer: str, by: str) -> str:
    return w.new(f"getelementptr i8, ptr {pointer}, i64 {by}")


def _left(w: Writer, a: Node, n: Node, site: int) -> Text:
    text, count = w.text(a), w.value(n)
    _not_less(w, 0, count, site)
    return Text(text.at, _lesser(w, text.length, count))


def _right(w: Writer, a: Node, n: Node, site: int) -> Text:
    text, count = w.text(a), w.value(n)
    _not_less(w, 0, count, site)
    length = _lesser(w, text.length, count)
    return Text(_moved(w, text.at, w.new(f"sub i64 {text.length}, {length}")), length)


def _span(w: Writer, text: Text, n: str, p: str) -> tuple[str, str]:
    """Where n characters from position p on begin in a text, counted from 0, and how many of them there are."""
    start = _lesser(w, text.length, w.new(f"sub i64 {p}, 1"))
    return start, _lesser(w, n, w.new(f"sub i64 {text.length}, {start}"))


def _mid(w: Writer, a: Node, n: Node, p: Node, site: int) -> Text:
    text, count, position = w.text(a), w.value(n), w.value(p)
    _not_less(w, 0, count, site)
    _not_less(w, 1, position, site)
    start, length = _span(w, text, count, position)
    return Text(_moved(w, text.at, start), length)


# --- new texts ------------------------------------------------------------------------------------------------------


def _joined(w: Writer, size: int, *parts: Text) -> Text:
    """The texts one after the other, at most so many bytes."""
    at = w.scratch(size)
    length = "0"
    for part in parts:
        end = _moved(w, at, length)
        w.emit(f"call void @llvm.memcpy.p0.p0.i64(ptr {end}, ptr {part.at}, i64 {part.length}, i1 false)")
        length = w.new(f"add i64 {length}, {part.length}")
    return Text(at, length)


def _concat(w: Writer, a: Node, b: Node) -> Text:
    left, right = w.text(a), w.text(b)
    return _joined(w, capacity(w, a) + capacity(w, b), left, right)


def _spliced(w: Writer, size: int, text: Text, between: Text, start: str, dropped: str) -> Text:
    """A text with another one in place of `dropped` characters."""
    end = w.new(f"add i64 {start}, {dropped}")
    rest = Text(_moved(w, text.at, end), w.new(f"sub i64 {text.length}, {end}"))
    return _joined(w, size, Text(text.at, start), between, rest)


def _insert(w: Writer, a: Node, b: Node, p: Node, site: int) -> Text:
    text, between, position = w.text(a), w.text(b), w.value(p)
    _not_less(w, 0, position, site)
    return _spliced(w, capacity(w, a) + capacity(w, b), text, between, _lesser(w, text.length, position), "0")


def _replaced(w: Writer, size: int, text: Text, between: Text, n: str, p: str, site: int) -> Text:
    _not_less(w, 0, n, site)
    _not_less(w, 1, p, site)
    return _spliced(w, size, text, between, *_span(w, text, n, p))


def _delete(w: Writer, a: Node, n: Node, p: Node, site: int) -> Text:
    text, count, position = w.text(a), w.value(n), w.value(p)
    return _replaced(w, capacity(w, a), text, EMPTY, count, position, site)


def _replace(w: Writer, a: Node, b: Node, n: Node, p: Node, site: int) -> Text:
    text, between, count, position = w.text(a), w.text(b), w.value(n), w.value(p)
    return _replaced(w, capacity(w, a) + capacity(w, b), text, between, count, position, site)


# --- choices --------------------------------------------------------------------------------------------------------


def _either(w: Writer, condition: str, yes: Text, no: Text) -> Text:
    return Text(w.new(f"select i1 {condition}, ptr {yes.at}, ptr {no.at}"),
                w.new(f"select i1 {condition}, i64 {yes.length}, i64 {no.length}"))


def _select(w: Writer, g: Node, a: Node, b: Node) -> Text:
    chosen, left, right = w.value(g), w.text(a), w.text(b)
    return _either(w, chosen, right, left)


def _mux(w: Writer, k: Node, choices: tuple[Node, ...], site: int) -> Text:
    number = w.value(k)
    texts = [w.text(choice) for choice in choices]
    choose = chooser(w, number, len(texts), site)
    return Text(choose("ptr", [text.at for text in texts]), choose("i64", [text.length for text in texts]))


def _extreme(comparison: str) -> Callable[..., Text]:
    def emit(w: Writer, a: Node, b: Node) -> Text:
        left, right = w.text(a), w.text(b)
        order = w.call("text_order", w.integer(left.at), left.length, w.integer(right.at), right.length)
        return _either(w, w.new(f"icmp {comparison} i64 {order}, 0"), left, right)

    return emit


# --- values ---------------------------------------------------------------------------------------------------------

_WRITERS = {
    **dict.fromkeys(("ULINT", "LWORD"), "put_number"), "REAL": "put_real", "LREAL": "put_lreal", "TIME": "put_time",
    "LTIME": "put_ltime", "DATE": "put_date", "LDATE": "put_ldate", "TIME_OF_DAY": "put_tod",
    "LTIME_OF_DAY": "put_ltod", "DATE_AND_TIME": "put_dt", "LDATE_AND_TIME": "put_ldt",
}
"""The routine that writes a value of each data type; the others are integers."""


def _to_text(w: Writer, data_type: str, a: Node) -> Text:
    data_type = SHORT_NAMES.get(data_type, data_type)
    if data_type == "BOOL":
        value = w.value(a) if a[1] == "b" else w.new(f"icmp ne i64 {w.wide(a)}, 0")
        return _either(w, value, _const(w, b"TRUE"), _const(w, b"FALSE"))
    number = as_bits(w, a) if is_float(a[1]) else w.wide(a)
    return _written(w, _WRITERS.get(data_type, "put_integer"), number)


def as_bits(w: Writer, a: Node) -> str:
    """The 64 bits of a float as LREAL."""
    return w.new(f"bitcast double {as_double(w, w.value(a), a[1])} to i64")


def _written(w: Writer, routine: str, number: str) -> Text:
    at = w.scratch(LONGEST_NUMBER)
    return Text(at, w.call(routine, w.integer(at), number))


def _enum_text(w: Writer, names: tuple[tuple[int, str], ...], a: Node) -> Text:
    value, after, other = w.wide(a), w.label(), w.label()
    rows = [(number, _const(w, name.encode("latin-1", "replace")), w.label()) for number, name in dict(names).items()]
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


def from_text(w: Writer, machine: str, data_type: str, a: Node, site: int) -> str:
    """`from_text`: the routine tells whether the text is a literal and whether its value fits."""
    text, result = w.text(a), w.field("result")
    at = w.integer(text.at)
    kind = KINDS[SHORT_NAMES.get(data_type, data_type)]
    status = w.call("read_value", w.integer(result), str(kind), at, text.length)
    shown: tuple[tuple[Any, ...], ...] = (("text", at, text.length), ("const", data_type))
    w.trap_if(w.new(f"icmp eq i64 {status}, 1"), "R0111", site, *shown)
    w.trap_if(w.new(f"icmp eq i64 {status}, 2"), "R0105", site, *shown)
    number = w.new(f"load i64, ptr {result}, align 8")
    if machine == "b":
        return w.new(f"icmp ne i64 {number}, 0")
    if not is_float(machine):
        return cut(w, number, machine)
    value = w.new(f"bitcast i64 {number} to double")
    return w.new(f"fptrunc double {value} to float") if machine == "f32" else value


TEXTS: dict[str, Callable[..., Text]] = {
    "const": _const, "tmp": _tmp, "load_text": _load_text, "left": _left, "right": _right, "mid": _mid,
    "concat": _concat, "insert": _insert, "delete": _delete, "replace": _replace, "select": _select, "mux": _mux,
    "min": _extreme("sle"), "max": _extreme("sge"), "to_text": _to_text, "enum_text": _enum_text,
}
"""How each operation is written that yields a text: called with the operands of its row."""
