"""What can be written at a place: members, pins, types, addresses, instructions, names and words of the language."""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, replace
from functools import cache

from fbvm.analysis import describe
from fbvm.analysis.calls import OPEN_COMMENT, open_call, pins, without_comments
from fbvm.analysis.hover import all_located
from fbvm.analysis.names import key_of
from fbvm.analysis.program import Program
from fbvm.analysis.scopes import Member, Scope, scope_at
from fbvm.base.areas import AREAS, FLAG_AREAS, SHARED_AREAS, SIZED_AREAS, Address, with_sizes_apart
from fbvm.base.types import ELEMENTARY, EnumType, fold
from fbvm.check import block_pages
from fbvm.check.calls import functions
from fbvm.check.instructions import meaning
from fbvm.syntax.ladder.instructions.instruction_set import instruction_set

STATEMENTS = {
    "IF": "IF ${1:condition} THEN\n\t$0\nEND_IF;", "CASE": "CASE ${1:value} OF\n\t${2:0}: $0\nEND_CASE;",
    "FOR": "FOR ${1:i} := ${2:0} TO ${3:9} DO\n\t$0\nEND_FOR;", "WHILE": "WHILE ${1:condition} DO\n\t$0\nEND_WHILE;",
    "REPEAT": "REPEAT\n\t$0\nUNTIL ${1:condition} END_REPEAT;", "RETURN": "RETURN;", "EXIT": "EXIT;", "CONTINUE": "CONTINUE;",
    "ELSIF": "ELSIF ${1:condition} THEN\n\t$0", "ELSE": "ELSE\n\t$0", "LADDER": "LADDER\n\t$0\nEND_LADDER"}
DECLARATIONS = {
    "FUNCTION_BLOCK": "FUNCTION_BLOCK ${1:Name}\nVAR_INPUT\n\t$2\nEND_VAR\nVAR_OUTPUT\nEND_VAR\n$0\nEND_FUNCTION_BLOCK",
    "FUNCTION": "FUNCTION ${1:Name} : ${2:INT}\nVAR_INPUT\n\t$3\nEND_VAR\n$0\nEND_FUNCTION",
    "PROGRAM": "PROGRAM ${1:Main}\nVAR\n\t$2\nEND_VAR\n$0\nEND_PROGRAM",
    "INTERFACE": "INTERFACE ${1:Name}\nMETHOD ${2:Do} : ${3:BOOL}\nEND_METHOD\nEND_INTERFACE",
    "TYPE": "TYPE\n\t${1:Name} : STRUCT\n\t\t$0\n\tEND_STRUCT;\nEND_TYPE", "VAR_GLOBAL": "VAR_GLOBAL\n\t$0\nEND_VAR"}
SECTIONS = {word: f"{word}\n\t$0\nEND_VAR" for word in (
    "VAR", "VAR_INPUT", "VAR_OUTPUT", "VAR_IN_OUT", "VAR_TEMP", "VAR_EXTERNAL", "VAR CONSTANT")}
METHODS = {"METHOD": "METHOD ${1:Name} : ${2:INT}\nVAR_INPUT\n\t$3\nEND_VAR\n\t$0\nEND_METHOD",
           "PROPERTY": "PROPERTY ${1:Name} : ${2:INT}\nGET\n\t$0\nEND_GET\nEND_PROPERTY"}
DYNAMIC = {"__NEW": "pointer := __NEW(TYPE), __NEW(TYPE, count), __NEW(BLOCK(arguments of FB_init))",
           "__DELETE": "__DELETE(pointer)"}
OPERATORS = ("AND", "OR", "XOR", "NOT", "MOD", "TRUE", "FALSE")
_PATH = re.compile(r"([A-Za-z_]\w*(?:\s*\[[^\[\]]*\]|\^|\.[A-Za-z_]\w*)*)\.\w*\Z")
_TYPED = re.compile(r"([A-Za-z_]\w*)#\w*\Z")
_AT = re.compile(r"\bAT\s+%?[\w. ]*\Z", re.I)
_OF_TYPE = re.compile(r"(?::|\bOF|\bTO)\s+\w*\Z|:\s*\w*\Z", re.I)
_MADE = re.compile(r"\b__NEW\s*\(\s*\w*\Z", re.I)
_KINDS = {"field": "variable", "enumeration": "type"}
"""The kinds of members that are called otherwise as items."""
_NO_TYPES, _ONLY_TYPES = ("field", "function"), ("block", "type")
"""Kinds of members that are no types of variables, and those that nothing but a declaration names."""
_ADDRESS = re.compile(r"%\w*\Z")
_WORD = re.compile(r"[@%!\w]*\Z")
_QUOTE = re.compile(r"['\"]")


@dataclass(frozen=True)
class Item:
    """Something that can be written.  `insert` is a snippet (`$0` is where the cursor goes) if it is not the label itself;
    `kind` is "variable", "pin", "function", "block", "type", "enumerator", "keyword", "address", "instruction", "action",
    "method", "property" or "namespace"; `page` is the name under which `documentation` finds more."""

    label: str
    kind: str
    detail: str = ""
    insert: str = ""
    page: str = ""
    rank: int = 5
    """Items with a smaller number stand in front."""


def complete(program: Program, name: str, offset: int) -> list[Item]:
    """What can be written at a place of a file, the nearest first; an editor keeps what begins with the letters there."""
    scope = scope_at(program, name, offset)
    if scope is None:
        return []
    text = without_comments(scope.part.source.text[:offset - scope.part.base])
    line = text[text.rfind("\n") + 1:]
    if _in_comment(text, line):
        return []
    if path := _PATH.search(line):
        unfit = _NO_TYPES if _in_section(text) and _OF_TYPE.search(line[:path.start()]) else _ONLY_TYPES
        return [_member(each, rank=1) for each in scope.members(path[1]) if each.kind not in unfit]
    if typed := _TYPED.search(line):
        return [Item(each.name, each.kind, each.type, rank=1) for each in scope.members(typed[1]) if each.kind == "enumerator"]
    if _AT.search(line):
        return list(_free_addresses(program))
    if _ADDRESS.search(line):
        return [Item(str(each.location), "address", f"{each.name} : {each.type}") for each in all_located(program)]
    if _in_ladder(text):
        return list(_rung(scope, line))
    if _in_section(text):
        return list(_types(program, scope)) if _OF_TYPE.search(line) else [Item("END_VAR", "keyword")]
    if _is_outside(text):
        return [Item(word, "keyword", insert=snippet) for word, snippet in DECLARATIONS.items()]
    if _MADE.search(line):
        return list(_types(program, scope))
    return [*_pins(program, name, offset), *_named(program, scope, text)]


def _member(member: Member, rank: int) -> Item:
    insert = f"{member.name}($0)" if member.kind in ("method", "function") else ""
    return Item(member.name, _KINDS.get(member.kind, member.kind), member.type, insert, rank=rank)


def documentation(page: str) -> str:
    """More about an item, as Markdown; "" if there is no more."""
    return block_pages.page(page) or ""


def _in_comment(text: str, line: str) -> bool:
    """True in a comment or a text, which has no end in front of the place."""
    return OPEN_COMMENT.search(text) is not None or _QUOTE.search(line) is not None and not _in_ladder(text)


def _in_ladder(text: str) -> bool:
    upper = fold(text)
    return upper.rfind("END_LADDER") < upper.rfind("LADDER") - len("END_")


_SECTION = re.compile(r"^[ \t]*(VAR(?:_[A-Z_]+)?|END_VAR)\b|\b(END_VAR)\b", re.I | re.M)


def _in_section(text: str) -> bool:
    last = None
    for last in _SECTION.finditer(text):  # noqa: B007
        pass
    return last is not None and fold(last[0].strip()) != "END_VAR"


def _is_outside(text: str) -> bool:
    """True in front of the first declaration of a part."""
    return re.search(r"\b(?:FUNCTION|FUNCTION_BLOCK|PROGRAM|TYPE|CONFIGURATION|ACTION|VAR_GLOBAL)\b\s*\w*\s", text, re.I) is None


def _pins(program: Program, name: str, offset: int) -> Iterator[Item]:
    """The pins of the open call that have no argument yet."""
    call = open_call(program, name, offset)
    if call is None or ":=" in call.before[-1] or "=>" in call.before[-1]:
        return
    pou = call.pou
    for number, pin in enumerate(pins(pou) if pou is not None else ()):
        if fold(pin.name) not in call.given:
            sign = describe.SHORT[pin.kind]
            yield Item(f"{pin.name} {sign}", "pin", f"{pin.kind} {pin.type}", f"{pin.name} {sign} $0", rank=number // 100)


def _named(program: Program, scope: Scope, text: str) -> Iterator[Item]:
    yield from _variables(scope)
    yield from (Item(each.name, "action", "ACTION", f"{each.name}();", rank=3) for each in scope.actions())
    yield from (_member(each, rank=3) for each in scope.methods())
    project = scope.checker.project
    for pou in list(project.pous.values()):
        if pou.is_function and not pou.source.library:
            yield Item(pou.name, "function", describe.head(pou).partition("\n")[0], f"{pou.name}($0)", rank=4)
    for entry in list(project.types.values()):
        kind = entry.resolved[0] if entry.resolved is not None and not entry.source.library else None
        if isinstance(kind, EnumType):
            yield from (Item(member, "enumerator", kind.name, rank=4) for member in kind.shown.values())
    for function in (*functions.SIGNATURES, *functions.OPERATORS):
        if not function.startswith("__"):
            yield Item(function, "function", describe.signature(function), f"{function}($0)", rank=6)
    if program.dialect.dynamic_memory:
        yield from (Item(word, "function", detail, f"{word}($0)", rank=6) for word, detail in DYNAMIC.items())
    yield from (Item(word, "keyword", insert=snippet, rank=7) for word, snippet in {**STATEMENTS, **SECTIONS, **METHODS}.items())
    yield from (Item(word, "keyword", rank=7) for word in OPERATORS)
    yield from (replace(item, rank=8) for item in _blocks(program, scope) if item.kind == "function")


def _variables(scope: Scope) -> Iterator[Item]:
    own = scope.pou.owner.name if scope.pou is not None else ""
    for each in scope.variables():
        if " " not in each.name or each.kind == "VAR_INPUT":
            name = each.name.partition(" ")[0]
            yield Item(name, "variable", f"{each.kind} {each.type}" + (f" AT {each.location}" if each.location else ""),
                       rank=2 if key_of(each)[2:3] == (fold(own),) else 3)


def _types(program: Program, scope: Scope) -> Iterator[Item]:
    yield from (Item(kind, "type", rank=2) for kind in (*ELEMENTARY, "STRING", "WSTRING"))
    project = scope.checker.project
    yield from (Item(entry.name, "type", rank=1) for entry in list(project.types.values()) if not entry.source.library)
    yield from (Item(pou.name, "block", "FUNCTION_BLOCK", rank=1) for pou in list(project.pous.values())
                if pou.kind == "FUNCTION_BLOCK" and not pou.source.library)
    yield from (Item(word, "keyword", insert=snippet, rank=3) for word, snippet in (
        ("ARRAY", "ARRAY [${1:0..9}] OF $0"), ("REF_TO", "REF_TO $0"), ("POINTER TO", "POINTER TO $0")))
    yield from (item for item in _blocks(program, scope) if item.kind == "block")


def _blocks(program: Program, scope: Scope) -> Iterator[Item]:
    """What the libraries have."""
    own = {fold(pou.name) for pou in scope.checker.project.pous.values() if not pou.source.library}
    for name in sorted(set(scope.checker.project.libraries.block_names())):
        item = _block(name)
        if item is not None and fold(name) not in own:
            yield item


@cache
def _block(name: str) -> Item | None:
    """A block or function of the shipped libraries; None for those that only the compiler calls."""
    page = block_pages.page(name)
    if page is None or name.startswith(("CX_", "SFC_", "_")):
        return None
    kind = "block" if "\nFUNCTION_BLOCK" in page else "function"
    return Item(name, kind, page.splitlines()[-1], "" if kind == "block" else f"{name}($0)", name, 4)


def _free_addresses(program: Program) -> Iterator[Item]:
    """For each area in use the address behind the last variable, and the areas."""
    behind: dict[str, int] = {}
    for each in all_located(program):
        assert each.location is not None
        area = each.location.area
        behind[area] = max(behind.get(area, 0), _behind(each.location, each.type.size))
    apart = program.dialect.sizes_apart
    for area, row in (with_sizes_apart(AREAS, SIZED_AREAS.values()) if apart else AREAS).items():
        label = f"%{area}" if area in SHARED_AREAS else area
        free = behind.get(area)
        if free is not None:
            text = f"%{area}W{free}" if area in SHARED_AREAS else \
                f"{area} {free}" if area == "CIO" else f"{area}{free}"
            yield Item(text, "address", f"the next free {'place' if area in SIZED_AREAS else 'word'}: {row.title}", rank=1)
        yield Item(label, "address", row.title, rank=2)


def _behind(location: Address, size: int) -> int:
    """The number of the first address behind `size` bytes: of a word, where an area has no addresses of one size only."""
    if location.area in FLAG_AREAS:
        return location.number + size
    unit = max(1, SIZED_AREAS[location.area].address_bits // 8) if location.area in SIZED_AREAS else 2
    return -(-(location.byte_offset() + size) // unit)


def _rung(scope: Scope, line: str) -> Iterator[Item]:
    """Instructions at the beginning of a line, behind them what can be an operand."""
    if _WORD.sub("", line).strip():
        yield from _variables(scope)
        return
    for row in instruction_set().rows.values():
        if row.does:
            operands = " ".join(f"${{{number}:{name}}}" for number, name in enumerate(row.names, 1))
            yield Item(row.mnemonic, "instruction", meaning(row), f"{row.mnemonic} {operands}".rstrip())


def nearest(items: Iterable[Item]) -> list[Item]:
    """The items, each label once, the nearest first."""
    kept: dict[str, Item] = {}
    for item in sorted(items, key=lambda item: (item.rank, item.label)):
        kept.setdefault(item.label, item)
    return list(kept.values())
