"""Quick fixes: changes of a text that make a diagnostic go away.

The words of a message and its hint say what to write.  Every change that they may mean is tried: it is offered if the
program then has this diagnostic no more, and no other error that it did not have."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass

from fbvm.analysis.parts import Part
from fbvm.analysis.program import Program
from fbvm.base.diagnostics import Diagnostic, errors
from fbvm.syntax import tree

Edit = tuple[int, int, str]
"""Start and end of a piece of a text, in characters from 0, and what is written there instead."""
TYPES = ("INT", "BOOL", "DINT", "REAL", "TIME", "WORD", "STRING", "LREAL")
"""Types that are tried for a name that is not declared.  A whole number is an INT if it fits: 0 and 1 would fit a BOOL, too."""
MOST = 8
"""Changes that are tried for one diagnostic."""
_NEAR = re.compile(r"did you mean ([^?;]+)\?")
_EXPECTED = re.compile(r"`?([A-Z_]+|[^\sA-Za-z`]+)`? expected")
_WRITE = re.compile(r"\bwrite (?:which: )?`?(.+?)`?(?:,? or take .*|; the same in .*| for the .*)?\Z")
_IS = re.compile(r"`([^`]+)` (?:(?:compares|assigns)\b(?!,)|is one sign\b)")
_CALL = re.compile(r"(\w+)\(\.\.\.\)")


@dataclass(frozen=True)
class Fix:
    """A change of one file that makes `diagnostic` go away; the `best` one of its kind is what an editor does by itself."""

    title: str
    diagnostic: Diagnostic
    edits: tuple[Edit, ...]
    best: bool = False


def fixes(program: Program, name: str, start: int, end: int) -> list[Fix]:
    """The quick fixes for the diagnostics between two places of a file."""
    found: list[Fix] = []
    for diagnostic in program.diagnostics(name):
        if diagnostic.start > end or max(diagnostic.end, diagnostic.start) < start:
            continue
        tried = [fix for _, fix in zip(range(MOST), _candidates(program, name, diagnostic), strict=False)]
        worked = list({fix.title: fix for fix in reversed(tried) if _helps(program, name, fix)}.values())[::-1]
        found += [Fix(fix.title, fix.diagnostic, fix.edits, fix is worked[0]) for fix in worked]
        if diagnostic.severity == "warning":
            found.append(_suppression(diagnostic))
        elif diagnostic.code == "S0201" and "is not declared" in diagnostic.message and not worked:
            found += _declared(program, name, diagnostic)
    return found


def applied(text: str, edits: tuple[Edit, ...]) -> str:
    """The text after the edits, whose places are those of the text in front of all of them."""
    for start, end, new in sorted(edits, reverse=True):
        text = text[:start] + new + text[end:]
    return text


def _candidates(program: Program, name: str, diagnostic: Diagnostic) -> Iterator[Fix]:
    """Changes that the words of a message may mean, the likeliest first."""
    text = program.files[name].text
    here, written = (diagnostic.start, diagnostic.end), text[diagnostic.start:diagnostic.end]
    if near := _NEAR.search(diagnostic.hint):
        for other in re.split(r", | or ", near[1]):
            yield Fix(f"Write {other}", diagnostic, ((*here, other),))
    if (expected := _EXPECTED.match(diagnostic.message)) is not None:
        sign = expected[1]
        if here[0] == here[1]:
            yield Fix(f"Insert {sign}", diagnostic, ((*here, f" {sign}" if sign[0].isalpha() or sign == ":=" else sign),))
        else:
            yield Fix(f"Write {sign}", diagnostic, ((*here, sign),))
            line = text.rfind("\n", 0, here[0]) + 1
            indent = text[line:here[0]] if text[line:here[0]].isspace() else ""
            ended = sign if sign.startswith("END_") and sign.split("_")[1] in ("VAR", "TYPE") else f"{sign};"
            yield Fix(f"Insert {sign}", diagnostic, ((line, line, f"{indent}{ended}\n"),))
            yield Fix(f"Insert {sign}", diagnostic, ((here[0], here[0], f"{sign} "),))
    if sign_is := _IS.match(diagnostic.hint):
        yield Fix(f"Write {sign_is[1]}", diagnostic, ((*here, sign_is[1]),))
    if "`:=` assigns" in diagnostic.hint and (equal := re.search(r"(?<![:<>=])=(?![>=])", written)) is not None:
        at = here[0] + equal.start()
        yield Fix("Write :=", diagnostic, ((at, at + 1, ":="),))
    if said := _WRITE.search(diagnostic.hint):
        for meant in dict.fromkeys((said[1], *re.split(r",? or (?:write )?", said[1]), said[1].partition(",")[0])):
            new = f"{call[1]}({written})" if (call := _CALL.fullmatch(meant)) else meant.strip("`")
            if new and new != written:
                yield Fix(f"Write {new}", diagnostic, ((*here, _apart(text, *here, new)),))
    if diagnostic.hint.startswith(("remove it", "leave it out")):
        yield from _removals(program, name, diagnostic)


def _apart(text: str, start: int, end: int, new: str) -> str:
    """What is written in place of a piece of a text, with a space where letters would meet: `a||b` becomes `a OR b`."""
    before = " " if re.match(r"\w\w", text[start - 1:start] + new[:1]) else ""
    behind = " " if re.match(r"\w\w", new[-1:] + text[end:end + 1]) else ""
    return before + new + behind


def _removals(program: Program, name: str, diagnostic: Diagnostic) -> Iterator[Fix]:
    """What a message says is better removed: a declaration of one variable, or what the message is about."""
    part = program.files[name].part_at(diagnostic.start)
    text, at = program.files[name].text, diagnostic.start - part.base
    for declared in _variables(part):
        if len(declared.names) == 1 and declared.names[0].start == at:
            start, end = declared.start + part.base, declared.end + part.base
            end += len(text[end:]) - len(text[end:].lstrip(" \t"))
            line, behind = text.rfind("\n", 0, start) + 1, text.find("\n", end) + 1 or len(text)
            alone = not text[line:start].strip() and not text[end:behind].strip()
            yield Fix(f"Remove {declared.names[0].text}", diagnostic, ((line, behind, "") if alone else (start, end, ""),))
            return
    yield Fix(f"Remove {text[diagnostic.start:diagnostic.end]}", diagnostic, ((diagnostic.start, diagnostic.end, ""),))


def _variables(part: Part) -> Iterator[tree.VarDecl]:
    for declared in part.syntax.everything():
        sections = declared.sections if isinstance(declared, tree.Pou) else ()
        for section in sections:
            yield from section.variables


def _helps(program: Program, name: str, fix: Fix) -> bool:
    """True if a change removes its diagnostic and brings no error."""
    other = program.copied()
    other.replace(name, applied(program.files[name].text, fix.edits))
    other.check_all()
    before, after = program.diagnostics(name), other.diagnostics(name)
    messages = [(each.code, each.message) for each in before]
    gone = Counter(messages)[fix.diagnostic.code, fix.diagnostic.message] > \
        Counter((each.code, each.message) for each in after)[fix.diagnostic.code, fix.diagnostic.message]
    everywhere = [(len(errors(program.diagnostics(each))), len(errors(other.diagnostics(each)))) for each in program.files]
    new = Counter((each.code, each.message) for each in errors(after)) - Counter(messages)
    return gone and not new and all(now <= then for then, now in everywhere)


def _suppression(diagnostic: Diagnostic) -> Fix:
    """Switches a warning off for its line."""
    source, line = diagnostic.source, diagnostic.source.place(diagnostic.start)[0]
    start = source.line_starts[line - 1]
    end = start + len(source.line(line))
    text = source.line(line)
    indent = text[:len(text) - len(text.lstrip())]
    return Fix(f"Suppress {diagnostic.code} on this line", diagnostic,
               ((start, start, f"{indent}{{warning disable {diagnostic.code}}}\n"),
                (end, end, f"\n{indent}{{warning restore {diagnostic.code}}}")))


def _declared(program: Program, name: str, diagnostic: Diagnostic) -> list[Fix]:
    """Declares a name that is unknown, with the first type that fits; nothing if none does."""
    part = program.files[name].part_at(diagnostic.start)
    text, pou = program.files[name].text, part.pou
    written = text[diagnostic.start:diagnostic.end]
    if pou is None or not written.isidentifier():
        return []
    section = next((each for each in reversed(pou.sections) if each.kind == "VAR" and not each.hidden and not each.qualifiers),
                   None)
    for kind in TYPES:
        if section is not None:
            at = part.base + section.end - len("END_VAR")
            line = text.rfind("\n", 0, at) + 1
            edit = (at, at, f"{written} : {kind}; ") if text[line:at].strip() else \
                (line, line, f"{text[line:at]}    {written} : {kind};\n")
        else:
            behind = max((each.end for each in pou.sections if not each.hidden), default=(pou.result or pou.name).end)
            edit = part.base + behind, part.base + behind, f"\nVAR\n    {written} : {kind};\nEND_VAR"
        fix = Fix(f"Declare {written} : {kind}", diagnostic, (edit,), True)
        if _helps(program, name, fix):
            return [fix]
    return []
