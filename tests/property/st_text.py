"""The text of a program that `st_making` makes, with as few parentheses as the precedence of operators allows."""

from __future__ import annotations

from typing import Any

from st_making import LEVEL, Node, Pou, Program

Lines = dict[tuple[int, int], int]
"""The line of each statement by its number, and by the number of the part of it that stands on a line of its own."""


def text_of(program: Program) -> tuple[str, Lines]:
    """The text, and where its statements stand."""
    out: list[str] = []
    lines: Lines = {}
    for name, members in program.structs:
        rows = " ".join(f"{member} : {kind};" for member, kind in members)
        out.append(f"TYPE {name} : STRUCT {rows} END_STRUCT; END_TYPE")
    for pou in program.pous:
        _pou(pou, out, lines)
    return "\n".join(out) + "\n", lines


def _pou(pou: Pou, out: list[str], lines: Lines) -> None:
    out.append(f"{pou.kind} {pou.name}" + (f" : {pou.result}" if pou.result else ""))
    for section in ("VAR_INPUT", "VAR_OUTPUT", "VAR_IN_OUT", "VAR"):
        rows = [row for row in pou.variables if row.section == section]
        if rows:
            out.append(section)
            out.extend(f"  {row.name} : {row.written}"
                       + (f" := {literal(row.kind.split()[0], row.initial)}" if row.initial is not None else "") + ";"
                       for row in rows)
            out.append("END_VAR")
    _block(pou.body, 1, out, lines)
    out.append(f"END_{pou.kind}")


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

    if kind == "assign":
        say(f"{place(operands[0])} := {value(operands[1])};")
    elif kind == "copy":
        say(f"{place(operands[0])} := {place(operands[1])};")
    elif kind == "bind":
        say(f"{place(operands[0])} := REF({place(operands[1])});")
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
    elif kind == "repeat":
        say("REPEAT", -1)
        inner(operands[0])
        say(f"UNTIL {value(operands[1])} END_REPEAT;", 0)
    else:
        say(f"{kind.upper()};")


def place(node: Node) -> str:
    if node[0] == "name":
        return str(node[2])
    if node[0] == "member":
        return f"{place(node[2])}.{node[3]}"
    if node[0] == "element":
        return f"{place(node[2])}[{value(node[3])}]"
    return f"{place(node[2])}^"


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
    if what == "convert":
        return f"{_source(node[2])}_TO_{kind}({value(node[2])})", 9
    if what == "truncate":
        return f"{_source(node[2])}_TRUNC_{kind}({value(node[2])})", 9
    return f"{node[2]}({', '.join(value(operand) for operand in node[3])})", 9


def _source(node: Node) -> str:
    return "STRING" if node[1].startswith("STRING") else str(node[1])


def _at_least(node: Node, level: float) -> str:
    text, own = _value(node)
    return text if own >= level else f"({text})"


def literal(kind: str, number: Any) -> str:
    if kind == "BOOL":
        return "TRUE" if number else "FALSE"
    if kind == "STRING":
        escaped = str(number).replace("$", "$$").replace("'", "$'")
        return f"'{escaped}'"
    if kind == "TIME":
        return f"T#{number}ns"
    if kind in ("REAL", "LREAL"):
        digits, _, exponent = repr(number).partition("e")
        return f"{kind}#{digits}{'' if '.' in digits else '.0'}{f'E{exponent}' if exponent else ''}"
    return f"{kind}#{number}"
