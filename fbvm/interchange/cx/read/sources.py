"""A PLC of a project as source files: global symbols, function blocks, programs, and which programs run."""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator

from fbvm.base.digits import whole_number
from fbvm.interchange.cx.markup import Row
from fbvm.interchange.cx.read.memory import initial_values
from fbvm.interchange.cx.read.places import Origin
from fbvm.interchange.cx.read.project import CYCLIC, LADDER_SECTION, BlockVariable, FunctionBlock, Plc, Program, Reading
from fbvm.interchange.cx.read.rungs import RungLines
from fbvm.interchange.cx.read.symbols import BLOCK, Symbol, SymbolError, location, spelling
from fbvm.interchange.source_files import SourceFiles

GLOBALS, MEMORY, CONFIGURATION = "globals", "memory", "configuration"
"""Names of the files for global symbols, for initial values, and for what runs."""
_USAGES = {"0": "VAR", "1": "VAR_INPUT", "2": "VAR_OUTPUT"}
_TYPES = {"0": "BOOL", "1": "INT", "2": "UINT", "3": "DINT", "4": "UDINT", "5": "LINT", "6": "ULINT", "7": "WORD", "8": "DWORD",
          "9": "LWORD", "10": "REAL", "11": "LREAL"}  # fmt: skip
"""Numbers in the rows of a function block's variables -> types."""
_VALUES = {"BOOL": "TRUE|FALSE", **dict.fromkeys(("REAL", "LREAL"), r"[+-]?\d+(\.\d+)?")}
"""Patterns of initial values; the other types have whole numbers."""
TIMER, COUNTER = "13", "14"
_SWITCH = re.compile(r"[!@%]?(?:TKON|TKOF)\b|\S+ TK\d+$", re.I)
"""An instruction that starts or stops a task, or reads the flag of one."""
_ASKS_FOR = ("EN", "ENO")


def sources(reading: Reading, plc: Plc, memory: bool) -> tuple[dict[str, str], dict[str, Origin]]:
    """Texts, and what they were made of, by the names of their files; with `memory` also the initial values of memory."""
    made = _Sources(reading, plc)
    return made.texts(memory), made.origins


class _Sources:
    def __init__(self, reading: Reading, plc: Plc) -> None:
        self.reading, self.plc = reading, plc
        self.files = SourceFiles()
        self.origins: dict[str, Origin] = {}
        self.blocks = {block.name.casefold(): block for block in plc.blocks}
        taken = {symbol.own.casefold() for symbol in plc.symbols}
        self.names: dict[int, str] = {}
        """By identity of a function block or program, its name in the sources."""
        self._switches_tasks = any(_SWITCH.match(line) for program in plc.programs for section in program.sections
                                   for rung in section.rungs for line in rung.lines)  # fmt: skip
        """Whether instructions start and stop tasks, or read the flags of tasks."""
        pous: list[FunctionBlock | Program] = [*plc.blocks, *plc.programs]
        for pou in pous:
            name = free = spelling(pou.name)
            number = 1
            while free.casefold() in taken:
                number += 1
                free = f"{name}_{number}"
            taken.add(free.casefold())
            self.names[id(pou)] = free

    def texts(self, memory: bool) -> dict[str, str]:
        """Texts by the names of their files."""
        plc = self.plc
        if lines := self._declarations(plc.symbols, "VAR_GLOBAL", "global symbols"):
            file = self.files.add(GLOBALS, [f"// Symbols of {plc.name}{f', {plc.device}' if plc.device else ''}", *lines])
            self.origins[file] = Origin("global symbols", _rows_by_name(plc.symbols))
        if memory and (lines := initial_values(plc.memory)):
            self.files.add(MEMORY, lines)
        for block in plc.blocks:
            self._block(block)
        for program in plc.programs:
            self._program(program)
        self._configuration()
        return self.files.texts()

    # --- symbols ---

    def _declarations(self, symbols: Iterable[Symbol], kind: str, where: str) -> list[str]:
        """The sections that declare symbols; constants have one of their own."""
        parts: dict[str, list[str]] = {}
        for symbol in symbols:
            if not symbol.name or symbol.is_numbered:
                continue
            head = f"{kind} CONSTANT" if symbol.is_constant else kind
            note = f" // {symbol.comment}" if symbol.comment else ""
            try:
                declared = symbol.declared(self._block_of(symbol)) + note
            except SymbolError as error:
                self.reading.report("X0203", symbol.row.start,
                                    f"{where}: symbol {symbol.name} is not taken over: {error.args[0]}")
                continue
            parts.setdefault(head, []).append(declared)
            if symbol.own != symbol.name:
                self.reading.report("X0190", symbol.row.start, f"{where}: the symbol {symbol.name} is called {symbol.own} here, "
                                    "as its name is no name of Structured Text, or stands twice")
        return [line for head, lines in parts.items() for line in (head, *lines, "END_VAR", "")]

    def _block_of(self, symbol: Symbol) -> str:
        """What the sources call the function block of an instance; "" for what is none.  Raises SymbolError."""
        if symbol.type != BLOCK:
            return ""
        block = self.blocks.get(symbol.block.casefold())
        if block is None:
            raise SymbolError(f"there is no definition of the function block {symbol.block}")
        return self.names[id(block)]

    def _rows(self, symbols: Iterable[Symbol], named: bool) -> Iterator[str]:
        """Rows of a table for what no declaration says: timers and counters, and comments of addresses."""
        for symbol in symbols:
            if symbol.is_numbered and symbol.name:
                yield f'{symbol.own},{symbol.address},{symbol.type},,,,"{symbol.comment}";'
            elif not symbol.name and not named and symbol.address:
                yield f',{symbol.address},{symbol.type},,,,"{symbol.comment}";'

    def _definition(self, local: Iterable[Symbol]) -> dict[str, tuple[str, FunctionBlock]]:
        """By name of an instance, its function block."""
        return {symbol.name.casefold(): (self.names[id(found)], found) for symbol in (*self.plc.symbols, *local)
                if symbol.type == BLOCK and (found := self.blocks.get(symbol.block.casefold()))}

    # --- programs ---

    def _program(self, program: Program) -> None:
        reading, name = self.reading, self.names[id(program)]
        if program.protected:
            reading.report("X0203", program.value,
                           f"program {program.name}: the program is protected by a password and is not taken over")
            return
        reading.where = f"program {program.name}"
        sections = []
        for section in program.sections:
            if section.kind in ("", LADDER_SECTION):
                sections.append(section)
            else:
                reading.report("X0203", section.value, f"section {section.name} is not taken over: it is no ladder "
                               f"(IEC1131Type {section.kind}); how SFC and ST are stored is not known")
        symbols = {symbol.name.casefold(): symbol for symbol in (*self.plc.symbols, *program.symbols) if symbol.name}
        rungs = RungLines(reading, symbols, _Definitions(self._definition(program.symbols)))
        is_first = program is self.plc.programs[0]
        body = list(rungs.sections(sections))
        called = {line.split()[2] for line in body if line.startswith("FBCALL")} - {symbol.own for symbol in program.symbols}
        outside = [f"{symbol.own} : {self._block_of(symbol)};" for symbol in self.plc.symbols
                   if symbol.type == BLOCK and symbol.own in called]
        lines = [f"// {' '.join(program.comment.split())}"] if program.comment else []
        lines += [f"PROGRAM {name}", *(["VAR_EXTERNAL", *outside, "END_VAR"] if outside else []),
                  *self._declarations(program.symbols, "VAR", f"program {program.name}"), *self._gate(program), "LADDER"]
        lines += self._rows((*self.plc.symbols, *program.symbols) if is_first else program.symbols, named=False)
        if not is_first:
            lines += self._rows(self.plc.symbols, named=True)
        file = self.files.add(name, [*lines, *body, "END_LADDER", "END_PROGRAM"])
        rows = _rows_by_name((*self.plc.symbols, *program.symbols))
        self.origins[file] = Origin(f"program {program.name}", rows, tuple(sections), (), program.value.start)
        reading.where = ""

    def _gate(self, program: Program) -> list[str]:
        """What a program of a cyclic task begins with where instructions start and stop tasks."""
        if not self._switches_tasks or program.task is None or program.task not in CYCLIC:
            return []
        return [f"IF NOT CX_Task({program.task - CYCLIC.start}, {str(program.starts).upper()}) THEN", "RETURN;", "END_IF;"]

    def _configuration(self) -> None:
        """Which programs run: cyclic tasks in the order of their numbers."""
        if setup := self.plc.value.get("PLC", "Settings", "Data"):
            self.reading.report("X0190", setup, "the PLC Setup (cycle time, startup mode) is not read: how it is stored is "
                                "not known", "say the cycle time with --cycle")
        programs = [program for program in self.plc.programs if not program.protected]
        any_starts = any(program.starts for program in programs)
        run = []
        for program in programs:
            why = self._why_not(program, any_starts)
            if why:
                self.reading.report("X0190", program.value, f"program {program.name} does not run: {why}")
            else:
                run.append(program)
        if not run:
            return
        lines = ["CONFIGURATION Project", f"RESOURCE {spelling(self.plc.name)} ON PLC"]
        for program in sorted(run, key=lambda one: one.task or 0):
            lines.append(f"PROGRAM {self.names[id(program)]} : {self.names[id(program)]};")
        self.files.add(CONFIGURATION, [*lines, "END_RESOURCE", "END_CONFIGURATION"])

    def _why_not(self, program: Program, any_starts: bool) -> str:
        if program.task is None:
            return ""
        if program.task < 0:
            return "it is given to no task"
        if program.task not in CYCLIC:
            return f"it belongs to interrupt task {program.task}, and interrupts are not emulated"
        return "" if program.starts or self._switches_tasks or not any_starts else "its task does not run from the start"

    # --- function blocks ---

    def _block(self, block: FunctionBlock) -> None:
        reading, name = self.reading, self.names[id(block)]
        if block.protected or block.kind not in ("", "FBLadder"):
            why = "it is protected by a password" if block.protected else f"its body is no ladder ({block.kind})"
            reading.report("X0203", block.value, f"function block {block.name}: the function block is not taken over: {why}")
            return
        reading.where = f"function block {block.name}"
        parts: dict[str, list[str]] = {}
        rows = []
        for variable in block.variables:
            try:
                rows += self._variable(variable, parts)
            except SymbolError as error:
                reading.report("X0203", block.value, f"variable {variable.name} is not taken over: {error.args[0]}")
        known = {variable.name.casefold(): spelling(variable.name) for variable in block.variables}
        rungs = RungLines(reading, {}, _Definitions({}))
        body = list(rungs.rungs(block.rungs))
        words = {word.upper() for line in body if not line.startswith(("RUNG", "'")) for word in re.findall(r"\w+", line)}
        for pin, head in zip(_ASKS_FOR, ("VAR_INPUT", "VAR_OUTPUT"), strict=True):
            if pin in words and pin.casefold() not in known:
                parts.setdefault(head, []).insert(0, f"{pin} : BOOL{' := TRUE' if pin == 'EN' else ''};")
        lines = [f"// {' '.join(block.comment.split())}"] if block.comment else []
        lines.append(f"FUNCTION_BLOCK {name}")
        lines += [line for head, inner in parts.items() for line in (head, *inner, "END_VAR")]
        file = self.files.add(name, [*lines, "LADDER", *rows, *body, "END_LADDER", "END_FUNCTION_BLOCK"])
        declared = {spelling(variable.name).casefold(): variable.row for variable in block.variables}
        self.origins[file] = Origin(f"function block {block.name}", declared, (), block.rungs, block.value.start)
        reading.where = ""

    def _variable(self, variable: BlockVariable, parts: dict[str, list[str]]) -> list[str]:
        """Adds the declaration of a variable to its section; returns the row of a timer or counter.  Raises SymbolError."""
        if variable.usage not in _USAGES:
            raise SymbolError(f"the usage {variable.usage} is not known: it may be an in-out or an external")
        note = f" // {variable.comment}" if variable.comment else ""
        if variable.type in (TIMER, COUNTER):
            kind = "TIMER" if variable.type == TIMER else "COUNTER"
            if variable.usage != "0":
                raise SymbolError(f"a {kind} as a pin is not emulated")
            comment = variable.comment.replace('"', "'")
            return [f'{spelling(variable.name)},{variable.address},{kind},,,,"{comment}";']
        if variable.type not in _TYPES:
            raise SymbolError(f"the type number {variable.type} is not known")
        kind = _TYPES[variable.type]
        spec = f"ARRAY [0..{variable.count - 1}] OF {kind}" if variable.count else kind
        place = f" AT {location(variable.address, kind)}" if variable.address else ""
        initial = "" if variable.count or variable.usage != "0" and place else self._initial(variable, kind)
        head = _USAGES[variable.usage] + (" RETAIN" if variable.retain and variable.usage == "0" else "")
        parts.setdefault(head, []).append(f"{spelling(variable.name)}{place} : {spec}{initial};{note}")
        return []


    def _initial(self, variable: BlockVariable, kind: str) -> str:
        """The initial value of a variable of a type, behind its `:=`; "" for none."""
        text = variable.initial
        if kind == "BOOL" and text.isdecimal():
            text = "TRUE" if whole_number(text) else "FALSE"
        if text and not re.fullmatch(_VALUES.get(kind, r"[+-]?\d+"), text):
            self.reading.report("X0190", variable.row.start,
                                f"the initial value {text} of {variable.name} is not taken over: it is no {kind}")
            return ""
        return f" := {text}" if text else ""


def _rows_by_name(symbols: Iterable[Symbol]) -> dict[str, Row]:
    """The rows of symbols, by the names that the sources have, in small letters; of comments of addresses, by these."""
    named = ((symbol.own or symbol.address, symbol.row) for symbol in symbols)
    return {name.casefold(): row for name, row in named if name}


class _Definitions:
    """Finds the function block of an instance by the name that rungs write."""

    def __init__(self, known: dict[str, tuple[str, FunctionBlock]]) -> None:
        self.known = known

    def __call__(self, instance: str) -> tuple[str, FunctionBlock] | None:
        return self.known.get(instance.casefold())
