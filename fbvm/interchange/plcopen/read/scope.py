"""The names in a diagram: types of variables and results, which memory a name stands for, and which names are free.

Only as much as the import needs to keep a value in a variable; the program is checked later.
"""

from __future__ import annotations

import re
from functools import cache
from pathlib import Path

from fbvm.base.data import data_folder
from fbvm.base.diagnostics import Source
from fbvm.base.types import SHORT_NAMES
from fbvm.check.calls.functions import OPERATORS, SIGNATURES, TIME_OPERATORS, conversion, typed_name
from fbvm.interchange.plcopen.read.diagram import Object, Wire
from fbvm.interchange.plcopen.read.document import Document, Pou
from fbvm.syntax import tree
from fbvm.syntax.ladder.operands import OperandError, Operands
from fbvm.syntax.parser import parse
from fbvm.syntax.text import read

SHARED = "%"
"""The root of all that other POUs may write: located, global and referenced variables."""
COMPARISONS = ("GT", "GE", "EQ", "LE", "LT", "NE")
_ROOT = re.compile(r"[^\W\d]\w*")
_WORDS = re.compile(r"'[^']*'|\"[^\"]*\"|[A-Za-z]+#\S*|%[\w.]+|(?<![\w.%])[^\W\d]\w*")
_OPERATORS = {"TRUE", "FALSE", "AND", "OR", "NOT", "XOR", "MOD"}
_DEEP = 12
"""Most blocks through which the type of a wire is followed upwards."""


class Scope:
    """The names of one POU of a document."""

    def __init__(self, document: Document, pou: Pou) -> None:
        self.document, self.pou = document, pou
        self.pous = document.pous_by_name
        self.own = {variable.name.upper(): (listed.kind, variable) for listed in pou.lists for variable in listed.variables}
        self.taken = {*self.own, *(name.upper() for name, _ in (*pou.actions, *pou.transitions))}
        """The names of this POU alone, in capitals; those of the document are taken, too."""
        self._numbers: dict[str, int] = {}
        self.made: dict[tuple[str, str], list[str]] = {}
        """Variables that the import adds: (section, type) -> names."""

    def new(self, stem: str, kind: str, keeps: bool) -> str:
        """Declare a variable of the type `kind`; returns its name, `stem` or `stem_2` and so on.  With `keeps`, its value lasts
        to the next pass."""
        name = stem
        while self.is_taken(name):
            self._numbers[stem] = number = self._numbers.get(stem, 1) + 1
            name = f"{stem}_{number}"
        self.declare(name, kind, "VAR" if keeps or self.is_function else "VAR_TEMP")
        return name

    def declare(self, name: str, kind: str, section: str = "VAR") -> None:
        """Declare a variable under a name that is not taken."""
        self.taken.add(name.upper())
        self.made.setdefault((section, kind), []).append(name)

    def is_block(self, kind: str) -> bool:
        """Whether a type is a function block of the document or of a library."""
        pou = self.pous.get(kind.upper())
        return pou.kind == "FUNCTION_BLOCK" if pou else bool(_library_pins(kind.upper()))

    def is_taken(self, name: str) -> bool:
        """Whether the POU or the document declares a name."""
        word = name.upper()
        return word in self.taken or word in self.pous or word in self.document.globals_by_name

    @property
    def is_function(self) -> bool:
        """Whether the POU is a function, in which nothing lasts from one call to the next."""
        return self.pou.kind == "FUNCTION"

    def roots(self, expression: str) -> frozenset[str]:
        """The roots of the variables that an expression of Structured Text reads."""
        found = set()
        for match in _WORDS.finditer(expression):
            word = match[0]
            if word[0] == "%":
                found.add(SHARED)
            elif word[0] not in "'\"" and "#" not in word and word.upper() not in _OPERATORS:
                found.add(self.root(word))
        return frozenset(found)

    def key(self, name: str) -> str:
        """What variable a name stands for: its folded name, or its address, so that two names of one place are one."""
        match = _ROOT.match(name)
        if not match:
            return name.upper()
        word = match[0].upper()
        kind, variable = self.own.get(word, ("", None))
        if variable is None or kind == "VAR_EXTERNAL":
            variable = self.document.globals_by_name.get(word, variable)
        return variable.address.upper() if variable and variable.address else word

    def keys(self, expression: str) -> frozenset[str]:
        """The variables that an expression of Structured Text reads (`key`)."""
        words = (match[0] for match in _WORDS.finditer(expression))
        return frozenset(self.key(word) for word in words
                         if word[0] == "%" or word[0] not in "'\"" and "#" not in word and word.upper() not in _OPERATORS)

    def shared(self, block: str) -> frozenset[str]:
        """The variables outside of it that a block of the document may read and write: globals and addresses."""
        found: set[str] = set()
        seen: set[str] = set()
        todo = [block.upper()]
        while todo:
            pou = self.pous.get(todo.pop())
            if pou is None or pou.name.upper() in seen:
                continue
            seen.add(pou.name.upper())
            for listed in pou.lists:
                for variable in listed.variables:
                    if listed.kind == "VAR_EXTERNAL" or variable.address:
                        known = self.document.globals_by_name.get(variable.name.upper(), variable)
                        found.add((known.address or known.name).upper())
                    todo.append(variable.type.upper())
        return frozenset(found)

    def bit(self, text: str) -> str:
        """The bit that an operand of a rung names, in Structured Text: an address such as W0.00 gets a `%`."""
        if self.declares(text):
            return text
        try:
            meant = Operands().expression(text, "b", 0, 0)
        except OperandError:
            return text
        return meant.text if isinstance(meant, tree.Direct) else text

    def names_action(self, text: str) -> bool:
        """Whether a dotted name ends in an action of a block, as far as the document shows; True if it does not show that."""
        *path, last = text.split(".")
        kind = self.type_of(path[0]) if path else ""
        for part in path[1:]:
            kind = self.output_type(kind, part)
        pou = self.pous.get(kind.upper())
        return pou is None or pou.variable(last) is None

    def declares(self, expression: str) -> bool:
        """Whether the name with which a text begins is declared."""
        match = _ROOT.match(expression)
        return match is not None and self.is_taken(match[0])

    def root(self, name: str) -> str:
        """The root of a variable: its folded name if only this POU can write it, else SHARED."""
        match = _ROOT.match(name)
        if not match:
            return SHARED
        word = match[0].upper()
        kind, variable = self.own.get(word, ("", None))
        if variable is None:
            return word if self.is_taken(word) and word not in self.pous else SHARED
        alone = kind in ("VAR", "VAR_TEMP", "VAR_INPUT", "VAR_OUTPUT") and not variable.address
        return word if alone and "POINTER" not in variable.type and "REF" not in variable.type else SHARED

    # --- types ---

    def type_of(self, expression: str) -> str:
        """The type of an expression that is the name of a variable or a literal; "" for another expression."""
        expression = expression.strip()
        if expression.upper() in ("TRUE", "FALSE"):
            return "BOOL"
        first, *rest = re.split(r"[.]", expression)
        _, found = self.own.get(first.strip().upper(), ("", None))
        if found is None:
            found = self.document.globals_by_name.get(first.upper())
        if found is None and not rest and self.is_function and first.upper() == self.pou.name.upper():
            return self.pou.result
        if found is not None and not rest:
            return found.type
        if found is not None and len(rest) == 1:
            return self.output_type(found.type, rest[0])
        typed = re.match(r"(?i)(BOOL|[SUL]*INT|[UD]+INT|L?REAL|BYTE|[DL]?WORD|TIME|T|LTIME|DATE|D|TOD|DT|STRING)#", expression)
        if typed:
            word = typed[1].upper()
            return {"T": "TIME", "D": "DATE"}.get(word, word)
        return ""

    def output_type(self, block: str, pin: str) -> str:
        """The type of a pin of a block, of this document or of a library; "" if it is not known."""
        other = self.pous.get(block.upper())
        if other is not None:
            variable = other.variable(pin)
            return variable.type if variable else ""
        return _library_pins(block.upper()).get(pin.upper(), "")

    def wire_type(self, wire: Wire, depth: int = 0) -> str:
        """The type of the value on a wire; "" if it is not known."""
        item = wire.source
        if depth > _DEEP:
            return ""
        if item.kind in ("leftPowerRail", "contact", "jump", "return"):
            return "BOOL"
        if item.kind in ("inVariable", "inOutVariable"):
            return "BOOL" if item.negated and not self.type_of(item.text) else self.type_of(item.text)
        if item.kind != "block":
            return ""
        if wire.pin.upper() == "ENO":
            return "BOOL"
        if item.instance:
            return self.output_type(item.text, wire.pin)
        return self._function_type(item, wire.pin, depth)

    def _function_type(self, item: Object, pin: str, depth: int) -> str:
        """The type of an output of a function."""
        name = item.text.upper()
        other = self.pous.get(name)
        if other is not None:
            variable = other.variable(pin)
            return variable.type if variable else other.result
        return _standard_type(name) or self._operand_type(item, depth)

    def has_type_of_operands(self, item: Object) -> bool:
        """Whether an object is a standard function whose result has the type of its operands."""
        name = item.text.upper()
        is_standard = name in SIGNATURES or name in OPERATORS
        return is_standard and not item.instance and name not in self.pous and not _standard_type(name)

    def _operand_type(self, item: Object, depth: int) -> str:
        """The type of the result of a standard function whose result has the type of its operands."""
        name = item.text.upper()
        if name not in SIGNATURES and name not in OPERATORS:
            return ""
        for data in (pin for pin in item.inputs if pin.name.upper() not in _NO_OPERANDS):
            found = self.type_of(data.expression) if data.expression else ""
            for wire in data.wires:
                found = found or self.wire_type(wire, depth + 1)
            if found:
                is_moment = name == "SUB" and _whole(found) in _MOMENTS
                return "TIME" if is_moment and self._is_difference(item, found, depth) else found
        return ""

    def _is_difference(self, item: Object, kind: str, depth: int) -> bool:
        """Whether SUB has two moments of a type as its operands: their difference is a duration."""
        behind = [pin for pin in item.inputs if pin.name.upper() not in _NO_OPERANDS][1:]
        return any(_whole(self.type_of(pin.expression) if pin.expression else "") == _whole(kind)
                   or any(_whole(self.wire_type(wire, depth + 1)) == _whole(kind) for wire in pin.wires) for pin in behind)


def _whole(kind: str) -> str:
    """The long name of a type: DATE_AND_TIME for DT."""
    return SHORT_NAMES.get(kind.upper(), kind.upper())


_MOMENTS = ("DATE_AND_TIME", "DATE", "TIME_OF_DAY")
_NO_OPERANDS = {"EN", "G", "K", "N", "L", "P"}
"""Inputs of standard functions whose type says nothing about that of the result."""


def _standard_type(name: str) -> str:
    """The type of the result of a standard function by its name; "" if that depends on the operands."""
    row = SIGNATURES.get(name)
    if name in COMPARISONS:
        return "BOOL"
    if row is not None and row.result not in ("T", ""):
        return row.result
    if (change := conversion(name)) is not None:
        return change.target
    if name in TIME_OPERATORS:
        function, (left, right) = TIME_OPERATORS[name]
        return ("LTIME" if left.startswith("L") else "TIME") if function == "SUB" and left == right else left
    if (typed := typed_name(name)) is not None:
        return name.removeprefix(f"{typed[0]}_") if typed[0] not in COMPARISONS else "BOOL"
    return ""


@cache
def _library_files() -> dict[str, Path]:
    return {path.stem.upper(): path for path in sorted(data_folder("fblib").rglob("*.st"), reverse=True)}


@cache
def library_block(block: str) -> tuple[Source, tree.Pou] | None:
    """The declaration of a library's block, whose name is given in capitals."""
    path = _library_files().get(block)
    source = read(path, path.name) if path else None
    if not isinstance(source, Source):
        return None
    declared = (d for d in parse(source)[0].declarations if isinstance(d, tree.Pou) and d.name.text.upper() == block)
    return next(((source, pou) for pou in declared), None)


@cache
def _library_pins(block: str) -> dict[str, str]:
    """Types of the pins of a library's block, by name in capitals."""
    found = library_block(block)
    return {} if found is None else {
        name.text.upper(): found[0].text[variable.spec.start:variable.spec.end] for section in found[1].sections
        if section.kind in ("VAR_INPUT", "VAR_OUTPUT", "VAR_IN_OUT") for variable in section.variables for name in variable.names}
