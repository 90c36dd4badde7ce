"""Where the name at a place is declared, everywhere that it stands, and how it is renamed."""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass

from fbvm.analysis.declarations import Declared, find
from fbvm.analysis.names import Key, Use, accessors, key_of_pou, text_has
from fbvm.analysis.parts import File, Part
from fbvm.analysis.program import Program
from fbvm.base.diagnostics import Diagnostic, errors
from fbvm.base.types import fold
from fbvm.check.symbols.facts import Pou
from fbvm.syntax.st.lexer import lexis


@dataclass(frozen=True)
class Place:
    """A piece of a file, in characters from 0; `role` is "declared", "read", "written" or "called"."""

    file: File
    start: int
    end: int
    role: str = "read"


class Refusal(Exception):
    """A name cannot be renamed; the message says why."""


def use_at(program: Program, name: str, offset: int) -> tuple[Part, Use] | None:
    """The name at a place of a file, or directly in front of it."""
    part = program.files[name].part_at(offset)
    at = offset - part.base
    found = [use for use in program.uses(part) if use.start <= at <= use.end]
    return (part, found[-1]) if found else None


def declared_at(program: Program, name: str, offset: int) -> Declared | None:
    """What the name at a place of a file means."""
    used = use_at(program, name, offset)
    return find(program.checked.checker, used[1].key) if used and program.checked is not None else None


def references(program: Program, key: Key) -> list[Place]:
    """All places in the program's files at which a name means the same; of a method or property also its overrides."""
    keys = family(program, key)
    return [Place(file, part.base + use.start, part.base + use.end, use.role)
            for file in program.files.values() for part in file.parts if text_has(part.source, key[-1].rpartition(".")[2])
            for use in program.uses(part) if use.key in keys]


def family(program: Program, key: Key) -> set[Key]:
    """The keys that have to have one name: of a method all that it overrides or implements, and all that override these."""
    if key[0] != "method" or program.checked is None:
        return {key}
    blocks = [pou for pou in program.checked.checker.project.pous.values()
              if any(each in pou.methods for each in accessors(key[3]))]  # fmt: skip
    found = [pou for pou in blocks if (pou.source.library, fold(pou.name)) == key[1:3]]
    for pou in found:
        found += [other for other in blocks if other not in found and (derives(other, pou) or derives(pou, other))]
    return {("method", pou.source.library, fold(pou.name), key[3]) for pou in found} | {key}


def derives(pou: Pou, other: Pou) -> bool:
    """True if a block extends or implements another one."""
    parents = [*([pou.base] if pou.base is not None else []), *pou.interfaces]
    return any(parent is other or derives(parent, other) for parent in parents)


def highlights(program: Program, name: str, offset: int) -> list[Place]:
    """The places in one file at which the name at `offset` means the same."""
    used = use_at(program, name, offset)
    return [place for place in references(program, used[1].key) if place.file.name == name] if used else []


def rename(program: Program, name: str, offset: int, new: str) -> list[Place]:
    """The places that get the text `new` when what stands at a place is renamed.

    Raises Refusal where that is not possible, or would change what the program means."""
    declared = declared_at(program, name, offset)
    if declared is None:
        raise Refusal("there is no name here that the program declares")
    if declared.source.library:
        raise Refusal(f"{declared.name} belongs to the library {declared.source.library}")
    if declared.variable is not None and declared.variable.role:
        raise Refusal(f"{declared.name} belongs to a chart")
    _check_name(new)
    places = references(program, declared.key)
    if fold(new) != fold(declared.name):
        _check_meaning(program, places, declared.key, new)
    return places


def _check_name(new: str) -> None:
    if not re.fullmatch(r"[A-Za-z_][A-Za-z0-9_]*", new):
        raise Refusal(f"`{new}` is no name: letters A to Z, digits and _, not beginning with a digit")
    if lexis().words.get(fold(new)) in lexis().reserved:
        raise Refusal(f"`{new}` is a word of the language")


def _check_meaning(program: Program, places: list[Place], key: Key, new: str) -> None:
    """Raise Refusal if the renamed program has an error more, or if a name means something else than before."""
    other = program.copied()
    for file, text in applied(places, new).items():
        other.replace(file, text)
    for _ in other.check(lint=False):
        pass
    for file in program.files:
        known = {(each.code, _without_name(each, fold(new), key[-1])) for each in errors(program.diagnostics(file))}
        for each in errors(other.diagnostics(file)):
            if (each.code, _without_name(each, fold(new), key[-1])) not in known:
                raise Refusal(f"{each.source.name}:{each.line}: {each.message}")
    renamed = (*key[:-1], f"{key[-1].rpartition('.')[0]}.{fold(new)}".lstrip("."))
    if len(references(other, renamed)) != len(places):
        raise Refusal(f"`{new}` means something else in a place where the name stands")


def _without_name(message: Diagnostic, new: str, old: str) -> str:
    return fold(message.message).replace(new, old)


def applied(places: list[Place], new: str) -> dict[str, str]:
    """The texts of files, by their names, with `new` at all places."""
    pieces: dict[str, list[str]] = {}
    ends: dict[str, tuple[str, int]] = {}
    for place in sorted(places, key=lambda place: place.start):
        name, (text, end) = place.file.name, ends.get(place.file.name, (place.file.text, 0))
        pieces.setdefault(name, []).extend((text[end:place.start], new))
        ends[name] = text, place.end
    return {name: "".join(made) + text[end:] for name, made in pieces.items() for text, end in (ends[name],)}


def callers(program: Program, key: Key) -> Iterator[tuple[Key, Place]]:
    """Who calls a POU: the key of each POU that does, with the place of the call."""
    checked = program.checked
    declared = find(checked.checker, key) if checked is not None else None
    if declared is None or declared.pou is None or checked is None:
        return
    for pou in checked.checker.bodies:
        node = pou.calls.get(declared.pou)
        found = program.place(pou.source)
        if node is not None and found is not None:
            yield key_of_pou(pou.owner), Place(found[0], found[1] + node.start, found[1] + node.end, "called")


def called(program: Program, key: Key) -> Iterator[tuple[Key, Place]]:
    """What a POU calls: the key of each POU, with the place of its first call."""
    checked = program.checked
    declared = find(checked.checker, key) if checked is not None else None
    if declared is None or declared.pou is None:
        return
    found = program.place(declared.pou.source)
    for pou, node in declared.pou.calls.items() if found is not None else ():
        assert found is not None
        yield (key_of_pou(pou.owner),
               Place(found[0], found[1] + node.start, found[1] + node.end, "called"))
