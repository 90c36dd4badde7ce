"""Ladder programs at random, of contacts, blocks of contacts, branches, coils and timers."""

from __future__ import annotations

from random import Random

INPUTS = "abcde"
BITS = (*INPUTS, "x", "y", "z", "v[1]", "v[2]")
HEAD = "PROGRAM Main\nVAR a, b, c, d, e, x, y, z : BOOL; v : ARRAY [0..3] OF BOOL; t : TON; u : CTU; END_VAR\nLADDER\n"
COILS = ("OUT", "OUT", "OUT", "OUT NOT", "SET", "RSET", "@SET", "%RSET", "DIFU", "DIFD")


def random_ladder(random: Random, reads: tuple[str, ...] = BITS, edges: bool = True) -> str:
    """A program of a few rungs; `reads` are the bits that contacts ask for."""
    return HEAD + "".join(_Rung(random, reads, edges).text() for _ in range(random.randint(1, 5))) + "END_LADDER\nEND_PROGRAM\n"


class _Rung:
    def __init__(self, random: Random, reads: tuple[str, ...], edges: bool) -> None:
        self.random, self.reads, self.edges = random, reads, edges
        self.lines = ["RUNG"]
        self.branches = 0

    def text(self) -> str:
        self._block(2)
        self._outputs(2)
        return "\n".join(self.lines) + "\n"

    def _contact(self, how: str) -> None:
        mark = self.random.choice(("", "", "", " NOT", "@", "%") if self.edges else ("", "", " NOT"))
        mnemonic = f"{mark}{how}" if mark in ("@", "%") else f"{how}{mark}"
        self.lines.append(f"    {mnemonic} {self.random.choice(self.reads)}")

    def _block(self, depth: int) -> None:
        """Contacts that begin with LD."""
        self._contact("LD")
        for _ in range(self.random.randint(0, 2)):
            how = self.random.choice(("AND", "OR", "AND LD", "OR LD"))
            if how in ("AND", "OR"):
                self._contact(how)
            elif depth:
                self._block(depth - 1)
                self.lines.append(f"    {how}")

    def _outputs(self, depth: int) -> None:
        """What hangs on a place: coils, more contacts with coils behind them, branches."""
        if self.random.random() < 0.2:
            self.lines.append(self.random.choice((
                "    FBCALL TON t IN:=a PT:=T#20ms Q=>z", "    FBCALL CTU u CU:=b PV:=&3 R:=FALSE Q=>y")))
        if depth and self.random.random() < 0.4:
            branch, self.branches = self.branches, self.branches + 1
            self.lines.append(f"    OUT TR{branch}")
            self._contact("AND")
            self._outputs(depth - 1)
            self.lines.append(f"    LD TR{branch}")
            if self.random.random() < 0.7:
                self._contact("AND")
        for _ in range(self.random.randint(1, 2)):
            self.lines.append(f"    {self.random.choice(COILS)} {self.random.choice(BITS[5:])}")
        if depth and self.random.random() < 0.3:
            self._contact("AND")
            self._outputs(depth - 1)
