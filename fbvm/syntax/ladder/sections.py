"""What a POU declares because of its LADDERs, and the call that turns the condition flags OFF at its beginning."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence

from fbvm.syntax.ladder.instructions.instruction_set import instruction_set
from fbvm.syntax.ladder.operands import SYMBOLS
from fbvm.syntax.tree import Call, CallStatement, NamedType, NameRef, VarDecl, VarSection
from fbvm.syntax.tree.ladder import Ladder


def turn_condition_flags_off(ladders: Sequence[Ladder], others: Sequence[Ladder] = ()) -> None:
    """Put a call of CX_Begin in front of the first of a PROGRAM's LADDERs if any rung reads or writes a condition flag, as ER
    or CY.  `others` are LADDERs in front of these, for which that was done."""
    if any(map(_uses_condition_flags, ladders)) and not any(map(_uses_condition_flags, others)):
        first = (*others, *ladders)[0]
        at = first.start
        first.body = (CallStatement(at, at, Call(at, at, NameRef(at, at, "CX_Begin"), ())), *first.body)


def _uses_condition_flags(ladder: Ladder) -> bool:
    rows = instruction_set().rows
    return any(rows[step.mnemonic].does.startswith("CX_") or
               any(SYMBOLS.get(operand.upper(), "").startswith("CF0") for operand in step.operands)
               for rung in ladder.rungs for step in rung.steps)


def hidden_sections(ladders: Sequence[Ladder], sections: Iterable[VarSection], report: Callable[..., None]) -> list[VarSection]:
    """The hidden sections of a POU with these LADDERs: VAR for the memory of steps and for the instances that FBCALL names
    and `sections` do not declare, VAR_TEMP for what lives during one execution.  Reports an instance that `sections`
    declare with another type than FBCALL."""
    start, end = ladders[0].start, ladders[-1].end
    sections = list(sections)
    declared = {name.text for section in sections for variable in section.variables for name in variable.names}
    instances = _undeclared([instance for ladder in ladders for instance in ladder.instances], sections, report)
    kept = {variable.names[0].text: variable for ladder in ladders for variable in ladder.variables}
    temporaries = {variable.names[0].text: variable for ladder in ladders for variable in ladder.temporaries}
    return [VarSection(start, end, kind, (), tuple(variables), True)
            for kind, found in (("VAR", [*kept.values(), *instances]), ("VAR_TEMP", [*temporaries.values()]))
            if (variables := [each for each in found if each.names[0].text not in declared])]


def _undeclared(instances: Iterable[VarDecl], sections: Iterable[VarSection], report: Callable[..., None]) -> list[VarDecl]:
    """Those instances that no section declares; one that is declared with another type has a diagnostic."""
    known = {name.text.upper(): variable for section in sections for variable in section.variables for name in variable.names}
    made: list[VarDecl] = []
    for instance in instances:
        name, spec = instance.names[0], instance.spec
        other = known.setdefault(name.text.upper(), instance)
        if other is instance:
            made.append(instance)
        elif isinstance(other.spec, NamedType) and isinstance(spec, NamedType) and other.spec.text.upper() != spec.text.upper():
            report("S0110", spec.start, name.end, f"{name.text} is an instance of {other.spec.text}, not of {spec.text}", "")
    return made
