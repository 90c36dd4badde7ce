"""What a PLCopen document holds, as values: types, variables, POUs with their bodies, configurations.

Types, values and expressions are text of Structured Text by then; bodies are still elements of XML.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from functools import cached_property

from fbvm.base.diagnostics import Diagnostic, Source
from fbvm.interchange.markup import Element
from fbvm.interchange.plcopen.read.producer import NETWORK, Producer


@dataclass
class Reading:
    """The import of one document: its source, and the diagnostics so far; `where` names the POU at work."""

    source: Source
    producer: Producer = field(default=Producer("", NETWORK, ""))
    diagnostics: list[Diagnostic] = field(default_factory=list)
    where: str = ""
    counted: dict[str, tuple[Element, int]] = field(default_factory=dict)
    """What is left out in many places and not needed to run -> the first place, and how often."""
    beside: Mapping[str, Variable] = field(default_factory=dict)
    """Variables that other files of the project declare, by name in capitals."""

    def report(self, code: str, at: Element, message: str, hint: str = "") -> None:
        """A message about an element."""
        parts = [f"POU {self.where}"] if self.where else []
        if number := at.get("localId"):
            parts.append(f"{at.name} {number}")
        text = f"{', '.join(parts)}: {message}" if parts else message
        self.diagnostics.append(Diagnostic(code, self.source, at.at, at.at + 1 + len(at.name), text, hint))

    def count(self, what: str, at: Element) -> None:
        """Count something that is left out and not needed to run."""
        first, times = self.counted.get(what, (at, 0))
        self.counted[what] = first, times + 1

    def close(self) -> None:
        """Report what was counted, one message for each kind."""
        for what, (first, times) in self.counted.items():
            again = f" ({times} times, here for the first)" if times > 1 else ""
            self.diagnostics.append(Diagnostic("X0190", self.source, first.at, first.at + 1 + len(first.name), what + again))


@dataclass(frozen=True)
class Variable:
    """One variable; `note` is its documentation."""

    name: str
    type: str
    initial: str = ""
    address: str = ""
    note: str = ""


@dataclass(frozen=True)
class VarList:
    """A section: `kind` as in VAR_INPUT; `name` is that of a list of globals."""

    kind: str
    qualifiers: tuple[str, ...]
    variables: tuple[Variable, ...]
    name: str = ""
    attributes: tuple[str, ...] = ()
    """Pragmas that stand in front of it."""


@dataclass(frozen=True)
class Body:
    """A body and the element of its language: ST, IL, LD, FBD, SFC or CFC."""

    language: str
    element: Element


@dataclass(frozen=True)
class Head:
    """Of a POU the words in front of its name, what it extends and implements, and the pragmas in front of it."""

    words: tuple[str, ...] = ()
    extends: tuple[str, ...] = ()
    implements: tuple[str, ...] = ()
    attributes: tuple[str, ...] = ()


@dataclass(frozen=True)
class Pou:
    """A POU; `actions` and `transitions` by their names."""

    kind: str
    name: str
    result: str
    lists: tuple[VarList, ...]
    body: Body | None
    actions: tuple[tuple[str, Body], ...]
    transitions: tuple[tuple[str, Body], ...]
    note: str
    element: Element
    head: Head = field(default_factory=Head)
    """What CODESYS keeps of its head in addData."""
    members: tuple[Pou, ...] = ()
    """Its METHODs and PROPERTYs; of a property its accessors, of the kinds GET and SET."""

    def variable(self, name: str) -> Variable | None:
        """The variable of that name, whatever its case."""
        for listed in self.lists:
            for variable in listed.variables:
                if variable.name.casefold() == name.casefold():
                    return variable
        return None


@dataclass(frozen=True)
class DataType:
    """A user's type: `text` is what stands behind `name :`."""

    name: str
    text: str
    initial: str
    note: str
    extends: tuple[str, ...] = ()
    attributes: tuple[str, ...] = ()


@dataclass(frozen=True)
class Task:
    """A task: times and names as they are to be written, "" where there is none."""

    name: str
    interval: str
    single: str
    priority: str


@dataclass(frozen=True)
class Instance:
    """A program that runs; `task` "" for one that runs freely."""

    name: str
    type: str
    task: str


@dataclass(frozen=True)
class Resource:
    """A resource with all that is in it."""

    name: str
    globals: tuple[VarList, ...]
    tasks: tuple[Task, ...]
    instances: tuple[Instance, ...]


@dataclass(frozen=True)
class Configuration:
    """A configuration with its resources."""

    name: str
    globals: tuple[VarList, ...]
    resources: tuple[Resource, ...]
    accesses: tuple[str, ...] = ()
    """The lines of its VAR_ACCESS."""
    settings: tuple[str, ...] = ()
    """The lines of its VAR_CONFIG."""


@dataclass(frozen=True)
class Document:
    """All of it, in the order of writing; `globals` are lists that stand outside of configurations."""

    types: tuple[DataType, ...]
    pous: tuple[Pou, ...]
    globals: tuple[VarList, ...]
    configurations: tuple[Configuration, ...]

    @cached_property
    def pous_by_name(self) -> dict[str, Pou]:
        """The POUs by their names in capitals."""
        return {pou.name.upper(): pou for pou in self.pous}

    @cached_property
    def globals_by_name(self) -> dict[str, Variable]:
        """All global variables by their names in capitals, the first of each name."""
        found: dict[str, Variable] = {}
        for lists in self._global_lists():
            for variable in (variable for listed in lists for variable in listed.variables):
                found.setdefault(variable.name.upper(), variable)
        return found

    def _global_lists(self) -> Iterator[tuple[VarList, ...]]:
        yield self.globals
        for configuration in self.configurations:
            yield configuration.globals
            for resource in configuration.resources:
                yield resource.globals
