"""Stepping in methods and properties: breakpoints of one instance, names of the object and of the call."""

from __future__ import annotations

import re

import pytest

from fbvm.code.compiler import compile_text
from fbvm.code.image import Image
from fbvm.machine.plc import Plc
from fbvm.step.commands import CommandError, Commands
from fbvm.step.session import Session
from fbvm.step.stop_report import StopReport

TEXT = """\
FUNCTION_BLOCK Motor
VAR_INPUT Limit : INT; END_VAR
VAR Speed : INT; END_VAR
METHOD Start : BOOL
VAR_INPUT Wanted : INT; END_VAR
VAR half : INT; END_VAR
half := Wanted / 2;
Speed := half + Wanted;
Start := Speed > Limit;
END_METHOD
PROPERTY Actual : INT
GET
Actual := Speed * 2;
END_GET
SET
Speed := Actual;
END_SET
END_PROPERTY
END_FUNCTION_BLOCK
FUNCTION_BLOCK Pump EXTENDS Motor
END_FUNCTION_BLOCK
PROGRAM Main
VAR slow : Motor; fast : Pump; ok : BOOL; x, n : INT; END_VAR
n := n + 1;
ok := slow.Start(Wanted := 2 * n);
ok := fast.Start(Wanted := 10 * n);
slow.Actual := 7;
x := fast.Actual;
END_PROGRAM
"""


@pytest.fixture(scope="module")
def image() -> Image:
    compilation = compile_text(TEXT)
    assert compilation.image is not None
    return compilation.image


@pytest.fixture
def commands(image: Image) -> Commands:
    session = Session.of(lambda: Plc(image))
    return Commands(session, StopReport(session, {"text.st": TEXT}))


def places(commands: Commands, where: str, count: int) -> list[str]:
    """Scan, line and place of so many stops at a breakpoint."""
    list(commands.run(f"break {where}"))
    found = []
    for _ in range(count):
        list(commands.run("run"))
        found.append(re.sub(r"scan (\d+), \w+: text.st:(\d+) in", r"\1 \2", commands.report.place()))
    return found


@pytest.mark.parametrize(("where", "stops"), [
    ("Main.slow.Start", ["0 7 Main.slow.Start", "1 7 Main.slow.Start"]),
    ("Main.fast.start", ["0 7 Main.fast.Start", "1 7 Main.fast.Start"]),
    ("Motor.Start", ["0 7 Main.slow.Start", "0 7 Main.fast.Start"]),
    ("Main.slow.Actual", ["0 16 Main.slow.Actual.Set", "1 16 Main.slow.Actual.Set"]),
    ("Main.fast.Actual.Get", ["0 13 Main.fast.Actual.Get", "1 13 Main.fast.Actual.Get"]),
    ("Motor.Actual", ["0 16 Main.slow.Actual.Set", "0 13 Main.fast.Actual.Get"]),
    ("Motor.Start IF Speed > 3", ["1 7 Main.slow.Start", "1 7 Main.fast.Start"]),
    ("Motor.Start IF Wanted > 9", ["0 7 Main.fast.Start", "1 7 Main.fast.Start"]),
])  # fmt: skip
def test_a_breakpoint_at_a_method_or_property(commands: Commands, where: str, stops: list[str]) -> None:
    assert places(commands, where, 2) == stops


def test_run_goes_to_a_method_of_one_instance(commands: Commands) -> None:
    list(commands.run("run Main.fast.Start"))
    assert commands.report.place() == "scan 0, 0s: text.st:7 in Main.fast.Start"


def test_names_in_a_method_are_those_of_the_call_and_of_the_object(commands: Commands) -> None:
    places(commands, "Main.fast.Start", 2)
    list(commands.run("step"))
    said = list(commands.run("print Wanted half Speed Main.n"))
    assert said == ["Wanted = 20", "half = 10", "Main.fast.Speed = 15", "Main.n = 2"]
    list(commands.run("write Speed = 4"))
    assert list(commands.run("print THIS.Speed")) == ["Main.fast.Speed = 4"]


@pytest.mark.parametrize("where", ["Main.slow.n", "Main.slow.Nothing.Get", "Main.n.Start"])
def test_what_is_no_method_is_refused(commands: Commands, where: str) -> None:
    with pytest.raises(CommandError, match="has no"):
        list(commands.run(f"break {where}"))


def test_a_property_is_read_through_its_accessor_without_a_trace(commands: Commands) -> None:
    list(commands.run("scan"))
    before = bytes(commands.session.memory.snapshot())
    assert list(commands.run("print Main.slow.Actual")) == ["Main.slow.Actual = 14"]
    assert list(commands.run("print main.fast.actual")) == ["Main.fast.Actual = 30"]  # inherited
    assert bytes(commands.session.memory.snapshot()) == before
    list(commands.run("break Motor.Start"))
    list(commands.run("run"))
    assert list(commands.run("print Actual")) == ["Main.slow.Actual = 14"]
    with pytest.raises(CommandError, match="is a property, which is computed when it is read"):
        list(commands.run("why Main.slow.Actual"))


@pytest.mark.parametrize("name", ["Main.n.Actual", "Main.nobody.Actual", "nobody.Actual", "Actual", "Main.Actual"])
def test_what_has_no_property_is_not_there(commands: Commands, name: str) -> None:
    list(commands.run("scan"))
    with pytest.raises(CommandError, match=r"there is no|has no"):
        list(commands.run(f"print {name}"))


def test_a_property_whose_accessor_ends_with_a_trap_says_so_and_leaves_the_memory() -> None:
    compilation = compile_text(TEXT.replace("Actual := Speed * 2;", "Speed := Speed + 1; Actual := 8 / (Speed - 1);"))
    image = compilation.image
    assert image is not None
    commands = Commands(session := Session.of(lambda: Plc(image)), StopReport(session, {}))
    with pytest.raises(CommandError, match=r"Main.slow.Actual cannot be computed: R0101 text.st:13"):
        list(commands.run("print Main.slow.Actual"))
    assert session.read(session.find("Main.slow.Speed")) == 0


def test_a_method_of_a_namespace_is_shown_without_its_namespace() -> None:
    text = f"NAMESPACE Plant.Drives\n{TEXT.partition('PROGRAM')[0]}END_NAMESPACE\n" \
        "PROGRAM Main\nVAR slow : Plant.Drives.Motor; ok : BOOL; END_VAR\nok := slow.Start(Wanted := 2);\nEND_PROGRAM\n"
    made = compile_text(text).image
    assert made is not None
    session = Session.of(lambda: Plc(made))
    commands = Commands(session, StopReport(session, {"text.st": text}))
    list(commands.run("break Plant.Drives.Motor.Start"))
    assert any("in Main.slow.Start" in line for line in commands.run("run"))
