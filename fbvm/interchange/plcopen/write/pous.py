"""POUs of the tree as elements of PLCopen XML 2.01: Structured Text as it is, ladder and charts as drawings."""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence

from fbvm.interchange.markup import Element, element
from fbvm.interchange.plcopen.schema import KINDS
from fbvm.interchange.plcopen.write import objects
from fbvm.interchange.plcopen.write.charts import ChartWriter
from fbvm.interchange.plcopen.write.layout import Drawing
from fbvm.interchange.plcopen.write.rungs import RungWriter
from fbvm.interchange.plcopen.write.statements import StatementWriter
from fbvm.interchange.plcopen.write.types import NotExportable, Types
from fbvm.syntax import tree
from fbvm.syntax.tree.il import InstructionList
from fbvm.syntax.tree.ladder import Ladder
from fbvm.syntax.tree.sfc import Sfc

TYPES_OF_POUS = {kind: name for name, kind in KINDS.items()}
_COLON = re.compile(r"\s*:(?!=)")
_JUMP = re.compile(r"(?i)\bJMP\b")
_LABEL = re.compile(r"(?m)^[ \t]*[^\W\d]\w*[ \t]*:(?!=)")


def pou(types: Types, declared: tree.Pou) -> Element:
    """The element of a POU.  Raises NotExportable if the POU has something for which the format has no form."""
    for refused in declared.refused:
        raise NotExportable(refused, f"{refused.what} is not exported", "")
    if declared.accesses:
        raise NotExportable(declared.accesses[0], "VAR_ACCESS of a POU is not exported", "")
    if declared.kind not in TYPES_OF_POUS:
        raise NotExportable(declared.name, f"{declared.kind} is not exported", objects.HINT)
    if declared.usings:
        raise NotExportable(declared.usings[0], "USING is not exported", "write whole names")
    if objects.is_object(declared):
        types.foreign.append((declared.name, f"the objects of {declared.name.text} are kept as CODESYS and TwinCAT have them; "
                              "other tools do not read them"))
    sections = [section for section in declared.sections if not section.hidden]
    variables = [variable for section in sections for variable in section.variables]
    types.note(sections)
    types.instances = _instances(variables)
    lists = objects.lists(types, declared)
    names = {name.text.upper() for variable in variables for name in variable.names}
    taken = set(names)
    transitions: list[Element] = []
    if declared.body and isinstance(declared.body[0], Sfc):
        inner, transitions, instances = _chart(types, declared.body[0], taken)
    else:
        inner, instances = _body(types, declared.body, *_span(types, declared), taken, objects.spans(types, declared))
    actions = [_action(types, action, taken, instances) for action in declared.actions if not _is_hidden(action)]
    if instances:
        lists.append(element("localVars", *instances.values()))
    members = objects.members(types, declared, lambda method, start, end: _method_body(types, method, start, end, names))
    result = element("returnType", types.spec(declared.result)) if declared.result is not None else None
    head = objects.added(objects.inherited("pouinheritance", declared.bases, declared.interfaces),
                         objects.access([word.text for word in declared.modifiers]), objects.attributes(types, declared.start))
    return element("pou", element("interface", result, *lists, head), _unless_empty("actions", actions),
                   _unless_empty("transitions", transitions), element("body", inner), objects.added(*members),
                   name=declared.name.text, pouType=TYPES_OF_POUS[declared.kind])


def _instances(variables: Sequence[tree.VarDecl]) -> dict[str, str]:
    """By the names of variables in capitals, the names of their types."""
    return {name.text.upper(): variable.spec.text for variable in variables for name in variable.names
            if isinstance(variable.spec, tree.NamedType)}


def _method_body(types: Types, method: tree.Pou, start: int, end: int, taken: set[str]) -> Element:
    """The element of the body of a method, which has nothing that lasts from one call to the next.  Raises NotExportable."""
    variables = [variable for section in method.sections if not section.hidden for variable in section.variables]
    outer, types.instances = types.instances, types.instances | _instances(variables)
    inner, instances = _body(types, method.body, start, end,
                             taken | {name.text.upper() for variable in variables for name in variable.names})
    types.instances = outer
    if instances:
        raise NotExportable(method.name, f"the rungs of {method.kind} {method.name.text} need memory of their own", objects.HINT)
    return inner


def add_action(types: Types, made: Element, action: tree.Action) -> None:
    """Add an action that stands outside of its POU to the element of that.  Raises NotExportable."""
    interface = made.one("interface")
    assert interface is not None
    taken = {inner.get("name").upper() for inner in interface.walk() if inner.name == "variable"}
    instances: dict[str, Element] = {}
    written = _action(types, action, taken, instances)
    if instances:
        lists = [at for at, part in enumerate(interface.content) if isinstance(part, Element) and part.name != "addData"]
        place = lists[-1] + 1 if lists else 0
        interface.content.insert(place, element("localVars", *instances.values()))
    holder = made.one("actions")
    if holder is None:
        holder = element("actions")
        made.content.insert(made.content.index(interface) + 1, holder)
    holder.content.append(written)


def _is_hidden(action: tree.Action) -> bool:
    """Whether an action is a subroutine of a LADDER, which has no name that can be written."""
    return action.name.text.startswith("$")


def _unless_empty(name: str, elements: list[Element]) -> Element | None:
    return element(name, *elements) if elements else None


def _chart(types: Types, chart: Sfc, taken: set[str]) -> tuple[Element, list[Element], dict[str, Element]]:
    """The element of a chart; the elements of its transitions that have bodies; the variables that these bodies need, by name."""
    instances: dict[str, Element] = {}

    def body(statements: tree.Block, start: int, end: int) -> Element:
        made, more = _body(types, statements, start, end, taken)
        instances.update(more)
        return made

    writer = ChartWriter(types, chart, body)
    drawn = element("SFC", *writer.write())
    return drawn, writer.named, instances


def _span(types: Types, declared: tree.Pou) -> tuple[int, int]:
    """Where the body of a POU begins and ends in the text."""
    start, end = objects.body_span(types, declared)
    written = [action.start for action in declared.actions if start <= action.start < end and not _is_hidden(action)]
    return start, min([end, *written])


def _action(types: Types, action: tree.Action, taken: set[str], instances: dict[str, Element]) -> Element:
    text = types.source.text
    start = action.name.end
    if colon := _COLON.match(text, start):
        start = colon.end()
    found = objects.END.search(text, start, action.end)
    inner, more = _body(types, action.body, start, found.start() if found else action.end, taken)
    instances |= more
    return element("action", element("body", inner), name=action.name.text)


def _body(types: Types, body: tree.Block, start: int, end: int, taken: set[str],
          without: Sequence[objects.Span] = ()) -> tuple[Element, dict[str, Element]]:
    """The element of a body, and the variables that the POU must declare for it, by name; `without` are parts of the text that
    stand in it and are no part of it.  Raises NotExportable."""
    for statement in body:
        if isinstance(statement, tree.RefusedStatement):
            raise NotExportable(statement, f"{statement.what} is not exported", "")
    pieces = [*_pieces(start, end, without)]
    text = "".join(types.source.text[begin:until] for begin, until in pieces)
    if not any(isinstance(statement, Ladder) for statement in body):
        types.kept += pieces
        # Beremiz takes an element without any text for none.
        return element("IL" if _is_list(body) else "ST", element("xhtml:p", _dedented(text) or "\n")), {}
    if len(body) > 1 and (_JUMP.search(text) or _LABEL.search(_without_ladder(text))):
        raise NotExportable(body[0], "jumps between rungs are not exported", "put the statements into a POU of Structured Text")
    drawing = Drawing()
    rungs = RungWriter(drawing, types, taken)
    statements = StatementWriter(drawing, types)
    for statement in body:
        if isinstance(statement, Ladder):
            statements.end_network()
            rungs.ladder(statement, statement is body[-1])
        else:
            statements.write(statement)
    return element("LD", *drawing.elements), rungs.declared


def _pieces(start: int, end: int, without: Sequence[objects.Span]) -> Iterator[objects.Span]:
    """What is left of a part of the text without some parts of it."""
    for begin, until in without:
        if start < end and begin < end:
            yield start, max(start, begin)
            start = max(start, until)
    yield start, max(start, end)


def _is_list(body: tree.Block) -> bool:
    """Whether a body is an instruction list; a jump back has become a loop around it."""
    return any(isinstance(each, InstructionList) or isinstance(each, tree.Repeat) and _is_list(each.body) for each in body)


def _without_ladder(text: str) -> str:
    return re.sub(r"(?is)^[ \t]*LADDER\b.*?^[ \t]*END_LADDER\b", "", text, flags=re.M)


def _dedented(text: str) -> str:
    """A text without its common indentation and without empty lines around it."""
    lines = text.expandtabs(4).split("\n")
    first, *more = lines
    margin = min((len(line) - len(line.lstrip()) for line in more if line.strip()), default=0)
    moved = [first.strip(), *(line[margin:].rstrip() for line in more)]
    return "\n".join(moved).strip("\n")
