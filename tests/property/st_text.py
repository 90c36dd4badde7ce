"""The text of a program that `st_making` makes, with as few parentheses as the precedence of operators allows."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from datetime import date, timedelta
from typing import Any

from st_kinds import (
    BITS,
    DATES,
    DAY_NS,
    DAYS,
    DAYTIMES,
    DURATIONS,
    LEVEL,
    MEMBERS,
    PARTS,
    REALS,
    Node,
    Pou,
    Program,
    Task,
    Variable,
)

Lines = dict[tuple[int, int], int]
"""The line of each statement by its number, and by the number of the part of it that stands on a line of its own."""


def text_of(program: Program) -> tuple[str, Lines]:
    """The text, and where its statements stand."""
    out: list[str] = []
    lines: Lines = {}
    for name, members in program.structs:
        rows = " ".join(f"{member} : {kind};" for member, kind in members)
        word = "UNION" if name[0] == "U" else "STRUCT"
        out.append(f"TYPE {name} : {word} {rows} END_{word}; END_TYPE")
    if "'E0'" in repr(program.pous):
        out.append("TYPE E0 : (" + ", ".join(f"{name} := {number}" for number, name in MEMBERS.items()) + "); END_TYPE")
    _section("VAR_GLOBAL", program.variables, out)
    for pou in program.pous:
        _pou(pou, out, lines)
    if program.tasks:
        _configuration(program.tasks, out)
    return "\n".join(out) + "\n", lines


def _pou(pou: Pou, out: list[str], lines: Lines) -> None:
    out.append(f"{pou.kind} {pou.name}" + (f" : {pou.result}" if pou.result else ""))
    for section in ("VAR_INPUT", "VAR_OUTPUT", "VAR_IN_OUT", "VAR", "VAR_TEMP"):
        _section(section, [row for row in pou.variables if row.section == section], out)
    if "('try'," in repr((pou.body, pou.actions)):
        out.append("VAR x9 : __SYSTEM.ExceptionCode; END_VAR")
    _block(pou.body, 1, out, lines)
    for name, block in pou.actions:
        out.append(f"ACTION {name}:")
        _block(block, 1, out, lines)
        out.append("END_ACTION")
    out.append(f"END_{pou.kind}")


def _section(section: str, rows: Sequence[Variable], out: list[str]) -> None:
    if rows:
        out += [section, *map(_declaration, rows), "END_VAR"]


def _declaration(row: Variable) -> str:
    first = f" := {literal(row.kind.split()[0], row.initial)}" if row.initial is not None else ""
    return f"  {row.name}{_location(row)} : {row.written}{first};"


def _location(row: Variable) -> str:
    if row.at is None:
        return ""
    area, byte, bit = row.at
    if area == "%M":
        size = BITS[row.kind.split()[-1]] // 8
        return f" AT %MX{byte}.{bit}" if bit is not None else f" AT %M{' BW D   L'[size]}{byte // size}"
    return f" AT {area}{byte // 2}" + (f".{bit + byte % 2 * 8:02}" if bit is not None else "")


def _configuration(tasks: tuple[Task, ...], out: list[str]) -> None:
    out += ["CONFIGURATION C", "RESOURCE R ON PLC"]
    for task in tasks:
        interval = f"INTERVAL := T#{task.interval_ms}ms, " if task.interval_ms else ""
        single = f"SINGLE := {task.single}, " if task.single else ""
        out.append(f"  TASK T{task.instance}({single}{interval}PRIORITY := {task.priority});")
    out += [f"  PROGRAM {task.instance} WITH T{task.instance} : Main;" for task in tasks]
    out += ["END_RESOURCE", "END_CONFIGURATION"]


def _block(block: tuple[Node, ...], depth: int, out: list[str], lines: Lines) -> None:
    for statement in block:
        _statement(statement, depth, out, lines)


def _statement(statement: Node, depth: int, out: list[str], lines: Lines) -> None:
    kind, number, *operands = statement

    def say(text: str, part: int = 0) -> None:
        out.append("  " * depth + text)
        lines.setdefault((number, part), len(out))

    def inner(block: tuple[Node, ...]) -> None:
        _block(block, depth + 1, out, lines)

    if kind in ("assign", "range"):
        say(f"{place(operands[0])} := {value(operands[1])};")
    elif kind == "copy":
        say(f"{place(operands[0])} := {place(operands[1])};")
    elif kind in SIMPLE:
        say(SIMPLE[kind](*operands))
    elif kind == "any":
        say("q0 := x.diSize;")
        out.append("  IF p0 >= 0 AND p0 <= UPPER_BOUND(x.BYTES, 1) THEN q1 := x.BYTES[p0]; x.BYTES[p0] := p1; END_IF;")
    elif kind == "ladder":
        say("LADDER")
        for mnemonic, operand in operands[0]:
            out.append(f"    {mnemonic} {operand}".rstrip())
        out.append("END_LADDER")
    elif kind == "run":
        pins = [f"{name} := {place(node[2]) if node[0] == 'at' else value(node)}" for name, node in operands[1]]
        pins += [f"{name} => {place(node)}" for name, node in operands[2]]
        say(f"{place(operands[0])}({', '.join(pins)});")
    elif kind == "if":
        for part, (condition, block) in enumerate(operands[0]):
            say(f"{'ELSIF' if part else 'IF'} {value(condition)} THEN", part)
            inner(block)
        if operands[1]:
            say("ELSE", -1)
            inner(operands[1])
        say("END_IF;", -2)
    elif kind == "case":
        say(f"CASE {value(operands[0])} OF")
        for labels, block in operands[1]:
            say(", ".join(str(low) if low == high else f"{low}..{high}" for low, high in labels) + ":", -1)
            inner(block)
        if operands[2]:
            say("ELSE", -1)
            inner(operands[2])
        say("END_CASE;", -2)
    elif kind == "for":
        counter, first, last, step, block = operands
        by = f" BY {value(step)}" if step else ""
        say(f"FOR {place(counter)} := {value(first)} TO {value(last)}{by} DO")
        inner(block)
        say("END_FOR;", -2)
    elif kind == "while":
        say(f"WHILE {value(operands[0])} DO")
        inner(operands[1])
        say("END_WHILE;", -2)
    elif kind == "try":
        say("__TRY")
        inner(operands[0])
        say("__CATCH(x9)", -1)
        inner(operands[1])
        if operands[2]:
            say("__FINALLY", -1)
            inner(operands[2])
        say("__ENDTRY;", -2)
    elif kind == "repeat":
        say("REPEAT", -1)
        inner(operands[0])
        say(f"UNTIL {value(operands[1])} END_REPEAT;", 0)
    else:
        say(f"{kind.upper()};")


def place(node: Node) -> str:
    what = node[0]
    if what == "name":
        return str(node[2])
    inner = place(node[2])
    if what == "through":
        return inner
    if what == "member":
        return f"{inner}.{node[3]}"
    if what == "element":
        return f"{inner}[{value(node[3])}]"
    if what == "beside":
        return f"{inner}[{node[3]}]"
    if what == "part":
        return f"{inner}.{'' if node[1] == 'BOOL' and node[3] % 2 else '%' + PARTS[node[1]]}{node[3]}"
    return f"{inner}^"


def _bind(reference: Node, target: Node) -> str:
    if reference[1].startswith("REFERENCE"):
        return f"{place(reference)} REF= {place(target)};"
    return f"{place(reference)} := REF({place(target)});"


def _move(pointer: Node, count: int) -> str:
    return f"{place(pointer)} := {place(pointer)} {'-' if count < 0 else '+'} {abs(count)} * SIZEOF({pointer[1][4:]});"


SIMPLE: dict[str, Callable[..., str]] = {
    "bind": _bind, "move": _move,
    "point": lambda pointer, target: f"{place(pointer)} := ADR({place(target)});",
    "open": lambda target, name, array, index: f"{place(target)} := {name}(a := {place(array)}, p0 := {value(index)});",
    "act": lambda name: f"{name}();", "jump": lambda name: f"JMP {name};", "label": lambda name: f"{name}:",
}  # fmt: skip
"""Statements of one line."""


def value(node: Node) -> str:
    return _value(node)[0]


def _value(node: Node) -> tuple[str, float]:
    """Text and level of an expression."""
    what, kind = node[0], node[1]
    if what == "literal":
        return literal(kind, node[2]), 9
    if what == "get":
        return place(node[2]), 9
    if what == "widen":
        return _value(node[2])
    if what in ("binary", "compare"):
        level = LEVEL[node[2]]
        return f"{_at_least(node[3], level)} {node[2]} {_at_least(node[4], level + 0.25)}", level
    if what == "unary":
        return f"{node[2]}{' ' if node[2] == 'NOT' else ''}{_at_least(node[3], 9)}", 8
    if what in WRITTEN:
        return WRITTEN[what].format(_source(node[2]), kind, value(node[2])), 9
    if what in ("moved", "apart"):
        sign, left, right = node[2:] if what == "moved" else ("-", *node[2:])
        return f"{_at_least(left, 5)} {sign} {_at_least(right, 5.25)}", 5
    if what == "named":
        return f"TO_{kind}({value(node[2])})", 9
    if what == "enabled":
        pins = ", ".join(f"{'EN' if n == 0 else f'p{n - 1}'} := {value(operand)}" for n, operand in enumerate(node[3]))
        return f"{node[2]}({pins})", 9
    if what == "bound":
        return f"{node[2]}_BOUND({node[3]}, 1)", 9
    return f"{node[2]}({', '.join(value(operand) for operand in node[3])})", 9


WRITTEN = {"convert": "{}_TO_{}({})", "truncate": "{}_TRUNC_{}({})", "bcd": "{}_BCD_TO_{}({})", "to_bcd": "{}_TO_BCD_{}({})"}
"""Conversions: type of the operand, type of the result, operand."""


def _source(node: Node) -> str:
    return str(node[1]).split()[0]


def _at_least(node: Node, level: float) -> str:
    text, own = _value(node)
    return text if own >= level else f"({text})"


def literal(kind: str, number: Any) -> str:
    if kind == "BOOL":
        return "TRUE" if number else "FALSE"
    if kind == "E0":
        return f"E0#{MEMBERS[number]}"
    if kind in ("STRING", "CHAR", "WSTRING", "WCHAR"):
        quote, width = ('"', 4) if kind[0] == "W" else ("'", 2)
        inside = "".join(f"${c}" if c in ("$", quote) else c if " " <= c <= "~" else f"${ord(c):0{width}X}" for c in number)
        return f"{f'{kind}#' if kind.endswith('CHAR') else ''}{quote}{inside}{quote}"
    if kind in DURATIONS:
        return f"{kind}#{number}ns"
    if kind in DATES:
        return f"{kind}#{moment(kind, number)}"
    if kind in REALS:
        digits, _, exponent = repr(number).partition("e")
        return f"{kind}#{digits}{'' if '.' in digits else '.0'}{f'E{exponent}' if exponent else ''}"
    return f"{kind}#{number}"


def moment(kind: str, number: int) -> str:
    """A date, a time of day or both, as a literal has it behind its prefix."""
    day, rest = divmod(number, DAY_NS)
    seconds, fraction = divmod(rest, 10**9)
    clock = f"{seconds // 3600:02}:{seconds // 60 % 60:02}:{seconds % 60:02}" + f".{fraction:09}".rstrip("0").rstrip(".")
    first = (date(1970, 1, 1) + timedelta(days=day)).isoformat()
    return first if kind in DAYS else clock if kind in DAYTIMES else f"{first}-{clock}"
