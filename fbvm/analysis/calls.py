"""The call that is being written at a place: whom it calls, and which of its arguments the place belongs to."""

from __future__ import annotations

import re
from dataclasses import dataclass

from fbvm.analysis import describe
from fbvm.analysis.program import Program
from fbvm.analysis.scopes import PATH, Scope, scope_at
from fbvm.base.types import fold
from fbvm.check.calls import functions
from fbvm.check.symbols.facts import Pou, Variable
from fbvm.syntax.st.comments import BRACKETED, LINE, TEXT

_MOST = 4000
"""Characters in front of a place in which the call is searched."""
_SKIPPED = re.compile(rf"{LINE}(?=\n)|{BRACKETED}|{TEXT}", re.S)
OPEN_COMMENT = re.compile(r"//|\(\*|/\*")
"""Where a comment begins that has no end; for texts from `without_comments`."""
_NAMED = re.compile(r"\s*([A-Za-z_]\w*)\s*(?::=|=>)")


@dataclass(frozen=True)
class OpenCall:
    """A call whose bracket is open at a place.  `before` are its arguments as written, the last one up to the place."""

    path: str
    before: tuple[str, ...]
    scope: Scope

    @property
    def pou(self) -> Pou | None:
        return self.scope.callee(self.path)

    @property
    def given(self) -> set[str]:
        """The folded names of the arguments in front of the place."""
        return {fold(found[1]) for each in self.before[:-1] if (found := _NAMED.match(each))}


@dataclass(frozen=True)
class Signature:
    """A function or block as it is called; `label` is the whole, `parameters` pieces of it, `active` the number of the one that
    is being written, None if it has no such."""

    label: str
    documentation: str
    parameters: tuple[str, ...]
    active: int | None


def pins(pou: Pou) -> list[Variable]:
    """The pins of a POU in the order of writing."""
    return [each for each in pou.order if each.kind in describe.PINS and " " not in each.name]


def without_comments(text: str) -> str:
    """A text with spaces in place of comments and texts that have an end in it; lines stay lines."""
    return _SKIPPED.sub(lambda found: re.sub(r"[^\n]", " ", found[0]), text)


def open_call(program: Program, name: str, offset: int) -> OpenCall | None:
    """The innermost call whose bracket is open at a place of a file."""
    scope = scope_at(program, name, offset)
    if scope is None:
        return None
    text = scope.part.source.text[:offset - scope.part.base]
    text = without_comments(text[-_MOST:])
    if OPEN_COMMENT.search(text) is not None:
        return None
    depth, ends = 0, [len(text)]
    for at in range(len(text) - 1, -1, -1):
        sign = text[at]
        if sign in ")]":
            depth += 1
        elif sign in "([" and depth:
            depth -= 1
        elif sign == ";" and not depth:
            return None
        elif sign == "," and not depth:
            ends.append(at)
        elif sign == "(":
            path = PATH.search(text, 0, at)
            ends.append(at)
            spans = zip(reversed(ends), [*reversed(ends)][1:], strict=False)
            return OpenCall(path[1], tuple(text[start + 1:end] for start, end in spans), scope) if path else None
        elif sign == "[":
            return None
    return None


def signature(program: Program, name: str, offset: int) -> Signature | None:
    """How what is called at a place of a file is called."""
    call = open_call(program, name, offset)
    if call is None:
        return None
    current = _NAMED.match(call.before[-1])
    position = len(call.before) - 1
    pou = call.pou
    if pou is not None:
        listed = pins(pou)
        parameters = [f"{pin.name} {describe.SHORT[pin.kind]} {pin.type}" for pin in listed]
        names = [fold(pin.name) for pin in listed]
        result = f" : {pou.result.type}" if pou.result is not None else ""
        said = describe.comment(pou.source, pou.tree.name)
        return _signature(pou.name, parameters, names, result, said, current, position)
    folded = fold(call.path)
    if not functions.is_standard(folded):
        return None
    label = describe.signature(folded)
    inside = label[label.index("(") + 1:].partition(")")[0]
    parameters = [each.strip() for each in inside.split(",")] if inside else []
    names = [fold(each.partition(" ")[0]) for each in parameters]
    at = names.index(fold(current[1])) if current and fold(current[1]) in names else min(position, len(parameters) - 1)
    return Signature(label, "", tuple(parameters), at if parameters else None)


def _signature(name: str, parameters: list[str], names: list[str], result: str, said: str, current: re.Match[str] | None,
               position: int) -> Signature:
    if current is not None:
        active = names.index(fold(current[1])) if fold(current[1]) in names else None
    else:
        active = position if position < len(names) else None
    return Signature(f"{name}({', '.join(parameters)}){result}", said, tuple(parameters), active)
