"""What is typed: expressions, the commands of `fbvm step`, completions, and values for hovers and lines."""

from __future__ import annotations

import re
from dataclasses import replace

from fbvm.base.types import ELEMENTARY, LREAL, TIME, Type, fold, string
from fbvm.dap.session import Arguments, Body, DebugSession, Refusal
from fbvm.dap.variables import property_row, text_of, variable
from fbvm.step.commands import COMMANDS_BY_WORD, CommandError, command_of, completed
from fbvm.step.past_session import PastSession
from fbvm.step.properties import PropertyValue
from fbvm.step.session import Session
from fbvm.watch.conditions import ConditionError, parse_expression
from fbvm.watch.paths import Place, Span, UnknownPlace
from fbvm.watch.scanner import code_of
from fbvm.watch.scopes import Scope
from fbvm.watch.values import Value, show

_WORD = re.compile(r"[^\W\d]\w*(?:\s*\.\s*[^\W\d]\w*|\[[^\]]*\])*")
_KINDS: dict[str, Type] = {"number": LREAL, "time": TIME, "text": string()}
"""As what the value of literals alone is shown, by their class."""
KEPT_BACK = {"quit", "break", "unbreak"}
"""Commands that an editor has of its own."""


def evaluate(debug: DebugSession, arguments: Arguments) -> Body:
    """evaluate: an expression, or a command of the stepping language where somebody types; a name goes before a command."""
    text = str(arguments.get("expression", "")).strip()
    if not text:
        raise Refusal("there is nothing to evaluate")
    frame = debug.frame_of(arguments)
    debug.hexadecimal = bool((arguments.get("format") or {}).get("hex"))
    scope = debug.scope(frame)
    plc = frame.plc if frame else None
    try:
        return _value(debug, scope, plc, text, arguments.get("context") == "clipboard")
    except (ConditionError, UnknownPlace) as error:
        context = arguments.get("context")
        if context in (None, "repl") and command_of(text):  # what is watched moves nothing
            return _command(debug, plc, text)
        if context == "repl" and re.search(r":=|(?<![<>])=", text):
            return _command(debug, plc, text)
        name = text.partition("(")[0].strip()
        if debug.plc(plc).properties.is_method(name, scope, debug.plc(plc).player.memory):
            raise Refusal(f"{name} is a method, which may change variables: the debugger calls none; a breakpoint at it shows "
                          "what it does") from None
        raise Refusal(str(error)) from None


class _Names:
    """Finds and reads the names in an expression: places, and properties, which are read when they are found."""

    def __init__(self, session: Session | PastSession, scope: Scope) -> None:
        self._session, self._scope = session, scope
        self._properties: dict[str, PropertyValue] = {}

    def find(self, text: str) -> Place | Span:
        """The place that `text` names, of a property that of its result.  Raises UnknownPlace, and ValueError for a trap."""
        try:
            return self._scope.find(text)
        except UnknownPlace:
            made = self._session.property(text, self._scope)
            if made is None:
                raise
        self._properties[made.place.name] = made
        return made.place

    def read(self, place: Place) -> Value:
        """The value of a place that was found."""
        made = self._properties.get(place.name)
        return made.value if made is not None else self._session.player.read(place)


def _value(debug: DebugSession, scope: Scope, plc: str | None, text: str, is_bare: bool) -> Body:
    session = debug.plc(plc)
    try:
        found = scope.find(text)
    except UnknownPlace:
        found = None
    if isinstance(found, Place):
        row = variable(debug, session, found, found.name, bare=is_bare)
        return {"result": row.pop("value"), **{key: row[key] for key in row if key not in ("name", "evaluateName")}}
    if isinstance(found, Span):
        values = [text_of(debug, session, place) for place in found.places]
        return {"result": "[" + ", ".join(values) + "]", "variablesReference": 0}
    if found is None and (made := session.property(text, scope)):
        row = property_row(debug, session, made, made.place.name)
        return {"result": row["value"], "type": row["type"], "variablesReference": 0, "presentationHint": row["presentationHint"]}
    names = _Names(session, scope)
    term = parse_expression(text, names.find)
    try:
        value = term.value(names.read)
    except (ArithmeticError, TypeError) as error:
        raise ConditionError(f"{text} cannot be computed: {error}") from None
    kind = term.type or ELEMENTARY.get(term.sort) or _KINDS[term.sort]
    return {"result": show(kind, value), "type": term.described, "variablesReference": 0}


def _command(debug: DebugSession, plc: str | None, text: str) -> Body:
    """A line of the language of `fbvm step`."""
    command = command_of(text)
    if command and command.name in KEPT_BACK:
        raise Refusal(f"{command.name}: the editor has that of its own")
    commands = debug.commands(plc)
    before = commands.session.here
    try:
        lines = list(commands.run(text))
    except CommandError as error:
        raise Refusal(str(error)) from None
    if commands.session.here != before or (command is None or command.name in CHANGING):
        debug.moved_by_command = commands.session.here != before
        debug.running.forget()
    return {"result": "\n".join(lines), "variablesReference": 0}


CHANGING = {"write", "force", "unforce", "mode", "power"}


def completions(debug: DebugSession, arguments: Arguments) -> Body:
    """completions: names in the words of `--until`, members behind a dot, and commands at the beginning of a line."""
    text = str(arguments.get("text", ""))
    first = 1 if debug.client.get("columnsStartAt1", True) else 0
    column = arguments.get("column")
    before = text if column is None else text[: max(0, int(column) - first)]
    word = re.split(r"[\s,(=<>+*/-]", before)[-1]
    frame = debug.frame_of(arguments)
    session = debug.plc(frame.plc if frame else None)
    found = dict.fromkeys(completed(session, "place", word, []), "variable")
    instance = debug.scope(frame).instance
    if instance is not None:
        inside = completed(session, "place", f"{instance.name}.{word}", [])
        found |= {name[len(instance.name) + 1 :]: "variable" for name in inside}
    if before.strip() == word and "." not in word:
        found |= {name: "keyword" for name, each in COMMANDS_BY_WORD.items()
                  if name == each.name and name.startswith(fold(word).lower()) and name not in KEPT_BACK}  # fmt: skip
    start = len(before) - len(word) + first
    rows = [{"label": name, "text": name, "type": kind, "start": start, "length": len(word)} for name, kind in found.items()]
    return {"targets": [row for row in rows if "$" not in str(row["label"])]}


def inline_values(debug: DebugSession, arguments: Arguments) -> Body:
    """fbvm/inlineValues: for the lines of a source the values of the variables that they name, in a frame."""
    frame = debug.frame_of(arguments)
    name = debug.sources.name_of(arguments.get("source") or {})
    if name is None:
        return {"values": []}
    session, scope = debug.plc(frame.plc if frame else None), debug.scope(frame)
    first = debug.sources.line(int(arguments.get("startLine") or 1))
    last = debug.sources.line(int(arguments.get("endLine") or arguments.get("startLine") or 1))
    rows: list[Body] = []
    for line, written in debug.sources.lines(name, first, last):
        text = code_of(written)
        seen: set[str] = set()
        for match in _WORD.finditer(text):
            named = _named(debug, session, scope, match[0])
            if named is not None and named[0] not in seen:
                seen.add(named[0])
                rows.append({"line": debug.sources.client_line(line),
                             "column": debug.sources.client_column(name, line, match.start() + 1), "expression": named[0],
                             "text": f"{match[0]} = {named[1]}"})  # fmt: skip
    return {"values": rows}


def _named(debug: DebugSession, session: Session | PastSession, scope: Scope, text: str) -> tuple[str, str] | None:
    """The whole path and the value of a variable or property; None for a block, and for all other words."""
    try:
        found = scope.find(text)
    except UnknownPlace:
        pass
    else:
        is_shown = isinstance(found, Place) and not _is_block(found)
        return (found.name, text_of(debug, session, replace(found))) if isinstance(found, Place) and is_shown else None
    try:
        made = session.property(text, scope)
    except ValueError:  # its accessor ends with a trap
        return None
    if made is None or _is_block(made.place):
        return None
    return made.place.name, str(property_row(debug, session, made, text)["value"])


def _is_block(place: Place) -> bool:
    return getattr(place.type, "block", False) is True

