"""Rungs made at random of all instructions: reading and printing change nothing, and both engines do the same."""

from __future__ import annotations

import re

import pytest
from depth import times
from hypothesis import HealthCheck, Phase, given, settings
from hypothesis import strategies as st

from fbvm.base.diagnostics import Source
from fbvm.code.compiler import compile_text
from fbvm.machine.plc import Plc
from fbvm.syntax.formatter.formatter import formatted
from fbvm.syntax.ladder.instructions.instruction_set import Instruction, instruction_set
from fbvm.syntax.ladder.notation import Form, Notation
from fbvm.syntax.parser import parse
from fbvm.syntax.tree import Pou
from fbvm.syntax.tree.ladder import Ladder, Step

ROWS = instruction_set().rows
OUTPUTS = sorted(name for name, row in ROWS.items() if row.kind != "?" and row.does.startswith(
    ("CX_", ".address", ".value_address", ".reset_numbers")))
CONTACTS = sorted(name.removeprefix("LD") for name, row in ROWS.items() if row.kind == "?" and name.startswith("LD"))
BITS = ["0.00", "000105", "W3.15", "H0.03", "A200.11", "P_On", "P_CY", "T0005", "C3", "D7.04", ",IR1", "+5,IR1", "Start"]
WRITTEN_BITS = ["100.01", "W5.00", "H1.15", ",IR1", "-3,IR1", ",IR1+", "Lamp"]
WORDS = ["D10", "W1", "T5", "#12", "&7", "-5", "@D1", "*D2", ",IR0", "DR0,IR0", "A500", "Level"]
WIDE = ["D10", "#123456", "&70000", "-70000", "@D1", ",IR0", "IR2", "H4"]
OPERANDS = {
    "b": BITS, "B": WRITTEN_BITS, "w": WORDS, "z": ["D10", "#12", "@D1"], "Z": ["D10", "#123456", ",IR0"],
    "W": ["D20", "W2", "@D1", ",IR0+", "DR1", "Level"], "d": WIDE,
    "r": ["D30", "+1.5", "-0.25"], "l": ["D40", "+2.5"], "q": WIDE,
    "a": ["D50", "H8", "@D1", ",IR0", "Table"], "k": ["#0", "#1", "D50"],
    "A": ["D60", "D100", "@D1", ",IR0", "IR3", "Table"], "t": ["5", "0006", "T0007"], "c": ["3", "C0004"],
    "m": ["T0005", "T0006"],
    "v": ["D10", "W0.05", "T0005", "Level"], "x": ["IR0", "ir1"]}  # fmt: skip
DECLARED = """VAR
    Start AT CIO 0.05 : BOOL; Lamp AT CIO 101.00 : BOOL; Level AT D80 : WORD; Table AT D90 : ARRAY [0..9] OF WORD;
END_VAR"""
SPANS = {"": ("", ""), "none": ("", ""), "IL": ("IL", "ILC"), "MILH": ("MILH {} W9.00", "MILC {}"),
         "MILR": ("MILR {} W9.01", "MILC {}"), "JMP": ("JMP {}", "JME {}"), "FOR": ("FOR &2", "NEXT")}
"""What stands around rungs: how it begins and ends."""


@st.composite
def spelt(draw: st.DrawFn, row: Instruction) -> str:
    """A line as somebody might write it."""
    prefix = draw(st.sampled_from(["", "", *row.variations])) if row.kind not in ("FB", "FB-") else ""
    name = row.mnemonic
    if name in ("LDNOT", "ANDNOT", "ORNOT", "ANDLD", "ORLD", "OUTNOT") and draw(st.booleans()):
        name = name[:-3] + " NOT" if name.endswith("NOT") else name[:-2] + " LD"
    if draw(st.integers(0, 3)) == 0:
        name = name.lower()
    if row.code and draw(st.booleans()):
        name += f"({row.code})" if draw(st.booleans()) else f"({int(row.code)})"
    number = draw(st.sampled_from(["", "", "", "00012 "]))
    blanks = draw(st.sampled_from([" ", "\t", "   "]))
    operands = [draw(st.sampled_from(OPERANDS[kind])) for kind in row.operands]
    if row.operands and draw(st.integers(0, 9)) == 0:
        return f"{number}{prefix}{name}\n" + "\n".join(f"      {operand}" for operand in operands)
    remark = draw(st.sampled_from(["", "", "", "  // a remark"]))
    return number + prefix + name + "".join(blanks + operand for operand in operands) + remark


@st.composite
def condition(draw: st.DrawFn, depth: int = 2) -> list[str]:
    """Lines of a block that begins with LD."""
    contact = draw(st.sampled_from(["LD", "LDNOT", "LD" + draw(st.sampled_from(CONTACTS))]))
    lines = [draw(spelt(ROWS[contact]))]
    for _ in range(draw(st.integers(0, 3))):
        if depth and draw(st.integers(0, 2)) == 0:
            lines += draw(condition(depth - 1))
            lines.append(draw(spelt(ROWS[draw(st.sampled_from(["ANDLD", "ORLD"]))])))
        else:
            joined = ["AND", "OR", "ANDNOT", "ORNOT", "NOT", "UP", "DOWN", *(how + CONTACTS[0] for how in ("AND", "OR"))]
            lines.append(draw(spelt(ROWS[draw(st.sampled_from(joined))])))
    return lines


@st.composite
def rung(draw: st.DrawFn) -> list[str]:
    output = ROWS[draw(st.sampled_from([*OUTPUTS, "OUT", "OUTNOT", "SET", "RSET", "KEEP", "DIFU", "DIFD"]))]
    lines = [draw(st.sampled_from(["RUNG", "RUNG 7 what it is for", "rung 3"]))]
    if draw(st.integers(0, 4)) == 0:
        lines.append("' a note")
    for _ in range(output.inputs):
        lines += draw(condition())
    if output.inputs == 1 and draw(st.integers(0, 3)) == 0:
        return [*lines, "OUT TR3", draw(spelt(ROWS["AND"])), draw(spelt(output)), "LD TR3", draw(spelt(ROWS["ANDNOT"])),
                draw(spelt(ROWS["OUT"]))]
    return [*lines, draw(spelt(output))]


@st.composite
def program(draw: st.DrawFn) -> str:
    lines: list[str] = []
    for number in range(draw(st.integers(1, 4))):
        span = draw(st.sampled_from(list(SPANS)))
        begin, end = (word.format(number) for word in SPANS[span])
        if begin:
            lines += ["RUNG", *([] if span == "FOR" else draw(condition())), begin]
        lines += [*draw(rung()), *draw(rung()), *(["RUNG", end] if end else [])]
    return f"PROGRAM Main\n{DECLARED}\nLADDER\n" + "\n".join(lines) + "\nEND_LADDER\nEND_PROGRAM\n"


def steps(text: str) -> list[list[tuple[str, str, tuple[str, ...]]]]:
    tree, diagnostics = parse(Source("rungs.st", text))
    assert [d for d in diagnostics if d.severity == "error"] == []
    pou = tree.declarations[0]
    assert isinstance(pou, Pou)
    ladder = next(statement for statement in pou.body if isinstance(statement, Ladder))
    return [[_key(step) for step in each.steps] for each in ladder.rungs]


def _key(step: Step) -> tuple[str, str, tuple[str, ...]]:
    return step.prefix, step.mnemonic, step.operands


def run(text: str, engine: str, observed: bool = False) -> bytes:
    """The memory after three scans from the same beginning."""
    return bytes(executed(text, engine, observed).memory.u8)


def executed(text: str, engine: str, observed: bool = False) -> Plc:
    """A PLC that has done three scans of a program from the same beginning."""
    made = compile_text(text, lint=False)
    assert made.image is not None, made.errors[0].render() + text
    plc = Plc(made.image, engine=engine, observed=observed)
    words = plc.memory.words("D")
    for at in range(200):
        words[at] = at * 0x1357 & 0xFFFF
    words[1], words[2] = 60, 0x55
    for name, value in (("CX_IR[0]", 0x10010), ("CX_IR[1]", 0xDE010)):
        plc.write(name, value)
    for scan in range(3):
        plc.memory.words("CIO")[0] = scan * 0x2B
        assert plc.scan() is None, plc.trap
    return plc


UNSHRUNK = {"deadline": None, "suppress_health_check": list(HealthCheck), "phases": (Phase.explicit, Phase.generate)}
"""To make such a program smaller takes longer than to read it."""


@pytest.mark.slow
@settings(max_examples=times(25), **UNSHRUNK)  # type: ignore[arg-type]
@given(program())
def test_reading_and_printing_change_nothing(text: str) -> None:
    printed, problems = formatted(Source("rungs.st", text))
    assert problems == []
    assert formatted(Source("rungs.st", printed))[0] == printed
    assert steps(printed) == steps(text)
    again = "\n".join(["RUNG\n" + "\n".join(f"{p}{m} {' '.join(o)}" for p, m, o in each) for each in steps(text)])
    assert steps(f"PROGRAM Main\n{DECLARED}\nLADDER\n{again}\nEND_LADDER\nEND_PROGRAM\n") == steps(text)


@pytest.mark.slow
@settings(max_examples=times(3), **UNSHRUNK)  # type: ignore[arg-type]
@given(program())
def test_what_is_printed_does_the_same_on_every_engine(text: str) -> None:
    printed, _ = formatted(Source("rungs.st", text))
    left = run(text, "python")
    assert run(printed, "python") == left
    assert run(printed, "python", observed=True) == left
    assert run(printed, "native") == left


def written(text: str, form: Form) -> str:
    """A program with its rungs in one notation."""
    made, problems = formatted(Source("rungs.st", text), notation=Notation(form))
    assert problems == []
    return made


def comments(text: str) -> list[str]:
    return re.findall(r"a remark|a note|what it is for", text)


@pytest.mark.slow
@settings(max_examples=times(25), **UNSHRUNK)  # type: ignore[arg-type]
@given(program())
def test_each_notation_is_written_in_the_other_and_back(text: str) -> None:
    listed = written(text, Form.MNEMONICS)
    assert steps(listed) == steps(text)
    drawn = written(text, Form.DRAWING)
    assert written(drawn, Form.DRAWING) == written(written(drawn, Form.MNEMONICS), Form.DRAWING) == drawn
    assert steps(written(drawn, Form.MNEMONICS)) == steps(drawn)
    assert sorted(comments(drawn)) == sorted(comments(text))


@pytest.mark.slow
@settings(max_examples=times(3), **UNSHRUNK)  # type: ignore[arg-type]
@given(program())
def test_a_drawing_does_what_its_instructions_did(text: str) -> None:
    drawn, listed = executed(written(text, Form.DRAWING), "python"), executed(text, "python")
    for area in ("CIO", "W", "H", "A", "D", "T", "C"):
        assert list(drawn.memory.words(area)) == list(listed.memory.words(area)), area
    for name in ("CX_IR", "P_CY", "P_EQ", "P_ER"):
        assert drawn.read(name) == listed.read(name), name


def test_a_condition_with_a_box_stays_a_list_where_and_load_joins_it_to_another() -> None:
    """Drawn in series, NOT would invert what is in front of it, too."""
    for box in ("NOT", "UP", "DOWN"):
        rung = f"LADDER\nRUNG\nLD W0.00\nLD W0.01\n{box}\nAND LD\nOUT W0.02\nEND_LADDER"
        made = written(f"PROGRAM Main\n{rung}\nEND_PROGRAM\n", Form.DRAWING)
        assert [line.split()[0] for line in made.splitlines() if "W0" in line or line.split()[:1] in ([box], ["ANDLD"])] == [
            "LD", "LD", box, "ANDLD", "OUT"]
