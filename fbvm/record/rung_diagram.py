"""Steps of a rung to what is drawn: contacts in series and in parallel, branch points, coils and boxes."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field

from fbvm.code.image import RungPicture


class Undrawable(Exception):
    """The steps can be executed and have no drawing, as an OR behind an output."""


@dataclass(eq=False)
class Contact:
    """A contact: `mark` is what stands between its two strokes."""

    step: int
    mark: str
    label: str


@dataclass(eq=False)
class Box:
    """What is drawn as a box; `inputs` are the conditions below the first one.  One with `through` lets power on."""

    step: int
    lines: tuple[str, ...]
    inputs: tuple[Series, ...] = ()
    through: bool = False


@dataclass(eq=False)
class Coil:
    step: int
    mark: str
    label: str


@dataclass(eq=False)
class Series:
    parts: list[Contact | Box | Parallel] = field(default_factory=list)


@dataclass(eq=False)
class Parallel:
    branches: list[Series]


@dataclass(eq=False)
class Point:
    """A place behind a series from which power goes on to outputs and to other points; the first one is the bus bar."""

    path: Series
    outs: list[Coil | Box | Point] = field(default_factory=list)


@dataclass
class _Condition:
    start: Point
    path: Series

    def is_empty(self) -> bool:
        return not self.path.parts


def diagram(picture: RungPicture) -> Point:
    """The bus bar of a rung with all that hangs on it.  Raises Undrawable."""
    reader = _Reader()
    for number, (_, prefix, mnemonic, operands) in enumerate(picture.steps):
        reader.step(number, prefix.replace("!", ""), mnemonic, operands)
    reader.finish()
    return reader.bar


class _Reader:
    """Follows the steps with a stack, as those do who execute them."""

    def __init__(self) -> None:
        self.bar = Point(Series())
        self.now = _Condition(self.bar, Series())
        self.stack: list[_Condition] = []
        self.kept: dict[str, Point] = {}

    def step(self, number: int, prefix: str, mnemonic: str, operands: tuple[str, ...]) -> None:
        if operands and operands[0].upper() in self.kept and mnemonic == "LD":
            self.now = _Condition(self.kept[operands[0].upper()], Series())
            return
        join = _joined(mnemonic)
        if join is not None and (operands or join[1]):
            self._join(join[0], _contact(number, prefix, join[1], operands))
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
        elif self.now.is_empty():
            raise Undrawable
        else:
            self.now.path = Series([Parallel([*_branches(self.now.path), Series([contact])])])

    def block(self, how: str) -> None:
        """AND LD, OR LD."""
        before = self.stack.pop()
        if self.now.start is not self.bar:
            raise Undrawable
        if how == "AND":
            before.path.parts += self.now.path.parts
        elif before.start is not self.bar or before.is_empty():
            raise Undrawable
        else:
            before.path = Series([Parallel([*_branches(before.path), *_branches(self.now.path)])])
        self.now = before

    def inline(self, number: int, text: str) -> None:
        """NOT, UP, DOWN change the condition where they stand."""
        self.now.path.parts.append(Box(number, (text,), through=True))

    def _point(self) -> Point:
        """The point at which the condition is now; made if there is none."""
        if self.now.is_empty():
            return self.now.start
        point = Point(self.now.path)
        self.now.start.outs.append(point)
        self.now = _Condition(point, Series())
        return point

    def _output(self, number: int, prefix: str, mnemonic: str, operands: tuple[str, ...]) -> None:
        name = prefix + mnemonic
        if mnemonic == "OUT" and operands[0].upper().startswith("TR") and operands[0][2:].isdigit():
            self.kept[operands[0].upper()] = self._point()
        elif mnemonic in _COILS:
            mark = _COILS[mnemonic] if not prefix else name
            self._point().outs.append(Coil(number, mark, operands[0]))
        elif mnemonic == "FBCALL":
            self.now.path.parts.append(Box(number, (f"{operands[1]} : {operands[0]}", *operands[2:]), through=True))
        elif mnemonic in _INPUTS:
            self._with_inputs(number, name, operands, _INPUTS[mnemonic])
        else:
            self._point().outs.append(Box(number, (name, *operands)))

    def _with_inputs(self, number: int, name: str, operands: tuple[str, ...], count: int) -> None:
        """A box with several inputs: the last blocks; all but the first begin at the bus bar."""
        blocks = [*self.stack[len(self.stack) - count + 1:], self.now]
        if len(blocks) < count or any(block.start is not self.bar for block in blocks[1:]):
            raise Undrawable
        del self.stack[len(self.stack) - count + 1:]
        self.now = blocks[0]
        self._point().outs.append(Box(number, (name, *operands), tuple(block.path for block in blocks[1:])))
        if self.now.start is self.bar:
            self.now = _Condition(self.bar, Series())

    def finish(self) -> None:
        """A path behind which nothing stands, as a block whose ENO nobody uses, goes on to the end."""
        if not self.now.is_empty():
            self._point()


def _branches(path: Series) -> list[Series]:
    """A path as branches of a parallel connection: one that is nothing else is taken apart."""
    if len(path.parts) == 1 and isinstance(path.parts[0], Parallel):
        return path.parts[0].branches
    return [path]


def _joined(mnemonic: str) -> tuple[str, str] | None:
    """How a mnemonic of a contact joins, and what is behind LD, AND, OR in it; None for all others."""
    for how in ("LD", "AND", "OR"):
        rest = mnemonic.removeprefix(how)
        if rest != mnemonic and (rest in ("", "NOT", "TST", "TSTN") or rest[0] in "=<>"):
            return how, rest
    return None


def _contact(number: int, prefix: str, rest: str, operands: tuple[str, ...]) -> Contact:
    if rest in ("", "NOT"):
        edge = {"": "", "@": "↑", "%": "↓"}[prefix]
        return Contact(number, ("/" if rest else "") + edge or " ", operands[0])
    return Contact(number, rest, " ".join(operands))


_COILS = {"OUT": " ", "OUTNOT": "/", "SET": "S", "RSET": "R", "DIFU": "↑", "DIFD": "↓"}
_INPUTS = {"KEEP": 2, "CNT": 2, "CNTX": 2, "TTIM": 2, "TTIMX": 2, "CNTR": 3, "CNTRX": 3, "SFT": 3}
_SINGLE: dict[str, Callable[[_Reader, int], None]] = {
    "ANDLD": lambda reader, _: reader.block("AND"), "ORLD": lambda reader, _: reader.block("OR"),
    "NOT": lambda reader, number: reader.inline(number, "NOT"), "UP": lambda reader, number: reader.inline(number, "UP"),
    "DOWN": lambda reader, number: reader.inline(number, "DOWN")}
