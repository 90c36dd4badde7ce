"""What README and the pages under docs show is what happens; `docs_pages` says how blocks are written and run."""

from __future__ import annotations

import importlib.util
import re
import subprocess
import sys
import tomllib
from pathlib import Path

import click
import pytest
from click.testing import CliRunner
from docs_pages import HOUSE, NOT_RUN, Reader, blocks, is_made, is_slow, options_of, pages
from rows import each_of

from fbvm.cli.main import main

PAGES = [pytest.param(page, id=page.relative_to(HOUSE).as_posix(), marks=[pytest.mark.slow] if is_slow(page) else [])
         for page in pages()]  # fmt: skip
ALL = {page.relative_to(HOUSE).as_posix(): page.read_text(encoding="utf-8") for page in pages()}


@pytest.mark.parametrize("page", PAGES)
def test_the_page_shows_what_happens(page: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("COLUMNS", "80")
    Reader(page).read()


def test_few_blocks_are_not_run() -> None:
    left_out = {f"{page.relative_to(HOUSE)}:{block.line}": block.text.partition("\n")[0].removeprefix(NOT_RUN)
                for page in pages() for block in blocks(page) if not block.is_run}  # fmt: skip
    assert len(left_out) <= 5, left_out
    assert all(left_out.values())


@each_of("name", ALL)
def test_commands_and_options_exist(name: str) -> None:
    lines = [line for block in blocks(HOUSE / name) if block.language in ("sh", "console")
             for line in block.text.replace("\\\n", "").splitlines() if re.match(r"(\$ )?\S*fbvm ", line)]  # fmt: skip
    named = re.findall(r"`(fbvm [^`]+)`", re.sub(r"^(`{3,}).*?^\1", "", ALL[name], flags=re.M | re.S))
    assert [unknown for line in (*lines, *named) for unknown in options_of(line)] == []


@each_of("name", ALL)
def test_extras_exist(name: str) -> None:
    extras = tomllib.loads((HOUSE / "pyproject.toml").read_text(encoding="utf-8"))["project"]["optional-dependencies"]
    named = re.findall(r"pip install.*?\[([a-z,]+)\]", ALL[name])
    assert [extra for group in named for extra in group.split(",") if extra not in extras] == []


def anchors(page: Path) -> set[str]:
    """The anchors of a page: its headings, as GitHub and MyST write them."""
    text = re.sub(r"^(`{3,}).*?^\1", "", page.read_text(encoding="utf-8"), flags=re.M | re.S)
    headings = re.findall(r"^#+ (.*)$", text, re.M)
    return {re.sub(r"[^\w\- ]", "", heading.lower()).replace(" ", "-") for heading in headings}


@each_of("name", ALL)
def test_links_lead_somewhere(name: str) -> None:
    page = HOUSE / name
    text = re.sub(r"^(`{3,}).*?^\1|`[^`\n]*`", "", ALL[name], flags=re.M | re.S)
    wrong = []
    for link in re.findall(r"\]\(<?([^)>\s]+)>?\)", text):
        file, _, anchor = link.partition("#")
        if re.match(r"[a-z]+:", link):
            wrong += [link] if not re.fullmatch(r"https://[\w.-]+\.[a-z]+(/[\w./#~-]*)?", link) else []
        else:
            target = (page.parent / file).resolve() if file else page
            if target.is_relative_to(HOUSE / "docs") and is_made(target):
                continue  # the test that builds the pages looks whether they are there
            wrong += [] if target.exists() and (not anchor or anchor in anchors(target)) else [link]
    assert wrong == []


@pytest.mark.parametrize("folder", ["tutorials", "howto"])
def test_every_page_is_in_its_index(folder: str) -> None:
    index = ALL[f"docs/{folder}/index.md"]
    listed = re.search(r"^```{toctree}\n(?::.*\n)*\n(.*?)^```", index, re.M | re.S)
    assert listed
    stems = {path.stem for path in (HOUSE / "docs" / folder).glob("*.md")}
    assert sorted(listed[1].split()) == sorted(stems - {"index"})


def test_the_readme_is_short_and_names_every_verb() -> None:
    assert len(ALL["README.md"].splitlines()) <= 200
    assert [verb for verb in main.list_commands(click.Context(main)) if f"`fbvm {verb}" not in ALL["README.md"]] == []


def test_the_two_commands_of_the_readme_stand_on_their_lines() -> None:
    commands = re.findall(r"^python3 -m venv .*$", ALL["README.md"], re.M)
    assert [command.split(" && ")[1:] for command in commands] == [
        [".venv/bin/pip install -q -e '.[peer,live]'", ".venv/bin/fbvm demo"],
        [".venv/bin/pip install -q -e '.[test]'", ".venv/bin/python -m pytest -n auto"],
    ]
    pattern = re.search(r"sed -n 's/(.*?)/", (HOUSE / ".ci" / "run").read_text(encoding="utf-8"))
    assert pattern and re.findall(pattern[1].replace("\\(", "(").replace("\\)", ")"), ALL["README.md"], re.M) == commands[1:]


def test_workflows_run_what_is_run_here() -> None:
    shown = next(block for block in blocks(HOUSE / "docs" / "howto" / "ci.md") if block.file == ".github/workflows/test.yml")
    assert shown.text == (HOUSE / "examples" / "project" / ".github" / "workflows" / "test.yml").read_text(encoding="utf-8")
    for name, script in (("test", ".ci/run"), ("package", ".ci/package")):
        text = (HOUSE / ".github" / "workflows" / f"{name}.yml").read_text(encoding="utf-8")
        assert f"run: {script}" in text and (HOUSE / script).is_file()


def test_the_picture_is_the_run_of_the_demo(tmp_path: Path) -> None:
    signals = "CIO 1519.02,CIO 1509.15,CIO 1519.03,CIO 1509.02,CIO 1509.13,CIO 1519.04,D30001,Main.Step"
    trace, picture = str(tmp_path / "demo.fbtrace"), tmp_path / "demo.svg"
    for command in (["run", str(HOUSE / "examples" / "demo.st"), "--until", "Main.Done", "--map", "192.168.250.1:502=peer",
                     "--trace", trace], ["convert", trace, str(picture), signals]):  # fmt: skip
        assert CliRunner().invoke(main, command).exit_code == 0
    assert picture.read_text(encoding="utf-8") == (HOUSE / "docs" / "demo.svg").read_text(encoding="utf-8")


@pytest.mark.slow
def test_the_pages_are_built_without_a_warning(tmp_path: Path) -> None:
    if importlib.util.find_spec("sphinx") is None:
        pytest.skip("sphinx is not installed")
    done = subprocess.run([sys.executable, "-m", "sphinx", "-W", "--keep-going", "-q", "-d", tmp_path / "trees", HOUSE / "docs",
                           tmp_path / "site"], capture_output=True, text=True, check=False)  # fmt: skip
    assert done.returncode == 0, done.stdout + done.stderr
    site = tmp_path / "site"
    wrong = []
    for page in site.rglob("*.html"):
        for link in re.findall(r'(?:href|src)="([^"]*)"', page.read_text(encoding="utf-8")):
            file = link.partition("#")[0].partition("?")[0]
            if re.match(r"[a-z]+:|//", link):
                wrong += [] if re.match(r"https://|mailto:|data:", link) else [link]
            elif file and not (page.parent / file).exists():
                wrong.append(f"{page.relative_to(site)}: {link}")
    assert wrong == []
    code = (site / "reference" / "diagnostics" / "S0101.html").read_text(encoding="utf-8")
    assert re.findall(r'current-page"><a [^>]*href="([^"]*)">([^<]*)', code) == [("index.html", "Diagnostics")]
