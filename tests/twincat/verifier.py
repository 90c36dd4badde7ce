"""TcUnit and its verifier, in a folder that somebody has: whether they give the results here that they give in TwinCAT.

`python tests/twincat/verifier.py DIR [SCANS]`, where DIR holds `TcUnit` and `TcUnit-Verifier` of github.com/tcunit/TcUnit,
compiles both without a change, runs the tests in virtual time, and compares the messages with what the verifier's own
classes expect of TwinCAT (`TcUnit-Verifier_DotNet/**/FB_*.cs`): it prints each expectation that does not hold, and the
counts.  Nothing of TcUnit is part of this repository."""

from __future__ import annotations

import re
import sys
import time
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path

if __name__ == "__main__":
    sys.path[:0] = [str(Path(__file__).parents[2])]

from fbvm.code.compiler import compile_files
from fbvm.interchange.formats.given import inputs
from fbvm.machine.plc import Plc

LEVELS = {"High": 4, "Medium": 2, "Low": 1}
"""Levels of Visual Studio's error list, and the kinds of messages that TwinCAT shows there."""
SCANS = 20_000
BUDGET = 1 << 40
LAST = "| ======================================"
KEPT = 256
"""Messages that the log holds."""
_TOKEN = re.compile(r"""//[^\n]*|/\*.*?\*/|(?P<text>"(?:\\.|[^"\\])*")|(?P<word>[A-Za-z_][\w.]*)|(?P<number>\d+(?:\.\d+)?)|"""
                    r"(?P<sign>[-+*/(){}\[\],;=<>!&|?:$@%])", re.S)  # fmt: skip
Message = tuple[int, str]
"""Kind and text."""


def run(folder: Path, scans: int = SCANS) -> list[Message]:
    """The messages of the verifier's run, up to the last line of its statistics."""
    found = sorted(folder.rglob("*.plcproj"), key=lambda path: path.stem.lower() != "tcunit")
    sources, _ = inputs([path for path in found if path.stem.lower().startswith("tcunit")])
    made = compile_files(sources, dialect="twincat", runnable=True)
    if made.image is None:
        raise SystemExit("\n".join(message.render() for message in made.errors))
    plc = Plc(made.image, budget=BUDGET)
    messages: list[Message] = []
    for _ in range(scans):
        if trap := plc.scan():
            raise SystemExit(f"the program stopped: {trap}")
        for number in range(len(messages), plc.read("TwinCAT_LogCount")):
            at = f"TwinCAT_Log[{number % KEPT}]"
            messages.append((plc.read(f"{at}.Mask"), plc.read(f"{at}.Text")))
        if messages and messages[-1][1].startswith(LAST):
            break
    return messages


@dataclass
class Expectations:
    """What the classes of the verifier expect, checked against messages."""

    messages: list[Message]
    checked: int = 0
    broken: list[str] = field(default_factory=list)
    _values: dict[str, object] = field(default_factory=dict)

    def check(self, path: Path) -> None:
        """Check the statements of one class."""
        self._suite = path.stem.removeprefix("FB_")
        tokens = [match for match in _TOKEN.finditer(path.read_text(encoding="utf-8-sig")) if match.lastgroup]
        statement: list[str] = []
        for token in tokens:
            statement.append(token[0])
            if token[0] in ("{", "}") and statement[0] != "string" or token[0] == ";":
                self._statement(statement)
                statement = []

    def _statement(self, tokens: list[str]) -> None:
        if "=" in tokens:
            name, at = tokens[tokens.index("=") - 1], tokens.index("=") + 1
            self._values[name] = [*self._values_in(tokens[at:])] if "{" in tokens else next(self._values_in(tokens[at:]), None)
        elif tokens[0] in _RULES and len(tokens) > 2:
            self.checked += 1
            arguments = [*self._values_in(tokens[2:])]
            if not _RULES[tokens[0]](self, *arguments):
                self.broken.append(f"{self._suite}: {tokens[0]} {arguments}")

    def _values_in(self, tokens: list[str]) -> Iterator[object]:
        """The values of expressions between commas: texts and sums of texts, names, numbers, CreateFailedTestMessage."""
        value: object = None
        at = 0
        while at < len(tokens):
            token = tokens[at]
            if token.startswith("CreateFailedTest"):
                end = tokens.index(")", at)
                method, *rest = self._values_in(tokens[at + 2:end])
                labels = ("EXP", "ACT", "MSG")
                value = ", ".join([f"FAILED TEST 'PRG_TEST.{self._suite}@{method}'",
                                   *(f"{label}: {each}" for label, each in zip(labels, rest, strict=False))])
                at = end
            elif token in (",", ")", "}", ";") and value is not None:
                yield value
                value = None
            elif token.startswith('"'):
                value = ("" if value is None else str(value)) + token[1:-1].replace('\\"', '"').replace("\\\\", "\\")
            elif token == "_testFunctionBlockInstance":
                value = ("" if value is None else str(value)) + self._suite
            elif token in self._values:
                known = self._values[token]
                value = known if value is None else f"{value}{known}"
            elif token.rpartition(".")[2].startswith("vsBuildErrorLevel"):
                value = LEVELS[token.rpartition("vsBuildErrorLevel")[2]]
            elif re.fullmatch(r"\d+(\.\d+)?", token):
                value = float(token) if "." in token else int(token)
            at += 1

    def count(self, text: object, level: object) -> int:
        """How many messages of a level hold a text, whose %f stands for any number."""
        number = r"[+-]?(?:\d+(?:\.\d*)?(?:E[+-]?\d+)?|\.\d+(?:E[+-]?\d+)?)"
        pattern = re.compile(re.escape(str(text).upper()).replace("%F", number))
        return sum(kind == level and pattern.search(shown.upper()) is not None for kind, shown in self.messages)

    def result(self, name: str, block: str, status: str, asserts: int, seconds: float, within: float) -> bool:
        """Whether the lines of a test say that much."""
        shown = [text for _, text in self.messages]
        at = next((number for number, text in enumerate(shown) if f"| Test name={name}" in text), None)
        if at is None or f"| Test class name={block}" not in shown[at + 1]:
            return False
        found = re.search(r"Test status=(\w+), number of asserts=(\d+), duration=([\d.eE+-]+)", shown[at + 2])
        return found is not None and (found[1], int(found[2])) == (status, asserts) and \
            abs(float(found[3]) - seconds) <= within


def _lacks(expected: Expectations, *given: object) -> bool:
    *texts, level = given
    return not any(kind == level and all(str(text).upper() in shown.upper() for text in texts)
                   for kind, shown in expected.messages)


_RULES = {
    "AssertContainsMessage": lambda expected, text, level: expected.count(text, level) > 0,
    "AssertDoesNotContainMessage": _lacks,
    "AssertMessageCount": lambda expected, text, times, level: expected.count(text, level) == times,
    "AssertContainsAtLeastOneMessage": lambda expected, texts, level: any(expected.count(text, level) for text in texts),
    "AssertAtLeastOneMessageCount":
        lambda expected, texts, times, level: sum(expected.count(text, level) for text in texts) == times,
    "AssertContainsResultSet": lambda expected, *given: expected.result(*given),
}
"""By statement of the verifier's classes: whether what it says holds."""


def main(folder: Path, scans: int = SCANS) -> None:
    """Run, compare and print."""
    began = time.monotonic()
    messages = run(folder, scans)
    expected = Expectations(messages)
    for path in sorted(folder.rglob("FB_*.cs")):
        expected.check(path)
    for line in expected.broken:
        print(f"differs  {line}")
    program = next(path for path in folder.rglob("Program.cs"))
    failing = re.search(r"expectedNumberOfFailedTests = (\d+)", program.read_text(encoding="utf-8-sig"))
    print(f"{len(messages)} messages; {expected.checked} expectations, {len(expected.broken)} differ; "
          f"{next((text for _, text in messages if text.startswith('| Tests:')), 'no statistics')[2:]}, "
          f"{next((text for _, text in messages if 'Failed tests' in text), '')[2:]} "
          f"(TwinCAT: {failing[1] if failing else '?'}); {time.monotonic() - began:.1f} s")


if __name__ == "__main__":
    main(Path(sys.argv[1]), int(sys.argv[2]) if len(sys.argv) > 2 else SCANS)
