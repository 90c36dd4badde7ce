"""The pages of the documentation as tests see them: what stands between three backquotes, and how it is run.

The blocks of a page are run from top to bottom in one empty folder.

- A block behind a line such as "`src/pump.st`:" is that file; it is written.  Programs among such files must compile,
  unless a command of the page shows what `fbvm check` says about them.
- ```console: each line that begins with `$ ` is run, and prints the lines behind it.  A line `...` stands for any number of
  lines; times such as `in 0.12s` may differ.  A command that ends in ` &` goes on until the end of the page; its `--port` is a
  free one, there and wherever the page names that port.
- ```python: executed, all blocks of a page in one namespace; a ```text block behind "It prints:" is what it prints.  One that
  begins with `>>> ` is a doctest.
- ```iecst: compiled, in the dialect with which the page runs the file.  What begins without a POU gets one, with the variables of
  the block before if it declares none.
- ```toml and ```yaml: read.
- ```sh: installs.  The extras of fbvm that are named exist.
- A block whose first line is `# not run by the tests: REASON` is not run; the options of its commands exist.
"""

from __future__ import annotations

import contextlib
import doctest
import importlib.util
import io
import os
import re
import shlex
import shutil
import socket
import subprocess
import sys
import time
import tomllib
from dataclasses import dataclass
from fnmatch import fnmatch
from pathlib import Path

import click
from click.testing import CliRunner

from fbvm.base.diagnostics import Source
from fbvm.cli.main import main
from fbvm.code.compiler import compile_sources

HOUSE = Path(__file__).resolve().parents[1]
NOT_RUN = "# not run by the tests: "
FENCE = re.compile(r"^(?P<fence>`{3,})(?P<language>[\w{}-]*)[^\n]*\n(?P<text>.*?)^(?P=fence)\s*$", re.M | re.S)
FILE = re.compile(r"^(?:.*\s)?`([\w./-]+\.\w+)`:$")
COMMAND = re.compile(r"^\$ ((?:.*\\\n)*.*)\n((?:(?!\$ ).*\n)*)", re.M)
INSTALLS = re.compile(r"(python3 -m venv|\. \.venv/|(\S*/)?pip install|cd |git clone|apt(-get)? install)")
PROCESSES = ("fbvm test", "fbvm mutate", "fbvm campaign", "fbvm demo", "--check", "--class", "python -m", " &")
"""What commands that start other programs have in them, or take seconds."""


@dataclass(frozen=True)
class Block:
    """What stands between backquotes: its language, its text, and the last line of text before it."""

    line: int
    language: str
    text: str
    before: str

    @property
    def file(self) -> str | None:
        """The name of the file that the block is, if it is one."""
        found = FILE.match(self.before)
        return found[1] if found else None

    @property
    def is_run(self) -> bool:
        return not self.text.startswith(NOT_RUN)

    @property
    def commands(self) -> list[tuple[str, str]]:
        """The commands of a console block with what they print."""
        return [(command.replace("\\\n", ""), output) for command, output in COMMAND.findall(self.text)]


def is_made(path: Path) -> bool:
    """Whether a page under docs is made when the documentation is built, as docs/.gitignore says."""
    rules, name, made = HOUSE / "docs" / ".gitignore", f"/{path.relative_to(HOUSE / 'docs').as_posix()}", False
    for line in rules.read_text(encoding="utf-8").splitlines() if rules.is_file() else ():
        if line.startswith(("/", "!")) and fnmatch(name, line.removeprefix("!")):
            made = line.startswith("/")
    return made


def pages() -> list[Path]:
    """README, and all pages under docs that people have written."""
    written = sorted(path for path in (HOUSE / "docs").glob("*/*.md") if not is_made(path))
    return [HOUSE / "README.md", HOUSE / "docs" / "index.md", *written]


def blocks(page: Path) -> list[Block]:
    """The blocks of a page, in their order."""
    text = page.read_text(encoding="utf-8")
    return [Block(text.count("\n", 0, found.start()) + 1, found["language"], found["text"],
                  text[: found.start()].rstrip().rpartition("\n")[2])
            for found in FENCE.finditer(text)]  # fmt: skip


LONG = {"bad-networks"}
"""Pages that take half a second."""


def is_slow(page: Path) -> bool:
    """Whether running the page starts other programs, or takes long."""
    if page.stem in LONG:
        return True
    shown = "\n".join(command for block in blocks(page) if block.language == "console" for command, _ in block.commands)
    return any(part in shown for part in PROCESSES)


def options_of(line: str) -> list[str]:
    """What a command line of fbvm names that fbvm does not know: its verb, or options of its verb."""
    words = re.split(r"\s+", line.partition("fbvm ")[2].partition(" | ")[0].partition(" && ")[0])
    verb = main.get_command(click.Context(main), words[0])
    if verb is None:
        return [words[0]] if re.fullmatch(r"[a-z]+", words[0]) else []
    if words[0] == "test":  # the others are pytest's
        return []
    known = {name for parameter in verb.params if isinstance(parameter, click.Option) for name in parameter.opts} | {"--help"}
    return [f"{words[0]} {word}" for word in words if word.startswith("--") and word.partition("=")[0] not in known]


class Reader:
    """Does what a reader of a page does, block by block, in the folder where it stands."""

    def __init__(self, page: Path) -> None:
        self.page, self.all = page, blocks(page)
        self.names: dict[str, object] = {"__name__": "page"}
        self.printed = ""
        self.declared = ""
        self.shown = "".join(block.text for block in self.all if block.language == "console")
        left_running = " ".join(re.findall(r"^\$ .* &$", self.shown, re.M))
        self.ports = {port: str(_free_port()) for port in re.findall(r"port (\d+)", left_running)}
        self.running: list[subprocess.Popen[bytes]] = []

    def read(self) -> None:
        """Run all blocks; AssertionError names the line of the page."""
        if "examples/" in self.page.read_text(encoding="utf-8"):
            shutil.copytree(HOUSE / "examples", "examples")
        try:
            for block in self.all:
                if block.is_run:
                    self._noted(block)
        finally:
            for process in self.running:
                process.terminate()
                process.wait(30)

    def _noted(self, block: Block) -> None:
        try:
            self._run(block)
        except Exception as wrong:
            wrong.add_note(f"{self.page.relative_to(HOUSE)}:{block.line}")
            raise

    def _run(self, block: Block) -> None:
        if block.file is not None:
            path = Path(block.file)
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_text(block.text, encoding="utf-8")
        if block.language == "console":
            for command, output in block.commands:
                printed = self._command(self._placed(command), len(output.splitlines()))
                compare(command, printed, self._placed(output))
        elif block.language == "iecst":
            self._compile(block)
        elif block.language == "python":
            self._python(block)
        elif block.language == "toml":
            tomllib.loads(block.text)
        elif block.language == "yaml" and importlib.util.find_spec("yaml") is not None:
            assert importlib.import_module("yaml").safe_load(block.text)
        elif block.language == "text" and block.before.endswith("It prints:"):
            compare("Python", self.printed, block.text)
        elif block.language == "sh":
            wrong = [line for line in block.text.splitlines() if line and not line.startswith("#") and not INSTALLS.match(line)]
            assert wrong == [], "commands that are run stand in ```console"

    def _placed(self, text: str) -> str:
        """The text with the ports that are free here."""
        for port, free in self.ports.items():
            text = re.sub(rf"\b{port}\b", free, text)
        return text

    def _command(self, line: str, lines: int) -> str:
        if line.endswith(" &"):
            return self._start(line.removesuffix(" &"), lines)
        if line.startswith("cd "):
            os.chdir(line.removeprefix("cd "))
            return ""
        fed = re.fullmatch(r"printf '(.*)' \| (fbvm .*)", line)
        command = fed[2] if fed else line
        if not command.startswith("fbvm ") or any(part in command for part in (*PROCESSES, "|", "&", "; ")):
            return _process(line)
        return CliRunner().invoke(main, shlex.split(command)[1:], input=fed[1].replace("\\n", "\n") if fed else None).output

    def _start(self, line: str, lines: int) -> str:
        """The first lines that a program prints, which then goes on."""
        log = Path(f"{len(self.running)}.log")
        command = [sys.executable, "-u", "-m", *shlex.split(line)]
        with log.open("wb") as out:
            self.running.append(subprocess.Popen(command, stdout=out, stderr=out))
        until = time.monotonic() + 30
        while log.read_text(encoding="utf-8").count("\n") < max(lines, 1) and time.monotonic() < until:
            time.sleep(0.05)
        return log.read_text(encoding="utf-8")

    def _compile(self, block: Block) -> None:
        if block.file is not None and f"{Path(block.file).name}:" in self.shown and "error S" in self.shown:
            return
        if block.file is not None and Path(block.file).name.startswith("test_"):
            assert "fbvm test" in self.shown, "tests in ST are run by fbvm test"
            return
        text = block.text
        bare = re.sub(r"^\s*(//.*\n|\(\*.*?\*\)\s*|\{.*?\}\s*)*", "", text)
        if not re.match(r"(PROGRAM|FUNCTION(_BLOCK)?|TYPE|CONFIGURATION|VAR_GLOBAL|CLASS|INTERFACE|NAMESPACE|USING)\b", bare):
            text = f"PROGRAM Main\n{'' if bare.startswith('VAR') else self.declared}{text}\nEND_PROGRAM\n"
        self.declared = "".join(re.findall(r"^VAR\b.*?^END_VAR\n", text, re.M | re.S))
        beside = [Source(str(path), other) for path in Path().rglob("*.st") if not path.is_relative_to("examples")
                  if "PROGRAM" not in (other := path.read_text(encoding="utf-8"))]  # fmt: skip
        alone = block.file is None or "PROGRAM" not in text
        chosen = re.search(rf"{re.escape(block.file)} --dialect (\w+)", self.shown) if block.file is not None else None
        found = compile_sources([Source(block.file or "block", text), *([] if alone else beside)],
                                dialect=chosen[1] if chosen else "standard")
        assert found.errors == [], "\n".join(each.render() for each in found.errors)

    def _python(self, block: Block) -> None:
        if block.text.startswith(">>> "):
            example = doctest.DocTestParser().get_doctest(block.text, self.names, self.page.name, str(self.page), block.line)
            with contextlib.redirect_stdout(io.StringIO()) as printed:
                failed = doctest.DocTestRunner(optionflags=doctest.ELLIPSIS).run(example, clear_globs=False).failed
            assert not failed, printed.getvalue()
            return
        code = compile(block.text, f"{self.page}:{block.line}", "exec")
        if block.file is not None:
            return
        with contextlib.redirect_stdout(io.StringIO()) as printed:
            exec(code, self.names)
        self.printed = printed.getvalue()


def _free_port() -> int:
    with socket.create_server(("127.0.0.1", 0)) as listening:
        return int(listening.getsockname()[1])


def _process(line: str) -> str:
    """What a shell prints that does a line, where `fbvm` and `python` are those that run this."""
    kept = {name: value for name, value in os.environ.items() if not name.startswith("PYTEST") and name != "CI"}
    path = f"{Path(sys.executable).parent}{os.pathsep}{kept['PATH']}"
    done = subprocess.run(["bash", "-c", line], env=kept | {"PATH": path, "COLUMNS": "80"}, stdout=subprocess.PIPE,
                          stderr=subprocess.STDOUT, text=True, check=False, timeout=120)  # fmt: skip
    return done.stdout


def _settled(text: str) -> list[str]:
    """Lines without what differs from run to run: times of the host, white space at their ends."""
    return [re.sub(r"\bin \d+\.\d+s\b", "in 0.1s", line).rstrip() for line in text.rstrip().splitlines()]


def compare(command: str, printed: str, shown: str) -> None:
    """Whether a command printed what the page shows; raises AssertionError with both if not."""
    parts = [re.escape(line) + "\n" if line != "..." else "(?:.*\n)*?" for line in _settled(shown)]
    got = "".join(line + "\n" for line in _settled(printed))
    assert re.fullmatch("".join(parts), got), f"$ {command}\n{got}--- the page shows\n{shown}"
