"""What a call of a method costs: python tests/bench/objects.py [CALLS].

Prints nanoseconds a call, in machine code, in a loop of so many calls (200,000): of a function, of a method whose body is known,
of one that four blocks override, through a pointer and through an interface; and of the same classes in C++ by `g++ -O2`, where
that is there.  It gates nothing."""

from __future__ import annotations

import shutil
import subprocess
import sys
import tempfile
import time
from pathlib import Path

HOUSE = Path(__file__).resolve().parents[2]
sys.path.insert(0, str(HOUSE))

from fbvm import Plc, compile_text  # noqa: E402

CALLS, ROUNDS = 200_000, 8
BODY = "n := n + x * {factor}; IF n > 100000 THEN n := n - 99991; END_IF; Add := n;"
METHOD = "METHOD Add : DINT VAR_INPUT x : DINT; END_VAR " + BODY + " END_METHOD"
CALLED = {"function": "FAdd(n, i)", "method": "a.Add(i)", "pointer": "p[i MOD 4]^.Add(i)", "interface": "l[i MOD 4].Add(i)"}
CPP = """
#include <chrono>
#include <cstdint>
#include <cstdio>
struct I { virtual int32_t Add(int32_t) = 0; };
struct A : I { int32_t n = 0; int32_t Add(int32_t x) override; };
struct B : A { int32_t Add(int32_t x) override; };
struct C : B { int32_t Add(int32_t x) override; };
struct D : A { int32_t Add(int32_t x) override; };
#define BODY(factor) { n += x * factor; if (n > 100000) n -= 99991; return n; }
int32_t A::Add(int32_t x) BODY(1)
int32_t B::Add(int32_t x) BODY(2)
int32_t C::Add(int32_t x) BODY(3)
int32_t D::Add(int32_t x) BODY(4)
int main() {
    static A a; static B b; static C c; static D d;
    static I* volatile given[4] = {&a, &b, &c, &d};
    I* l[4] = {given[0], given[1], given[2], given[3]};
    volatile int32_t r = 0;
    for (int is_virtual = 0; is_virtual < 2; is_virtual++) {
        double best = 1e9;
        for (int round = 0; round < ROUNDS; round++) {
            auto begun = std::chrono::steady_clock::now();
            int32_t sum = r;
            for (int32_t i = 0; i < CALLS; i++) sum += is_virtual ? l[i % 4]->Add(i) : a.A::Add(i);
            r = sum;
            double took = std::chrono::duration<double>(std::chrono::steady_clock::now() - begun).count();
            if (took < best) best = took;
        }
        printf("%.2f\\n", best / CALLS * 1e9);
    }
}
"""


def program(call: str, calls: int) -> str:
    """A program with four blocks that extend one another, and a loop with one kind of call."""
    blocks = "".join(f"FUNCTION_BLOCK {name} EXTENDS {base} {METHOD.format(factor=factor)} END_FUNCTION_BLOCK\n"
                     for name, base, factor in (("B", "A", 2), ("C", "B", 3), ("D", "A", 4)))  # fmt: skip
    return f"""INTERFACE I METHOD Add : DINT VAR_INPUT x : DINT; END_VAR END_METHOD END_INTERFACE
FUNCTION_BLOCK A IMPLEMENTS I VAR n : DINT; END_VAR {METHOD.format(factor=1)} END_FUNCTION_BLOCK
{blocks}FUNCTION FAdd : DINT VAR_IN_OUT n : DINT; END_VAR VAR_INPUT x : DINT; END_VAR
{BODY.format(factor=1).replace("Add", "FAdd")}
END_FUNCTION
PROGRAM Main
VAR a : A; b : B; c : C; d : D; r, i, n : DINT; l : ARRAY [0..3] OF I; p : ARRAY [0..3] OF POINTER TO A; END_VAR
l[0] := a; l[1] := b; l[2] := c; l[3] := d; p[0] := ADR(a); p[1] := ADR(b); p[2] := ADR(c); p[3] := ADR(d);
FOR i := 0 TO {calls - 1} DO r := r + {call}; END_FOR;
END_PROGRAM
"""


def nanoseconds(call: str, calls: int) -> float:
    """What a call costs, the best of some rounds."""
    made = compile_text(program(call, calls), dialect="codesys", lint=False)
    assert made.image is not None, [message.render() for message in made.errors]
    plc = Plc(made.image, engine="native", budget=1 << 40)
    took = []
    for _ in range(ROUNDS + 1):
        begun = time.perf_counter()
        assert plc.scan() is None
        took.append(time.perf_counter() - begun)
    return min(took[1:]) / calls * 1e9


def in_cpp(calls: int) -> list[float]:
    """Direct and virtual call in C++; nothing where there is no compiler."""
    compiler = shutil.which("g++")
    if compiler is None:
        return []
    with tempfile.TemporaryDirectory() as folder:
        source, made = Path(folder) / "calls.cpp", Path(folder) / "calls"
        source.write_text(CPP.replace("ROUNDS", str(ROUNDS)).replace("CALLS", str(calls)), encoding="utf-8")
        subprocess.run([compiler, "-O2", "-fwrapv", str(source), "-o", str(made)], check=True)
        said = subprocess.run([str(made)], check=True, stdout=subprocess.PIPE, text=True).stdout
    return [float(line) for line in said.split()]


def main(calls: int) -> None:
    """Prints all rows."""
    for name, call in CALLED.items():
        print(f"{name:<20} {nanoseconds(call, calls):8.2f} ns")
    for name, found in zip(("C++, direct", "C++, virtual"), in_cpp(calls), strict=False):
        print(f"{name:<20} {found:8.2f} ns")


if __name__ == "__main__":
    main(int(sys.argv[1]) if len(sys.argv) > 1 else CALLS)
