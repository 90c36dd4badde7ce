"""The programs that `fbvm serve` serves: the shipped one with its settings, one's own, one of OpenPLC; their memory in a file."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import click
import pytest
from rows import each_of

from fbvm.cli.running import serve
from fbvm.cli.shared.files import OutputError
from fbvm.code.compiler import compile_text
from fbvm.machine.plc import Plc
from fbvm.units.openplc.unit import OpenPlc

PROGRAM = "PROGRAM {} VAR n : INT; END_VAR n := n + 1; END_PROGRAM\n"
SOCKETS = "PROGRAM Main VAR s : {}; END_VAR s(); END_PROGRAM\n"


def own(tmp_path: Path, text: str, *options: str, allowed: set[str] = frozenset()) -> tuple[Plc, OpenPlc | None]:  # type: ignore[assignment]
    """What the verb makes of a program with these options."""
    file = tmp_path / "own.st"
    file.write_text(text, encoding="utf-8")
    with serve.command.make_context("serve", [str(file), *options]) as context:
        settings: Any = {name: context.params[name] for name in serve.OWN_SETTINGS}
        return serve._own((file,), context.params["program"], (), allowed, settings)


@each_of("options, allowed, runtime", [
    ([], [], None), (["--dialect", "matiec"], [], {}), (["--dialect", "strucpp"], [], {}), (["--read-only"], ["read_only"], None),
    (["--dialect", "matiec", "--sockets", "3"], [], {"clients": 3}),
    (["--dialect", "matiec", "--read-only"], [], {"read_only": True}),
    (["--dialect", "matiec", "--read-only", "--sockets", "2"], [], {"clients": 2, "read_only": True}),
])
def test_a_program_of_openplc_is_served_by_its_runtime_and_others_by_themselves(
        options: list[str], allowed: list[str], runtime: dict[str, Any] | None, tmp_path: Path) -> None:
    plc, unit = own(tmp_path, PROGRAM.format("Main"), *options, allowed=set(allowed))
    assert plc.cycle_ns == 10_000_000 and plc.read("Main.n") == 0
    assert (unit is None) == (runtime is None)
    usual = {"address": "192.168.250.25", "port": 502, "clients": 8, "read_only": False}
    assert unit is None or unit.configuration == usual | (runtime or {})


@each_of("options, allowed, said", [
    (["--sockets", "3"], [], "--sockets"), (["--sockets", "1"], [], "--sockets"), (["--read-only"], [], "--read-only"),
    (["--idle", "5s", "--fn0f"], [], "--fn0f, --idle"), (["--full-dm", "--read-only"], ["read_only"], "--full-dm"),
    (["--dialect", "matiec", "--fn0f", "--sockets", "3"], [], "--fn0f"), (["--dialect", "matiec", "--idle", "1s"], [], "--idle"),
])
def test_options_of_the_shipped_program_are_none_of_ones_own(options: list[str], allowed: list[str], said: str,
                                                             tmp_path: Path) -> None:  # fmt: skip
    with pytest.raises(click.UsageError) as error:
        own(tmp_path, PROGRAM.format("Main"), *options, allowed=set(allowed))
    assert error.value.message == f"{said}: said to the shipped server program; your own sets what it wants itself"


def test_one_of_several_programs_has_to_be_named(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    text = PROGRAM.format("One") + PROGRAM.format("Two")
    with pytest.raises(SystemExit) as ended:
        own(tmp_path, text)
    assert ended.value.code == 3 and "error S0209: there are several programs" in capsys.readouterr().err
    assert own(tmp_path, text, "--program", "Two")[0].find("Two.n")


@pytest.mark.slow
def test_the_shipped_program_has_the_settings_that_are_given() -> None:
    plc = serve._shipped({"sockets": 3, "read_only": True, "fn0f": True, "full_dm": False, "idle_ns": 7_000_000_000})
    assert [plc.read(f"Main.Server.{name}") for name in ("Sockets", "Read_Only", "Fn0F", "Full_DM", "Idle_Time")] == [
        3, True, True, False, 7_000_000_000]
    assert plc.cycle_ns == 10_000_000
    usual = serve._shipped({"sockets": 1, "read_only": False, "fn0f": False, "full_dm": True, "idle_ns": None})
    assert [usual.read(f"Main.Server.{name}") for name in ("Sockets", "Full_DM", "Idle_Time")] == [1, True, 60_000_000_000]


LAST = {"%QX1023.7": "BOOL", "%IX1023.7": "BOOL", "%QW1023": "INT", "%IW1023": "INT", "%MW1023": "INT", "%MD1023": "DINT",
        "%ML1023": "LINT"}
"""The last places of each table of OpenPLC's server."""


@pytest.mark.slow
def test_the_memory_that_clients_of_openplc_reach_is_saved_to_its_last_word(tmp_path: Path) -> None:
    declared = " ".join(f"v{number} AT {place} : {kind};" for number, (place, kind) in enumerate(LAST.items()))
    image = compile_text(f"PROGRAM Main VAR {declared} END_VAR v2 := v3; END_PROGRAM", dialect="matiec").image
    assert image is not None
    plc, again, file = Plc(image), Plc(image), tmp_path / "memory.json"
    values = [True, True, *(-5 - number for number in range(2, len(LAST)))]
    for number, value in enumerate(values):
        plc.write(f"Main.v{number}", value)
    assert serve._save(plc, file)
    serve._load(again, file)
    assert [again.read(f"Main.v{number}") for number in range(len(LAST))] == values


@pytest.mark.slow
def test_words_of_units_in_a_file_are_told_and_not_set(tmp_path: Path, monkeypatch: pytest.MonkeyPatch,
                                                       capsys: pytest.CaptureFixture[str]) -> None:
    image = compile_text("PROGRAM Main VAR n : INT; END_VAR n := n; END_PROGRAM", lint=False).image
    assert image is not None
    file = tmp_path / "memory.json"
    file.touch()
    monkeypatch.setattr(serve.memory_images, "load", lambda memory, path: {
        "CIO": range(1500, 1525), "W": range(7, 9), "D": range(30000, 30001)})
    serve._load(Plc(image), file)
    assert capsys.readouterr().err == (
        f"{file}: CIO 1500 to 1524: not set, since these words belong to units\n"
        f"{file}: W 7 to 8: not set, since these words belong to units\n"
        f"{file}: D 30000: not set, since these words belong to units\n")
    for error, said in ((OSError(13, "Permission denied"), f"{file} cannot be read: permission denied"),
                        (serve.memory_images.ImageError("no image"), "no image")):
        def load(memory: Any, path: Path, error: Exception = error) -> Any:
            raise error

        monkeypatch.setattr(serve.memory_images, "load", load)
        with pytest.raises(click.UsageError) as refused:
            serve._load(Plc(image), file)
        assert refused.value.message == said


def test_a_file_that_could_not_be_written_at_the_end_is_refused_in_the_beginning(tmp_path: Path) -> None:
    image = compile_text("PROGRAM Main VAR n : INT; END_VAR n := n; END_PROGRAM", lint=False).image
    assert image is not None
    with pytest.raises((click.UsageError, OutputError), match="no"):
        serve._load(Plc(image), tmp_path / "no" / "memory.json")
