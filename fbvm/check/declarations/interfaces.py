"""Interfaces: the sections of a POU become its variables and the layout of its instances or its frame.

Instance of a block or program: an 8-byte header that begins with the type identifier, then its variables in order of
writing, naturally aligned.  Frame of a function (one, fixed: POUs never recurse and tasks never preempt): first inputs and
in-outs, which the caller writes; all others get their initial values at each entry.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence

from fbvm.base.diagnostics import Source
from fbvm.base.dialects import takers
from fbvm.base.types import (
    BOOL,
    AnyType,
    ArrayType,
    Field,
    OpenArrayType,
    StringType,
    StructType,
    base,
    fold,
    followed,
)
from fbvm.check.declarations import construction, generic_blocks, initializers, same_names
from fbvm.check.declarations.hidden import add_hidden
from fbvm.check.declarations.inheritance import refuse_abstract, resolve_head
from fbvm.check.declarations.locations import is_open
from fbvm.check.declarations.specs import resolve
from fbvm.check.declarations.variables import check_qualifiers, initialized, is_constant, make_variable, type_of
from fbvm.check.expressions.scope import Scope
from fbvm.check.symbols.context import Context
from fbvm.check.symbols.facts import Edge, Pou, Variable, is_block
from fbvm.check.symbols.statement_lists import writes_eno
from fbvm.check.symbols.symbol_table import Resolved
from fbvm.syntax import tree
from fbvm.syntax.st.pragmas import passes_places

OBJECTS_AT = 4
"""Where an instance has the number of the first of its objects: behind its type identifier, 32 bits each."""
_SECTIONS = ("VAR", "VAR_INPUT", "VAR_OUTPUT", "VAR_IN_OUT", "VAR_TEMP", "VAR_EXTERNAL", "VAR_STAT")
"""Sections that every POU may have."""
PADDED_BYTES = 8
"""Arrays, structures and texts in frames take multiples of so many bytes where a dialect lets programs write the rest."""
_LOCATED = ("VAR", "VAR_INPUT", "VAR_OUTPUT")
"""Sections of blocks and programs whose variables may lie AT an address."""
_WITH_BOUNDS = (OpenArrayType, AnyType)
"""Types of parameters whose slot holds a reference, and the bounds or the type of the argument."""
_NOT_EXECUTED = ("VAR_INST", "VAR_ACCESS", "VAR_CONFIG")


def resolve_interface(context: Context, pou: Pou) -> None:
    """Fill in the variables and the layout of a POU."""
    _Interface(context, pou).resolve()


class _Interface:
    """The variables of one POU."""

    def __init__(self, context: Context, pou: Pou) -> None:
        self.context = context
        self.project = context.project
        self.pou = pou
        self.scope = Scope(context, pou.source, pou)
        self.at_start: list[tree.VarDecl] = []
        """Declarations whose initial values the body assigns at each start."""

    def resolve(self) -> None:
        """Fill in the variables and the layout."""
        pou = self.pou
        if pou.block is None:
            resolve_head(self.context, pou)
        if pou.base is not None:
            self._inherit(pou.base)
        pou.later = {fold(name.text): (declared, section) for section in pou.tree.sections if section.kind != "VAR_EXTERNAL"
                     for declared in section.variables for name in declared.names}
        for section in generic_blocks.sections(self.scope, pou):
            if self._is_allowed(section):
                self._section(section)
        pou.later = {}
        add_hidden(self.project, pou)
        if self.at_start:
            pou.tree, pou.as_written = initializers.with_assignments(pou, self.at_start), False
        if pou.tree.result is not None:
            self._result(pou.tree.result)
        if (constructed := construction.with_construction(self.context, pou)) is not pou.tree:
            self._construct(constructed)
        if "ENO" not in pou.variables and writes_eno(pou):
            self._enables_itself()
        if pou.is_routine:
            if pou.is_function and pou.tree.methods:
                self._error("S0205", pou.tree.methods[0].name, "a FUNCTION has no METHOD", "make it a FUNCTION_BLOCK")
            self._frame([v for v in pou.order if v.place == "self"])
        else:
            self._methods()
            self._frame(pou.parameters("VAR_TEMP"))
            self._instance()
        for action, source in pou.written_actions:
            self._action(action, source)

    def _enables_itself(self) -> None:
        """Declare the ENO that the body writes."""
        pou = self.pou
        self._register(Variable("ENO", BOOL, "VAR_OUTPUT", pou.source, pou.tree.name, pou, initial=b"\x01"))
        pou.enables_itself = True

    def _construct(self, constructed: tree.Pou) -> None:
        """Take the tree with the construction of instances at its start, and declare what that needs."""
        added = constructed.sections[len(self.pou.tree.sections):]
        self.pou.tree, self.pou.as_written = constructed, False
        for section in added:
            self._section(section)

    def _inherit(self, base: Pou) -> None:
        """Take over the variables of the block that this one extends: they come first, where they lie in that."""
        pou = self.pou
        pou.variables = {name: v for name, v in base.variables.items() if v.kind not in ("VAR_TEMP", "VAR_EXTERNAL")}
        pou.order = [variable for variable in base.order if variable.kind != "VAR_TEMP"]
        pou.edges = list(base.edges)
        pou.other_names = {**base.other_names, **pou.other_names}

    def _error(self, code: str, node: tree.Node, message: str, hint: str = "",
               related: tuple[Source, int, str] | None = None) -> None:
        self.context.report.add(code, self.pou.source, node, message, hint, related)

    def _action(self, action: tree.Action, source: Source) -> None:
        """Make the POU of an ACTION: a body of its own, with the variables of the POU that it belongs to."""
        name = fold(action.name.text)
        if self.pou.is_function:
            self.context.report.add("S0205", source, action.name, "a FUNCTION has no ACTION", "make it a FUNCTION_BLOCK")
        elif name in self.pou.variables and self.pou.variables[name].role != "action" or name in self.pou.actions:
            self.context.report.add("S0202", source, action.name, f"{action.name.text} is declared twice in {self.pou.name}",
                                    "an ACTION needs a name of its own")
        else:
            body = tree.Pou(action.start, action.end, "ACTION", action.name, None, (), action.body)
            pou = self.pou
            pou.actions[name] = Pou(f"{pou.name}.{action.name.text}", "ACTION", source, body, pou.variables, type=pou.type,
                                    resolved=True, failed_names=pou.failed_names, inherits=pou.inherits, home=pou)

    # --- methods ----------------------------------------------------------------------------------------------------

    def _methods(self) -> None:
        """Make the POUs of methods and accessors, and the variables that each of them keeps in the instance."""
        pou = self.pou
        for written in pou.tree.methods:
            name, shown = fold(written.name.text), f"{pou.name}.{written.name.text}"
            key = name if written.kind == "METHOD" else f"{written.kind} {name}"
            others = (name, f"GET {name}", f"SET {name}") if written.kind == "METHOD" else (name, key)
            clash = pou.variables.get(name)
            if clash is not None or any(other in pou.methods for other in others) or name in pou.actions:
                self._error("S1005", written.name, f"{written.name.text} is declared twice in {pou.name}",
                            "variables, actions, methods and properties of a block share their names")
                continue
            source = self.context.project.namespaces.used_by(written, pou.source)
            made = Pou(shown if written.kind == "METHOD" else f"{shown}.{written.kind.capitalize()}", written.kind, source,
                       written, block=pou, modifiers=_modifiers(pou, written))
            pou.methods[key] = made
            for refused in written.refused:
                self.context.report.refuse(pou.source, refused)
            for section in written.sections:
                if section.kind == "VAR_INST":
                    self._kept(made, section)

    def _kept(self, method: Pou, section: tree.VarSection) -> None:
        """The variables of VAR_INST: they lie in the instance, and only their method sees them."""
        check_qualifiers(self.context.report, section, self.pou.source, "FUNCTION_BLOCK", self.scope.dialect)
        for declared in section.variables:
            resolved = self._resolved(declared, section)
            for name in declared.names:
                if resolved is None:
                    method.failed_names.add(fold(name.text))
                    continue
                made = make_variable(self.context, declared, name, section, self.pou.source, resolved)
                made.owner = self.pou
                if fold(name.text) in method.variables:
                    self._error("S0202", name, f"{name.text} is declared twice in {method.name}")
                    continue
                method.variables[fold(name.text)] = made
                made.name = f"{method.tree.name.text}.{name.text}"
                self.pou.order.append(made)

    # --- sections ---------------------------------------------------------------------------------------------------

    def _is_allowed(self, section: tree.VarSection) -> bool:
        """True for a section that a POU of this kind may have; else a diagnostic."""
        if section.kind == "VAR_INST" and self.pou.block is not None:
            return False  # the instance has them
        if section.kind in _SECTIONS:
            check_qualifiers(self.context.report, section, self.pou.source, self.pou.kind, self.scope.dialect)
            return True
        if section.kind in _NOT_EXECUTED:
            self._error("S0901", section, f"{section.kind} is understood but not executed by this version")
        else:
            self._error("S0205", section, f"{section.kind} has no place in a {self.pou.kind}")
        for declared in section.variables:
            self.pou.failed_names.update(fold(name.text) for name in declared.names)
        return False

    def _section(self, section: tree.VarSection) -> None:
        for declared in section.variables:
            if section.kind == "VAR_EXTERNAL":
                self._external(declared, section)
            else:
                self._declaration(declared, section)

    def _declaration(self, declared: tree.VarDecl, section: tree.VarSection) -> None:
        """The variables of one declaration, with their places."""
        resolved = self.pou.later_constants.get(declared) or self._resolved(declared, section)
        if resolved is not None and section.kind == "VAR_IN_OUT":
            resolved = followed(resolved[0]), resolved[1]  # an in-out of REFERENCE TO is one of what it is bound to
        for name in declared.names:
            self.pou.later.pop(fold(name.text), None)
            if resolved is None:
                self.pou.failed_names.add(fold(name.text))
                continue
            made = make_variable(self.context, declared, name, section, self.pou.source, resolved)
            made.owner = self.pou
            self._pass_by_reference(made, section)
            if made.kind != "VAR_IN_OUT":
                refuse_abstract(self.context, made.type, self.pou.source, name)
            if is_block(made.type) and made.kind == "VAR_OUTPUT" and self.pou.is_routine and \
                    not self.scope.dialect.instances_are_values:
                self._error("S0901", name, f"an instance as VAR_OUTPUT of a {self.pou.kind} is not taken here",
                            f"pass it as VAR_IN_OUT, or take {takers('instances_are_values')}")
            self._place(made, declared)
            self._register(made)
            if made.kind == "VAR_STAT":
                self.context.global_order.append(made)

    def _resolved(self, declared: tree.VarDecl, section: tree.VarSection) -> Resolved | None:
        """Type and initial bytes of a declaration; None after a diagnostic.

        The frame of a body gets its initial values at each start: they may name variables in some dialects, and be assigned by
        the body then."""
        resolved = type_of(self.scope, declared)
        if resolved is None or declared.initial is None:
            return resolved
        in_frame = section.kind == "VAR_TEMP" or self.pou.is_routine and section.kind in ("VAR", "VAR_OUTPUT")
        if not in_frame or is_constant(section):
            return initialized(self.scope, declared, resolved)
        if self.scope.dialect.initial_variables and initializers.varies(self.scope, resolved[0], declared.initial):
            self.at_start.append(declared)
            return resolved
        return initialized(Scope(self.context, self.pou.source, self.pou, late=True), declared, resolved)

    def _pass_by_reference(self, made: Variable, section: tree.VarSection) -> None:
        """Make an in-out of a VAR_INPUT that is ANY (as CODESYS has it), an instance (its outputs are read), or has a pragma."""
        if section.kind != "VAR_INPUT":
            return
        if self.scope.dialect.pragmas_act and passes_places(self.pou.source, section):
            made.kind, made.by_reference = "VAR_IN_OUT", True
        elif isinstance(made.type, AnyType) or self._is_instance_elsewhere(made) or isinstance(made.type, OpenArrayType):
            made.kind, made.by_reference = "VAR_IN_OUT", True
            made.constant = not isinstance(made.type, AnyType)

    def _is_instance_elsewhere(self, made: Variable) -> bool:
        """True for an input that is an instance and reads it where it lies; some dialects copy it into one of the block's own."""
        return is_block(made.type) and (self.pou.is_function or not self.scope.dialect.instances_are_values)

    def _takes_bounds(self, variable: Variable) -> bool:
        """True for what takes bounds, size or type from an argument: an in-out, ANY, and an input ARRAY [*] of a FUNCTION, which
        reads the argument where it lies and may not write it."""
        if not variable.by_reference or not isinstance(variable.type, OpenArrayType):
            return variable.kind == "VAR_IN_OUT"
        return self.pou.is_routine and not self.scope.dialect.no_open_inputs

    def _place(self, variable: Variable, declared: tree.VarDecl) -> None:
        variable.reference = variable.kind == "VAR_IN_OUT"
        self._check_bounds(variable, declared)
        spec = declared.spec.target if isinstance(declared.spec, tree.RefSpec) else declared.spec
        variable.any_length = isinstance(spec, tree.StringSpec) and spec.length is None and (
            variable.reference or isinstance(declared.spec, tree.RefSpec) and variable.kind == "VAR_INPUT")
        if variable.kind == "VAR_STAT":
            variable.place = "abs"  # one for all instances and calls
        elif variable.kind == "VAR_TEMP" or self.pou.is_routine:
            variable.place = "self" if self.pou.is_routine else "frame"
        if declared.location is not None:
            located = variable.kind in _LOCATED and not self.pou.is_routine
            if located and is_open(declared.location, variable.type):
                self._place_by_var_config(variable, declared.location)
            else:
                variable.place = "area"
            if not located:
                self._error("S0604", declared.location,
                            f"{variable.kind} of a {self.pou.kind} has no location", "declare it in a VAR section")
        if declared.edge:
            self._edge(variable, declared)
        if self.context.guards_calls(variable):
            variable.guards, variable.initial = True, variable.initial if variable.explicit else b"\x01"

    def _place_by_var_config(self, variable: Variable, location: tree.Location) -> None:
        """`AT %I*`: VAR_CONFIG gives each instance its place; without VAR_CONFIG it is a variable like others."""
        variable.open = self.project.completes(variable.name)
        variable.open_location = location.text.strip() if variable.open else ""
        variable.reference = variable.reference or variable.open
        if not variable.open:
            said = "no VAR_CONFIG says" if location.text.rstrip().endswith("*") else "only its maker knows"
            self._error("S0692", location, f"{said} where {variable.name} AT {location.text} lies",
                        "it keeps its value as a variable of its own; a place in the area is %MW10 or %IX0.3")

    def _check_bounds(self, variable: Variable, declared: tree.VarDecl) -> None:
        """Report ARRAY [*] and ANY that are no in-outs: they take bounds, size and type from the argument."""
        kind = variable.type
        if isinstance(kind, _WITH_BOUNDS) and not self._takes_bounds(variable):
            what = kind.name if isinstance(kind, AnyType) else "ARRAY [*]"
            section = "VAR_INPUT" if variable.by_reference else variable.kind
            if section == "VAR_INPUT" and self.pou.is_routine:
                self._error("S0903", declared.spec, f"{what} as an input is not in the dialect {self.scope.dialect.name}",
                            f"declare it in VAR_IN_OUT, or take {takers('no_open_inputs', False)}")
            else:
                self._error("S0205", declared.spec, f"{what} cannot be {section} of a {self.pou.kind}",
                            "declare it in VAR_IN_OUT" + ("; only a FUNCTION takes it as VAR_INPUT" if
                                                          section == "VAR_INPUT" and what == "ARRAY [*]" else ""))

    def _edge(self, variable: Variable, declared: tree.VarDecl) -> None:
        if variable.kind != "VAR_INPUT" or base(variable.type) != BOOL or self.pou.is_routine:
            self._error("S0206", variable.node, f"{declared.edge} belongs to a BOOL input of a block or program")
            return
        variable.edge = declared.edge

    def _register(self, variable: Variable) -> None:
        other = self.pou.variables.get(fold(variable.name))
        if other is None and fold(variable.name) == fold(self.pou.tree.name.text) and self.pou.tree.result is not None and \
                not same_names.hides_result(self.scope, self.pou, variable):
            return
        if other is not None and other.owner is not self.pou and not self.pou.is_routine and other.owner is not None:
            self._error("S1005", variable.node, f"{other.owner.name} has a variable {other.name} already, which {self.pou.name} "
                        "inherits", "rename it", (other.source, other.node.start, "declared here"))
            return
        if other is not None:
            same_names.declared_twice(self.scope, self.pou, variable, other)
            return
        self.pou.variables[fold(variable.name)] = variable
        self.pou.order.append(variable)
        if variable.edge:
            self._add_edge(variable)

    def _add_edge(self, raw: Variable) -> None:
        """Add the hidden variables of an input with R_EDGE or F_EDGE: the body reads the edge instead of the pin.

        Their names have a space, so that no program can name them."""
        memory = Variable(f"{raw.name} memory", BOOL, "VAR", raw.source, raw.node, self.pou, initial=b"\0")
        hidden = Variable(f"{raw.name} edge", BOOL, "VAR", raw.source, raw.node, self.pou, initial=b"\0")
        self.pou.order += [hidden, memory]
        self.pou.variables[fold(raw.name)] = hidden
        self.pou.edges.append(Edge(raw, hidden, memory, raw.edge == "F_EDGE"))

    def _external(self, declared: tree.VarDecl, section: tree.VarSection) -> None:
        resolved = resolve(self.scope, declared.spec)
        for name in declared.names:
            self.pou.failed_names.add(fold(name.text))
            variable = self.context.global_variable(name.text, self.pou.source)
            if variable is None:
                self._error("S0208", name, f"there is no VAR_GLOBAL {name.text}",
                            self.project.nearest_global(name.text))
            elif resolved is not None and resolved[0] != variable.type:
                self._error("S0208", name,
                            f"{name.text} is {resolved[0]} here and {variable.type} as global",
                            "", (variable.source, variable.node.start, "the VAR_GLOBAL"))
            elif variable.constant and not is_constant(section):
                self._error("S0208", name, f"the VAR_GLOBAL {name.text} is CONSTANT",
                            "write VAR_EXTERNAL CONSTANT")
            elif is_constant(section) and not variable.constant:
                self.pou.constant_externals.add(fold(name.text))
            if fold(name.text) in self.pou.variables:
                self._error("S0202", name, f"{name.text} is declared twice in {self.pou.name}")
            elif variable is not None:
                self.pou.variables[fold(name.text)] = variable

    def _result(self, spec: tree.TypeSpec) -> None:
        pou, resolved = self.pou, resolve(self.scope, spec)
        if resolved is None:
            pou.failed_names.add(fold(pou.tree.name.text))
            return
        if is_block(resolved[0]) and not self.scope.dialect.instances_are_values:
            self._error("S0901", spec, f"an instance as a result is not taken here: {takers('instances_are_values')}")
            return
        refuse_abstract(self.context, resolved[0], pou.source, spec)
        pou.result = Variable(pou.tree.name.text, resolved[0], "RESULT", pou.source, pou.tree.name, pou, initial=resolved[1])
        pou.variables.setdefault(fold(pou.tree.name.text), pou.result)
        pou.order.append(pou.result)

    # --- layout -----------------------------------------------------------------------------------------------------

    def _frame(self, variables: Sequence[Variable]) -> None:
        passed = [v for v in variables if v.kind in ("VAR_INPUT", "VAR_IN_OUT")]
        read = [v for v in variables if v.kind in ("VAR_OUTPUT", "RESULT")] if self.pou.block is not None else []
        rest = [*read, *(v for v in variables if v not in passed and v not in read)]
        if not self._fit(variables):
            return
        content = bytearray()
        for variable in passed:
            _append(content, variable)
        self.pou.frame_inputs = len(content)
        for number, variable in enumerate(rest):
            if number == len(read):
                self.pou.frame_given = len(content)
            pads = self.scope.dialect.padding_is_written and isinstance(variable.type, ArrayType | StructType | StringType)
            content += bytes(-len(content) % PADDED_BYTES if pads else 0)
            _append(content, variable)
            content += bytes(-len(content) % PADDED_BYTES if pads else 0)
        if len(rest) == len(read):
            self.pou.frame_given = len(content)
        for variable in variables:
            variable.place = "frame"
        self.pou.frame_size, self.pou.frame_initial = len(content), bytes(content)

    def _instance(self) -> None:
        self.pou.identifier = self.context.new_type_identifier()
        content = bytearray(self.pou.identifier.to_bytes(4, "little") + bytes(4))
        if self.pou.base is not None:
            content += self.pou.base.initial[len(content):]
        held = [variable for variable in self.pou.order if variable.place == "self" and variable.owner is self.pou]
        for variable in held if self._fit(held) else ():
            _append(content, variable)
        content += bytes(-len(content) % 8)
        fields = {fold(v.name): _field(v) for v in self.pou.order if v.place != "frame"}
        parents = tuple(each.type for each in (self.pou.base, *self.pou.interfaces) if each is not None and each.type is not None)
        self.pou.type = StructType(self.pou.name, len(content), 8, fields, True, self.pou.other_names, parents)
        self.pou.initial = bytes(content)
        inner = (field.type for field in fields.values() if not field.reference)
        self.project.size_limits.nests(self.pou.type, inner, f"{self.pou.name} has", self.pou.source, self.pou.tree.name)

    def _fit(self, variables: Iterable[Variable]) -> bool:
        """True if an instance or a frame can hold the variables; else a diagnostic."""
        size, pou = sum(8 if variable.reference else variable.type.size for variable in variables), self.pou
        return self.project.size_limits.reserve(size, f"the variables of {pou.name} take", pou.source, pou.tree.name)


def _slot(variable: Variable) -> int:
    return variable.type.size if isinstance(variable.type, _WITH_BOUNDS) else 8


def _append(content: bytearray, variable: Variable) -> None:
    size, align = (max(8, _slot(variable)), 8) if variable.reference else (variable.type.size, variable.type.align)
    content += bytes(-len(content) % align)
    variable.offset = len(content)
    content += bytes(size) if variable.reference else variable.initial


def _field(variable: Variable) -> Field:
    """The variable as a member of its block's type; a location is filled in when the layout is known."""
    return Field(variable.name, variable.type, variable.offset, variable.kind, absolute=variable.place in ("area", "abs"),
                 reference=variable.reference, constant=variable.constant, hexadecimal=variable.hexadecimal)


def _modifiers(pou: Pou, written: tree.Pou) -> frozenset[str]:
    """The words of the head of a method; FINAL in an interface, which TwinCAT takes, forbids nothing to who implements it."""
    return frozenset(word.text for word in written.modifiers if pou.kind != "INTERFACE" or word.text != "FINAL")
