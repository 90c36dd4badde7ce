"""Compilers that are functions of C work in another process on what is large, with the same result, and can be broken off."""

from __future__ import annotations

import subprocess
import sys
import threading
from typing import Any

import pytest

from fbvm import Plc, compile_text
from fbvm.base.host import interrupt
from fbvm.engine import apart
from fbvm.engine.apart import run_apart
from fbvm.engine.native import engine as native
from fbvm.engine.python import engine as python

BLOCKS = "".join(f"FUNCTION_BLOCK B{n} VAR_OUTPUT o : INT; END_VAR o := o + {n}; END_FUNCTION_BLOCK\n" for n in range(5))
PROGRAM = f"""{BLOCKS}PROGRAM Main VAR {" ".join(f"b{n} : B{n};" for n in range(5))} s, z : INT; END_VAR
{" ".join(f"b{n}(); s := s + b{n}.o;" for n in range(5))} IF s > 60 THEN s := s / z; END_IF END_PROGRAM"""


def result(engine: str) -> tuple[int, str]:
    """What three scans of a new image make, and the trap of the third."""
    image = compile_text(PROGRAM).image
    assert image is not None
    plc = Plc(image, 1_000_000, engine=engine)
    plc.run(scans=4)
    return int(str(plc.read("Main.s"))), str(plc.trap)


@pytest.mark.slow
def test_python_in_parts_and_in_another_process(monkeypatch: pytest.MonkeyPatch) -> None:
    whole = result("python")
    assert whole[0] == 10 + 20 + 30 + 40
    monkeypatch.setattr(python, "PART_CHARACTERS", 10)
    assert result("python") == whole
    ran: list[bytes | None] = []

    def noted(*arguments: Any) -> bytes | None:
        ran.append(run_apart(*arguments))
        return ran[-1]

    monkeypatch.setattr(python, "run_apart", noted)
    monkeypatch.setattr(python, "LONGEST_HERE", 10)
    assert result("python") == whole
    assert len(ran) > 2
    assert all(ran)
    monkeypatch.setattr(apart.subprocess, "Popen", lambda *_, **__: (_ for _ in ()).throw(OSError))  # a system without any
    assert result("python") == whole


@pytest.mark.slow
@pytest.mark.skipif(not native.available(), reason="llvmlite is not installed")
def test_llvm_in_another_process(monkeypatch: pytest.MonkeyPatch) -> None:
    from fbvm.engine.native.llvm import worker
    from fbvm.engine.native.llvm.compiler import compile_text as compile_module

    text = "define i32 @f(i32 %a) {\n  %b = add i32 %a, 1\n  ret i32 %b\n}\n"
    monkeypatch.setattr(worker, "compile_text", None)  # not in this process
    monkeypatch.setattr(worker, "LONGEST_HERE", {0: 10, 2: 10})
    assert [worker.compile_apart(text, level) for level in (0, 2)] == [compile_module(text, level) for level in (0, 2)]


@pytest.mark.slow
def test_ctrl_c_ends_the_other_process(monkeypatch: pytest.MonkeyPatch) -> None:
    started: list[subprocess.Popen[bytes]] = []

    class Noted(subprocess.Popen[bytes]):
        def __init__(self, *arguments: Any, **options: Any) -> None:
            super().__init__(*arguments, **options)
            started.append(self)
            threading.Timer(0.05, interrupt, [threading.get_ident()]).start()

    monkeypatch.setattr(apart.subprocess, "Popen", Noted)
    with pytest.raises(KeyboardInterrupt):
        run_apart("import time; time.sleep(60)", b"")
    assert started[0].returncode not in (None, 0)


@pytest.mark.slow
def test_a_process_that_fails_makes_nothing() -> None:
    assert run_apart("raise SystemExit(1)", b"") is None


def test_the_other_process_does_not_hear_ctrl_c() -> None:
    assert "SIG_IGN" in apart.DEAF
    assert sys.executable
