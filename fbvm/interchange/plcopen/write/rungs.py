"""Rungs as ladder diagrams: follows the steps of mnemonics with the stack of conditions with which they are executed.

`Power` is a condition: the outputs from which it comes, and elements behind these that have not been drawn yet.
Comparisons become blocks of the standard; other instructions become boxes of their names, which only fbvm understands.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field

from fbvm.base.areas import parse_address
from fbvm.interchange.markup import Element, element
from fbvm.interchange.plcopen.schema import LOCATION
from fbvm.interchange.plcopen.write.layout import Drawing, End, Ends, own_data
from fbvm.interchange.plcopen.write.types import NotExportable, Types
from fbvm.syntax import tree
from fbvm.syntax.ladder.drawing.diagram import WIRE
from fbvm.syntax.ladder.instructions.instruction_set import JOINS, Instruction, instruction_set
from fbvm.syntax.ladder.mnemonics import Symbol, read_rungs
from fbvm.syntax.ladder.operands import SYMBOLS, OperandError, Operands
from fbvm.syntax.ladder.symbols import is_own, number
from fbvm.syntax.tree.ladder import Ladder, Rung, Step

COILS = {"OUT": {}, "OUTNOT": {"negated": "true"}, "SET": {"storage": "set"}, "RSET": {"storage": "reset"},
         "DIFU": {"edge": "rising"}, "DIFD": {"edge": "falling"}}
EDGES = {"@": {"edge": "rising"}, "%": {"edge": "falling"}}
ALWAYS = "P_ON"
COMPARISONS = {"=": "EQ", "<>": "NE", "<": "LT", "<=": "LE", ">": "GT", ">=": "GE"}
"""Signs of comparisons, and the functions of the standard for them."""
_NUMERIC = re.compile(r"(?:SL?|[LFD])\Z")
"""What stands behind the sign of a comparison that compares numbers."""


@dataclass(eq=False)
class Contact:
    """A contact that is still to be drawn."""

    variable: str
    marks: dict[str, str]


@dataclass(eq=False)
class Test:
    """A comparison that is still to be drawn, as a block of this name with these values."""

    kind: str
    values: list[str]
    mnemonic: str


@dataclass(eq=False)
class Ways:
    """Series in parallel."""

    series: list[list[Contact | Test | Ways]]


Series = list[Contact | Test | Ways]


@dataclass
class Power:
    """A condition: `ends` are the outputs from which it comes (None: the rail), `series` the elements behind them that are not
    drawn yet; the next element goes to `column` and `row`."""

    ends: Ends | None = None
    series: Series = field(default_factory=list)
    column: int = 0
    row: int = 0


class RungWriter:
    """Draws the rungs of one body; `declared` grows by the variables that the drawing needs, by name, and `taken`, the names of
    the POU's variables in capitals, by theirs."""

    def __init__(self, drawing: Drawing, types: Types, taken: set[str]) -> None:
        self.drawing, self.types, self.taken = drawing, types, taken
        self.declared: dict[str, Element] = {}
        self.numbered = dict(types.numbered)
        """Symbols that mean timers and counters, and their numbers."""

    def ladder(self, ladder: Ladder, is_last: bool) -> None:
        """Draw LADDER .. END_LADDER.  An END at its end is left out if the LADDER `is_last` in its body: it keeps nothing from
        being executed then.  Raises NotExportable."""
        for symbol in self._symbols(ladder):
            if timer := number(symbol):
                self.numbered[symbol.name.upper()] = timer
            elif is_own(symbol):
                raise NotExportable(ladder, f"{symbol.name} is a {symbol.type.lower()} of each instance, for which other tools "
                                    "have no name", f"give it a number, as in {symbol.name},T0005,TIMER,,,,")
        for instance in ladder.instances:
            name = instance.names[0].text
            if name.upper() not in self.taken:
                self.taken.add(name.upper())
                self.declared[name] = self._declared(instance)
        for rung in ladder.rungs:
            notes = [text.lstrip("'/ ").rstrip() for _, text in rung.notes]
            if comment := "\n".join(filter(None, [rung.comment, *notes])):
                self.drawing.comment(comment)
            if rung.steps and not (is_last and rung is ladder.rungs[-1] and rung.steps[0].mnemonic == "END"):
                self._rung(rung)

    def _symbols(self, ladder: Ladder) -> Iterator[Symbol]:
        """The rows of tables of symbols between the rungs."""
        text = self.types.source.text[ladder.start:ladder.end]
        for rung in read_rungs(text, text.find("\n") + 1, text.rfind("\n") + 1, lambda *message: None):
            yield from rung.symbols

    def _declared(self, variable: tree.VarDecl) -> Element:
        """An instance of FBCALL, or a variable of a table of symbols."""
        spec, name = variable.spec, variable.names[0].text
        if isinstance(spec, tree.ArraySpec) and isinstance(spec.element, tree.NamedType):
            bounds = {"lower": "0", "upper": str(getattr(spec.dimensions[0][1], "value", 0)) if spec.dimensions[0] else "0"}
            kind = element("array", element("dimension", **bounds), element("baseType", self.types.spec(spec.element)))
        else:
            kind = self.types.spec(spec)
        made = element("variable", element("type", kind), name=name)
        if variable.location is not None:
            place = str(parse_address(variable.location.text))
            self.foreign(variable, f"the address {place} is kept as data of this program; other tools place the variable")
            made.content.append(own_data(LOCATION, place))
        return made

    def foreign(self, node: tree.Node, message: str) -> None:
        self.types.foreign.append((node, message))

    def _rung(self, rung: Rung) -> None:
        self.rail, self.start = self.drawing.rail()
        self.now: Power | None = None
        self.saved: list[Power] = []
        self.kept: dict[str, Power] = {}
        self.coils: list[End] = []
        self.columns, self.rows = 1, 0
        for step in rung.steps:
            self.step = step
            self._step(step)
        self.drawing.close(self.rail, self.coils, self.columns, self.rows)

    def _step(self, step: Step) -> None:
        row = instruction_set().rows[step.mnemonic]
        if row.ends_condition:
            raise self._not_exportable(f"block program ({step.mnemonic})")
        if join := re.fullmatch(r"(LD|AND|OR)(NOT)?", step.mnemonic):
            self._join(join[1], bool(join[2]), step)
        elif row.kind == "?":
            how = next(how for how in JOINS if step.mnemonic.startswith(how))
            self._joined(how, [self._test(step.mnemonic.removeprefix(how), step.operands)])
        elif step.mnemonic in ("ANDLD", "ORLD"):
            self._block(step.mnemonic)
        elif step.mnemonic in COILS:
            self._coil(step)
        elif step.mnemonic in _OTHERS:
            _OTHERS[step.mnemonic](self)
        else:
            self._instruction(step, row)

    def _not_exportable(self, what: str) -> NotExportable:
        return NotExportable(self.step, f"ladder of PLCopen XML has no {what}", "write that rung in Structured Text")

    @property
    def power(self) -> Power:
        assert self.now is not None
        return self.now

    # --- contacts ---

    def _join(self, how: str, negated: bool, step: Step) -> None:
        name = step.operands[0]
        if how == "LD" and name.upper() in self.kept:
            kept = self.kept[name.upper()]
            if self.now is not None:
                self.saved.append(self.now)
            self.now = Power(kept.ends, [], kept.column, self.rows)
            return
        self._joined(how, self._contact(name, negated, step.prefix.replace("!", "")))

    def _joined(self, how: str, part: Series) -> None:
        if how == "LD":
            if self.now is not None:
                self.saved.append(self.now)
            self.now = Power(None, part)
        elif how == "AND":
            self.power.series += part
        else:
            self._beside(Power(None, part))

    def _contact(self, name: str, negated: bool, edge: str) -> Series:
        if name.upper() == ALWAYS and not negated and not edge:
            return []
        marks = dict(EDGES.get(edge, {}))
        if negated:
            if edge:
                raise self._not_exportable("contact that is negated and has an edge")
            marks["negated"] = "true"
        return [Contact(self._symbol(name), marks)]

    def _test(self, mnemonic: str, operands: tuple[str, ...]) -> Test:
        kind = COMPARISONS.get(_NUMERIC.sub("", mnemonic), mnemonic)
        if kind == mnemonic:
            self.foreign(self.step, f"{mnemonic} is a comparison that other tools do not have")
        return Test(kind, [self._operand(text) for text in operands], mnemonic)

    def _symbol(self, name: str) -> str:
        """The variable of a contact or coil; an address is noted as one that other tools cannot name."""
        name = self.numbered.get(name.upper(), name)
        try:
            is_variable = _is_variable(name)
        except OperandError as wrong:
            raise NotExportable(self.step, wrong.args[0], "") from None
        if not is_variable:
            self.foreign(self.step, f"{name} is an address, for which other tools have no name; declare a variable AT it")
        return name

    def _beside(self, other: Power) -> None:
        """OR: join another condition to this one."""
        power = self.power
        if power.ends is None and other.ends is None:
            if not power.series or not other.series:
                raise self._not_exportable("wire that bridges contacts")
            known = power.series[0] if len(power.series) == 1 and isinstance(power.series[0], Ways) else None
            ways = known.series if known else [power.series]
            self.now = Power(None, [Ways([*ways, other.series])])
            return
        first = self._drawn(power)
        other.row = self.rows
        second = self._drawn(other)
        self.now = Power((*first, *second), [], max(power.column, other.column), power.row)

    def _block(self, how: str) -> None:
        second = self.power
        first = self.saved.pop()
        if how == "ORLD":
            self.now = first
            self._beside(second)
        elif second.ends is not None:
            raise self._not_exportable("AND of two places from which something else hangs")
        else:
            first.series += second.series
            self.now = first

    # --- drawing ---

    def _drawn(self, power: Power) -> Ends:
        """Draw the elements of a condition that are not drawn yet; returns the outputs from which it comes."""
        if power.ends is None:
            power.row = max(power.row, self.rows)
        ends = (self._rail_end(power.row),) if power.ends is None else power.ends
        ends, power.column, used = self._series(power.series, ends, power.column, power.row)
        self.rows = max(self.rows, power.row + used if power.series else self.rows)
        self.columns = max(self.columns, power.column + 1)
        power.ends, power.series = ends, []
        return ends

    def _rail_end(self, row: int) -> End:
        return End(self.start.id, "", self.start.x, self.drawing.y(row))

    def _series(self, series: Series, ends: Ends, column: int, row: int) -> tuple[Ends, int, int]:
        """Draw elements in series; returns the outputs at their end, the next column, and the number of rows."""
        rows = 1
        for part in series:
            if isinstance(part, Contact):
                ends = (self.drawing.symbol("contact", part.variable, ends, column, row, **part.marks),)
                column += 1
                continue
            if isinstance(part, Test):
                ends = self._tested(part, ends, column, row)
                column += 3
                rows = max(rows, 3)
                continue
            joined: list[End] = []
            widest, used = column, 0
            for way in part.series:
                start = (self._rail_end(row + used),) if ends[0].id == self.start.id else ends
                outs, end_column, taken = self._series(way, start, column, row + used)
                joined += outs
                widest, used = max(widest, end_column), used + taken
            ends, column, rows = tuple(joined), widest, max(rows, used)
        return ends, column, rows

    def _tested(self, part: Test, ends: Ends, column: int, row: int) -> Ends:
        """Draw a comparison as a block of the standard, and an AND with the condition before it."""
        inputs: list[tuple[str, Ends | str]] = [(f"IN{at}", value) for at, value in enumerate(part.values, 1)]
        made = self.drawing.block(part.kind, "", inputs, [("OUT", "")], column + 1, row + 1, part.mnemonic)
        if ends[0].id == self.start.id:
            return (made["OUT"],)
        both: list[tuple[str, Ends | str]] = [("IN1", ends), ("IN2", (made["OUT"],))]
        return (self.drawing.block("AND", "", both, [("OUT", "")], column + 2, row)["OUT"],)

    def _output(self) -> tuple[Ends, int, int]:
        """Draw the saved conditions in their order, then the present one; returns its outputs, and the column and row for what it
        goes to."""
        for saved in self.saved:
            if saved.series:
                self._drawn(saved)
        power = self.power
        ends = self._drawn(power)
        row = power.row
        power.row = self.rows = max(self.rows, row + 1)
        return ends, power.column, row

    def _coil(self, step: Step) -> None:
        name = step.operands[0]
        if re.fullmatch(r"(?i)TR\d+", name):
            power = self.power
            self._drawn(power)
            self.kept[name.upper()] = Power(power.ends, [], power.column, power.row)
            return
        marks = {**COILS[step.mnemonic], **EDGES.get(step.prefix.replace("!", ""), {})}
        self._draw_coil(self._symbol(name), marks)

    def _draw_coil(self, name: str, marks: dict[str, str]) -> None:
        ends, column, row = self._output()
        self.coils.append(self.drawing.symbol("coil", name, ends, column, row, **marks))

    # --- others ---

    def _nothing(self) -> None:
        """NOP."""

    def _keep(self) -> None:
        """KEEP: a coil that sets, and behind it one that resets, which therefore wins."""
        name = self._symbol(self.step.operands[0])
        reset, set_ = self.power, self.saved.pop()
        if name.upper() in {c.variable.upper() for c in _contacts(reset.series)} or reset.ends is not None:
            raise self._not_exportable("KEEP whose reset asks for its own bit")
        self.now = set_
        self._draw_coil(name, COILS["SET"])
        self.now = Power(None, reset.series, 0, self.rows)
        self._draw_coil(name, COILS["RSET"])

    def _function(self, kind: str, pin: str, output: str, instance: str = "") -> None:
        """Draw a block that the power goes through."""
        ends, column, row = self._output()
        made = self.drawing.block(kind, instance, [(pin, ends)], [(output, "")], column, row, kind if kind == "NOT" else "")
        self.now = Power((made[output],), [], column + 1, row)

    def _refuse(self) -> None:
        raise self._not_exportable(self.step.mnemonic)

    def _up(self) -> None:
        """UP: an R_TRIG that the power goes through.  DOWN is refused: F_TRIG also has an edge in its first call."""
        last = 1
        while (name := f"Edge{last}").upper() in self.taken or re.search(rf"(?i)\b{name}\b", self.types.source.text):
            last += 1
        self.taken.add(name.upper())
        self.declared[name] = element("variable", element("type", element("derived", name="R_TRIG")), name=name)
        self._function("R_TRIG", "CLK", "Q", name)

    def _instruction(self, step: Step, row: Instruction) -> None:
        """Draw an instruction of Omron's as a box of its name: conditions, then operands as they are written."""
        self.foreign(step, f"{step.mnemonic} is an instruction that other tools do not have")
        inputs: list[tuple[str, Ends | str]] = []
        column = place = 0
        if row.inputs:
            powers = [*[self.saved.pop() for _ in range(row.inputs - 1)][::-1], self.power]
            if any(power.ends is not None for power in powers[1:]):
                raise self._not_exportable(f"{step.mnemonic} of which two inputs begin at a branch point")
            for power in powers[:-1]:
                self._drawn(power)
                self.rows += 1
            _, column, place = self._output()
            inputs = [(f"C{at}" if at > 1 else "EN", power.ends or ()) for at, power in enumerate(powers, 1)]
        else:
            place = self.rows
        inputs += [(f"OP{at}", self.numbered.get(text.upper(), text)) for at, text in enumerate(step.operands, 1)]
        self.drawing.block(step.mnemonic, "", inputs, [("ENO", "")], column + 1, place, step.prefix + step.mnemonic)
        self.rows = max(self.rows, place + len(inputs) // 2 + 1)
        if row.inputs:
            self.power.row = self.rows
        self.columns = max(self.columns, column + 3)

    def _call(self) -> None:
        kind, instance, *pins = self.step.operands
        ends, column, row = self._output()
        parts = [re.split(r"(:=|=>)", pin, maxsplit=1) for pin in pins]
        wired = {sign: name for name, sign, text in parts if text == WIRE}
        inputs: list[tuple[str, Ends | str]] = [(wired.get(":=", "EN"), ends)]
        leaving = wired.get("=>", "ENO")
        outputs = [(leaving, "")]
        for name, sign, text in (part for part in parts if part[2] != WIRE):
            if sign == ":=":
                inputs.append((name, self._operand(text)))
            else:
                outputs.append((name, self._operand(text)))
        made = self.drawing.block(kind, instance, inputs, outputs, column + 1, row)
        self.rows = max(self.rows, row + len(inputs) // 2 + 1)
        self.columns = max(self.columns, column + 4)
        below = self.rows if len(outputs) > 1 else row
        self.now = Power((made[leaving],), [], column + 3, below)

    def _operand(self, text: str) -> str:
        """An operand at a pin, in Structured Text."""
        text = self.numbered.get(text.upper(), text)
        if text.upper() in ("P_ON", "P_OFF"):
            return "TRUE" if text.upper() == "P_ON" else "FALSE"
        if re.fullmatch(r"&\d+", text):
            return text[1:]
        if re.fullmatch(r"#[0-9A-Fa-f]+", text):
            return f"16#{text[1:]}"
        if re.fullmatch(r"[+-][\d.]+", text):
            return text.lstrip("+")
        if text[0] in "'\"" or "#" in text or text.upper() in ("TRUE", "FALSE"):
            return text
        try:
            is_variable = _is_variable(text)
        except OperandError:
            is_variable = False
        if not is_variable:
            self.foreign(self.step, f"{text} is an address, for which other tools have no name; declare a variable AT it")
        return text


def _is_variable(text: str) -> bool:
    """Whether an operand names a variable: D100 is an address, also where a variable is called so.  Raises OperandError."""
    meant = Operands().expression(text, "b", 0, 0)
    return isinstance(meant, tree.NameRef | tree.Member | tree.Index) and text.upper() not in SYMBOLS


def _contacts(series: Series) -> list[Contact]:
    found: list[Contact] = []
    for part in series:
        if isinstance(part, Ways):
            found += [contact for way in part.series for contact in _contacts(way)]
        elif isinstance(part, Contact):
            found.append(part)
    return found


_OTHERS: dict[str, Callable[[RungWriter], None]] = {
    "NOP": RungWriter._nothing, "KEEP": RungWriter._keep, "FBCALL": RungWriter._call,
    "NOT": lambda writer: writer._function("NOT", "IN", "OUT"), "UP": RungWriter._up,
    "DOWN": lambda writer: writer._refuse(),
}
