"""Diagrams to the steps of a rung; each diagram has one form as instructions."""

from __future__ import annotations

from typing import NamedTuple

from fbvm.syntax.ladder.drawing.diagram import CALL, COILS, EDGES, WIRE, Box, Coil, Contact, Parallel, Part, Point, Series

_COILS = {mark.strip(): mnemonic for mnemonic, mark in COILS.items()} | {"P": "DIFU", "N": "DIFD"}
"""Marks of coils; P and N are those of IEC 61131-3, table 76."""
_EDGES = {mark: prefix for prefix, mark in EDGES.items()} | {"P": "@", "N": "%"}


class Coded(NamedTuple):
    """An instruction, and the element that it was drawn as; None for one that only joins others, such as AND LD."""

    prefix: str
    mnemonic: str
    operands: tuple[str, ...]
    drawn: Contact | Coil | Box | None = None


def steps(bar: Point) -> list[Coded]:
    """The instructions of a diagram, in the order in which they are executed."""
    coder = _Coder()
    coder.outs(bar, at_bar=True)
    return coder.steps


class _Coder:
    def __init__(self) -> None:
        self.steps: list[Coded] = []
        self.points = 0

    def outs(self, point: Point, at_bar: bool = False, before: str = "") -> None:
        """The outputs and paths of a point whose condition has been made; a TR bit keeps the condition if it is needed again.
        `before` is the TR bit of the point before."""
        kept = ""
        again = any(isinstance(out, Point) or isinstance(out, Box) and out.inputs for out in point.outs[:-1])
        if not at_bar and (again or any(isinstance(out, Point) and out.is_joined for out in point.outs)):
            kept = f"TR{self.points}"
            self.points += 1
            self.add("OUT", kept)
        used = False
        for out in point.outs:
            if used and kept:
                self.add("LD", kept)
            used = isinstance(out, Point) or isinstance(out, Box) and bool(out.inputs)
            if isinstance(out, Point):
                self.series(out.path, not at_bar)
                self.outs(out, before=kept)
            elif isinstance(out, Coil):
                self.steps.append(coil(out))
            else:
                for path in out.inputs:
                    if path.from_branch:
                        self.add("LD", before)
                    self.series(path, path.from_branch)
                self.box(out)

    def add(self, mnemonic: str, *operands: str) -> None:
        self.steps.append(Coded("", mnemonic, operands))

    def series(self, path: Series, is_joined: bool) -> None:
        """Conditions in series; with `is_joined`, in series with the condition that has been made."""
        for part in path.parts:
            self.part(part, "AND" if is_joined else "LD")
            is_joined = True

    def part(self, part: Part, how: str) -> None:
        if isinstance(part, Contact):
            self.steps.append(contact(part, how))
        elif isinstance(part, Box):
            self.box(part)
        elif how == "AND" and any(isinstance(branch.parts[0], Box) for branch in part.branches if branch.parts):
            self.forked(part)
        else:
            self.parallel(part)
            if how == "AND":
                self.add("ANDLD")

    def forked(self, part: Parallel) -> None:
        """Branches behind a condition of which one begins with a box, as UP: each begins at a TR bit with the condition."""
        kept = f"TR{self.points}"
        self.points += 1
        self.add("OUT", kept)
        for number, branch in enumerate(part.branches):
            if number:
                self.add("LD", kept)
            self.series(branch, True)
            if number:
                self.add("ORLD")

    def parallel(self, part: Parallel) -> None:
        first, *more = part.branches
        self.series(first, False)
        for branch in more:
            if len(branch.parts) == 1 and isinstance(branch.parts[0], Contact):
                self.part(branch.parts[0], "OR")
            else:
                self.series(branch, False)
                self.add("ORLD")

    def box(self, box: Box) -> None:
        if not box.instance:
            prefix = box.name[: len(box.name) - len(box.name.lstrip("!@%"))]
            self.steps.append(Coded(prefix, box.name[len(prefix):], box.operands, box))
            return
        pins = [f"{pin.name}{'=>' if pin.output else ':='}{pin.operand}" for pin in box.pins]
        if box.through:
            conditions = [f"{name}:={WIRE}" for name in box.entries if name.upper() != "EN"]
            conditions += [f"{box.leaves}=>{WIRE}"] if box.leaves.upper() != "ENO" else []
        else:
            conditions = [f"{name}:=" for name in box.entries]
        self.steps.append(Coded("", "FBCALL" if box.through else CALL, (box.name, box.instance, *conditions, *pins), box))


def contact(drawn: Contact, how: str) -> Coded:
    """A contact as an instruction that joins as `how` says."""
    mark = drawn.mark.strip()
    bit = mark.removeprefix("!")
    prefix = "!" if bit != mark else ""
    if bit.strip("/") in _EDGES:
        return Coded(prefix + _EDGES[bit.strip("/")], how + ("NOT" if "/" in bit else ""), drawn.operands, drawn)
    rest = mark.lstrip("!@%")
    return Coded(mark[: len(mark) - len(rest)], how + rest, drawn.operands, drawn)


def coil(drawn: Coil) -> Coded:
    """A coil as an instruction."""
    mark = drawn.mark.strip()
    rest = mark.lstrip("!@%")
    return Coded(mark[: len(mark) - len(rest)], _COILS.get(rest, rest), drawn.operands, drawn)
