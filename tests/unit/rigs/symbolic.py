"""Scans of the encoder with inputs that are not known, compared with scans of the engine for some values of these inputs.

Terms are evaluated here, by Python's integers: what the encoder's factory has simplified has to mean the same.  As the solver
does, this refuses operands of several widths."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from encoded import FROM_BYTE, MACHINE_BYTES

from fbvm.base.areas import PAGE_BYTES
from fbvm.code.image import Image
from fbvm.machine.counting import counting
from fbvm.machine.plc import Plc
from fbvm.prove.encoding.cells import BIT, BOOL, Cell, Contents, Partition, Reshape, constant_of
from fbvm.prove.encoding.clocks import FixedCycle
from fbvm.prove.encoding.scan import Scanned, Signal, scan
from fbvm.prove.encoding.terms import Term, Terms, signed
from fbvm.prove.unreached import own_files
from fbvm.watch.paths import Place

CYCLE_NS, BUDGET = 10_000_000, 20_000


def term_value(term: Term, values: Mapping[Term, int], known: dict[Term, int] | None = None) -> int:
    """The value of a term for values of its variables, as an unsigned number; without any simplification."""
    known = {} if known is None else known
    if term not in known:
        if term.op in ("const", "var"):
            known[term] = int(term.value) if term.op == "const" else values[term]
        else:
            args = [term_value(arg, values, known) for arg in term.args]
            known[term] = _result(term, args) & ((1 << max(term.width, 1)) - 1)
    return known[term]


def _result(term: Term, args: list[int]) -> int:
    op, width = term.op, term.args[0].width
    alike = {arg.width for arg in (term.args[1:] if op == "ite" else term.args)}
    assert len(alike) == 1 or op == "concat", f"{op} of {alike} bits"
    if op in _PLAIN:
        return int(_PLAIN[op](*args))
    if op in ("slt", "sle", "sdiv", "srem"):
        a, b = (signed(arg, width) for arg in args)
        if op in ("slt", "sle"):
            return int(a < b or (op == "sle" and a == b))
        if b == 0:
            return (1 if a < 0 else -1) if op == "sdiv" else a
        quotient = abs(a) // abs(b) * (1 if (a < 0) == (b < 0) else -1)
        return quotient if op == "sdiv" else a - b * quotient
    if op == "concat":
        return args[0] << term.args[1].width | args[1]
    if op == "extract":
        return args[0] >> term.value
    return signed(args[0], width) if op == "sext" else args[0]


_PLAIN: dict[str, Any] = {
    "not": lambda a: not a, "and": lambda a, b: a & b, "xor": lambda a, b: a ^ b, "ite": lambda c, a, b: a if c else b,
    "eq": lambda a, b: a == b, "ult": lambda a, b: a < b, "ule": lambda a, b: a <= b, "add": lambda a, b: a + b,
    "sub": lambda a, b: a - b, "mul": lambda a, b: a * b, "neg": lambda a: -a, "udiv": lambda a, b: a // b if b else -1,
    "urem": lambda a, b: a % b if b else a, "bvand": lambda a, b: a & b, "bvor": lambda a, b: a | b,
    "bvxor": lambda a, b: a ^ b, "bvnot": lambda a: ~a, "shl": lambda a, n: a << n if n < 64 else 0, "shr": lambda a, n: a >> n,
}  # fmt: skip


def encoded(plc: Plc, inputs: Sequence[Place]) -> tuple[Scanned, dict[Term, Cell]]:
    """The first scan, and the variables of the cells that lie in the inputs."""
    inside = {at for place in inputs for at in range(place.offset, place.offset + max(1, place.type.size))}
    return encoded_program(plc.image, bytes(plc.memory.u8), BUDGET, inside)


def encoded_program(program: Image, memory: bytes, budget: int, inputs: set[int]) -> tuple[Scanned, dict[Term, Cell]]:
    """The first scan of a program in this memory, and the variables of the cells that lie in the bytes `inputs`."""
    terms, numbers = Terms(), frozenset[int]()
    clock = FixedCycle(terms, program.tasks, CYCLE_NS)
    variables: dict[Term, Cell] = {}

    def initial(cell: Cell) -> Term:
        if not inputs.issuperset(range(cell.offset, cell.offset + cell.size)):
            return constant_of(terms, cell, memory[cell.offset : cell.offset + cell.size])
        variable = terms.variable(cell, cell.width)
        variables[variable] = cell
        return variable

    def signal(asked: Signal) -> Term:
        found = clock.value(0, asked)
        return terms.boolean(asked[0] == "fresh") if found is None else found

    while True:
        partition = Partition(numbers)
        try:
            while True:
                before = len(partition.at)
                variables.clear()
                scanned = scan(program, Contents(terms, partition, initial), signal, budget)
                if len(partition.at) == before:
                    return scanned, variables
        except Reshape as reshape:
            numbers |= {reshape.offset}


def held(cell: Cell, memory: bytes) -> int:
    """What lies in a cell, as an unsigned number."""
    if cell.kind == BIT:
        return memory[cell.offset] >> cell.bit & 1
    return int.from_bytes(memory[cell.offset : cell.offset + cell.size], "little")


def compare_inputs(image: Image, names: Sequence[str], rows: Sequence[Sequence[Any]]) -> None:
    """Asserts that the first scan, encoded once with the variables `names` unknown, leaves for the values of each row the memory
    and the trap that the engine leaves."""
    plc = Plc(image, CYCLE_NS, budget=BUDGET, engine="python")
    places = [plc.find(name) for name in names]
    scanned, variables = encoded(plc, places)  # type: ignore[arg-type]
    begin = plc.snapshot()
    cells = {cell for cells in scanned.contents.partition.at.values() for cell in cells if cell.offset >= FROM_BYTE}
    for row in rows:
        plc.restore(begin)
        for name, value in zip(names, row, strict=True):
            plc.write(name, value)
        memory = bytes(plc.memory.u8)
        values = {term: held(cell, memory) for term, cell in variables.items()}
        assert all(value < 2 for term, value in values.items() if variables[term].kind == BOOL)
        with counting(plc, own_files(image)) as counts:
            plc.scan()
            executed = counts.executed()
        known: dict[Term, int] = {}
        trap = next(((each.code, plc.image.sites[each.site]) for each in scanned.execution.traps
                     if term_value(each.condition, values, known)), None)  # fmt: skip
        assert trap == ((plc.trap.code, plc.trap.site) if plc.trap else None), row
        if trap is None:
            reached = {site for site, term in scanned.execution.reached.items() if term_value(term, values, known)}
            assert {site for site, count in executed.items() if count} == reached & executed.keys(), row
            after = bytes(plc.memory.u8)
            found = {cell: term_value(scanned.contents.get(cell), values, known) for cell in cells}
            assert found == {cell: held(cell, after) for cell in cells}, row
            pages = [page for page in range(FROM_BYTE, len(after), PAGE_BYTES)
                     if memory[page : page + PAGE_BYTES] != after[page : page + PAGE_BYTES]]  # fmt: skip
            changed = {at for page in pages for at in range(page, min(page + PAGE_BYTES, len(after)))
                       if memory[at] != after[at] and at not in MACHINE_BYTES}  # fmt: skip
            assert changed <= scanned.contents.partition.at.keys(), "what was written is known"
