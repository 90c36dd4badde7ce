"""All that an editor is told about whole texts, word for word: what each name means and how it is used, what is said of it, what
can be written at a place, the outline, folds, colours, addresses, and changes.  `FBVM_REWRITE=1 pytest` of this file writes the
texts anew; read the difference before you keep it."""

from __future__ import annotations

import os
from collections.abc import Iterator
from functools import cache
from pathlib import Path

import pytest
from editing import MARK

from fbvm.analysis.calls import signature
from fbvm.analysis.completion import complete, nearest
from fbvm.analysis.declarations import find
from fbvm.analysis.fixes import applied, fixes
from fbvm.analysis.hover import hover
from fbvm.analysis.outline import Symbol, folds, lenses, outline
from fbvm.analysis.program import Program
from fbvm.analysis.references import Refusal, highlights, references, rename
from fbvm.analysis.tokens import address_hints, tokens

TEXTS = Path(__file__).parent / "texts"


def check(name: str, lines: list[str]) -> None:
    path, text = TEXTS / name, "\n".join(lines) + "\n"
    if os.environ.get("FBVM_REWRITE"):
        path.write_text(text, encoding="utf-8")
    assert text == path.read_text(encoding="utf-8")


@cache
def program(*more: tuple[str, str]) -> Program:
    """The plant and some other files, checked."""
    made = Program(dialect="codesys")
    for name, text in (("plant.st", (TEXTS / "plant.st").read_text(encoding="utf-8")), *more):
        made.replace(name, text)
    made.check_all()
    return made


def placed(made: Program, name: str, start: int, end: int) -> str:
    source = made.files[name].source
    line, column = source.place(start)
    return f"{line}:{column} {' '.join(source.text[start:end].split())}"


def names(made: Program, name: str) -> Iterator[str]:
    """Each name in a file with its meaning, and behind its first place what is said of it and how often it stands."""
    file, seen = made.files[name], set()
    for part in file.parts:
        for use in made.uses(part):
            start, end = part.base + use.start, part.base + use.end
            yield f"{placed(made, name, start, end)} | {' '.join(use.key)} | {use.role}"
            if use.key in seen:
                continue
            seen.add(use.key)
            said = hover(made, name, start)
            found = find(made.checked.checker, use.key) if made.checked is not None else None
            where = f"{found.source.name}, {found.source.place(found.node.start)[0]}" if found is not None else "nowhere"
            yield f"    declared in {where}; {len(references(made, use.key))} times"
            shown = said.markdown.splitlines()[:8] if said is not None else ()
            yield from (f"    > {line}".rstrip() for line in shown if "```" not in line)


@pytest.mark.slow
def test_what_every_name_means() -> None:
    made = program()
    wrong = [f"{placed(made, 'plant.st', each.start, each.end)} | {each.severity} {each.code} {each.message}"
             for each in made.diagnostics("plant.st")]
    check("names.txt", [*wrong, *names(made, "plant.st")])


def symbols(made: Program, found: list[Symbol], indent: str = "") -> Iterator[str]:
    for each in found:
        text = placed(made, "plant.st", each.start, each.end)
        name = placed(made, "plant.st", each.name_start, each.name_end)
        yield f"{indent}{each.kind} {each.name} | {each.detail} | {text[:30]} .. {text[-12:]} | {name}"
        yield from symbols(made, each.children, indent + "    ")


def test_how_a_text_looks() -> None:
    made = program()
    file = made.files["plant.st"]
    check("looks.txt", [
        *symbols(made, outline(file)), "", *(f"{each.first} {each.last} {each.kind}" for each in folds(file)), "",
        *(f"{each.command} {each.name} | {placed(made, 'plant.st', each.start, each.end)}" for each in lenses(file)), "",
        *(f"{placed(made, 'plant.st', each.start, each.end)} | {each.type} {' '.join(sorted(each.modifiers))}"
          for each in tokens(made, file)), "",
        *(f"{placed(made, 'plant.st', each.at - 6, each.at)} | {each.text}"
          for each in address_hints(made, file, 0, len(file.text)))])  # fmt: skip


PLACES = (
    "    P1.‸", "    P1.Tank.‸", "    All[2].‸", "    P1(‸", "    P1(Level := 3, ‸", "    P1(Level := 3, Runs => ‸",
    "    Words[1] := Twice(‸",
    "    Words[1] := Twice(x := 3, ‸", "    Mode := Modes#‸", "    Mode := Modes.‸", "    Words[1] := Plant.‸",
    "    P1.Turn(‸", "    P1.Fast(‸",
    "    Words[1] := SEL(TRUE, ‸", "    Words[1] := MAX(1, 2, 3, ‸", "    Words[1] := INT_TO_REAL(‸",
    "    Pulse(IN := (1 > 2), PT := ‸",
    "    Words[1] := Words[ABS(‸", "    THIS^.‸", "    Ptr^.‸", "    Iface.‸", "    Total ‸", "    // P1.‸", "    %‸", "    D‸",
)  # fmt: skip
"""Lines in the body of Main with the mark where the cursor stands."""
SHOWN = 12
"""So many items of the nearest are looked at."""


@pytest.mark.slow
def test_what_can_be_written_at_places_of_a_body() -> None:
    text, made, lines = (TEXTS / "plant.st").read_text(encoding="utf-8"), Program(dialect="codesys"), []
    made.replace("plant.st", text)
    made.check_all()
    for place in PLACES:
        changed = text.replace("    // here\n", f"{place}\n")
        offset = changed.index(MARK)
        made.replace("plant.st", changed.replace(MARK, ""))
        call = signature(made, "plant.st", offset)
        lines.append(f"=== {place.strip()}" + (f" | {call.label} {call.active}" if call is not None else ""))
        lines += [f"{each.rank} {each.kind} {each.label} | {each.detail} | {each.insert!r}"
                  for each in nearest(complete(made, "plant.st", offset))[:SHOWN]]  # fmt: skip
    check("written.txt", lines)


@pytest.mark.slow
def test_new_names() -> None:
    """What a name may be called, by its first place in the text, and the lines that change."""
    lines = []
    for old, new in (("Level", "Height"), ("Turn", "Rotate"), ("Filling", "Running"), ("Twice", "Double"), ("Total", "Sum"),
                     ("Pump", "Engine"), ("Fast", "Quick"), ("Total", "2x"), ("Total", "IF"), ("Total", "Words"), ("ABS",
    "abs2"),
                     ("Main", "Other"), ("Idle", "Resting"), ("Stop", "Halt"), ("Tank", "Vessel"), ("x", "y"), ("P1",
    "Motor")):  # fmt: skip
        made = program()
        offset = next(part.base + use.start for part in made.files["plant.st"].parts for use in made.uses(part)
                      if part.source.text[use.start : use.end] == old)  # fmt: skip
        found = [f"{placed(made, 'plant.st', each.start, each.end)} {each.role}" for each in highlights(made, "plant.st", offset)]
        lines.append(f"=== {old} becomes {new}; {', '.join(found)}")
        try:
            before, after = made.files["plant.st"].text, applied_rename(made, offset, new)
        except Refusal as refusal:
            lines.append(str(refusal))
            continue
        rows = zip(before.splitlines(), after.splitlines(), strict=True)
        lines += [f"{number}: {then.strip()}" for number, (now, then) in enumerate(rows, 1) if now != then]
    check("renamed.txt", lines)


def applied_rename(made: Program, offset: int, new: str) -> str:
    from fbvm.analysis.references import applied as with_name

    return with_name(rename(made, "plant.st", offset, new), new)["plant.st"]


MISTAKES = (
    "    Totl := 1;", "    nobody := 1.5;", "    P1.Run();", "    Mode := Fillin;", "    IF P1.Runs THEN",
    "    Words[1] = 2;", "    Words[1] := Pump;",
    "    Total := 'a';", "    P1(Lvel := 1);", "    EXIT;", "    FOR Total := 1 TO 2 DO END_FOR; x := 1;",
    "    Total := 1 Total := 2;",
    "    Words[9] := 1;", "    nobody(1);", "    Twice(1);",
)  # fmt: skip


@pytest.mark.slow
def test_what_mends_mistakes() -> None:
    text, lines = (TEXTS / "plant.st").read_text(encoding="utf-8"), []
    for line in MISTAKES:
        made = Program(dialect="codesys")
        made.replace("plant.st", changed := text.replace("    // here\n", f"{line}\n"))
        made.check_all()
        start = changed.index(line)
        found = fixes(made, "plant.st", start, start + len(line))
        lines += [f"=== {line.strip()}", *(f"{placed(made, 'plant.st', each.start, each.end)[:40]} | {each.code} {each.message}"
                                           for each in made.diagnostics("plant.st"))]  # fmt: skip
        for fix in found:
            rows = zip(changed.splitlines(), applied(changed, fix.edits).splitlines(), strict=False)
            now, then = next((now, then) for now, then in rows if now != then)
            lines.append(f"{fix.title} | {fix.best}: {now.strip()!r} -> {then.strip()!r}")
    check("mended.txt", lines)
