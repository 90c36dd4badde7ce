"""Declarations of variables: sections of a POU become its variables and the layout of its instances or frame.

Instance of a block or program: an 8-byte header that begins with the type identifier, then its variables in order of
writing, naturally aligned.  Frame of a function (one, fixed: POUs never recurse and tasks never preempt): inputs and
in-outs first, which the caller writes; the rest gets its initial values at each entry.
"""

from __future__ import annotations

from collections.abc import Iterable
from typing import TYPE_CHECKING

from fbvm.base.areas import FLAG_AREAS
from fbvm.base.diagnostics import Source
from fbvm.base.types import (
    BOOL,
    AnyType,
    ArrayType,
    Field,
    OpenArrayType,
    StructType,
    Type,
    base,
    fold,
    followed,
    on_bits,
)
from fbvm.check.declarations import initializers
from fbvm.check.declarations.locations import location_of
from fbvm.check.statements import writes_eno
from fbvm.check.symbols.facts import Edge, Pou, Variable, is_block, is_open
from fbvm.check.symbols.reserved_names import refuse_reserved
from fbvm.syntax import tree
from fbvm.syntax.st.pragmas import passes_places

if TYPE_CHECKING:
    from fbvm.check.checker import Checker

OBJECTS_AT = 4
"""Where an instance has the number of the first of its objects: behind its type identifier, 32 bits each."""
_SECTIONS = ("VAR", "VAR_INPUT", "VAR_OUTPUT", "VAR_IN_OUT", "VAR_TEMP", "VAR_EXTERNAL", "VAR_STAT")
"""What every POU may have."""
_QUALIFIERS = {
    "VAR": ("CONSTANT", "RETAIN", "NON_RETAIN", "PERSISTENT"), "VAR_INPUT": ("CONSTANT", "RETAIN", "NON_RETAIN"),
    "VAR_OUTPUT": ("RETAIN", "NON_RETAIN"), "VAR_IN_OUT": ("CONSTANT",), "VAR_TEMP": (), "VAR_EXTERNAL": ("CONSTANT",),
    "VAR_GLOBAL": ("CONSTANT", "RETAIN", "NON_RETAIN", "PERSISTENT"),
    "VAR_STAT": ("CONSTANT", "RETAIN", "NON_RETAIN", "PERSISTENT"),
}
_LOCATED = ("VAR", "VAR_INPUT", "VAR_OUTPUT")
"""Sections of blocks and programs whose variables may lie AT an address."""
BORROWED = (OpenArrayType, AnyType)
"""Types whose slot holds a reference and more."""
_LATER = ("VAR_INST", "VAR_GENERIC", "VAR_ACCESS", "VAR_CONFIG")


class Interfaces:
    """Turns declarations into variables and layout."""

    def __init__(self, checker: Checker) -> None:
        self.checker = checker
        self.project = checker.project
        self.report = checker.project.report
        self._identifiers = 0
        self._begun: list[tree.VarDecl] = []
        """What begins with a value that is worked out at each start of the body."""
        self._early: dict[tree.VarDecl, tuple[Type, bytes] | None] = {}
        """What was asked for before its turn came; None while it is being worked out."""

    def resolve(self, pou: Pou) -> None:
        """Fill in the variables and the layout of a POU."""
        mark = len(self._begun)
        pou.later = {fold(name.text): (declared, section) for section in pou.tree.sections if section.kind != "VAR_EXTERNAL"
                     for declared in section.variables for name in declared.names}
        for section in pou.tree.sections:
            if self._section_allowed(section, pou):
                self._section(section, pou)
        pou.later = {}
        for name in sorted(self.project.tasked(pou.name)) if pou.kind == "PROGRAM" else ():
            self._tasked(name, pou)
        if begun := self._begun[mark:]:
            pou.tree, pou.as_written = initializers.with_assignments(pou, begun), False
            del self._begun[mark:]
        if pou.tree.result is not None:
            self._result(pou, pou.tree.result)
        if "ENO" not in pou.variables and writes_eno(pou):
            eno = Variable("ENO", BOOL, "VAR_OUTPUT", pou.source, pou.tree.name, pou, initial=b"\x01")
            self._register(eno, pou)
            pou.enables_itself = True
        if pou.is_function:
            self._frame(pou, [v for v in pou.order if v.place == "self"])
        else:
            self._frame(pou, pou.parameters("VAR_TEMP"))
            self._instance(pou)
        for action, source in pou.written_actions:
            self._action(action, source, pou)

    def _tasked(self, name: str, pou: Pou) -> None:
        """A variable that says whether a task of its own runs an instance of this instance of a program."""
        block = pou.variables.get(name)
        if block is not None and block.kind == "VAR" and is_block(block.type):
            flag = Variable(f"{block.name} task", BOOL, "VAR", pou.source, block.node, pou, initial=b"\0")
            pou.order.append(flag)
            pou.tasked[block] = flag

    def _action(self, action: tree.Action, source: Source, pou: Pou) -> None:
        """An ACTION is a body of its own over the variables of its POU."""
        name = fold(action.name.text)
        if pou.is_function:
            self.report.add("S0205", source, action.name, "a FUNCTION has no ACTION", "make it a FUNCTION_BLOCK")
        elif name in pou.variables and pou.variables[name].role != "action" or name in pou.actions:
            self.report.add("S0202", source, action.name, f"{action.name.text} is declared twice in {pou.name}",
                            "an ACTION needs a name of its own")
        else:
            body = tree.Pou(action.start, action.end, "ACTION", action.name, None, (), action.body)
            pou.actions[name] = Pou(f"{pou.name}.{action.name.text}", "ACTION", source, body, pou.variables, type=pou.type,
                                    resolved=True, damaged=pou.damaged, inherits=pou.inherits, home=pou)

    # --- sections ---------------------------------------------------------------------------------------------------

    def _section_allowed(self, section: tree.VarSection, pou: Pou) -> bool:
        if section.kind in _LATER:
            self.report.add("S0901", pou.source, section, f"{section.kind} is understood but not executed by this version")
        elif section.kind not in _SECTIONS:
            self.report.add("S0205", pou.source, section, f"{section.kind} has no place in a {pou.kind}")
        else:
            return self.qualified(section, pou.source, pou.kind)
        for declared in section.variables:
            pou.damaged.update(fold(name.text) for name in declared.names)
        return False

    def qualified(self, section: tree.VarSection, source: Source, pou_kind: str) -> bool:
        """Complain about qualifiers that the section cannot have; True in any case, so that its names are known."""
        words = [fold(q.text) for q in section.qualifiers]
        for word, node in zip(words, section.qualifiers, strict=True):
            if word not in _QUALIFIERS[section.kind] or (pou_kind == "FUNCTION" and word != "CONSTANT"):
                self.report.add("S0206", source, node, f"{section.kind} of a {pou_kind} cannot be {word}")
        if "CONSTANT" in words and len(words) > 1 or {"RETAIN", "NON_RETAIN"} <= set(words):
            self.report.add("S0206", source, section.qualifiers[1], f"{' '.join(words)} exclude one another")
        return True

    def _section(self, section: tree.VarSection, pou: Pou) -> None:
        for declared in section.variables:
            if section.kind == "VAR_EXTERNAL":
                self._external(declared, section, pou)
                continue
            inner = section.kind in ("VAR", "VAR_OUTPUT") and pou.is_function
            late = (inner or section.kind == "VAR_TEMP") and all(fold(word.text) != "CONSTANT" for word in section.qualifiers)
            resolved = self._early.get(declared) or self.typed(declared, pou.source, pou, late)
            if resolved is not None and section.kind == "VAR_IN_OUT":
                resolved = followed(resolved[0]), resolved[1]  # an in-out of REFERENCE TO is one of what it is bound to
            borrowed = resolved is not None and section.kind == "VAR_INPUT" and \
                (isinstance(resolved[0], AnyType) or is_block(resolved[0]))
            by_place = section.kind == "VAR_INPUT" and self.project.dialect.pragmas_act and \
                passes_places(pou.source, section)
            for name in declared.names:
                pou.later.pop(fold(name.text), None)
                if resolved is None:
                    pou.damaged.add(fold(name.text))
                    continue
                variable = self.variable(declared, name, section, pou.source, resolved)
                variable.owner = pou
                if by_place:
                    variable.kind = "VAR_IN_OUT"
                elif borrowed:
                    variable.kind = "VAR_IN_OUT"  # ANY, as CODESYS has it, and an instance, whose outputs are read, go by place
                    variable.constant = is_block(variable.type)
                if is_block(variable.type) and variable.kind == "VAR_OUTPUT":
                    self.report.add("S0901", pou.source, name, f"an instance as {section.kind} is understood but not "
                                    "executed by this version", "pass it as VAR_IN_OUT")
                self._place(variable, declared, pou)
                self._register(variable, pou)
                if variable.kind == "VAR_STAT":
                    self.checker.global_order.append(variable)

    def early(self, name: tree.NameRef, pou: Pou) -> Variable | None:
        """A CONSTANT of a POU that is declared behind what needs it; None after a diagnostic."""
        declared, section = pou.later[fold(name.text)]
        if all(fold(word.text) != "CONSTANT" for word in section.qualifiers):
            self.report.add("S0701", pou.source, name, f"{name.text} has no value yet where this is worked out",
                            "declare it in front, in a VAR CONSTANT section")
            return None
        if declared in self._early and self._early[declared] is None:
            self.report.add("S0207", pou.source, name, f"the value of {name.text} needs {name.text} itself")
            return None
        self._early[declared] = None
        resolved = self._early[declared] = self.typed(declared, pou.source, pou)
        node = next(each for each in declared.names if fold(each.text) == fold(name.text))
        return self.variable(declared, node, section, pou.source, resolved) if resolved is not None else None

    def typed(self, declared: tree.VarDecl, source: Source, pou: Pou | None, late: bool = False) -> tuple[Type, bytes] | None:
        """Type and initial bytes of a declaration in `pou`, or of a global one; None after a diagnostic.

        A `late` variable gets its value whenever its body starts."""
        with self.checker.scope(pou):
            specs = self.checker.specs
            resolved = specs.resolve(declared.spec, source) if pou is None else specs.parameter(declared.spec, source)
            if resolved is None:
                return None
            kind, initial = resolved
            if declared.initial is not None and late and pou is not None and self.project.dialect.initial_variables and \
                    initializers.varies(self.checker.expressions(source, pou), declared.initial):
                self._begun.append(declared)
            elif declared.initial is not None:
                before = len(self.project.facts.starts)
                with self.checker.scope(pou, late):
                    initial = self.checker.values.initial(kind, declared.initial, source, initial)
                if len(self.project.facts.starts) > before and declared.location is not None:
                    self.report.add("S0701", source, declared.initial,
                                    "a reference that lies AT an address is made by the program", "assign it in the body instead")
        return kind, initial

    def variable(self, declared: tree.VarDecl, name: tree.Name, section: tree.VarSection, source: Source,
                 resolved: tuple[Type, bytes]) -> Variable:
        """A variable as declared, with its location but without a place."""
        refuse_reserved(self.report, source, name)
        kind, initial = resolved
        words = {fold(q.text) for q in section.qualifiers}
        made = Variable(name.text, kind, section.kind, source, name, initial=initial, constant="CONSTANT" in words,
                        retain=bool({"RETAIN", "PERSISTENT"} & words), explicit=declared.initial is not None,
                        role=section.role)
        if made.constant and is_block(kind):
            self.report.add("S0206", source, name, "an instance cannot be CONSTANT")
        elif made.constant:
            if section.kind in ("VAR_INPUT", "VAR_IN_OUT"):
                pass  # what the caller gives; the block may only read it
            elif declared.initial is None and not isinstance(kind, StructType | ArrayType):
                self.report.add("S0701", source, name, f"the constant {name.text} has no value", "write := and its value")
            elif isinstance(declared.initial, tree.Expr):
                made.wrong = declared.initial in self.project.facts.wrong
                made.value = None if made.wrong else self.project.facts.constants.get(declared.initial)
        if declared.location is not None:
            made.location = location_of(self.checker, declared, kind, source)
            place = made.location
            if isinstance(kind, ArrayType) and place is not None and (place.bit is not None or place.area in FLAG_AREAS):
                made.type = on_bits(kind)
        return made

    def _place(self, variable: Variable, declared: tree.VarDecl, pou: Pou) -> None:
        variable.reference = variable.kind == "VAR_IN_OUT"
        self._open(variable, declared, pou)
        variable.any_length = variable.reference and isinstance(declared.spec, tree.StringSpec) and declared.spec.length is None
        if variable.kind == "VAR_STAT":
            variable.place = "abs"  # one for all instances and calls
        elif variable.kind == "VAR_TEMP" or pou.is_function:
            variable.place = "self" if pou.is_function else "frame"
        if declared.location is not None:
            located = variable.kind in _LOCATED and not pou.is_function
            if located and is_open(declared.location, variable.type):
                self._completed(variable, declared.location, pou)
            else:
                variable.place = "area"
            if not located:
                self.report.add("S0604", pou.source, declared.location,
                                f"{variable.kind} of a {pou.kind} has no location", "declare it in a VAR section")
        if declared.edge:
            self._edge(variable, declared, pou)
        if fold(variable.name) == "EN" and variable.kind == "VAR_INPUT" and not variable.explicit:
            variable.initial = b"\x01"  # EN is TRUE where nobody connects it

    def _completed(self, variable: Variable, location: tree.Location, pou: Pou) -> None:
        """`AT %I*`: where VAR_CONFIG says, for each instance another place; without that it is a variable as others."""
        variable.open = self.project.completes(variable.name)
        variable.reference = variable.reference or variable.open
        if not variable.open:
            said = "no VAR_CONFIG says" if location.text.rstrip().endswith("*") else "only its maker knows"
            self.report.add("S0692", pou.source, location, f"{said} where {variable.name} AT {location.text} lies",
                            "it keeps its value as a variable of its own; a place in the area is %MW10 or %IX0.3")

    def _open(self, variable: Variable, declared: tree.VarDecl, pou: Pou) -> None:
        """ARRAY [*] and ANY are parameters that borrow bounds, size and type from what is passed."""
        kind = variable.type
        if isinstance(kind, BORROWED) and variable.kind != "VAR_IN_OUT":
            what = kind.name if isinstance(kind, AnyType) else "ARRAY [*]"
            self.report.add("S0205", pou.source, declared.spec, f"{what} cannot be {variable.kind}",
                            "declare it in VAR_IN_OUT")

    def _edge(self, variable: Variable, declared: tree.VarDecl, pou: Pou) -> None:
        if variable.kind != "VAR_INPUT" or base(variable.type) != BOOL or pou.is_function:
            self.report.add("S0206", pou.source, variable.node,
                            f"{declared.edge} belongs to a BOOL input of a block or program")
            return
        variable.edge = declared.edge

    def _register(self, variable: Variable, pou: Pou) -> None:
        other = pou.variables.get(fold(variable.name))
        if other is None and fold(variable.name) == fold(pou.name) and pou.is_function:
            self.report.add("S0202", pou.source, variable.node, f"{variable.name} is the name of the function itself",
                            "that name stands for the result; rename the variable")
            pou.damaged.add(fold(variable.name))
            return
        if other is not None:
            self.report.add("S0202", pou.source, variable.node, f"{variable.name} is declared twice in {pou.name}", "",
                            (other.source, other.node.start, "first declared here"))
            return
        pou.variables[fold(variable.name)] = variable
        pou.order.append(variable)
        if variable.edge:
            self._add_edge(variable, pou)

    def _add_edge(self, raw: Variable, pou: Pou) -> None:
        """The body reads a hidden variable instead of the pin; names with a space cannot be written in a program."""
        memory = Variable(f"{raw.name} memory", BOOL, "VAR", raw.source, raw.node, pou, initial=b"\0")
        hidden = Variable(f"{raw.name} edge", BOOL, "VAR", raw.source, raw.node, pou, initial=b"\0")
        pou.order += [hidden, memory]
        pou.variables[fold(raw.name)] = hidden
        pou.edges.append(Edge(raw, hidden, memory, raw.edge == "F_EDGE"))

    def _external(self, declared: tree.VarDecl, section: tree.VarSection, pou: Pou) -> None:
        resolved = self.checker.specs.resolve(declared.spec, pou.source)
        for name in declared.names:
            pou.damaged.add(fold(name.text))
            variable = self.project.global_variable(name.text, pou.source)
            if variable is None:
                self.report.add("S0208", pou.source, name, f"there is no VAR_GLOBAL {name.text}",
                                self.project.nearest_global(name.text))
            elif resolved is not None and resolved[0] != variable.type:
                self.report.add("S0208", pou.source, name,
                                f"{name.text} is {resolved[0]} here and {variable.type} as global",
                                "", (variable.source, variable.node.start, "the VAR_GLOBAL"))
            elif variable.constant and not any(fold(q.text) == "CONSTANT" for q in section.qualifiers):
                self.report.add("S0208", pou.source, name, f"the VAR_GLOBAL {name.text} is CONSTANT",
                                "write VAR_EXTERNAL CONSTANT")
            if fold(name.text) in pou.variables:
                self.report.add("S0202", pou.source, name, f"{name.text} is declared twice in {pou.name}")
            elif variable is not None:
                pou.variables[fold(name.text)] = variable

    def _result(self, pou: Pou, spec: tree.TypeSpec) -> None:
        resolved = self.checker.specs.resolve(spec, pou.source)
        if resolved is None:
            pou.damaged.add(fold(pou.name))
            return
        if is_block(resolved[0]):
            self.report.add("S0901", pou.source, spec, "an instance as a result is understood but not executed")
            return
        result = Variable(pou.name, resolved[0], "RESULT", pou.source, pou.tree.name, pou, initial=resolved[1])
        pou.result = result
        pou.variables.setdefault(fold(pou.name), result)
        pou.order.append(result)

    # --- layout -----------------------------------------------------------------------------------------------------

    def _frame(self, pou: Pou, variables: list[Variable]) -> None:
        passed = [v for v in variables if v.kind in ("VAR_INPUT", "VAR_IN_OUT")]
        rest = [v for v in variables if v not in passed]
        if not self._fit(pou, variables):
            return
        content = bytearray()
        for variable in passed:
            _append(content, variable)
        pou.frame_inputs = len(content)
        for variable in rest:
            _append(content, variable)
        for variable in variables:
            variable.place = "frame"
        pou.frame_size = len(content)
        pou.frame_initial = bytes(content)

    def _instance(self, pou: Pou) -> None:
        self._identifiers += 1
        content = bytearray(self._identifiers.to_bytes(4, "little") + bytes(4))
        held = [variable for variable in pou.order if variable.place == "self"]
        for variable in held if self._fit(pou, held) else ():
            _append(content, variable)
        content += bytes(-len(content) % 8)
        fields = {fold(v.name): _field(v) for v in pou.order if v.place != "frame"}
        pou.type = StructType(pou.name, len(content), 8, fields, True, pou.other_names)
        pou.initial = bytes(content)

    def _fit(self, pou: Pou, variables: Iterable[Variable]) -> bool:
        """Whether there is room for what an instance or a frame holds."""
        size = sum(8 if variable.reference else variable.type.size for variable in variables)
        return self.project.room.has(size, f"the variables of {pou.name} take", pou.source, pou.tree.name)


def _slot(variable: Variable) -> int:
    return variable.type.size if isinstance(variable.type, BORROWED) else 8


def _append(content: bytearray, variable: Variable) -> None:
    size, align = (max(8, _slot(variable)), 8) if variable.reference else (variable.type.size, variable.type.align)
    content += bytes(-len(content) % align)
    variable.offset = len(content)
    content += bytes(size) if variable.reference else variable.initial


def _field(variable: Variable) -> Field:
    """The variable as a member of its block's type; a location is filled in when the layout is known."""
    return Field(variable.name, variable.type, variable.offset, variable.kind, absolute=variable.place in ("area", "abs"),
                 reference=variable.reference, constant=variable.constant, hexadecimal=variable.hexadecimal)
