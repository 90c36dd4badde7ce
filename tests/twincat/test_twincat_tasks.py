"""The text that says when the programs of a project run, and files as Windows finds them."""

from __future__ import annotations

import os
from pathlib import Path

import pytest
from rows import each_of

from fbvm.base.diagnostics import Diagnostic
from fbvm.interchange.markup import Element, parse_markup
from fbvm.interchange.twincat.project import TASKS, TaskSettings, _file, _other_settings, configuration, task_source


def tasks(*written: str) -> list[Element]:
    made = parse_markup(f"<Tasks>{''.join(written)}</Tasks>".encode(), "x.TcTTO")
    assert not isinstance(made, Diagnostic)
    return list(made[1].all("Task"))


def task(name: str, cycle: str = "1000", priority: str = "3", *calls: str) -> str:
    said = "".join(f"<PouCall><Name> {call} </Name></PouCall>" for call in calls)
    return f'<Task Name="{name}"><CycleTime>{cycle}</CycleTime><Priority>{priority}</Priority>{said}</Task>'


HEAD, END = ["RESOURCE PLC ON fbvm"], ["END_RESOURCE", "END_CONFIGURATION"]


@each_of(("given", "application", "lines"), (
    ([task("Fast", "1000", "3", "MAIN", "Second")], "Line",
     ["CONFIGURATION Line", *HEAD, "    TASK Fast(INTERVAL := T#1000us, PRIORITY := 3);", "    PROGRAM MAIN WITH Fast : MAIN;",
      "    PROGRAM Second WITH Fast : Second;"]),
    ([task("Fast", "1000", "3", "MAIN"), task("2 slow", "x", "-1", "Other", "not a name"), task("Third")], "",
     ["CONFIGURATION TwinCAT", *HEAD, "    TASK Fast(INTERVAL := T#1000us, PRIORITY := 3);",
      "    TASK Task_2(INTERVAL := T#10000us, PRIORITY := 20);", "    TASK Third(INTERVAL := T#1000us, PRIORITY := 3);",
      "    PROGRAM MAIN WITH Fast : MAIN;", "    PROGRAM Other WITH Task_2 : Other;"]),
    ([task("T", "9" * 15)], "a.b", ["CONFIGURATION TwinCAT", *HEAD, f"    TASK T(INTERVAL := T#{'9' * 15}us, PRIORITY := 3);"]),
    ([task("T", "9" * 16)], "my line", ["CONFIGURATION TwinCAT", *HEAD, "    TASK T(INTERVAL := T#10000us, PRIORITY := 3);"]),
    ([task("T", "5", "", "Lib.MAIN")], "x",  # a library's, which is left out
     ["CONFIGURATION x", *HEAD, "    TASK T(INTERVAL := T#5us, PRIORITY := 20);"]),
    (['<Task Name="T"/>'], "x", ["CONFIGURATION x", *HEAD, "    TASK T(INTERVAL := T#10000us, PRIORITY := 20);"])))  # fmt: skip
def test_tasks_are_a_configuration(given: list[str], application: str, lines: list[str]) -> None:
    assert configuration(tasks(*given), application) == "\n".join([*lines, *END, ""])
    source = task_source("a/b.tsproj", tasks(*given), application)
    assert (source.name, source.text) == (f"a/b.tsproj/{TASKS}", "\n".join([*lines, *END, ""]))


def test_what_the_system_says_of_a_task_holds_and_a_difference_is_told() -> None:
    given = tasks(task("Fast", "1000", "3"), task("Slow", "9000", "4"), task("Same", "5", "5"))
    settings = {"Fast": TaskSettings(2000, 3), "Slow": TaskSettings(9000, 1), "Same": TaskSettings(5, 5)}
    assert [line.strip() for line in configuration(given, "", settings).splitlines() if "TASK" in line] == [
        "TASK Fast(INTERVAL := T#2000us, PRIORITY := 3);", "TASK Slow(INTERVAL := T#9000us, PRIORITY := 1);",
        "TASK Same(INTERVAL := T#5us, PRIORITY := 5);"]  # fmt: skip
    made = parse_markup(b"\n<Project/>", "x.plcproj")
    assert not isinstance(made, Diagnostic)
    said = list(_other_settings(*made, given, settings))
    assert [(each.code, each.start, each.end, each.message, each.hint) for each in said] == [
        ("X0292", made[1].at, made[1].at + 1, text, "the system's hold") for text in (
            "the system gives the task Fast 2000 us and priority 3, its own file 1000 us and 3",
            "the system gives the task Slow 9000 us and priority 1, its own file 9000 us and 4")]  # fmt: skip


@pytest.mark.skipif(os.name == "nt" or os.uname().sysname == "Darwin", reason="small letters are large ones there")
def test_a_file_is_found_as_windows_finds_it(tmp_path: Path) -> None:
    for name in ("POUs/Main.TcPOU", "pous/main.TcPOU", "DUTs/One.TcDUT"):
        (tmp_path / name).parent.mkdir(exist_ok=True)
        (tmp_path / name).write_text("")
    found = {parts: _file(tmp_path, tuple(parts.split("/"))).relative_to(tmp_path).as_posix() for parts in (
        "POUs/Main.TcPOU", "pous/main.TcPOU", "POUS/MAIN.TCPOU", "duts/ONE.tcdut", "pous/MAIN.TcPOU", "duts/two.TcDUT",
        "DUTs/One.TcDUT/inside", "none/One.TcDUT")}  # fmt: skip
    assert found == {
        "POUs/Main.TcPOU": "POUs/Main.TcPOU", "pous/main.TcPOU": "pous/main.TcPOU", "POUS/MAIN.TCPOU": "POUs/Main.TcPOU",
        "duts/ONE.tcdut": "DUTs/One.TcDUT", "pous/MAIN.TcPOU": "pous/main.TcPOU", "duts/two.TcDUT": "duts/two.TcDUT",
        "DUTs/One.TcDUT/inside": "DUTs/One.TcDUT/inside", "none/One.TcDUT": "none/One.TcDUT"}  # fmt: skip
