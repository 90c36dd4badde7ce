"""What `fbvm demo` prints: its steps, the words beside the registers, and why a program did not get through."""

from __future__ import annotations

import io
from types import SimpleNamespace
from typing import Any, cast

from rich.console import Console
from rows import each_of

from fbvm.cli.running.demo import Comparison, StepDisplay, _failure, _table, compare
from fbvm.code.compiler import compile_text
from fbvm.machine.plc import Plc


class Program:
    """A program that is at some step at some time."""

    def __init__(self) -> None:
        self.step, self.now_ns, self.trap = 0, 0, None

    def read(self, name: str) -> int:
        assert name == "Main.Step"
        return self.step


def shown(is_terminal: bool, *moments: tuple[int, float]) -> list[str]:
    """The lines of the last view, when the program was at these steps at these times in ms."""
    file = io.StringIO()
    program = Program()
    plc = cast(Plc, program)
    with StepDisplay(Console(file=file, force_terminal=is_terminal, width=90), plc) as steps:
        for program.step, now_ms in moments:
            program.now_ns = int(now_ms * 1e6)
            steps.watch(plc)
    return [line.rstrip() for line in file.getvalue().splitlines()][-5:] if not is_terminal else file.getvalue().splitlines()


def test_steps_are_shown_with_how_long_each_took() -> None:
    assert shown(False, (0, 0), (0, 10), (1, 30.5), (2, 40), (2, 50)) == [
        "  + connect to the server                       30.5 ms",
        "  + read holding registers (function 03)         9.5 ms",
        "  > compute", "    write registers (function 10)", "    write one register (function 06)"]


def test_before_the_first_scan_no_step_has_begun() -> None:
    assert [line[:4].strip() for line in shown(False)] == [""] * 5


def test_a_terminal_shows_each_step_as_it_happens() -> None:
    def views(*moments: tuple[int, float]) -> int:
        return sum("connect to the server" in line for line in shown(True, *moments))

    assert views((0, 0), (1, 10), (2, 20)) - views((0, 0)) == 2
    assert views((0, 0), (0, 10), (0, 20)) == views((0, 0))


def printed(comparisons: list[Comparison]) -> list[str]:
    console = Console(file=io.StringIO(), width=100)
    console.print(_table(comparisons))
    return [" ".join(line.split()) for line in cast(io.StringIO, console.file).getvalue().splitlines()]


def test_words_stand_beside_the_registers_of_the_server() -> None:
    assert printed([Comparison("read", ["D200", "D201"], [7, 8], 40, [7, 9]), Comparison("written", ["D400"], [5], 90, [5])]) == [
        "PLC holds server register", "D200 7 = 7 40 read", "D201 8 differs from 9 41", "D400 5 = 5 90 written"]


@each_of("words, registers, expected", [([1, 2], [1, 2], True), ([1, 2], [1, 3], False), ([1], [1, 2], False), ([], [], False)])
def test_what_is_equal(words: list[int], registers: list[int], expected: bool) -> None:
    assert Comparison("", [""] * len(words), words, 0, registers).equal is expected


def test_which_words_belong_to_which_registers() -> None:
    image = compile_text("PROGRAM Main VAR Quantity, Source, Target, Signature : INT := 3; Written : INT := 2; END_VAR "
                         "Source := 10; Target := 20; Signature := 30; END_PROGRAM").image
    assert image is not None
    plc = Plc(image)
    plc.run(scans=1)
    plc.write("D200..D202", [10, 11, 12])
    plc.write("D400..D401", [20, 21])
    server = SimpleNamespace(registers=lambda first, count: list(range(first, first + count)))
    assert [(each.places, each.words, each.first_register, each.registers) for each in compare(plc, cast(Any, server))] == [
        (["D200", "D201", "D202"], [10, 11, 12], 10, [10, 11, 12]), (["D400", "D401"], [20, 21], 20, [20, 21]),
        (["Main.Written"], [2], 30, [30])]


@each_of("own, connection, said", [
    (0x1234, 0x5678, "The program did not get through (max); error code 1234"),
    (0, 0x5678, "The program did not get through (max); error code 5678"),
])
def test_why_it_did_not_get_through(own: int, connection: int, said: str) -> None:
    codes = {"Main.Error_Code": own, "Main.Connection.Error_Code": connection}
    plc = SimpleNamespace(trap=None, read=codes.__getitem__)
    assert _failure(cast(Plc, plc), "max") == said
    assert _failure(cast(Plc, SimpleNamespace(trap="R0101 here")), "trap") == "R0101 here"
