"""Construction of instances: the calls of FB_init with the arguments of declarations, then of methods with 'call_after_init';
and the calls of FB_exit, which end them.

Each block with something to construct gets a hidden method for itself, not for what it extends: it constructs the variables
that the block declares, in their order, and calls the block's own FB_init.  A declaration of an instance calls these methods
for all that its type extends, the base first.  Instances that live as long as the program are constructed in front of the first
cycle of the first task; those of a method or function, and VAR_TEMP, each time its body begins.

FB_exit is called in the opposite order, the derived block first, by a body of its own that the program never calls: whoever puts
another program in place of this one executes it (machine/endings.py).  Instances of methods and functions, and those of a PLC
whose power goes off, just end.  Nobody changes a program while it runs: FB_reinit is never called.

Source: Beckhoff Information System and CODESYS online help, Methods FB_init, FB_reinit and FB_exit; attribute call_after_init."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from itertools import product

from fbvm.base.diagnostics import Source
from fbvm.base.types import BOOL, ArrayType, StructType, Type, fold
from fbvm.check.symbols.context import Context
from fbvm.check.symbols.facts import Pou, Variable, holds_block
from fbvm.syntax import tree
from fbvm.syntax.tree.node import changed

INIT, AFTER, EXIT = "FB_init", "call_after_init", "FB_exit"
"""The phases: the method of that name, the methods with that attribute."""
PHASES = (INIT, AFTER)
LAST = "call_after_global_init_slot"
"""The attribute of functions that are called behind all initialisation; methods with it are called in the phase AFTER."""
INIT_KEY = fold(INIT)
FLAGS = {INIT: ("bInitRetains", "bInCopyCode"), EXIT: ("bInCopyCode",)}
"""The inputs with which methods begin that the runtime system calls, and which it gives."""
_FLAGS = len(FLAGS[INIT])
KEPT, DONE = "retained values are kept", "__FB_init_done"
"""Hidden variables: TRUE while FB_init is called at a start that keeps RETAIN variables; TRUE and kept behind the first start."""


def arguments(spec: tree.TypeSpec) -> tuple[tree.Argument, ...]:
    """The arguments of FB_init in a declaration: those of `F(25)`, `F(a := 1)`, also of an array of F."""
    if isinstance(spec, tree.ArraySpec):
        return arguments(spec.element)
    if isinstance(spec, tree.EnumSpec) and spec.base is not None:
        return tuple(tree.Argument(name.start, name.end, "", None, tree.NameRef(name.start, name.end, name.text)) if value is None
                     else tree.Argument(name.start, value.end, ":=", name, value) for name, value in spec.members)
    return spec.arguments if isinstance(spec, tree.ConstructedSpec) else ()


def constructs(context: Context, kind: Type, phase: str = "") -> bool:
    """True if a value of that type holds an instance that has something to construct, in one phase or in any."""
    if not holds_block(kind):
        return False
    if isinstance(kind, ArrayType):
        return constructs(context, kind.element, phase)
    if isinstance(kind, StructType) and kind.block:
        return any(_has_own(context, level, each) for level in context.block_of(kind).lineage()
                   for each in ([phase] if phase else (*PHASES, EXIT)))
    return isinstance(kind, StructType) and any(constructs(context, field.type, phase) for field in kind.fields.values())


def _has_own(context: Context, level: Pou, phase: str) -> bool:
    """True if a block itself, without what it extends, has something to construct."""
    key = level, phase
    if key not in context.constructing:
        context.constructing[key] = bool(_called(context, level, phase)) or \
            any(constructs(context, kind, phase) for kind in {id(each.type): each.type for each in _declared(level)}.values())
    return context.constructing[key]


def _called(context: Context, level: Pou, phase: str) -> list[Pou]:
    """The methods of a block itself that a phase calls."""
    if phase != AFTER:
        return [level.methods[fold(phase)]] if fold(phase) in level.methods else []
    wanted = {LAST} | ({AFTER} if AFTER in context.attributes(level) else set())
    return [method for key, method in level.methods.items() if wanted & context.attributes(method).keys()
            and (level.base is None or level.base.method(key) is None)]


def _declared(level: Pou) -> list[Variable]:
    """The variables of an instance that a block declares itself."""
    return [each for each in level.order
            if each.owner is level and each.place == "self" and not each.reference and each.kind != "VAR_TEMP"]


# --- statements -------------------------------------------------------------------------------------------------------


class Statements:
    """Makes the statements that construct variables.  Arrays need counters, which the body must declare, unless the statements
    are to be `unrolled`: one for each element then."""

    def __init__(self, context: Context, source: Source, unrolled: bool = False) -> None:
        self.context, self.source, self.unrolled = context, source, unrolled
        self.counters = 0

    def sections(self) -> tuple[tree.VarSection, ...]:
        """The section with the counters of the loops that were made."""
        if not self.counters:
            return ()
        names = tuple(tree.Name(0, 0, _counter(number)) for number in range(self.counters))
        return (tree.VarSection(0, 0, "VAR", (), (tree.VarDecl(0, 0, names, None, tree.NamedType(0, 0, "DINT"), None),), True),)

    def of(self, variable: Variable, name: str, phase: str) -> Iterator[tree.Statement]:
        """The statements that construct a variable, which is called `name` where they stand."""
        node, declared = variable.node, variable.declared
        place = tree.NameRef(node.start, node.end, name)
        given = arguments(declared.spec) if declared is not None and phase == INIT else ()
        yield from self.value(place, variable.type, given, declared, phase)

    def value(self, place: tree.Expr, kind: Type, given: tuple[tree.Argument, ...], declared: tree.VarDecl | None,
              phase: str) -> Iterator[tree.Statement]:
        """The statements that do a phase for a value that `place` names; `given` are arguments of FB_init."""
        if not constructs(self.context, kind, phase):
            return
        if isinstance(kind, ArrayType):
            yield from self._elements(place, kind, given, declared, phase)
        elif isinstance(kind, StructType) and kind.block:
            yield from self._instance(place, self.context.block_of(kind), given, phase)
            if phase == INIT and declared is not None and isinstance(declared.initial, tree.StructInit):
                yield from self._initial_values(place, kind, declared.initial)
        elif isinstance(kind, StructType):
            for field in kind.fields.values():
                part = tree.Member(place.start, place.end, place, tree.Name(place.start, place.end, field.name))
                yield from self.value(part, field.type, (), None, phase)

    def _elements(self, place: tree.Expr, kind: ArrayType, given: tuple[tree.Argument, ...], declared: tree.VarDecl | None,
                  phase: str) -> Iterator[tree.Statement]:
        """Each element: one after another if each has arguments of its own, else in loops."""
        own = _of_elements(declared.spec) if declared is not None and phase == INIT else None
        if own is not None and len(kind.bounds) == 1:
            for index, each in zip(range(kind.bounds[0][0], kind.bounds[0][1] + 1), own, strict=False):
                element = tree.Index(place.start, place.end, place, (_integer(place, index),))
                yield from self.value(element, kind.element, each, None, phase)
            return
        if self.unrolled:
            for subscripts in product(*(range(low, high + 1) for low, high in kind.bounds)):
                element = tree.Index(place.start, place.end, place, tuple(_integer(place, each) for each in subscripts))
                yield from self.value(element, kind.element, given, None, phase)
            return
        counters = []
        for _ in kind.bounds:
            counters.append(tree.NameRef(place.start, place.end, _counter(self.counters)))
            self.counters += 1
        element = tree.Index(place.start, place.end, place, tuple(counters))
        body = tuple(self.value(element, kind.element, given, None, phase))
        for counter, (low, high) in reversed(list(zip(counters, kind.bounds, strict=True))):
            body = (tree.For(place.start, place.end, counter, _integer(place, low), _integer(place, high), None, body),)
        yield from body

    def _instance(self, place: tree.Expr, block: Pou, given: tuple[tree.Argument, ...], phase: str) -> Iterator[tree.Statement]:
        lineage = [*block.lineage()]
        levels = [level for level in (lineage if phase == EXIT else lineage[::-1]) if _has_own(self.context, level, phase)]
        nearest = next((level.methods[INIT_KEY] for level in block.lineage() if INIT_KEY in level.methods), None)
        named = self._named(place, given, nearest, block.name) if phase == INIT else {}
        for level in levels:
            method = level_method(self.context, level, phase)
            own = [name for name, _ in _inputs(level.methods.get(INIT_KEY))] if phase == INIT else []
            passed = tuple(named[fold(name.text)] for name in own if fold(name.text) in named)
            name = tree.Name(place.start, place.end, method.tree.name.text)
            member = tree.Member(place.start, place.end, place, name)
            end = given[-1].end if given else place.end
            yield tree.CallStatement(place.start, end, tree.Call(place.start, end, member, passed))

    def _named(self, place: tree.Expr, given: Sequence[tree.Argument], init: Pou | None, block: str) -> dict[str, tree.Argument]:
        """The arguments of a declaration by the folded names of inputs of FB_init; what is missing or too much is reported."""
        inputs = _inputs(init)
        names = {fold(name.text): name for name, _ in inputs}
        named: dict[str, tree.Argument] = {}
        free = [name for name, _ in inputs]
        for each in given:
            if each.name is not None and fold(each.name.text) in names:
                key = fold(each.name.text)
                named[key] = each
                free = [name for name in free if fold(name.text) != key]
            elif each.name is None and free:
                name = free.pop(0)
                named[fold(name.text)] = tree.Argument(each.start, each.end, ":=", tree.Name(each.start, each.end, name.text),
                                                       each.value)
            else:
                takes = ", ".join(name.text for name, _ in inputs)
                self._report(each, f"FB_init takes no {each.name.text}" if each.name is not None else
                             f"FB_init takes {len(inputs)} arguments", f"it takes {takes}" if takes else "it takes none")
        for name, value in inputs:
            if value is None and fold(name.text) not in named:
                self._report(place, f"the argument {name.text} of FB_init is missing", f"write __NEW({block}({name.text} := ...))"
                             if isinstance(place, tree.Deref) else
                             f"write {self.source.text[place.start:place.end]} : TYPE({name.text} := ...)")
        return named

    def _report(self, node: tree.Node, message: str, hint: str) -> None:
        self.context.report.add("S1011", self.source, node, message, hint)

    def _initial_values(self, place: tree.Expr, kind: StructType, initial: tree.StructInit) -> Iterator[tree.Statement]:
        """Initial values of inputs that a declaration writes: they hold behind FB_init."""
        for name, value in initial.fields:
            member = kind.member(name.text)
            if member is not None and member.kind == "VAR_INPUT" and not isinstance(value, tree.ArrayInit | tree.StructInit):
                target = tree.Member(place.start, name.end, place, name)
                yield tree.Assign(name.start, value.end, (target,), ":=", value)


def _counter(number: int) -> str:
    return f"element {number}"


def _integer(place: tree.Node, value: int) -> tree.Literal:
    return tree.Literal(place.start, place.end, "int", value, None, str(value))


def _of_elements(spec: tree.TypeSpec) -> list[tuple[tree.Argument, ...]] | None:
    """The arguments of each element of `ARRAY [..] OF F[(x := 1), 2((x := 2))]`; None for any other."""
    values = spec.element.values if isinstance(spec, tree.ArraySpec) and isinstance(spec.element, tree.ConstructedSpec) else None
    if values is None:
        return None
    found: list[tuple[tree.Argument, ...]] = []
    for repetition, value in values.items:
        count = repetition.value if isinstance(repetition, tree.Literal) and isinstance(repetition.value, int) else 1
        fields = value.fields if isinstance(value, tree.StructInit) else ()
        found += count * [tuple(tree.Argument(name.start, each.end, ":=", name, each) for name, each in fields)]
    return found


def _inputs(init: Pou | None) -> list[tuple[tree.Name, tree.Initial | None]]:
    """The inputs of FB_init that declarations give, each with its initial value."""
    if init is None:
        return []
    return [(name, declared.initial) for section in init.tree.sections if section.kind == "VAR_INPUT"
            for declared in section.variables for name in declared.names][_FLAGS:]


# --- what __NEW makes ---------------------------------------------------------------------------------------------------


def of_value(context: Context, source: Source, place: tree.Expr, kind: Type,
             given: tuple[tree.Argument, ...]) -> list[tree.Statement]:
    """The statements that construct a value that __NEW has made.

    place: an expression that names the value.
    given: the arguments of FB_init, if it is an instance."""
    made_of = Statements(context, source, unrolled=True)
    return [statement for phase in PHASES for statement in made_of.value(place, kind, given, None, phase)]


def endings_of_value(context: Context, source: Source, place: tree.Expr, kind: Type, known: Type) -> list[tree.Statement]:
    """The statements that end an instance of type `kind`, in front of a __DELETE of a pointer to the type `known`.

    None if that type has nothing to end: what is only in a derived type is not called then (EcoStruxure Machine Expert,
    __DELETE)."""
    if not constructs(context, known, EXIT):
        return []
    return list(Statements(context, source, unrolled=True).value(place, kind, (), None, EXIT))


# --- methods ----------------------------------------------------------------------------------------------------------


def level_method(context: Context, level: Pou, phase: str) -> Pou:
    """The hidden method that does a phase for a block itself, without what it extends."""
    name = f"{phase} of {level.name}"
    if fold(name) in level.methods:
        return level.methods[fold(name)]
    made_of = Statements(context, level.source)
    body: list[tree.Statement] = []
    at = level.tree.name.start, level.tree.name.end
    kept: dict[str, dict[str, Variable]] = {}
    for variable in _declared(level)[::-1 if phase == EXIT else 1]:
        method_name, _, own = variable.name.partition(".")
        if own:
            kept.setdefault(method_name, {})[own] = variable
        else:
            body += made_of.of(variable, variable.name, phase)
    for method_name, variables in kept.items():
        body += _of_kept(context, level, method_name, variables, phase)
    inputs: tuple[tree.VarSection, ...] = ()
    calls: list[tree.Statement] = []
    for method in _called(context, level, phase):
        passed: list[tree.Argument] = []
        callee: tree.Expr = tree.NameRef(*at, method.tree.name.text)
        if phase == AFTER:
            callee = tree.Member(*at, tree.Deref(*at, tree.NameRef(*at, "THIS")), tree.Name(*at, method.tree.name.text))
        else:
            inputs, passed = _parameters(context, method, phase, at)
        calls.append(tree.CallStatement(*at, tree.Call(*at, callee, tuple(passed))))
    body = [*calls, *body] if phase == EXIT else [*body, *calls]
    written = tree.Pou(*at, "METHOD", tree.Name(*at, name), None, (*inputs, *made_of.sections()), tuple(body))
    made = Pou(f"{level.name}.{phase}", "METHOD", level.source, written, as_written=False, block=level,
               modifiers=frozenset({"FINAL"}))
    if phase == INIT and calls:
        made.variables[fold(KEPT)] = _kept_values(context)
    return _added(context, level, made)


def _kept_values(context: Context) -> Variable:
    """The variable that says whether FB_init is called at a start that keeps RETAIN variables."""
    if context.kept_values is None:
        context.kept_values = flag(KEPT)
        context.global_order.append(context.kept_values)
    return context.kept_values


def flag(name: str, retain: bool = False) -> Variable:
    """A hidden global variable of type BOOL."""
    source = Source(INIT, "{attribute 'hide'}\n" + name)
    node = tree.Name(source.text.index(name), len(source.text), name)
    return Variable(name, BOOL, "VAR_GLOBAL", source, node, place="abs", initial=b"\0", retain=retain)


def _of_kept(context: Context, level: Pou, method_name: str, variables: dict[str, Variable],
             phase: str) -> Iterator[tree.Statement]:
    """The call of a hidden method that constructs the VAR_INST of a method, whose arguments may name each other."""
    if not any(constructs(context, variable.type, phase) for variable in variables.values()):
        return
    at = level.tree.name.start, level.tree.name.end
    name = f"{phase} of {level.name}.{method_name}"
    made_of = Statements(context, level.source)
    body = [statement for own, variable in variables.items() for statement in made_of.of(variable, own, phase)]
    written = tree.Pou(*at, "METHOD", tree.Name(*at, name), None, made_of.sections(), tuple(body))
    made = Pou(f"{level.name}.{method_name}.{phase}", "METHOD", level.source, written, as_written=False, block=level,
               modifiers=frozenset({"FINAL"}))
    made.variables.update({fold(own): variable for own, variable in variables.items()})
    _added(context, level, made)
    yield tree.CallStatement(*at, tree.Call(*at, tree.NameRef(*at, name), ()))


def _added(context: Context, level: Pou, made: Pou) -> Pou:
    """A hidden method, as one of its block whose body is to be checked."""
    level.methods[fold(made.tree.name.text)] = made
    context.project.new_pous.append(made)
    return made


def _parameters(context: Context, method: Pou, phase: str,
                at: tuple[int, int]) -> tuple[tuple[tree.VarSection, ...], list[tree.Argument]]:
    """Inputs for the arguments of FB_init, and the arguments of its call; those of the call of FB_exit."""
    declared = [(name, each, section) for section in method.tree.sections if section.kind == "VAR_INPUT"
                for each in section.variables for name in each.names]
    wanted = FLAGS[phase]
    if phase == INIT and not declared and context.project.dialect.bare_construction:
        return (), []
    if len(declared) < len(wanted) or phase == EXIT and len(declared) > len(wanted):
        how = "begins with two inputs" if phase == INIT else "has one input"
        context.report.add("S1011", method.source, method.tree.name, f"{phase} {how}",
                           f"write VAR_INPUT {', '.join(wanted)} : BOOL; END_VAR")
    values = {"bInitRetains": tree.Unary(*at, "NOT", tree.NameRef(*at, KEPT)),
              "bInCopyCode": truth(at, False)}
    flags = [tree.Argument(*at, ":=", name, values[flag]) for flag, (name, _, _) in zip(wanted, declared, strict=False)]
    given = declared[len(wanted):] if phase == INIT else []
    variables = tuple(changed(each, names=(name,)) for name, each, _ in given)
    passed = [tree.Argument(*at, ":=", name, tree.NameRef(*at, name.text)) for name, _, _ in given]
    return ((tree.VarSection(*at, "VAR_INPUT", (), variables),) if variables else ()), flags + passed


def with_construction(context: Context, pou: Pou) -> tree.Pou:
    """The tree of a POU whose body begins with the construction of the instances that begin anew with it."""
    made_of = Statements(context, pou.source)
    fresh = [each for each in pou.order if (each.kind == "VAR_TEMP" or pou.is_routine and each.kind == "VAR")
             and each.place != "abs" and not each.reference and constructs(context, each.type)]
    body = [statement for phase in PHASES for each in fresh for statement in made_of.of(each, each.name, phase)]
    if not body:
        return pou.tree
    return changed(pou.tree, sections=(*pou.tree.sections, *made_of.sections()), body=(*body, *pou.tree.body))


def truth(at: tuple[int, int], value: bool) -> tree.Literal:
    return tree.Literal(*at, "bool", value, None, "TRUE" if value else "FALSE")
