"""The language corpus: small programs that say in comments what is to come of them.

A file holds programs one after the other, each begun by a line `// ---- what it shows`.  Comments say what is expected:

    x := y;  // error S0301: part of the message     at the line that causes it, or of its hint; `warning` alike
    x := 1 / z;  // trap R0101                       at the line that stops the program
    // expect x = 5, q = TRUE                        values after the first scan
    // expect scan 3: a[2].b = 7                     values after another one
    // set scan 2: start = TRUE                      values written before a scan
    // cycle 10ms                                    how far a scan advances the time
    // dialect codesys                               whose answers are taken

A name is looked for in the program Main first, then among programs, globals and addresses.  A value is written as in a
program; INF, -INF and NAN are reals, the member of an enumeration is its name.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path

HERE = Path(__file__).parent
WORDS = ("error", "warning", "trap", "expect", "set", "cycle", "dialect")
_TEXT = r"""'(?:\$.|[^'$])*'|"(?:\$.|[^"$])*\""""
_COMMENT = re.compile(rf"//\s*({'|'.join(WORDS)})\b((?:{_TEXT}|(?!//).)*)")
_CODE = re.compile(r"\s*([SR]\d{4})\s*(?::\s*(.*?))?\s*")
_AT_SCAN = re.compile(r"(?:\s*scan\s+(\d+)\s*:)?(.*)", re.S)
_ITEM = re.compile(rf"((?:[^,\[\]'\"=]|\[[^\]]*\])+)=\s*((?:[^,\[\]'\"]|{_TEXT}|\[(?:{_TEXT}|[^\]])*\])+)(?:,|$)")
_SECONDS = {"ms": 1_000_000, "us": 1_000, "s": 1_000_000_000}


@dataclass(frozen=True)
class Message:
    """A diagnostic or a trap that is expected: its line in the file, its code, a part of its text."""

    line: int
    code: str
    part: str = ""

    def fits(self, line: int, code: str, text: str) -> bool:
        return (self.line, self.code) == (line, code) and self.part in text


@dataclass(frozen=True)
class Item:
    """One `name = value` and the scan and line that it belongs to."""

    scan: int
    name: str
    value: str
    line: int


@dataclass
class Program:
    """One program of the corpus.  `text` begins with as many empty lines as stand before it in its file."""

    path: Path
    line: int
    title: str
    text: str
    diagnostics: list[Message] = field(default_factory=list)
    trap: Message | None = None
    expected: list[Item] = field(default_factory=list)
    written: list[Item] = field(default_factory=list)
    cycle_ns: int = 10_000_000
    dialect: str = "standard"

    @property
    def name(self) -> str:
        return f"{self.path.parent.name}/{self.path.name}"

    @property
    def scans(self) -> int:
        return max((item.scan for item in (*self.expected, *self.written)), default=1)

    @property
    def runs(self) -> bool:
        """True if nothing but warnings is expected of the compiler."""
        return all(message.code >= "S0" and message.code[3] == "9" for message in self.diagnostics)


def programs(folder: Path = HERE) -> Iterator[Program]:
    """All programs below a folder.  Raises ValueError for an expectation that cannot be read."""
    for path in sorted(folder.glob("**/*.st")):
        yield from read(path)


def read(path: Path) -> Iterator[Program]:
    """The programs of one file."""
    lines = path.read_text("utf-8").splitlines()
    starts = [number for number, line in enumerate(lines) if line.startswith("// ----")]
    if not starts or any(line.strip() for line in lines[: starts[0]]):
        raise ValueError(f"{path}: a file begins with `// ---- what the first program shows`")
    for start, end in zip(starts, [*starts[1:], len(lines)], strict=True):
        text = "\n" * start + "\n".join(lines[start:end]) + "\n"
        program = Program(path, start + 1, lines[start][7:].strip(), text)
        for number in range(start, end):
            for match in _COMMENT.finditer(lines[number]):
                _take(program, match[1], match[2], number + 1)
        yield program


def _take(program: Program, word: str, rest: str, line: int) -> None:
    """Adds what one comment expects."""
    if word == "dialect":
        program.dialect = rest.strip()
    elif word == "cycle":
        match = re.fullmatch(r"\s*(\d+)\s*(ms|us|s)\s*", rest)
        if not match:
            raise ValueError(f"{program.path}:{line}: cycle takes a time such as 10ms")
        program.cycle_ns = int(match[1]) * _SECONDS[match[2]]
    elif word in ("expect", "set"):
        into = program.expected if word == "expect" else program.written
        into.extend(_items(program, rest, line))
    else:
        match = _CODE.fullmatch(rest)
        if not match or (word == "trap") != (match[1][0] == "R"):
            raise ValueError(f"{program.path}:{line}: {word} takes a code such as S0301 or R0101")
        message = Message(line, match[1], match[2] or "")
        if word != "trap":
            program.diagnostics.append(message)
        elif program.trap:
            raise ValueError(f"{program.path}:{line}: a program stops once")
        else:
            program.trap = message


def _items(program: Program, rest: str, line: int) -> Iterator[Item]:
    match = _AT_SCAN.fullmatch(rest)
    assert match
    text, at = match[2].strip(), 0
    while at < len(text):
        item = _ITEM.match(text, at)
        if not item:
            raise ValueError(f"{program.path}:{line}: cannot read {text[at:]!r}; write name = value, name = value")
        yield Item(int(match[1] or 1), item[1].strip(), item[2].strip(), line)
        at = item.end()
