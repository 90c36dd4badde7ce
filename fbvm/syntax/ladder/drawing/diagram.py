"""Steps of a rung to a diagram: contacts in series and in parallel, branch points, coils and boxes."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

from fbvm.syntax.ladder.instructions.instruction_set import instruction_set

MOST_NESTED, MOST_POINTS = 24, 200
"""How many parallel connections one within another, and how many points one behind another, a drawing has at most.  What is
deeper is as wide as five screens, and takes long to lay out."""
StepText = tuple[str, str, tuple[str, ...]]
"""Prefix, mnemonic and operands of an instruction."""


class Undrawable(Exception):
    """The steps can be executed and cannot be drawn, as with an OR behind an output, or are nested too deep for it."""


@dataclass(eq=False)
class Contact:
    """A contact: `mark` is the text between its two strokes."""

    step: int
    mark: str
    operands: tuple[str, ...]


@dataclass(frozen=True)
class Pin:
    """A pin of a function block: an input with its operand, or an output with the variable that takes its value."""

    name: str
    operand: str
    output: bool = False


@dataclass(eq=False)
class Box:
    """What is drawn as a box.  `inputs` are the conditions below the first one; one with `through` lets power on.

    A function block has an `instance`, names of the pins that conditions enter, and of the one that power leaves; others
    have operands."""

    step: int
    name: str
    operands: tuple[str, ...] = ()
    inputs: tuple[Series, ...] = ()
    through: bool = False
    instance: str = ""
    pins: tuple[Pin, ...] = ()
    entries: tuple[str, ...] = ()
    leaves: str = "ENO"


@dataclass(eq=False)
class Coil:
    step: int
    mark: str
    operands: tuple[str, ...]


@dataclass(eq=False)
class Series:
    parts: list[Part] = field(default_factory=list)
    from_branch: bool = False
    """Of a lower input of a box: it begins at the point before the one that the box hangs on, not at the bus bar."""


@dataclass(eq=False)
class Parallel:
    branches: list[Series]


@dataclass(eq=False)
class Point:
    """A point behind a series, from which power goes on to outputs and to other points; the first point is the bus bar."""

    path: Series
    outs: list[Out] = field(default_factory=list)

    @property
    def is_joined(self) -> bool:
        """Whether a box on it has lower inputs that begin at the point before."""
        return any(path.from_branch for out in self.outs if isinstance(out, Box) for path in out.inputs)


Part = Contact | Box | Parallel
Out = Coil | Box | Point

WIRE = "*"
"""The operand that marks the pin of an FBCALL that takes power in place of EN, or gives power in place of ENO."""
CALL = "CALL"
"""The call of a block in Structured Text, as a step: type, instance, pins; a pin takes a condition where nothing enters it."""
COILS = {"OUT": " ", "OUTNOT": "/", "SET": "S", "RSET": "R", "DIFU": "↑", "DIFD": "↓"}
EDGES = {"": "", "@": "↑", "%": "↓"}


@dataclass
class _Condition:
    start: Point
    path: Series

    def is_empty(self) -> bool:
        return not self.path.parts


def diagram(steps: Sequence[StepText]) -> Point:
    """The bus bar of a rung with all elements that follow it.  Raises Undrawable."""
    reader = _Reader()
    try:
        for number, (prefix, mnemonic, operands) in enumerate(steps):
            reader.step(number, prefix, mnemonic, operands)
    except IndexError:
        raise Undrawable from None
    reader.finish()
    _limit(reader.bar)
    return reader.bar


def _limit(bar: Point) -> None:
    """Raises Undrawable if something is nested too deep."""
    waiting: list[tuple[Point | Part, int, int]] = [(bar, 0, 0)]
    while waiting:
        item, nested, points = waiting.pop()
        if nested > MOST_NESTED or points > MOST_POINTS:
            raise Undrawable
        if isinstance(item, Point):
            waiting += [(part, nested, points) for part in item.path.parts]
            waiting += [(out, nested, points + 1) for out in item.outs if not isinstance(out, Coil)]
        elif not isinstance(item, Contact):
            within = item.branches if isinstance(item, Parallel) else item.inputs
            waiting += [(part, nested + isinstance(item, Parallel), points) for path in within for part in path.parts]


def _changes_power(path: Series) -> bool:
    """Whether there is a box in this series, such as NOT or UP, which does not only pass power on.  One in a branch takes the
    power of its branch."""
    return any(isinstance(part, Box) for part in path.parts)


class _Reader:
    """Follows the steps with the stack of conditions with which they are executed."""

    def __init__(self) -> None:
        self.bar = Point(Series())
        self.now = _Condition(self.bar, Series())
        self.stack: list[_Condition] = []
        self.kept: dict[str, Point] = {}
        self.before: dict[Point, Point] = {}
        """The point before each point but the bus bar."""
        self.lost = False
        """Whether the condition is that of the last input of a box, behind which nothing can be drawn."""

    def step(self, number: int, prefix: str, mnemonic: str, operands: tuple[str, ...]) -> None:
        if operands and operands[0].upper() in self.kept and mnemonic == "LD":
            self.stack.append(self.now)
            self.now, self.lost = _Condition(self.kept[operands[0].upper()], Series()), False
            return
        join = joined(mnemonic)
        self.lost &= join is None or join[0] != "LD"
        if self.lost:
            raise Undrawable
        if join is not None and (operands or join[1]):
            self._join(join[0], drawn_contact(number, prefix, join[1], operands))
        elif mnemonic in _SINGLE:
            _SINGLE[mnemonic](self, number)
        else:
            self._output(number, prefix, mnemonic, operands)

    def _join(self, how: str, contact: Contact) -> None:
        if how == "LD":
            if not self.now.is_empty() or self.now.start is not self.bar:
                self.stack.append(self.now)
            self.now = _Condition(self.bar, Series([contact]))
        elif how == "AND":
            self.now.path.parts.append(contact)
        elif self.now.is_empty() or self.now.start is not self.bar:
            raise Undrawable
        else:
            self.now.path = Series([Parallel([*_branches(self.now.path), Series([contact])])])

    def block(self, how: str) -> None:
        """AND LD, OR LD."""
        before = self.stack.pop()
        is_branch = how == "OR" and before.start is self.now.start and not self.now.is_empty()
        if self.now.start is not self.bar and not is_branch:
            raise Undrawable
        if how == "AND" and _changes_power(self.now.path):
            raise Undrawable  # in series it would change the power of what is in front, too
        if how == "AND":
            before.path.parts += self.now.path.parts
        elif before.start is not self.now.start or before.is_empty():
            raise Undrawable
        else:
            before.path = Series([Parallel([*_branches(before.path), *_branches(self.now.path)])])
        self.now = before

    def inline(self, number: int, text: str) -> None:
        """NOT, UP, DOWN change the condition where they stand."""
        self.now.path.parts.append(Box(number, text, through=True))

    def _point(self) -> Point:
        """The point at which the execution condition is; made if there is none yet."""
        if self.now.is_empty():
            return self.now.start
        return self._made()

    def _made(self) -> Point:
        """A new point at the end of the present path, which may be empty."""
        point = Point(self.now.path)
        self.now.start.outs.append(point)
        self.before[point] = self.now.start
        self.now = _Condition(point, Series())
        return point

    def _output(self, number: int, prefix: str, mnemonic: str, operands: tuple[str, ...]) -> None:
        if mnemonic == "OUT" and operands[0].upper().startswith("TR") and operands[0][2:].isdecimal():
            self.kept[operands[0].upper()] = self._point()
        elif mnemonic in COILS:
            self._point().outs.append(Coil(number, coil_mark(prefix, mnemonic), operands))
        elif mnemonic == "FBCALL":
            block, instance, *pins = operands
            wired = {pin.output: pin.name for pin in map(_pin, pins) if pin.operand == WIRE}
            others = tuple(pin for pin in map(_pin, pins) if pin.operand != WIRE)
            self.now.path.parts.append(Box(number, block, (), (), True, instance, others,
                                           (wired.get(False, "EN"),), wired.get(True, "ENO")))
        elif mnemonic == CALL:
            block, instance, *pins = operands
            entries = tuple(pin.name for pin in map(_pin, pins) if not pin.operand)
            given = tuple(pin for pin in map(_pin, pins) if pin.operand)
            self._box(Box(number, block, (), (), False, instance, given, entries), len(entries))
        else:
            row = instruction_set().rows.get(mnemonic)
            self._box(Box(number, prefix + mnemonic, operands), row.inputs if row else 1)
            if row and row.ends_condition:
                self.now = _Condition(self.bar, Series())

    def _box(self, box: Box, count: int) -> None:
        """Add a box as an output.  If it has several inputs, these are the last blocks; all but the first of these begin at
        the bus bar, or all at the point from which power comes to the box."""
        if count < 2:
            start = self.bar if box.instance and not count else self._point()
            start.outs.append(box)
            return
        blocks = [*self.stack[len(self.stack) - count + 1:], self.now]
        if len(blocks) < count:
            raise Undrawable
        del self.stack[len(self.stack) - count + 1:]
        self.now = blocks[0]
        box.inputs = tuple(block.path for block in blocks[1:])
        if any(block.start is not self.bar for block in blocks[1:]):
            self._join_branch(blocks)
        elif any(block.is_empty() for block in blocks[1:]):
            raise Undrawable
        self._point().outs.append(box)
        self.lost = self.now.start is not self.bar

    def _join_branch(self, blocks: Sequence[_Condition]) -> None:
        """Let the lower inputs of a box begin at the point from which power comes to the box."""
        branch = blocks[1].start
        if any(block.start is not branch for block in blocks[1:]):
            raise Undrawable
        if self.now.start is branch:
            self._made()
        elif not self.now.is_empty() or self.before.get(self.now.start) is not branch:
            raise Undrawable
        for block in blocks[1:]:
            block.path.from_branch = True

    def finish(self) -> None:
        """Make a point at the end of a path that no output follows, such as a block whose ENO is not used."""
        if not self.now.is_empty():
            self._point()
        if any(point.is_joined and not Point(Series(), point.outs[-1:]).is_joined for point in self.before):
            raise Undrawable  # the lines of the lower inputs would cross what hangs on the point below the box


def _branches(path: Series) -> list[Series]:
    """The branches of a path; one branch if the path is no parallel connection."""
    if len(path.parts) == 1 and isinstance(path.parts[0], Parallel):
        return path.parts[0].branches
    return [path]


def joined(mnemonic: str) -> tuple[str, str] | None:
    """How a contact joins (LD, AND or OR), and the rest of its mnemonic; None for an instruction that is no contact."""
    for how in ("LD", "AND", "OR"):
        rest = mnemonic.removeprefix(how)
        if rest != mnemonic and (rest in ("", "NOT", "TST", "TSTN") or rest[0] in "=<>"):
            return how, rest
    return None


def drawn_contact(number: int, prefix: str, rest: str, operands: tuple[str, ...]) -> Contact:
    """The contact of an instruction: `rest` is what its mnemonic has behind LD, AND or OR."""
    if rest not in ("", "NOT"):
        return Contact(number, prefix + rest, operands)
    at_once, edge = "!" * ("!" in prefix), EDGES[prefix.replace("!", "")]
    return Contact(number, at_once + ("/" if rest else "") + edge or " ", operands)


def coil_mark(prefix: str, mnemonic: str) -> str:
    """The text between the brackets of a coil."""
    mark = COILS[mnemonic]
    return (prefix + mark.strip()) or mark


def _pin(text: str) -> Pin:
    sign = ":=" if ":=" in text else "=>"
    name, _, operand = text.partition(sign)
    return Pin(name, operand, sign == "=>")


_SINGLE: dict[str, Callable[[_Reader, int], None]] = {
    "ANDLD": lambda reader, _: reader.block("AND"), "ORLD": lambda reader, _: reader.block("OR"),
    "NOT": lambda reader, number: reader.inline(number, "NOT"), "UP": lambda reader, number: reader.inline(number, "UP"),
    "DOWN": lambda reader, number: reader.inline(number, "DOWN")}
