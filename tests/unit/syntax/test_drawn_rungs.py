"""Rungs beside their drawings in several widths, at rest and with power, and what is said of drawings that are damaged in each
of their cells, word for word.  `FBVM_REWRITE=1 pytest` of this file writes the texts anew; read the difference before you
keep it."""

from __future__ import annotations

import os
from collections.abc import Callable
from pathlib import Path

import pytest
from growth import assert_linear

from fbvm.syntax.ladder.drawing.drawing import rung_text
from fbvm.syntax.ladder.drawing.reading import remark_of
from fbvm.syntax.ladder.drawing.widths import Annotations
from fbvm.syntax.ladder.mnemonics import read_rungs

TEXTS = Path(__file__).parent / "texts"
RUNGS = {
    "series": "LD a; ANDNOT long_name_of_b; @AND c; %ANDNOT d; OUT e",
    "parallel": "LD a; OR b; ORNOT c; AND d; OR e; OUTNOT f",
    "parallel in parallel": "LD a; LD b; OR c; AND d; LD e; AND f; ORLD; ANDLD; OUT g",
    "a branch that is longer than the others": "LD a; LD b; AND c; AND d; ORLD; LD e; LD f; AND g; ORLD; ANDLD; OUT x",
    "outputs one below the other": "LD a; OUT b; SET c; RSET d; DIFU e; DIFD f; @SET g; !OUT x",
    "branch points": "LD a; OUT TR0; AND b; OUT TR1; AND c; OUT x; LD TR1; ANDNOT c; OUT y; LD TR0; AND d; OUT z; LD TR0; OUT u",
    "a branch that ends in two": "LD a; AND b; OUT TR0; LD c; OR d; ANDLD; OUT x; LD TR0; LD e; OR f; ANDLD; OUT y",
    "comparisons": "LD= D0 #5; AND> D100 &7; OR<=L D10 D20; OUT x",
    "a comparison as a branch": "LD a; OR>= D0 D1; AND<>S D2 D3; OUT x",
    "boxes": "LD a; MOV #1 D0; @+(400) D0 D1 D2; AND b; ++(590) D0",
    "a box behind a bridge": "LD a; OR b; NOT; AND c; UP; DOWN; OUT x",
    "boxes of two inputs": "LD a; LD b; CNT 1 #10; LD c; LD d; KEEP e",
    "one of three": "LD a; AND b; LD c; OR d; LD e; SFT D0 D1",
    "lower inputs at a branch point": "LD a; OUT TR0; AND b; LD TR0; AND c; LD TR0; ANDNOT d; CNTR 5 #10",
    "a box of two inputs below outputs": "LD a; OUT TR0; OUT x; LD TR0; AND b; LD TR0; AND c; CNT 5 #10",
    "a call": "LD a; FBCALL TON t IN:=b PT:=T#1s Q=>c ET=>d; AND t.Q; OUT x",
    "calls behind each other": "LD a; FBCALL CTU k CU:=* PV:=&5 Q=>*"
        "; FBCALL TON t IN:=* PT:=long_operand_of_timer Q=>* ET=>e; OUT x",
    "a call in a branch": "LD a; OR b; FBCALL R_TRIG r CLK:=* Q=>*; OR c; OUT x",
    "a call at the end": "LD a; FBCALL Part p u:=b io:=c done=>d",
    "a call at the rail": "FBCALL Part p u:=b", "at the rail": "END", "jumps": "LD a; JMP 1; LD b; OUT c; JME 1",
    "wide letters": "LD 水位; AND 펌프; OUT 밸브; MOV 水位 D0", "what has no drawing": "LD a; OUT b; OR c; OUT d",
    "behind the last input": "LD a; LD b; CNT 1 #10; AND c; OUT x",
    "an AND of what changes power": "LD a; LD b; UP; ANDLD; OUT x",
    "nothing in front of a branch": "LD a; LD b; AND c; ORLD; LD d; OR e; ANDLD; LD f; ORLD; OUT x",
    "a condition for nothing": "LD a; AND b", "blocks of inputs too few": "LD a; CNT 1 #10",
    "too many blocks": "LD a; LD b; OUT x",
    "conditions that meet": "LD a; OUT TR0; AND b; LD TR0; ANDNOT c; ORLD; OUT x",
    "a block that is missing": "LD a; ANDLD; OUT x", "AND of a branch": "LD a; OUT TR0; LD b; LD TR0; AND c; ANDLD; OUT x",
    "OR behind an output": "LD a; OUT x; LD b; ORLD; OUT y", "OR of nothing": "LD a; OUT TR0; LD TR0; ORLD; OUT x",
    "a block program": "LD a; BPRG 1; OUT x; BEND; LD b; OUT y",
    "an input that is missing": "LD a; LD b; LD c; CNT 1 #10; CNT 2 #10",
    "inputs that begin at two points": "LD a; OUT TR0; AND b; OUT TR1; AND c; LD TR0; AND d; LD TR1; AND e; SFT D0 D1",
    "an input beside the rail": "LD a; OUT TR0; OUT x; LD b; LD TR0; AND c; CNT 1 #10",
    "an output below a box of two inputs": "LD a; OUT TR0; AND b; LD TR0; AND c; CNT 5 #10; LD TR0; AND d; OUT x",
    "an interlock": "LD a; IL; LD b; OUT c; ILC",
    "seven in series": "LD a; AND b; AND c; AND d; AND e; AND f; AND g; OUT x; MOV #1 D0",
}  # fmt: skip
SEEN = {step: [step % 3 != 1, step % 2 == 0, step % 5 != 3] for step in range(40)}
"""States that contacts, outputs and blocks had."""
PLACES = Annotations(places=lambda symbol: f"W{len(symbol)}.0{len(symbol) % 8}" if symbol in "acegx" else "",
                     values=lambda step, operand: f"{step}7" if operand.startswith("D") else "",
                     others=lambda operand: "Level" if operand == "D0" else "")  # fmt: skip
WAYS = {"40": (40, Annotations()), "24": (24, Annotations()), "80 with power": (80, Annotations(SEEN)),
        "30 with power": (30, Annotations(SEEN)), "60 with places and values": (60, PLACES),
        "60 with all": (60, PLACES._replace(states=SEEN)), "0 with nothing executed": (0, Annotations({}))}  # fmt: skip


def check(name: str, lines: list[str]) -> None:
    path, text = TEXTS / name, "\n".join(lines) + "\n"
    if os.environ.get("FBVM_REWRITE"):
        path.write_text(text, encoding="utf-8")
    assert text == path.read_text(encoding="utf-8")


def steps(rung: str) -> list[tuple[str, str, tuple[str, ...]]]:
    """The instructions of a rung, which `;` parts here."""
    lines = rung.replace("; ", "\n") + "\n"
    return [(line.step.prefix, line.step.mnemonic, line.step.operands)
            for made in read_rungs(lines, 0, len(lines), lambda *message: None) for line in made.lines]  # fmt: skip


@pytest.mark.slow
@pytest.mark.parametrize("way", WAYS)
def test_drawings_of_a_width(way: str) -> None:
    width, annotations = WAYS[way]
    lines = [line for name, rung in RUNGS.items() for line in (f"=== {name}", *rung_text(steps(rung), width, annotations))]
    check(f"rungs {way}.txt", lines)


DRAWN = ("branch points", "a call", "boxes of two inputs")


@pytest.mark.slow
@pytest.mark.parametrize("sign", [" ", "│"])
def test_what_is_said_of_a_drawing_that_is_damaged(sign: str) -> None:
    """Each cell in its turn is another one; one line for cells of which the same is said."""
    lines: list[str] = []
    for name in DRAWN:
        drawing = rung_text(steps(RUNGS[name]), 40)
        lines += [f"=== {name}", *drawing]
        said, since = "", ""
        for y, line in enumerate(drawing):
            for x, character in enumerate(line):
                if character == sign or sign != " " and character == " " and (x + y) % 5:
                    continue
                damaged = [*drawing[:y], line[:x] + sign + line[x + 1 :], *drawing[y + 1 :]]
                now = read("\n".join(damaged) + "\n")
                if now != said:
                    lines += [f"{since}: {said}"] if since else []
                    said, since = now, f"{y + 1}:{x + 1}"
        lines.append(f"{since}: {said}")
    check(f"damaged {'space' if sign == ' ' else 'down'}.txt", lines)


def read(text: str) -> str:
    """What is wrong with a drawing, or the instructions that it says."""
    wrong: list[str] = []

    def report(code: str, start: int, end: int, message: str, hint: str) -> None:
        row = text.count("\n", 0, start)
        column = start - (text.rfind("\n", 0, start) + 1)
        wrong.append(f"{code} {row + 1}:{column + 1}+{end - start} {message}; {hint}")

    rungs = read_rungs(text, 0, len(text), report)
    found = [" ".join((line.step.prefix + line.step.mnemonic, *line.step.operands)) for rung in rungs for line in rung.lines]
    return " | ".join(wrong) or ", ".join(found)


@pytest.mark.slow
def test_how_far_from_its_contact_an_operand_may_stand() -> None:
    """Of one, of two words that belong to a comparison, and of one that stands in the row above that."""
    lines = []
    for text, contact in (("a", "┤ ├"), ("D0 #5", "┤=├"), ("n", "┤P├")):
        for shift in range(26 - len(text)):
            above = ("│" + " " * shift + text).ljust(31) + "b   │"
            rung = f"{above}\n├────────{contact}──────────────────( )──┤\n"
            lines.append(f"{shift} {text}: {read(rung)}")
    check("operands.txt", lines)


def nested(depth: int) -> list[tuple[str, str, tuple[str, ...]]]:
    return [("", "LD", ("a",)), *[("", how, ("b",)) for how in ("OR", "AND") * depth], ("", "OUT", ("c",))]


def outputs(count: int) -> list[tuple[str, str, tuple[str, ...]]]:
    return [("", "LD", ("a",)), *[("", how, ("b",)) for how in ("OUT", "AND") * count], ("", "OUT", ("c",))]


@pytest.mark.parametrize(("rung", "most"), [(nested, 24), (outputs, 199)])
def test_a_rung_that_is_nested_too_deep_for_a_drawing_is_shown_as_its_instructions(
        rung: Callable[[int], list[tuple[str, str, tuple[str, ...]]]], most: int) -> None:
    assert rung_text(rung(most))[1].startswith("├")
    for depth in (most + 1, 2_000):
        made = rung(depth)
        assert rung_text(made) == [f"    {mnemonic} {operand}" for _, mnemonic, (operand,) in made]


def test_the_comment_behind_a_long_line_is_found_in_time_that_grows_as_the_line() -> None:
    assert [remark_of(line) for line in ("│ a │  // why", "│ a │// why", "│ http://x │", "│ a │")] == ["// why", "// why", "", ""]
    assert_linear(lambda many: lambda: remark_of("│" + " " * 500 * many + "│"), 8)
