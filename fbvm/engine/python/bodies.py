"""The function of Python that a body becomes, its blocks, and what they hold in local variables.

`p3_Main(b1, n)` is the body of number 3 for the instance at byte b1 with n steps left, and returns how many are left then;
`own3[b1]` are the views that begin with this instance.  Loops and blocks nested deeper than Python allows become functions inside
the body; what leaves them is a return code."""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping, Sequence
from typing import Any

from fbvm.base.areas import BUDGET
from fbvm.code.image import Body, Image
from fbvm.code.operations import CALLS, Address, Block, Node
from fbvm.engine.effects import STORES, Effects
from fbvm.engine.inlining import Inlining
from fbvm.engine.observation import NO_SITE
from fbvm.engine.python.expressions import ROWS
from fbvm.engine.python.held import Held, full_range, uses
from fbvm.engine.python.writer import Expressions, bare, view
from fbvm.engine.ranges import Range, may_trap, with_temporaries

MOST_INDENTS = 60
"""Levels of indentation in one function of Python, which takes 100."""
EXIT, NEXT, RETURN = 1, 2, 3
"""What an outlined block returns if it is left early."""
IN_MEMORY = f"i64[{BUDGET // 8}]"
"""The step budget in the memory."""
BEGIN, END = "#+ ", "#- "
"""Beginnings of the comments around the code of a body in place of a call, with the number of the call."""
STORING = {*STORES, *CALLS} - {"store"}
"""Statements that may change what is held; a store sees to that itself."""
LEAVES = {EXIT: "exit", NEXT: "next", RETURN: "return"}


def function_name(number: int, body: Body) -> str:
    """The name of the Python function of a body."""
    return f"p{number}_" + re.sub(r"\W", "_", body.name, flags=re.ASCII)


class BodyWriter(Expressions):
    """Writes one body of the plain build, which drops observations.

    `tail` is the tail of the innermost loop of the current function, None outside of any.  `budget` is where the step budget is:
    handed from body to body in the variable n, and written to the memory at the end of the run, or, in bodies that could find it
    there by references, and in other builds, in the memory.  `held` is what else is held.  `inlined` are the calls in place of
    which the code of a body stands, with the operands of the call; comments with their numbers are around it."""

    may_hold = True
    """Whether nobody changes the memory while a body is executed."""

    emitters: Mapping[str, Callable[..., None]]
    """How each statement is written: called with the writer and the operands of its row."""

    def __init__(self, image: Image, constants: dict[str, Any], effects: Effects, inlining: Inlining | None = None) -> None:
        super().__init__(ROWS, constants)
        self.image = image
        self.effects = effects
        self.inlining = inlining
        self.inlined: list[tuple[int, Address | None]] = []
        self.out: list[str] = []
        self.indent = 1
        self.loops = 0
        self.tail: Block | None = None
        self.budget = IN_MEMORY
        self.outlined = False
        self.leaves: set[int] = set()
        self.assigned: set[int] = set()
        self.shared: set[int] = set()
        self.site = NO_SITE
        self._line = 0

    def write(self, number: int) -> list[str]:
        """The lines of the Python function of the body of that number."""
        body = self.image.bodies[number]
        low, high = self.effects.bases.get(number, (-1, -1))
        self.base = low if low == high >= 0 else None
        places = (low, high + body.instance_size) if high >= 0 else None
        code = self.inlining.code(number) if self.inlining else body.code
        loads, references = uses(code) if self.may_hold else ([], True)
        self.held = Held(loads, self.effects, self.base, places, with_temporaries(code))
        if not self.may_hold:
            self.held.state = None
        elif not references:
            self.budget = "n"
        self.block(code)
        self.line(self.returning())
        lines = self.head(function_name(number, body))
        if self.own:
            names = [f"{view(machine)}s" for machine in sorted(self.own)]
            lines.append(f"    {', '.join(names)}{',' * (len(names) == 1)} = own{number}[b1]")
        if self.shared:
            lines.append("    " + "".join(f"t{number} = " for number in sorted(self.shared)) + "None")
        for routine in self.routines:
            lines += ["    " + line for line in routine]
        return lines + self.ended(self.out)

    # --- what is held in local variables

    def kept(self, machine: str, address: Address) -> str | None:
        held, key = self.held, self.held.key(machine, address)
        if key is None or held.state is None:
            return None
        if key in held.state:
            known = held.state[key]
            if known and known[0] == known[1]:
                return str(known[0])
            return None if self.apart else held.name(key)
        if self.perhaps or self.apart or not held.worth(key, 2):
            return None
        self.line(f"{held.name(key)} = {self.item(address, machine)}")
        held.hold(key, full_range(machine))
        return held.name(key)

    def known_range(self, node: Node) -> Range | None:
        if node[0] == "load":
            return self.held.range(self.held.key(node[1], node[2]))
        return self.held.range(("tmp", "", node[2])) if node[0] == "tmp" else None

    def rounded(self, node: Node, text: str) -> str:
        if self.held.state is None or self.perhaps or self.apart or may_trap(node):
            return super().rounded(node, text)
        name = self.name("v")
        self.views.add("r32")
        self.line(f"r32[0] = {bare(text)}")
        self.line(f"{name} = r32[0]")
        return name

    # --- what other builds do otherwise

    def head(self, name: str) -> list[str]:
        """The first lines of the function of a body.  Views are parameters: Python reads these faster than global names."""
        views = "".join(f", {each}={each}" for each in sorted(self.views))
        if self.budget == "n":
            return [f"def {name}(b1, n{views}):"]
        return [f"def {name}(b1, steps{views}):", f"    {IN_MEMORY} = steps"]

    def returning(self) -> str:
        """The last line of the function of a body, and that of a RETURN."""
        return f"return {self.budget}"

    def ended(self, lines: list[str]) -> list[str]:
        """The lines of a function, one at least."""
        return [*lines, "    pass"] if _empty(lines) else lines

    def calling(self, call: str) -> str:
        """Python that calls a function which is made of a block."""
        return call

    def call_body(self, pou: int, address: Address | None, place: str) -> None:
        """Writes the call of the body of number `pou`, whose instance begins at `address`; `place` is Python for that byte."""
        self.line(f"{self.budget} = {self.function(pou)}({place}, {self.budget})")

    def attempt_body(self, pou: int, place: str, number: str) -> None:
        """Writes the execution of a part of this POU, and that the variable `number` is 0 behind it."""
        self.line(f"{self.budget} = {self.function(pou)}({place}, {self.budget})")
        self.line(f"{number} = 0")

    def after_stop(self, number: str, traps: bool) -> None:
        """Writes what is done when such a part has stopped: the variable `number` gets what has ended it."""
        self.line(f"{number}, {self.budget}, _ = caught(stopped, {traps})")

    def observe(self, kind: str, site: int, detail: Any) -> None:
        """Writes an observation."""

    def begin_pass(self) -> None:
        """Writes what is done at the beginning of each pass of a loop."""

    def flush(self) -> None:
        """Writes what must stand in front of the next line, or at the end of a block."""

    def function(self, pou: int) -> str:
        """The name of the function of a body."""
        return function_name(pou, self.image.bodies[pou])

    # --- lines and blocks

    def line(self, text: str) -> None:
        self.out.append("    " * self.indent + text)

    def comment(self, text: str) -> None:
        self.out.append("    " * self.indent + text)

    def block(self, block: Block) -> None:
        for node in block:
            self.emitters[node[0]](self, *node[1:])
            if node[0] in STORING:
                self.held.forget(node, self.range_of)

    def suite(self, write: Callable[[], None]) -> None:
        """What `write` writes, one level deeper."""
        self.indent += 1
        before = len(self.out)
        if self.indent > MOST_INDENTS:
            self.outline(write)
        else:
            write()
        self.flush()
        if _empty(self.out[before:]):
            self.line("pass")
        self.indent -= 1

    def outline(self, write: Callable[[], None]) -> None:
        """What `write` writes as a function inside the body, and its call."""
        self.flush()
        outer = (self.out, self.indent, self.loops, self.tail, self.outlined, self.leaves, self.assigned)
        around = self.held.enter()
        self.out, self.indent, self.loops, self.tail = [], 1, 0, None
        self.outlined, self.leaves, self.assigned = True, set(), set()
        write()
        self.flush()
        name, lines, leaves, assigned = self.name("o"), self.out, self.leaves, self.assigned
        self.out, self.indent, self.loops, self.tail, self.outlined, self.leaves, self.assigned = outer
        self.shared |= assigned
        names = [f"t{number}" for number in sorted(assigned)] + ["n"] * (self.budget == "n")
        shared = [f"    nonlocal {', '.join(names)}"] if names else []
        self.routines.append([f"def {name}():", *shared, *self.ended(lines)])
        call = self.calling(f"{name}()")
        self.line(f"r = {call}" if leaves else call)
        for key in self.held.leave(around):  # what a loop around holds
            self.line(f"{self.held.name(key)} = {self.item((key[1], key[2], ()), key[0])}")
        for code in sorted(leaves):
            self.line(f"if r == {code}:")
            self.indent += 1
            state = self.held.copy()
            self.emitters[LEAVES[code]](self)
            self.held.state = state
            self.indent -= 1

    def leave(self, code: int) -> None:
        """Leave an outlined block: whoever called it goes on with the code."""
        self.leaves.add(code)
        self.line(f"return {code}")
        self.held.state = None

    def branches(self, tests: list[tuple[str, Block]], otherwise: Block, conditions: Sequence[Node] = ()) -> None:
        """An if with its branches; `conditions` are those of the tests, as far as they are operations."""
        word, held = "if", self.held
        before, ends = held.copy(), []
        for number, (test, block) in enumerate(tests):
            self.line(f"{word} {test}:")
            held.state = None if before is None else dict(before)
            if conditions:
                held.learn(conditions[number], True)
            self.suite(lambda block=block: self.block(block))  # type: ignore[misc]
            ends.append(held.state)
            held.state = before
            if conditions:
                held.learn(conditions[number], False)
            word = "elif"
        if otherwise:
            self.line("else:")
            self.suite(lambda: self.block(otherwise))
        held.meet([*ends, held.state])


def _empty(lines: list[str]) -> bool:
    return all(line.lstrip().startswith("#") for line in lines)
