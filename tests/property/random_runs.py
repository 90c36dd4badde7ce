"""Very many random runs of a small program: it draws its own inputs and looks at the property itself, so that a whole run is one
batch of scans in machine code."""

from __future__ import annotations

from dataclasses import dataclass
from random import Random

from fbvm.code.compiler import compile_text
from fbvm.machine.plc import Plc

HOLD_SCANS = (1, 2, 4, 16, 64)
"""An input is drawn anew in one scan of so many, on the average."""
BATCH = 10
"""Scans with the same time between them, where that may vary."""
_STEP = "    Z_Draw := Z_Draw * 1664525 + 1013904223;\n"
_VARIABLES = "    Z_Draw, Z_Hold : UDINT; Z_Scan, Z_Broken : DINT;\n"
_NUMBER = """    {name} := UDINT_TO_INT(Z_Draw / 4096 MOD 12) - 1;
        IF Z_Draw / 1048576 MOD 4 = 0 THEN {name} := UDINT_TO_INT(Z_Draw / 256 MOD 65536); END_IF
"""


def with_drawing(text: str, flags: tuple[str, ...], number: str, broken: str) -> str:
    """The text of a program `Main` that draws its inputs, BOOLs and an INT, and notes the first scan behind which `broken`
    holds, counted from 1, in `Z_Broken`."""
    head, body = text.split("END_VAR\n", 1)
    drawn = "".join(f"{_STEP}    IF Z_Draw / 65536 MOD Z_Hold = 0 THEN {name} := Z_Draw / 268435456 MOD 2 = 1; END_IF\n"
                    for name in flags)  # fmt: skip
    drawn += f"{_STEP}    IF Z_Draw / 65536 MOD Z_Hold = 0 THEN\n    {_NUMBER.format(name=number)}    END_IF\n"
    noted = f"    IF Z_Broken = 0 AND ({broken}) THEN Z_Broken := Z_Scan; END_IF\n" if broken else ""
    body = body.replace("END_PROGRAM", f"{noted}END_PROGRAM")
    return f"{head}{_VARIABLES}END_VAR\n    Z_Scan := Z_Scan + 1;\n{drawn}{body}"


@dataclass(frozen=True)
class Broken:
    """A random run that got to a goal: the number of the scan, from 1 on, and what it was drawn from."""

    scan: int
    seed: int
    hold: int


class RandomRuns:
    """Runs from power-on of a program that `with_drawing` made; with `longest_ns`, after any time up to it between two scans."""

    def __init__(self, text: str, is_native: bool, cycle_ns: int = 10_000_000, longest_ns: int = 0) -> None:
        image = compile_text(text, lint=False).image
        assert image is not None, text
        self.plc = Plc(image, cycle_ns, engine="native" if is_native else "python")
        self.cycle_ns, self.longest_ns = cycle_ns, longest_ns
        self._begin = self.plc.snapshot()

    def first_broken(self, seed: int, scans: int, is_trap: bool) -> Broken | None:
        """What one run of so many scans shows: the scan of its trap, if that is asked for, or that which Z_Broken has."""
        plc, random = self.plc, Random(seed)
        plc.restore(self._begin)
        plc.cycle_ns = self.cycle_ns
        first, hold = random.getrandbits(32), random.choice(HOLD_SCANS)
        plc.write("Main.Z_Draw", first)
        plc.write("Main.Z_Hold", hold)
        while plc.scans < scans and not plc.trap:
            if self.longest_ns:
                plc.cycle_ns = random.choice((self.cycle_ns, self.longest_ns, random.randint(self.cycle_ns, self.longest_ns)))
            plc.run(scans=min(BATCH if self.longest_ns else scans, scans - plc.scans))
        at = (plc.scans if plc.trap else 0) if is_trap else plc.read("Main.Z_Broken")
        return Broken(at, first, hold) if at else None
