"""Two versions of a program side by side: symbols, and rungs that were added, removed or changed."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from difflib import SequenceMatcher, unified_diff

from fbvm.interchange.contents import Contents, Declared, Program, WrittenRung
from fbvm.syntax.ladder.drawing.cells import cells, columns, padded, text_of
from fbvm.syntax.ladder.drawing.diagram import StepText, Undrawable, diagram
from fbvm.syntax.ladder.drawing.drawing import rung_text
from fbvm.syntax.ladder.drawing.steps import steps

GAP = "   "
LEAST = 40
"""Columns for one drawing below which two are drawn one below the other."""


@dataclass(frozen=True)
class Difference:
    """One difference: where it is, what happened in words, and the lines that show it."""

    where: str
    what: str
    lines: tuple[str, ...]


def differences(old: Contents, new: Contents, width: int) -> Iterator[Difference]:
    """The differences between two versions: symbols, then POU by POU; drawings are at most `width` columns wide."""
    yield from _symbols("global symbols", {key: one for key, (_, one) in old.symbols.items()},
                        {key: one for key, (_, one) in new.symbols.items()})
    before, after = {**old.blocks, **old.programs}, {**new.blocks, **new.programs}
    for key in dict.fromkeys((*before, *after)):
        first, second = before.get(key), after.get(key)
        name = (second or first or before[key]).name
        if first and second:
            yield from _symbols(name, first.declared, second.declared)
        yield from _program(name, first, second, width)
    for key in dict.fromkeys((*old.others, *new.others)):
        if key not in before and key not in after and old.others.get(key, ("", 0, ""))[2] != new.others.get(key, ("", 0, ""))[2]:
            yield _text(key, old, new)


def _symbols(where: str, old: Mapping[str, Declared], new: Mapping[str, Declared]) -> Iterator[Difference]:
    lines: list[str] = []
    counts = [0, 0, 0]
    for key in dict.fromkeys((*old, *new)):
        first, second = old.get(key), new.get(key)
        if first == second:
            continue
        counts[0 if first and second else 1 if first else 2] += 1
        lines += [f"{sign} {_row(one)}" for sign, one in (("-", first), ("+", second)) if one is not None]
    if lines:
        yield Difference(where, _counted("symbol", *counts), tuple(lines))


def _row(one: Declared) -> str:
    return f"{one.name}{f' AT {one.address}' if one.address else ''} : {one.type}{f'  // {one.comment}' if one.comment else ''}"


def _counted(what: str, changed: int, removed: int, added: int) -> str:
    parts = [f"{count} {what}{'s' * (count > 1)} {how}"
             for count, how in ((changed, "changed"), (removed, "removed"), (added, "added")) if count]
    return ", ".join(parts)


def _program(name: str, old: Program | None, new: Program | None, width: int) -> Iterator[Difference]:
    before, after = old.sections if old else {}, new.sections if new else {}
    first = second = 0
    for section in dict.fromkeys((*before, *after)):
        left, right = before.get(section, []), after.get(section, [])
        lines: list[str] = []
        counts = [0, 0, 0]
        said = [_said(rung) for rung in left], [_said(rung) for rung in right]
        for how, i, j, k, m in SequenceMatcher(None, *said, autojunk=False).get_opcodes():
            if how == "equal":
                continue
            both = min(j - i, m - k)
            counts = [counts[0] + both, counts[1] + j - i - both, counts[2] + m - k - both]
            for at in range(max(j - i, m - k)):
                one = (first + i + at, left[i + at]) if at < j - i else None
                other = (second + k + at, right[k + at]) if at < m - k else None
                lines += [*_pair(one, other, width), ""]
        first, second = first + len(left), second + len(right)
        if lines:
            where = f"{name}, section {section}" if section else name
            yield Difference(where, _counted("rung", *counts), tuple(lines[:-1]))


def _said(rung: WrittenRung) -> object:
    """What a rung says: its comments, and the instructions that its drawing has.  How blocks were joined, and the numbers of
    temporary relays, which CX-Programmer gives by itself and does not show, are no difference."""
    written: list[StepText] = [(step.prefix, step.mnemonic, step.operands) for step in rung.steps]
    remarks = tuple((step.text, step.operands, step.remark) for step in rung.steps if step.remark)
    with suppress(Undrawable):
        written = [(step.prefix, step.mnemonic, step.operands) for step in steps(diagram(written))]
    return rung.comment, tuple(written), remarks


def _pair(old: tuple[int, WrittenRung] | None, new: tuple[int, WrittenRung] | None, width: int) -> list[str]:
    """A rung before and after, side by side if there is room."""
    half = (width - len(GAP)) // 2
    if half >= LEAST:
        left, right = _drawn("-", old, half), _drawn("+", new, half)
        if max(map(columns, left), default=0) <= half:
            rows = max(len(left), len(right))
            left += [""] * (rows - len(left))
            right += [""] * (rows - len(right))
            return [f"{padded(one, half)}{GAP}{other}".rstrip() for one, other in zip(left, right, strict=True)]
    return _drawn("-", old, width) + _drawn("+", new, width)


def _drawn(sign: str, rung: tuple[int, WrittenRung] | None, width: int) -> list[str]:
    if rung is None:
        return []
    number, written = rung
    comment, *notes = written.comment or ("",)
    head = f"{sign} RUNG {number} {comment}".rstrip()
    steps = [(step.prefix, step.mnemonic, step.operands) for step in written.steps]
    remarks = [f"{sign} {step.text} {' '.join(step.operands)}  // {step.remark}" for step in written.steps if step.remark]
    picture = [f"{sign} {line}" for line in rung_text(steps, width - 2)] if steps else []
    notes, remarks, [head] = ([_cut(line, width) for line in lines]
                              for lines in ([f"{sign} ' {note}" for note in notes], remarks, [head]))  # fmt: skip
    return [head, *notes, *picture, *remarks]


def _cut(line: str, width: int) -> str:
    """The beginning of a line that has this many columns."""
    return text_of(cells(line)[:width])


def _text(key: str, old: Contents, new: Contents) -> Difference:
    """A POU of text, by lines."""
    first, second = old.others.get(key), new.others.get(key)
    before, after = (_lines(one[0].text[one[1]:], one[2]) if one else [] for one in (first, second))
    name = (second or first or ("", 0, "? ?"))[2].split(" ")[1]
    what = "changed" if first and second else "removed" if first else "added"
    lines = unified_diff(before, after, lineterm="", n=1)
    return Difference(name, what, tuple(line for line in lines if not line.startswith(("---", "+++"))))


def _lines(text: str, words: str) -> Sequence[str]:
    """The lines of a text up to the end of the POU, whose words are `words`."""
    made: list[str] = []
    left = len("".join(words.split()))
    for line in text.splitlines():
        if left <= 0:
            break
        made.append(line.rstrip())
        left -= len("".join(line.split()))
    return made
