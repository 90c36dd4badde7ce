"""What constructs and ends the instances that live as long as the program: the bodies in front of the first cycle, in the
order of initialisation, and the body that ends all instances (see `construction`)."""

from __future__ import annotations

from collections.abc import Iterable, Iterator

from fbvm.base.diagnostics import Source
from fbvm.base.hidden import ENDING
from fbvm.base.types import StructType, fold
from fbvm.check.declarations.construction import DONE, EXIT, INIT, KEPT, LAST, PHASES, Statements, constructs, flag, truth
from fbvm.check.symbols.config_facts import Run
from fbvm.check.symbols.context import Context
from fbvm.check.symbols.facts import PROGRAM_SLOT, Pou, Variable
from fbvm.syntax import tree
from fbvm.syntax.st.pragmas import init_slot


def construct_at_start(context: Context) -> None:
    """Let the task that runs first construct all instances that live as long as the program, where there is something to do, and
    make the body that ends them."""
    if not context.tasks:
        return
    source = Source(INIT, "{attribute 'hide'}\nFB_init of all instances")
    at = source.text.index("\n") + 1, len(source.text)
    if ending := _of_sources(context, (EXIT,)):
        _check(context, ending, [_hidden("FUNCTION", ENDING, source, at, _calls(at, [each.name for each in ending]))])
    made, last = _of_sources(context, PHASES), _called_afterwards(context)
    if not made and not last:
        return
    over = flag("FB_init is over")
    flags, begins, ends = [over], [_set(at, over.name, truth(at, True))], []
    if context.kept_values is not None:
        done = context.project.globals["", fold(DONE)] = flag(DONE, retain=True)
        flags += [context.kept_values, done]
        begins.append(_set(at, KEPT, tree.NameRef(*at, DONE)))
        ends = [_set(at, KEPT, truth(at, False)), _set(at, DONE, truth(at, True))]
        context.global_order.append(done)
    context.global_order.append(over)
    names = [*(each.name for each in made), *last]
    is_first = tree.Unary(*at, "NOT", tree.NameRef(*at, over.name))
    statement = tree.If(*at, ((is_first, (*begins, *_calls(at, names), *ends)),), None)
    begun = [_hidden("PROGRAM", INIT, source, at, [statement]) for _ in context.tasks]
    for pou, task in zip(begun, context.tasks, strict=True):
        pou.variables.update({fold(each.name): each for each in flags})
        task.runs.insert(0, Run(task.runs[0].instance, pou))
    _check(context, made, begun)


def _of_sources(context: Context, phases: tuple[str, ...]) -> list[Pou]:
    """The functions that do some phases for all instances that live as long as the program."""
    made = []
    for phase in phases:
        groups: dict[tuple[int, Source], list[Variable]] = {}
        for slot, each in sorted(((_slot(context, each), each) for each in context.global_order), key=lambda row: row[0]):
            if constructs(context, each.type, phase):
                groups.setdefault((slot, each.source), []).append(each)
        made += [_of_source(context, number, group, phase) for number, group in enumerate(groups.values())]
    return made[::-1] if phases == (EXIT,) else made


def _slot(context: Context, variable: Variable) -> int:
    """The place of a global variable or program in the order of initialisation."""
    if variable.kind != "PROGRAM" or not isinstance(variable.type, StructType):
        return variable.init_slot
    return init_slot(context.attributes(context.block_of(variable.type)), PROGRAM_SLOT)


def _called_afterwards(context: Context) -> list[str]:
    """The names of the user's functions that are called once behind all initialisation, in the order of their attributes."""
    slots = [(init_slot(context.attributes(pou), -1, LAST), pou.name) for pou in context.project.pous.values()
             if pou.is_function and not pou.source.library]
    return [name for slot, name in sorted(row for row in slots if row[0] >= 0)]


def _check(context: Context, called: list[Pou], callers: list[Pou]) -> None:
    """Check bodies that call hidden functions, and these; afterwards no name means them."""
    names = {("", fold(each.name)): each for each in called}
    context.project.pous |= names
    for pou in callers:
        context.check_body(pou)
    for key, each in names.items():
        context.check_body(each)
        del context.project.pous[key]


def _hidden(kind: str, name: str, source: Source, at: tuple[int, int], body: Iterable[tree.Statement]) -> Pou:
    return Pou(name, kind, source, tree.Pou(*at, kind, tree.Name(*at, name), None, (), tuple(body)), as_written=False)


def _calls(at: tuple[int, int], functions: list[str]) -> Iterator[tree.Statement]:
    for name in functions:
        yield tree.CallStatement(*at, tree.Call(*at, tree.NameRef(*at, name), ()))


def _set(at: tuple[int, int], name: str, value: tree.Expr) -> tree.Statement:
    return tree.Assign(*at, (tree.NameRef(*at, name),), ":=", value)


def _of_source(context: Context, number_of_source: int, variables: list[Variable], phase: str) -> Pou:
    """The function that constructs the variables of one source.  It is named by a number, since the sources of a program that is
    being edited are parts of files, several with the name of one file."""
    source = variables[0].source
    made_of = Statements(context, source)
    at = variables[0].node.start, variables[0].node.end
    body: list[tree.Statement] = []
    aliases: dict[str, Variable] = {}
    for number, variable in enumerate(variables[::-1] if phase == EXIT else variables):
        name = f"{variable.name} {number}"
        aliases[fold(name)] = variable
        body += made_of.of(variable, name, phase)
    name = f"{phase} of source {number_of_source}"
    written = tree.Pou(*at, "FUNCTION", tree.Name(*at, name), None, made_of.sections(), tuple(body))
    made = Pou(name, "FUNCTION", source, written, as_written=False)
    made.variables.update(aliases)
    return made
