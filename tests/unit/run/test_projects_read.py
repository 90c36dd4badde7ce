"""What is read of whole project files, or said about them, word for word, beside `projects/`: a file and its text.

`FBVM_REWRITE=1 pytest` of this file writes the texts anew: read the difference before you keep it."""

from __future__ import annotations

import os
from dataclasses import fields, is_dataclass
from pathlib import Path

import pytest

from fbvm.base.diagnostics import Source
from fbvm.run.project import Project, read_project

HERE = Path(__file__).with_name("projects")


def told(name: str, value: object, indent: int = 0) -> list[str]:
    """A value as lines; of dataclasses the fields that are not as they are without a word, by name."""
    before = "    " * indent + f"{name}: "
    if isinstance(value, tuple) and any(is_dataclass(each) or isinstance(each, tuple) for each in value):
        return [line for number, each in enumerate(value, 1) for line in told(f"{name} {number}", each, indent)]
    if is_dataclass(value) and not isinstance(value, type):
        inner = [(field.name, getattr(value, field.name), field.default) for field in fields(value)]
        return [before.rstrip(), *(line for name, each, usual in inner if not isinstance(each, Source) and each != usual
                                   for line in told(name, each, indent + 1))]  # fmt: skip
    if isinstance(value, tuple):
        return [before + ("[" + ", ".join(plain(each) for each in value) + "]")]
    return [before + (str(sorted(map(str, value))) if isinstance(value, frozenset) else plain(value))]


def plain(value: object) -> str:
    return here(str(value)) if isinstance(value, Path) else repr(value)


def here(text: str) -> str:
    return text.replace(str(HERE), "HERE").replace("\\", "/")


def read(file: Path) -> str:
    """What a project file comes to."""
    found = read_project(file)
    if isinstance(found, Project):
        return "\n".join(told("project", found)) + "\n"
    return "\n".join(here(each.render()) for each in found) + "\n"


@pytest.mark.parametrize("file", [pytest.param(file, id=file.stem) for file in sorted(HERE.glob("*.toml"))])
def test_a_project_is_read_as_it_is_kept(file: Path) -> None:
    kept = file.with_suffix(".txt")
    came = read(file)
    if os.environ.get("FBVM_REWRITE"):
        kept.write_text(came, encoding="utf-8")
    assert came == kept.read_text(encoding="utf-8")
