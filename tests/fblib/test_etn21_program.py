"""The ETN21's own program: what a function reads and changes of the unit's memory stands at its head, and nowhere else."""

from __future__ import annotations

import re
from dataclasses import dataclass, field
from functools import cache
from pathlib import Path

import pytest

from fbvm.base.data import data_folder

FOLDER = data_folder("fblib") / "omron" / "etn21"
MEMORY = FOLDER / "ETN21_Memory.st"
FUNCTIONS = sorted(set(FOLDER.glob("*.st")) - {MEMORY})
SECTION = re.compile(r"^VAR(?:_\w+)?(?: CONSTANT)?$.*?^END_VAR$", re.M | re.S)
PLACE = r"{}(?:\[[^;]*?\])?(?:\.\w+(?:\[[^;]*?\])?)*"
"""A variable, or a part of it."""


@dataclass
class Function:
    """A function as its text says it."""

    name: str
    has_result: bool
    body: str
    sections: dict[str, dict[str, str]] = field(default_factory=dict)
    """Names and types of variables by section, such as "VAR_EXTERNAL CONSTANT"."""


def declared(section: str) -> dict[str, str]:
    """The variables of a section, and the type of each."""
    found = {}
    for declaration in section.split("\n", 1)[1].removesuffix("END_VAR").split(";"):
        if ":" in declaration:
            names, kind = declaration.split(":", 1)
            found.update((name.strip(), kind.split(":=")[0].strip()) for name in names.split(","))
    return found


def without_comments(path: Path) -> str:
    text = re.sub(r"//[^\n]*", "", path.read_text(encoding="utf-8"))
    return re.sub(r"[ \t]+$", "", text, flags=re.M)


@cache
def function(path: Path) -> Function:
    text = without_comments(path)
    head = re.search(r"^FUNCTION (\w+)( : \w+)?$", text, re.M)
    assert head, path.name
    found = Function(head[1], head[2] is not None, SECTION.sub("", text[head.end() :]).removesuffix("END_FUNCTION\n"))
    for section in SECTION.finditer(text):
        found.sections.setdefault(section[0].split("\n", 1)[0], {}).update(declared(section[0]))
    return found


@cache
def memory() -> tuple[dict[str, str], dict[str, str]]:
    """The constants and the variables of the unit's memory, with their types."""
    sections = [section[0] for section in SECTION.finditer(without_comments(MEMORY))]
    constants, variables = sections
    assert constants.startswith("VAR_GLOBAL CONSTANT\n") and variables.startswith("VAR_GLOBAL\n")
    return declared(constants), declared(variables)


def changed(body: str) -> set[str]:
    """The globals that statements assign to, or hand to a function's in-outs."""
    found = {name for name in memory()[1]
             if re.search(rf"(?:^|;|\bTHEN|\bELSE|\bDO|:)\s*{PLACE.format(name)}\s*:=", body)}  # fmt: skip
    for path in FUNCTIONS:
        for call in re.finditer(rf"\b{path.stem}\(", body):
            arguments, depth = body[call.end() :], 1
            for at, letter in enumerate(arguments):
                depth += {"(": 1, ")": -1}.get(letter, 0)
                if not depth:
                    arguments = arguments[:at]
                    break
            for name in function(path).sections.get("VAR_IN_OUT", {}):
                found |= set(re.findall(rf"\b{name}\s*:=\s*(ETN21_\w+)", arguments))
    return found & memory()[1].keys()


def wrong_with(path: Path) -> list[str]:
    this, (constants, variables) = function(path), memory()
    read, written = this.sections.get("VAR_EXTERNAL CONSTANT", {}), this.sections.get("VAR_EXTERNAL", {})
    head = read | written
    named = {name for name in constants | variables if re.search(rf"(?<![\w.#]){name}\b(?!#)", this.body)}
    bounds = {name for name in constants for kind in head.values() if re.search(rf"\b{name}\b", kind)}
    changes = changed(this.body)
    does = changes or this.has_result or "VAR_IN_OUT" in this.sections or re.search(r"\bETN21_\w+\(", this.body)
    return [
        *(f"uses {name}, which its head does not declare" for name in sorted(named - head.keys())),
        *(f"declares {name} and does not use it" for name in sorted(head.keys() - named - bounds)),
        *(f"changes {name}, which its head declares CONSTANT" for name in sorted(changes & read.keys())),
        *(f"only reads {name}, which its head does not declare CONSTANT" for name in sorted(written.keys() - changes)),
        *(f"declares another type of {name}" for name, kind in head.items() if kind != (constants | variables).get(name)),
        *(["does nothing"] if not does else []),
    ]


@pytest.mark.slow
def test_a_function_names_only_what_its_head_declares() -> None:
    assert {path.stem: wrong for path in FUNCTIONS if (wrong := wrong_with(path))} == {}


def test_functions_are_there() -> None:
    assert len(FUNCTIONS) > 50 and len(memory()[0]) > 5 and len(memory()[1]) > 30
    body = "  ETN21_N[i + 1] := 0; ETN21_Take(Event := ETN21_Events[i]); x := ETN21_Cycle;"
    assert changed(body) == {"ETN21_N", "ETN21_Events"}
