"""What a program that `st_making` makes has to do: a tree walker, written from the rules of the language and not from an
engine.

It covers expressions of all elementary types but dates and wide strings, assignments, IF, CASE, FOR, WHILE, REPEAT, EXIT,
CONTINUE, RETURN, functions, function block instances with VAR_IN_OUT, structures, arrays, references, strings.  It does not
know located variables, timers, dates, WSTRING, text to value, REAL to text, partial access, tasks and the step budget."""

from __future__ import annotations

import math
import struct
from collections.abc import Callable
from contextlib import suppress
from typing import Any

from st_making import BITS, REALS, SIGNED, Node, Pou, Program, limits
from st_text import Lines

Place = tuple[Any, Any]
"""A dict or list and the key in it."""


class Trapped(Exception):
    """The program stops with a code at a line."""

    def __init__(self, code: str, line: int = 0) -> None:
        super().__init__(code, line)
        self.code, self.line = code, line


class _Exit(Exception):
    pass


class _Continue(Exception):
    pass


class _Return(Exception):
    pass


# --- values -----------------------------------------------------------------------------------------------------------


def single(number: float) -> float:
    """The nearest REAL."""
    try:
        answer: float = struct.unpack("<f", struct.pack("<f", number))[0]
    except OverflowError:
        return math.copysign(math.inf, number)
    return answer


def rounded(kind: str, number: float) -> float:
    return single(number) if kind == "REAL" else number


def wrapped(kind: str, number: int) -> int:
    """The low bits, read in the type."""
    number &= (1 << BITS[kind]) - 1
    return number - (1 << BITS[kind]) if (kind in SIGNED or kind == "TIME") and number >> BITS[kind] - 1 else number


def of_integer(kind: str, number: int) -> float:
    """The nearest REAL or LREAL, ties to even, without rounding twice."""
    spare = max(0, abs(number).bit_length() - (24 if kind == "REAL" else 53))
    whole, rest = divmod(abs(number), 1 << spare)
    half = (1 << spare) / 2
    whole += spare > 0 and (rest > half or (rest == half and whole % 2 == 1))
    return math.copysign(float(whole << spare), number)


def truncated(a: int, b: int) -> int:
    """The quotient toward zero."""
    return abs(a) // abs(b) * (1 if (a < 0) == (b < 0) else -1)


def divided(a: float, b: float) -> float:
    if b != 0:
        return a / b
    return math.nan if a == 0 or a != a else math.copysign(math.inf, a) * math.copysign(1, b)


def power(a: float, b: float) -> float:
    if b == 0:
        return 1.0
    if a == 0 and b < 0:
        return math.inf
    try:
        return math.pow(a, b)
    except ValueError:
        return math.nan
    except OverflowError:
        return -math.inf if a < 0 and b % 2 == 1 else math.inf


def mathematical(name: str, a: float) -> float:
    """A function of an LREAL; NaN outside its domain."""
    try:
        if name in ("LN", "LOG") and a == 0:
            return -math.inf
        return {"SQRT": math.sqrt, "LN": math.log, "LOG": math.log10, "EXP": math.exp, "SIN": math.sin, "COS": math.cos,
                "TAN": math.tan, "ASIN": math.asin, "ACOS": math.acos, "ATAN": math.atan}[name](a)
    except ValueError:
        return math.nan
    except OverflowError:
        return math.inf


def lesser(a: Any, b: Any) -> Any:
    if a != a or b != b:
        return math.nan
    return b if b < a else a


def greater(a: Any, b: Any) -> Any:
    if a != a or b != b:
        return math.nan
    return b if b > a else a


def to_integer(kind: str, number: float, nearest: bool) -> int:
    if number != number or math.isinf(number):
        raise Trapped("R0105")
    whole = round(number) if nearest else math.trunc(number)
    low, high = limits(kind)
    if not low <= whole <= high:
        raise Trapped("R0105")
    return whole


def converted(source: str, kind: str, value: Any) -> Any:
    if kind == "BOOL":
        return value != 0
    if kind == "STRING":
        return ("TRUE" if value else "FALSE") if source == "BOOL" else str(value)
    if source in REALS:
        return rounded(kind, value) if kind in REALS else to_integer(kind, value, True)
    return of_integer(kind, int(value)) if kind in REALS else wrapped(kind, int(value))


COMPARED: dict[str, Callable[[Any, Any], bool]] = {
    "=": lambda a, b: a == b, "<>": lambda a, b: a != b, "<": lambda a, b: a < b, "<=": lambda a, b: a <= b,
    ">": lambda a, b: a > b, ">=": lambda a, b: a >= b,
}  # fmt: skip


def binary(kind: str, sign: str, a: Any, b: Any) -> Any:
    if kind in REALS:
        if sign == "**":
            return rounded(kind, power(a, b))
        if sign == "/":
            return rounded(kind, divided(a, b))
        return rounded(kind, a + b if sign == "+" else a - b if sign == "-" else a * b)
    if sign in ("AND", "&", "AND_THEN"):
        return a & b
    if sign in ("OR", "OR_ELSE"):
        return a | b
    if sign == "XOR":
        return a ^ b
    if sign in "+-*":
        return wrapped(kind, a + b if sign == "+" else a - b if sign == "-" else a * b)
    if b == 0:
        raise Trapped("R0101")
    return wrapped(kind, truncated(a, b) if sign == "/" else a - b * truncated(a, b))


# --- functions --------------------------------------------------------------------------------------------------------


def shifted(name: str, kind: str, a: int, count: int) -> int:
    width = BITS[kind]
    if count < 0:
        raise Trapped("R0106")
    if name in ("SHL", "SHR"):
        return wrapped(kind, a << count if name == "SHL" else a >> count) if count < width else 0
    count = count % width if name == "ROL" else -count % width
    return wrapped(kind, a << count | a >> width - count)


def position(number: int, least: int) -> int:
    if number < least:
        raise Trapped("R0108")
    return number


def of_text(name: str, values: list[Any]) -> Any:
    """A function of strings."""
    text = values[0]
    if name == "CONCAT":
        return "".join(values)
    if name == "FIND":
        return text.find(values[1]) + 1 if values[1] else 0
    if name == "LEFT":
        return text[:position(values[1], 0)]
    if name == "RIGHT":
        return text[max(0, len(text) - position(values[1], 0)):]
    if name == "INSERT":
        at = position(values[2], 0)
        return text[:at] + values[1] + text[at:]
    length, at = position(values[-2], 0), position(values[-1], 1) - 1
    if name == "MID":
        return text[at:at + length]
    if name == "DELETE":
        return text[:at] + text[at + length:]
    return text[:at] + values[1] + text[at + length:]


def standard(name: str, kind: str, values: list[Any]) -> Any:
    """A standard function."""
    if name == "SEL":
        return values[2] if values[0] else values[1]
    if name == "MUX":
        if not 0 <= values[0] < len(values) - 1:
            raise Trapped("R0107")
        return values[1 + values[0]]
    if name in ("MIN", "MAX"):
        answer = values[0]
        for other in values[1:]:
            answer = (lesser if name == "MIN" else greater)(answer, other)
        return answer
    if name == "LIMIT":
        return lesser(greater(values[1], values[0]), values[2])
    if name == "ABS":
        return abs(values[0]) if kind in REALS else wrapped(kind, abs(values[0]))
    if name == "LEN":
        return len(values[0])
    if name in ("SHL", "SHR", "ROL", "ROR"):
        return shifted(name, kind, *values)
    if kind == "STRING" or name == "FIND":
        return of_text(name, values)
    return rounded(kind, mathematical(name, values[0]))


# --- programs ---------------------------------------------------------------------------------------------------------


def default(kind: str) -> Any:
    if kind == "BOOL":
        return False
    if kind.startswith("STRING"):
        return ""
    return None if kind.startswith("REF") else 0.0 if kind in REALS else 0


class Oracle:
    """Executes a program, scan by scan; `variables` are those of its instance."""

    def __init__(self, program: Program, lines: Lines) -> None:
        self._structs = dict(program.structs)
        self._pous = {pou.name: pou for pou in program.pous}
        self._lines = lines
        self._line = 0
        self._main = program.pous[-1]
        self.variables = self._instance(self._main)

    def _instance(self, pou: Pou) -> dict[str, Any]:
        made = {}
        for row in pou.variables:
            made[row.name] = self._made(row.kind) if row.initial is None else row.initial
            if row.kind in REALS and row.initial is not None:
                made[row.name] = rounded(row.kind, row.initial)
        return made

    def _made(self, kind: str) -> Any:
        if kind in self._structs:
            return {name: self._made(inner) for name, inner in self._structs[kind]}
        if kind in self._pous:
            return self._instance(self._pous[kind])
        if kind.startswith("ARRAY"):
            _, low, high, inner = kind.split(" ", 3)
            return [self._made(inner) for _ in range(int(low), int(high) + 1)]
        return default(kind)

    def scan(self) -> Trapped | None:
        """Execute the program once."""
        try:
            self._body(self._main, self.variables, {})
        except Trapped as trapped:
            return Trapped(trapped.code, self._line)
        return None

    def _body(self, pou: Pou, frame: dict[str, Any], passed: dict[str, Place]) -> None:
        with suppress(_Return):
            self._block(pou.body, (frame, passed))

    # --- statements

    def _block(self, block: tuple[Node, ...], frame: Any) -> None:
        for statement in block:
            self._line = self._lines[statement[1], -1 if statement[0] == "repeat" else 0]
            getattr(self, f"_do_{statement[0]}")(frame, statement[1], *statement[2:])

    def _at(self, number: int, part: int = 0) -> None:
        self._line = self._lines[number, part]

    def _do_assign(self, frame: Any, number: int, target: Node, node: Node) -> None:
        place = self._place(target, frame)
        self._store(place, target[1], self._value(node, frame))

    def _store(self, place: Place, kind: str, value: Any) -> None:
        if kind.startswith("STRING"):
            value = value[:int(kind[7:])]
        place[0][place[1]] = value

    def _do_copy(self, frame: Any, number: int, target: Node, source: Node) -> None:
        into, out_of = self._place(target, frame), self._place(source, frame)
        into[0][into[1]][:] = out_of[0][out_of[1]]

    def _do_bind(self, frame: Any, number: int, reference: Node, target: Node) -> None:
        place = self._place(reference, frame)
        place[0][place[1]] = self._place(target, frame)

    def _do_run(self, frame: Any, number: int, instance: Node, inputs: Any, outputs: Any) -> None:
        place = self._place(instance, frame)
        inside, pou, passed = place[0][place[1]], self._pous[instance[1]], {}
        kinds = {row.name: row.kind for row in pou.variables}
        for name, node in inputs:
            if node[0] == "at":
                passed[name] = self._place(node[2], frame)
            else:
                self._store((inside, name), kinds[name], self._value(node, frame))
        self._body(pou, inside, passed)
        self._at(number)
        for name, target in outputs:
            self._store(self._place(target, frame), target[1], inside[name])

    def _do_if(self, frame: Any, number: int, rows: Any, otherwise: Any) -> None:
        for part, (condition, block) in enumerate(rows):
            self._at(number, part)
            if self._value(condition, frame):
                return self._block(block, frame)
        return self._block(otherwise, frame)

    def _do_case(self, frame: Any, number: int, node: Node, rows: Any, otherwise: Any) -> None:
        value = self._value(node, frame)
        for labels, block in rows:
            if any(low <= value <= high for low, high in labels):
                return self._block(block, frame)
        return self._block(otherwise, frame)

    def _do_for(self, frame: Any, number: int, counter: Node, first: Node, last: Node, step: Node | None, block: Any) -> None:
        place, kind = self._place(counter, frame), counter[1]
        value, end = self._value(first, frame), self._value(last, frame)
        by = self._value(step, frame) if step else 1
        if by == 0:
            raise Trapped("R0109")
        low, high = limits(kind)
        place[0][place[1]] = value
        while value <= end if by > 0 else value >= end:
            if not self._pass(block, frame):
                return
            value += by
            if not low <= value <= high:
                return
            place[0][place[1]] = value

    def _pass(self, block: Any, frame: Any) -> bool:
        """One pass of a loop; False if it was left."""
        try:
            self._block(block, frame)
        except _Exit:
            return False
        except _Continue:
            pass
        return True

    def _do_while(self, frame: Any, number: int, condition: Node, block: Any) -> None:
        while self._value(condition, frame) and self._pass(block, frame):
            self._at(number)

    def _do_repeat(self, frame: Any, number: int, block: Any, condition: Node) -> None:
        while self._pass(block, frame):
            self._at(number)
            if self._value(condition, frame):
                return

    def _do_exit(self, frame: Any, number: int) -> None:
        raise _Exit

    def _do_continue(self, frame: Any, number: int) -> None:
        raise _Continue

    def _do_return(self, frame: Any, number: int) -> None:
        raise _Return

    # --- places and values

    def _place(self, node: Node, frame: Any) -> Place:
        what = node[0]
        if what == "name":
            variables, passed = frame
            found: Place = passed[node[2]] if node[2] in passed else (variables, node[2])
            return found
        outer = self._place(node[2], frame)
        inside = outer[0][outer[1]]
        if what == "member":
            return inside, node[3]
        if what == "deref":
            if inside is None:
                raise Trapped("R0110")
            return inside  # type: ignore[no-any-return]
        index = self._value(node[3], frame)
        if not node[4] <= index <= node[5]:
            raise Trapped("R0102")
        return inside, index - node[4]

    def _value(self, node: Node, frame: Any) -> Any:
        what, kind = node[0], node[1]
        if what == "literal":
            return rounded(kind, node[2]) if kind in REALS else node[2]
        if what == "get":
            place = self._place(node[2], frame)
            return place[0][place[1]]
        if what in ("widen", "convert", "truncate"):
            value = self._value(node[2], frame)
            if what == "truncate":
                return to_integer(kind, value, False)
            return value if node[2][1] == kind else converted(node[2][1], kind, value)
        if what == "unary":
            value = self._value(node[3], frame)
            if node[2] == "NOT":
                return not value if kind == "BOOL" else ~value & (1 << BITS[kind]) - 1
            return -value if kind in REALS else wrapped(kind, -value)
        if what == "call":
            return standard(node[2], kind, [self._value(operand, frame) for operand in node[3]])
        if what == "user":
            return self._called(self._pous[node[2]], [self._value(operand, frame) for operand in node[3]])
        left = self._value(node[3], frame)
        if (node[2] == "AND_THEN" and not left) or (node[2] == "OR_ELSE" and left):
            return left
        right = self._value(node[4], frame)
        return COMPARED[node[2]](left, right) if what == "compare" else binary(kind, node[2], left, right)

    def _called(self, pou: Pou, values: list[Any]) -> Any:
        frame = self._instance(pou) | {pou.name: default(pou.result)}
        names = [row for row in pou.variables if row.section == "VAR_INPUT"]
        for row, value in zip(names, values, strict=True):
            self._store((frame, row.name), row.kind, value)
        line = self._line
        self._body(pou, frame, {})
        self._line = line
        return frame[pou.name]


