"""The pages that are made of the product name all that the product has."""

from __future__ import annotations

import doctest
import importlib
import re
import sys
from functools import cache
from pathlib import Path
from typing import Any

import click
import pytest

import fbvm
from fbvm.base.areas import AREAS
from fbvm.base.codes import CODES
from fbvm.base.dialects import DIALECTS
from fbvm.cli.main import GROUP_OF, main
from fbvm.machine.backplane import KINDS as UNIT_KINDS
from fbvm.run.project_reader import REQUIRED
from fbvm.syntax.ladder.instructions.instruction_set import instruction_set
from fbvm.units.etn21 import codes as etn21_codes

HOUSE = Path(__file__).resolve().parent.parent
EXTENSIONS = HOUSE / "docs" / "_ext"


@pytest.fixture(autouse=True)
def _extensions(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.syspath_prepend(str(EXTENSIONS))


@cache
def pages() -> dict[str, str]:
    made: dict[str, str] = importlib.import_module("product_pages").pages()
    return made


def page(name: str) -> str:
    return pages()[f"reference/{name}"]


def module_names() -> list[str]:
    """The modules whose public names have pages, without `fbvm`."""
    sys.path.insert(0, str(EXTENSIONS))
    try:
        return list(importlib.import_module("product_pages.python_api").MODULES)
    finally:
        sys.path.remove(str(EXTENSIONS))


def module_members(name: str) -> list[str]:
    return list(module("python_api").MODULES.get(name) or importlib.import_module(name).__all__)


def module(name: str) -> Any:
    return importlib.import_module(f"product_pages.{name}")


def test_each_command_has_a_section_with_each_of_its_options() -> None:
    context = click.Context(main, info_name="fbvm")
    for verb in GROUP_OF:
        section = page("command-line").partition(f"### fbvm {verb}\n")[2].partition("\n### ")[0]
        command = main.get_command(context, verb)
        assert command is not None
        options = [name for parameter in command.params if isinstance(parameter, click.Option) for name in parameter.opts]
        assert [name for name in options if name not in section] == [], verb


def test_each_status_is_said() -> None:
    assert set(module("command_line").statuses()) == {0, 1, 2, 3, 4, 5, 130, 141, 143}


def test_each_key_of_a_project_file_has_its_meaning() -> None:
    text = page("project-file")
    for path, key in module("project_file").all_keys():
        assert f"| `{path.rpartition('.')[2]}` |" in text
        assert key.meaning in text
        assert key.meaning.endswith("."), path


def test_what_a_unit_has_is_what_its_class_takes() -> None:
    text = page("project-file")
    for kind, (_, arguments) in UNIT_KINDS.items():
        section = text.partition(f"Type `{kind}`:")[2].partition("\n\nType")[0]
        assert [key for key in arguments if f"| `{key}` |" not in section] == []


def test_a_key_that_is_needed_is_marked() -> None:
    needed = [path for path, key in module("project_file").all_keys() if key.default is REQUIRED]
    assert page("project-file").count("**needed**") == len(needed)


def test_each_diagnostic_has_a_page_and_a_row() -> None:
    for name, row in CODES.items():
        assert page(f"diagnostics/{name}").startswith(f"# {name} {row.title}")
        assert f"| [{name}]({name}.md) | {row.severity} | {row.title} |" in page("diagnostics/index")


def test_each_public_name_is_on_a_page() -> None:
    for name in fbvm.__all__:
        assert name == "__version__" or f":: fbvm.{name}\n" in page("python/fbvm"), name


def test_each_instruction_is_listed() -> None:
    text = page("ladder")
    assert [row.mnemonic for row in instruction_set().rows.values() if row.code and f"({row.code})`" not in text] == []


def test_each_dialect_area_and_response_code_is_listed() -> None:
    assert [name for name in DIALECTS if f"- {name}: " not in page("dialects")] == []
    assert [area.name for area in AREAS.values() if f"| `{area.name}` | {area.title} (" not in page("memory")] == []
    values = [*etn21_codes.MEANING, *etn21_codes.ERRNO.values()]
    assert [f"{value:04X}" for value in values if f"| {value:04X} |" not in page("etn21")] == []


def test_words_of_the_system_are_listed() -> None:
    for address in ("A0", "A200.11", "A200.15", "A262 and A263", "A264 and A265", "A500.12", "CF113", "CF102"):
        assert f"| `{address}` |" in page("memory")


def test_each_library_shows_the_pins_of_its_blocks() -> None:
    names = module("libraries").names()
    assert len(names) == len(list((HOUSE / "fblib").rglob("library.toml")))
    shown = page("libraries/iec")
    assert "### TON\n" in shown
    assert re.search(r"PT\s+: TIME", shown)
    assert "### MTCP_ETN_Fn03\n" in page("libraries/omron-mtcp_etn")


def test_each_assumption_is_listed_with_its_place() -> None:
    text = pages()["explanation/assumed"]
    count = 0
    for path in (HOUSE / "tests").rglob("test_*.py"):
        for number, line in enumerate(path.read_text(encoding="utf-8").splitlines(), 1):
            if re.match(r"def test_\w+_assumed\(", line):
                count += 1
                assert f"(`{path.relative_to(HOUSE).as_posix()}:{number}`)" in text
    assert text.count("\n- ") == count > 50


def test_pages_are_written_if_they_changed_and_removed_if_they_are_gone(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    made = pages()
    product_pages = importlib.import_module("product_pages")
    monkeypatch.setattr(product_pages, "pages", lambda: made)
    product_pages.write(tmp_path)
    reference = tmp_path / "reference"
    path = reference / "memory.md"
    before = path.stat().st_mtime_ns
    (gone := reference / "diagnostics" / "S9999.md").write_text("# S9999 A code that is gone\n", encoding="utf-8")
    (written := reference / "index.md").write_text("# By people\n", encoding="utf-8")
    product_pages.write(tmp_path)
    assert path.stat().st_mtime_ns == before
    assert written.is_file() and not gone.exists()


def test_docstrings_become_what_sphinx_reads() -> None:
    lines = ["Reads `D100`, *named.", "", "    x = `1`", "", "    y", "", "After `it`.", ">>> ns('1s')", "1000000000"]
    module("python_api").reshape(lines)
    assert lines == ["Reads ``D100``, \\*named.", "", ".. code-block:: none", "", "    x = `1`", "", "    y", "", "After ``it``.",
                     ">>> ns('1s')", "1000000000"]  # fmt: skip


def test_links_of_a_file_lead_where_they_led() -> None:
    markdown = module("markdown")
    origin = HOUSE / "fblib" / "tianxing" / "mb_tcp_server" / "README.md"
    known = {HOUSE / "fblib" / "port" / "README.md": "reference/libraries/port"}
    text = "[port](../../port/README.md#slots), [license](../../../LICENSE), [web](https://example.org)"
    assert markdown.moved(text, origin, "reference/libraries/x", known) == (
        "[port](port.md#slots), [license](../../../LICENSE), [web](https://example.org)")  # fmt: skip


LONG = {"time"}
"""Pages that take half a second."""
EXPLAINED = [pytest.param(path, id=path.stem, marks=[pytest.mark.slow] * (path.stem in LONG))
             for path in sorted((HOUSE / "docs").rglob("*.md")) if ">>>" in path.read_text(encoding="utf-8")]  # fmt: skip


@pytest.mark.parametrize("path", EXPLAINED)
def test_what_a_page_shows_in_python_happens(path: Path) -> None:
    assert doctest.testfile(str(path), module_relative=False).failed == 0


@pytest.mark.parametrize("name", ["fbvm", *module_names()])
def test_what_a_docstring_shows_happens(name: str) -> None:
    """Docstrings of the public names of a module, wherever these live."""
    finder, runner = doctest.DocTestFinder(), doctest.DocTestRunner()
    public = importlib.import_module(name)
    for thing in {id(one): one for one in (getattr(public, each) for each in module_members(name))}.values():
        if getattr(thing, "__module__", "").startswith("fbvm"):
            home = importlib.import_module(thing.__module__)
            for case in finder.find(thing, module=home):
                runner.run(case)
    assert runner.summarize(verbose=False).failed == 0


def test_a_file_of_the_repository_that_a_page_names_is_there() -> None:
    named = {name for folder in ("decisions", "explanation") for path in (HOUSE / "docs" / folder).glob("*.md")
             for name in re.findall(r"`((?:fbvm|fblib|tests|grammar)/[\w./-]+)`", path.read_text(encoding="utf-8"))}  # fmt: skip
    assert sorted(name for name in named if not (HOUSE / name).exists()) == []
