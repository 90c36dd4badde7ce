"""`fbvm new`: a project with a block, its test, and what continuous integration needs."""

from __future__ import annotations

import re
from collections.abc import Iterable
from pathlib import Path

import click

from fbvm.base.data import data_folder
from fbvm.base.files import is_part, resolved, write_file
from fbvm.base.host import portable
from fbvm.cli.shared.files import in_the_way, writing
from fbvm.cli.shared.terminal import say

EXAMPLE = "project"
"""The folder in `examples/` that is copied."""
TITLE = "PROJECT"
"""The word in its files that is replaced by the name of the project."""
DESCRIPTIONS = {
    "src/pump.st": "a function block",
    "src/main.st": "the program that uses it",
    "tests/test_pump.py": "its test",
    "fbvm.toml": "what `fbvm run` runs",
    "requirements.txt": "what to install",
    ".github/workflows/test.yml": "tests on each push",
}
"""The description of each file, in the order in which they are listed."""


@click.command("new")
@click.argument("name", metavar="NAME")
def command(name: str) -> None:
    """Make a folder NAME with a project: a block, a program, a test, and a file for continuous integration.

    `fbvm test` in it passes at once."""
    target = Path(name)
    title = resolved(target).name
    if not re.fullmatch(r"[\w][\w .-]*", title):
        raise click.UsageError(f"{name!r} cannot be the name of a project; use letters, digits, - and _")
    if portable(title) != title:
        raise click.UsageError(f"{name!r} cannot be the name of a project: Windows has no folder of this name")
    source = data_folder("examples") / EXAMPLE
    files = {target / path.relative_to(source): path.read_text(encoding="utf-8").replace(TITLE, title)
             for path in sorted(source.rglob("*")) if path.is_file() and "__pycache__" not in path.parts}  # fmt: skip
    if target.exists() and (not target.is_dir() or in_the_way(files) or _has_others(target, files)):
        raise click.UsageError(f"{name} is there already")
    with writing(name):
        for path, text in files.items():
            path.parent.mkdir(parents=True, exist_ok=True)
            write_file(path, text)
    say(f"{name}/")
    for file, said in DESCRIPTIONS.items():
        say(f"  {file:<28}{said}")
    say(f"\ncd {name}\nfbvm test")


def _has_others(folder: Path, files: Iterable[Path]) -> bool:
    """True if a folder holds more than these files, their folders, and parts that a killed call has left."""
    known = {each for path in files for each in (path, *path.parents)}
    return any(path not in known and not is_part(path) for path in folder.rglob("*"))
