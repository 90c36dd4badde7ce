"""Rungs to the text of a project."""

from __future__ import annotations

import re
from collections.abc import Mapping

from fbvm.interchange.contents import WrittenRung
from fbvm.interchange.cx.markup import CxText

MARK = "$?St$Bk?_#[{}]"
NEW = 10_000_000
"""Markers of new texts are numbered from here on, before all get the numbers of the file."""
_WORD = re.compile(r"[^\W\d]\w*")


def rung_text(rung: WrittenRung, indent: str, text: CxText, names: Mapping[str, str]) -> str:
    """The text of a rung behind its key, with markers whose numbers are no numbers of the file yet.

    names: by the name in the sources, in small letters, that in the project."""

    def own(word: re.Match[str]) -> str:
        return names.get(word[0].casefold(), word[0])

    end = "\r\n" if "\r\n" in text.text else "\n"
    notes = [step.remark for step in rung.steps if step.remark]
    lines = ["'  R0"] if rung.comment else []
    for step in rung.steps:
        operands = [operand if operand.startswith("#") else _WORD.sub(own, operand) for operand in step.operands]
        lines.append(" ".join((step.text, *operands)))
        if step.remark:
            lines.append(f"//  {notes.index(step.remark)}")
    inner = indent + " "
    listed = f"{end}{MARK.format(NEW)}{end}" + "".join(f"{line}\n" for line in lines) + f"{MARK.format(NEW)}{end}" if lines \
        else f'"";{end}'
    made = [f"{end}{indent}BEGIN{end}", f"{inner}Com:={_text(end.join(rung.comment), end)}", f'{inner}Flags:="1,0";{end}',
            f'{inner}FBversion:="";{end}', f"{inner}SL:={listed}", f"{inner}AtchCmts:={end}{inner}BEGIN{end}",
            f"{inner} CC:={len(notes)};{end}"]  # fmt: skip
    made += [f"{inner} {number}:={_text(note, end)}" for number, note in enumerate(notes)]
    return "".join([*made, f"{inner}END;{end}", f"{indent}END;{end}"])


def _text(text: str, end: str) -> str:
    """A comment as a value, with its line end: between markers if it holds a quote or a line end."""
    if '"' in text or "\n" in text:
        return f"{end}{MARK.format(NEW)}{end}{text}{MARK.format(NEW)}{end}"
    return f'"{text}";{end}'
