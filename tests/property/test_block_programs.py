"""Block programs made at random do what an interpreter of their instructions does, cycle by cycle, on both engines.

The interpreter keeps a position among the instructions, as a person with a finger on the listing would; it shares nothing with
the jumps and loops that the compiler makes."""

from __future__ import annotations

from dataclasses import dataclass, field

import pytest
from depth import times
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from fbvm.code.compiler import compile_text
from fbvm.machine.plc import Plc

INPUTS = ["W0.00", "W0.01", "W0.02"]
COUNTERS = 12
LOOPED = 3


@dataclass
class Listing:
    """The lines of a program, each with what the interpreter does: its word, its bit with NOT or not, and where it leads."""

    lines: list[str] = field(default_factory=list)
    steps: list[tuple[str, str, bool, int]] = field(default_factory=list)

    def add(self, line: str, word: str, bit: str = "", inverted: bool = False, number: int = 0) -> int:
        self.lines.append(line)
        self.steps.append((word, bit, inverted, number))
        return len(self.steps) - 1


@st.composite
def bodies(draw: st.DrawFn, listing: Listing, depth: int, looped: bool) -> None:
    for _ in range(draw(st.integers(0, 3))):
        bit, inverted = draw(st.sampled_from(INPUTS)), draw(st.booleans())
        operand = f"NOT {bit}" if inverted else bit
        kind = draw(st.sampled_from(["count", "count", "wait", "exit", "if", "if", "loop", "cntw"]))
        if kind == "count":
            number = draw(st.integers(0, COUNTERS - 1))
            listing.add(f"++(590) D{number}", "count", number=number)
        elif kind in ("wait", "exit"):
            if draw(st.booleans()):
                listing.add(f"{kind.upper()} {operand}", kind, bit, inverted)
            else:
                listing.add(f"LD{'NOT' if inverted else ''} {bit}\n{kind.upper()}", kind, bit, inverted)
        elif kind == "if" and depth:
            listing.add(f"IF {operand}", "if", bit, inverted)
            draw(bodies(listing, depth - 1, looped))
            if draw(st.booleans()):
                listing.add("ELSE", "else")
                draw(bodies(listing, depth - 1, looped))
            listing.add("IEND", "iend")
        elif kind == "loop" and depth and not looped:
            listing.add(f"MOV #0 D{COUNTERS}\nLOOP\n++ D{COUNTERS}", "loop")
            draw(bodies(listing, depth - 1, True))
            listing.add(f"LD>= D{COUNTERS} &{LOOPED}\nOR {bit}\nLEND", "lend", bit)
        elif kind == "cntw":
            listing.add(f"CNTW {len(listing.steps)} #0001 {bit}", "cntw", bit, number=len(listing.steps))


@st.composite
def programs(draw: st.DrawFn) -> Listing:
    listing = Listing()
    draw(bodies(listing, 3, False))
    return listing


class Interpreter:
    def __init__(self, listing: Listing) -> None:
        self.steps = listing.steps
        self.at = 0
        self.counts = [0] * COUNTERS
        self.looped = 0
        self.before: dict[int, bool] = {}
        self.counting = False

    def other(self, at: int, words: tuple[str, ...], step: int = 1) -> int:
        """Where the next of these words of the same depth stands, or the last one before."""
        opening, closing = (("if", "loop"), ("iend", "lend"))[::step]
        depth = 0
        while True:
            at += step
            word = self.steps[at][0]
            if not depth and word in words:
                return at
            depth += (word in opening) - (word in closing)

    def cycle(self, on: dict[str, bool]) -> None:
        while self.at < len(self.steps):
            word, bit, inverted, number = self.steps[self.at]
            state = on.get(bit, False) != inverted
            if word == "count":
                self.counts[number] += 1
            elif word == "wait" and not state:
                return
            elif word == "exit" and state:
                break
            elif word == "if" and not state:
                self.at = self.other(self.at, ("else", "iend"))
            elif word == "else":
                self.at = self.other(self.at, ("iend",))
            elif word == "loop":
                self.looped = 1
            elif word == "lend" and not (self.looped >= LOOPED or state):
                self.at = self.other(self.at, ("loop",), -1)
                self.looped += 1
            elif word == "cntw":
                rises = self.counting and state and not self.before[number]
                self.before[number] = state
                self.counting = not rises
                if not rises:
                    return
            self.at += 1
        self.at = 0


@pytest.mark.slow
@settings(max_examples=times(60), deadline=None, suppress_health_check=list(HealthCheck))
@given(programs(), st.lists(st.tuples(st.booleans(), st.booleans(), st.booleans(), st.sampled_from([True, True, True, False])),
                            min_size=4, max_size=12))
def test_a_block_program_does_what_its_listing_says(listing: Listing, cycles: list[tuple[bool, ...]]) -> None:
    text = "\n".join(["PROGRAM Main", "LADDER", "LD W0.03", "BPRG 0", *listing.lines, "BEND", "END_LADDER", "END_PROGRAM"])
    made = compile_text(text, lint=False)
    assert made.image is not None, (text, made.diagnostics)
    plcs = [Plc(made.image, engine=engine) for engine in ("python", "native")]
    oracle = Interpreter(listing)
    for states in cycles:
        for plc in plcs:
            plc.memory.words("W")[0] = sum(state << at for at, state in enumerate(states))
            assert plc.scan() is None
        if states[3]:
            oracle.cycle(dict(zip(INPUTS, states, strict=False)))
        for plc in plcs:
            assert plc.memory.words("D")[:COUNTERS].tolist() == oracle.counts, text
