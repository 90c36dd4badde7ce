"""Rungs that are stored as cells: the instructions that they are, or why they are none."""

from __future__ import annotations

import os
from pathlib import Path

from rows import each_of

from fbvm.interchange.cx.markup import Row, Value
from fbvm.interchange.cx.read.elements import ElementError, instructions
from fbvm.interchange.cx.read.project import BlockVariable, Elements, FunctionBlock

TEXTS = Path(__file__).with_name("texts") / "cells.txt"
TITLE, MADE, REFUSED = "--- ", "> ", "! "


def pin(usage: str, name: str) -> BlockVariable:
    return BlockVariable(Row(0, 0, ()), usage, name, "BOOL", "", 1, "", False, "")


HOLD = FunctionBlock(Value(0, 0, 0, 0), "HOLD", "FBLadder", "", False,
                     (pin("1", "A"), pin("2", "Q"), pin("0", "N"), pin("1", "B"), pin("1", "C")), ())  # fmt: skip


def made(rows: list[str]) -> list[str]:
    separator = "|" if "|" in rows[0] else ","
    elements = Elements(tuple((row, 0) for row in rows), separator)
    try:
        return [MADE + line for line in instructions(elements, lambda name: ("HOLD_1", HOLD) if name == "Hold1" else None)]
    except ElementError as error:
        return [REFUSED + str(error)]


def cases() -> list[tuple[str, list[str], list[str]]]:
    found = []
    for part in TEXTS.read_text(encoding="utf-8").removeprefix(TITLE).split(f"\n{TITLE}"):
        title, *lines = part.rstrip("\n").split("\n")
        found.append((title, [line for line in lines if line[:2] not in (MADE, REFUSED)],
                      [line for line in lines if line[:2] in (MADE, REFUSED)]))  # fmt: skip
    if os.environ.get("FBVM_REWRITE"):
        found = [(title, rows, made(rows)) for title, rows, _ in found]
        TEXTS.write_text("".join("\n".join([TITLE + title, *rows, *said, ""]) for title, rows, said in found), encoding="utf-8")
    return found


@each_of(("title", "rows", "said"), cases(), ids=lambda case: case[0])
def test_cells_are_instructions_or_are_refused_by_name(title: str, rows: list[str], said: list[str]) -> None:
    assert made(rows) == said != [], title
