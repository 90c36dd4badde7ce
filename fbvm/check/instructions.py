"""The page of each ladder instruction, made of the instruction table and of the library that executes it."""

from __future__ import annotations

import re
from functools import cache
from pathlib import Path

from fbvm.base.data import data_folder
from fbvm.base.digits import whole_number
from fbvm.syntax.ladder.instructions.instruction_set import KINDS, Instruction, instruction_set

FLAGS = ("P_ER", "P_CY", "P_GT", "P_GE", "P_EQ", "P_NE", "P_LE", "P_LT", "P_N", "P_OF", "P_UF")
_CALLED = re.compile(r"\b(CX_\w+|P_[A-Z]{1,2})\b")
_PREFIXES = {"@": "@ on the rise of its condition", "%": "% on its fall", "!": "! with immediate refresh (no effect here)"}


def find(name: str) -> Instruction | None:
    """The instruction of that name, as it is written or listed (`@MOV`, `MOV(021)`) or of that function code; of comparisons
    also without LD, AND or OR in front."""
    rows = instruction_set().rows
    spelt, _, _ = name.strip().upper().replace(" ", "").partition("(")
    found = rows.get(spelt) or rows.get(f"LD{spelt}")
    if found is None and spelt[:1] in _PREFIXES:
        found = rows.get(spelt[1:]) or rows.get(f"LD{spelt[1:]}")
    if found is None and spelt.isdecimal():
        found = next((row for row in rows.values() if row.code and int(row.code) == whole_number(spelt)), None)
    return found


def page(row: Instruction) -> str:
    """What an instruction does, its operands and its flags, as text for people."""
    lines = [row.mnemonic + (f"({row.code})" if row.code else ""), "", *_wrapped(meaning(row)), ""]
    if not row.does:
        return "\n".join([*lines[:2], "Understood and not executed.", *lines[2:-1]])
    width = max((len(name) for name in row.names), default=0)
    for name, kind, number in zip(row.names, row.operands, range(len(row.names)), strict=True):
        lines.append(f"  {name:{width}}  {KINDS[kind]}" + (", may be left out" if number >= row.least else ""))
    lines += [""] * bool(row.names)
    lines += [f"  {_PREFIXES[sign]}" for sign in row.variations]
    if row.kind == "?":
        lines.append("  a contact: LD begins a block with it, AND and OR join it")
    elif row.inputs != 1:
        lines.append("  stands at the bus bar" if not row.inputs else f"  takes {row.inputs} conditions, the upper one first")
    lines.append(f"  flags: {' '.join(flags(row)) or 'none'}")
    return "\n".join(lines)


def meaning(row: Instruction) -> str:
    """What an instruction does, or why it is refused, in a sentence or two."""
    said = row.words or _comment(row.does).partition(": ")[2]
    return said[:1].upper() + said[1:].removesuffix(".") + "."


@cache
def flags(row: Instruction) -> list[str]:
    """The condition flags that an instruction writes or reads."""
    seen: set[str] = set()
    todo = [row.does] if row.does.startswith("CX_") else _SAID.get(row.does, [])
    todo = list(todo)
    while todo:
        name = todo.pop()
        if name not in seen:
            seen.add(name)
            if name.startswith("CX_"):
                todo += _CALLED.findall(_source(name))
    return [flag for flag in FLAGS if flag in seen]


_SAID = {".reset_numbers": ["CX_CNR"], ".failure": ["CX_FAL"], ".macro": ["CX_MCRO_In", "CX_MCRO_Out"]}
"""What the front end calls for some of its own words."""


@cache
def _files() -> dict[str, Path]:
    return {path.stem.upper(): path for path in data_folder("fblib").rglob("CX_*.st")}


@cache
def _source(name: str) -> str:
    """A library's source without its comments; "" for what is no file, such as a global variable."""
    path = _files().get(name.upper())
    return re.sub(r"//[^\n]*", "", path.read_text(encoding="utf-8")) if path else ""


def _comment(name: str) -> str:
    """The comment at the head of a library's source, in one line."""
    lines = []
    for line in _files()[name.upper()].read_text(encoding="utf-8").splitlines():
        if not line.startswith("//"):
            break
        lines.append(line[2:].strip())
    return " ".join(" ".join(lines).split())


def _wrapped(text: str, width: int = 100) -> list[str]:
    lines = [""]
    for word in text.split():
        if len(lines[-1]) + len(word) >= width:
            lines.append("")
        lines[-1] = f"{lines[-1]} {word}".strip()
    return lines
