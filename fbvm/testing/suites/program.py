"""The suites of a program, found without running it: instances of blocks that extend FB_TestSuite, and the names of their tests.

Source: TcUnit's user guide: a program declares its suites and calls RUN or RUN_IN_SEQUENCE; a test begins with TEST or
TEST_ORDERED."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

from fbvm.base.diagnostics import Source
from fbvm.base.types import fold
from fbvm.syntax import tree
from fbvm.syntax.parser import parse
from fbvm.syntax.tree.node import walk

BASE = "FB_TESTSUITE"
RUNS = ("RUN", "RUN_IN_SEQUENCE")
BEGINS = ("TEST", "TEST_ORDERED")
DISABLED = "disabled_"


@dataclass(frozen=True)
class FoundTest:
    """A test that a suite begins: its name, and where that is written; `skipped` if its name begins with `disabled_`."""

    name: str
    file: str
    line: int
    skipped: bool = False
    asserts: tuple[tuple[str, int], ...] = ()
    """The messages of its assertions, as far as they are literals, and their lines."""

    def line_of(self, failure: str) -> int | None:
        """The line of the assertion that has told of a failure; None if its message tells it not from others."""
        said = failure.rpartition(", MSG: ")[2] if ", MSG: " in failure else ""
        lines = [line for message, line in self.asserts if message.strip() == said.strip()]
        return lines[0] if len(lines) == 1 else None


@dataclass(frozen=True)
class FoundSuite:
    """An instance of a suite: its path in the program, its tests, and whether it has some whose names are no literals."""

    path: str
    tests: tuple[FoundTest, ...]
    has_others: bool


def find_suites(sources: Sequence[Source], libraries: Sequence[Source] = ()) -> list[FoundSuite]:
    """The suites that the programs of some sources run, in the order of declaration; none if no program runs any.

    Blocks of `libraries` may be suites, too, and what suites extend; their programs are not looked at."""
    declared, behind = _declarations(sources), _declarations(libraries)
    pous = {fold(node.name.text): (node, source) for node, source in (*behind, *declared) if isinstance(node, tree.Pou)}
    programs = [(node, source) for node, source in declared if isinstance(node, tree.Pou) and node.kind == "PROGRAM"]
    if not any(_called(call) in RUNS for node, _ in programs for call in _calls(node)):
        return []
    found = [_suite(f"{Path(source.name).stem}.{name}", block, pous) for node, source in declared
             if isinstance(node, tree.GlobalVars) for name, block in _instances(node.section)]  # fmt: skip
    found += [_suite(f"{node.name.text}.{name}", block, pous) for node, _ in programs for section in node.sections
              for name, block in _instances(section)]  # fmt: skip
    return [suite for suite in found if suite is not None]


def _declarations(sources: Sequence[Source]) -> list[tuple[tree.Declaration, Source]]:
    return [(node, source) for source in sources for node in parse(source)[0].declarations]


Pous = dict[str, tuple[tree.Pou, Source]]


def _instances(section: tree.VarSection) -> Iterator[tuple[str, str]]:
    """Name and folded type of each variable of a section that may be an instance."""
    for declared in section.variables:
        if isinstance(declared.spec, tree.NamedType):
            yield from ((name.text, _last(declared.spec.text)) for name in declared.names)


def _last(name: str) -> str:
    return fold(name.rpartition(".")[2])


def _suite(path: str, block: str, pous: Pous) -> FoundSuite | None:
    """The suite at a path, if its type is one."""
    lineage: list[tuple[tree.Pou, Source]] = []
    while block in pous and block != BASE and len(lineage) < len(pous):
        lineage.append(pous[block])
        bases = pous[block][0].bases
        block = _last(bases[0].text) if bases else ""
    if block != BASE or not lineage:
        return None
    tests: dict[str, FoundTest] = {}
    others = False
    for node, source in lineage:
        calls = sorted(_calls(node), key=lambda each: each.start)
        for position, call in enumerate(calls):
            if _called(call) not in BEGINS or not call.arguments:
                continue
            value = call.arguments[0].value
            if isinstance(value, tree.Literal) and isinstance(value.value, str):
                name, skipped = value.value.strip(), value.value.strip().lower().startswith(DISABLED)
                name = name[len(DISABLED):] if skipped else name
                tests.setdefault(name, FoundTest(name, source.name, source.place(call.start)[0], skipped,
                                                 tuple(_asserts(calls[position + 1:], source))))
            else:
                others = True
    return FoundSuite(path, tuple(tests.values()), others)


def _asserts(calls: Sequence[tree.Call], source: Source) -> Iterator[tuple[str, int]]:
    """Message and line of each assertion up to the next test."""
    for call in calls:
        if _called(call) in BEGINS:
            return
        if _called(call).startswith("ASSERT"):
            given = [each.value for each in call.arguments if each.name is None or fold(each.name.text) == "MESSAGE"]
            texts = [value.value for value in given if isinstance(value, tree.Literal) and isinstance(value.value, str)]
            yield texts[-1] if texts else "", source.place(call.start)[0]


def _calls(node: tree.Node) -> Iterator[tree.Call]:
    return (each for each in walk(node) if isinstance(each, tree.Call))


def _called(call: tree.Call) -> str:
    """The folded name of what is called, without the name of a library in front."""
    callee = call.callee
    if isinstance(callee, tree.Member) and isinstance(callee.of, tree.NameRef):
        return fold(callee.name.text)
    return fold(callee.text) if isinstance(callee, tree.NameRef) else ""
