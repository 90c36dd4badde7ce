"""One declaration of variables: its qualifiers, its type and initial bytes, and the variables that it makes."""

from __future__ import annotations

from fbvm.base.areas import FLAG_AREAS
from fbvm.base.diagnostics import Source
from fbvm.base.dialects import Dialect, takers
from fbvm.base.types import ArrayType, Elementary, EnumType, StringType, StructType, base, fold, on_bits
from fbvm.check.declarations.initial_bytes import initial_bytes
from fbvm.check.declarations.locations import location_of
from fbvm.check.declarations.specs import resolve, resolve_parameter
from fbvm.check.expressions.constants import decode
from fbvm.check.expressions.scope import Scope
from fbvm.check.symbols.context import Context
from fbvm.check.symbols.facts import Pou, Variable, is_block
from fbvm.check.symbols.report import Report
from fbvm.check.symbols.reserved_names import refuse_reserved
from fbvm.check.symbols.symbol_table import Resolved
from fbvm.syntax import tree

_QUALIFIERS = {
    "VAR": ("CONSTANT", "RETAIN", "NON_RETAIN", "PERSISTENT"), "VAR_INPUT": ("CONSTANT", "RETAIN", "NON_RETAIN"),
    "VAR_OUTPUT": ("RETAIN", "NON_RETAIN"), "VAR_IN_OUT": ("CONSTANT",), "VAR_TEMP": (), "VAR_EXTERNAL": ("CONSTANT",),
    "VAR_GLOBAL": ("CONSTANT", "RETAIN", "NON_RETAIN", "PERSISTENT"),
    "VAR_INST": ("CONSTANT", "RETAIN", "NON_RETAIN", "PERSISTENT"),
    "VAR_STAT": ("CONSTANT", "RETAIN", "NON_RETAIN", "PERSISTENT"),
}
"""Qualifiers that each kind of section can have."""
_ACCESS = ("PUBLIC", "PRIVATE", "PROTECTED", "INTERNAL")
"""Access words, which blocks and classes have in front of variables; these are not seen from outside in any case."""


def check_qualifiers(report: Report, section: tree.VarSection, source: Source, pou_kind: str, dialect: Dialect) -> None:
    """Report qualifiers that a section of a POU of that kind cannot have."""
    if dialect.persistent_parameters and pou_kind == "FUNCTION_BLOCK" and section.kind in ("VAR_INPUT", "VAR_OUTPUT"):
        return
    words = [fold(q.text) for q in section.qualifiers]
    for word, node in zip(words, section.qualifiers, strict=True):
        if word in _ACCESS and section.kind == "VAR" and pou_kind in ("FUNCTION_BLOCK", "CLASS"):
            continue
        if word not in _QUALIFIERS[section.kind] or (pou_kind == "FUNCTION" and word != "CONSTANT"):
            report.add("S0206", source, node, f"{section.kind} of a {pou_kind} cannot be {word}")
    if "CONSTANT" in words and len(words) > 1 or {"RETAIN", "NON_RETAIN"} <= set(words):
        report.add("S0206", source, section.qualifiers[1], f"{' '.join(words)} exclude one another")


def is_constant(section: tree.VarSection) -> bool:
    """True for a section that is declared CONSTANT."""
    return any(fold(word.text) == "CONSTANT" for word in section.qualifiers)


def type_of(scope: Scope, declared: tree.VarDecl) -> Resolved | None:
    """Type of the declared variables, and their initial bytes without the initial value; None after a diagnostic."""
    return resolve(scope, declared.spec) if scope.pou is None else resolve_parameter(scope, declared.spec)


def initialized(scope: Scope, declared: tree.VarDecl, resolved: Resolved) -> Resolved:
    """The type of declared variables, and their initial bytes with the initial value of the declaration."""
    if declared.initial is None:
        return resolved
    kind, initial = resolved
    references = len(scope.facts.starts)
    initial = initial_bytes(scope, kind, declared.initial, initial)
    if len(scope.facts.starts) > references and declared.location is not None:
        scope.error("S0701", declared.initial, "a reference that lies AT an address is made by the program",
                    "assign it in the body instead")
    return kind, initial


def make_variable(context: Context, declared: tree.VarDecl, name: tree.Name, section: tree.VarSection, source: Source,
                  resolved: Resolved) -> Variable:
    """One variable as declared, with its location but without a place."""
    report = context.report
    refuse_reserved(report, source, name, context.project.dialect, section.kind)
    kind, initial = resolved
    words = {fold(q.text) for q in section.qualifiers} if section.qualifiers else frozenset[str]()
    made = Variable(name.text, kind, section.kind, source, name, initial=initial, constant="CONSTANT" in words,
                    retain=bool({"RETAIN", "PERSISTENT"} & words), explicit=declared.initial is not None,
                    role=section.role, declared=declared)
    if made.constant and is_block(kind) and section.kind == "VAR_IN_OUT" and context.project.dialect.instances_are_values:
        made.constant = False  # CODESYS lets such an instance be called
    elif made.constant and section.kind == "VAR_INPUT" and context.project.dialect.constant_inputs_are_written:
        made.constant = False
    elif made.constant and is_block(kind):
        report.add("S0206", source, name, "an instance cannot be CONSTANT")
    elif made.constant and section.kind not in ("VAR_INPUT", "VAR_IN_OUT"):  # these the caller gives
        _give_value(context, made, declared)
    if declared.location is not None:
        made.location = location_of(context, declared, kind, source)
        place = made.location
        if isinstance(kind, ArrayType) and place is not None and (place.bit is not None or place.area in FLAG_AREAS):
            made.type = on_bits(kind)
    return made


def _give_value(context: Context, made: Variable, declared: tree.VarDecl) -> None:
    """Gives a constant its value."""
    report, facts = context.report, context.facts
    if isinstance(declared.initial, tree.Expr):
        made.wrong = declared.initial in facts.wrong
        made.value = None if made.wrong else facts.constants.get(declared.initial)
    elif declared.initial is not None or isinstance(made.type, StructType | ArrayType):
        return
    elif context.project.dialect.idle_constants:
        report.add("S0193", made.source, made.node, f"the constant {made.name} has no value, and keeps the first one of its type")
        made.value = decode(made.type, made.initial) if isinstance(base(made.type), Elementary | EnumType | StringType) else None
    else:
        report.add("S0701", made.source, made.node, f"the constant {made.name} has no value",
                   f"write := and its value, or take {takers('idle_constants')}")


def later_constant(context: Context, pou: Pou, name: tree.NameRef) -> Variable | None:
    """A CONSTANT of a POU that is declared behind the declaration that names it; None after a diagnostic."""
    declared, section = pou.later[fold(name.text)]
    if fold(name.text) in pou.failed_names or context.chain.too_long:
        return None
    if not is_constant(section):
        context.report.add("S0701", pou.source, name, f"{name.text} has no value yet where this is worked out",
                           "declare it in front, in a VAR CONSTANT section")
        return None
    if declared in pou.later_constants and pou.later_constants[declared] is None:
        context.report.add("S0207", pou.source, name, f"the value of {name.text} needs {name.text} itself")
        return None
    pou.later_constants[declared] = None
    scope = Scope(context, pou.source, pou)
    resolved = type_of(scope, declared)
    if resolved is None:
        return None
    resolved = pou.later_constants[declared] = initialized(scope, declared, resolved)
    node = next(each for each in declared.names if fold(each.text) == fold(name.text))
    return make_variable(context, declared, node, section, pou.source, resolved)
