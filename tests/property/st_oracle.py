"""What a program that `st_making` makes has to do: a tree walker, written from the rules of the language and not from an
engine.

It covers all that is made but the step budget."""

from __future__ import annotations

from contextlib import suppress
from typing import Any

from st_kinds import BITS, CHARACTERS, GENERIC, MEMBERS, REALS, STANDARD, TEXTS, Node, Pou, Program, Task, Variable, limits
from st_oracle_blocks import BLOCKS, Rungs
from st_oracle_places import Part, Place, Pointer, Shared, SharedRow, Temporaries, Union, reach_byte
from st_oracle_values import (
    COMPARED,
    Trapped,
    binary,
    converted,
    moved,
    of_bcd,
    rounded,
    standard,
    to_bcd,
    to_integer,
    wrapped,
)
from st_text import Lines

AREA_BYTES = 400


class _Exit(Exception):
    pass


class _Continue(Exception):
    pass


class _Return(Exception):
    pass


class _Jump(Exception):
    def __init__(self, label: str) -> None:
        super().__init__(label)
        self.label = label


def default(kind: str) -> Any:
    if kind == "BOOL":
        return False
    if kind.startswith(TEXTS):
        return ""
    if kind in CHARACTERS:
        return "\0"
    return None if kind.startswith(("REF", "PTR")) else 0.0 if kind in REALS else 0


def of_type(item: Any, generic: str, kind: str) -> Any:
    """A piece of a function of a generic type, for one type."""
    if isinstance(item, tuple):
        return tuple(of_type(part, generic, kind) for part in item)
    return kind if item == generic else item


class Oracle:
    """Executes a program, scan by scan."""

    def __init__(self, program: Program, lines: Lines, cycle_ns: int) -> None:
        self._structs = dict(program.structs)
        self._pous = STANDARD | {pou.name: pou for pou in program.pous}
        self._lines, self._line = lines, 0
        self._areas: dict[str, bytearray] = {}
        self._main = program.pous[-1]
        self._globals = {row.name: self._first(row) for row in program.variables}
        self._tasks = program.tasks
        names = [task.instance for task in program.tasks] or [self._main.name]
        self._instances = {name: self._instance(self._main) for name in names}
        self._cycle_ns, self._now_ns = cycle_ns, -cycle_ns
        self._levels: dict[str, bool] = {}

    def _instance(self, pou: Pou) -> dict[str, Any]:
        rows = [row for row in pou.variables if row.section not in ("VAR_TEMP", "VAR_IN_OUT")]
        return {row.name: self._first(row) for row in rows}

    def _first(self, row: Variable) -> Any:
        if row.span:
            return row.span[0]
        if row.initial is None:
            return self._made(row.kind)
        return rounded(row.kind, row.initial) if row.kind in REALS else row.initial

    def _made(self, kind: str) -> Any:
        if kind in self._structs:
            members = self._structs[kind]
            return Union(members) if kind[0] == "U" else {name: self._made(inner) for name, inner in members}
        if kind in self._pous:
            return self._instance(self._pous[kind])
        if kind.startswith("ARRAY"):
            _, low, high, inner = kind.split(" ", 3)
            return [self._made(inner) for _ in range(int(low), int(high) + 1)]
        return default(kind)

    def scan(self) -> Trapped | None:
        """Execute what is due, one cycle later."""
        self._now_ns += self._cycle_ns
        try:
            for name in self._due():
                self._body(self._main, self._instances[name], {})
        except Trapped as trapped:
            return Trapped(trapped.code, self._line)
        return None

    def _due(self) -> list[str]:
        if not self._tasks:
            return [self._main.name]
        return [task.instance for task in sorted(self._tasks, key=lambda task: task.priority) if self._is_due(task)]

    def _is_due(self, task: Task) -> bool:
        level = bool(task.single and self._globals[task.single])
        rose = level and not self._levels.get(task.instance, False)
        self._levels[task.instance] = level
        return rose or (bool(task.interval_ms) and not level and self._now_ns % (task.interval_ms * 10**6) == 0)

    def values(self) -> dict[str, Any]:
        """Global variables, and those of each instance of the program, by name; located ones as they are now."""
        for instance in self._instances.values():
            for row in self._main.variables:
                if row.at:
                    holder, key = self._located(row)
                    instance[row.name] = holder[key][:] if row.kind.startswith("ARRAY") else holder[key]
        return self._globals | self._instances

    def _body(self, pou: Pou, variables: dict[str, Any], passed: dict[str, Place], name: str = "") -> None:
        """Execute a body with its variables and what its in-outs stand for."""
        temporaries = Temporaries((row.name, self._first(row)) for row in pou.variables if row.section == "VAR_TEMP")
        places = passed | {name: (temporaries, name) for name in temporaries}
        places |= {row.name: self._located(row) for row in pou.variables if row.at}
        places |= {name: (self._globals, name) for name in self._globals if name not in variables}
        try:
            with suppress(_Return):
                self._block(pou.body, (variables, places, pou))
        finally:
            temporaries.ended = True

    def _located(self, row: Variable) -> Place:
        assert row.at
        area, first, bit = row.at
        content = self._areas.setdefault(area, bytearray(AREA_BYTES))
        if row.kind.startswith("ARRAY"):
            _, low, high, inner = row.kind.split(" ", 3)
            return {"": SharedRow(content, inner, first, int(high) - int(low) + 1)}, ""
        return Shared(content, row.kind, first, bit), ""

    # --- statements

    def _block(self, block: tuple[Node, ...], frame: Any) -> None:
        at = 0
        while at < len(block):
            statement = block[at]
            at += 1
            self._line = self._lines[statement[1], -1 if statement[0] == "repeat" else 0]
            try:
                getattr(self, f"_do_{statement[0]}")(frame, statement[1], *statement[2:])
            except _Jump as jump:
                labels = [number for number, other in enumerate(block) if other[0] == "label" and other[2] == jump.label]
                if not labels:
                    raise
                at = labels[0]

    def _at(self, number: int, part: int = 0) -> None:
        self._line = self._lines[number, part]

    def _do_assign(self, frame: Any, number: int, target: Node, node: Node) -> None:
        place = self._place(target, frame)
        self._store(place, target[1], self._value(node, frame))

    def _do_range(self, frame: Any, number: int, target: Node, node: Node) -> None:
        place, value = self._place(target, frame), self._value(node, frame)
        low, high = next(row.span for row in frame[2].variables if row.name == target[2])
        if not low <= value <= high:
            raise Trapped("R0103")
        place[0][place[1]] = value

    def _store(self, place: Place, kind: str, value: Any) -> None:
        if kind.startswith(TEXTS):
            value = value[:int(kind.split()[1])]
        place[0][place[1]] = value

    def _do_copy(self, frame: Any, number: int, target: Node, source: Node) -> None:
        into, out_of = self._place(target, frame), self._place(source, frame)
        into[0][into[1]][:] = list(out_of[0][out_of[1]])

    def _do_bind(self, frame: Any, number: int, reference: Node, target: Node) -> None:
        holder, key = self._place(reference, frame)
        holder[key] = Pointer(*self._place(target, frame))

    _do_point = _do_bind

    def _do_move(self, frame: Any, number: int, pointer: Node, count: int) -> None:
        holder, key = self._place(pointer, frame)
        if holder[key] is not None:
            holder[key] = Pointer(holder[key].holder, holder[key].key, holder[key].moved + count)

    def _do_run(self, frame: Any, number: int, instance: Node, inputs: Any, outputs: Any) -> None:
        place = self._place(instance, frame)
        inside, pou, passed = place[0][place[1]], self._pous[instance[1]], {}
        kinds = {row.name: row.kind for row in pou.variables}
        for name, node in inputs:
            if node[0] == "at":
                passed[name] = self._place(node[2], frame)
                if kinds[name] == "ANY":
                    passed["kind"] = {"": node[1]}, ""
            else:
                self._store((inside, name), kinds[name], self._value(node, frame))
        if pou.name in STANDARD:
            BLOCKS[pou.name](inside, self._now_ns)
        else:
            self._body(pou, inside, passed)
        self._at(number)
        for name, target in outputs:
            self._store(self._place(target, frame), target[1], inside[name])

    def _do_open(self, frame: Any, number: int, target: Node, name: str, array: Node, index: Node) -> None:
        place = self._place(target, frame)
        value = self._called(self._pous[name], [self._value(index, frame)], {
            "a": self._place(array, frame), "low": ({"": int(array[1].split()[1])}, "")})
        self._store(place, target[1], value)

    def _do_act(self, frame: Any, number: int, name: str) -> None:
        with suppress(_Return):
            self._block(dict(frame[2].actions)[name], frame)

    def _do_jump(self, frame: Any, number: int, label: str) -> None:
        raise _Jump(label)

    def _do_label(self, frame: Any, number: int, name: str) -> None:
        """Nothing."""

    def _do_any(self, frame: Any, number: int) -> None:
        variables, places, _ = frame
        variables["q0"], was = reach_byte(places["x"], places["kind"][0][""], variables["p0"], variables["p1"])
        variables["q1"] = variables["q1"] if was is None else was

    def _do_ladder(self, frame: Any, number: int, steps: Any) -> None:
        Rungs(frame[0]).run(steps)

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

    def _do_try(self, frame: Any, number: int, block: Any, handler: Any, final: Any) -> None:
        """A trap in the handler ends the program at once; jumps out of both lead through the statements at the end."""
        leaving: Exception | None = None
        try:
            try:
                self._block(block, frame)
            except Trapped:
                self._block(handler, frame)
        except (_Return, _Exit, _Continue, _Jump) as way:
            leaving = way
        self._block(final, frame)
        if leaving:
            raise leaving

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
            variables, places, _ = frame
            found: Place = places[node[2]] if node[2] in places else (variables, node[2])
            return found
        outer = self._place(node[2], frame)
        if what == "part":
            bits = BITS[node[1]]
            return Part(outer, node[2][1], bits * node[3], bits), ""
        inside = outer[0][outer[1]]
        if what == "member":
            return inside, node[3]
        if what in ("deref", "through", "beside"):
            place = inside.place(node[3] if what == "beside" else 0) if inside is not None else None
            if place is None:
                raise Trapped("R0110")
            return place  # type: ignore[no-any-return]
        low = node[4] if node[4] is not None else frame[1]["low"][0][""]
        index = self._value(node[3], frame)
        if not low <= index < low + len(inside):
            raise Trapped("R0102")
        return inside, index - low

    def _value(self, node: Node, frame: Any) -> Any:
        what, kind = node[0], node[1]
        row = getattr(self, f"_of_{what}", None)
        if row:
            return row(frame, kind, *node[2:])
        left = self._value(node[3], frame)
        if (node[2] == "AND_THEN" and not left) or (node[2] == "OR_ELSE" and left):
            return left
        right = self._value(node[4], frame)
        return COMPARED[node[2]](left, right) if what == "compare" else binary(kind, node[2], left, right)

    def _of_literal(self, frame: Any, kind: str, value: Any) -> Any:
        return rounded(kind, value) if kind in REALS else value

    def _of_get(self, frame: Any, kind: str, node: Node) -> Any:
        place = self._place(node, frame)
        return place[0][place[1]]

    def _of_convert(self, frame: Any, kind: str, node: Node) -> Any:
        value = self._value(node, frame)
        return value if node[1] == kind else converted(node[1], kind, value)

    _of_widen = _of_convert

    def _of_truncate(self, frame: Any, kind: str, node: Node) -> Any:
        return to_integer(kind, self._value(node, frame), False)

    def _of_bcd(self, frame: Any, kind: str, node: Node) -> Any:
        return of_bcd(kind, self._value(node, frame))

    def _of_to_bcd(self, frame: Any, kind: str, node: Node) -> Any:
        return to_bcd(kind, self._value(node, frame))

    def _of_moved(self, frame: Any, kind: str, sign: str, left: Node, right: Node) -> Any:
        return moved(kind, sign, self._value(left, frame), self._value(right, frame))

    def _of_apart(self, frame: Any, kind: str, left: Node, right: Node) -> Any:
        return wrapped(kind, self._value(left, frame) - self._value(right, frame))

    def _of_bound(self, frame: Any, kind: str, side: str, name: str) -> Any:
        low = frame[1]["low"][0][""]
        holder, key = frame[1][name]
        return low if side == "LOWER" else low + len(holder[key]) - 1

    def _of_named(self, frame: Any, kind: str, node: Node) -> Any:
        number = self._value(node, frame)
        return MEMBERS[number] if kind in TEXTS else number

    def _of_enabled(self, frame: Any, kind: str, name: str, operands: tuple[Node, ...]) -> Any:
        enable, *values = [self._value(operand, frame) for operand in operands]
        return self._called(self._pous[name], values, {}) if enable else default(kind)

    def _of_unary(self, frame: Any, kind: str, sign: str, node: Node) -> Any:
        value = self._value(node, frame)
        if sign == "NOT":
            return not value if kind == "BOOL" else ~value & (1 << BITS[kind]) - 1
        return -value if kind in REALS else wrapped(kind, -value)

    def _of_call(self, frame: Any, kind: str, name: str, operands: tuple[Node, ...]) -> Any:
        return standard(name, kind, [self._value(operand, frame) for operand in operands])

    def _of_user(self, frame: Any, kind: str, name: str, operands: tuple[Node, ...]) -> Any:
        pou, values = self._pous[name], [self._value(operand, frame) for operand in operands]
        if pou.result in GENERIC:
            rows = [Variable(row.section, row.name, row.written, kind) for row in pou.variables]
            pou = Pou(pou.kind, name, kind, tuple(rows), of_type(pou.body, pou.result, kind))
        return self._called(pou, values, {})

    def _called(self, pou: Pou, values: list[Any], passed: dict[str, Place]) -> Any:
        variables = self._instance(pou) | {pou.name: default(pou.result)}
        names = [row for row in pou.variables if row.section == "VAR_INPUT"]
        for row, value in zip(names, values, strict=True):
            self._store((variables, row.name), row.kind, value)
        line = self._line
        self._body(pou, variables, passed)
        self._line = line
        return variables[pou.name]
