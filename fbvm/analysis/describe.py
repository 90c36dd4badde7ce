"""What is known about a name, as Markdown for people: its declaration, its comment, its address, its pins, its page."""

from __future__ import annotations

from fbvm.analysis.comments import comment_at
from fbvm.analysis.declarations import Declared, shown_name
from fbvm.base.areas import FIXED_OR_SIZED_AREAS, Address
from fbvm.base.diagnostics import Source
from fbvm.base.types import EnumType, StructType
from fbvm.check import block_pages
from fbvm.check.calls import functions
from fbvm.check.symbols.facts import Pou, Value, Variable
from fbvm.syntax import tree

PINS = ("VAR_INPUT", "VAR_OUTPUT", "VAR_IN_OUT")
SHORT = {"VAR_INPUT": ":=", "VAR_IN_OUT": ":=", "VAR_OUTPUT": "=>"}


def declaration(declared: Declared) -> str:
    """The declaration of a name as it could be written."""
    if declared.variable is not None:
        return variable(declared.variable)
    if declared.pou is not None and declared.key[0] == "variable":
        return declared.name
    if declared.pou is not None:
        return head(declared.pou)
    return _type(declared)


def variable(declared: Variable) -> str:
    """`VAR_INPUT Level : INT := 5`, with the address behind AT."""
    kind = declared.kind + (" CONSTANT" if declared.constant and declared.kind.startswith("VAR") else "")
    place = f" AT {declared.location}" if declared.location is not None else ""
    written = declared.source.text[declared.node.end:].partition(";")[0]
    value = written.partition(":=")[2].strip() if ":=" in written and "\n" not in written else ""
    return f"{kind} {shown_name(declared)}{place} : {declared.type}" + (f" := {value}" if value else "")


def head(pou: Pou) -> str:
    """The first line of a POU and its pins; of an accessor its property."""
    if pou.kind in ("GET", "SET"):
        value = pou.result or pou.order[0]
        return f"PROPERTY {pou.name.rpartition('.')[0]} : {value.type}"
    result = f" : {pou.result.type}" if pou.result is not None else ""
    lines = [f"{pou.kind} {pou.name}{result}"]
    lines += [f"    {each.kind} {each.name} : {each.type};" for each in pou.order if each.kind in PINS and " " not in each.name]
    return "\n".join(lines)


def _type(declared: Declared) -> str:
    entry = declared.type
    assert entry is not None, "what is no variable and no POU is a type, or a member of one"
    kind = entry.resolved[0] if entry.resolved is not None else None
    if declared.key[0] == "member" and isinstance(kind, EnumType):
        return f"{entry.tree.name.text}#{declared.name} = {kind.members.get(declared.key[3], '')}"
    if declared.key[0] == "member" and isinstance(kind, StructType):
        field = kind.fields.get(declared.key[3])
        return f"{entry.tree.name.text}.{declared.name} : {field.type if field is not None else '?'}"
    return "TYPE " + " ".join(entry.source.text[entry.tree.start:entry.tree.end].split()).removeprefix("TYPE ")


def comment(source: Source, node: tree.Node) -> str:
    """The comment that belongs to a declaration: behind it on its line, else directly above it; "" if there is none."""
    return comment_at(source.text, node.start, node.end)


def markdown(declared: Declared, value: Value | None = None) -> str:
    """All that is known about a declaration."""
    if declared.pou is not None and declared.source.library and declared.key[0] == "pou" and \
            (page := block_pages.page(declared.name)):
        return page.partition("\n")[2].strip()
    lines = ["```st", declaration(declared), "```"]
    if said := comment(declared.source, declared.node):
        lines += ["", said]
    if declared.variable is not None and declared.variable.location is not None:
        area = FIXED_OR_SIZED_AREAS.get(declared.variable.location.area)
        lines += ["", f"At {declared.variable.location}: {area.title}." if area else f"At {declared.variable.location}."]
    if declared.source.library:
        lines += ["", f"Library {declared.source.library}"]
    return "\n".join(lines)


def standard(name: str) -> str:
    """A standard function as Markdown."""
    return f"```st\n{signature(name)}\n```\n\nStandard function (IEC 61131-3)."


def signature(name: str) -> str:
    """`SEL(G : BOOL, IN0 : T, IN1 : T) : T`, with what T stands for."""
    typed = functions.typed_name(name)
    row = functions.SIGNATURES.get(typed[0] if typed is not None else name)
    if row is not None:
        listed = ", ".join(f"{pin} : {kind}" for pin, kind in row.parameters) + (", .." if row.repeats else "")
        limits = f"  (T: {', '.join(row.limits)})" if row.limits else ""
        return f"{name}({listed})" + (f" : {row.result}" if row.result else "") + limits
    if (meant := functions.conversion(name)) is not None:
        return f"{name}(IN : {meant.source or 'ANY'}) : {meant.target}"
    if name in functions.TIME_OPERATORS:
        _, (left, right) = functions.TIME_OPERATORS[name]
        return f"{name}(IN1 : {left}, IN2 : {right})"
    return f"{name}(IN1, IN2)" if name in functions.OPERATORS else f"{name}(...)"


def address(meant: Address, symbols: list[str]) -> str:
    """A PLC memory address as Markdown: its area, and the variables that lie there."""
    area = FIXED_OR_SIZED_AREAS.get(meant.area)
    lines = [f"**{meant}**: {area.title}" if area else f"**{meant}**"]
    return "\n\n".join([*lines, *(f"`{symbol}`" for symbol in symbols)])
