"""Pragmas: which ones are ignored without a warning, since they only concern editors and other tools, and which ones matter."""

from __future__ import annotations

import re
from collections.abc import Iterator

from fbvm.base.diagnostics import Source
from fbvm.syntax.tree import Declaration, Pragma, SourceText, VarSection

WORDS = {"region", "endregion", "warning", "info", "text", "elsif", "else", "end_if", "flow", "noflow", "attribute"}
"""First words of pragmas for the reader or for messages of a compiler that we are not, of those that go on with an IF, which was
warned of, and of attributes without quotes, which tools beside the compiler read (`attribute clr [...]` of Inxton)."""

ATTRIBUTES = {
    "qualified_only", "strict", "hide", "hide_all_locals", "conditionalshow", "conditionalshow_all_locals", "displaymode",
    "monitoring", "symbol", "linkalways", "naming", "obsolete", "analysis", "estimated-stack-usage", "to_string",
    "opc.ua.da", "tcencoding", "tcdisplayscale", "tcnocopy", "no_copy", "no-analysis", "const_non_replaced", "tcgenerated",
    "tcrpcenable", "pytmc", "enable_dynamic_creation", "signature_flag", "tclinkto", "tcncaxis", "tccontextname",
    "call_after_online_change_slot", "no_assign", "no_assign_warning", "no_explicit_call",
    "call_after_init", "call_after_global_init_slot", "global_init_slot", "reflection", "instance-path", "noinit"}
"""Names of attributes that are obeyed, and of those that make no valid program do anything else: they restrict, show, hide,
export."""

PACK_MODES = {"0": 1, "1": 1, "2": 2, "4": 4, "8": 8}
"""Values of the attribute pack_mode, and the multiples of bytes at which members of a structure lie at most."""

DIALECTAL = {"ref", "external"}
"""Pragmas that mean something in some dialects only; they are judged when the dialect is known."""

GENERATOR = (
    (re.compile(r"\s*(?:disable|enable)\s+code\s+generation\s*", re.IGNORECASE),
     "matiec only checks the text between these pragmas, and fbvm executes it",
     "take both pragmas and the text between them out"),
    (re.compile(r"\s*#\s*include\b.*", re.IGNORECASE | re.DOTALL), "matiec reads another file here, and fbvm does not",
     "name the file on the command line, or under `files` in fbvm.toml"))
"""Pragmas on which the generator of matiec acts and fbvm does not: message and hint."""

NO_EFFECT = "what it switches for another compiler is not switched here"
"""The hint for pragmas that are not known."""

_PACK_MODE = re.compile(r"\s*attribute\s*'pack_mode'\s*:=\s*'([^']*)'\s*", re.IGNORECASE)
_HEXADECIMAL = re.compile(r"""\{\s*attribute\s*'displaymode'\s*:=\s*'hex(?:adecimal)?'\s*\}\s*\Z""", re.IGNORECASE)
_HIDDEN = re.compile(r"""\{\s*attribute\s*'hide'\s*\}\s*\Z""", re.IGNORECASE)
_REACH = 100
"""Characters in front of a name in which its pragma is searched."""

_REF = re.compile(r"VAR_INPUT\s*\{\s*ref\s*\}", re.IGNORECASE)
_POU = re.compile(r"\s*(?:FUNCTION|FUNCTION_BLOCK|PROGRAM)\b", re.IGNORECASE)
_SHAPE = re.compile(r"""\s*(?:attribute\s*'([^']*)'|(\w+))""", re.IGNORECASE)


def harmless(text: str) -> bool:
    """Whether the program means the same without the pragma whose contents are `text`."""
    if packed := _PACK_MODE.fullmatch(text):
        return packed[1] in PACK_MODES
    found = _SHAPE.match(text)
    if not found:
        return not text.strip()
    name, word = found[1], found[2]
    return name.lower() in ATTRIBUTES if name is not None else word.lower() in WORDS


def attribute_name(text: str) -> str:
    """The name of the attribute whose pragma has these contents; "" for other pragmas and where its value is what is wrong."""
    found = _SHAPE.match(text)
    return found[1] if found and found[1] is not None and not _PACK_MODE.fullmatch(text) else ""


def dialectal(text: str) -> bool:
    """Whether the meaning of the pragma whose contents are `text` depends on the dialect."""
    return text.strip().lower() in DIALECTAL


def passes_places(source: Source, section: VarSection) -> bool:
    """Whether a section begins `VAR_INPUT {ref}`, by which RuSTy passes inputs by reference."""
    return _REF.match(source.text, section.start) is not None


def external(text: SourceText, declaration: Declaration) -> bool:
    """Whether {external} stands in front of a declaration, by which RuSTy leaves its body to another language."""
    return any(pragma.strip().lower() == "external" for pragma in _in_front(text, declaration))


def in_place(source: Source, pragma: Pragma) -> bool:
    """Whether a pragma of some dialects stands where it means something there: {ref} directly behind VAR_INPUT,
    {external} directly in front of a POU."""
    if pragma.text.strip().lower() == "external":
        return _POU.match(source.text, pragma.end) is not None
    before = source.text[max(0, pragma.start - _REACH):pragma.start].rstrip()
    return re.search(r"\bVAR_INPUT\Z", before, re.IGNORECASE) is not None


def shown_in_hexadecimal(text: str, start: int) -> bool:
    """Whether `{attribute 'displaymode' := 'hex'}` stands before the name that begins at `start`, as CODESYS has it."""
    at = max(0, start - _REACH)
    if text.find("}", at, start) < 0:
        return False
    before = text[at:start]
    return before.rstrip().endswith("}") and _HEXADECIMAL.search(before) is not None


def hides_inside(text: str, start: int) -> bool:
    """Whether `{attribute 'hide'}` stands before the POU that begins at `start`: stepping does not stop inside."""
    before = text[max(0, start - _REACH):start]
    return before.rstrip().endswith("}") and _HIDDEN.search(before) is not None


_ATTRIBUTE = re.compile(r"""\{\s*attribute\s*'([^']*)'\s*(?::=\s*'([^']*)')?\s*\}""", re.IGNORECASE)
_FAR = 2_000
"""Characters in front of a declaration in which its attributes are searched."""


def attributes_before(text: str, start: int) -> dict[str, str]:
    """The attributes directly in front of what begins at `start` in a text, among blanks and comments: names in small letters
    and values."""
    before = text[max(0, start - _FAR):start]
    if "{" not in before:
        return {}
    at = len(before)
    while match := re.search(r"\{[^{}]*\}(?:\s|//[^\n]*\n|\(\*(?:(?!\*\)).)*\*\))*\Z", before[:at], re.DOTALL):
        at = match.start()
    return {found[1].lower(): found[2] or "" for found in _ATTRIBUTE.finditer(before[at:])}


def init_slot(attributes: dict[str, str], otherwise: int, name: str = "global_init_slot") -> int:
    """The number of an attribute that places something in the order of initialisation; `otherwise` without one."""
    value = attributes.get(name, "")
    return int(value) if value.isdecimal() else otherwise


def attributes(text: SourceText, declaration: Declaration) -> set[str]:
    """Names of the attributes that stand directly in front of a declaration."""
    found = (_SHAPE.match(pragma) for pragma in _in_front(text, declaration))
    return {match[1].lower() for match in found if match and match[1] is not None}


def pack_mode(text: SourceText, declaration: Declaration) -> int | None:
    """The multiple of bytes at which members of a structure lie at most, if an attribute in front of it says that."""
    found = [match for pragma in _in_front(text, declaration) if (match := _PACK_MODE.fullmatch(pragma))]
    return PACK_MODES.get(found[-1][1]) if found else None


def _in_front(text: SourceText, declaration: Declaration) -> Iterator[str]:
    """The contents of the pragmas directly in front of a declaration."""
    if not text.pragmas:
        return
    before = max((d.end for d in text.everything() if d.end <= declaration.start), default=0)
    yield from (p.text for p in text.pragmas if before <= p.start and p.end <= declaration.start)
