"""`fbvm diff`: symbols and rungs of two versions of a program, side by side."""

from __future__ import annotations

from pathlib import Path

import pytest
from click.testing import CliRunner
from cx_text import SAMPLE

from fbvm.base.diagnostics import Source
from fbvm.cli.main import main
from fbvm.interchange.contents import contents
from fbvm.interchange.cx.compression import compress
from fbvm.record.draw.difference import differences

OLD = """PROGRAM Main
VAR a AT 0.00 : BOOL; // start
b : BOOL; END_VAR
LADDER
RUNG 0 first
LD a
OUT b
RUNG 1
LD b
OUT 1.00
END_LADDER
END_PROGRAM
FUNCTION Twice : INT
VAR_INPUT x : INT; END_VAR
Twice := 2 * x;
END_FUNCTION
"""


def shown(old: str, new: str, width: int = 120) -> list[str]:
    found = differences(contents([Source("a.st", old)]), contents([Source("b.st", new)]), width)
    return [line for one in found for line in (f"{one.where}: {one.what}", *one.lines)]


def test_nothing_differs_between_a_text_and_its_copy_in_other_clothes() -> None:
    assert shown(OLD, OLD) == []
    assert shown(OLD, OLD.replace("LD a", "  LD     a").replace("\n", "\r\n")) == []


def test_a_changed_rung_is_drawn_beside_the_one_before() -> None:
    assert [line.rstrip() for line in shown(OLD, OLD.replace("LD b\n", "LD b\nANDNOT a\n"), 90)] == [
        "Main: 1 rung changed",
        "- RUNG 1                                      + RUNG 1",
        "- │   b            1.00  │                    + │   b      a         1.00  │",
        "- ├──┤ ├────────────( )──┤                    + ├──┤ ├────┤/├─────────( )──┤",
    ]


def test_a_function_of_text_is_removed_or_added() -> None:
    less = OLD[:OLD.index("FUNCTION")]
    lines = ["FUNCTION Twice : INT", "VAR_INPUT x : INT; END_VAR", "Twice := 2 * x;", "END_FUNCTION"]
    assert shown(OLD, less) == ["Twice: removed", "@@ -1,4 +0,0 @@", *(f"-{line}" for line in lines)]
    assert shown(less, OLD) == ["Twice: added", "@@ -0,0 +1,4 @@", *(f"+{line}" for line in lines)]


BRANCHES = "LD a\nOUT TR0\nAND b\nOUT 1.00\nLD TR0\nANDNOT b\nOUT 1.01\n"


@pytest.mark.parametrize(("old", "new", "same"), [
    (BRANCHES, BRANCHES.replace("TR0", "TR3"), True), (BRANCHES, BRANCHES.replace("LD TR0\nANDNOT", "LD TR0\nAND"), False),
    ("LD a\nLD b\nORLD\nOUT 1.00\n", "LD a\nOR b\nOUT 1.00\n", True),
    ("LD a\nOR b\nOUT 1.00\n", "LD b\nOR a\nOUT 1.00\n", False),
])  # fmt: skip
def test_rungs_that_are_drawn_alike_do_not_differ(old: str, new: str, same: bool) -> None:
    assert (shown(OLD.replace("LD b\nOUT 1.00\n", old), OLD.replace("LD b\nOUT 1.00\n", new)) == []) is same


@pytest.mark.slow
def test_added_and_removed_rungs_stand_on_their_side() -> None:
    more = OLD.replace("END_LADDER", "RUNG 2\nLD P_On\nOUT 1.01\nEND_LADDER")
    assert shown(OLD, more)[0] == "Main: 1 rung added"
    assert all(line.startswith("+") or not line[:40].strip() for line in shown(OLD, more)[1:])
    assert shown(more, OLD)[0] == "Main: 1 rung removed"
    assert all(line.startswith("-") for line in shown(more, OLD)[1:])


def test_narrow_terminals_have_one_below_the_other() -> None:
    lines = shown(OLD, OLD.replace("LD b\n", "LD b\nANDNOT a\n"), 60)
    assert [line[0] for line in lines[1:]] == ["-"] * 3 + ["+"] * 3


def test_symbols_are_added_and_removed() -> None:
    old, new = "VAR_GLOBAL a, b : INT; END_VAR", "VAR_GLOBAL b : INT; c AT D5 : WORD; END_VAR"
    assert shown(old, new) == ["global symbols: 1 symbol removed, 1 symbol added", "- a : INT", "+ c AT D5 : WORD"]
    assert shown("", old)[0] == "global symbols: 2 symbols added"


def test_symbols_comments_and_texts_differ_too() -> None:
    new = OLD.replace("// start", "// go").replace("2 * x", "3 * x")
    assert shown(OLD, new) == [
        "Main: 1 symbol changed", "- a AT 0.00 : BOOL  // start", "+ a AT 0.00 : BOOL  // go", "Twice: changed",
        "@@ -2,3 +2,3 @@", " VAR_INPUT x : INT; END_VAR", "-Twice := 2 * x;", "+Twice := 3 * x;", " END_FUNCTION"]  # fmt: skip


def test_pous_of_text_are_added_and_removed() -> None:
    rest, function = OLD[:OLD.index("FUNCTION")], OLD[OLD.index("FUNCTION"):].splitlines()
    assert shown(rest, OLD) == ["Twice: added", "@@ -0,0 +1,4 @@", *(f"+{line}" for line in function)]
    assert shown(OLD, rest) == ["Twice: removed", "@@ -1,4 +0,0 @@", *(f"-{line}" for line in function)]


@pytest.mark.slow
def test_projects_differ_by_their_status_and_quietly(tmp_path: Path) -> None:
    one, other = tmp_path / "a.cxp", tmp_path / "b.cxt"
    one.write_bytes(compress(SAMPLE.bytes()))
    other.write_bytes(SAMPLE.bytes())
    run = CliRunner().invoke
    assert (run(main, ["diff", str(one), str(other)]).exit_code, run(main, ["diff", str(one), str(other)]).output) == (0, "")
    other.write_bytes(SAMPLE.bytes().replace(b"OR Pump\n", b"OR Pump\nOR W0.00\n"))
    done = run(main, ["diff", str(one), str(other)])
    assert done.exit_code == 1
    assert "NewProgram1, section Pumping: 1 rung changed" in done.output
    colored = run(main, ["diff", str(one), str(other)], color=True).output
    assert [line for line in colored.splitlines() if "\x1b[1m" in line] == [
        "\x1b[1mNewProgram1, section Pumping: 1 rung changed\x1b[0m"]
    assert (
        run(main, ["diff", "-q", str(one), str(other)]).exit_code,
        run(main, ["diff", "-q", str(one), str(other)]).output,
    ) == (1, "")
    other.write_bytes(b"CXProgVer:=cut")
    assert run(main, ["diff", str(one), str(other)]).exit_code == 3
