"""Prints how `fbvm check` grows with a program: python tests/bench/checking.py [LINES ...].  It gates nothing.

Each size has a process of its own, so that its memory can be told.  The program is blocks as machines have them (states,
timers, scaling, texts, tables), each called once by a program, without an error or a warning.

The limit is a straight line: twice the lines, twice the time and memory, as every stage is one pass in Python over tokens or
nodes.  The parser alone cannot be quicker than the host's regular expressions find tokens, some ten times as fast."""

from __future__ import annotations

import json
import resource
import subprocess
import sys
import time
from pathlib import Path

HOUSE = Path(__file__).resolve().parents[2]
sys.path.insert(0, str(HOUSE))

SIZES = (5_000, 20_000, 50_000)
BLOCK = """
FUNCTION_BLOCK Station_{n}
VAR_INPUT
    Start, Stop, Reset : BOOL;
    Level : INT;
    Top : REAL := 80.0;
END_VAR
VAR_OUTPUT
    Run, Alarm : BOOL;
    Flow : REAL;
    Message : STRING[40];
END_VAR
VAR
    Phase : (Idle_{n}, Filling_{n}, Mixing_{n}, Draining_{n});
    Wait : TON;
    Pulse : R_TRIG;
    Count : CTU;
    History : ARRAY [0..15] OF INT;
    Place, i : INT;
    Sum : DINT;
    Mean : REAL;
END_VAR
    Pulse(CLK := Start);
    Wait(IN := Phase = Mixing_{n}, PT := T#5s);
    Count(CU := Pulse.Q, R := Reset, PV := 100);

    // what has come in, and its mean
    Place := (Place + 1) MOD 16;
    History[Place] := Level;
    Sum := 0;
    FOR i := 0 TO 15 DO
        Sum := Sum + History[i];
    END_FOR;
    Mean := DINT_TO_REAL(Sum) / 16.0;
    Flow := LIMIT(0.0, Mean * 0.25 + 1.5 * Top / (ABS(Mean) + 1.0), 100.0);

    CASE Phase OF
        Idle_{n}:
            IF Pulse.Q AND NOT Stop THEN
                Phase := Filling_{n};
                Message := 'filling';
            END_IF;
        Filling_{n}:
            IF Flow > Top OR Level >= 27000 THEN
                Phase := Mixing_{n};
                Message := CONCAT('mixing at ', REAL_TO_STRING(Flow));
            ELSIF Stop THEN
                Phase := Draining_{n};
            END_IF;
        Mixing_{n}:
            IF Wait.Q THEN
                Phase := Draining_{n};
                Message := 'draining';
            END_IF;
        Draining_{n}:
            IF Level < 100 AND (Mean < 120.0 OR Count.Q) THEN
                Phase := Idle_{n};
                Message := '';
            END_IF;
    END_CASE;

    Alarm := (Level > 32000 OR Level < -10) AND NOT Reset;
    Run := Phase <> Idle_{n} AND NOT Alarm;
END_FUNCTION_BLOCK
"""


def program(lines: int) -> str:
    """A text of about that many lines."""
    count = max(1, lines // (BLOCK.count("\n") + 3))
    blocks = [BLOCK.format(n=n) for n in range(count)]
    declared = "".join(f"    Unit_{n} : Station_{n};\n" for n in range(count))
    called = "".join(f"    Unit_{n}(Start := Go, Level := Levels[{n % 100}]);\n" for n in range(count))
    return "".join(blocks) + f"""
PROGRAM Main
VAR
    Go : BOOL;
    Levels : ARRAY [0..99] OF INT;
{declared}END_VAR
{called}END_PROGRAM
"""


def measured(lines: int) -> dict[str, float]:
    """Times and memory of one check."""
    from fbvm.base.diagnostics import Source
    from fbvm.code.compiler import compile_sources
    from fbvm.syntax.parser import parse

    text = program(lines)
    compile_sources([Source("warm.st", program(100))])
    empty = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    began = time.process_time()
    parse(Source("big.st", text))
    parsed_s = time.process_time() - began
    began = time.process_time()
    made = compile_sources([Source("big.st", text)], lint=False)
    compiled_s = time.process_time() - began
    began = time.process_time()
    linted = compile_sources([Source("big.st", text)])
    linted_s = time.process_time() - began
    assert made.diagnostics == linted.diagnostics == [], [d.render() for d in linted.diagnostics[:3]]
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    return {"lines": text.count("\n"), "parse": parsed_s, "compile": compiled_s, "check": linted_s,
            "mib": (peak - empty) / 1024}


def main() -> None:
    """One row a size: lines per second of processor time of the parser, of a compilation, and of all that `fbvm check` does."""
    if sys.argv[1:2] == ["--one"]:
        print(json.dumps(measured(int(sys.argv[2]))))
        return
    print(f"{'lines':>8}{'parse':>12}{'compile':>12}{'check':>12}   lines/s{'memory':>12}{'a line':>12}")
    for lines in [int(each) for each in sys.argv[1:]] or SIZES:
        done = subprocess.run([sys.executable, __file__, "--one", str(lines)], check=True, capture_output=True, text=True)
        row = json.loads(done.stdout)
        rates = "".join(f"{row['lines'] / row[part]:>12,.0f}" for part in ("parse", "compile", "check"))
        print(f"{row['lines']:>8,.0f}{rates}{row['mib']:>18,.0f} MiB{row['mib'] * 1024 / row['lines']:>8,.1f} KiB", flush=True)


if __name__ == "__main__":
    main()
