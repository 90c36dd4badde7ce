"""The scripts of tests/bench still find what they measure: each does a little of its work."""

from __future__ import annotations

import importlib.util
import io
import json
import os
import re
import shutil
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Callable
from contextlib import ExitStack, redirect_stdout
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest
from click.testing import CliRunner

from fbvm.base.data import cache_folder
from fbvm.cli.main import main
from fbvm.cli.running.demo import modbus_server
from fbvm.code.compiler import compile_text
from fbvm.engine.native.engine import available
from fbvm.machine.plc import Plc

HOUSE = Path(__file__).resolve().parent.parent
BENCH = HOUSE / "tests" / "bench"
SCRIPTS = sorted(path.stem for path in BENCH.glob("*.py"))
SMALL = "PROGRAM Main\nVAR n : INT; t : TON; END_VAR\n    n := n + 1;\n    t(IN := n > 3, PT := T#1s);\nEND_PROGRAM\n"
"""What is measured in place of 5,000 lines."""
pytestmark = pytest.mark.slow
needs_machine_code = pytest.mark.skipif(not available(), reason="llvmlite is not installed")
needs_c = pytest.mark.skipif(shutil.which("cc") is None, reason="no compiler of C is there")

Load = Callable[[str], Any]


@pytest.fixture
def load(monkeypatch: pytest.MonkeyPatch) -> Load:
    """Imports a script by its name; the search path is as before at the end."""

    def loaded(name: str) -> Any:
        monkeypatch.setattr(sys, "path", list(sys.path))
        described = importlib.util.spec_from_file_location(f"bench_{name}", BENCH / f"{name}.py")
        assert described is not None and described.loader is not None
        module = importlib.util.module_from_spec(described)
        described.loader.exec_module(module)
        return module

    return loaded


@pytest.fixture
def small(tmp_path: Path) -> Path:
    """The folder of the scripts with a small program in place of the large one."""
    folder = tmp_path / "bench"
    shutil.copytree(BENCH, folder, ignore=shutil.ignore_patterns("__pycache__"))
    (folder / "lines5000.st").write_text(SMALL, encoding="utf-8")
    return folder


def in_process(command: list[str], **options: Any) -> str:
    """What `python -c TEXT ...` or `python -m fbvm ...` prints."""
    if command[1:3] == ["-m", "fbvm"]:
        result = CliRunner().invoke(main, command[3:], catch_exceptions=False)
        assert result.exit_code == 0, result.output
        return str(result.output)
    before, output = (sys.argv, list(sys.path)), io.StringIO()
    try:
        sys.argv = ["-c", *command[3:]]
        with redirect_stdout(output):
            exec(compile(command[2], "<-c>", "exec"), {"__name__": "__main__"})
    finally:
        sys.argv, sys.path[:] = before
    return output.getvalue()


PROCESSES = SimpleNamespace(
    run=lambda command, **options: SimpleNamespace(stdout=in_process(command), returncode=0), check_output=in_process)


def test_every_script_is_tried() -> None:
    tried = {name.removeprefix("test_the_script_") for name in globals() if name.startswith("test_the_script_")}
    elsewhere = {"mutants", "reached", "forked", "loaded", "large_text"}  # in test_mutants.py; a text for other scripts
    assert tried | elsewhere == set(SCRIPTS)


DISTURBED = """
import gc, os, time

def objects():
    return len(gc.get_objects())

def handles():
    return len(os.listdir("/proc/self/fd"))

def test_disturbed():
    ends_s, seen, before = time.monotonic() + 300, set(), (objects(), handles())
    while len(seen) < 3:
        used_s, now_s = time.thread_time(), time.monotonic()
        assert now_s < ends_s, seen
        time.sleep(0.001)
        seen |= {"objects"} if objects() > before[0] + 1000 else set()
        seen |= {"handles"} if handles() > before[1] else set()
        seen |= {"stops"} if time.monotonic() - now_s > 0.05 + time.thread_time() - used_s else set()
"""


@pytest.mark.skipif(not Path("/proc/self/fd").exists(), reason="handles are counted in /proc")
def test_the_script_disturbed(tmp_path: Path) -> None:
    (tmp_path / "test_made.py").write_text(DISTURBED, encoding="utf-8")
    environment = {**os.environ, "PYTHONPATH": str(HOUSE / "tests" / "bench")}
    done = subprocess.run([sys.executable, "-m", "pytest", "-q", "-p", "disturbed", "-n", "1", "test_made.py"],
                          cwd=tmp_path, env=environment, check=False, capture_output=True, text=True)  # fmt: skip
    assert done.returncode == 0, done.stdout


def test_the_script_latencies(load: Load) -> None:
    script = load("latencies")
    rows = [*script.editor(300, 300, 1), *script.debugger(20)]
    assert len(rows) == 7 and all(taken > 0 for _, taken, _ in rows)


def test_the_script_checking(load: Load) -> None:
    assert set(load("checking").measured(100)) == {"lines", "parse", "compile", "check", "mib"}


def test_the_script_editing(load: Load, capsys: pytest.CaptureFixture[str]) -> None:
    load("editing").report(600, places=2, keys=22)
    said = capsys.readouterr().out
    assert "(24 checked one POU alone)" in said
    assert "memory:" in said


@needs_machine_code
def test_the_script_exchanges(load: Load, monkeypatch: pytest.MonkeyPatch) -> None:
    script = load("exchanges")
    monkeypatch.setattr(script, "ROUNDS", 1)
    monkeypatch.setattr(script, "ROUND_MS", 30)
    with ExitStack() as stack:
        port = stack.enter_context(script.modbus_server())
        clients = {script.PLAIN: script.pymodbus(stack, port), "pyModbusTCP": script.pymodbus_tcp(stack, port)}
        for engine in ("native", "python"):
            clients[engine] = script.Blocks(stack, script.poll(), port, engine, "event", 10)
        script.compare(clients)
        assert clients["native"].done and clients["python"].done


@needs_machine_code
def test_the_script_servers(load: Load, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    """Each server is measured in all of its parts."""
    script = load("servers")
    monkeypatch.setattr(signal, "signal", lambda *_: None)

    def some_scans(plc: Plc, **_: Any) -> None:
        network = plc.units[0].network
        for _number in range(20):
            plc.scan(time.monotonic_ns())
            network.wait(0.0)
        network.close()

    monkeypatch.setattr(script, "run", some_scans)
    for name in script.PROGRAMS:
        with monkeypatch.context() as patch:
            patch.setattr(script.native_scans, "_functions", script.native_scans._functions)
            script.serve(name, True)
        port, used = capsys.readouterr().out.splitlines()
        assert int(port) > 0
        told = json.loads(used)
        assert told["scans"] == 20
        assert all(told[part] > 0 for part in (*script.PARTS, "all")), (name, told)


@needs_machine_code
def test_the_script_many(load: Load, monkeypatch: pytest.MonkeyPatch) -> None:
    script = load("many")
    monkeypatch.setattr(script, "RUN_MS", 20)
    for name, pace in (("timer", "cyclic"), ("logic", "event")):
        script.measure(name, 2, pace, 10)


@needs_machine_code
def test_only_what_is_measured_writes_into_a_new_cache(load: Load, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    script = load("native")
    monkeypatch.setenv("FBVM_CACHE", str(tmp_path / "before"))
    plc = Plc(compile_text(SMALL).image, engine="native")  # fast code of it is compiled in the background
    plc.scan()
    with script.new_cache() as folder:
        assert cache_folder() == folder and not list(folder.iterdir())
        assert plc.engine.optimised
        assert script.COMPILER not in {thread.name for thread in threading.enumerate()}
    assert cache_folder() == tmp_path / "before" and not folder.exists()


@needs_machine_code
@needs_c
def test_the_script_native(load: Load, small: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    script = load("native")
    monkeypatch.setattr(script, "shortest_ns", lambda work, rounds=0: [work(2), 1.0][1])
    monkeypatch.setattr(script, "PROGRAMS", {"crc": 1_000_000})
    monkeypatch.setattr(script, "BENCH", small)
    monkeypatch.setenv("FBVM_CACHE", str(small / "cache"))
    script.programs()
    script.large_program()
    script.calls()
    script.many()
    monkeypatch.setattr(script, "STARTS", 1)
    monkeypatch.setattr(script, "subprocess", PROCESSES)
    monkeypatch.setattr("fbvm.code.compiler.passes.parse", sys.modules["fbvm.code.compiler.passes"].parse)
    script.start()


@needs_machine_code
@needs_c
def test_the_script_limits(load: Load, small: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    script = load("limits")
    monkeypatch.setattr(script, "BENCH", small)
    monkeypatch.setattr(script.native, "shortest_ns", lambda work, rounds=0: [work(2), 1.0][1])
    monkeypatch.setattr(script.native, "PROGRAMS", {"crc": 1_000_000})
    monkeypatch.setattr(script.run, "work_ms", lambda folder, *words: 1.0)
    monkeypatch.setattr(script.run, "STARTS", 1)
    many = "logic   cyclic 10,000 345 48.9 10.3 100,005 1.0 0.2 0.4 0"

    def check_output(words: list[str], **options: Any) -> str:
        if words[-1] == script.IN_ONE_PROCESS:
            return json.dumps(script.in_one_process())
        return many if "cyclic" in words else "700"

    monkeypatch.setattr(script, "PROCESSES", 2)
    monkeypatch.setattr(script, "subprocess", SimpleNamespace(run=script.subprocess.run, check_output=check_output))
    monkeypatch.setattr(sys, "argv", ["limits.py", "starting", "compiling", "many", "programs"])
    script.main()
    said = capsys.readouterr().out
    assert "10,000 PLCs at 100 ms, logic: of a core, missed, each" in said and "10.3 %, 0, 48.9 KiB   <= 25 %, 0, 50 KiB" in said
    assert "crc: machine code, times C by hand, 2 processes" in said and "1.00 (1.00 to 1.00)   <= 1.4" in said
    assert "from start to first native scan" in said and "crc: python engine, times C by hand" in said


def test_the_script_debugger(load: Load, capsys: pytest.CaptureFixture[str]) -> None:
    script = load("debugger")
    script.LINES = 3
    script.main(60)
    assert "one step back in the last scan" in capsys.readouterr().out


def test_the_script_recorder(load: Load, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    script = load("recorder")
    for name, scans in (("NATIVE_SCANS", 20), ("PYTHON_SCANS", 5), ("OBSERVED_SCANS", 2), ("TIMES", 1), ("LEAST_SCANS", 10),
                        ("WARM", 2)):  # fmt: skip
        monkeypatch.setattr(script, name, scans)
    monkeypatch.setattr(script, "optimised", lambda plc: None)  # beside other tests that build takes a minute or two
    monkeypatch.setattr(script.shutil, "which", lambda name: None)
    monkeypatch.setattr(sys, "argv", ["recorder.py", "20"])
    script.main()
    said = capsys.readouterr().out
    assert re.search(r"events a scan; listener / python +2302; ", said)
    assert "scans of which it has each statement                              0 to 19" in said


def test_the_script_recorded_day(load: Load, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    monkeypatch.setattr(sys, "argv", ["recorded_day.py", "0.001"])
    load("recorded_day").main()
    assert "360 scans, plain" in capsys.readouterr().out


def test_the_script_pages(load: Load, capsys: pytest.CaptureFixture[str]) -> None:
    assert "200 scans" in load("pages").made(200)
    assert "a page of 200 scans of 6 variables" in capsys.readouterr().out


def test_the_script_live(load: Load) -> None:
    slices, scans = load("live").measured(2, 3, True)
    assert len(slices) >= 6 and len(scans) == 30 and min(slices) > 0


def test_the_script_run(load: Load, small: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    script = load("run")
    monkeypatch.setattr(script, "SCANS", 200)
    monkeypatch.setattr(script, "BENCH", small)
    monkeypatch.setattr(script, "subprocess", PROCESSES)
    monkeypatch.setattr(script, "best_s", lambda work, times=1: [work(), 1.0][1])
    script.compiling()
    script.scanning()
    script.starting()
    started: list[list[str]] = []
    monkeypatch.setattr(script, "subprocess", SimpleNamespace(run=lambda words, **options: started.append(words[1:])))
    script.loading()
    assert started[-1] == ["-m", "pytest", "-q", "-p", "no:cacheprovider", "-p", "fbvm.testing.plugin"]
    assert "what the plugin adds" in capsys.readouterr().out


def test_the_script_soak(load: Load, monkeypatch: pytest.MonkeyPatch) -> None:
    script = load("soak")
    monkeypatch.setattr(script, "PARTS", 1)
    monkeypatch.setattr(script, "MEMORY_S", 2)
    monkeypatch.setattr(script, "SOCKETS_S", 1)
    script.memory()
    script.sockets()


def test_the_script_reconnecting_clients(load: Load, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    script = load("reconnecting_clients")
    monkeypatch.setattr(script, "QUIET_S", 0)
    monkeypatch.setattr(script, "RIGHT", script.RIGHT[:-2] + (2000).to_bytes(2, "big"))
    monkeypatch.setattr(sys, "stdin", SimpleNamespace(readline=lambda: time.sleep(0.5)))
    with modbus_server() as port:
        script.main(port, 1)
    counts = json.loads(capsys.readouterr().out)
    assert (counts["served at once"], counts.get("wrong", 0)) == (8, 0)
    assert counts["right"] > 8


def test_the_script_bare_loop(load: Load, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    script, turns = load("bare_loop"), iter([0] * 5 + [1])
    monkeypatch.setattr(script, "select", SimpleNamespace(select=lambda *_: (next(turns) and [sys.stdin], [], [])))
    script.main(1 << 60)
    assert json.loads(capsys.readouterr().out) == {"periods": 1, "missed": 0}


@needs_machine_code
def test_the_script_objects(load: Load, capsys: pytest.CaptureFixture[str]) -> None:
    script = load("objects")
    assert list(script.CALLED) == ["function", "method", "pointer", "interface"]
    assert all(script.nanoseconds(call, 200) > 0 for call in script.CALLED.values())
    assert len(script.in_cpp(200)) in (0, 2)


def test_the_script_campaigns(load: Load, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    script = load("campaigns")
    monkeypatch.setattr(script, "find_spec", lambda name: None)  # a cluster takes seconds to begin, and has a test of its own
    monkeypatch.setattr(sys, "argv", ["campaigns.py", "12"])
    script.main()
    assert [line.split("  ")[0] for line in capsys.readouterr().out.splitlines()] == [
        "12 runs by one process", "12 runs by 2 processes", "", ]
    assert script.demo(12).plan.count == 12


def test_the_script_llvmlite_range(load: Load) -> None:
    script = load("llvmlite_range")
    assert all(end.startswith("llvmlite==") for end in script.ends())
    assert [test for test in script.TESTS if not (HOUSE / test).is_file()] == []


SUITE_TASK = """id: pump
language: ST
properties_file: props.yaml
variants:
  - {file: clean.st, expected_verdict: true}
  - {file: bomb.st, expected_verdict: false}
  - {file: clean.ld, expected_verdict: true}
"""
SUITE_PROPERTIES = """properties:
  - {id: P1, kind: invariant, expression: "!(pump && full)"}
  - {id: P2, kind: mutual_exclusion, variables: [pump, full]}
  - {id: P3, kind: reachable, expression: "pump"}
"""
SUITE_PROGRAM = "PROGRAM tank\nVAR full AT %IX0.0 : BOOL; pump AT %QX0.0 : BOOL; END_VAR\n    pump := {};\nEND_PROGRAM\n"


def test_the_script_prove_suite(load: Load, tmp_path: Path, monkeypatch: pytest.MonkeyPatch,
                                capsys: pytest.CaptureFixture[str]) -> None:  # fmt: skip
    pytest.importorskip("yaml")
    pytest.importorskip("bitwuzla")
    task, table = tmp_path / "suite" / "pump", tmp_path / "table.md"
    task.mkdir(parents=True)
    for name, text in (("benchmark.yml", SUITE_TASK), ("props.yaml", SUITE_PROPERTIES), ("clean.ld", "rungs"),
                       ("clean.st", SUITE_PROGRAM.format("NOT full")), ("bomb.st", SUITE_PROGRAM.format("TRUE"))):  # fmt: skip
        (task / name).write_text(text, encoding="utf-8")
    monkeypatch.setattr(sys, "argv", ["prove_suite.py", str(tmp_path / "suite"), "--table", str(table)])
    assert load("prove_suite").main() == 0
    rows = [line.split(" | ") for line in table.read_text(encoding="utf-8").splitlines() if "pump" in line]
    assert [(row[1], row[4]) for row in rows] == [("clean.st", "agrees"), ("bomb.st", "agrees"), ("clean.ld", "out of scope")]
    assert "P1 violated, after 1 scan, by the shortest run" in rows[1][5]
    assert "3 variants: 2 agrees, 1 out of scope" in capsys.readouterr().out
