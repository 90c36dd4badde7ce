"""POUs of the tree as elements of PLCopen XML 2.01: Structured Text as it is, ladder and charts as drawings."""

from __future__ import annotations

import re

from fbvm.interchange.markup import Element, element
from fbvm.interchange.plcopen.schema import KINDS
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
_END = re.compile(r"(?i)END_(?:FUNCTION_BLOCK|FUNCTION|PROGRAM|ACTION)\s*$")
_COLON = re.compile(r"\s*:(?!=)")
_JUMP = re.compile(r"(?i)\bJMP\b")
_LABEL = re.compile(r"(?m)^[ \t]*[^\W\d]\w*[ \t]*:(?!=)")


def pou(types: Types, declared: tree.Pou) -> Element:
    """The element of a POU.  Raises NotExportable if the POU has something for which the format has no form."""
    for refused in declared.refused:
        raise NotExportable(refused, f"{refused.what} is not exported", "")
    if declared.accesses:
        raise NotExportable(declared.accesses[0], "VAR_ACCESS of a POU is not exported", "")
    _refuse_objects(declared)
    sections = [section for section in declared.sections if not section.hidden]
    variables = [variable for section in sections for variable in section.variables]
    types.note(sections)
    types.instances = {name.text.upper(): variable.spec.text for variable in variables for name in variable.names
                       if isinstance(variable.spec, tree.NamedType)}
    lists = [types.section(section) for section in sections if section.variables]
    taken = {name.text.upper() for variable in variables for name in variable.names}
    transitions: list[Element] = []
    if declared.body and isinstance(declared.body[0], Sfc):
        inner, transitions, instances = _chart(types, declared.body[0], taken)
    else:
        inner, instances = _body(types, declared.body, *_span(types, declared), taken)
    actions = [_action(types, action, taken, instances) for action in declared.actions if not _is_hidden(action)]
    if instances:
        lists.append(element("localVars", *instances.values()))
    result = element("returnType", types.spec(declared.result)) if declared.result is not None else None
    return element("pou", element("interface", result, *lists), _unless_empty("actions", actions),
                   _unless_empty("transitions", transitions), element("body", inner),
                   name=declared.name.text, pouType=TYPES_OF_POUS[declared.kind])


def _refuse_objects(declared: tree.Pou) -> None:
    """TC6 2.01 is older than the objects of edition 3: it has neither kinds of POUs nor elements for them."""
    hint = "put what other tools are to read into function blocks and functions without objects"
    if declared.kind not in TYPES_OF_POUS:
        raise NotExportable(declared.name, f"{declared.kind} is not exported", hint)
    for nodes, what in ((declared.bases, "EXTENDS"), (declared.interfaces, "IMPLEMENTS"), (declared.modifiers, "")):
        if nodes:
            raise NotExportable(nodes[0], f"{what or nodes[0].text.upper()} is not exported", hint)
    if declared.methods:
        method = declared.methods[0]
        raise NotExportable(method.name, f"{method.kind} {method.name.text} is not exported", hint)


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
    heads: list[tree.Node] = [declared.name, *(s for s in declared.sections if not s.hidden)]
    if declared.result is not None:
        heads.append(declared.result)
    start = max(node.end for node in heads)
    text = types.source.text
    while text[start:start + 1] in (" ", "\t", ";"):
        start += 1
    found = _END.search(text, start, declared.end)
    end = found.start() if found else declared.end
    written = [action.start for action in declared.actions if start <= action.start < end and not _is_hidden(action)]
    return start, min([end, *written])


def _action(types: Types, action: tree.Action, taken: set[str], instances: dict[str, Element]) -> Element:
    text = types.source.text
    start = action.name.end
    if colon := _COLON.match(text, start):
        start = colon.end()
    found = _END.search(text, start, action.end)
    inner, more = _body(types, action.body, start, found.start() if found else action.end, taken)
    instances |= more
    return element("action", element("body", inner), name=action.name.text)


def _body(types: Types, body: tree.Block, start: int, end: int, taken: set[str]) -> tuple[Element, dict[str, Element]]:
    """The element of a body, and the variables that the POU must declare for it, by name.  Raises NotExportable."""
    for statement in body:
        if isinstance(statement, tree.RefusedStatement):
            raise NotExportable(statement, f"{statement.what} is not exported", "")
    text = types.source.text[start:end]
    if not any(isinstance(statement, Ladder) for statement in body):
        types.kept.append((start, end))
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
            rungs.ladder(statement)
        else:
            statements.write(statement)
    return element("LD", *drawing.elements), rungs.declared


def _is_list(body: tree.Block) -> bool:
    """Whether a body is an instruction list; its jumps back have become loops around parts of it."""
    return any(isinstance(each, InstructionList) or isinstance(each, tree.Repeat) and _is_list(each.body)
               or isinstance(each, tree.If) and any(_is_list(inner) for _, inner in each.branches) for each in body)  # fmt: skip


def _without_ladder(text: str) -> str:
    return re.sub(r"(?is)^[ \t]*LADDER\b.*?^[ \t]*END_LADDER\b", "", text, flags=re.M)


def _dedented(text: str) -> str:
    """A text without its common indentation and without empty lines around it."""
    lines = text.expandtabs(4).split("\n")
    first, *more = lines
    margin = min((len(line) - len(line.lstrip()) for line in more if line.strip()), default=0)
    moved = [first.strip(), *(line[margin:].rstrip() for line in more)]
    return "\n".join(moved).strip("\n")
